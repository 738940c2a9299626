"""Derivatives of what jumps, used under an integral: their tangents are distributions, and only an integral takes them.

For f(y, a) = [y > a] the tangent along (v, w) is delta(y - a)*(v - w), so its integral over y in [0, 1] is v - w at a.
"""

from __future__ import annotations

import pytest

import potto

JUMPS = """
def f(y, a) [y > a]
g = deriv(f)
step = \\y . [y > 0]
dstep = deriv(step)
def square(y, a) if [y > a] then y^2 else 0
def slope(y, a) snd(deriv(square)((y, 0), (a, 1)))
def taking(k, a) integral [0, 1] snd(deriv(k)((x, 0), (a, 1))) d(x)
"""


@pytest.mark.parametrize(
    ("program", "expected"),
    [
        ("integral [0, 1] snd(deriv(f)((x, 0), (a, 1))) d(x)", -1.0),
        ("integral [0, 1] snd(deriv(f)((x, 1), (a, 0))) d(x)", 1.0),
        ("integral [0, 1] snd(deriv(f)((x, a), (a, 3))) d(x)", -2.6),
        ("integral [0, 1] snd(g((x, 0), (a, 1))) d(x)", -1.0),  # the derivative has a name
        ("integral [0, 1] x*snd(dstep((2*x - a, 1))) d(x)", 0.1),  # delta(2 x - a) x, at x = a/2
        ("integral [0, 1] snd(deriv(square)((x, 0), (a, 1))) d(x)", -0.16),
        ("integral [0, 1] slope(x, a) d(x)", -0.16),  # behind a call
        ("integral [0, 1] (let (v, w) = g((x, 0), (a, 1)) in v + w) d(x)", 0.6 - 1),
        ("integral ([0, 1], [0, 1]) y*snd(g((x, 0), (a*y, y))) d(x, y)", -1 / 3),  # -y^2 over [0, 1]
        ("integral [0, 1] snd(g((x, 0), (a + 1, 1))) d(x)", 0.0),  # out of the domain
        ("taking(square, a)", -0.16),  # of a parameter
        ("taking(f, a)", -1.0),
        (r"taking(\(y, b) . a*[y > b], a)", -0.4),  # which has captured something
        ("integral [0, 1] fst(g((x, 0), (a, 1))) d(x)", 0.6),
    ],
)
def test_the_deltas_count(program: str, expected: float) -> None:
    got = potto.compile(f"{JUMPS}def h(a) {program}\n").h(0.4)
    assert abs(got.value - expected) <= 1e-14 + got.error and got.error <= 1e-12


def test_they_are_differentiated_in_their_turn() -> None:
    """The integral of the tangent of `square` is -a^2."""
    got = potto.deriv(potto.compile(f"{JUMPS}def h(a) integral [0, 1] slope(x, a) d(x)\n").h)((0.4, 1.0))
    assert abs(got.value + 0.16) <= 1e-14 and abs(got.tangent + 0.8) <= 1e-13
