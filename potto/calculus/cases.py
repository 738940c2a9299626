"""Conditions on abs, min, max and clamp as conditions on what is inside of them.

Owns `cased`. The surface of `[max(x, y) < t]` runs along x and along y, so that no variable of integration cuts all
of it; those of `if [x >= y] then [x < t] else [y < t]` do. The condition that chooses has no jump of its own.
"""

from __future__ import annotations

from collections.abc import Callable

from potto.core.terms import (
    Branch,
    Integral,
    Prim,
    Term,
    branch,
    children,
    integral,
    neg,
    postorder,
    prim,
    rebuild,
    sub,
)

_FLAT = ("max", "min", "clamp")
MOST = 8  # cases that one condition is taken apart into


def cased(term: Integral) -> Integral:
    """An equal integral, or the same one where there is nothing to take apart."""
    if not any(isinstance(node, Branch) and _changes(node) for node in postorder(term.body)):
        return term
    memo: dict[Term, Term] = {}
    for node in postorder(term.body):
        new = rebuild(node, tuple(memo[c] for c in children(node)))
        memo[node] = _apart(new, MOST) if isinstance(node, Branch) and _changes(node) else new
    return integral(term.variables, term.bounds, memo[term.body], term.hints)


def _changes(node: Branch) -> bool:
    """Whether one of the cases of a condition varies with less than the condition, or not at all."""
    parts = [part for part in postorder(node.surface) if isinstance(part, Prim) and part.op in _FLAT]
    return any(arg.free != part.free for part in parts if part.free for arg in part.args)


def _apart(node: Term, most: int) -> Term:
    assert isinstance(node, Branch)
    bent = next((part for part in postorder(node.surface) if isinstance(part, Prim) and part.op in _CASES), None)
    if bent is None or most < 2:
        return node
    margin, first, second = _CASES[bent.op](*bent.args)
    cases = []
    for value in (first, second):
        coordinates = tuple(_put(c, bent, value) for c in node.coordinates)
        cases.append(_apart(branch(coordinates, node.strict, node.then, node.orelse), most // 2))
    return branch((margin,), False, cases[0], cases[1])


def _put(term: Term, old: Term, new: Term) -> Term:
    memo: dict[Term, Term] = {old: new}
    for node in postorder(term):
        if node not in memo:
            memo[node] = rebuild(node, tuple(memo[c] for c in children(node)))
    return memo[term]


def _largest(*args: Term) -> tuple[Term, Term, Term]:
    first, *rest = args
    other = _joined("max", rest)
    return sub(first, other), first, other


def _least(*args: Term) -> tuple[Term, Term, Term]:
    first, *rest = args
    other = _joined("min", rest)
    return sub(other, first), first, other


def _joined(op: str, args: list[Term]) -> Term:
    return args[0] if len(args) == 1 else prim(op, *args)


def _clamped(x: Term, lo: Term, hi: Term) -> tuple[Term, Term, Term]:
    inner = _joined("max", [x, lo])
    return sub(hi, inner), inner, hi


# A margin, what the builtin is where that is >= 0, and what it is elsewhere
_CASES: dict[str, Callable[..., tuple[Term, Term, Term]]] = {
    "abs": lambda x: (x, x, neg(x)),
    "max": _largest,
    "min": _least,
    "clamp": _clamped,
}
