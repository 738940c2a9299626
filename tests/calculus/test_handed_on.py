"""Which number is handed on from each variable to those further in, and what is left."""

from __future__ import annotations

import pytest
from calculus_terms import term

from potto.calculus.decomposition.elimination import eliminate
from potto.core.printer import format_term
from potto.core.terms import ONE, ZERO, integral


def steps(names: str, body: str) -> list[tuple[str, str]] | None:
    """(weight, what is passed on) of each variable; `x@known` is what x has passed on."""
    found = eliminate(integral(tuple(names), ((ZERO, ONE),) * len(names), term(body)))
    if found is None:
        return None
    return [(format_term(step.weight), "" if step.passed is None else format_term(step.passed)) for step in found]


@pytest.mark.parametrize(
    ("names", "body", "expected"),
    [
        ("xyz", "sin(x + y + z)", [("1", "x"), ("1", "y + x@known"), ("sin(z + y@known)", "")]),
        ("xyz", "exp(x + y + z)", [("exp(x)", ""), ("exp(y)", ""), ("exp(z)", "")]),
        ("xyz", "x*sqrt(y)/(1 + z)", [("x", ""), ("sqrt(y)", ""), ("1/(z + 1)", "")]),
        ("xyz", "(1 + x)*cos(x*y*z)", [("x + 1", "x"), ("1", "y*x@known"), ("cos(z*y@known)", "")]),
        ("xyz", "sin(x*y)*cos(y*z)", [("1", "x"), ("sin(y*x@known)", "y"), ("cos(z*y@known)", "")]),
        (
            "xyz",
            "cos(2*x + 4*y*y + z)*tanh(t + x + 2*y*y)",
            [("1", "2*x"), ("tanh(t + 2*y*y + 0.5*x@known)", "4*y*y + x@known"), ("cos(z + y@known)", "")],
        ),
        ("xyz", "sin(x + y)*cos(x*z)", [("1", "x"), ("sin(y + x@known)", "x@known"), ("cos(z*y@known)", "")]),
        ("xyz", "cos(x*z)*sin(y + z)*exp(x*y*z)", None),
    ],
)
def test_steps(names: str, body: str, expected: list[tuple[str, str]] | None) -> None:
    assert steps(names, body) == expected
