"""Regions that affine conditions leave of a box, and proofs that nothing is left.

Owns `AffineForm`, `Forms` and `Polytope`. Coefficients may be terms in parameters. Each is carried with the number that
it is now, so that a proof is searched for by numbers; what it rests on is a list of terms, its premises, and the proof
holds for all parameters for which they are positive.

A conic combination of conditions f >= 0 and g >= 0 in which one variable cancels has to be somewhere positive in the
box; where it is not, no point meets both (Farkas). In one variable that is all there is to say.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Mapping

from msgspec import Struct

from potto.calculus.algebra.ranges import range_of
from potto.core.terms import (
    ONE,
    ZERO,
    Const,
    Integral,
    Prim,
    Term,
    Var,
    add,
    apply,
    children,
    const,
    div,
    mul,
    neg,
    unknown,
    var,
)

Number = Callable[[Term], float]  # what a plain term is now; nan if that is not known
MARGIN = 1e-12  # how much of its parts a bound must amount to, to be told from rounding


class Coefficient(Struct, frozen=True):
    """A plain term and the number that it is now."""

    term: Term
    value: float

    @classmethod
    def of(cls, term: Term, value: float) -> Coefficient:
        """A number is itself: 0*t is 0 also while t is not known."""
        return cls(term, term.value if isinstance(term, Const) else value)


NONE = Coefficient(ZERO, 0.0)


class AffineForm(Struct, frozen=True, eq=False):
    """rest + sum of slopes[name] * name."""

    rest: Coefficient
    slopes: Mapping[str, Coefficient]

    def term(self) -> Term:
        parts = [_product(c, Coefficient(var(name), math.nan)).term for name, c in self.slopes.items()]
        return add(*parts, *(() if self.rest.term is ZERO else (self.rest.term,)))


class Forms:
    """Affine forms of terms in some variables, each found once."""

    def __init__(self, names: frozenset[str], number: Number) -> None:
        self.names = names
        self.number = number
        self.known: dict[Term, AffineForm | None] = {}

    def of(self, term: Term) -> AffineForm | None:
        """The term as an affine function of the variables; None if it is not written as one."""
        for node in unknown(term, self.known, lambda node: children(node) if node.free & self.names else ()):
            self.known[node] = self._form(node)
        return self.known[term]

    def short(self, form: AffineForm) -> Term:
        """The term of a form, whose parts are known from now on."""
        for name, c in form.slopes.items():
            self.known.setdefault(c.term, AffineForm(c, {}))
            self.known.setdefault(_product(c, Coefficient(var(name), math.nan)).term, AffineForm(NONE, {name: c}))
        self.known.setdefault(form.rest.term, AffineForm(form.rest, {}))
        found = form.term()
        self.known.setdefault(found, form)
        return found

    def plain(self, term: Term) -> Coefficient:
        return Coefficient(term, self.number(term))

    def _form(self, node: Term) -> AffineForm | None:
        if not node.free & self.names:
            return AffineForm(self.plain(node), {})
        if isinstance(node, Var):
            return AffineForm(NONE, {node.name: Coefficient(ONE, 1.0)})
        if not isinstance(node, Prim) or node.op not in ("add", "neg", "mul", "div"):
            return None
        parts = [self.known[arg] for arg in node.args]
        forms = [part for part in parts if part is not None]
        if len(forms) < len(parts):
            return None
        if node.op == "neg":
            return _opposite(forms[0])
        if node.op == "add":
            return _sum(forms)
        if node.op == "div":
            below = forms[1]
            return None if below.slopes else _divided(forms[0], below.rest)
        varying = [form for form in forms if form.slopes]
        if len(varying) != 1:
            return None
        found = varying[0]
        for form in forms:
            found = found if form is varying[0] else scaled(found, form.rest)
        return found


def scaled(form: AffineForm, by: Coefficient) -> AffineForm:
    return AffineForm(_product(form.rest, by), {name: _product(c, by) for name, c in form.slopes.items()})


def _divided(form: AffineForm, by: Coefficient) -> AffineForm:
    return AffineForm(_quotient(form.rest, by), {name: _quotient(c, by) for name, c in form.slopes.items()})


def _sum(forms: list[AffineForm]) -> AffineForm:
    slopes: dict[str, list[Coefficient]] = {}
    for form in forms:
        for name, c in form.slopes.items():
            slopes.setdefault(name, []).append(c)
    found = {name: total(parts) for name, parts in slopes.items()}
    return AffineForm(total([form.rest for form in forms]), {n: c for n, c in found.items() if c.term is not ZERO})


def total(parts: list[Coefficient]) -> Coefficient:
    """The sum, its numbers added up."""
    terms: list[Term] = []
    number = 0.0
    for part in parts:
        for term in part.term.args if isinstance(part.term, Prim) and part.term.op == "add" else (part.term,):
            if isinstance(term, Const):
                number += term.value
            else:
                terms.append(term)
    whole = add(*terms, const(number)) if terms else const(number)
    if not terms:
        return Coefficient(whole, number)
    values = [part.value for part in parts]
    return Coefficient(whole, math.fsum(values) if all(map(math.isfinite, values)) else sum(values))


def _product(a: Coefficient, b: Coefficient) -> Coefficient:
    x, y = a.term, b.term
    value = a.value * b.value
    if isinstance(x, Const) and isinstance(y, Const):
        return Coefficient(const(value), value)
    if isinstance(y, Const):
        x, y = y, x
    if isinstance(x, Const) and isinstance(y, Prim) and y.op == "mul" and isinstance(y.args[0], Const):
        return Coefficient.of(mul(const(x.value * y.args[0].value), *y.args[1:]), value)
    return Coefficient.of(mul(x, y), value)


def _quotient(a: Coefficient, b: Coefficient) -> Coefficient:
    value = a.value / b.value if b.value else math.nan
    if isinstance(a.term, Const) and isinstance(b.term, Const) and value == value:
        return Coefficient(const(value), value)
    return Coefficient.of(div(a.term, b.term), value)


Premises = tuple[Term, ...]


class VariableBounds(Struct, frozen=True):
    """The bounds of one variable."""

    lo: Coefficient
    hi: Coefficient


class Polytope(Struct, eq=False):
    """What conditions leave of a box: each a form that is >= 0 there. decided: sides, by what they are known by."""

    box: Mapping[str, VariableBounds]
    conditions: tuple[AffineForm, ...] = ()
    decided: Mapping[Hashable, bool] = {}
    further: dict[tuple[Hashable, bool], tuple[Polytope | None, Premises]] = {}

    def side(self, key: Hashable, form: AffineForm | None, up: bool) -> tuple[Polytope | None, Premises]:
        """The part where a form is >= 0 (up) or <= 0: None if it is proved to be empty, with the proof's premises.

        key: what the form is known by, here and in the parts.
        """
        if key in self.decided:
            return (self if self.decided[key] == up else None), ()
        found = self.further.get((key, up))
        if found is None:
            found = self.further[key, up] = self._side(key, form, up)
        return found

    def _side(self, key: Hashable, form: AffineForm | None, up: bool) -> tuple[Polytope | None, Premises]:
        conditions = self.conditions
        if form is not None:
            form = form if up else _opposite(form)
            premises = self.empty(form)
            if premises is not None:
                return None, premises
            conditions = (*conditions, form)
        return Polytope(self.box, conditions, {**self.decided, key: up}), ()

    def empty(self, form: AffineForm) -> Premises | None:
        """The premises of a proof that the form is nowhere >= 0 in the region; None if none was found."""
        for combined, signs in self._combinations(form):
            size = _highest(combined, self.box)
            if size is not None and size[0] < -MARGIN * size[1]:
                return (*signs, *_below_zero(combined, self.box))
        return None

    def _combinations(self, form: AffineForm) -> Iterator[tuple[AffineForm, Premises]]:
        yield form, ()
        for other in reversed(self.conditions):
            for name, c in form.slopes.items():
                d = other.slopes.get(name)
                if d is None or not c.value * d.value < 0:
                    continue
                if not self._below((form, abs(d.value)), (other, abs(c.value)), name):
                    continue
                mine, its = (d, c) if d.value > 0 else (_negative(d), _negative(c))
                # mine > 0 > its: form * mine - other * its has no `name`
                yield (
                    _without(name, _sum([scaled(form, mine), scaled(other, _negative(its))])),
                    (
                        *_unless_number(mine.term),
                        *_unless_number(neg(its.term)),
                    ),
                )

    def _below(self, first: tuple[AffineForm, float], second: tuple[AffineForm, float], name: str) -> bool:
        """Whether the sum of two forms, each times a number, may be below 0 in the box, without `name`, which cancels.
        By numbers alone: of most conditions nothing follows, and terms take a hundred times as long."""
        (form, by), (other, its) = first, second
        high = form.rest.value * by + other.rest.value * its
        size = abs(high)
        for slope in form.slopes.keys() | other.slopes.keys():
            extent = self.box.get(slope)
            if slope == name:
                continue
            if extent is None:
                return False
            c = form.slopes.get(slope, NONE).value * by + other.slopes.get(slope, NONE).value * its
            part = max(c * extent.lo.value, c * extent.hi.value) if c else 0.0
            high, size = high + part, max(size, abs(part))
        return high < -0.5 * MARGIN * size


def _opposite(form: AffineForm) -> AffineForm:
    return scaled(form, Coefficient(const(-1.0), -1.0))


def _without(name: str, form: AffineForm) -> AffineForm:
    return AffineForm(form.rest, {n: c for n, c in form.slopes.items() if n != name})


def _negative(c: Coefficient) -> Coefficient:
    return _product(c, Coefficient(const(-1.0), -1.0))


def _unless_number(term: Term) -> Premises:
    return () if isinstance(term, Const) else (term,)


def _highest(form: AffineForm, box: Mapping[str, VariableBounds]) -> tuple[float, float] | None:
    """An upper bound of a form in a box, and how large the parts are; None if there is none."""
    high, size = form.rest.value, abs(form.rest.value)
    for name, c in form.slopes.items():
        extent = box.get(name)
        if extent is None:
            return None
        ends = c.value * extent.lo.value, c.value * extent.hi.value
        part = max(ends)
        if not math.isfinite(part) or any(map(math.isnan, ends)):
            return None
        high, size = high + part, max(size, abs(part))
    return (high, size) if math.isfinite(high) else None


def _below_zero(form: AffineForm, box: Mapping[str, VariableBounds]) -> Premises:
    """The term that is positive where the upper bound is negative."""
    parts: list[Coefficient] = [form.rest]
    for name, c in form.slopes.items():
        ends = _product(c, box[name].lo), _product(c, box[name].hi)
        larger = max(ends, key=lambda end: end.value)
        if all(isinstance(end.term, Const) for end in ends):
            parts.append(larger)
        else:
            parts.append(Coefficient(apply("max", ends[0].term, ends[1].term), larger.value))
    return _unless_number(_negative(total(parts)).term)


def region_of(around: Integral, forms: Forms, outer: Polytope) -> tuple[Polytope, Premises]:
    """What an integral's bounds leave inside of a region, and the premises that they do."""
    box, conditions, premises = dict(outer.box), list(outer.conditions), dict[Term, None]()
    for name, (lo, hi) in zip(around.variables, around.bounds, strict=True):
        if not (lo.free | hi.free) & forms.names:
            box[name] = VariableBounds(forms.plain(lo), forms.plain(hi))
            continue
        found = [range_of(bound, {n: _widest(e) for n, e in box.items()}) for bound in (lo, hi)]
        low, high = min(r.lo for r in found), max(r.hi for r in found)
        first, last = forms.of(lo), forms.of(hi)
        if first is not None and last is not None:
            turned = Polytope(box, tuple(conditions)).empty(_sum([first, _opposite(last)]))
            if turned is not None:  # they are never the other way round
                here = AffineForm(NONE, {name: Coefficient(ONE, 1.0)})
                conditions += [_sum([here, _opposite(first)]), _sum([last, _opposite(here)])]
                premises |= dict.fromkeys(turned)
        box[name] = VariableBounds(Coefficient(const(low), low), Coefficient(const(high), high))
    return Polytope(box, tuple(conditions)), tuple(premises)


def _widest(extent: VariableBounds) -> tuple[float, float]:
    if isinstance(extent.lo.term, Const) and isinstance(extent.hi.term, Const):
        return extent.lo.value, extent.hi.value
    return -math.inf, math.inf
