"""Whether a condition can be integrated over: singular, invertible, solvable or none of it.

Owns `judge`, a pure function of a condition's coordinates, and the kinds of diagnostics that say no. For a condition
under an integral it is enough that its first coordinate can be solved for one variable of integration with all roots,
or that it is strictly monotone in one; a map with as many coordinates as variables must also not be singular. A bracket
or a delta needs no inverse: it is enough that its zeros can be searched for. What is declared a diffeomorphism must be
one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from msgspec import Struct

from potto.calculus.algebra.affine import determinant
from potto.calculus.algebra.ranges import Box, ranges
from potto.calculus.algebra.rational_form import is_zero
from potto.calculus.differentiation.derivative import NotSmooth, partial
from potto.calculus.inlining.reads import with_numbers_named
from potto.calculus.solving.enclosable import searchable
from potto.calculus.solving.inverse_map import Failure, InverseMap, dependence, invert, jacobian, listed
from potto.calculus.solving.solve import Sections, sections
from potto.calculus.surfaces.nested_brackets import in_loops, pieces
from potto.core.printer import LONGEST, abridged, format_term
from potto.core.terms import Branch, If, Integral, Prim, Term, postorder, var
from potto.diagnostics import Kind, declare
from potto.primitives import PRIMITIVES

SINGULAR = declare("P0401", "a map that is not invertible")
NO_INVERSE = declare("P0402", "a condition whose inverse was not found")
WRONG_INVERSE = declare("P0403", "the given inverse is wrong")
COMPONENTS = declare("P0404", "a diffeomorphism with the wrong number of components")
NOT_DIFFERENTIABLE = declare("P0405", "a diffeomorphism that is not differentiable")
MEASURE_ZERO = declare("P0406", "a condition that holds on no area", "warning")
SEARCHED = declare("P0616", "a surface that is searched for", "hint")


class ConditionProblem(Struct, frozen=True):
    """What is wrong with a condition, for a diagnostic to be made of."""

    kind: Kind
    message: str
    label: str = ""
    notes: tuple[str, ...] = ()
    help: str = ""


class Verdict(Struct, frozen=True):
    """A condition that can be integrated over.

    pivot: the variable that its first coordinate is solved for.
    completion: the coordinates that were left out and were added to make the map invertible.
    roots: the sections in the pivot; None where the coordinate is only known to be monotone, or is searched.
    searched: the surfaces whose zeros have to be searched for.
    """

    pivot: str
    completion: tuple[Term, ...]
    determinant: Term | None
    roots: Sections | None
    inverse: InverseMap | None = None
    searched: tuple[Term, ...] = ()


Role = Literal["bracket", "delta", "map"]


def judge(
    coordinates: Sequence[Term], variables: Sequence[str], box: Box, whole: bool = False, role: Role = "bracket"
) -> Verdict | ConditionProblem:
    """The verdict on a condition; `whole`: its author wrote all coordinates, as many as variables. What is a map or has
    several coordinates is declared a diffeomorphism, which must have an inverse."""
    if len(coordinates) > 1:
        role = "map"
    if any(map(in_loops, coordinates)):
        return _broken(coordinates) if role == "map" else _in_cases(coordinates[0], variables, box, role)
    return _judged(coordinates, variables, box, whole, role)


def _in_cases(surface: Term, variables: Sequence[str], box: Box, role: Role) -> Verdict | ConditionProblem:
    """The verdict on a condition with brackets inside: on each of its cases."""
    verdicts: list[Verdict] = []
    empty: ConditionProblem | None = None
    for case in pieces(surface):
        if in_loops(case) or not case.free.intersection(variables):
            continue
        found = _judged((case,), variables, box, False, role)
        if isinstance(found, Verdict):
            verdicts.append(found)
        elif found.kind is MEASURE_ZERO:
            empty = found
        else:
            return found
    if not verdicts:
        return empty or Verdict(next(v for v in variables if v in surface.free), (), None, None)
    searched = tuple(dict.fromkeys(case for found in verdicts for case in found.searched))
    return Verdict(verdicts[0].pivot, (), None, None, searched=searched)


def _broken(coordinates: Sequence[Term]) -> ConditionProblem:
    inner = next(node for c in coordinates for node in postorder(c) if isinstance(node, Branch))
    return ConditionProblem(
        NOT_DIFFERENTIABLE,
        f"the map jumps where `{format_term(inner.surface)}` is 0",
        "jumps",
        ("a diffeomorphism is differentiable everywhere, and so is its inverse",),
        "write it as a bracket, `[... >= 0]`, which may have brackets inside",
    )


def _judged(
    coordinates: Sequence[Term], variables: Sequence[str], box: Box, whole: bool, role: Role
) -> Verdict | ConditionProblem:
    """The verdict on a condition without brackets inside."""
    surface = coordinates[0]
    if len(coordinates) > 1:
        if whole and len(coordinates) > len(variables):
            return _too_many(coordinates, variables)
        if len(coordinates) == len(variables):
            problem = singular(coordinates, variables)
            if problem is not None:
                return problem
    problem = _empty(surface, box)
    if problem is not None:
        return problem
    reasons: list[str] = []
    mine = [v for v in variables if v in surface.free]
    for name in reversed(mine):
        found = sections(surface, name)
        if isinstance(found, Sections) and found.complete:
            return _solved(coordinates, variables, name, found)
        reasons.append(f"for `{name}`: {found.reason}")
    for name in reversed(mine):
        if monotone(surface, name, box):
            return _solved(coordinates, variables, name, None)
    if len(coordinates) == len(variables):
        try:
            inverse = invert(coordinates, variables)
        except NotSmooth:
            return no_inverse(surface, mine, reasons, role)
        if isinstance(inverse, InverseMap):
            return Verdict(mine[-1], (), inverse.determinant, None, inverse)
    enclosed = with_numbers_named(surface, variables)
    found_by_search = next((name for name in reversed(mine) if searchable(enclosed, name)), None)
    if role != "map" and found_by_search is not None:
        return Verdict(found_by_search, (), None, None, searched=(surface,))
    return no_inverse(surface, mine, reasons, role, found_by_search is not None)


def _solved(
    coordinates: Sequence[Term], variables: Sequence[str], name: str, found: Sections | None
) -> Verdict | ConditionProblem:
    """The coordinates that are missing are the other variables: with the first one solved for `name`, that inverts."""
    missing = tuple(var(v) for v in variables if v != name) if len(coordinates) < len(variables) else ()
    completed = (coordinates[0], *missing) if missing else tuple(coordinates)
    try:
        det = determinant(jacobian(completed, variables)) if len(completed) == len(variables) else None
    except NotSmooth as problem:
        return no_inverse(coordinates[0], list(variables), [f"for `{name}`: {problem}"])
    return Verdict(name, missing, det, found)


def monotone(surface: Term, name: str, box: Box) -> bool:
    """Whether the surface is strictly monotone in a variable throughout the box, as far as ranges show."""
    try:
        slope = partial(surface, name)
    except NotSmooth:
        return False
    bounds = ranges(slope, box)[slope]
    return bounds.positive or bounds.negative


# Problems


def shown(terms: Sequence[Term]) -> str:
    return ", ".join(f"`{abridged(t)}`" for t in terms)


def singular(coordinates: Sequence[Term], variables: Sequence[str]) -> ConditionProblem | None:
    try:
        rows = jacobian(coordinates, variables)
    except NotSmooth:
        return None
    det = determinant(rows)
    if not is_zero(det):
        return None
    table = "; ".join(", ".join(format_term(entry) for entry in row) for row in rows)
    return ConditionProblem(
        SINGULAR,
        f"({', '.join(map(format_term, coordinates))}) is not invertible in {listed(variables)}: its determinant is 0",
        "singular",
        (f"the derivative is ({table}), whose determinant is 0", dependence(coordinates, variables)),
        "let the coordinates vary independently; `diffeo(...)` and `[...]` may leave out all but the first",
    )


def _too_many(coordinates: Sequence[Term], variables: Sequence[str]) -> ConditionProblem:
    return ConditionProblem(
        COMPONENTS,
        f"{len(coordinates)} coordinates over {_count(len(variables))} of integration ({listed(variables)})",
        f"{len(coordinates)} coordinates",
        (),
        "give as many coordinates as variables, or the first one alone",
    )


def _count(n: int) -> str:
    return f"{n} variable" if n == 1 else f"{n} variables"


def _empty(surface: Term, box: Box) -> ConditionProblem | None:
    bounds = ranges(surface, box)[surface]
    if bounds.hi > 0:
        return None
    return ConditionProblem(
        MEASURE_ZERO,
        f"`{format_term(surface)}` is never positive, so the condition holds at most on a set without area",
        "never positive",
        (),
        "the integral is that of the other branch",
    )


_ADVICE: dict[Role, str] = {
    "bracket": "write the condition so that one variable can be isolated",
    "delta": "write the condition so that one variable can be isolated",
    "map": "write the bracket `[{0} >= 0]`, which needs no inverse",
}


def no_inverse(
    surface: Term, variables: Sequence[str], reasons: Sequence[str], role: Role = "bracket", searchable: bool = False
) -> ConditionProblem:
    help = _ADVICE[role if searchable else "bracket"].format(format_term(surface))  # it is to be written
    integrals = [node for node in postorder(surface) if isinstance(node, Integral)]
    if integrals:  # neither can be done: an inverse is a formula, and is verified as one
        inner = next((node for node in integrals if not node.free.isdisjoint(variables)), integrals[0])
        reasons = (*reasons, "integrals are evaluated numerically, and the surface must be known beforehand")
        what = " or ".join(f"`{name}`" for name in variables if name in inner.free)
        help = f"write `{format_term(inner)}` as a formula in {what}" if what else help
    return ConditionProblem(
        NO_INVERSE,
        f"no inverse was found for `{abridged(surface)}` in {listed(variables, 'or')}",
        "cannot be solved for where it is 0",
        tuple(reasons),
        help,
    )


def searched(surfaces: Sequence[Term], variables: Sequence[str], roots: str) -> ConditionProblem:
    """What to say of surfaces that have no closed form along any variable."""
    further = [v for v in variables if v != roots]
    cost = f"once for each node in {listed(further)}" if further else "once for each value of the integral"
    what = f"where {shown(surfaces)} {'is' if len(surfaces) == 1 else 'are'} 0"
    if any(len(format_term(surface)) > LONGEST for surface in surfaces):  # what is written says more, and stands there
        what = "this surface"
    return ConditionProblem(
        SEARCHED,
        f"{what} has no closed form: it is searched for",
        "searched for",
        (f"`{roots}` is halved until interval arithmetic has told all roots apart, {cost}",),
        "nothing has to be done; a condition that can be solved for a variable is faster",
    )


def kinks(coordinates: Sequence[Term], variables: Sequence[str], box: Box) -> Term | None:
    """A place where a coordinate is not differentiable: the term whose zeros are the kinks."""
    names = frozenset(variables)
    for node in postorder(*coordinates):
        if isinstance(node, If) and node.condition.free & names:
            return node.condition
        if not isinstance(node, Prim) or not node.free & names or not _bends(node):
            continue
        for kink in PRIMITIVES[node.op].kinks(*node.args):
            if kink.free & names:
                bounds = ranges(kink, box)[kink]
                if bounds.lo < 0 < bounds.hi:
                    return kink
    return None


def _bends(node: Prim) -> bool:
    """Whether a builtin's derivative jumps at its kinks; hypot's kink is a single point."""
    entry = PRIMITIVES.get(node.op)
    if entry is None or entry.partials is None:
        return False
    return any(isinstance(part, Branch) for part in postorder(*entry.partials(*node.args)))


def failure(found: Failure, coordinates: Sequence[Term], variables: Sequence[str]) -> ConditionProblem:
    """What to say when a diffeomorphism has no inverse."""
    return ConditionProblem(
        NO_INVERSE,
        f"no inverse was found for ({', '.join(map(format_term, coordinates))}) in {listed(variables)}",
        "no inverse found",
        (found.reason,),
        "add the inverse: `inverse (u, v) . (x, y)` with the variables in terms of the components",
    )
