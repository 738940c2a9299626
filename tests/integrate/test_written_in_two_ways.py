"""The same condition written in two ways: the same answer, at the same cost, counted in evaluations and in calls."""

from __future__ import annotations

import math
from typing import Any

import pytest
from call_counts import calls_in

import potto

SAME = 1.5
T = 0.7
UNIT = "([0, 1], [0, 1])"
DISCS = "([-2, 2], [-2, 2])"
ONE, OTHER = "x^2 + y^2 - 1", "(x - t)^2 + y^2 - 1"

# Bounds, a condition, the same in another way, and its area and the derivative of that where they have plain formulas.
PAIRS: list[tuple[str, str, str, str, tuple[float, float] | None]] = [
    ("and", UNIT, "[x < t and y < t]", "[x < t]*[y < t]", (T**2, 2 * T)),
    ("or", UNIT, "[x < t or y < t]", "([x < t] + [y < t] - [x < t]*[y < t])", (1 - (1 - T) ** 2, 2 - 2 * T)),
    ("max", UNIT, "[max(x, y) < t]", "[x < t]*[y < t]", (T**2, 2 * T)),
    ("min", UNIT, "[min(x, y) < t]", "(1 - [x >= t]*[y >= t])", (1 - (1 - T) ** 2, 2 - 2 * T)),
    ("max of three", UNIT, "[max(x + y, x - y, 2*x) < t]", "[x + y < t]*[x - y < t]*[2*x < t]",
     (3 / 8 * T**2, 3 / 4 * T)),
    ("abs", UNIT, "[abs(x - y) < t]", "[x - y < t]*[y - x < t]", (1 - (1 - T) ** 2, 2 - 2 * T)),
    ("abs that is larger", UNIT, "[2*abs(x - y) - t > 0]", "([x - y > t/2] + [y - x > t/2])",
     ((1 - T / 2) ** 2, T / 2 - 1)),
    ("clamp", UNIT, "[clamp(x + y, 0.2, 1.5) < t]", "[x + y < t]", (T**2 / 2, T)),
    ("clamp that is flat", UNIT, "[clamp(x + y, 0.2, t) < 1.5]", "[0.1 < 0.2]", (1.0, 0.0)),
    ("tents", UNIT, "[t - max(abs(2*x - 1), abs(2*y - 1)) > 0]",
     "[2*x - 1 < t]*[1 - 2*x < t]*[2*y - 1 < t]*[1 - 2*y < t]", (T**2, 2 * T)),
    ("discs that meet", DISCS, f"[max({ONE}, {OTHER}) < 0]", f"[{ONE} < 0]*[{OTHER} < 0]", None),
    ("least of brackets", UNIT, "min([x < t], [y < t])", "[x < t]*[y < t]", (T**2, 2 * T)),
    ("greatest of brackets", UNIT, "max([x < t], [y < t])", "[x < t or y < t]", (1 - (1 - T) ** 2, 2 - 2 * T)),
    ("greatest of weighed brackets", UNIT, "max([x < t]*2, 3*[y < t])", "(3*[y < t] + 2*[y >= t]*[x < t])",
     (5 * T - 2 * T**2, 5 - 4 * T)),
    ("least of weighed brackets", UNIT, "min([x < t]*2, 3*[y < t])", "2*[x < t and y < t]", (2 * T**2, 4 * T)),
    ("exponentials that a number scales", UNIT, "[2*exp(x) > 2*exp(t*y)]", "[x > t*y]", (1 - T / 2, -0.5)),
    ("exponentials", DISCS, "[exp(-x^2 - y^2) > exp(-t)]", "[x^2 + y^2 < t]", (math.pi * T, math.pi)),
    ("reciprocals", DISCS, "[1/(x^2 + y^2) > 1/t]", "[x^2 + y^2 < t]", (math.pi * T, math.pi)),
    ("product", DISCS, "[(x^2 + y^2 - t)*(x - y) < 0]",
     "[(x^2 + y^2 < t and x > y) or (x^2 + y^2 > t and x < y)]", (8.0, 0.0)),
    ("discs joined", DISCS, f"[min({ONE}, {OTHER}) < 0]", f"[{ONE} < 0 or {OTHER} < 0]", None),
]  # fmt: skip

SIDES = [f"{math.cos(0.1 + k * math.pi / 6)}*x + {math.sin(0.1 + k * math.pi / 6)}*y" for k in range(12)]
PAIRS += [("max of twelve", DISCS, f"[max({', '.join(SIDES)}) < t]", "*".join(f"[{side} < t]" for side in SIDES),
           (12 * math.tan(math.pi / 12) * T**2, 24 * math.tan(math.pi / 12) * T))]  # fmt: skip

APART = [f"{0.4 * T!r}*t - (x - {x})^2 - (y - {y})^2" for x, y in ((-1, -1), (1, -1.1), (-1.1, 1), (0.9, 1.2))]
ADDED = "(" + " + ".join(f"[{d} > 0]" for d in APART) + ")"
FOUR = 1.6 * math.pi * T**2, 1.6 * math.pi * T
PAIRS += [
    ("discs apart", DISCS, f"[{' or '.join(f'{d} > 0' for d in APART)}]", ADDED, FOUR),
    ("greatest of functions apart", DISCS, f"[max({', '.join(APART)}) > 0]", ADDED, FOUR),
]

OTHERWISE = ("min", "abs that is larger", "clamp that is flat", "discs joined")  # one surface, and not two or none


def asked(bounds: str, condition: str) -> tuple[Any, int]:
    """The area and its derivative, and how many calls of functions it takes by numpy, once everything is made: what
    others have asked before may be just about to become machine code."""
    f = potto.deriv(potto.compile(f"def f(t) integral {bounds} {condition} d(x, y)").f)

    def call() -> Any:
        with potto.settings(backend="numpy"):
            return f((T, 1.0))

    call()
    return call(), calls_in(call)


@pytest.mark.parametrize(("name", "bounds", "one", "other", "exact"), PAIRS, ids=[row[0] for row in PAIRS])
def test_greatest_and_least_are_products(
    name: str, bounds: str, one: str, other: str, exact: tuple[float, float] | None
) -> None:
    (first, calls), (second, others) = asked(bounds, one), asked(bounds, other)
    assert abs(first.value - second.value) <= first.error + second.error + 1e-15
    assert abs(first.tangent - second.tangent) <= first.tangent_error + second.tangent_error + 1e-15
    if exact is not None:
        assert abs(first.value - exact[0]) <= first.error + 1e-15 <= 1e-10
        assert abs(first.tangent - exact[1]) <= first.tangent_error + 1e-15 <= 1e-10
    if name not in OTHERWISE:
        assert first.evals <= SAME * second.evals and second.evals <= SAME * first.evals
        assert calls <= SAME * others and others <= SAME * calls


@pytest.mark.parametrize(
    "condition", ["[t*abs(x - y) < 0.3]", "[abs(x - y)*(x - 0.5) < 0.1*t]", "[exp(-abs(x)) > t*y]"]
)
def test_what_does_not_rise_or_fall_with_it_stays(condition: str) -> None:
    """Nothing says that t is positive: the condition keeps its one surface, and the answer is that of its cases."""
    bounds = "([-1, 1], [-1, 1])"
    found, _ = asked(bounds, condition)
    inner = "abs(x)" if "abs(x)" in condition else "abs(x - y)"
    up, down = condition.replace(inner, inner[3:]), condition.replace(inner, f"(-{inner[3:]})")
    cases, _ = asked(bounds, f"({up}*[{inner[3:]} >= 0] + {down}*[{inner[3:]} < 0])")
    assert abs(found.value - cases.value) <= found.error + cases.error
    assert abs(found.tangent - cases.tangent) <= found.tangent_error + cases.tangent_error


def test_a_sum_of_magnitudes_stays_a_sum() -> None:
    """|x| + |y| + |z| + |w| < t has 16 faces, and is a sum of four parts: its volume is 2^4 t^4/4!."""
    cube = ", ".join(["[-1, 1]"] * 4)
    f = potto.deriv(
        potto.compile(f"def f(t) integral ({cube}) [abs(x) + abs(y) + abs(z) + abs(w) < t] d(x, y, z, w)").f
    )
    found = f((T, 1.0))
    assert abs(found.value - 2 / 3 * T**4) <= found.error + 1e-15 <= 1e-9
    assert abs(found.tangent - 8 / 3 * T**3) <= found.tangent_error + 1e-15 <= 1e-9
    assert found.converged and found.evals <= 50_000


@pytest.mark.parametrize("product", ["exp(-x^2/2)*[sin(3*x) < t]", "weight(x)*[sin(3*x) < t]", "both(x, t)"])
def test_a_density_behind_a_call_ends_an_infinite_range(product: str) -> None:
    """Half of a normal density lies where a sine is negative; the roots are at k*pi/3."""
    text = "def weight(x) exp(-x^2/2)\ndef both(x, t) exp(-x^2/2)*[sin(3*x) < t]\n"
    f = potto.compile(f"{text}def f(t) integral [-inf, inf] {product} d(x)").f
    r = potto.deriv(f)((0.0, 1.0))
    slope = sum(math.exp(-((k * math.pi / 3) ** 2) / 2) / 3 for k in range(-20, 21))
    assert r.converged
    assert abs(r.value - math.sqrt(math.pi / 2)) <= r.error < 1e-9
    assert abs(r.tangent - slope) <= r.tangent_error < 1e-9


LEANS = "6.123233995736766e-17"


@pytest.mark.parametrize(
    ("leaning", "along", "times"),
    [
        # Far apart in the order in which x is innermost.
        (f"[{LEANS}*y + x < t]", "[x < t]", SAME),
        (f"[{LEANS}*y + x < t + 0.1]", "[x < t + 0.1]", SAME),
        # Where it would meet the bounds is less than its rounding away from infinity.
        ("[x*cos(pi/2) + y*sin(pi/2) < t]", "[y < t]", SAME),
        # In either order one of them has sections that leave the bounds at two places that are one.
        (f"[{LEANS}*y + x < t]*[y + {LEANS}*x < t]", "[x < t]*[y < t]", 8),
    ],
)
def test_an_edge_along_an_axis_but_for_rounding(leaning: str, along: str, times: float) -> None:
    found, plain = (
        potto.deriv(potto.compile(f"def f(t) integral ([-1, 1], [-1, 1]) {body}*exp(x) d(x, y)").f)((T, 1.0))
        for body in (leaning, along)
    )
    assert abs(found.value - plain.value) <= found.error + plain.error
    assert abs(found.tangent - plain.tangent) <= found.tangent_error + plain.tangent_error <= 1e-10
    assert found.converged and found.evals <= times * plain.evals
