"""What stands around the parser: chunks, tokens, live expressions, completeness, dumps, walks, the cache of tables."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from syntax_samples import SAMPLES

from potto.source import Span
from potto.syntax import (
    RESERVED,
    completeness,
    dump_tree,
    live_expressions,
    node_at,
    parse_chunk,
    parse_tables,
    split,
    tokenize,
)
from potto.syntax.nodes import Apply, Definition, Name


class TestChunks:
    def chunks(self, text: str) -> list[str]:
        return [chunk.text for chunk in split(text)]

    def test_a_chunk_starts_in_the_first_column(self) -> None:
        assert self.chunks("x = (1,\n 2)\ny = (\nz = 3\n") == ["x = (1,\n 2)", "y = (", "z = 3"]

    def test_blank_lines_belong_to_no_chunk(self) -> None:
        assert [(c.start, c.text) for c in split("\n\nx = 1\n\n  \ny = 2\n\n")] == [(2, "x = 1"), (12, "y = 2")]

    def test_comments_directly_above_belong_to_a_definition(self) -> None:
        assert self.chunks("# a\n\n# b\n# c\nx = 1\n# d\n") == ["# a", "# b\n# c\nx = 1", "# d"]

    def test_comments_within_a_definition(self) -> None:
        assert self.chunks("def f(x)\n    y = x\n# c\n\n# d\n    y\nz = 1") == [
            "def f(x)\n    y = x\n# c\n\n# d\n    y",
            "z = 1",
        ]

    def test_a_closing_bracket_starts_nothing(self) -> None:
        assert self.chunks("x = [\n  1,\n]\ny = 2") == ["x = [\n  1,\n]", "y = 2"]

    @pytest.mark.parametrize("name", SAMPLES)
    def test_chunks_cover_all_that_is_written(self, name: str) -> None:
        text = SAMPLES[name]
        rest = list(text)
        for chunk in split(text):
            assert text[chunk.start : chunk.start + len(chunk.text)] == chunk.text
            rest[chunk.start : chunk.start + len(chunk.text)] = [" "] * len(chunk.text)
        assert "".join(rest).strip() == ""


def test_tokens_stand_where_they_say() -> None:
    for text in SAMPLES.values():
        found = tokenize(text)
        assert all(text[token.start : token.end] == token.text for token in found)
        assert [token.start for token in found] == sorted(token.start for token in found)


def test_d_is_a_word_only_after_an_integral() -> None:
    kinds = [token.kind for token in tokenize("x = d + integral [0, 1] d d(d)") if token.text == "d"]
    assert kinds == ["NAME", "NAME", "D", "NAME"]


def test_live_expressions() -> None:
    text = "x = 1\n#> x + 1\n#= 2\n    #>y  \n# > no\n#>\n#> z\n# other\n#= 3\r\n"
    found = live_expressions(text)
    assert [(live.text, live.expected) for live in found] == [("x + 1", "2"), ("y", None), ("z", None)]
    for live in found:
        assert text[live.text_span.start : live.text_span.end] == live.text
        assert text[live.span.start : live.span.start + 2] == "#>"
    assert found[0].expected_span is not None
    assert text[found[0].expected_span.start : found[0].expected_span.end] == "2"


@pytest.mark.parametrize(
    ("text", "state"),
    [
        ("", "complete"),
        ("# c", "complete"),
        ("x = 1", "complete"),
        ("x = 1\ny = 2", "complete"),
        ("f(x)", "complete"),
        ("x = 1 +", "incomplete"),
        ("x =", "incomplete"),
        ("x = (1,", "incomplete"),
        ("x = [1, 2", "incomplete"),
        ("def f(x)", "incomplete"),
        ("def f(x):", "incomplete"),
        ("def f(x", "incomplete"),
        ("def f(x)\n    y = x", "incomplete"),
        ("def f(x)\n    y", "complete"),
        ("for v in [1, 2]:", "incomplete"),
        ("for v in [1, 2]:\n    print(v)", "complete"),
        ("if p then", "incomplete"),
        ("if p then 1", "incomplete"),
        ("let a = 1", "incomplete"),
        ("integral [0, 1]", "incomplete"),
        ("integral [0, 1] x", "incomplete"),
        ("from m import", "incomplete"),
        ("from m import a,", "complete"),
        (r"\x .", "incomplete"),
        ("diffeo f(x, y) =", "incomplete"),
        ("x = )", "wrong"),
        ("x = (1]", "wrong"),
        ("x = 1 $", "wrong"),
        ("x = 2y", "wrong"),
        ("x = a b = c", "wrong"),
        ("x = (1\ny = 2", "wrong"),
        ("def f(x, x) x", "wrong"),
        ("x = (1 +) + (", "wrong"),
        ("def f(x)\n    x + 1\n    y = x", "wrong"),
    ],
)
def test_completeness(text: str, state: str) -> None:
    assert completeness(text) == state


def test_dump() -> None:
    parsed = parse_chunk("f = a - 2")
    assert parsed.item is not None
    assert dump_tree(parsed.item).split("\n") == [
        "Definition [0, 9) name='f' keyword=False",
        "  Chain [4, 9)",
        "    Name [4, 5) id='a'",
        "    Operand [6, 9) op='-'",
        "      Number [8, 9) text='2' value=2.0",
    ]


def test_node_at() -> None:
    parsed = parse_chunk("f = g(a + b)")
    assert parsed.item is not None
    path = node_at(parsed.item, 10)
    assert isinstance(path[0], Definition)
    assert isinstance(path[1], Apply)
    assert path[-1] == Name(Span(10, 11), "b")
    assert node_at(parsed.item, 40) == ()


_CONFLICTS = ("ADJACENT", "BINOP", "LPAR", "LSQB", "MEMBER", "NAME", "QMARK", "SIGN", "STAR")


class TestTables:
    def test_those_of_the_file_are_those_of_the_grammar(self) -> None:
        """If this fails: `make tables`. lark numbers states in an order of its own each time, so one
        automaton is walked beside the other."""
        written, computed = parse_tables.written(), parse_tables.compute(parse_tables.grammar_text())
        assert written is not None and written.starts.keys() == computed.starts.keys()
        beside = {written.starts[name]: computed.starts[name] for name in parse_tables.STARTS}
        waiting = list(beside)
        for state in waiting:
            row, other = written.rows[state], computed.rows[beside[state]]
            assert row.keys() == other.keys()
            for symbol, action in row.items():
                if action < 0:
                    assert written.rules[~action] == computed.rules[~other[symbol]]
                elif action not in beside:
                    beside[action] = other[symbol]
                    waiting.append(action)
                assert action < 0 or beside[action] == other[symbol]
        assert {written.ends[name]: computed.ends[name] for name in parse_tables.STARTS}.items() <= beside.items()

    def test_a_grammar_that_was_changed_is_computed_again(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        grammar = parse_tables.grammar_text()
        monkeypatch.setattr(parse_tables, "FILE", tmp_path / "parse_tables.json")
        parse_tables.write()
        assert parse_tables.written() is not None
        monkeypatch.setattr(parse_tables, "grammar_text", lambda: grammar + "\n")
        assert parse_tables.written() is None and parse_tables.tables.__wrapped__().starts

    def test_no_conflicts_but_the_known_ones(self, caplog: pytest.LogCaptureFixture) -> None:
        import logging

        from lark import logger

        with caplog.at_level(logging.DEBUG, logger.name):
            parse_tables.lark_parser(parse_tables.grammar_text())
        # Operators and `?` after an open-ended form go into it; a bracket after a type or a group belongs to it, a
        # type after the size of an array, and a bracket to what it stands directly behind.
        conflicts = {str(record.args) for record in caplog.records if "conflict" in str(record.msg)}
        assert conflicts == {f"('{kind}',)" for kind in _CONFLICTS}


def test_the_programs_of_the_grammar_page_parse() -> None:
    page = Path(__file__).parents[2] / "docs" / "grammar.md"
    programs = re.findall(r"```potto\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    assert programs
    for program in programs:
        for chunk in split(program):
            assert parse_chunk(chunk.text).diagnostics == ()


def test_the_reserved_words_are_those_of_the_grammar_page() -> None:
    page = (Path(__file__).parents[2] / "docs" / "grammar.md").read_text(encoding="utf-8")
    listed = re.search(r"Reserved: `([^`]*)`", page)
    assert listed is not None
    assert set(listed[1].split()) == RESERVED
