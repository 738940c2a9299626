"""Calls carried out: a term in which known functions are replaced by what they do.

Owns `expanded`, `Expansion`, `Calls`, `known_function`, `named` and `heads_of`.
"""

from __future__ import annotations

from collections.abc import Callable

from potto.calculus.inlining.currying import arguments_of, sizes_of, uncurry
from potto.calculus.surfaces.trace import spine
from potto.core.binders import Bound, apart
from potto.core.terms import App, Deriv, Global, Lam, Proj, Term, Var, children, postorder, proj, rebuild, substitute

# The term of another definition: its skeleton, or all of it.
Resolve = Callable[[Global], "Term | None"]
# The dual of a function.
Derive = Callable[[Lam], Lam]

DEEPEST = 60  # calls inside calls
MOST_NAMES = 100  # that a definition may lead through


def expanded(term: Term, resolve: Resolve, derive: Derive | None = None, rounds: int = 1) -> Term:
    """The term with calls of known functions carried out; of derivatives too, if it is said how.

    rounds: how many calls of a recursion are carried out inside each other.
    """
    return Expansion(resolve, derive, rounds).of(term)


class Calls:
    """Calls that were carried out, each with the same arguments once."""

    def __init__(self) -> None:
        self.known: dict[tuple[Lam, tuple[Term, ...]], Term] = {}

    def carried_out(
        self, call: App, function: Lam, groups: tuple[tuple[Term, ...], ...], run: Callable[[Term], Term]
    ) -> Term:
        """What `run` makes of the function's body with the arguments in it; the call, if they don't fit."""
        params, body = uncurry(function, sizes_of(groups))
        args = arguments_of(function, groups)
        if len(args) != len(params):
            return call
        key = (function, args)
        if key not in self.known:
            self.known[key] = run(substitute(body, dict(zip(params, args, strict=True))))
        return self.known[key]


class Expansion:
    """Calls carried out in one term or several, each call with the same arguments once.

    A call of a definition inside itself stays a call after some rounds: how deep it goes is decided by values. Binders
    that get inside of each other have names of their own.
    """

    def __init__(self, resolve: Resolve, derive: Derive | None = None, rounds: int = 1) -> None:
        self.resolve = resolve
        self.derive = derive
        self.rounds = rounds
        self.calls = Calls()
        self.bound: Bound = {}

    def of(self, term: Term) -> Term:
        return apart(self.run(term, ()), self.bound)

    def run(self, term: Term, path: tuple[Term, ...]) -> Term:
        memo: dict[Term, Term] = {}
        for node in postorder(term):
            if isinstance(node, Proj):
                memo[node] = proj(memo[node.term], node.index)
                continue
            new = rebuild(node, tuple(memo[c] for c in children(node)))
            memo[node] = self.applied(new, path) if isinstance(new, App) else new
        return memo[term]

    def applied(self, call: App, path: tuple[Term, ...]) -> Term:
        head, groups = spine(call)
        named = head
        while isinstance(named, Deriv):
            named = named.function
        if path.count(named) >= self.rounds or len(path) > DEEPEST:
            return call
        function = known_function(head, self.resolve, self.derive)
        if function is None:
            return call
        inner = (*path, named) if isinstance(named, Global) else path
        return self.calls.carried_out(call, function, groups, lambda body: self.run(body, inner))


def known_function(head: Term, resolve: Resolve, derive: Derive | None) -> Lam | None:
    """The function that the head of a call is, if it is known."""
    if isinstance(head, Global):
        found = named(head, resolve)
        if isinstance(found, Deriv) and derive is not None:  # a derivative that has a name
            return known_function(found, resolve, derive)
        return found if isinstance(found, Lam) else None
    if isinstance(head, Deriv) and derive is not None:
        inner = known_function(head.function, resolve, derive)
        return None if inner is None else derive(inner)
    return head if isinstance(head, Lam) else None


def named(name: Global, resolve: Resolve) -> Term | None:
    """What a name stands for, through definitions that are other names."""
    found: Term | None = name
    for _ in range(MOST_NAMES):
        if not isinstance(found, Global):
            return found
        found = resolve(found)
    return None


def heads_of(term: Term) -> frozenset[str]:
    """The variables that are functions: those that are applied."""
    found: set[str] = set()
    for node in postorder(term):
        if isinstance(node, App):
            head = node.function
            while isinstance(head, Deriv):
                head = head.function
            if isinstance(head, Var):
                found.add(head.name)
    return frozenset(found)
