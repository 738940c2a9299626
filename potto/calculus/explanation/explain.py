"""The derivative of a definition, for a person to read: what `potto deriv` and hover show.

Owns `explain_derivative`; how what it finds is laid out is in `explained`. First the derivative of each integrand with
its deltas, as in equation (2) of the paper, then what is left when the deltas are integrated out, then the surfaces and
what moves each. Functions that are parameters stay symbols: `shader (x, y) c` and, for its tangent, `dshader (x, y)
(c, dc)`.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec.structs import replace

from potto.calculus.checking.guards import unguarded
from potto.calculus.differentiation.boundary_terms import at_bounds, at_surfaces, jumps
from potto.calculus.differentiation.deltas import without_deltas
from potto.calculus.differentiation.derivative import NotSmooth
from potto.calculus.differentiation.dual import Differentiator
from potto.calculus.differentiation.higher_order import moving_deltas
from potto.calculus.differentiation.level_sets import level_set
from potto.calculus.explanation.layout import DerivativeText, IntegralText, SurfaceText
from potto.calculus.inlining.expand import Resolve, heads_of
from potto.calculus.solving.pivots import NoClosedForm, pivots
from potto.calculus.solving.solve import factors
from potto.calculus.surfaces.branch_assignment import branches_of
from potto.calculus.surfaces.branch_cuts import opened
from potto.calculus.surfaces.case_split import unnested
from potto.calculus.surfaces.trace import spine
from potto.core.printer import format_term
from potto.core.simplify import normalized_surface, simplify
from potto.core.terms import (
    ONE,
    ZERO,
    App,
    Branch,
    Deriv,
    Global,
    Integral,
    Lam,
    Proj,
    Term,
    Tuple,
    Var,
    app,
    branch,
    children,
    integral,
    lam,
    mul,
    postorder,
    rebuild,
    tuple_,
    var,
)
from potto.diagnostics import PottoError
from potto.elaborate import core_term
from potto.query import Database
from potto.types import Type, derivative_type, format_type, groups_of, interface


def explain_derivative(db: Database, file: str, name: str) -> DerivativeText:
    """The derivative of a definition, in symbols. What is a derivative itself is explained by what it is one of."""

    def resolve(target: Global) -> Term:
        return core_term(db, target.module, target.name)

    found = interface(db, file, name)
    term = core_term(db, file, name)
    original = _original(term, name, resolve)
    if original is not None:
        of, shown = original
        type = derivative_type(interface(db, of.module, of.name).type) if isinstance(of, Global) else found.type
        text = describe(resolve(of) if isinstance(of, Global) else of, shown, format_type(type), resolve)
        return replace(text, by=name)
    given = _applied(term, found.type)
    return describe(given, name, format_type(derivative_type(found.type)), resolve)


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


def describe(term: Term, name: str, type_text: str, resolve: Resolve) -> DerivativeText:
    """The same for a term."""
    body, params = term, list[str]()
    while isinstance(body, Lam):
        params.extend(body.params)
        body = body.body
    body, conditions = unguarded(body)
    functions = {p: f"d{p}" for p in params if p in heads_of(term)}
    tangents: dict[str, Term] = {p: var(f"d{p}") for p in params}
    work = Differentiator(resolve, folding=True)
    problems: list[str] = []
    tangent = ""
    try:
        tangent = _text(work.dual(opened(body), tangents)[1], functions)
    except NoClosedForm as problem:
        problems.append(f"a boundary is found by numbers: {problem}")
    except NotSmooth as problem:
        problems.append(f"the derivative has no closed form: {problem}")
    except PottoError as problem:
        problems.extend(d.message for d in problem.diagnostics)
    known = [work.carried_out(i) for i in _outermost(body)]
    integrals = tuple(_integral(unnested(i), work, tangents, functions) for i in known if isinstance(i, Integral))
    found = DerivativeText(name, type_text, tangent, isinstance(body, Integral), integrals, conditions)
    found = replace(found, problems=tuple(problems), smooth=tangent)
    if not integrals and not problems:
        plain = work.carried_out(body)
        found = replace(found, surfaces=_own_surfaces(plain, tangents))
        return _with_deltas(found, plain, work, tangents, functions)
    return found


def _outermost(term: Term) -> list[Integral]:
    found: dict[Integral, None] = {}
    stack = [term]
    while stack:
        node = stack.pop()
        if isinstance(node, Integral):
            found[node] = None
        else:
            stack.extend(reversed(children(node)))
    return list(found)


def _with_deltas(
    found: DerivativeText,
    plain: Term,
    work: Differentiator,
    tangents: Mapping[str, Term],
    functions: Mapping[str, str],
) -> DerivativeText:
    """A function that jumps over its parameters: its derivative is a distribution over what they are filled with."""
    try:
        over = jumps(opened(plain), tangents, lambda t: work.dual(t, tangents)[1])
    except NotSmooth as problem:
        return replace(found, problems=(*found.problems, f"where it jumps has no closed form: {problem}"))
    if not over:
        return found
    smooth = _text(work.dual(plain, tangents)[1], functions)  # calls carried out here too: else they count twice
    deltas = tuple(_text(item.contribution, functions) for item in over if item.rate is not ZERO)
    first = f"({smooth})" if smooth.startswith("if ") else smooth  # an `else` would take in what is added
    parts = deltas if smooth == "0" and deltas else (first, *deltas)
    return replace(found, tangent=" + ".join(parts), smooth=smooth, deltas=deltas)


def _integral(
    node: Integral, work: Differentiator, tangents: Mapping[str, Term], functions: Mapping[str, str]
) -> IntegralText:
    def rate(term: Term) -> Term:
        return work.dual(term, inside)[1]

    inside = {n: t for n, t in tangents.items() if n not in node.variables}
    deltas: list[str] = []
    boundary: list[str] = []
    bounds: list[str] = []
    interior, reason = "", ""
    try:
        interior = _text(rate(node.body), functions)
        for item in jumps(opened(node.body), node.variables, rate):
            deltas.append(_text(item.contribution, functions))
        deltas += [_text(t, functions) for t in moving_deltas(node, rate)]
        whole = opened(node)
        assert isinstance(whole, Integral)
        plain = without_deltas(whole, True)
        if isinstance(plain, Integral):
            reason = _why_searched(plain)
        if isinstance(plain, Integral) and level_set(plain) is None:
            bounds = [_text(t, functions) for t in at_bounds(plain, rate)]
            swept = at_surfaces(plain, frozenset(inside), rate, True)
            boundary = [_text(t, functions) for t in swept if not (isinstance(t, Integral) and level_set(t))]
    except (NoClosedForm, NotSmooth) as problem:
        reason = str(problem)
    except PottoError as problem:
        reason = problem.diagnostics[0].message
    head = format_term(integral(node.variables, node.bounds, ONE)).rpartition(" 1 ")[0]
    return IntegralText(
        head,
        ", ".join(node.variables),
        format_term(simplify(node.body)),
        interior,
        tuple(deltas),
        tuple(bounds),
        tuple(b for b in boundary if b != "0"),
        _surfaces(node, inside),
        reason,
    )


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


def _surfaces(node: Integral, tangents: Mapping[str, Term]) -> tuple[SurfaceText, ...]:
    found: dict[Term, SurfaceText] = {}
    for item in branches_of(opened(node.body), node.variables):
        for factor in factors(item.surface):
            canonical = normalized_surface(factor)[0]
            if canonical in found or not factor.free & frozenset(node.variables):
                continue
            roots: list[str] = []
            try:
                for root in pivots(node, factor)[0].roots:
                    each = f" for integers {root.index}" if root.index else ""
                    roots.append(f"{root.variable} = {format_term(simplify(root.at))}{each}")
            except NoClosedForm:
                pass
            found[canonical] = SurfaceText(equation(factor), tuple(sorted(factor.free & tangents.keys())), tuple(roots))
    return tuple(found.values())


def _own_surfaces(body: Term, tangents: Mapping[str, Term]) -> tuple[SurfaceText, ...]:
    """Where a body without an integral jumps."""
    found: dict[Term, SurfaceText] = {}
    for item in branches_of(opened(body), tangents):
        canonical = normalized_surface(item.surface)[0]
        moved = tuple(name for name in tangents if name in item.surface.free)
        found.setdefault(canonical, SurfaceText(equation(item.surface), moved, ()))
    return tuple(found.values())


# Text


def equation(surface: Term) -> str:
    """Where a surface is, as people write it: `x = t` for t - x."""
    return format_term(branch((surface,), False, ONE, ZERO))[1:-1].replace(">=", "=").replace("<=", "=")


def _text(term: Term, functions: Mapping[str, str]) -> str:
    """With brackets as factors, as people write them: what they guard against is not evaluated here."""
    return format_term(simplify(_symbols(simplify(term), functions)))


def _symbols(term: Term, functions: Mapping[str, str]) -> Term:
    """Values and tangents of calls as symbols: `shader (x, y) c`, `dshader (x, y) (c, dc)`."""
    originals = {dual: name for name, dual in functions.items()}
    memo: dict[Term, Term] = {}
    for node in postorder(term):
        if isinstance(node, Proj) and isinstance(node.term, App):
            head, groups = spine(node.term)
            named = _named(head, originals)
            if named is not None:
                name, original = named
                result: Term = original if node.index == 0 else name
                for group in groups:
                    args = [_symbols(a, functions) for a in group]
                    result = app(result, tuple(_shown(a, node.index == 0, originals) for a in args))
                memo[node] = result
                continue
        new = rebuild(node, tuple(memo[c] for c in children(node)))
        if isinstance(new, Branch) and new.orelse is ZERO and not isinstance(new.then, Tuple) and new.then is not ONE:
            new = mul(new.then, branch(new.coordinates, new.strict, ONE, ZERO))
        memo[node] = new
    return memo[term]


def _named(head: Term, originals: Mapping[str, str]) -> tuple[Term, Term] | None:
    """The symbol for the tangent of a call, and the function itself."""
    if isinstance(head, Var) and head.name in originals:
        return head, var(originals[head.name])
    if isinstance(head, Deriv) and isinstance(head.function, Global):
        return var(f"d{head.function.name}"), head.function
    return None


def _shown(arg: Term, primal: bool, originals: Mapping[str, str]) -> Term:
    if isinstance(arg, Tuple) and len(arg.items) == 2:
        value, tangent = arg.items
        return value if primal or tangent is ZERO else tuple_((value, tangent))
    if primal and isinstance(arg, Var) and arg.name in originals:
        return var(originals[arg.name])
    return arg.function if primal and isinstance(arg, Deriv) else arg
