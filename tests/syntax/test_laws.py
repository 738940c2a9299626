"""Laws over random trees and random damage: printing, formatting and repair, and our automaton against lark's own."""

from __future__ import annotations

import random
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from syntax_samples import SAMPLES
from syntax_trees import expressions, items

from potto.syntax import (
    RESERVED,
    format_source,
    parse_chunk,
    parse_expression,
    print_expression,
    print_item,
    split,
    tokenize,
)
from potto.syntax.automaton import Automaton
from potto.syntax.groups import Context
from potto.syntax.lexer import lex
from potto.syntax.nodes import Paren
from potto.syntax.parse_tables import grammar_text, lark_parser
from potto.syntax.walk import without_spans

LAW = settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def bare(tree: Any) -> Any:
    """A tree without spans and parentheses."""
    if isinstance(tree, Paren):
        return bare(tree.inner)
    if isinstance(tree, tuple):
        return tuple(bare(item) for item in tree)
    if not hasattr(type(tree), "__match_args__"):
        return tree
    return type(tree)(*(bare(getattr(tree, name)) for name in type(tree).__match_args__))


@LAW
@given(tree=expressions)
def test_printing_reads_back_as_the_same_expression(tree: Any) -> None:
    text = print_expression(tree)
    parsed = parse_expression(text)
    assert parsed.diagnostics == (), text
    assert bare(without_spans(parsed.expr)) == bare(tree), text


@LAW
@given(tree=items)
def test_printing_reads_back_as_the_same_item(tree: Any) -> None:
    text = print_item(tree)
    (chunk,) = split(text)
    parsed = parse_chunk(chunk.text)
    assert parsed.diagnostics == (), text
    assert bare(without_spans(parsed.item)) == bare(tree), text


@LAW
@given(tree=items, seed=st.integers(0, 2**16))
def test_formatting_keeps_the_tree_and_is_idempotent(tree: Any, seed: int) -> None:
    text = ruffled(print_item(tree), random.Random(seed))
    before = parse_chunk(text)
    if before.diagnostics:
        return
    formatted = format_source(text)
    (chunk,) = split(formatted)
    after = parse_chunk(chunk.text)
    assert after.diagnostics == ()
    assert without_spans(after.item) == without_spans(before.item), formatted
    assert sorted(c.text for c in after.comments) == sorted(c.text for c in before.comments)
    assert format_source(formatted) == formatted


def ruffled(text: str, rng: random.Random) -> str:
    """A text with other blanks, line breaks and comments within its brackets, to be put in order again."""
    out, last, depth = [], 0, 0
    for token in tokenize(text):
        gap = text[last : token.start]
        if depth and "\n" not in gap:
            gap = rng.choice([gap, gap, gap, gap + "  ", gap + "\n  ", f"{gap} # why {len(out)}\n "])
        out += [gap, token.text]
        depth += (token.kind in ("LPAR", "LSQB")) - (token.kind in ("RPAR", "RSQB"))
        last = token.end
    return "".join(out)


@pytest.mark.parametrize("name", SAMPLES)
def test_formatting_the_samples(name: str) -> None:
    text, diffeo = SAMPLES[name], name.endswith(".diffeo")
    formatted = format_source(text, diffeo)
    assert format_source(formatted, diffeo) == formatted
    assert [c.text for c in tokenize(text, diffeo)] == [c.text for c in tokenize(formatted, diffeo)]
    trees = [without_spans(parse_chunk(chunk.text, diffeo).item) for chunk in split(text)]
    assert trees == [without_spans(parse_chunk(chunk.text, diffeo).item) for chunk in split(formatted)]


@LAW
@given(text=st.text(alphabet="abd x12.,;:()[]=+-*/^<>?\\~#\n\t λ∫\r", max_size=60))
def test_any_text_has_a_tree_and_a_format(text: str) -> None:
    for chunk in split(text):
        parsed = parse_chunk(chunk.text)
        assert parsed.item is not None or parsed.comments or parsed.diagnostics
        for diagnostic in parsed.diagnostics:
            assert 0 <= diagnostic.span.start <= diagnostic.span.end <= len(chunk.text)
    formatted = format_source(text)
    assert format_source(formatted) == formatted


WORDS = [*"()[],.:=+*-^<12?;~x", *sorted(RESERVED), "..", "d(x)", "f", "2.5", "\\", "\n   "]


@LAW
@given(words=st.lists(st.sampled_from(WORDS), max_size=25))
def test_any_words_have_a_tree(words: list[str]) -> None:
    for chunk in split(" ".join(words).lstrip()):
        parsed = parse_chunk(chunk.text)
        assert parsed.item is not None or parsed.diagnostics


class TestAgainstLark:
    """Our driver accepts what lark's own parser accepts, over the same tables' grammar."""

    parser = lark_parser(grammar_text())

    def accepts(self, tokens: list[Any]) -> bool:
        from lark.exceptions import UnexpectedToken

        try:
            self.parser.parse([(t.kind, t.text, t.start) for t in tokens if t.kind != "$END"], start="chunk")
        except UnexpectedToken:
            return False
        return True

    def ours(self, tokens: list[Any]) -> bool:
        return Automaton(Context("", False), "chunk").run(tokens, 0) == len(tokens)

    @pytest.mark.parametrize("name", SAMPLES)
    def test_samples_and_what_is_left_of_them(self, name: str) -> None:
        rng = random.Random(7)
        for chunk in split(SAMPLES[name]):
            tokens = lex(chunk.text, name.endswith(".diffeo")).tokens
            assert self.accepts(tokens) and self.ours(tokens)
            for _ in range(10):
                index = rng.randrange(len(tokens) - 1)
                fewer = tokens[:index] + tokens[index + 1 :]
                assert self.accepts(fewer) == self.ours(fewer)


def chunk_starts(text: str) -> list[int]:
    """Where chunks start, line by line."""
    starts: list[int] = []
    comments: list[int] = []
    adjacent, at = False, 0
    lines = ("\n" + text[1:] if text.startswith("\ufeff") else text).replace("\r\n", " \n").replace("\r", "\n")
    for line in lines.split("\n"):
        code = line.lstrip("\f")
        first = code[:1].strip()
        if not line.strip():
            adjacent = False
        elif first == "#":
            comments += [] if adjacent else [at]
            adjacent = True
        elif starts and (not first or first in ")]"):
            comments, adjacent = [], False
        else:
            starts += comments if adjacent else [*comments, at]
            comments, adjacent = [], False
        at += len(line) + 1
    return starts + comments


PIECES = ["\ufeff", "#", "x", "def f", "\n", "\n\n", " ", "    y", "\t", ")", "]", "\f", "\r", "\r\n", "# c\n"]


def test_chunks_start_where_a_walk_over_the_lines_says() -> None:
    rng = random.Random(1)
    for _ in range(20_000):
        text = "".join(rng.choice(PIECES) for _ in range(rng.randrange(12)))
        assert [chunk.start for chunk in split(text)] == chunk_starts(text), text
