"""Numbers that have a name, `k = 0.3`, where they are read: what decides a condition is to be enclosed.

Owns `with_numbers`, and `as_parameters`, which says the same without their values.
"""

from __future__ import annotations

from collections.abc import Mapping

from potto.calculus.inlining.expand import Resolve
from potto.core.terms import Const, Global, Prim, Term, postorder, var
from potto.core.walking import fresh, transform

MOST_NODES = 64  # of a definition that is arithmetic: longer ones are evaluated once, and read


def with_numbers(term: Term, resolve: Resolve) -> Term:
    """The term with arithmetic in the place of names that stand for it; functions, integrals and data keep theirs."""
    return _replaced(term, {name: found for name in _names(term) if (found := _arithmetic(name, resolve, ()))})


def as_parameters(term: Term, resolve: Resolve) -> Term:
    """The term with a variable for each name that stands for arithmetic, called like it where that is free."""
    numbers = [name for name in _names(term) if _arithmetic(name, resolve, ())]
    return _replaced(term, {name: var(fresh(name.name, term.free)) for name in numbers})


def _names(term: Term) -> list[Global]:
    return [node for node in postorder(term) if isinstance(node, Global)]


def _replaced(term: Term, known: Mapping[Term, Term]) -> Term:
    return transform(term, lambda node, new: known.get(node, new)) if known else term


def _arithmetic(name: Global, resolve: Resolve, path: tuple[Global, ...]) -> Term | None:
    """What a name stands for, if that is arithmetic of numbers and of names for such."""
    found = None if name in path else resolve(name)
    if not isinstance(found, Const | Prim | Global):
        return None
    nodes = list(postorder(found))
    if len(nodes) > MOST_NODES or not all(isinstance(node, Const | Prim | Global) for node in nodes):
        return None
    known: dict[Term, Term] = {}
    for inner in _names(found):
        arithmetic = _arithmetic(inner, resolve, (*path, name))
        if arithmetic is None:
            return None
        known[inner] = arithmetic
    return _replaced(found, known)
