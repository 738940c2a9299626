"""A builtin of which an entry says nothing but its formula is solved and enclosed by that."""

from __future__ import annotations

import pytest

from potto.calculus.algebra.ranges import RANGES, range_of
from potto.calculus.solving.enclosable import enclosable
from potto.calculus.solving.solve import Sections, sections
from potto.core.terms import ONE, const, mul, neg, prim, sub, var
from potto.integrate.rules.intervals import INTERVALS, enclosure
from potto.primitives import PRIMITIVES, Primitive

T, X = var("t"), var("x")


@pytest.fixture(autouse=True)
def coversin(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = Primitive(
        "coversin",
        arity=1,
        formula=lambda x: sub(ONE, prim("sin", x)),
        doc="1 - sin(x).",
        partials=lambda x: (neg(prim("cos", x)),),
        domain=((-50.0, 50.0),),
    )
    monkeypatch.setitem(PRIMITIVES, "coversin", entry)


def test_its_values_are_between_bounds() -> None:
    term = prim("coversin", X)
    assert RANGES.knows("coversin") and INTERVALS.knows("coversin") and enclosable(term)
    bounds = range_of(term)
    assert -1e-14 <= bounds.lo <= 0 and 2 <= bounds.hi <= 2 + 1e-14
    ((lo, hi),) = enclosure((term,), {"x": (0.0, 0.1)})
    assert 0.9 <= float(lo) <= 0.9001666 and 1 <= float(hi) <= 1 + 1e-14  # sin(0.1) = 0.09983


def test_its_equations_are_those_of_the_formula() -> None:
    three = mul(const(3.0), X)
    found = sections(sub(prim("coversin", three), T), "x")
    written = sections(sub(sub(ONE, prim("sin", three)), T), "x")
    assert isinstance(found, Sections) and isinstance(written, Sections)
    assert found.complete and [f.root for f in found.families] == [f.root for f in written.families]
