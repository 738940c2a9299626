"""Text that no author means: binary data, enormous lines, hopeless nesting, odd line ends. Never an exception, fast."""

from __future__ import annotations

import inspect
import itertools
import sys
import time
from collections.abc import Callable

import pytest
from syntax_help import everything, messages
from syntax_samples import CONSTRUCTS, SAMPLES

from potto.source import SourceText
from potto.syntax import (
    completeness,
    dump_tree,
    format_source,
    parse_chunk,
    parse_expression,
    print_item,
    split,
    tokenize,
)
from potto.syntax.nodes import BrokenItem, Definition, ErrorExpr
from potto.syntax.walk import deeper_than, walk

SECONDS = 5.0
"""Generous: these take less than a second each; a quadratic step would take half a minute and more."""

ENORMOUS: dict[str, Callable[[], str]] = {
    "one line of 10 MB": lambda: "x = " + "a + " * 2_500_000,
    "one word of 10 MB": lambda: "a" * 10_000_000,
    "10 MB of blanks": lambda: " " * 10_000_000,
    "10 MB of blanks after a name": lambda: "x" + " " * 10_000_000,
    "10 MB of empty lines": lambda: "\n" * 10_000_000,
    "32 kB sum": lambda: "x = " + "a + " * 8_000 + "a",
    "4,000 open brackets": lambda: "x = " + "(" * 4_000,
    "4,000 nested brackets": lambda: "x = " + "(" * 4_000 + "1" + ")" * 4_000,
    "12,000 closing brackets": lambda: "x = 1" + ")" * 12_000,
    "12,000 wrong brackets": lambda: "x = " + "(]" * 12_000,
    "12,000 signs": lambda: "x = " + "-" * 12_000 + "1",
    "6,000 powers": lambda: "x = " + "2^" * 6_000 + "2",
    "2,000 ifs": lambda: "x = " + "if a then b else " * 2_000 + "c",
    "3,200 lambdas": lambda: "x = " + r"\a . " * 3_200 + "a",
    "2,000 lets": lambda: "x = " + "let a = 1 in " * 2_000 + "a",
    "2,000 integrals without end": lambda: "x = " + "integral [0, 1] " * 2_000,
    "1,600 integrals and brackets": lambda: "x = " + "integral [0, 1] (x) " * 1_600,
    "2,000 sums without a body": lambda: "x = " + "sum i in 1..2 " * 2_000,
    "12,000 ranges": lambda: "x = sum i in " + "1.." * 12_000,
    "12,000 arguments": lambda: "x = f " + "a " * 12_000,
    "16,000 unknown characters": lambda: "x = " + "$@" * 8_000,
    "12,000 commas": lambda: "x = [" + "," * 12_000 + "]",
    "12,000 equals signs": lambda: "x " + "= " * 12_000,
    "8,000 keywords": lambda: "x = " + "then " * 8_000,
    "12,000 quotes": lambda: "x = " + "'" * 12_000,
    "digits": lambda: "x = " + "1" * 96_000,
    "a number with many points": lambda: "x = " + "1." * 48_000,
    "12,000 brackets on lines of their own": lambda: "(\n" * 12_000,
    "one bracket over 20,000 lines": lambda: "x = [" + "\n1," * 20_000 + "]\n",
    "24,000 comments": lambda: "# c\n" * 24_000,
    "40,000 definitions": lambda: "x = 1\n" * 40_000,
    "lines of ever less indentation": lambda: "for v in xs\n" + "".join(f"{' ' * (300 - i)}a\n" for i in range(299)),
    "600 open loops": lambda: "".join(" " * i + "for v in xs\n" for i in range(600)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ENORMOUS)
def test_enormous_input_is_read_in_linear_time(name: str) -> None:
    text = ENORMOUS[name]()
    before = time.process_time()
    for chunk in itertools.islice(split(text), 100):
        parse_chunk(chunk.text)
    completeness(text[:100_000])
    assert time.process_time() - before < SECONDS


@pytest.mark.parametrize(
    "name",
    ["4,000 nested brackets", "12,000 signs", "6,000 powers", "2,000 ifs", "3,200 lambdas", "12,000 arguments"],
)
def test_nested_too_deeply(name: str) -> None:
    parsed = parse_chunk(ENORMOUS[name]())
    assert [d.code for d in parsed.diagnostics] == ["P0114"]
    assert parsed.diagnostics[0].message == "this is nested too deeply"
    assert isinstance(parsed.item, Definition)
    assert isinstance(parsed.item.body, ErrorExpr)
    assert parsed.item.name == "x"


@pytest.mark.parametrize(
    "before", ["(", "f(", "[1, ", "f(a=", "1 + 2*(", "-", "2^", "if p then 1 else ", r"\a . ", "let a = 1 in "]
)
def test_nested_as_deeply_as_is_allowed(before: str) -> None:
    """Everything that walks a tree bears the deepest one, with room for the frames of those who call it."""
    after = {"(": ")", "[": "]"}.get(next((c for c in before if c in "(["), ""), "")
    for levels in range(98, 20, -1):
        text = "x = " + before * levels + "1" + after * levels
        parsed = parse_chunk(text)
        if not parsed.diagnostics:
            break
    assert parsed.item is not None
    assert deeper_than(parsed.item, 100) is None
    limit = sys.getrecursionlimit()
    try:
        sys.setrecursionlimit(len(inspect.stack(0)) + 750)
        assert parse_chunk(print_item(parsed.item)).diagnostics == ()
        assert format_source(format_source(text)) == format_source(text)
        assert dump_tree(parsed.item)
        assert hash(parsed.item) == hash(parse_chunk(text).item)
        assert parsed.item == parse_chunk(text).item
    finally:
        sys.setrecursionlimit(limit)


def test_too_long() -> None:
    parsed = parse_chunk(ENORMOUS["one line of 10 MB"]())
    assert [d.code for d in parsed.diagnostics] == ["P0114"]
    assert isinstance(parsed.item, BrokenItem)
    assert parsed.item.name == "x"


def test_empty() -> None:
    assert split("") == ()
    assert parse_chunk("").item is None
    assert format_source("") == ""
    assert tokenize("") == ()
    assert completeness("") == "complete"
    assert parse_expression("").diagnostics[0].code == "P0101"


@pytest.mark.parametrize(
    "text", ["x = 1\0", "\0\0\0", "\x7fELF\x02\x01\x01\0\0", "PK\x03\x04\x14\0\b\b", "ÿþd\0e\0f\0"]
)
def test_binary(text: str) -> None:
    codes = {diagnostic.code for diagnostic, _ in messages(text)}
    assert "P0112" in codes


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends(end: str) -> None:
    plain = everything(CONSTRUCTS)
    other = everything(CONSTRUCTS.replace("\n", end))
    assert [p.diagnostics for _, p in other] == [()] * len(plain)
    assert [type(p.item) for _, p in other] == [type(p.item) for _, p in plain]
    lines, other_lines = SourceText("a", CONSTRUCTS), SourceText("b", CONSTRUCTS.replace("\n", end))
    for (start, parsed), (other_start, other_parsed) in zip(plain, other, strict=True):
        assert parsed.item is not None and other_parsed.item is not None
        for node, other_node in zip(walk(parsed.item), walk(other_parsed.item), strict=True):
            if hasattr(node, "span"):
                place = lines.position(start + node.span.start)
                assert other_lines.position(other_start + other_node.span.start) == place  # type: ignore[union-attr]


def test_byte_order_mark() -> None:
    (chunk,) = split("\ufeffx = 1")
    assert (chunk.start, chunk.text) == (1, "x = 1")
    assert format_source("\ufeffx=1") == "x = 1\n"


def test_form_feeds_and_other_blanks() -> None:
    text = "x = 1\n\f\ndef f(y)\n\f    y\v+\t1\n\fz = 2\u00a0+ 1\n"
    assert [chunk.text.strip("\f")[:1] for chunk in split(text)] == ["x", "d", "z"]
    assert [parsed.diagnostics for _, parsed in everything(text)] == [()] * 3


def test_unusual_line_separators_do_not_end_lines() -> None:
    assert len(split("x = 1 \u2028 y = 2\x85z")) == 1


@pytest.mark.parametrize("name", SAMPLES)
def test_every_prefix_has_a_tree(name: str) -> None:
    text, diffeo = SAMPLES[name], name.endswith(".diffeo")
    for chunk in split(text):
        for end in range(1, len(chunk.text)):
            parsed = parse_chunk(chunk.text[:end], diffeo)
            assert parsed.item is not None or chunk.text[:end].lstrip().startswith("#")
            for diagnostic in parsed.diagnostics:
                assert 0 <= diagnostic.span.start <= diagnostic.span.end <= end


@pytest.mark.parametrize("name", SAMPLES)
def test_every_deletion_of_a_token_has_a_tree(name: str) -> None:
    text, diffeo = SAMPLES[name], name.endswith(".diffeo")
    for chunk in split(text):
        parsed = parse_chunk(chunk.text, diffeo)
        defined = getattr(parsed.item, "name", None)
        for token in tokenize(chunk.text, diffeo):
            if token.start == 0 or token.kind == "COMMENT":
                continue
            kept = defined is not None and token.text not in (defined, "=")
            broken = chunk.text[: token.start] + " " + chunk.text[token.end :]
            again = parse_chunk(broken, diffeo)
            assert again.item is not None
            if kept:
                assert getattr(again.item, "name", None) == defined, broken


@pytest.mark.parametrize("name", SAMPLES)
def test_every_doubling_of_a_token_has_a_tree(name: str) -> None:
    text, diffeo = SAMPLES[name], name.endswith(".diffeo")
    for chunk in split(text):
        for token in tokenize(chunk.text, diffeo):
            doubled = chunk.text[: token.end] + " " + chunk.text[token.start :]
            assert parse_chunk(doubled, diffeo).item is not None


def test_an_error_stays_in_its_definition() -> None:
    clean = "def g(x)\n    x\n"
    for broken in ("def f(x) (x +", "f = [1, 2", "def f(", "x = )))", "integral [0, 1"):
        chunks = split(f"{broken}\n{clean}")
        assert chunks[1].text == clean.rstrip()
        assert parse_chunk(chunks[1].text).diagnostics == ()
