"""Diffeomorphisms checked: each condition under an integral, and each definition of a diffeomorphism.

Owns the queries `check_conditions` and `diffeo_info`. What a condition is comes from `conditions`, whether it can be
integrated over from `verdict`; here both meet the program: places, the author's `inverse` and `where`, messages.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache

from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.algebra.ranges import Box
from potto.calculus.checking.conditions import Condition, called_by, conditions_of, has_conditions, skeleton
from potto.calculus.checking.map_shapes import many, unknown_call, wrong_shape
from potto.calculus.checking.solvability import (
    COMPONENTS,
    NO_INVERSE,
    WRONG_INVERSE,
    ConditionProblem,
    Role,
    Verdict,
    failure,
    judge,
    searched,
    singular,
)
from potto.calculus.checking.soundness import is_sound, rests_on_guesses
from potto.calculus.differentiation.deltas import without_deltas
from potto.calculus.differentiation.derivative import NotSmooth
from potto.calculus.differentiation.dual import Differentiator
from potto.calculus.inlining.expand import Resolve, expanded
from potto.calculus.inlining.numbers import as_parameters
from potto.calculus.inlining.relevance import may_integrate
from potto.calculus.solving.inverse_map import Failure, InverseMap, invert, listed
from potto.calculus.solving.isolate import Guard
from potto.calculus.solving.pivots import NoClosedForm
from potto.calculus.solving.verify import Refuted, Untested, Verified, box_of, guards_of, verify
from potto.calculus.surfaces.branch_assignment import unguarded
from potto.calculus.surfaces.trace import spine
from potto.core.simplify import simplify
from potto.core.terms import (
    App,
    Branch,
    Deriv,
    Global,
    Holding,
    Hole,
    Integral,
    Term,
    postorder,
    stem,
    substitute,
    var,
)
from potto.diagnostics import Diagnostic, PottoError
from potto.elaborate import core, core_term, diffeo_core
from potto.modules import chunk_text, definition
from potto.query import Database, query
from potto.source import Span
from potto.syntax import nodes
from potto.syntax.walk import walk

_Bounds = tuple[tuple[str, tuple[float, float]], ...]


class DiffeoInfo(Struct, frozen=True):
    """What is known of a diffeomorphism, for hover and `potto deriv`.

    branches: the variables over the values of the components, once for each branch; empty if there is none.
    values: names for the values of the components, as `branches` uses them.
    proven: shown by symbols; else `notes` say what was tried.
    """

    name: str
    variables: tuple[str, ...]
    parameters: tuple[tuple[str, ...], ...]
    components: tuple[Term, ...]
    values: tuple[str, ...]
    branches: tuple[tuple[Term, ...], ...]
    determinant: Term | None
    method: str
    proven: bool
    notes: tuple[str, ...] = ()


class _Study(Struct, frozen=True):
    diagnostics: tuple[Diagnostic, ...]
    info: DiffeoInfo | None


@query
def check_conditions(db: Database, file: str, name: str) -> tuple[Diagnostic, ...]:
    """The diagnostics of a definition's conditions (spans relative to it), or of the diffeomorphism that it is."""
    item = definition(db, file, name)
    if isinstance(item, nodes.DiffeoDefinition):
        return _studied(db, file, name).diagnostics
    if not may_integrate(db, file, name) or rests_on_guesses(db, file, name):
        return ()
    elaborated = core(db, file, name)
    found = conditions_of(elaborated.term, lambda g: exported(db, g.module, g.name), lambda g: _faultless(db, g))
    spans = dict(elaborated.origins)
    fallback = Span(0, 0) if item is None else item.name_span
    products = _products(db, elaborated.term, found, spans, fallback)
    maps = _maps(item, chunk_text(db, file, name))
    return (*_judged(found, spans, fallback, maps, lambda g: _whole(db, g)), *products)


def _maps(item: nodes.Definition | None, text: str | None) -> frozenset[Span]:
    """Where a definition says `diffeo(...)`: most do not, and are not looked through."""
    if item is None or text is None or "diffeo" not in text:
        return frozenset()
    return frozenset(node.span for node in walk(item) if isinstance(node, nodes.InlineDiffeo))


@query
def diffeo_info(db: Database, file: str, name: str) -> DiffeoInfo | None:
    """Inverse and determinant of a diffeomorphism; None for other definitions."""
    if not isinstance(definition(db, file, name), nodes.DiffeoDefinition):
        return None
    return _studied(db, file, name).info


def _exported_in_cycle(db: Database, file: str, name: str) -> Term | None:
    """Of a recursive definition nothing is left out."""
    return skeleton(core_term(db, file, name))


@query(cycle=_exported_in_cycle, travels=True)
def exported(db: Database, file: str, name: str) -> Term | None:
    """The conditions and calls of a definition over its parameters: what a caller's check reads.

    None of one that is wrong itself, or uses one that is guessed: what that would lead to is no fault of its callers.
    """
    if not is_sound(db, file, name) or rests_on_guesses(db, file, name):
        return None
    return skeleton(core_term(db, file, name), lambda g: has_conditions(exported(db, g.module, g.name)))


def _whole(db: Database, target: Global) -> Term | None:
    return core_term(db, target.module, target.name) if is_sound(db, target.module, target.name) else None


def _faultless(db: Database, target: Global) -> Term | None:
    """As `_whole`, but None of a diffeomorphism that is none: that is said where it is defined, and not at each use."""
    item = definition(db, target.module, target.name)
    if isinstance(item, nodes.DiffeoDefinition) and _whole(db, target) is not None:
        studied = _studied(db, target.module, target.name)
        if any(said.severity == "error" for said in studied.diagnostics):
            return None
    return _whole(db, target)


# Conditions under integrals


def _judged(
    found: Iterable[Condition], spans: Mapping[Term, Span], fallback: Span, maps: frozenset[Span], resolve: Resolve
) -> Iterable[Diagnostic]:
    """What is said of conditions; `maps` is where the text says `diffeo(...)`, `resolve` gives definitions."""
    said: set[tuple[str, Span, str]] = set()
    wrong = Holding(Hole)
    for condition in found:
        if any(map(wrong, condition.coordinates)):
            continue  # a diagnostic has said what is wrong there
        condition = _readable(condition)
        own = isinstance(condition.anchor, Branch) and condition.anchor.coordinates == condition.coordinates
        span = spans.get(condition.anchor, fallback)
        role: Role = "delta" if condition.delta else "map" if span in maps else "bracket"
        coordinates = tuple(as_parameters(c, resolve) for c in condition.coordinates)
        problem = _verdict(coordinates, condition.variables, tuple(condition.box.items()), own, role)
        if problem is not None:
            key = (problem.kind.code, span, problem.message)
            if key not in said:
                said.add(key)
                yield _diagnostic(problem, span, condition.calls)


@lru_cache(maxsize=4096)
def _verdict(
    coordinates: tuple[Term, ...], variables: tuple[str, ...], box: _Bounds, whole: bool, role: Role
) -> ConditionProblem | None:
    """What there is to say of a condition. Most edits leave most conditions as they are."""
    found = judge(coordinates, variables, dict(box), whole, role)
    if isinstance(found, Verdict) and found.searched:
        return searched(found.searched, [v for v in variables if v in coordinates[0].free], found.pivot)
    return found if isinstance(found, ConditionProblem) else None


def _products(
    db: Database, term: Term, found: Sequence[Condition], spans: Mapping[Term, Span], fallback: Span
) -> Iterable[Diagnostic]:
    """Deltas that meet on one surface: what they are multiplied by is looked at only where there are any."""
    deltas, nodes = [c.anchor for c in found if c.delta], postorder(term)
    if not deltas and Deriv not in map(type, nodes):
        return
    for node in nodes:
        if not isinstance(node, Integral):
            continue
        parts = postorder(node.body)
        anchors = [anchor for anchor in deltas if anchor in parts]
        anchors += [p for p in parts if isinstance(p, App) and isinstance(spine(p)[0], Deriv)]
        if not anchors:
            continue
        try:
            whole = Differentiator(lambda g: _faultless(db, g)).carried_out(node)
            if isinstance(whole, Integral):
                without_deltas(whole)
        except PottoError as error:
            span = spans.get(anchors[-1], spans.get(node, fallback))
            yield from (replace(d, span=span) for d in error.diagnostics)
        except (NoClosedForm, NotSmooth):
            pass  # then they are eliminated by numbers, which looks again


def _readable(condition: Condition) -> Condition:
    """Copies of bound variables (x'1) under their own names, where those are free."""
    used = {n for c in condition.coordinates for n in c.free}
    plain = {n: stem(n) for n in used if "'" in n}
    plain = {n: p for n, p in plain.items() if p not in used and list(plain.values()).count(p) == 1}
    if not plain:
        return condition
    names: dict[str, Term] = {n: var(p) for n, p in plain.items()}
    coordinates = tuple(substitute(c, names) for c in condition.coordinates)
    return replace(condition, coordinates=coordinates, box={plain.get(n, n): b for n, b in condition.box.items()})


def _diagnostic(problem: ConditionProblem, span: Span, calls: Sequence[str] = ()) -> Diagnostic:
    notes = problem.notes
    if calls:
        notes = (*notes, f"the condition is inside {called_by(calls)}")
    return problem.kind(span, problem.message, label=problem.label, notes=notes, help=problem.help)


# Definitions of diffeomorphisms


@query
def _studied(db: Database, file: str, name: str) -> _Study:
    item = definition(db, file, name)
    assert isinstance(item, nodes.DiffeoDefinition)
    parts = diffeo_core(db, file, name)
    assert parts is not None
    components = tuple(expanded(c, lambda g: _whole(db, g)) for c in parts.components)
    variables = parts.variables
    if not variables or any(isinstance(n, Hole) for n in postorder(*components)):
        return _Study((), None)
    where = tuple(guard for truth in parts.where for guard in guards_of(truth))
    box = box_of(where, variables)
    span = _components_span(item)
    problem = wrong_shape(components, variables, box) or unknown_call(components, variables)
    problem = problem or singular(components, variables)
    if problem is not None:
        return _Study((_diagnostic(problem, span),), None)
    what = _Map(components, variables, parts.groups, where, box)
    found = invert(components, variables, bool(where))
    if item.inverse is None or parts.inverse is None:
        return _inverted(item, what, found, span)
    inverse = tuple(expanded(i, lambda g: _whole(db, g)) for i in parts.inverse.components)
    return _authors(item, item.inverse.span, what, found, parts.inverse.values, inverse)


class _Map(Struct, frozen=True):
    components: tuple[Term, ...]
    variables: tuple[str, ...]
    parameters: tuple[tuple[str, ...], ...]
    where: tuple[Guard, ...]
    box: Box


def _components_span(item: nodes.DiffeoDefinition) -> Span:
    if not item.components:
        return item.name_span
    return item.components[0].span.cover(item.components[-1].span)


def _inverted(item: nodes.DiffeoDefinition, what: _Map, found: InverseMap | Failure, span: Span) -> _Study:
    """The inverse that was found, on the branch that `where` selects."""
    if isinstance(found, Failure):
        return _Study((_diagnostic(failure(found, what.components, what.variables), span),), None)
    branches = tuple(tuple(simplify(unguarded(part)) for part in branch) for branch in found.branches)
    notes: tuple[str, ...] = ()
    if what.where and len(branches) > 1:
        kept = [b for b in branches if isinstance(_on_branch(what, found.values, b), Verified)]
        if not kept:
            problem = ConditionProblem(
                NO_INVERSE,
                f"none of the {len(branches)} solutions found lies on the branch that `where` selects",
                "no inverse on this branch",
                (),
                "widen `where`, or add the inverse: `inverse (u, v) . (x, y)`",
            )
            return _Study((_diagnostic(problem, span),), None)
        branches = tuple(kept)
        notes = ("the branch was selected at sample points",)
    info = DiffeoInfo(
        item.name, what.variables, what.parameters, what.components, found.values, branches,
        found.determinant, found.method, True, notes,
    )  # fmt: skip
    return _Study((), info)


def _on_branch(what: _Map, values: Sequence[str], inverse: Sequence[Term]) -> Verified | Refuted | Untested:
    return verify(what.components, what.variables, values, inverse, what.where, what.box)


def _authors(
    item: nodes.DiffeoDefinition,
    span: Span,
    what: _Map,
    found: InverseMap | Failure,
    values: tuple[str, ...],
    parts: tuple[Term, ...],
) -> _Study:
    """The author's inverse, verified."""
    if len(values) != len(what.components) or len(parts) != len(what.variables):
        problem = ConditionProblem(
            COMPONENTS,
            f"the inverse takes {many(len(values), 'value')} to {many(len(parts), 'component')}, "
            f"but the map takes {many(len(what.variables), 'variable')} to {many(len(what.components), 'component')}",
            "wrong number",
            (),
            "the inverse takes the components, in their order, back to the variables",
        )
        return _Study((_diagnostic(problem, span),), None)
    outcome = _on_branch(what, values, parts)
    if isinstance(outcome, Refuted):
        return _Study((_diagnostic(_wrong(what, outcome), span),), None)
    if isinstance(outcome, Untested):
        problem = ConditionProblem(
            WRONG_INVERSE,
            "the inverse could not be verified: no point was found where both it and the map are defined",
            "not verified",
            (f"tried {listed(what.variables)} between -3 and 3, or as `where` says",),
            "say with `where` in which box the map is used",
        )
        return _Study((_diagnostic(problem, span),), None)
    notes = () if outcome.proven else (f"the inverse was verified at {outcome.tested} sample points only",)
    det = found.determinant
    info = DiffeoInfo(
        item.name, what.variables, what.parameters, what.components, values, (parts,), det, "given", outcome.proven,
        notes,
    )  # fmt: skip
    return _Study((), info)


def _wrong(what: _Map, refuted: Refuted) -> ConditionProblem:
    at = ", ".join(f"{n} = {v:.6g}" for n, v in refuted.point.items())
    back = ", ".join(f"{n} = {v:.6g}" for n, v in refuted.back.items())
    off = f", which is off by {refuted.off:.1e}" if math.isfinite(refuted.off) else ""
    hint = "" if what.where else "; if it is right on one branch only, select that with `where`"
    nowhere = not all(math.isfinite(v) for v in refuted.back.values())
    return ConditionProblem(
        WRONG_INVERSE,
        f"this inverse does not lead back: it is not defined where the map leads from {at}"
        if nowhere
        else f"this inverse does not lead back: from {at} it gives {back}{off}",
        "not the inverse",
        ("checked at sample points",),
        f"correct the inverse{hint}",
    )


# The branch
