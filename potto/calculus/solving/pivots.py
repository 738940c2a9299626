"""Which variable of integration a surface is solved for.

Owns `Roots` and `pivots`. The innermost variable that the surface can be solved for in closed form; for an affine
surface the variable of the largest slope, chosen at run time where slopes are known only then.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from enum import Enum, auto
from functools import partial, reduce

from msgspec import Struct

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.ranges import Box, range_of
from potto.calculus.algebra.rational_form import is_zero
from potto.calculus.solving.solve import Family, Sections, sections
from potto.calculus.surfaces.branch_assignment import box_of, unguarded
from potto.core.simplify import simplify
from potto.core.terms import Const, Integral, Prim, Term, const, if_, prim, sub, substitute, transform
from potto.primitives import PRIMITIVES


class NoClosedForm(Exception):
    """A boundary that cannot be written with the builtins; evaluation finds it by numbers."""


class Roots(Enum):
    """Which roots are wanted in closed form.

    STEADY: but those along which the surface turns back as the others vary, where what is added up is infinite.
    ALL: these too. READ: all, as textbooks write them, whatever cancels in them: for formulas that are shown.
    """

    STEADY = auto()
    ALL = auto()
    READ = auto()


class SurfaceRoot(Struct, frozen=True):
    """A root of a surface in a variable of integration; `index` and `counts` when it is one of a periodic family."""

    variable: str
    at: Term
    index: str | None = None
    counts: tuple[Term, Term] | None = None


class Pivot(Struct, frozen=True):
    """The roots of a surface in one variable of integration; taken where the plain `condition` holds."""

    roots: list[SurfaceRoot]
    condition: Term | None = None


def pivots(node: Integral, surface: Term, wanted: Roots = Roots.ALL) -> list[Pivot]:
    """Where a surface cuts the integral, solved for the innermost variable that it can be solved for.

    An affine surface whose slopes are known only at run time is solved for the variable of the largest slope then:
    the others may be 0. The pivots are tried in order, the last one has no condition.
    """
    slopes: dict[str, Term] = {}
    for name in reversed(node.variables):
        found = affine(surface, (name,)) if name in surface.free else None
        if found is not None and not found.coefficients[0].free & frozenset(node.variables):
            slopes[name] = found.coefficients[0]
    order = [n for n in reversed(node.variables) if n in surface.free]
    if len(slopes) < 2 or order[0] not in slopes:
        return [Pivot(_solved(node, surface, order, wanted))]
    if all(isinstance(c, Const) for c in slopes.values()):
        sizes = {n: abs(c.value) for n, c in slopes.items() if isinstance(c, Const)}
        largest = max(sizes.values())
        name = next(n for n in order if sizes.get(n, 0.0) * _STEEP >= largest)
        return [Pivot(_solved(node, surface, [name], wanted))]
    result: list[Pivot] = []
    for name, slope in slopes.items():
        others = [prim("le", prim("abs", c), prim("abs", slope)) for n, c in slopes.items() if n != name]
        result.append(Pivot(_solved(node, surface, [name], wanted), conjunction(others)))
    return [*result[:-1], Pivot(result[-1].roots)]


_COUNTABLE = 1000.0  # integers, of which a person sees how many there are
_STEEP = 8.0  # a slope this much smaller than the largest one is still fine to divide by


def _solved(node: Integral, surface: Term, order: Sequence[str], wanted: Roots) -> list[SurfaceRoot]:
    reasons: list[str] = []
    for name in order:
        found = sections(surface, name, plain=wanted is Roots.READ)
        steep = found.steep if wanted is Roots.STEADY and isinstance(found, Sections) else ()
        if any(edge.free & frozenset(node.variables) for edge in steep):
            reasons.append(f"it turns back along `{name}`")
        elif isinstance(found, Sections) and _is_a_factor(node, surface, name, found):
            reasons.append(f"another part of it may run along `{name}`")
        elif isinstance(found, Sections) and found.complete:
            roots = [SurfaceRoot(name, r) for r in (*found.roots, *found.poles)]
            position = node.variables.index(name)
            return roots + [_family(node, position, f, wanted) for f in (*found.families, *found.pole_families)]
        else:
            reasons.append(found.reason)
    raise NoClosedForm(reasons[0] if reasons else "the surface varies with no variable of integration")


def _is_a_factor(node: Integral, surface: Term, name: str, found: Sections) -> bool:
    """Whether a root stands still while other variables vary: then the surface has a factor with this root, and a
    further one, as of abs(z)*t - z*y; where that does not vary with `name` it has no root in it."""
    others = surface.free & frozenset(node.variables) - {name}
    return bool(others) and any(not unguarded(root).free & others for root in found.roots)


def chosen(alternatives: Sequence[tuple[Term | None, Term]]) -> Term:
    """The term of the first pivot whose condition holds."""
    result = alternatives[-1][1]
    for condition, term in reversed(alternatives[:-1]):
        result = result if condition is None else if_(condition, term, result)
    return result


def _family(node: Integral, position: int, family: Family, wanted: Roots) -> SurfaceRoot:
    name, (lo, hi) = node.variables[position], node.bounds[position]
    inner, stops = family.inner, family.stops
    if wanted is Roots.READ:
        inner, stops = _continued(inner, name, stops)
    ends = [substitute(inner, {name: end}) for end in (lo, hi)]
    ends += [substitute(inner, {name: _within(stop, lo, hi)}) for stop in stops]
    if any(map(_infinite, ends)) or any(not _finite(b) and _unbounded(e) for b, e in zip((lo, hi), ends, strict=False)):
        raise NoClosedForm(f"there are infinitely many roots in `{name}`")
    if wanted is Roots.READ and (counts := _enclosing(ends, box_of(node))) is not None:
        return SurfaceRoot(name, family.root, family.index, counts)
    ends = _corners(node, position, ends)
    if wanted is Roots.READ:
        ends = list(dict.fromkeys(map(simplify, ends)))
        least, most = (reduce(partial(prim, op), ends) for op in ("min", "max"))
        return SurfaceRoot(name, family.root, family.index, (prim("ceil", least), prim("floor", most)))
    lowest, highest = _extreme("min", ends), _extreme("max", ends)
    counts = (_whole("ceil", lowest, 1.0), _whole("floor", highest, 0.0))
    return SurfaceRoot(name, family.root, family.index, counts)


def _continued(term: Term, name: str, stops: Iterable[Term]) -> tuple[Term, tuple[Term, ...]]:
    """A function of a variable going on as it ends where it has no value, and the stops that are no such ends."""
    edges: list[Term] = []

    def change(_: Term, new: Term) -> Term:
        if not isinstance(new, Prim) or name not in new.args[0].free or len(new.args) != 1:
            return new
        (low, high), inner = PRIMITIVES[new.op].within, new.args[0]
        bounds = range_of(inner)
        if bounds.lo < low:
            edges.append(sub(inner, const(low)))
            inner = prim("max", inner, const(low))
        if bounds.hi > high:
            edges.append(sub(const(high), inner))
            inner = prim("min", inner, const(high))
        return prim(new.op, inner)

    whole = transform(term, change)
    turns = [s for s in stops if not any(is_zero(substitute(edge, {name: s})) for edge in edges)]
    return whole, tuple(turns)


def _enclosing(ends: Iterable[Term], box: Box) -> tuple[Term, Term] | None:
    """The integers that can belong to a root in the domain, if these are known without the parameters, and few. Which
    of them do, the bounds ask of the root itself."""
    ranges = [range_of(end, box) for end in ends]
    low, high = min(r.lo for r in ranges), max(r.hi for r in ranges)
    if not high - low <= _COUNTABLE:
        return None
    return const(float(math.ceil(low))), const(float(math.floor(high)))


def _corners(node: Integral, position: int, ends: list[Term]) -> list[Term]:
    """The ends at the corners of the domain of the other variables: how many terms there are must not vary with these,
    or where each of them begins and ends would be hidden from the integral over them."""
    own = node.variables[position]
    for name, (lo, hi) in reversed(list(zip(node.variables, node.bounds, strict=True))):
        if name == own or not any(name in end.free for end in ends):
            continue
        known = own not in lo.free | hi.free and _finite(lo) and _finite(hi)
        if not known or any(affine(end, (name,)) is None for end in ends):
            raise NoClosedForm(f"how many roots there are in `{own}` varies with `{name}`")
        ends = list(dict.fromkeys(substitute(end, {name: bound}) for end in ends for bound in (lo, hi)))
    return ends


def _finite(bound: Term) -> bool:
    return not (isinstance(bound, Const) and abs(bound.value) == float("inf"))


def _infinite(end: Term) -> bool:
    return _unbounded(end) and range_of(end).lo == range_of(end).hi


def _unbounded(end: Term) -> bool:
    return max(abs(range_of(end).lo), abs(range_of(end).hi)) == math.inf


def _whole(op: str, end: Term, otherwise: float) -> Term:
    """An end of the range of the index; an empty range where the roots do not exist."""
    return if_(prim("eq", end, end), prim(op, end), const(otherwise))


def _within(stop: Term, lo: Term, hi: Term) -> Term:
    return prim("clamp", stop, prim("min", lo, hi), prim("max", lo, hi))


def _extreme(op: str, ends: list[Term]) -> Term:
    """The least or the greatest of the ends; one that is nan, where the index ends, does not count."""
    result = ends[0]
    for end in ends[1:]:
        either: Term = prim(op, result, end)
        if len(ends) > 2:  # there are stops, so there may be an end
            either = if_(prim("ne", result, result), end, if_(prim("ne", end, end), result, either))
        result = either
    return result


def conjunction(conditions: Iterable[Term]) -> Term:
    result: Term | None = None
    for condition in conditions:
        result = condition if result is None else prim("and", result, condition)
    assert result is not None
    return result
