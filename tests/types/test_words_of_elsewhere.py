"""Names of other languages: the hint says how it is written here."""

from __future__ import annotations

import pytest
from marks import only


@pytest.mark.parametrize(
    ("program", "help"),
    [
        ("def f(x) ln(x)", "the natural logarithm is `log`"),
        ("def f(x) arcsin(x)", "write `asin`"),
        ("def f(x) log10(x)", "write `log(x)/log(10)`"),
        ("def f(x) π*x", "write `pi`"),
        ("def f(x) if x > 0 then True else 2", "a comparison in brackets is 1 or 0; write `1`"),
        ("def f(x) math.sin(x)", "`sin` is a builtin: write it without `math.`"),
        ("def f(x) clip(x, 0, 1)", "write `clamp(x, lo, hi)`"),
        ("def f(x) x^2\ng = hessian(f)", "a second derivative is `D(D(f, x), y)`"),
        ("def f(x) normal(x, 1)", "a measure stands among the bounds of an integral: `integral (x ~ normal(…)) body"),
        ("def f(x) sqr(x)", "did you mean `sqrt`?"),
        ("def f(x) x(x + 1)", "to multiply, write `*`"),
        ("def f(x, y) x(y)\ndef g(x) f(x + 1, x)", "it is applied there, as a function; if a product is meant, write"),
        ("xs = [1, 2]\nxs(0)", "an element of an array is written with brackets: `xs[i]`"),
        ("xs = [1 2]", "to multiply, write `*` between the two; to list them, a comma"),
        ("m = [[1, 2], [3, 4]]*[1, 2]", "write it for each row: `[row*v for row in rows]`; a matrix times a vector is"),
        ("m = [[1, 2], [3, 4]] - [1, 2]", "write it for each row: `[row - v for row in rows]`"),
        ("a = sum i in 0..2.5 (i)", "`floor` and `ceil` round to a whole number"),
        ("a = [i for i in 0.5..2]", "`floor` and `ceil` round to a whole number"),
        ("xs = [1, 2]\na = max(xs)", "the greatest element of an array is `max x in xs (x)`"),
        ("def f(c) integral ([0, 1], [0, 1]) ((x + c, y) ? 1 : 0) d(x, y)", "write `diffeo(…)` for a diffeomorphism"),
        ("def f(t) if t then 1 else 0\ndef g(x) f(x + 1)", "it decides a condition there; a number is compared first"),
        ("def f(t) integral [0, 1] (x < t) d(x)", "put it in brackets, `[x < t]`, for 1 where it holds"),
    ],
)
def test_one_error_with_a_hint(program: str, help: str) -> None:
    assert only(program).help.startswith(help)


def test_a_definition_of_such_a_name_is_one() -> None:
    assert only("def arctan(x) atan(x)\ndef f(x) arctan(x) + artcan(x)").help.startswith("did you mean `arctan`")
