"""Half planes in a rectangle, with parameters in awkward places, against exact rational arithmetic.

Values and derivatives in every spelling of a program, as numbers and as arrays: lines through corners, along edges,
parallel or nearly so, coincident; ranges of length zero, reversed, with bounds that move. An error that is reported
must cover what is wrong; a derivative with two sides must come with both, or with an error that covers both.
"""

from __future__ import annotations

import random
from fractions import Fraction

import pytest
from exact_answers import held_against
from exact_polygons import Line, Scene, Truth
from how_many import examples, the_same
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

NUMBERS = (0.0, 1.0, -1.0, 0.5, 0.25, 2.0, 1.0, 1e-8, 0.3, -0.7, 1 + 1e-8, 1 - 1e-9, 6e-17)
MARGINS = (0.0, 0.0, 0.5, 1.0, 0.25, 1e-8, -1e-9, 1e-17, 0.3)
TANGENTS = (1.0, 1.0, -1.0, 0.0, 0.5)
CONDITIONS: tuple[tuple[str, int, Truth], ...] = (
    ("{0}", 1, lambda s: s[0]),
    ("not {0}", 1, lambda s: not s[0]),
    ("{0} and {1}", 2, lambda s: s[0] and s[1]),
    ("{0} or {1}", 2, lambda s: s[0] or s[1]),
    ("{0} and not {1}", 2, lambda s: s[0] and not s[1]),
    ("{0} and {1} and {2}", 3, all),
    ("({0} or {1}) and {2}", 3, lambda s: (s[0] or s[1]) and s[2]),
)
MANY: tuple[tuple[str, int, Truth], ...] = (
    (" and ".join(f"{{{k}}}" for k in range(8)), 8, all),
    ("not (" + " or ".join(f"{{{k}}}" for k in range(7)) + ")", 7, lambda s: not any(s)),
    ("({0} or {1}) and " + " and ".join(f"{{{k}}}" for k in range(2, 9)), 9, lambda s: (s[0] or s[1]) and all(s[2:])),
)


def scene(pick: random.Random, conditions: tuple[tuple[str, int, Truth], ...]) -> tuple[Scene, str, str]:
    """A scene, its condition as Potto writes it, and how."""
    text, count, truth = pick.choice(conditions)
    lines = tuple(_line(pick) for _ in range(count))
    if count > 1 and pick.random() < 0.3:  # the same line, flipped or scaled or turned by next to nothing
        first, scale = lines[0], pick.choice((1.0, -1.0, 2.0, -0.5))
        near = pick.choice((0.0, 0.0, 1e-9))
        other = Line(scale * first.a, scale * first.b + near, scale * first.c, pick.choice(TANGENTS))
        lines = (first, other, *lines[2:])
    box = pick.choice((
        (0.0, 0.0, 1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.0, 0.0, 1.0), (-1.0, 0.0, 1.0, 0.0, -1.0, 1.0),
        (0.0, 0.0, 0.5, 1.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0, 0.0, 1.0), (0.25, -1.0, 0.25, 1.0, 0.0, 1.0),
        (1.0, 0.0, 0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.0, 1.0, 1.0), (1.0, 0.0, 0.5, 1.0, 0.0, 2.0),
    ))  # fmt: skip
    weight = pick.choice(((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 1.0, 0.0), (0.0, 1.0, 1.0), (0.0, 1.0, -1.0)))
    return Scene(box, lines, truth, weight), text, pick.choice(SPELLINGS)


def _line(pick: random.Random) -> Line:
    a, b = pick.choice(NUMBERS), pick.choice(NUMBERS)
    while not a and not b:
        a, b = pick.choice(NUMBERS), pick.choice(NUMBERS)
    corner = pick.choice(((0.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.5, 0.5)))
    c = a * corner[0] + b * corner[1] + pick.choice(MARGINS) if pick.random() < 0.6 else pick.uniform(-1, 2)
    return Line(a, b, c, pick.choice(TANGENTS))


SPELLINGS = ("bracket", "if", "nested", "swapped", "called", "difference")


def program(s: Scene, condition: str, spelling: str) -> str:
    """The scene as a definition of f(t)."""

    def number(x: float) -> str:
        return f"({x!r})" if x < 0 else repr(x)

    x0, u0, x1, u1, y0, y1 = map(number, s.box)
    comparisons = [f"{number(k.a)}*x + {number(k.b)}*y < {number(k.c)} + {number(k.d)}*t" for k in s.lines]
    if spelling == "difference":
        comparisons = [f"{number(k.c)} + {number(k.d)}*t - {number(k.a)}*x - {number(k.b)}*y > 0" for k in s.lines]
    where = condition.format(*(f"({c})" for c in comparisons))
    p, q, r = map(number, s.weight)
    weight, along = f"({p} + {q}*x + {r}*y)", (f"[{x0} + {u0}*t, {x1} + {u1}*t]", f"[{y0}, {y1}]")
    match spelling:
        case "if":
            return f"def f(t)\n    integral ({along[0]}, {along[1]}) (if [{where}] then {weight} else 0) d(x, y)"
        case "nested":
            return f"def f(t)\n    integral {along[0]} (integral {along[1]} [{where}]*{weight} d(y)) d(x)"
        case "swapped":
            return f"def f(t)\n    integral ({along[1]}, {along[0]}) {weight}*[{where}] d(y, x)"
        case "called":
            inner = f"def inner(x, y, t)\n    if [{where}] then {weight} else 0\n"
            return f"{inner}def f(t)\n    integral ({along[0]}, {along[1]}) inner(x, y, t) d(x, y)"
        case _:
            return f"def f(t)\n    integral ({along[0]}, {along[1]}) {weight}*[{where}] d(x, y)"


def check(number: int, conditions: tuple[tuple[str, int, Truth], ...] = CONDITIONS) -> str:
    """Compare one program; what came of it."""
    pick = random.Random(number)
    s, condition, spelling = scene(pick, conditions)
    t = pick.choice((0.0, 0.0, 0.0, 0.25, 1e-8, -1e-8, pick.uniform(-0.5, 0.5)))
    text = f"# program {number}\n{program(s, condition, spelling)}"
    return held_against(text, t, s.value(Fraction(t)), s.rate, pick.random() < 0.3)


@the_same(20261)
@settings(max_examples=examples(60), deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 10**9))
def test_half_planes_in_awkward_places(number: int) -> None:
    check(number)


@the_same(20262)
@settings(max_examples=examples(40), deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 10**9))
def test_polygons_in_awkward_places(number: int) -> None:
    """Of many half planes the corners of what they leave are found by clipping: what it drops must not count."""
    check(number, MANY)


def test_a_line_all_but_parallel_to_a_bound_that_moves_onto_it() -> None:
    """6e-17 off parallel, and a unit in the last place away: there are other derivatives to both sides of that."""
    check(20056)


@pytest.mark.parametrize("number", [300453, 301124, 305117, 305131, 305134, 305767, 305821, 307081])
def test_scenes_that_were_wrong(number: int) -> None:
    """Lines that coincide and run along an axis up to rounding; places that rounding moves further than they matter."""
    check(number)


@pytest.mark.parametrize("spelling", ["bracket", "nested", "swapped", "if"])
@pytest.mark.parametrize("slope", [0.0, 1e-18, 6e-17, -6e-17, 3e-16, 1e-15, 1e-13])
@pytest.mark.parametrize("condition", ["{0} and not {1}", "{0} or not {1}", "not {0} and {1}"])
def test_between_two_lines_that_coincide(slope: float, spelling: str, condition: str) -> None:
    """What opens between them is seen from neither side, where no double lies between the ends of either."""
    truth = {
        "{0} and not {1}": lambda s: s[0] and not s[1],
        "{0} or not {1}": lambda s: s[0] or not s[1],
        "not {0} and {1}": lambda s: not s[0] and s[1],
    }[condition]
    lines = (Line(0.25, slope, 0.125, 1.0), Line(0.5, 2 * slope, 0.25, 0.0))
    s = Scene((-1.0, 0.0, 1.0, 0.0, -1.0, 1.0), lines, truth, (2.0, 1.0, 0.0))
    text = program(s, condition, spelling)
    held_against(text, 0.0, s.value(Fraction(0)), s.rate, False)


@pytest.mark.parametrize("t", [-1e-8, 1e-8, 0.0, 3e-9, -2.5e-9, 1e-7])
@pytest.mark.parametrize("slope", [1e-8, 3e-9, 1e-7, -1e-8, 1e-6])
def test_a_steep_line_through_a_corner(slope: float, t: float) -> None:
    """Sections that sweep the range while the parameter goes on by a rounding: its bar tells."""
    lines = (Line(2.0, slope, 2.00000001, 1.0), Line(slope, 0.25, 0.125000005, 1.0))
    s = Scene((-1.0, 0.0, 1.0, 0.0, -1.0, 1.0), lines, lambda k: k[0] or k[1], (1.0, 0.0, 0.0))
    held_against(program(s, "{0} or {1}", "nested"), t, s.value(Fraction(t)), s.rate, True)
