"""Half planes in a rectangle, with parameters in awkward places, against exact rational arithmetic.

Values and derivatives in every spelling of a program, as numbers and as arrays: lines through corners, along edges,
parallel or nearly so, coincident; ranges of length zero, reversed, with bounds that move. An error that is reported
must cover what is wrong; a derivative with two sides must come with both, or with an error that covers both.
"""

from __future__ import annotations

import random
from fractions import Fraction

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


def scene(pick: random.Random) -> tuple[Scene, str, str]:
    """A scene, its condition as Potto writes it, and how."""
    text, count, truth = pick.choice(CONDITIONS)
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


def check(number: int) -> str:
    """Compare one program; what came of it."""
    pick = random.Random(number)
    s, condition, spelling = scene(pick)
    t = pick.choice((0.0, 0.0, 0.0, 0.25, 1e-8, -1e-8, pick.uniform(-0.5, 0.5)))
    text = f"# program {number}\n{program(s, condition, spelling)}"
    return held_against(text, t, s.value(Fraction(t)), s.rate, pick.random() < 0.3)


@the_same(20261)
@settings(max_examples=examples(60), deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 10**9))
def test_half_planes_in_awkward_places(number: int) -> None:
    check(number)


def test_a_line_all_but_parallel_to_a_bound_that_moves_onto_it() -> None:
    """6e-17 off parallel, and a unit in the last place away: there are other derivatives to both sides of that."""
    check(20056)
