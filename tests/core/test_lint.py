"""Every invariant of core terms, broken once."""

from __future__ import annotations

import pytest
from core_terms import UNIT, area, bracket, t, x, y
from lint import lint

from potto.core.terms import ONE, ZERO, Term, add, branch, deriv, if_, integral, lam, mul, prim, sub, sum_, tuple_, var

LESS = prim("lt", x, y)


@pytest.mark.parametrize(
    ("term", "problem"),
    [
        (add(x, LESS), "the truth value of `lt` stands where a number belongs, in a `add`"),
        (tuple_((LESS, x)), "the truth value of `lt` stands where a number belongs, in a Tuple"),
        (if_(x, ONE, y), "the condition of an if is a Var, not a truth value"),
        (if_(prim("and", LESS, x), ONE, y), "`and` of what is not a truth value"),
        (if_(LESS, LESS, y), "the truth value of `lt` stands where a number belongs, in a If"),
        (prim("add", x), "`add` has 1 argument"),
        (prim("div", x), "`div` has 1 arguments instead of 2"),
        (branch((), False, x, y), "a branch has no surface"),
        (lam(("u", "u"), x), "a function binds a parameter twice: u, u"),
        (lam(("x",), lam(("x",), x)), "x is bound again inside of its own scope"),
        (area(sum_("x", ONE, ONE, x), "x"), "x is bound again inside of its own scope"),
        (add(x, area(x, "x")), "x is both free and bound"),
        (integral(("x", "y"), ((ZERO, y), (ZERO, ONE)), t), "a bound of x depends on y, which it cannot see"),
        (integral(("x",), UNIT, t, ((x,),)), "a bound of x depends on x, which it cannot see"),
    ],
)
def test_problems(term: Term, problem: str) -> None:
    assert problem in lint(term)


@pytest.mark.parametrize(
    "term",
    [
        deriv(lam(("t",), area(mul(x, bracket(sub(t, x))), "x"))),
        if_(prim("or", LESS, prim("not", LESS)), x, y),
        integral(("x", "y"), ((ZERO, t), (ZERO, x)), mul(x, y), ((t,), (x,))),
        add(area(x, "x"), area(mul(x, x), "x")),  # side by side a name may be bound twice
        sum_("i", ONE, x, area(var("i"), "u")),
    ],
)
def test_no_problems(term: Term) -> None:
    assert lint(term) == []
