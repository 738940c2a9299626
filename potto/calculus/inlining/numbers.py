"""Numbers that have a name, `k = 0.3`, where they are read: what decides a condition is to be enclosed.

Owns `with_numbers`, and `as_parameters`, which says the same without their values. Owns `IntegralsAsParameters`, for
calls that give a number by an integral.
"""

from __future__ import annotations

from collections.abc import Container, Mapping

from msgspec import Struct

from potto.calculus.inlining.currying import sizes_of, uncurry
from potto.calculus.inlining.expand import Resolve
from potto.calculus.surfaces.trace import spine
from potto.core.printer import format_term
from potto.core.terms import App, Const, Global, Integral, Lam, Prim, Term, postorder, var
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


class IntegralsAsParameters(Struct):
    """Calls of definitions that integrate, as variables called like them, `g(t)`, where no variable of integration goes
    in: of such a number no more is known, and what it is of, however many integrals deep, is the definition's.

    variables: those of integration, also ones that come to be known later.
    """

    resolve: Resolve
    variables: Container[str]
    found: dict[App, Term] = {}

    def __call__(self, call: App) -> Term | None:
        """The variable; None of any other call."""
        if call not in self.found:
            head, groups = spine(call)
            if not isinstance(head, Global) or any(name in self.variables for name in call.free):
                return None
            function = self.resolve(head)
            if not isinstance(function, Lam):
                return None
            _, body = uncurry(function, sizes_of(groups))
            if not isinstance(body, Integral | Prim) or not any(isinstance(n, Integral) for n in postorder(body)):
                return None
            text = format_term(call)
            taken = frozenset().union(*(known.free for known in self.found.values()))
            self.found[call] = var(fresh(head.name if "'" in text else text, taken))
        return self.found[call]
