"""Integrals made ready to be integrated.

Owns `prepared`: deltas are integrated out, a sum under an integral becomes a sum of integrals, and an integrand that
is a sum with many surfaces is taken apart, so that each part is cut along its own surfaces only. That keeps n
conditions added up at a cost proportional to n. Owns `held` too: deltas that stand still.
"""

from __future__ import annotations

from functools import lru_cache

from potto.calculus.deltas import without_deltas
from potto.calculus.derivative import NotSmooth
from potto.calculus.dual import Differentiator
from potto.calculus.expand import Resolve, expanded
from potto.calculus.pivots import NoClosedForm
from potto.core.terms import (
    Branch,
    Delta,
    Deriv,
    Global,
    Integral,
    Prim,
    Sum,
    Term,
    Var,
    add,
    children,
    integral,
    neg,
    postorder,
    rebuild,
    substitute,
    sum_,
    var,
)
from potto.diagnostics import PottoError
from potto.kernels.cells import Value
from potto.runtime.functions import Closure

FEW = 4  # branches that one integrand may have before its summands are integrated apart


@lru_cache(maxsize=4096)
def prepared(term: Integral) -> Term:
    """An equal term, or the same one where there is nothing to be done. Raises PottoError (a product of deltas)."""
    if any(isinstance(node, Delta) for node in postorder(term.body)):
        return without_deltas(term)
    body = term.body
    if isinstance(body, Sum) and not (body.lo.free | body.hi.free) & set(term.variables):
        return sum_(body.variable, body.lo, body.hi, _over(term, body.body))
    if isinstance(body, Prim) and body.op == "neg":
        inner = _over(term, body.args[0])
        ready = prepared(inner)
        return neg(ready) if ready is not inner else term
    if isinstance(body, Prim) and body.op == "add":
        return _apart(term, body)
    return term


def placed(term: Integral, resolve: Resolve) -> Integral:
    """The integral with the calls of definitions that place its deltas carried out: `delta(cond (x, y) c)`. Of a
    derivative under it, of a function that jumps over its variables, the deltas are written out."""
    term = _with_spikes(term, resolve)
    nodes = postorder(term)
    if not any(isinstance(n, Delta) and any(isinstance(g, Global) for g in postorder(*n.coordinates)) for n in nodes):
        return term
    memo: dict[Term, Term] = {}
    for node in nodes:
        new = rebuild(node, tuple(memo[c] for c in children(node)))
        memo[node] = expanded(new, resolve) if isinstance(new, Delta) else new
    found = memo[term]
    assert isinstance(found, Integral)
    return found


def filled(term: Integral, env: dict[str, Value]) -> tuple[Integral, dict[str, Value]]:
    """With the functions in the place of those parameters whose derivatives are taken in the integrand; what they have
    captured joins the environment under names of its own."""
    for name in _derived_parameters(term):
        function = env.get(name)
        if type(function) is not Closure:
            continue
        names = {captured: f"{captured}@{name}" for captured in function.captured}
        own = substitute(function.lam, {captured: var(new) for captured, new in names.items()})
        found = substitute(term, {name: own})
        assert isinstance(found, Integral)
        term = found
        env = {**env, **{new: function.captured[captured] for captured, new in names.items()}}
    return term, env


@lru_cache(maxsize=4096)
def _derived_parameters(term: Integral) -> tuple[str, ...]:
    """The functions among the parameters whose derivatives are taken in an integrand."""
    derived = (node.function for node in postorder(term.body) if isinstance(node, Deriv))
    return tuple(sorted({inner.name for inner in derived if isinstance(inner, Var)} & term.free))


def _with_spikes(term: Integral, resolve: Resolve) -> Integral:
    """The integrand with derivatives carried out, if that brings deltas over the variables of integration.

    Kernels carry the tangents of derivatives from point to point, where a delta is nowhere: `D Real[x]` is
    `(Real[x], Dist[x])` for what jumps. Where no such derivative is reached, the term is the same.
    """
    if not _derives(term.body, resolve):
        return term
    try:
        body = Differentiator(resolve).carried_out(term.body)
    except (NoClosedForm, NotSmooth, PottoError):  # of an integral in the function, whose derivative takes numbers
        return term
    variables = frozenset(term.variables)
    before = {node for node in postorder(term.body) if isinstance(node, Delta)}
    found = any(isinstance(n, Delta) and n not in before and n.coordinates[0].free & variables for n in postorder(body))
    return _over(term, body) if found else term


def _derives(body: Term, resolve: Resolve) -> bool:
    """Whether a derivative and a jump are both reached from an integrand."""
    seen: set[Term] = set()
    todo, kinds = [body], set[type[Term]]()
    while todo:
        for node in postorder(todo.pop()):
            if isinstance(node, Global) and node not in seen:
                seen.add(node)
                known = resolve(node)
                todo += [] if known is None else [known]
            elif isinstance(node, Deriv | Branch):
                kinds.add(type(node))
    return kinds == {Deriv, Branch}


@lru_cache(maxsize=1024)
def held(term: Integral) -> tuple[Integral, tuple[tuple[str, str], ...]]:
    """The integral with what places its deltas under names of its own, to be given values without tangents.

    The names are those of the parameters, with the new ones.
    """
    deltas = [node for node in postorder(term.body) if isinstance(node, Delta)]
    bound = {name for node in postorder(term) if isinstance(node, Integral) for name in node.variables}
    names = sorted({name for node in deltas for name in node.coordinates[0].free} - bound)
    renamed = {name: var(f"{name}@still") for name in names}
    memo: dict[Term, Term] = {}
    for node in postorder(term):
        new = rebuild(node, tuple(memo[child] for child in children(node)))
        memo[node] = substitute(new, renamed) if isinstance(new, Delta) else new
    result = memo[term]
    assert isinstance(result, Integral)
    return result, tuple((name, f"{name}@still") for name in names)


def _over(term: Integral, body: Term) -> Integral:
    return integral(term.variables, term.bounds, body, term.hints)


def _apart(term: Integral, body: Prim) -> Term:
    """Summands with surfaces of their own integrated by themselves, the others together."""
    counts = [_branches(arg, frozenset(term.variables)) for arg in body.args]
    if sum(counts) <= FEW and not any(isinstance(arg, Sum) for arg in body.args):
        return term
    smooth = [arg for arg, count in zip(body.args, counts, strict=True) if not count and not isinstance(arg, Sum)]
    rest = [arg for arg in body.args if arg not in smooth]
    if len(rest) + bool(smooth) < 2:
        return term
    parts: list[Term] = [_over(term, add(*smooth))] if smooth else []
    return add(*parts, *(_over(term, arg) for arg in rest))


def _branches(term: Term, variables: frozenset[str]) -> int:
    return sum(1 for node in postorder(term) if isinstance(node, Branch) and node.surface.free & variables)
