"""Every builtin has a rule in every domain, and the rules hold: enclosures enclose, exact values are exact."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import pytest
from builtin_terms import EPS, builtin, nearest_order
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mpmath import mp

from potto.calculus.algebra.floats import FLOATS
from potto.calculus.algebra.ranges import ARITHMETIC, RANGES, ranges
from potto.core.reference import function
from potto.core.reference.functions import sphericalj
from potto.core.terms import Const, const, postorder, prim, var
from potto.integrate.rules.complex_enclosures import DISCS, Form, enclosed
from potto.integrate.rules.intervals import INTERVALS, enclosure
from potto.integrate.rules.magnitudes import log_magnitude
from potto.kernels.support import ARRAYS
from potto.primitives import EXACT, PRIMITIVES, Primitive
from potto.primitives.walking import Domain

DOMAINS: dict[str, Domain[Any]] = {
    "floats": FLOATS, "ranges": RANGES, "intervals": INTERVALS, "discs": DISCS, "arrays": ARRAYS,
}  # fmt: skip
NUMERIC = [p for p in PRIMITIVES.values() if not p.truth]
ROUNDED = 1e-14  # what bounds of logarithms leave out, of themselves
OF_ONE = [p for p in NUMERIC if p.arity == 1]
OF_ONE_AND_ORDERS = [p for p in NUMERIC if p.arity == p.orders + 1]


def by_name(primitive: Primitive) -> str:
    return primitive.name


@pytest.mark.parametrize("domain", [*DOMAINS, "mpmath", "derivatives"])
@pytest.mark.parametrize("primitive", PRIMITIVES.values(), ids=by_name)
def test_no_rule_is_missing(primitive: Primitive, domain: str) -> None:
    """An entry names those that there are none of in `lacks`, and has all others."""
    match domain:
        case "mpmath":
            known = callable(function(primitive.name))
        case "derivatives":
            known = primitive.partials is not None or primitive.plain
        case "ranges" | "intervals":
            known = primitive.name in ARITHMETIC or primitive.truth or DOMAINS[domain].knows(primitive.name)
        case "discs":
            known = not primitive.analytic or DISCS.knows(primitive.name)
        case _:
            known = DOMAINS[domain].knows(primitive.name)
    assert known == (domain not in primitive.lacks), f"{primitive.name} has no rule for {domain}"


def ends(primitive: Primitive) -> st.SearchStrategy[list[tuple[float, float]]]:
    """Bounds of every argument, now wide, now narrow."""

    def bounds(lo: float, hi: float) -> st.SearchStrategy[tuple[float, float]]:
        lo, hi = max(lo, -40.0), min(hi, 40.0)
        width = st.sampled_from([0.0, 1e-9, 1e-3, 0.3, 4.0, 100.0])
        return st.builds(lambda a, w: (a, min(a + w, hi)), st.floats(lo, hi), width)

    def order(lo: float, hi: float) -> st.SearchStrategy[tuple[float, float]]:
        return st.floats(lo, hi).map(lambda x: (nearest_order(primitive, x),) * 2)

    domain = primitive.domain * (2 if primitive.arity is None else 1)
    orders, others = domain[: primitive.orders], domain[primitive.orders :]
    return st.tuples(*(order(*b) for b in orders), *(bounds(*b) for b in others)).map(list)


@pytest.mark.parametrize("primitive", [p for p in NUMERIC if "intervals" not in p.lacks], ids=by_name)
@settings(deadline=None, max_examples=40)
@given(data=st.data())
def test_intervals_enclose(primitive: Primitive, data: st.DataObject) -> None:
    """Of batches and of single ones, at the ends, in the middle, and anywhere else. Against mpmath."""
    box = data.draw(ends(primitive))
    names = [f"a{i}" for i in range(len(box))]
    k = primitive.orders
    term = prim(primitive.name, *(const(a) for a, _ in box[:k]), *map(var, names[k:]))
    batch = {n: (np.array([a]), np.array([b])) for n, (a, b) in zip(names, box)}
    ((low, high),), log = enclosure((term,), batch), float(np.max(log_magnitude(term, batch)))
    one = ranges(term, dict(zip(names, box)))[term]
    shares = [(s,) * len(box) for s in (0.0, 0.5, 1.0)]
    shares += data.draw(st.lists(st.tuples(*(st.floats(0, 1) for _ in box)), min_size=4, max_size=4))
    for share in shares:
        point = [min(a + s * (b - a), b) for (a, b), s in zip(box, share)]
        with mp.workdps(40):
            value = function(primitive.name)(*map(mp.mpf, point))
        if mp.isnan(value) or 0 < abs(value) < 1e-300:
            continue
        assert low[0] <= value <= high[0], (point, value)
        assert one.lo <= value <= one.hi, (point, value)
        assert one.zero or value != 0
        assert primitive.image[0] <= value <= primitive.image[1]
        assert not value or mp.log(abs(value)) <= log + ROUNDED * (1 + abs(log)), (point, value)


@pytest.mark.parametrize("primitive", [p for p in OF_ONE_AND_ORDERS if p.analytic and p.remainder], ids=by_name)
@settings(deadline=None, max_examples=40)
@given(data=st.data())
def test_discs_enclose(primitive: Primitive, data: st.DataObject) -> None:
    """What the linear part leaves is no more than the remainder, on the rim and inside, against mpmath."""
    orders = [nearest_order(primitive, data.draw(st.floats(lo, hi))) for lo, hi in primitive.domain[:-1]]
    lo, hi = primitive.domain[-1]
    if "inv" in primitive.name:  # the inverse of erf in the plane is searched for, from nearby
        lo, hi = lo + 0.3, hi - 0.3
    m = data.draw(st.floats(max(lo, -30.0), min(hi, 30.0)))
    d = data.draw(st.sampled_from([1e-6, 1e-3, 0.1, 0.5, 1.0, 3.0]))
    h = np.array([[d]])
    x = Form(np.array([m]), np.ones((1, 1)), 0.0, h)
    with np.errstate(all="ignore"):
        (form,) = enclosed((prim(primitive.name, *map(const, orders), var("x")),), {"x": x}, {}, h)
    assume(np.isfinite(form.r).all() and form.g is not None)
    turns = data.draw(st.lists(st.floats(0, 2 * math.pi), min_size=6, max_size=6))
    with mp.workdps(30):
        f = complex_form(primitive, orders)
        centre, slope = f(mp.mpf(m)), mp.diff(f, mp.mpf(m))
        for k, turn in enumerate((0.0, math.pi / 2, math.pi, *turns)):
            s = mp.mpc(d * cmath.exp(1j * turn)) * (1 if k < 6 else mp.mpf("0.7"))
            beyond = abs(f(m + s) - centre - slope * s)
            assert beyond <= float(form.r[0]) * (1 + 1e-9) + 1e-13 * abs(centre), (m, d, turn)


def complex_form(primitive: Primitive, orders: list[float]) -> Any:
    """The function in the complex plane, as mpmath has it."""
    if primitive.name.startswith("erf") and primitive.name.endswith("inv"):
        turned = primitive.name == "erfcinv"
        return lambda y: mp.findroot(lambda z: (mp.erfc if turned else mp.erf)(z) - y, (1 - y if turned else y) * 0.9)
    if primitive.name in ("besselj0", "besselj1"):
        return lambda z: mp.besselj(int(primitive.name[-1]), z)
    if primitive.name == "sphericalj":
        return lambda z: sphericalj(orders[0], z)
    return lambda z: getattr(mp, primitive.mpmath.removeprefix("potto."))(*orders, z)


@pytest.mark.parametrize("primitive", OF_ONE, ids=by_name)
def test_what_is_said_of_shapes(primitive: Primitive) -> None:
    """Parity, roots, exact values and turns, against mpmath."""
    f = function(primitive.name)
    with mp.workdps(40):
        for x in map(mp.mpf, ("0.3", "0.77")):
            if primitive.parity and abs(x) <= primitive.within[1]:
                assert f(-x) == primitive.parity * f(x)
        for (op, x), y in EXACT.items():
            if op == primitive.name:
                assert f(mp.mpf(x)) == y
        for turn in primitive.turns or ():
            h = mp.mpf("1e-6")
            assert (f(turn + h) - f(turn)) * (f(turn - h) - f(turn)) > 0
        for inside in (-0.5, 0.5, 1.5):
            least, most = primitive.within
            assert mp.isfinite(f(mp.mpf(inside))) or not least < inside < most


@pytest.mark.parametrize("primitive", OF_ONE, ids=by_name)
@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_values_are_as_good_as_is_said(primitive: Primitive, data: st.DataObject) -> None:
    """Doubles within the `ulp` and `off` of the entry (and half a place more, for rounding itself), against mpmath."""
    lo, hi = primitive.domain[0]
    x = data.draw(st.one_of(st.floats(max(lo, -30.0), min(hi, 30.0)), st.floats(max(lo, -3.0), min(hi, 3.0))))
    assume(x == 0 or abs(x) > 1e-30)
    with mp.workdps(60):
        wanted = function(primitive.name)(mp.mpf(x))
        off = abs(mp.mpf(float(builtin(primitive.name, x))) - wanted)
        plain = abs(mp.mpf(FLOATS.apply(primitive.name, (x,))) - wanted)
        allowed = (primitive.places(x) + 2) * EPS * abs(wanted) + 2 * primitive.strays(x) + mp.mpf("1e-300")
    assert off <= allowed
    assert plain <= 4 * allowed


@pytest.mark.parametrize("primitive", [p for p in NUMERIC if p.formula is not None], ids=by_name)
@settings(deadline=None, max_examples=20)
@given(data=st.data())
def test_formulas_are_what_they_define(primitive: Primitive, data: st.DataObject) -> None:
    assert primitive.formula is not None
    point = [data.draw(st.floats(max(lo, -3.0), min(hi, 3.0))) for lo, hi in primitive.domain]
    names = [f"a{i}" for i in range(len(point))]
    formula = primitive.formula(*map(var, names))
    assert not [node for node in postorder(formula) if isinstance(node, Const) and node.value != node.value]
    from potto.core.reference import evaluate

    with mp.workdps(40):
        wanted = function(primitive.name)(*map(mp.mpf, point))
        found = evaluate(formula, dict(zip(names, point)))
        assert abs(found - wanted) <= mp.mpf("1e-20") * (1 + abs(wanted))


@pytest.mark.parametrize("primitive", [p for p in OF_ONE if p.partials], ids=by_name)
def test_builtins_that_are_steep_say_so(primitive: Primitive) -> None:
    """Where one of one argument has a value its slope is a number, at 0 and at the ends of where it is defined."""
    x = var("x")
    (slope,) = primitive.partials(x)  # type: ignore[misc]
    with np.errstate(all="ignore"):
        for place in {0.0, 1.0, -1.0, *primitive.within}:
            value, rise = ARRAYS.walk((prim(primitive.name, x), slope), {"x": np.float64(place)}, {})
            if np.isfinite(place) and np.isfinite(value) and not np.isfinite(rise):
                assert primitive.steep(x)
