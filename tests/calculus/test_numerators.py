"""What a term is zero with, over its common denominator: made where there is one, and only then."""

import pytest

from potto.calculus.algebra import fractions
from potto.calculus.algebra.fractions import numerator
from potto.core.terms import add, const, div, mul, pow_, prim, var

X, T = var("x"), var("t")


def test_a_denominator_is_multiplied_out():
    assert numerator(add(div(T, X), const(-2.0)), "x") is add(T, mul(const(-2.0), X))
    square, minus_t = pow_(X, const(2.0)), mul(const(-1.0), T)
    assert numerator(add(pow_(X, const(-2.0)), minus_t), "x") is add(const(1.0), mul(minus_t, square))


@pytest.mark.parametrize(
    "term",
    [add(pow_(X, const(3.0)), mul(X, T)), mul(X, add(X, div(const(1.0), T))), add(X, prim("sqrt", div(T, X)))],
    ids=["none", "of what does not vary", "within a root"],
)
def test_nothing_is_made_where_nothing_is_divided_by(monkeypatch, term):
    monkeypatch.setattr(fractions, "_node", lambda node, memo: pytest.fail("a fraction was made"))
    assert numerator(term, "x") is None
