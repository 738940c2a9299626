"""Roots of conditions in closed form: they are roots, none is missing, and they keep their digits.

Roots are checked with 40 digits, where the surface must vanish to 30; that none is missing is checked against sign
changes on a fine grid, which is independent of how the roots were found.
"""

from __future__ import annotations

import math
import random

import mpmath
import pytest
from calculus_terms import term, value

from potto.calculus.solving.solve import Sections, Unsolvable, sections
from potto.core.terms import Term, const, postorder, substitute, var

# A surface in x, and what its parameters range over (the default is [-2, 2]).
SURFACES = [
    "x + y + c",
    "t - x",
    "(x - 0.5)^2 - t",
    "t - (x - 0.5)^2",
    "r^2 - x^2 - y^2",
    "r^2 - (x - a)^2 - (y - b)^2",
    "sin(9*x) - t",
    "cos(3*x + a) - t",
    "tan(x) - t",
    "x*y - t",
    "t - x^3",
    "x^5*y - t",
    "exp(-x) - t",
    "a*x*x + b*x + c",
    "x^2 + b*x + c",
    "x^4 + x^2 - t",
    "x^4 - 3*x^2 + t",
    "x^6 - t",
    "exp(2*x) + exp(x) - t",
    "exp(x) + t*exp(-x) - 3",
    "(x - t)*(x - s)",
    "x^2*y^2 - t",
    "1/(x - t)",
    "1/(x - t) - 1",
    "(x - t)/(1 + x^2)",
    "x/(1 + x^2) - t",
    "abs(x - a) + abs(y) - r",
    "max(x - a, a - x, y) - r",
    "min(x, 1 - x) - t",
    "max(x, y) - t",
    "hypot(x, y) - r",
    "hypot(x, x + 1) - r",
    "abs(x - 1) + x - t",
    "abs(x - 1) + abs(x - t) - 2",
    "sqrt(x + 1) - x",
    "sqrt(x + 2) - x*t",
    "sqrt(x) + x - t",
    "a*sin(x) + b*cos(x) - c",
    "sin(x)^2 + cos(x) - t",
    "sin(x)*cos(x)*0 + sin(2*x) - t",
    "log(x) - log(1 - x)",
    "log(x)^2 - log(x) - t",
    "2*x - x*t - 1",
    "atan2(y, x) - t",
    "atan2(x, y) - t",
    "tanh(x) - t",
    "atan(x - a) - t",
    "(x^2 + y^2)^2 - (x^2 - y^2)*t",
    "sin(x^2) - t",
    "exp(x*t) - exp(1 - x)",
    "x*cos(t) + y*sin(t) - a",
    "clamp(x, 0, 1) - t",
    "x^1.5 - t",
    "x^(-2) - t",
    "(t*x)^2 - 1",
    "((x - a)^2 + (x - a)) - t",
    "erf(x - t)",
    "1e-160*(t - x)",
    "x^3 - t*x",
    "2^x - t",
    "t*x - 1",
    "tan(1 - 2*x^1.5) - t",
    "sin(3*sqrt(x + 1)) - t",
    "atan2(x, 3*x) - 0.4",
]

GRID = 301
LO, HI = -3.03, 3.07


def solved(surface: Term, name: str = "x") -> Sections:
    found = sections(surface, name)
    assert isinstance(found, Sections), found
    return found


def all_roots(found: Sections, env: dict[str, float], poles: bool = False) -> list[mpmath.mpf]:
    """Every root between LO and HI; of a family those that its index range gives."""
    roots = [value(r, env) for r in (found.poles if poles else found.roots)]
    for family in found.pole_families if poles else found.families:
        at = [mpmath.mpf(LO), mpmath.mpf(HI)]
        at += [s for s in (value(stop, env) for stop in family.stops) if LO < s < HI]
        counts = [value(family.inner, {**env, "x": x}) for x in at]
        counts = [c for c in counts if c == c]
        if not counts:
            continue
        for k in range(math.ceil(min(counts) - 1e-12), math.floor(max(counts) + 1e-12) + 1):
            roots.append(value(family.root, {**env, family.index: k}))
    return [r for r in roots if r == r and abs(r) < 1e6]


def cases() -> list[tuple[str, int]]:
    return [(s, seed) for s in SURFACES for seed in range(3)]


def parameters(surface: Term, seed: int) -> dict[str, float]:
    source = random.Random(seed * 1000 + 7)
    return {n: source.uniform(-2, 2) for n in sorted(surface.free - {"x"})}


@pytest.mark.parametrize(("text", "seed"), cases())
def test_roots_are_roots(text: str, seed: int) -> None:
    surface = term(text)
    env = parameters(surface, seed)
    found = solved(surface)
    assert found.complete
    with mpmath.workdps(40):
        for root in all_roots(found, env):
            here = value(surface, {**env, "x": root})
            slope = 1 + abs(root) + sum(abs(v) for v in env.values())
            assert abs(here) < mpmath.mpf(10) ** -30 * slope**4, (root, here)


def test_two_edges_of_a_polygon_meet_in_their_corner() -> None:
    """Where they meet is a fraction of fractions of the coordinates, and as such loses digits of a flat corner."""
    other = "(ay - by)*(x - bx)/(ax - bx) + by"  # the height of the edge from a to b
    surface = term(f"(cx - bx)*({other} - by) - (cy - by)*(x - bx)")
    assert solved(surface).roots == (var("bx"),)
    surface = term("(cx - bx)*(ay - (by - ay)*ax/(bx - ax) + (by - ay)/(bx - ax)*x - by) - (cy - by)*(x - bx)")
    assert solved(surface).roots == (var("bx"),)


@pytest.mark.parametrize(("text", "seed"), cases())
def test_no_root_is_missing(text: str, seed: int) -> None:
    surface = term(text)
    env = parameters(surface, seed)
    found = solved(surface)
    known = sorted(all_roots(found, env) + all_roots(found, env, poles=True))
    xs = [LO + (HI - LO) * i / (GRID - 1) for i in range(GRID)]
    values = [value(surface, {**env, "x": x}) for x in xs]
    for i in range(GRID - 1):
        a, b = values[i], values[i + 1]
        if a == a and b == b and a * b < 0:
            inside = [r for r in known if xs[i] - 1e-9 <= r <= xs[i + 1] + 1e-9]
            assert inside, f"sign change between {xs[i]} and {xs[i + 1]}, roots {known}"


@pytest.mark.parametrize("text", ["x*exp(x) - t", "x^3 + x - t", "x + sin(x) - t", "x^5 + x^2 - t"])
def test_what_has_no_closed_form_says_why(text: str) -> None:
    found = sections(term(text), "x")
    assert isinstance(found, Unsolvable)
    assert found.reason


def test_the_reason_names_what_stands_in_the_way() -> None:
    found = sections(term("x*exp(x) - t"), "x")
    assert isinstance(found, Unsolvable)
    assert "`x` itself" in found.reason and "exp" in found.reason


# Structure is kept: these would lose their digits if the condition were expanded.


def double(root: Term, env: dict[str, float]) -> float:
    """The value in double precision, operation by operation."""
    with mpmath.workprec(53):
        return float(value(root, env))


@pytest.mark.parametrize("t", [2.0**-40, 2.0**-80, 1e-150])
def test_a_fold_keeps_its_digits(t: float) -> None:
    found = solved(term("x^2 - t"))
    roots = sorted(double(r, {"t": t}) for r in found.roots)
    assert roots == pytest.approx([-math.sqrt(t), math.sqrt(t)], rel=4e-16, abs=0)


@pytest.mark.parametrize("scale", [1e-150, 1e-75, 1.0, 1e75, 1e150])
def test_a_circle_keeps_its_digits_at_any_scale(scale: float) -> None:
    found = solved(term("r^2 - x^2 - y^2"))
    roots = sorted(double(r, {"r": 5 * scale, "y": 3 * scale}) for r in found.roots)
    assert roots == pytest.approx([-4 * scale, 4 * scale], rel=1e-15, abs=0)


def test_a_circle_next_to_its_pole_keeps_its_digits() -> None:
    # r^2 - y^2 by itself has lost every digit here: r + y and r - y have not.
    y = 1 - 2.0**-50
    found = solved(term("r^2 - x^2 - y^2"))
    exact = float(mpmath.sqrt((1 - mpmath.mpf(y)) * (1 + mpmath.mpf(y))))
    assert max(double(r, {"r": 1.0, "y": y}) for r in found.roots) == pytest.approx(exact, rel=1e-15, abs=0)


@pytest.mark.parametrize("b", [1e8, -1e8, 1e150, -1e150])
def test_both_roots_of_a_quadratic_keep_their_digits(b: float) -> None:
    found = solved(term("a*x^2 + b*x + c"))
    env = {"a": 1.0, "b": b, "c": 1.0}
    roots = sorted((double(r, env) for r in found.roots), key=abs)
    with mpmath.workdps(700):
        small = float(2 / (-mpmath.mpf(b) - mpmath.sign(b) * mpmath.sqrt(mpmath.mpf(b) ** 2 - 4)))
    assert roots[0] == pytest.approx(small, rel=4e-16, abs=0)
    assert roots[1] == pytest.approx(-b, rel=4e-16, abs=0)


def test_a_quadratic_that_is_affine_at_run_time_keeps_its_root() -> None:
    found = solved(term("a*x^2 + b*x + c"))
    for b in (2.0, -2.0):
        roots = [double(r, {"a": 0.0, "b": b, "c": 3.0}) for r in found.roots]
        assert -3.0 / b in roots


def test_a_shifted_discriminant_cancels_symbolically() -> None:
    # x^2 - 2 p x + p^2 - t has discriminant t, however large p is.
    found = solved(term("x^2 - 2*p*x + p^2 - t"))
    radicands = [n for r in found.roots for n in postorder(r) if getattr(n, "op", "") == "sqrt"]
    assert radicands and all(n.free == {"t"} for n in radicands)


def test_a_scaled_condition_has_the_same_root() -> None:
    found = solved(term("1e-160*(t - x)"))
    assert found.roots == (term("t"),)


def test_both_sides_under_one_builtin_are_compared_directly() -> None:
    # exp(x) = exp(800) would overflow through log(exp(800)).
    assert solved(term("exp(x) - exp(t)")).roots == (term("t"),)


def test_a_cubic_root_keeps_its_digits() -> None:
    (root,) = solved(term("t - x^3")).roots
    assert double(root, {"t": 2.0**-60}) == pytest.approx(2.0**-20, rel=4e-15, abs=0)
    assert double(root, {"t": -8.0}) == pytest.approx(-2.0, rel=1e-15, abs=0)


def test_turning_terms_vanish_where_roots_meet() -> None:
    found = solved(term("r^2 - x^2 - y^2"))
    for y in (1.5, -1.5):
        assert any(value(t, {"r": 1.5, "y": y}) == 0 for t in found.turning)


@pytest.mark.parametrize(
    ("text", "env"),
    [
        ("asin(x) - t", {"t": 1.6}),
        ("sqrt(x) - t", {"t": -0.1}),
        ("x^2 - t", {"t": -0.1}),
        ("sin(x) - t", {"t": 1.1}),
        ("abs(x) - t", {"t": -0.1}),
        ("hypot(x, 1) - t", {"t": -3.0}),
    ],
)
def test_a_root_that_does_not_exist_is_nan(text: str, env: dict[str, float]) -> None:
    found = solved(term(text))
    for root in (*found.roots, *(substitute(f.root, {f.index: const(0)}) for f in found.families)):
        assert math.isnan(double(root, env))


def test_forty_crossings_are_counted() -> None:
    found = solved(term("sin(40*pi*x) - t"))
    count = 0
    for family in found.families:
        lo, hi = (value(family.inner, {"t": 0.3, "x": x}) for x in (0, 1))
        count += math.floor(hi) - math.ceil(lo) + 1
    assert count == 40


def test_poles_are_told_from_roots() -> None:
    found = solved(term("1/(x - t) - 2"))
    assert found.poles == (term("t"),)
    assert double(found.roots[0], {"t": 1.0}) == 1.5
    assert solved(term("(x - t)/(1 + x^2)")).poles == ()


def test_a_surface_of_thousands_of_terms_does_not_overflow_the_stack() -> None:
    big = term("t")
    from potto.core.terms import add, mul, neg, prim, var

    for i in range(3000):
        big = add(prim("sqrt", add(mul(const(0.001 * i), var("y")), big)), var("t"))
    found = solved(add(big, neg(var("x"))))
    assert len(found.roots) == 1


def test_a_deep_chain_is_undone_without_recursion() -> None:
    from potto.core.terms import add, prim, var

    chain: Term = var("x")
    for _ in range(2000):
        chain = add(prim("exp", prim("log", chain)), const(0.0))
    assert len(solved(add(chain, var("t"))).roots) == 1
