"""A missing bracket, one too many and a missing comma in integrals and lists: one mistake is one message."""

from __future__ import annotations

import pytest

from potto.syntax import parse_chunk, parse_expression


@pytest.mark.parametrize(
    ("text", "mended"),
    [
        ("integral [0, 1] [x < t d(x)", "integral [0, 1] [x < t] d(x)"),
        ("integral ([0, 1], [0, 1]) [x^2 + y^2 < r^2 d(x, y)", "integral ([0, 1], [0, 1]) [x^2 + y^2 < r^2] d(x, y)"),
        ("integral [0, 1] (2*x d(x)", "integral [0, 1] (2*x) d(x)"),
        ("1 + (integral [0, 1] [x < t d(x))", "1 + (integral [0, 1] [x < t] d(x))"),
        ("integral [0, 1] integral [0, 1] [x < y d(x) d(y)", "integral [0, 1] integral [0, 1] [x < y] d(x) d(y)"),
    ],
)
def test_one_bracket_is_missing(text: str, mended: str) -> None:
    (said,) = parse_expression(text).diagnostics
    assert said.code == "P0102" and "never closed" in said.message
    (suggestion,) = said.suggestions
    (edit,) = suggestion.edits
    assert text[: edit.span.start] + edit.text + text[edit.span.end :] == mended
    assert not parse_expression(mended).diagnostics


@pytest.mark.parametrize(
    "text",
    [
        "def f(corners: [m (Real, Real), faces: [n] (Real, Real, Real), photo: [h, w] Real) corners[0].0",
        "def f(corners: [m] (Real, Real), photo: [h, w (Real, Real, Real), k) corners[0].0",
        "def stress(x, y 1/(1 + x^2 + y^2)",
        "def f(x) integral ([0, 1], [x, 1] [u < v]*(if [u > x] then 1 else 2) d(u, v)",
        "def f(xs: [n] Real) [xs[i + 1 - xs[i] for i in 0..n-2]",
    ],
)
def test_one_that_is_missing_in_a_definition_is_one_mistake(text: str) -> None:
    (said,) = parse_chunk(text).diagnostics
    assert said.code == "P0102" and "never closed" in said.message


def test_several_are_missing() -> None:
    found = parse_expression("integral [0, 1] (x*(1 + [x < 1 d(x)").diagnostics
    assert [said.code for said in found] == ["P0102"] * 3


@pytest.mark.parametrize(
    ("text", "said", "place"),
    [
        ("def lamp(lx) lx, 0.4, 3)", "this `)` closes nothing: no `(` is open here", 23),
        ("arrow = [(0.1, 0.1), 0.2, 0.9), (0.4, 0.45)]", "this `)` closes nothing: no `(` is open here", 29),
        ("def mean(xs: [n] ] Real) sum x in xs (x) / n", "this `]` closes nothing: no `[` is open here", 17),
        ("def inner(t) integral [0, 1] insidex, t) d(x)", "this `)` closes nothing: no `(` is open here", 39),
        ("def inner(t) integral ([0 1], [0, 1]) x*y d(x, y)", "an interval has two ends", 23),
        ("def inner(t) integral ([0, 1], [0, t]) x*y d(x y)", "`x y` is not a name: a variable of integration", 45),
        ("def inner(t) 2*integral", "expected the bounds after `integral`", 15),
    ],
)
def test_one_bracket_too_many_or_one_comma_too_few_is_one_mistake(text: str, said: str, place: int) -> None:
    (found,) = parse_chunk(text).diagnostics
    assert found.message.startswith(said) and found.span.start == place
