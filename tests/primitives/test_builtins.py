"""Laws of the table of builtins; a new entry is tested the day that it appears."""

from __future__ import annotations

import math

import pytest
from builtin_terms import EPS, builtin, double, nearest_order
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from lint import lint
from mpmath import mp

import potto
from potto.calculus.differentiation.derivative import partial
from potto.core.reference import evaluate, function
from potto.core.terms import Const, Prim, const, postorder, prim, sub, var
from potto.primitives import PRIMITIVES, Primitive

NUMERIC = [p for p in PRIMITIVES.values() if not p.truth]
SMOOTH = [p for p in NUMERIC if p.partials is not None]
INVERTIBLE = [p for p in SMOOTH if p.inverse is not None]


def by_name(primitive: Primitive) -> str:
    return primitive.name


def arity(primitive: Primitive) -> int:
    return 3 if primitive.arity is None else primitive.arity


def domains(primitive: Primitive) -> tuple[tuple[float, float], ...]:
    return primitive.domain * arity(primitive) if primitive.arity is None else primitive.domain


def numbers(lo: float, hi: float) -> st.SearchStrategy[float]:
    """Over the whole of an interval, and crowded around 0 and around 1."""
    small = st.floats(max(lo, -3.0), min(hi, 3.0)) if lo < 3.0 and hi > -3.0 else st.nothing()
    least = 1e-30 if lo <= 0 <= hi else 0.0  # what is smaller says nothing new, and costs mpmath many digits
    return st.one_of(st.floats(lo, hi), small).map(lambda x: x if abs(x) >= least else 0.0)


def points(primitive: Primitive) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*(numbers(lo, hi) for lo, hi in domains(primitive))).map(
        lambda point: (*(nearest_order(primitive, x) for x in point[: primitive.orders]), *point[primitive.orders :])
    )


def names(primitive: Primitive) -> list[str]:
    return [f"a{i}" for i in range(arity(primitive))]


def exact(primitive: Primitive, *args: float) -> mp.mpf:
    return function(primitive.name)(*map(mp.mpf, args))


def regular(primitive: Primitive, point: tuple[float, ...]) -> bool:
    """Whether a point lies on no kink and no edge of the domain."""
    args = [const(x) for x in point]
    special = (*primitive.kinks(*args), *primitive.edges(*args))
    return all(double(term, {}) != 0 for term in special)


# Entries


@pytest.mark.parametrize("primitive", PRIMITIVES.values(), ids=by_name)
def test_entries_are_complete(primitive: Primitive) -> None:
    assert primitive.doc.endswith(".") and primitive.example
    assert len(primitive.domain) == (1 if primitive.arity is None else primitive.arity)
    assert (primitive.partials is None) == primitive.plain
    args = [var(n) for n in names(primitive)]
    terms = (*primitive.kinks(*args), *primitive.edges(*args), *(primitive.partials or (lambda *a: ()))(*args))
    assert not [problem for term in terms for problem in lint(term)]


@pytest.mark.parametrize("primitive", NUMERIC, ids=by_name)
@settings(deadline=None, max_examples=12)
@given(data=st.data())
def test_values_agree_with_mpmath(primitive: Primitive, data: st.DataObject) -> None:
    """Within 8 ulp of the value plus what half an ulp of the arguments changes (sin of 1000 has that conditioning)."""
    point = data.draw(points(primitive))
    value = float(builtin(primitive.name, *point))
    with mp.workdps(40):
        wanted = exact(primitive, *point)
        slopes = [] if primitive.partials is None else list(primitive.partials(*map(const, point)))
        bend = sum(abs(mp.mpf(x)) * abs(size) for x, s in zip(point, slopes) if mp.isfinite(size := evaluate(s)))
        assert abs(mp.mpf(value) - wanted) <= 8 * EPS * (abs(wanted) + bend) + mp.mpf("1e-300")


# Derivatives


@pytest.mark.parametrize("primitive", SMOOTH, ids=by_name)
@settings(deadline=None, max_examples=12)
@given(data=st.data())
def test_partials_agree_with_mpmath(primitive: Primitive, data: st.DataObject) -> None:
    """The formulas at 40 digits against differences at 110: 1e-25 relative is all that differences keep, and where a
    derivative is 0 they keep the square of their step of 1e-30."""
    point = data.draw(points(primitive))
    assume(regular(primitive, point))
    env = dict(zip(names(primitive), point))
    formulas = primitive.partials(*map(var, names(primitive)))  # type: ignore[misc]
    for i, formula in list(enumerate(formulas))[primitive.orders :]:
        with mp.workdps(110):
            wanted = slope(primitive, point, i)
        found = evaluate(formula, env, digits=40)
        allowed = mp.mpf("1e-25") * (abs(wanted) + abs(exact(primitive, *point)) * EPS) + mp.mpf("1e-60")
        assert abs(found - wanted) <= allowed


def slope(primitive: Primitive, point: tuple[float, ...], i: int) -> mp.mpf:
    def along(x: mp.mpf) -> mp.mpf:
        return function(primitive.name)(*map(mp.mpf, point[:i]), x, *map(mp.mpf, point[i + 1 :]))

    # A step that is short beside every argument: where two of them are tiny, the function bends within their size.
    return mp.diff(along, mp.mpf(point[i]), h=mp.mpf(10) ** -30 * min(1, *(abs(x) for x in point if x), 1))


@pytest.mark.parametrize("primitive", SMOOTH, ids=by_name)
@settings(deadline=None, max_examples=12)
@given(data=st.data())
def test_partials_keep_their_digits_in_doubles(primitive: Primitive, data: st.DataObject) -> None:
    """16 ulp of the derivative, plus 16 ulp of its arguments times how fast it changes with them.

    The inverses of erf and erfc pass through exp(r^2), whose argument is rounded: r^2 ulp more, up to 15^2.
    """
    point = data.draw(points(primitive))
    assume(regular(primitive, point))
    holders = names(primitive)
    env = dict(zip(holders, point))
    for formula in primitive.partials(*map(var, holders))[primitive.orders :]:  # type: ignore[misc]
        wanted = evaluate(formula, env, digits=40)
        changes = (abs(evaluate(partial(formula, n), env, digits=40) * env[n]) for n in holders[primitive.orders :])
        allowed = (400 if primitive.name in ("erfinv", "erfcinv") else 16) * EPS * (
            abs(wanted) + sum(changes, mp.mpf(0))
        ) + mp.mpf("1e-300")
        if abs(wanted) < mp.mpf("1e300"):
            assert abs(mp.mpf(double(formula, env)) - wanted) <= allowed


@pytest.mark.parametrize(
    ("op", "point", "wanted"),
    [
        ("pow", (0.0, 2.0), 0.0),
        ("pow", (0.0, 1.0), 1.0),
        ("pow", (0.0, 0.0), 0.0),
        ("pow", (-2.0, 3.0), 12.0),
        ("tanh", (800.0,), 0.0),
        ("atan", (1e200,), 0.0),
        ("hypot", (3e200, 4e200), 0.6),
        ("atan2", (1e-200, 1e-200), 5e199),
        ("erf", (1e10,), 0.0),
        ("asin", (1 - 2**-52,), 1 / math.sqrt(2**-52 * (2 - 2**-52))),
    ],
)
def test_partials_at_hard_points(op: str, point: tuple[float, ...], wanted: float) -> None:
    """By the first argument, where a careless formula gives nan or nothing: exact, or within 4 ulp."""
    formula = PRIMITIVES[op].partials(*map(const, point))[0]  # type: ignore[misc]
    assert double(formula, {}) == pytest.approx(wanted, rel=4 * EPS, abs=0)


def test_a_power_with_a_constant_exponent_has_no_logarithm() -> None:
    square = partial(prim("pow", var("x"), const(2.0)), "x")
    assert not [n for n in postorder(square) if isinstance(n, Prim) and n.op == "log"]
    assert double(partial(prim("pow", var("x"), const(0.0)), "x"), {"x": 0.0}) == 0
    assert double(partial(prim("pow", var("x"), var("n")), "n"), {"x": 0.0, "n": 2.0}) == 0


@pytest.mark.parametrize("primitive", [p for p in SMOOTH if p.kinks(*map(var, names(p)))], ids=by_name)
@settings(deadline=None, max_examples=12)
@given(data=st.data())
def test_at_a_kink_the_derivative_is_one_sided(primitive: Primitive, data: st.DataObject) -> None:
    """On the kink itself the partials are those of one of the two sides, which differ by no more than the kink."""
    if primitive.name in ("hypot", "atan2"):
        return  # smooth except where all arguments are 0 or on the cut: the terms only say where to be careful
    first, second = data.draw(st.tuples(st.floats(-5, 5), st.floats(6, 9)))
    point = (0.0,) if primitive.arity == 1 else (first, first, second)
    formulas = primitive.partials(*map(var, names(primitive)))  # type: ignore[misc]
    slopes = [double(f, dict(zip(names(primitive), point))) for f in formulas]
    if primitive.name == "between":  # at a, which is where x is: to the right of it
        assert slopes == pytest.approx([1 / (second - first), -1 / (second - first), 0], rel=1e-14)
        return
    assert set(slopes) <= {-1.0, 0.0, 1.0}
    if primitive.arity != 1:
        assert sum(slopes) == 1  # all arguments moved together move the value


# Inverses, periods, order


@pytest.mark.parametrize("primitive", INVERTIBLE, ids=by_name)
@settings(deadline=None, max_examples=12)
@given(data=st.data())
def test_inverses_solve(primitive: Primitive, data: st.DataObject) -> None:
    """Every solution that is a number solves f(x) = y, and one of them is x (or differs by a period)."""
    x = data.draw(points(primitive))[0]
    with mp.workdps(340):  # erf(20) differs from 1 in its 176th digit, tanh(300) in its 261st
        y = exact(primitive, x)
        solutions = [*primitive.inverse(var("y"))]  # type: ignore[misc]
        period = None
        if primitive.period is not None:
            period, further = primitive.period(var("y"))
            solutions += further
        roots = [r for s in solutions if mp.isfinite(r := evaluate(s, {"y": y}, digits=320))]
        assert roots
        for root in roots:
            back = function(primitive.name)(root)
            assert abs(back - y) <= mp.mpf("1e-60") * max(1, abs(y))
        turns = [(x - r) / evaluate(period, {}, digits=320) for r in roots] if period is not None else []
        near = [abs(t - mp.nint(t)) for t in turns] or [abs(r - x) / max(1, abs(mp.mpf(x))) for r in roots]
        assert min(near) < mp.mpf("1e-25")  # asin next to 1 keeps only half of the digits


@pytest.mark.parametrize("primitive", INVERTIBLE, ids=by_name)
def test_inverses_give_nan_outside_of_the_range(primitive: Primitive) -> None:
    outside = {"sqrt": -1.0, "exp": -1.0, "expm1": -2.0, "sin": 2.0, "cos": 2.0, "asin": 2.0, "acos": -1.0, "abs": -1.0}
    outside |= {"atan": 2.0, "cosh": 0.5, "tanh": 2.0, "acosh": -1.0, "erf": 2.0, "erfc": 3.0}
    if primitive.name in outside:
        for solution in primitive.inverse(const(outside[primitive.name])):  # type: ignore[misc]
            assert math.isnan(double(solution, {}))


@pytest.mark.parametrize("primitive", [p for p in NUMERIC if p.period is not None], ids=by_name)
def test_periods(primitive: Primitive) -> None:
    period, further = primitive.period(const(0.3))  # type: ignore[misc]
    with mp.workdps(40):
        length = evaluate(period, {})
        for x in map(mp.mpf, ("0.1", "1.3", "-2.2")):
            f = function(primitive.name)
            assert abs(f(x + length) - f(x)) < mp.mpf("1e-35")
        for solution in further:
            assert abs(function(primitive.name)(evaluate(solution, {})) - mp.mpf(0.3)) < mp.mpf("1e-25")


@pytest.mark.parametrize("primitive", [p for p in NUMERIC if p.arity == 1], ids=by_name)
@settings(deadline=None, max_examples=12)
@given(data=st.data())
def test_order(primitive: Primitive, data: st.DataObject) -> None:
    a, b = sorted(data.draw(st.tuples(*(numbers(*primitive.domain[0]),) * 2)))
    assume(b - a > 1e-9 * max(1, abs(a)))
    with mp.workdps(700):  # erfc(20) and tanh(300) differ from their limits far to the right
        difference = exact(primitive, b) - exact(primitive, a)
    if primitive.increasing:
        assert difference * primitive.increasing > 0


def test_kinks_are_where_the_sides_meet() -> None:
    a, b, c = var("a"), var("b"), var("c")
    assert PRIMITIVES["max"].kinks(a, b) == (sub(a, b),)
    assert len(PRIMITIVES["min"].kinks(a, b, c)) == 3
    assert PRIMITIVES["abs"].kinks(a) == (a,)
    assert PRIMITIVES["pow"].edges(a, const(2.0)) == ()
    assert PRIMITIVES["pow"].edges(a, const(0.5)) == (a,)
    assert isinstance(PRIMITIVES["neg"].inverse(const(2.0))[0], Const)  # type: ignore[misc]


@pytest.mark.parametrize("order", [0, 1])
def test_bessel_functions_far_out(order: int) -> None:
    """The phase x - pi/4 is not rounded: within 4e-16 and two units in the last place (of 0.25 at most), as is said."""
    f = potto.compile(f"def f(x) besselj{order}(x)").f
    for x in (10.0, 24.9, 25.1, 1e3, 12345.678, -1e4, 1e8):
        found = f(x)
        with mp.workdps(40):
            assert abs(found.value - mp.besselj(order, x)) <= found.error <= 4e-16 + 2 * 2**-52 * 0.25


def test_the_bend_of_tanh_far_out() -> None:
    """0 from 800 on, where cosh is more than a double holds."""
    assert potto.hessian(potto.compile("def f(x) tanh(x)").f)(800.0).value == 0.0
