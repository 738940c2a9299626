"""Terms with everything carried out that plain values decide: calls, the sides of plain conditionals, sums.

Owns `unrolled` and `loops_unrolled`. `expand` leaves a recursion as a call, since how deep it goes is a matter of
values; here the values are known, so that a simulation of n steps becomes one term, in which a state that is met again
is one object.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from potto.calculus.inlining.expand import Calls, Step, driven
from potto.calculus.surfaces.finding import Decide, Resolve
from potto.calculus.surfaces.trace import spine
from potto.core.binders import apart
from potto.core.terms import (
    App,
    Branch,
    Const,
    Delta,
    Deriv,
    Fold,
    Holding,
    If,
    Lam,
    Proj,
    Sum,
    Term,
    add,
    children,
    const,
    postorder,
    proj,
    rebuild,
    substitute,
    sum_,
)

MOST_CALLS = 5000
MOST_SUMMANDS = 256  # where it is not known yet what becomes of them
MOST_STEPS = 1000  # of a loop that is written out to be integrated

holds_loop, holds_branch = Holding(Sum, Fold), Holding(Branch)


class _TooMuch(Exception):
    """More calls than a term is worth."""


def unrolled(term: Term, resolve: Resolve, decide: Decide, most: int = MOST_SUMMANDS) -> Term | None:
    """An equal term for the plain values at hand; None if it would take too many calls.

    `resolve` gives the functions that a call may be replaced by; others stay calls. most: steps of a loop.
    """
    try:
        return apart(driven(_Unrolling(resolve, decide, most).run(term)))
    except _TooMuch:
        return None


def loops_unrolled(term: Term, decisions: Mapping[Term, float | None]) -> Term:
    """An equal term in which sums and folds that jump are written out, calls left as they are. decisions: the values
    of plain terms, as far as these are known."""
    if not (holds_loop(term) and holds_branch(term)):
        return term

    def decided(plain: Term) -> float | None:
        return plain.value if isinstance(plain, Const) else decisions.get(plain)

    return unrolled(term, lambda head: None, decided, MOST_STEPS) or term


class _Unrolling:
    """One unrolling."""

    def __init__(self, resolve: Resolve, decide: Decide, most: int) -> None:
        self.resolve = resolve
        self.decide = decide
        self.most = most
        self.calls = Calls()
        self.begun = 0

    def run(self, term: Term) -> Step:
        taken: dict[Term, Term] = {}  # plain conditionals, and the sides that they take
        memo: dict[Term, Term] = {}
        deciding = {
            part
            for node in postorder(term)
            if isinstance(node, Branch | Delta)
            for part in postorder(node.coordinates[0])
            if isinstance(part, Sum | Fold)
        }
        for node in postorder(term, below=lambda node: self.below(node, taken)):
            if node in taken:
                memo[node] = memo[taken[node]]
            elif isinstance(node, Deriv):
                memo[node] = node
            elif isinstance(node, Proj):
                memo[node] = proj(memo[node.term], node.index)
            else:
                new = rebuild(node, tuple(memo[c] for c in children(node)))
                memo[node] = (yield step) if (step := self.carried_out(new, node in deciding)) else new
        return memo[term]

    def below(self, node: Term, taken: dict[Term, Term]) -> Sequence[Term]:
        """What has to be there before a node: of a conditional that is decided, the side that it takes."""
        if isinstance(node, Deriv):
            return ()
        if isinstance(node, If):
            outcome = self.decide(node.condition)
            if outcome is not None and outcome == outcome:
                taken[node] = node.then if outcome else node.orelse
                return (taken[node],)
        return children(node)

    def carried_out(self, node: Term, decides: bool) -> Step | None:
        """A call as what it does, a sum as its summands where they jump, or decide where something else does; a fold
        whose steps jump as these; None for what stays."""
        if isinstance(node, App):
            return self.applied(node)
        if isinstance(node, Sum) and (decides or any(isinstance(part, App | Branch) for part in postorder(node.body))):
            return self.summed(node, decides)
        if isinstance(node, Fold) and (decides or any(isinstance(part, App | Branch) for part in postorder(node.body))):
            return self.stepped(node)
        return None

    def applied(self, call: App) -> Step:
        head, groups = spine(call)
        function = head if isinstance(head, Lam) else self.resolve(head)
        if not isinstance(function, Lam):
            return call
        return (yield self.calls.carried_out(call, function, groups, self.inside))

    def inside(self, body: Term) -> Step:
        """What is carried out within a function."""
        self.begun += 1
        if self.begun > MOST_CALLS:
            raise _TooMuch
        return self.run(body)

    def summed(self, node: Sum, decides: bool) -> Step:
        """What an endless sum goes on with stays a sum, unless it decides: jumps there are next to nothing."""
        numbers = self.numbers(node)
        if numbers is None:
            return node
        terms = []
        for k in numbers:
            terms.append((yield self.run(substitute(node.body, {node.variable: const(k)}))))
        if node.endless and not decides:
            terms.append(sum_(node.variable, const(numbers.stop), const(numbers.stop - 1), node.body, True))
        return add(*terms)

    def stepped(self, node: Fold) -> Step:
        numbers, state = self.numbers(node), node.start
        if numbers is None:
            return node
        for k in numbers:
            state = yield self.run(substitute(node.body, {node.variable: const(k), node.state: state}))
        return state

    def numbers(self, node: Sum | Fold) -> range | None:
        """What a loop goes through, if that is known and not too much to write out."""
        lo, hi = self.decide(node.lo), self.decide(node.hi)
        if lo is None or hi is None or not hi - lo < self.most:
            return None
        return range(int(lo), int(hi) + 1)
