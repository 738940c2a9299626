"""Regions that conics of any kinds and lines bound, against closed forms: of their crossings only the corners count."""

from __future__ import annotations

import math
import random

import mpmath as mp
import numpy as np
import pytest
from conic_areas import Conic, Inside, area, places
from how_many import examples

import potto
from potto.integrate.decomposition.balls import exact
from potto.integrate.decomposition.conic_crossings import crossings
from potto.integrate.decomposition.quartics import roots_in_discs

KINDS = ("ellipse", "hyperbola", "parabola", "upright parabola", "circle", "line")


def drawn(pick: random.Random, kind: str) -> Conic:
    """A conic that passes near the middle of [-1, 1]^2."""
    a, b, x, y = pick.uniform(0.5, 2.0), pick.uniform(0.5, 2.0), pick.uniform(-0.5, 0.5), pick.uniform(-0.5, 0.5)
    p, q, r = pick.uniform(-1, 1), pick.uniform(-1, 1), pick.uniform(-0.3, 0.3)
    squares = {
        "ellipse": (a + p * p, 2 * p * q, b + q * q), "hyperbola": (a * p, 2 * q, -b),
        "parabola": (p * p, 2 * p * q, q * q), "upright parabola": (a, 0.0, 0.0), "circle": (a, 0.0, a),
        "line": (0.0, 0.0, 0.0),
    }[kind]  # fmt: skip
    u, v, w = (round(square, 6) for square in squares)
    slope = (q, -p if kind == "parabola" else b) if u * w * 4 == v * v or kind == "parabola" else (0.0, 0.0)
    d, e = -2 * u * x - v * y + slope[0], -2 * w * y - v * x + slope[1]
    return (
        u,
        v,
        w,
        round(d, 6),
        round(e, 6),
        round(u * x * x + v * x * y + w * y * y - slope[0] * x - slope[1] * y + r, 6),
    )


def written(conic: Conic) -> str:
    a, b, c, d, e, f = conic
    return f"{a!r}*x*x + ({b!r})*x*y + ({c!r})*y*y + ({d!r})*x + ({e!r})*y + ({f!r}) < t"


def tree(pick: random.Random, leaves: list[int], conics: list[Conic]) -> tuple[str, Inside]:
    """Conditions joined at random, as they are written, and what they say of a point."""
    if len(leaves) == 1:
        (leaf,) = leaves
        text = written(conics[leaf])
        return (
            (f"not ({text})", lambda held: not held[leaf]) if pick.random() < 0.3 else (text, lambda held: held[leaf])
        )
    at, word = pick.randrange(1, len(leaves)), pick.choice(("and", "or"))
    (text, one), (rest, other) = tree(pick, leaves[:at], conics), tree(pick, leaves[at:], conics)
    if word == "and":
        return f"(({text}) and ({rest}))", lambda held: one(held) and other(held)
    return f"(({text}) or ({rest}))", lambda held: one(held) or other(held)


TREES = [pytest.param(k, marks=[] if k < 8 else pytest.mark.slow) for k in range(examples(40, 400))]


@pytest.mark.parametrize("seed", TREES)
def test_trees_of_conics(seed: int) -> None:
    """Three to eight of all kinds, joined at random. 1e-14, 1e-13: what doubles are rounded by, of numbers up to 4 and
    of slopes up to 10."""
    pick = random.Random(seed)
    conics = [drawn(pick, pick.choice(KINDS)) for _ in range(pick.randrange(3, 9))]
    text, inside = tree(pick, list(range(len(conics))), conics)
    answer = potto.deriv(potto.compile(f"def f(t) integral ([-1, 1], [-1, 1]) [{text}] d(x, y)").f)((0.2, 1.0))
    value, slope = area(conics, 0.2, 1.0, inside)
    assert abs(answer.value - value) <= answer.error + 1e-14
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-13
    assert answer.error <= 1e-8 and answer.tangent_error <= 1e-6 * max(1, abs(slope))


TOUCHING = [
    ("x^2/4 + y^2 < t or (x - 3)^2 + y^2/3 < 1", mp.pi * (2 + mp.sqrt(3)), 2 * mp.pi),
    ("x^2/4 + y^2 < t and x^2 + y^2 < 4", 2 * mp.pi, 2 * mp.pi),
    ("x^2/4 + y^2 < t and x^2 + y^2 < 1", mp.pi, mp.mpf(0)),
]


@pytest.mark.parametrize(("inside", "value", "slope"), TOUCHING, ids=["outside", "twice, around", "twice, within"])
def test_conics_that_touch(inside: str, value: mp.mpf, slope: mp.mpf) -> None:
    """No crossing is proved where they do: it is searched for in the surfaces, in what the numbers leave."""
    answer = potto.deriv(potto.compile(f"def f(t) integral ([-4, 6], [-4, 4]) [{inside}] d(x, y)").f)((1.0, 1.0))
    assert abs(answer.value - value) <= answer.error + 1e-14 <= 1e-11
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-14 <= 1e-10


PARABOLA, ELLIPSE, LONG = (1.0, 0.0, 0.0, 0.0, -1.0, 0.0), (1.0, 0.0, 4.0, 0.0, 0.0, -5.0), (0.25, 0.0, 1.0, 0, 0, -1.0)
# Each two meet three times in one place, or four times, for t = 0: the second one is the first with a multiple of the
# square of its tangent added, or of the tangent's product with another line through that place.
OSCULATING = {
    "parabola and circle of curvature": (PARABOLA, (1.0, 0.0, 1.0, 1.0, -2.5, -0.1875)),
    "parabola and circle at its vertex": (PARABOLA, (1.0, 0.0, 1.0, 0.0, -1.0, 0.0)),
    "ellipse and circle at its vertex": (LONG, (1.0, 0.0, 1.0, -3.0, 0.0, 2.0)),
    "ellipses, three times": (ELLIPSE, (1.25, 0.75, 3.0, -1.25, 1.25, -5.0)),
    "ellipses, three times, once beside": (ELLIPSE, (1.25, 1.25, 5.0, -1.75, -3.25, -2.5)),
    "ellipses, four times": (ELLIPSE, (1.125, 1.0, 6.0, -1.25, -5.0, -1.875)),
}


@pytest.mark.parametrize("speeds", [(1, 0), (0, 1), pytest.param((1, 1), marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", OSCULATING)
def test_conics_that_osculate(name: str, speeds: tuple[int, int]) -> None:
    """At contact and beside it. Rounding of the surfaces hides where they cross for 1e-5 about a place in which they
    meet three times, for 1e-3 where four times: the slope is known to so much, of the value nothing is lost."""
    conics = OSCULATING[name]
    one, other = (f"[{written(conic)[:-1]}{speed}*t]" for conic, speed in zip(conics, speeds, strict=True))
    f = potto.deriv(potto.compile(f"def f(t) integral ([-4, 4], [-4, 4]) {one}*{other} d(x, y)").f)
    for t in (0.0, 1e-3, -1e-3, 1e-6, -1e-6, 1e-9, -1e-9):
        answer = f((t, 1.0))
        value, slope = area(conics, t, 4.0, all, speeds)
        assert abs(answer.value - value) <= answer.error + 1e-14
        assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-13
        assert answer.error <= 1e-4 and answer.tangent_error <= 1e-2


# Two ellipses, a circle, a parabola, a hyperbola and a line through the origin.
THROUGH_ONE: list[Conic] = [
    (0.25, 0.0, 1.0, 0.0, -2.0, 0.0), (1.0, 0.0, 0.5, -2.0, 0.0, 0.0), (1.0, 0.0, 1.0, -1.0, -1.0, 0.0),
    (1.0, 0.0, 0.0, 0.5, -1.0, 0.0), (1.0, 0.0, -1.0, 1.0, 0.5, 0.0), (0.0, 0.0, 0.0, 1.0, -1.0, 0.0),
]  # fmt: skip


@pytest.mark.parametrize(("which", "speeds", "word"), [
    ((0, 1, 2), (1, 1, 0), "and"), ((0, 1, 2, 3, 4), (1, 0, 1, 0, 0), "and"), ((0, 1, 2, 3, 4), (1, 0, 1, 0, 0), "or"),
    ((0, 1, 3, 5), (0, 1, 0, 1), "and"), ((0, 3, 4), (1, 1, 1), "and"),
])  # fmt: skip
def test_many_conics_through_one_place(which: tuple[int, ...], speeds: tuple[int, ...], word: str) -> None:
    """As they pass through it, and beside: 1e-14, 1e-13 are what doubles are rounded by."""
    conics = [THROUGH_ONE[i] for i in which]
    terms = [written(conic)[:-1] + f"{speed}*t" for conic, speed in zip(conics, speeds, strict=True)]
    f = potto.deriv(potto.compile(f"def f(t) integral ([-4, 4], [-4, 4]) [{f' {word} '.join(terms)}] d(x, y)").f)
    for t in (0.0, 1e-6, -1e-6, 1e-9, -1e-9):
        answer = f((t, 1.0))
        value, slope = area(conics, t, 4.0, all if word == "and" else any, speeds)
        assert abs(answer.value - value) <= answer.error + 1e-14 <= 1e-9
        assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-13 <= 1e-8


@pytest.mark.parametrize("apart", [1e-3, 1e-6, 1e-9, 1e-12])
def test_conics_that_all_but_coincide(apart: float) -> None:
    """The inner one of two ellipses is the moving one where y*y + x*y < 0, or y is between 0 and -x: the slope is twice
    the angle that this is of the circle at first order, 2*atan(2). Bars are wide, and cover, where they are not told
    apart: 3*apart is what orders beyond that come to."""
    other = f"x^2/4 + (1 + {apart!r})*y^2 + {apart!r}*x*y < 1"
    program = f"def f(t) integral ([-4, 4], [-4, 4]) [x^2/4 + y^2 < t and {other}] d(x, y)"
    answer = potto.deriv(potto.compile(program).f)((1.0, 1.0))
    assert abs(answer.tangent - 2 * math.atan(2.0)) <= answer.tangent_error + 3 * apart <= 0.1


def numbers(pick: random.Random) -> tuple[list[Conic], list[Conic]]:
    return tuple([drawn(pick, pick.choice(KINDS[: 5 + k])) for _ in range(200)] for k in range(2))  # type: ignore[return-value]


@pytest.mark.parametrize("seed", range(3))
def test_no_crossing_is_missed(seed: int) -> None:
    """Crossings in [-2, 2]^2 are those of the resultant in x by mpmath, each within what it may be off by."""
    first, second = numbers(random.Random(seed))
    box = np.repeat([[-2.0], [2.0], [-2.0], [2.0]], len(first), axis=1)
    found = crossings(exact(np.array(first).T), exact(np.array(second).T), box)
    for pair, (one, other) in enumerate(zip(first, second, strict=True)):
        mine = [(found.place[:, i], found.off[i]) for i in np.nonzero(found.pair == pair)[0]]
        theirs = places(one, other)
        for x, y in theirs:
            assert any(max(abs(x - at[0]), abs(y - at[1])) <= off <= 1e-8 for at, off in mine)
        assert len([at for at, _ in mine if np.abs(at).max() <= 2]) == len(theirs)


@pytest.mark.parametrize("often", [2, 3, 4])
def test_discs_around_a_root_that_is_there_several_times(often: int) -> None:
    """Their radius is about the root of what doubles are rounded by, (16*2^-52)^(1/often), whatever approximations
    they are made of: 20 times that are the sizes of the summands and the other roots."""
    roots = [1.0] * often + [-2.0] * (4 - often)
    discs = roots_in_discs(exact(np.poly(roots)[::-1, None]))
    near = np.abs(discs.middle[:, 0] - 1) <= discs.radius[:, 0]
    assert near.sum() == often and (discs.together[near].sum(axis=1) == often).all()
    assert discs.radius[near, 0].max() <= 20 * (16 * 2.0**-52) ** (1 / often)
