"""The derivative of a definition, for a person to read: what `potto deriv` and hover show.

Owns `explain_derivative`; how what it finds is laid out is in `layout`. First the derivative of each integrand with
its deltas, as in equation (2) of the paper, then what is left when the deltas are integrated out, then the surfaces and
what moves each. Functions that are parameters stay symbols (`symbols`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import inf

from msgspec.structs import replace

from potto.calculus.algebra.ranges import Box, range_of
from potto.calculus.algebra.rational_form import normal
from potto.calculus.decomposition.guards import unguarded
from potto.calculus.differentiation.boundary_terms import Name, at_bounds, at_surfaces, jumps
from potto.calculus.differentiation.deltas import without_deltas
from potto.calculus.differentiation.derivative import NotSmooth
from potto.calculus.differentiation.dual import Differentiator
from potto.calculus.differentiation.higher_order import moving_deltas
from potto.calculus.differentiation.level_sets import level_set
from potto.calculus.differentiation.root_names import RootNames, names_in
from potto.calculus.explanation.alternatives import holds
from potto.calculus.explanation.continuity import continuous
from potto.calculus.explanation.divisors import divided_by
from potto.calculus.explanation.fields import fields_of
from potto.calculus.explanation.layout import DerivativeText, IntegralText, SurfaceText
from potto.calculus.explanation.notation import Notation, Rewrite, notation_of, written_notation
from potto.calculus.explanation.plain_names import Each, apart, plainly_indexed, plainly_named
from potto.calculus.explanation.readable import readable
from potto.calculus.explanation.readable_parts import ReadableParts
from potto.calculus.explanation.symbols import Formula, NoFormula, Words, over_functions, shorter
from potto.calculus.inlining.expand import Resolve, heads_of
from potto.calculus.solving.pivots import NoClosedForm, Roots, SurfaceRoot, pivots
from potto.calculus.solving.solve import factors
from potto.calculus.surfaces.branch_assignment import box_of, branches_of, with_index
from potto.calculus.surfaces.branch_assignment import unguarded as where_it_exists
from potto.calculus.surfaces.branch_cuts import opened
from potto.calculus.surfaces.case_split import unnested
from potto.core.simplify import normalized_surface, simplify
from potto.core.terms import (
    ONE,
    ZERO,
    Array,
    Deriv,
    Fold,
    Global,
    Integral,
    Lam,
    Sum,
    Term,
    app,
    children,
    integral,
    lam,
    stem,
    sub,
    substitute,
    var,
)
from potto.diagnostics import PottoError
from potto.elaborate import core_term
from potto.query import Database, query
from potto.types import Type, derivative_type, format_type, groups_of, interface

_MOST = 20_000  # characters of what stands under one integral, which nobody reads; what comes then is not looked for


@query
def explain_derivative(db: Database, file: str, name: str) -> DerivativeText:
    """The derivative of a definition, in symbols. What is a derivative itself is explained by what it is one of. Of a
    definition that an error spoils, itself or by what it needs, the symbols mean nothing: that is asked first."""

    def resolve(target: Global) -> Term:
        return core_term(db, target.module, target.name)

    found = interface(db, file, name)
    term = core_term(db, file, name)
    original = _original(term, name, resolve)
    if original is not None:
        of, shown = original
        type, notation = found.type, written_notation(db, file, name)
        if isinstance(of, Global):
            own = interface(db, of.module, of.name).type
            of, type, notation = resolve(of), derivative_type(own), Notation(fields_of(db, own), notation.numbers)
        return replace(describe(of, shown, format_type(type), resolve, notation, db.give_way), by=name)
    type_text = format_type(derivative_type(found.type))
    return describe(_applied(term, found.type), name, type_text, resolve, notation_of(db, file, name), db.give_way)


def _original(term: Term, name: str, resolve: Resolve) -> tuple[Term, str] | None:
    """What a term is the derivative of, and a name for it; None if it is none."""
    term = _behind(term, resolve)
    if not isinstance(term, Deriv):
        return None
    while isinstance(term, Deriv):
        term = _behind(term.function, resolve)
    if isinstance(term, Global):
        return term, term.name
    return (term, name.removeprefix("d") or "f") if isinstance(term, Lam) else None


def _behind(term: Term, resolve: Resolve) -> Term:
    """What stands behind other names for it: a derivative, or the name of a definition of its own."""
    while isinstance(term, Global) and isinstance(found := resolve(term), Deriv | Global):
        term = found
    return term


def _applied(term: Term, type: Type) -> Term:
    """With its parameters written: a function that is another one by name, or was given a part of its arguments."""
    if isinstance(term, Lam):
        return term
    groups = [tuple(p.name or f"x{n}" for n, p in enumerate(group, 1)) for group in groups_of(type)]
    body: Term = term
    for names in groups:
        body = app(body, tuple(map(var, names)))
    for names in reversed(groups):
        body = lam(names, body)
    return body


def describe(
    term: Term, name: str, type_text: str, resolve: Resolve, notation: Notation,
    pause: Callable[[], None] = lambda: None,
) -> DerivativeText:  # fmt: skip
    """The same for a term; `pause` may raise what ends it."""
    body, params = term, list[str]()
    while isinstance(body, Lam):
        params.extend(body.params)
        body = body.body
    body, conditions = unguarded(body)
    tangents: dict[str, Term] = {p: var(f"d{p}") for p in params}
    words = Words(
        {p: f"d{p}" for p in params if p in heads_of(term)},
        notation,
        frozenset(params) | {f"d{p}" for p in params},
        frozenset(f"d{p}" for p in params),
        ReadableParts(pause),
        RootNames(tangents, names_in(term)),
    )
    work = Differentiator(resolve, wanted=Roots.READ)
    problems: list[str] = []
    tangent = Formula("")
    try:
        named = Differentiator(resolve, wanted=Roots.READ, names=words.roots)
        (tangent,) = shorter((words.formula(_tangent(body, each, tangents)),) for each in (named, work))
    except NoClosedForm as problem:
        problems.append(f"a boundary is found by numbers: {problem}")
    except NotSmooth as problem:
        problems.append(f"the derivative has no closed form: {problem}")
    except NoFormula as problem:
        problems.append(str(problem))
    except PottoError as problem:
        problems.extend(d.message for d in problem.diagnostics)
    known = [(work.carried_out(i), each) for i, each in _outermost(body)]
    integrals = tuple(
        _integral(unnested(i), each, work, tangents, words) for i, each in known if isinstance(i, Integral)
    )
    where = tuple(dict.fromkeys(map(words.condition, (each for each in conditions if not holds(simplify(each))))))
    found = DerivativeText(name, type_text, tangent.text, isinstance(body, Integral), integrals, where)
    found = replace(found, problems=tuple(problems), smooth=tangent.text, parameters=tuple(params))
    found = replace(found, divisors=divided_by(tangent, (body, work.carried_out(body)), conditions, words))
    if not integrals and not problems:
        plain = work.carried_out(body)
        found = replace(found, surfaces=_own_surfaces(plain, tangents, notation))
        return _with_deltas(found, plain, work, tangents, words)
    return found


def _tangent(body: Term, work: Differentiator, tangents: Mapping[str, Term]) -> Term:
    """The whole derivative, deltas integrated out."""
    found = work.dual(opened(body), tangents)[1]
    return work.dual(opened(work.carried_out(body)), tangents)[1] if over_functions(found) else found


def _outermost(term: Term) -> list[tuple[Integral, tuple[Each, ...]]]:
    """The integrals that are in no other one, each with the indices of the sums and arrays it stands in."""
    found: dict[Integral, tuple[Each, ...]] = {}
    stack: list[tuple[Term, tuple[Each, ...]]] = [(term, ())]
    while stack:
        node, around = stack.pop()
        if isinstance(node, Integral):
            found.setdefault(node, around)
            continue
        if isinstance(node, Deriv):  # of a function of its own, whose parameters are not those of the formula
            continue
        if isinstance(node, Sum | Array | Fold):
            lo, hi = (ZERO, sub(node.size, ONE)) if isinstance(node, Array) else (node.lo, node.hi)
            around = (*around, (node.variable, lo, hi))
        stack.extend((part, around) for part in reversed(children(node)))
    return [(node, tuple(each for each in around if each[0] in node.free)) for node, around in found.items()]


def _with_deltas(
    found: DerivativeText,
    plain: Term,
    work: Differentiator,
    tangents: Mapping[str, Term],
    words: Words,
) -> DerivativeText:
    """A function that jumps over its parameters: its derivative is a distribution over what they are filled with."""
    try:
        over = [item for item in jumps(opened(plain), tangents, lambda t: work.dual(t, tangents)[1])
                if _is_met(item.surface)]  # fmt: skip
    except (NotSmooth, NoFormula) as problem:
        return replace(found, problems=(*found.problems, f"where it jumps has no closed form: {problem}"))
    if not over:
        return found
    try:
        smooth = words.text(work.dual(plain, tangents)[1])  # calls carried out here too: else they count twice
        meeting = [item for item in over if continuous(item, tangents)]
        moving = [item for item in over if item.rate is not ZERO and item not in meeting]
        deltas = tuple(text for item in moving if (text := words.text(item.contribution)) != "0")
    except NoFormula as problem:
        return replace(found, tangent="", smooth="", problems=(*found.problems, str(problem)))
    found = replace(found, continuous=tuple(words.notation.equation(item.surface) for item in meeting))
    first = f"({smooth})" if smooth.startswith("if ") else smooth  # an `else` would take in what is added
    parts = (smooth,) if not deltas else deltas if smooth == "0" else (first, *deltas)
    return replace(found, tangent=_sum_of(parts), smooth=smooth, deltas=deltas)


def _is_met(surface: Term) -> bool:
    """Whether a surface can be 0: 105/s is nowhere."""
    found = normal(surface)
    return found is None or set(found.top) != {()}


def _sum_of(parts: Iterable[str]) -> str:
    """Formulas added up, those with a minus in front taken away."""
    first, *more = parts
    return first + "".join(f" - {part[1:]}" if part.startswith("-") else f" + {part}" for part in more)


def _integral(
    node: Integral, around: tuple[Each, ...], work: Differentiator, tangents: Mapping[str, Term], words: Words
) -> IntegralText:
    def rate(term: Term) -> Term:
        return work.dual(term, inside)[1]

    node, around = plainly_indexed(plainly_named(node, words.names), around, words.names)
    inside = {n: t for n, t in tangents.items() if n not in node.variables}
    indices, ranges = [name for name, _, _ in around], _ranges(around)
    box = {**ranges, **box_of(node)}
    deltas, meeting, bounds, boundary = list[str](), list[str](), list[str](), tuple[str, ...]()
    interior, reason = "", ""

    def under(term: Term) -> str:
        if sum(map(len, (interior, *deltas))) > _MOST:
            raise NoFormula("the formula is too long to be shown")
        return words.under_integral(term, *node.variables, *indices, box=box)

    try:
        interior = under(rate(node.body))
        for item in jumps(opened(node.body), node.variables, rate):
            if _outside(item.surface, box):
                continue
            if continuous(item, node.variables):
                meeting.append(words.equation(item.surface, node.variables))
            else:
                deltas.append(under(item.contribution))
        deltas += [under(t) for t in moving_deltas(node, rate)]
        plain = _without_deltas(node)
        reason = "" if plain is None else _why_searched(plain)
        if plain is not None and level_set(plain) is None:
            bounds = [words.text(t, *indices, box=ranges) for t in at_bounds(plain, rate)]
            boundary = _swept(plain, inside, rate, words, indices, ranges)
    except (NoClosedForm, NotSmooth, NoFormula) as problem:
        reason = str(problem)
    except PottoError as problem:
        reason = problem.diagnostics[0].message
    return IntegralText(
        _head(node, words),
        ", ".join(node.variables),
        words.plain(node.body),
        interior,
        tuple(deltas),
        tuple(text for text in bounds if text != "0"),
        tuple(text for text in boundary if text != "0"),
        _surfaces(node, inside, words),
        reason,
        tuple(meeting),
        ", ".join(f"{name} in {words.plain(lo)}..{words.plain(hi)}" for name, lo, hi in around),
    )


def _head(node: Integral, words: Words) -> str:
    """`integral` and the bounds, these as short as can be, without what stands under it."""
    text = words.notation.text

    def shortest(bound: Term) -> Term:
        written = words.notation.fields(bound)
        return min(written, readable(simplify(written), frozenset()), key=lambda each: len(text(each)))

    bounds = tuple([(shortest(lo), shortest(hi)) for lo, hi in node.bounds])
    return text(integral(node.variables, bounds, ONE)).rpartition(" 1 ")[0]


def _swept(
    plain: Integral, tangents: Mapping[str, Term], rate: Rewrite, words: Words, indices: list[str], ranges: Box
) -> tuple[str, ...]:
    """The boundary terms of an integral with its deltas integrated out, but those over level sets."""

    def told(name: Name | None) -> tuple[Formula, ...]:
        terms = at_surfaces(plain, frozenset(tangents), rate, Roots.READ, name)
        shown = [t for t in terms if not (isinstance(t, Integral) and level_set(t))]
        return tuple([words.formula(t, *indices, box=ranges) for t in shown])

    return tuple([formula.text for formula in shorter(map(told, (words.roots.along(tangents), None)))])


def _ranges(around: Iterable[Each]) -> Box:
    box: Box = {}
    for index in around:
        box = with_index(box, *index)
    return box


def _without_deltas(node: Integral) -> Integral | None:
    """The integral with its deltas integrated out, if it is still one then."""
    whole = opened(node)
    assert isinstance(whole, Integral)
    plain = without_deltas(whole, Roots.READ)
    return plain if isinstance(plain, Integral) else None


def _outside(surface: Term, box: Mapping[str, tuple[float, float]]) -> bool:
    """Whether a surface is nowhere in the domain."""
    found = range_of(surface, box)
    return found.positive or found.negative


def _why_searched(node: Integral) -> str:
    """Why the boundary of an integral is found by numbers; nothing where it is not."""
    known = level_set(node)
    found = branches_of(node.body, node.variables)
    for surface in (known.surface,) if known else (f for item in found for f in factors(item.surface)):
        try:
            if surface.free & frozenset(node.variables):
                pivots(node, surface)
        except NoClosedForm as problem:
            return str(problem)
    return ""


def _surfaces(node: Integral, tangents: Mapping[str, Term], words: Words) -> tuple[SurfaceText, ...]:
    found: dict[Term, SurfaceText] = {}
    box = box_of(node)
    for item in branches_of(opened(node.body), node.variables):
        for factor in factors(item.surface):
            canonical = normalized_surface(factor)[0]
            if canonical in found or not factor.free & frozenset(node.variables) or _outside(factor, box):
                continue
            roots: list[str] = []
            try:
                for root in pivots(node, factor, Roots.READ)[0].roots:
                    roots.append(f"{root.variable} = {_root(root, node.variables, words)}")
            except NoClosedForm:
                pass
            found[canonical] = SurfaceText(
                words.equation(factor, node.variables),
                tuple(sorted(factor.free & tangents.keys())),
                tuple(roots),
            )
    return tuple(found.values())


def _root(root: SurfaceRoot, variables: tuple[str, ...], words: Words) -> str:
    """A root where it exists; of many that recur, with the name of their index."""
    at = where_it_exists(root.at)
    index = root.index and apart(stem(root.index), (at.free | words.names | {root.variable}) - {root.index})
    if root.index and index:
        at = substitute(at, {root.index: var(index)})
    text = words.notation.text(words.read(at, dict.fromkeys(variables, (-inf, inf))))
    return f"{text} for integers {index}" if index else text


def _own_surfaces(body: Term, tangents: Mapping[str, Term], notation: Notation) -> tuple[SurfaceText, ...]:
    """Where a body without an integral jumps."""
    found: dict[Term, SurfaceText] = {}
    for item in branches_of(opened(body), tangents):
        if not _is_met(item.surface):
            continue
        canonical = normalized_surface(item.surface)[0]
        moved = tuple(name for name in tangents if name in item.surface.free)
        found.setdefault(canonical, SurfaceText(notation.equation(item.surface), moved, ()))
    return tuple(found.values())
