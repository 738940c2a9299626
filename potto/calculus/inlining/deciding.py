"""Which parameters decide what course a recursion takes, or how many terms a sum has.

Owns `deciding`. A recursion is followed as deep as plain conditions go, so members of a batch can be evaluated together
as long as the conditions come out the same for all of them. What else a recursion is given may differ.
"""

from __future__ import annotations

from collections.abc import Iterable

from potto.calculus.inlining.currying import fitted, sizes_of, uncurry
from potto.calculus.surfaces.discontinuities import underlying
from potto.calculus.surfaces.finding import Resolve
from potto.calculus.surfaces.trace import spine
from potto.core.terms import App, Array, Fold, Global, If, Lam, Length, Prim, Sum, Term, Var, children, postorder


def deciding(terms: Iterable[Term], resolve: Resolve, exponents: bool = False) -> frozenset[str]:
    """The free names of terms that reach a condition of a recursion or a bound of a sum, through calls; or an exponent,
    if these count.

    Where it is not known which function is called, everything that it is given counts.
    """
    whole = list(terms)
    functions = _reached(whole, resolve)
    recursive = {f for f in functions if f in _reached([f.body], resolve)}
    known: dict[Lam, frozenset[str]] = dict.fromkeys(functions, frozenset())
    changed = True
    while changed:
        changed = False
        for function in functions:
            names = _names(function.body, function in recursive, exponents, known, resolve)
            if names != known[function]:
                known[function] = names
                changed = True
    return frozenset().union(*(_names(term, False, exponents, known, resolve) & term.free for term in whole))


def _reached(terms: list[Term], resolve: Resolve) -> dict[Lam, None]:
    """The functions that terms mention, and those that these mention."""
    found: dict[Lam, None] = {}
    waiting = list(terms)
    while waiting:
        for node in postorder(waiting.pop()):
            heads = [node] if isinstance(node, Global) else [node.function] if isinstance(node, App) else []
            for head in heads:
                function, _ = underlying(head, resolve)
                if function is not None and function not in found:
                    found[function] = None
                    waiting.append(function.body)
    return found


def _names(
    term: Term, recursive: bool, exponents: bool, known: dict[Lam, frozenset[str]], resolve: Resolve
) -> frozenset[str]:
    names: set[str] = set()
    for node in postorder(term):
        match node:
            case If() if recursive:
                names |= node.condition.free
            case Sum() | Fold():
                names |= _values(node.lo) | _values(node.hi)
            case Array():
                names |= _values(node.size)
            case Prim(op="pow") if exponents:
                names |= node.args[1].free
            case App():
                names |= _given(node, known, resolve)
            case _:
                pass
    return frozenset(names)


def _values(term: Term) -> frozenset[str]:
    """The names whose values a term depends on: of an array of which only the length is asked, not its own."""
    if not any(isinstance(node, Length) for node in postorder(term)):
        return term.free
    parts = postorder(term, below=lambda node: () if isinstance(node, Length) else children(node))
    return term.free.intersection(node.name for node in parts if isinstance(node, Var))


def _given(call: App, known: dict[Lam, frozenset[str]], resolve: Resolve) -> set[str]:
    """The names in the arguments of a call that decide something in the function."""
    head, groups = spine(call)
    function, _ = underlying(head, resolve)
    if function is None:
        return set(call.free)
    names: set[str] = set()
    decides: set[str] = set(known.get(function, ()))
    inner: Term = function
    for args in groups:
        if not isinstance(inner, Lam):
            return names | {n for group in groups for a in group for n in a.free} if decides else names
        given = fitted(args, len(inner.params))
        if len(given) != len(inner.params):
            return {n for group in groups for a in group for n in a.free}
        for param, arg in zip(inner.params, given, strict=True):
            if param in decides:
                names |= arg.free
        inner = inner.body
    params, _ = uncurry(function, sizes_of(groups))
    return names | (decides - set(params))
