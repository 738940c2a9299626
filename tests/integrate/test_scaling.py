"""Twice as much of a program costs at most STEP times as much: conditions, summands, calls, builtins; also gradients.

Evaluations of integrands are counted, and calls of functions, Python's and numpy's; nothing is timed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import pytest
from call_counts import calls_in
from spheres import directions

import potto
from potto.core.terms import Lam
from potto.integrate.decomposition import conic_corners
from potto.kernels.cells import Array, Bools, Ints

STEP = 2.3
Made = Callable[[int], tuple[str, dict[str, float]]]
SHOWN = "[({2} - {0})*(y - {1}) - ({3} - {1})*(x - {0}) > 0]*[({4} - {2})*(y - {3}) - ({5} - {3})*(x - {2}) > 0]"
TRIANGLE = f"{SHOWN}*[({{0}} - {{4}})*(y - {{5}}) - ({{1}} - {{5}})*(x - {{4}}) > 0]*{{6}}"
CORNERS = ("ax", "ay", "bx", "by", "cx", "cy", "s")


def conditions(n: int) -> tuple[str, dict[str, float]]:
    """A function of all conditions, so that no sum splits it."""
    at = {f"a{k}": 0.9 * k / (n + 1) for k in range(1, n + 1)}
    return f"def f({', '.join(at)}) integral [0, 1] 1/(1 + {' + '.join(f'[x < {a}]' for a in at)}) d(x)", at


def one_parameter(n: int) -> tuple[str, dict[str, float]]:
    terms = " + ".join(f"{k}*[x < {k}*t/{n + 1}]" for k in range(1, n + 1))
    return f"def f(t) integral [0, 1] ({terms}) d(x)", {"t": 0.9}


def own_parameters(n: int) -> tuple[str, dict[str, float]]:
    at = {f"a{k}": 0.9 * k / (n + 1) for k in range(1, n + 1)}
    terms = " + ".join(f"exp(x*{a})*[x < {a}]" for a in at)
    return f"def f({', '.join(at)}) integral [0, 1] ({terms}) d(x)", at


def triangles(n: int) -> tuple[str, dict[str, float]]:
    at: dict[str, float] = {}
    for i in range(n):
        corners = (0.1 + 0.3 * i / n, 0.2, 0.9 - 0.2 * i / n, 0.15, 0.4, 0.7 + 0.2 * i / n, 1.0 + i)
        at |= dict(zip((f"{c}{i}" for c in CORNERS), corners, strict=True))
    calls = " + ".join(f"tri(x, y, {', '.join(f'{c}{i}' for c in CORNERS)})" for i in range(n))
    tri = f"def tri(x, y, {', '.join(CORNERS)}) {TRIANGLE.format(*CORNERS)}"
    return f"{tri}\ndef f({', '.join(at)}) integral ([0, 1], [0, 1]) ({calls}) d(x, y)", at


def polygon(n: int) -> tuple[str, dict[str, float]]:
    """A regular one, which no edge runs along an axis of."""
    normals = ((math.cos(angle), math.sin(angle)) for angle in (2 * math.pi * (k + 0.3) / n for k in range(n)))
    sides = "*".join(f"[({a!r})*x + ({b!r})*y < t]" for a, b in normals)
    return f"def f(t) integral ([-2, 2], [-2, 2]) {sides} d(x, y)", {"t": 0.7}


def discs(n: int) -> tuple[str, dict[str, float]]:
    """What discs around a middle share."""
    middles = ((0.3 * math.cos(angle), 0.3 * math.sin(angle)) for angle in (2 * math.pi * k / n for k in range(n)))
    sides = "*".join(f"[(x - ({a!r}))^2 + (y - ({b!r}))^2 < t^2]" for a, b in middles)
    return f"def f(t) integral ([-2, 2], [-2, 2]) {sides} d(x, y)", {"t": 0.9}


def union(n: int) -> tuple[str, dict[str, float]]:
    """What discs around a middle cover."""
    discs = (f"(x - ({0.3 * math.cos(a)!r}))^2 + (y - ({0.3 * math.sin(a)!r}))^2 < t^2"
             for a in (2 * math.pi * (k + 0.3) / n for k in range(n)))  # fmt: skip
    return f"def f(t) integral ([-2, 2], [-2, 2]) [{' or '.join(discs)}] d(x, y)", {"t": 0.9}


def chain(n: int) -> tuple[str, dict[str, float]]:
    """Discs that overlap with their neighbours alone, as the greatest of functions."""
    discs = (f"t^2 - (x - {(k + 0.5) / n!r})^2 - (y - {0.5 + 0.2 * math.sin(7 * (k + 0.5) / n)!r})^2" for k in range(n))
    return f"def f(t) integral ([0, 1], [0, 1]) [max({', '.join(discs)}) > 0] d(x, y)", {"t": 0.8 / n}


def ellipses(n: int) -> tuple[str, dict[str, float]]:
    """What ellipses around a middle share, each turned another way."""
    turned = (ellipse(a, 0.3, 2.7 * a, 1.0, 1.15) for a in (2 * math.pi * (k + 0.3) / n for k in range(n)))
    return f"def f(t) integral ([-2, 2], [-2, 2]) [{' and '.join(turned)}] d(x, y)", {"t": 0.9}


def row(n: int) -> tuple[str, dict[str, float]]:
    """What ellipses in a row cover, each of which overlaps with its neighbours."""
    middles = (((k + 0.5) / n, 0.2 * math.sin(7 * (k + 0.5) / n)) for k in range(n))
    along = (ellipse(math.atan2(y, x), math.hypot(x, y), 0.4, 0.9 / n, 0.7 / n) for x, y in middles)
    return f"def f(t) integral ([0, 1], [-1, 1]) [{' or '.join(along)}] d(x, y)", {"t": 0.9}


def ellipse(angle: float, far: float, turn: float, a: float, b: float) -> str:
    """With half axes a and b, turned, and its middle so far in a direction."""
    c, s = math.cos(turn), math.sin(turn)
    x, y = far * math.cos(angle - turn), far * math.sin(angle - turn)
    return f"({c!r}*x + ({s!r})*y - ({x!r}))^2/{a * a!r} + ({c!r}*y - ({s!r})*x - ({y!r}))^2/{b * b!r} < t"


def weighted_lines(n: int) -> tuple[str, dict[str, float]]:
    """Half planes that are counted, under a factor that has to do with none of them."""
    sides = (f"{k}*[({math.cos(a)!r})*x + ({math.sin(a)!r})*y < t]"
             for k, a in enumerate((2 * math.pi * (k + 0.3) / n for k in range(n)), 1))  # fmt: skip
    return f"def f(t) integral ([-2, 2], [-2, 2]) exp(-x*y)*({' + '.join(sides)}) d(x, y)", {"t": 0.7}


def weighted_discs(n: int) -> tuple[str, dict[str, float]]:
    """The same of discs around a middle."""
    discs = (f"{k}*[(x - ({0.3 * math.cos(a)!r}))^2 + (y - ({0.3 * math.sin(a)!r}))^2 < t^2]"
             for k, a in enumerate((2 * math.pi * (k + 0.3) / n for k in range(n)), 1))  # fmt: skip
    return f"def f(t) integral ([-2, 2], [-2, 2]) ({' + '.join(discs)})/(3 + x) d(x, y)", {"t": 0.7}


def weighted_planes(n: int) -> tuple[str, dict[str, float]]:
    """Half spaces that are counted, some of them outside of others."""
    sides = (f"{k}*[({a!r})*x + ({b!r})*y + ({c!r})*z < t]" for k, (a, b, c) in enumerate(directions(n), 1))
    return f"def f(t) integral ([-2, 2], [-2, 2], [-2, 2]) exp(-x)*({' + '.join(sides)}) d(x, y, z)", {"t": 0.7}


def half_planes(n: int) -> tuple[str, dict[str, float]]:
    """What half planes around a middle cover."""
    sides = (f"({math.cos(a)!r})*x + ({math.sin(a)!r})*y < t" for a in (2 * math.pi * (k + 0.3) / n for k in range(n)))
    return f"def f(t) integral ([-2, 2], [-2, 2]) [{' or '.join(sides)}] d(x, y)", {"t": 0.7}


def builtins(n: int) -> tuple[str, dict[str, float]]:
    terms = " + ".join(f"sin({k}/{n}*x*t)*exp(-{k}/{n}*x)" for k in range(1, n + 1))
    return f"def f(t) integral [0, 1] ({terms})*[x < t] d(x)", {"t": 0.7}


def nested(n: int) -> tuple[str, dict[str, float]]:
    """Each integrand is made of the integral before, which does not vary with its variable."""
    calls = (f"def f{k}(t) integral [0, 1] [x < t]*(0.2 + f{k - 1}(t)) d(x)\n" for k in range(1, n))
    return f"def f0(t) t\n{''.join(calls)}def f(t) integral [0, 1] [x < t]*(0.2 + f{n - 1}(t)) d(x)", {"t": 0.7}


def counted(call: Callable[[], Any]) -> tuple[int, int]:
    """Evaluations, and calls of functions, once everything is made."""
    return call().evals, calls_in(call)


@pytest.mark.parametrize("made, sizes", [
    (conditions, (20, 40, 80)), (one_parameter, (160, 320, 640)), (own_parameters, (40, 80, 160)),
    (triangles, (12, 24, 48)), (polygon, (16, 32, 64)), (discs, (24, 48, 96)),
    (union, (10, 20, 40, 80)), (chain, (10, 20, 40)),
    (ellipses, (10, 20, 40)), (row, (10, 20)),  # of 40 as small and as far away rounding limits the slope
    (weighted_lines, (8, 16, 32)), (weighted_discs, (4, 8, 16, 32)), (weighted_planes, (8, 16, 32, 64)),
    (half_planes, (16, 32, 64)), (nested, (4, 8, 16)),
    (builtins, (80, 160, 320)),  # below, fewer nodes do
])  # fmt: skip
@pytest.mark.parametrize("gradient", [False, True])
def test_twice_as_much(made: Made, sizes: tuple[int, ...], gradient: bool) -> None:
    costs = []
    for n in sizes:
        program, at = made(n)
        f = potto.compile(program).f
        call = potto.grad(f, list(at)) if gradient else f
        with potto.settings(backend="numpy"):  # when machine code is made depends on the time that numpy took
            costs.append(counted(lambda call=call, at=at: call(**at)))  # type: ignore[misc]
    for small, large in itertools.pairwise(costs):
        assert large[0] <= STEP * small[0]
        assert large[1] <= STEP * small[1]


@pytest.mark.parametrize("gradient", [False, True])
def test_half_as_many_cost_no_more(gradient: bool) -> None:
    """Half spaces that are added up: few of them are integrated as many are."""
    costs = []
    for n in (2, 4, 8):
        sides = (f"{k}*[({a!r})*x + ({b!r})*y + ({c!r})*z < t]" for k, (a, b, c) in enumerate(directions(n), 1))
        f = potto.compile(f"def f(t) integral ([-2, 2], [-2, 2], [-2, 2]) ({' + '.join(sides)}) d(x, y, z)").f
        call = potto.grad(f, "t") if gradient else f
        costs.append(counted(lambda call=call: call(0.7)))  # type: ignore[misc]
    for small, large in itertools.pairwise(costs):
        assert small[0] <= large[0] and small[1] <= large[1]


def test_what_passes_a_box_by_crosses_nothing_in_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the lines of a scene few meet a pixel: of pairs of these alone it is asked where they cross."""
    asked = list[int]()
    looking = conic_corners._straight_crossings

    def noting(v: Array, e: Array, p: Ints, *rest: Ints) -> conic_corners.Places:
        asked.append(p.size)
        return looking(v, e, p, *rest)

    monkeypatch.setattr(conic_corners, "_straight_crossings", noting)
    for n in (8, 16, 32):
        lines = "*".join(f"(1 - [y + 0.25*x > t + {k}]/2)" for k in range(n))
        asked.clear()
        found = potto.compile(f"def f(t) integral ([0, 1], [0, 1]) ({lines}*(1 - [y > x/4 + 0.25])) d(x, y)").f(0.25)
        # 3/8 lie below y = (1 + x)/4, and of the 1/4 between that and y = (1 - x)/4 half is taken
        assert abs(found.value - 0.25) <= found.error < 1e-13
        assert 0 < max(asked) < 40


def test_crossings_within_a_union_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of n half planes n^2/2 pairs cross, mostly within others: of fewer than n it is asked what both bound."""
    asked = list[int]()
    looking = conic_corners._bounds_both

    def noting(v: Array, e: Array, places: conic_corners.Places, polynomial: Lam, machine: Any) -> Bools:
        asked.append(places.p.size)
        return looking(v, e, places, polynomial, machine)

    monkeypatch.setattr(conic_corners, "_bounds_both", noting)
    for n in (16, 32, 64):
        program, at = half_planes(n)
        asked.clear()
        found = potto.compile(program).f(**at)
        assert abs(found.value - 16) <= found.error < 1e-12  # each point is in one of two that are opposite
        assert 0 < sum(asked) < n


def test_a_narrow_strip_asks_for_no_more_nodes_beside_it() -> None:
    """Between lines that nearly meet few doubles lie; of areas three nodes tell all the same, also how they round."""
    ends = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.7 + 2.0**-30]
    steps = " + ".join(f"[x + y < {end!r}*t]" for end in ends)
    found = potto.compile(f"def f(t) integral ([0, 1], [0, 1]) 1/(1 + {steps}) d(x, y)").f(1.0)
    area = sum((end**2 - below**2) / 2 / (9 - k) for k, (below, end) in enumerate(itertools.pairwise([0.0, *ends])))
    assert abs(found.value - (area + 1 - ends[-1] ** 2 / 2)) <= found.error <= 1e-14
    assert found.evals <= 405  # 1,485 with as many nodes as any function takes
