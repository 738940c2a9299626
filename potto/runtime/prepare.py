"""Integrals made ready to be integrated.

Owns `prepared`: deltas are integrated out, a sum under an integral becomes a sum of integrals, and an integrand that
is a sum with many surfaces is taken apart, so that each part is cut along its own surfaces only. That keeps n
conditions added up at a cost proportional to n. Owns `held` too: deltas that stand still.
"""

from __future__ import annotations

from functools import lru_cache

from potto.calculus.deltas import without_deltas
from potto.calculus.expand import Resolve, expanded
from potto.core.terms import (
    Branch,
    Delta,
    Global,
    Integral,
    Prim,
    Sum,
    Term,
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
    """The integral with the calls of definitions that place its deltas carried out: `delta(cond (x, y) c)`."""
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
