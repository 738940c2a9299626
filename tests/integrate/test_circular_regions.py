"""Regions that lines and circles bound, against closed forms: of all their crossings only the corners count."""

from __future__ import annotations

import math

import mpmath as mp
import pytest
from arcs import Inside, Line, area
from call_counts import calls_in

import potto


def held(program: str, at: float, value: mp.mpf, slope: mp.mpf, evals: int) -> None:
    """Within the errors, which are at most 1e-9 of what there is, and within so many evaluations."""
    answer = potto.deriv(potto.compile(program).f)((at, 1.0))
    assert abs(answer.value - value) <= answer.error + 1e-15 * abs(value) <= 1e-9 * abs(value)
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-15 * abs(slope) <= 1e-9 * abs(slope)
    assert answer.converged and answer.evals <= evals


def around(n: int) -> list[tuple[float, float]]:
    return [(math.cos(a), math.sin(a)) for a in (2 * math.pi * (k + 0.3) / n for k in range(n))]


@pytest.mark.parametrize(("n", "evals"), [(12, 1_000), (24, 1_500), (56, 2_500)])
def test_discs_around_a_middle(n: int, evals: int) -> None:
    """Each bounds what they share where it lies on the other side of the middle. 56 have 1,540 pairs."""
    shared = "*".join(f"[(x - ({0.3 * a!r}))^2 + (y - ({0.3 * b!r}))^2 < t^2]" for a, b in around(n))

    def area(r: mp.mpf) -> mp.mpf:
        def reach(a: mp.mpf) -> mp.mpf:
            return -mp.mpf(0.3) * mp.cos(a) + mp.sqrt(r * r - (mp.mpf(0.3) * mp.sin(a)) ** 2)

        return n * mp.quad(lambda a: reach(a) ** 2 / 2, [-mp.pi / n, 0, mp.pi / n])

    with mp.workdps(30):
        value, slope = area(mp.mpf(0.9)), mp.diff(area, mp.mpf(0.9))
        held(f"def f(t) integral ([-2, 2], [-2, 2]) {shared} d(x, y)", 0.9, value, slope, evals)


@pytest.mark.parametrize("middle", [0.0, 100.0])
def test_what_holes_leave(middle: float) -> None:
    """Twelve holes that don't meet, one of them halved by an edge, and half planes that leave all of it."""
    holes = [(middle + i - 1.5, j - 1.0) for i in range(4) for j in range(3) if (i, j) != (3, 1)]
    kept = " and ".join(f"(x - ({a!r}))^2 + (y - ({b!r}))^2 > t^2" for a, b in [*holes, (middle + 2.0, 0.0)])
    kept += f" and x + y < {middle + 4!r} and x - y > {middle - 4!r}"
    program = f"def f(t) integral ([{middle - 2!r}, {middle + 2!r}], [-1.5, 1.5]) [{kept}] d(x, y)"
    with mp.workdps(30):
        r = mp.mpf(0.25)
        held(program, 0.25, 12 - 11.5 * mp.pi * r**2, -23 * mp.pi * r, 20_000)


@pytest.mark.parametrize("radius", [0.9, 1.0, 1.01, 1.2])
def test_a_disc_in_a_polygon(radius: float) -> None:
    """Within it, touching its sides, cut by them, and around it: where it touches, bars are wide, and cover."""
    polygon = "*".join(f"[{a!r}*x + ({b!r})*y < 1]" for a, b in around(12))
    f = potto.compile(f"def f(t) integral ([-2, 2], [-2, 2]) {polygon}*[x^2 + y^2 < t^2] d(x, y)").f
    answer = potto.deriv(f)((radius, 1.0))
    with mp.workdps(30):
        r, around_it = mp.mpf(radius), 1 / mp.cos(mp.pi / 12)
        half = mp.acos(1 / r) if r > 1 else mp.mpf(0)  # the angle that a side takes from the circle, halved
        value = mp.pi * r**2 - 12 * (half * r**2 - mp.tan(half)) if r < around_it else 12 * mp.tan(mp.pi / 12)
        slope = r * (2 * mp.pi - 24 * half) if r < around_it else mp.mpf(0)
        assert abs(answer.value - value) <= answer.error + 1e-14 <= 1e-9
        assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-14 <= (1e-4 if radius == 1.0 else 1e-9)


SCATTERED = [(0.5 + 0.3 * math.sqrt(k / 20) * math.cos(2.4 * k), 0.5 + 0.3 * math.sqrt(k / 20) * math.sin(2.4 * k))
             for k in range(20)]  # fmt: skip
CORNER: list[Line] = [(0.6, 0.8, 0.75), (-0.8, 0.6, 0.05), (1.0, -0.1, 0.7)]
DISCS = [f"(x - {a!r})^2 + (y - {b!r})^2 < t^2" for a, b in SCATTERED]
BEYOND = [f"(x - {a!r})^2 + (y - {b!r})^2 >= t^2" for a, b in SCATTERED]
INSIDE = [f"t^2 - (x - {a!r})^2 - (y - {b!r})^2" for a, b in SCATTERED]
HALVES = [f"({a!r})*x + ({b!r})*y < {c!r}" for a, b, c in CORNER]
PAIRS = [f"({one} and {other})" for one, other in zip(DISCS[::2], DISCS[1::2], strict=True)]


def met(program: str, lines: list[Line], inside: Inside) -> None:
    """Value and derivative by the radius within the errors, which are at most 1e-8, and the first call in little time:
    worked out as formulas, 190 pairs of circles take 13 to 34 million calls of functions."""
    answers = []
    calls = calls_in(lambda: answers.append(potto.deriv(potto.compile(program).f)((0.1, 1.0))))
    answer = answers[0]
    assert calls <= 6_000_000
    with mp.workdps(30):
        value, slope = area(SCATTERED, lines, mp.mpf(0.1), inside)
    assert abs(answer.value - value) <= answer.error + 1e-15 <= 1e-9
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-15 <= 1e-8


@pytest.mark.parametrize("written", [
    f"[{' or '.join(DISCS)}]", f"(1 - [{' and '.join(BEYOND)}])", f"[not ({' and '.join(BEYOND)})]",
    f"(1 - {'*'.join(f'(1 - [{disc}])' for disc in DISCS)})", f"[max({', '.join(INSIDE)}) > 0]",
    f"[min({', '.join(f'-({of})' for of in INSIDE)}) < 0]",
], ids=["or", "without all others", "not", "product", "max", "min"])  # fmt: skip
def test_a_union_however_it_is_written(written: str) -> None:
    met(f"def f(t) integral ([0, 1], [0, 1]) {written} d(x, y)", [], any)


def test_unions_and_intersections_of_each_other() -> None:
    """Of lenses; within half planes; without some of it."""
    square = "def f(t) integral ([0, 1], [0, 1])"

    def lenses(held: list[bool] | tuple[bool, ...]) -> bool:
        return any(held[k] and held[k + 1] for k in range(0, 20, 2))

    met(f"{square} [{' or '.join(PAIRS)}] d(x, y)", [], lenses)
    met(f"{square} [({' or '.join(DISCS)}) and {' and '.join(HALVES)}] d(x, y)", CORNER,
        lambda held: any(held[:20]) and all(held[20:]))  # fmt: skip
    met(f"{square} [({' or '.join(DISCS[:12])}) and not ({' or '.join(DISCS[12:])})] d(x, y)", [],
        lambda held: any(held[:12]) and not any(held[12:]))  # fmt: skip


def test_what_is_added_up_in_a_function() -> None:
    """The branches are behind calls, and what is integrated has factors: the mean of a plane is that at the middle."""
    outside = "*".join(f"(1 - disc(x, y, {a!r}, {b!r}, t))" for a, b in MIRRORED)
    program = f"""
def disc(x, y, a, b, r) [(x - a)^2 + (y - b)^2 < r^2]
def f(t) integral ([0, 1], [0, 1]) (2 + x)*(1 - {outside}) d(x, y)
"""
    answer = potto.deriv(potto.compile(program).f)((0.1, 1.0))
    with mp.workdps(30):
        value, slope = area(MIRRORED, [], mp.mpf(0.1), any)
    assert abs(answer.value - 2.5 * value) <= answer.error + 1e-15 <= 1e-9
    assert abs(answer.tangent - 2.5 * slope) <= answer.tangent_error + 1e-15 <= 1e-8


MIRRORED = [(0.5 + sign * a, b) for a, b in ((0.07, 0.3), (0.19, 0.42), (0.11, 0.55), (0.2, 0.71)) for sign in (1, -1)]
