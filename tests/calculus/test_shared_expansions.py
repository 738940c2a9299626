"""Normal forms of what terms share are worked out once, also where they are too large."""

from __future__ import annotations

import pytest

from potto.calculus.algebra import rational_form
from potto.calculus.algebra.rational_form import normal, shorter
from potto.core.terms import Term, add, const, mul, prim, sub, var


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> list[Term]:
    """The terms whose normal forms are made, in order."""
    made: list[Term] = []
    own = rational_form._node

    def counted(node: Term, args: list[rational_form.Rational]) -> rational_form.Rational:
        made.append(node)
        return own(node, args)

    monkeypatch.setattr(rational_form, "_node", counted)
    return made


def sides(prefix: str, count: int) -> Term:
    return mul(*(add(var(f"{prefix}{k}"), var(f"{prefix}{k}'")) for k in range(count)))


def test_what_two_terms_share_is_multiplied_out_once(steps: list[Term]) -> None:
    shared = sides("a", 5)
    assert normal(add(shared, var("x"))) is not None
    before = len(steps)
    assert normal(sub(mul(const(2.0), shared), var("y"))) is not None
    assert len(steps) - before <= 6


def test_what_has_grown_too_large_is_not_tried_again(steps: list[Term]) -> None:
    large = sides("b", 12)
    assert normal(large) is None
    before = len(steps)
    for power in range(2, 12):
        assert normal(add(mul(const(float(power)), large), var("x"))) is None
    assert len(steps) - before <= 50


def test_what_a_function_hides_is_not_multiplied_out(steps: list[Term]) -> None:
    large = sides("c", 12)
    assert shorter(sub(add(prim("sqrt", large), var("x")), prim("sqrt", large))) is var("x")


def test_a_determinant_that_cancels_is_found() -> None:
    """The volume of three vectors of which one is the sum of the others."""
    a, b = ([var(f"{v}{k}") for k in range(3)] for v in "pq")
    c = [add(u, v) for u, v in zip(a, b, strict=True)]
    rows = [(1, 2), (2, 0), (0, 1)]
    volume = add(*(mul(a[k], sub(mul(b[i], c[j]), mul(b[j], c[i]))) for k, (i, j) in enumerate(rows)))
    assert normal(volume) is not None and shorter(volume).free == frozenset()
