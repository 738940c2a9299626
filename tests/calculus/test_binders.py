"""Variables of integration of the same name, one inside the other, once calls are carried out."""

from __future__ import annotations

import pytest

import potto
from potto.core.binders import apart
from potto.core.terms import ZERO, add, branch, const, integral, postorder, sum_, var


def test_binders_get_names_of_their_own() -> None:
    inner = integral(("z",), ((ZERO, var("z")),), branch((var("z"),), True, var("z"), var("y")))
    outer = integral(("z",), ((ZERO, var("y")),), add(inner, var("z")))
    whole = apart(sum_("y", ZERO, const(3), outer))
    bound = [name for node in postorder(whole) for name in getattr(node, "variables", ())]
    assert len(set(bound)) == 2 and whole.free == {"y"} - {"y"}
    assert apart(inner) is not inner  # its bound uses another z
    assert apart(whole) is whole


@pytest.mark.parametrize("name", ["z", "w"])
def test_second_derivatives_know_them_apart(name: str) -> None:
    """J(a) is the integral over x of x^2 (1 - a) + (1 - x) a, or 1/3 - a/3 + a/2, and nothing but the names differs."""
    m = potto.compile(f"""
def H(y) integral [0, 1] [{name} > y] d({name})
def G(y, a) integral [0, 1] (if [z > a] then y^2 else H(y)) d(z)
def J(a) integral [0, 1] G(x, a)*a d(x)
def T(a) integral [0, 1] snd(deriv(G)((x, 0), (a, 1))) d(x)
def K(z, a) [z > a]*H(z)
def L(a) integral [0, 1] K(x, a) d(x)
""")
    second = potto.deriv(potto.deriv(m.J))(((0.4, 1.0), (1.0, 0.0)))
    assert abs(second.tangent[1] - 1 / 3) <= 1e-14  # of a/3 + a^2/6
    tangent = potto.deriv(m.T)((0.4, 1.0))
    assert abs(tangent.value - 1 / 6) <= 1e-14 and abs(tangent.tangent) <= 1e-14
    # L(a) is the integral of 1 - x from a on.
    second = potto.deriv(potto.deriv(m.L))(((0.4, 1.0), (1.0, 0.0)))
    assert abs(second.value[1] + 0.6) <= 1e-14 and abs(second.tangent[1] - 1) <= 1e-14
