"""Functions that give functions without a lambda in sight: what the other arguments decide is counted all the same.

Each integral is worth the share of [0, 1] on which `x > c`, so 1 - c with derivative -1, unless it says otherwise.
"""

from __future__ import annotations

from textwrap import dedent

import pytest

import potto

PROGRAM = """
step = \\y . c . [y > c]
flip = \\y . c . [c > y]
three = \\a . b . c . [a + b > c]

def part(y) step(y)
def named(y)
    s = step(y)
    s
def twice(y) part(y)
def two(a) three(a)
def mixed(a, b) three(a)(b)
def apply(p, x) p(x)
def all_of(p, x, c) p(x)(c)
def over(p) integral [0, 1] p(x) d(x)
third = step(1/3)
"""

CASES = [
    "part(x)(c)",
    "named(x)(c)",
    "twice(x)(c)",
    "two(x)(0)(c)",
    "mixed(x, 0)(c)",
    "apply(step, x)(c)",
    "apply(part, x)(c)",
    "apply(two, x)(0)(c)",
    "all_of(part, x, c)",
    "all_of(\\u . step(u), x, c)",
    "all_of(\\u . apply(step, u), x, c)",
    "(let q = part(x) in q(c))",
]


@pytest.mark.parametrize("call", CASES)
def test_what_the_last_argument_decides_is_counted(call: str) -> None:
    module = potto.compile(PROGRAM + f"def f(c) integral [0, 1] {call} d(x)\n")
    found = module.eval("deriv(f)((0.4, 1))")
    assert found.converged
    assert found.value == pytest.approx(0.6, rel=1e-10, abs=0)
    assert found.tangent == pytest.approx(-1, rel=1e-10, abs=0)


@pytest.mark.parametrize("passed", ["flip(c)", "apply(flip, c)", "(\\u . apply(flip, c)(u))"])
def test_a_function_that_a_call_gave_is_passed_on(passed: str) -> None:
    module = potto.compile(PROGRAM + f"def f(c) over({passed})\n")
    found = module.eval("deriv(f)((0.4, 1))")
    assert (found.value, found.tangent) == (pytest.approx(0.6, abs=1e-10), pytest.approx(-1, abs=1e-10))


def test_a_value_that_is_a_function() -> None:
    found = potto.compile(PROGRAM + "def f(c) integral [0, 1] third(c*x) d(x)\n").eval("deriv(f)((0.5, 1))")
    # 1/3 > c x up to x = 1/(3 c)
    assert (found.value, found.tangent) == (pytest.approx(2 / 3, abs=1e-10), pytest.approx(-4 / 3, abs=1e-10))


@pytest.mark.parametrize("call", ["part(x)(c)", "apply(part, x)(c)"])
def test_second_derivatives(call: str) -> None:
    module = potto.compile(PROGRAM + f"def f(c) integral [0, 1] {call}*x d(x)\n")  # (1 - c^2)/2
    found = module.eval("deriv(deriv(f))(((0.4, 1), (1, 0)))")
    (value, first), (same, second) = found.value, found.tangent
    assert (value, first) == (pytest.approx(0.42, abs=1e-9), pytest.approx(-0.4, abs=1e-9))
    assert (same, second) == (pytest.approx(-0.4, abs=1e-9), pytest.approx(-1, abs=1e-9))


@pytest.mark.parametrize("call", ["bad(p)(c)", "part(p)(c)", "apply(bad, p)(c)"])
def test_the_condition_is_seen_and_searched_for_where_it_cannot_be_inverted(call: str) -> None:
    text = """
        def bad(y)(c) [y^5 + sin(y*c) > c]
        def part(y) bad(y)
        def apply(p, x) p(x)
        def f(c) integral ([0, 1], [0, 1]) (let p = x*y + sin(x + y^3) in CALL) d(x, y)
    """
    found = potto.compile(dedent(text).replace("CALL", call)).diagnostics
    assert [d.code for d in found] == ["P0616"]
