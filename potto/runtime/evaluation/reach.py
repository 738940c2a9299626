"""What terms lead to, through definitions: derivatives, jumps, integrals.

Owns `Reach`, and `kept` for what follows from that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import wraps
from itertools import chain
from typing import Any, ParamSpec, TypeVar

from potto.calculus.inlining.arrays import ARRAYS
from potto.calculus.inlining.expand import Resolve
from potto.core.terms import Branch, Delta, Deriv, Global, Index, Integral, Lam, Prim, Term, outside, reached
from potto.primitives import PRIMITIVES

MOST_KEPT = 4096  # results of one function
P = ParamSpec("P")
R = TypeVar("R")


class Reach:
    """What is reached from terms, through definitions. results: of functions, by their other arguments (`kept`)."""

    def __init__(self, resolve: Resolve) -> None:
        self.resolve = resolve
        self.known: dict[Term, frozenset[type]] = {}
        self.known_branches: dict[Term, int] = {}
        self.known_derived: dict[Term, frozenset[type]] = {}
        self.known_recursions: dict[Term, frozenset[Global]] = {}
        self.known_spikes: dict[Term, bool] = {}
        self.results: dict[Any, dict[Any, Any]] = {}

    def kinds(self, term: Term) -> frozenset[type]:
        """Deriv, Branch, Delta and Integral, where there are such terms; Prim for a builtin with a kink, Index for what
        has to do with arrays."""
        found = self.known.get(term)
        if found is None:
            found = self.known[term] = frozenset(self._found(term))
        return found

    def branches(self, term: Term) -> int:
        """How many conditions there are, those of each definition once."""
        found = self.known_branches.get(term)
        if found is None:
            found = self.known_branches[term] = sum(isinstance(node, Branch) for node in self._all(term))
        return found

    def derived(self, term: Term) -> frozenset[type]:
        """What is reached from the functions that are derived; of one that is a parameter, or a part of
        one, it may be anything."""
        found = self.known_derived.get(term)
        if found is None:
            heads = {node.function for node in self._all(term) if isinstance(node, Deriv)}
            kinds = (self.kinds(head if isinstance(head, Global | Lam | Deriv) else term) for head in heads)
            found = self.known_derived[term] = frozenset[type]().union(*kinds)
        return found

    def deltas(self, term: Term) -> bool:
        """Whether something that jumps is derived, or has deltas itself, or something that bends twice."""
        found = self.derived(term)
        return bool(found & {Branch, Delta}) or found >= {Deriv, Prim}

    def recursions(self, term: Term) -> frozenset[Global]:
        """The definitions that are reached, and lead to themselves."""
        found = self.known_recursions.get(term)
        if found is None:
            names = {node for node in self._all(term) if isinstance(node, Global)}
            found = self.known_recursions[term] = frozenset(filter(self._returns, names))
        return found

    def _returns(self, name: Global) -> bool:
        known = self.resolve(name)
        return known is not None and any(name in nodes for nodes in reached(known, resolve=self.resolve))

    def spikes(self, function: Term) -> bool:
        """Whether what a function gives has deltas that no integral of its own is around."""
        found = self.known_spikes.get(function)
        if found is None:
            self.known_spikes[function] = False  # of a recursion: what it adds itself is found without it
            found = self.known_spikes[function] = any(self._spiky(node) for node in outside(function, (Integral,)))
        return found

    def _spiky(self, node: Term) -> bool:
        if isinstance(node, Global):
            known = self.resolve(node)
            return known is not None and self.spikes(known)
        return isinstance(node, Delta)

    def _all(self, term: Term) -> Iterator[Term]:
        return chain.from_iterable(reached(term, resolve=self.resolve))

    def _found(self, term: Term) -> Iterator[type]:
        for node in self._all(term):
            if isinstance(node, Deriv | Branch | Delta | Integral):
                yield type(node)
            elif isinstance(node, ARRAYS):
                yield Index
            elif isinstance(node, Prim) and PRIMITIVES[node.op].kinks(*node.args):
                yield Prim


def kept(function: Callable[P, R]) -> Callable[P, R]:
    """The function, whose last argument is a `Reach`, with its results kept there: they go with the program, where a
    cache of the function would keep the program."""

    @wraps(function)
    def known(*args: P.args, **others: P.kwargs) -> R:
        *key, reach = args
        assert isinstance(reach, Reach) and not others
        results = reach.results.setdefault(function, {})
        terms = tuple(key)
        if terms not in results:
            if len(results) >= MOST_KEPT:
                results.clear()
            results[terms] = function(*args, **others)
        found: R = results[terms]
        return found

    return known
