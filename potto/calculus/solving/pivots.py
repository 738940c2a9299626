"""Which variable of integration a surface is solved for.

Owns `pivots`. The innermost variable that the surface can be solved for in closed form; for an affine surface the
variable of the largest slope, chosen at run time where slopes are known only then.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from msgspec import Struct

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.ranges import range_of
from potto.calculus.solving.solve import Family, Sections, sections
from potto.calculus.surfaces.branch_assignment import unguarded
from potto.core.terms import Const, Integral, Term, const, if_, prim, substitute


class NoClosedForm(Exception):
    """A boundary that cannot be written with the builtins; evaluation finds it by numbers."""


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


def pivots(node: Integral, surface: Term, folding: bool = True) -> list[Pivot]:
    """Where a surface cuts the integral, solved for the innermost variable that it can be solved for.

    An affine surface whose slopes are known only at run time is solved for the variable of the largest slope then:
    the others may be 0. The pivots are tried in order, the last one has no condition.
    folding: also for one along which the surface turns back as the others vary, where what is added up is infinite.
    """
    slopes: dict[str, Term] = {}
    for name in reversed(node.variables):
        found = affine(surface, (name,)) if name in surface.free else None
        if found is not None and not found.coefficients[0].free & frozenset(node.variables):
            slopes[name] = found.coefficients[0]
    order = [n for n in reversed(node.variables) if n in surface.free]
    if len(slopes) < 2 or order[0] not in slopes:
        return [Pivot(_solved(node, surface, order, folding))]
    if all(isinstance(c, Const) for c in slopes.values()):
        sizes = {n: abs(c.value) for n, c in slopes.items() if isinstance(c, Const)}
        largest = max(sizes.values())
        name = next(n for n in order if sizes.get(n, 0.0) * _STEEP >= largest)
        return [Pivot(_solved(node, surface, [name]))]
    result: list[Pivot] = []
    for name, slope in slopes.items():
        others = [prim("le", prim("abs", c), prim("abs", slope)) for n, c in slopes.items() if n != name]
        result.append(Pivot(_solved(node, surface, [name]), conjunction(others)))
    return [*result[:-1], Pivot(result[-1].roots)]


_STEEP = 8.0  # a slope this much smaller than the largest one is still fine to divide by


def _solved(node: Integral, surface: Term, order: Sequence[str], folding: bool = True) -> list[SurfaceRoot]:
    reasons: list[str] = []
    for name in order:
        found = sections(surface, name)
        turning = () if folding or not isinstance(found, Sections) else found.turning
        if any(turn.free & frozenset(node.variables) for turn in turning):
            reasons.append(f"it turns back along `{name}`")
        elif isinstance(found, Sections) and _is_a_factor(node, surface, name, found):
            reasons.append(f"another part of it may run along `{name}`")
        elif isinstance(found, Sections) and found.complete:
            roots = [SurfaceRoot(name, r) for r in (*found.roots, *found.poles)]
            position = node.variables.index(name)
            return roots + [_family(node, position, f) for f in (*found.families, *found.pole_families)]
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


def _family(node: Integral, position: int, family: Family) -> SurfaceRoot:
    name, (lo, hi) = node.variables[position], node.bounds[position]
    ends = [substitute(family.inner, {name: end}) for end in (lo, hi)]
    if family.stops:
        ends += [substitute(family.inner, {name: _within(stop, lo, hi)}) for stop in family.stops]
    if any(map(_infinite, ends)) or any(not _finite(b) and _unbounded(e) for b, e in zip((lo, hi), ends, strict=False)):
        raise NoClosedForm(f"there are infinitely many roots in `{name}`")
    ends = _corners(node, position, ends)
    lowest, highest = _extreme("min", ends), _extreme("max", ends)
    counts = (_whole("ceil", lowest, 1.0), _whole("floor", highest, 0.0))
    return SurfaceRoot(name, family.root, family.index, counts)


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
