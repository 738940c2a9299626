"""Where a term can branch: the sites that a trace names.

Owns `layout`. A kernel takes a trace, one entry per site of its term: a branch (as it falls, or forced to a side), a
call (the callee's trace) or a part that is compiled on its own (a lazy side of a conditional, a sum). The order of
sites is a property of the term alone, so a caller and a separately compiled callee agree on it without meeting.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from msgspec import Struct

from potto.core.terms import (
    App,
    Array,
    Branch,
    Deriv,
    Fold,
    Hole,
    If,
    Index,
    Integral,
    Lam,
    Prim,
    Sum,
    Term,
    children,
    function_of,
    lam,
    outside,
    postorder,
)  # fmt: skip
from potto.core.walking import Holding


class Side(Struct, frozen=True):
    """A site whose sides are evaluated everywhere and selected: the branch itself."""

    branch: Branch


class Subkernel(Struct, frozen=True):
    """A site that is a kernel of its own: the then (or else) side of a lazy conditional, or a sum's body.

    `owner` is the If, Branch or Sum; `body` the part as a function of its free variables, in sorted order.
    """

    owner: Term
    index: int
    body: Lam


class CallSite(Struct, frozen=True):
    """A call: `head` applied to groups of arguments."""

    call: App
    head: Term
    groups: tuple[tuple[Term, ...], ...]


Site = Side | Subkernel | CallSite


class TermSites(Struct, frozen=True):
    """The sites of one term, and the terms evaluated at once (not inside a part, a function or an integral)."""

    sites: tuple[Site, ...]
    index: dict[tuple[Term, int], int]
    order: tuple[Term, ...]


def spine(call: App) -> tuple[Term, tuple[tuple[Term, ...], ...]]:
    """Head and groups of a curried call: `f (x, y) c` is f and ((x, y), (c,))."""
    groups: list[tuple[Term, ...]] = []
    term: Term = call
    while isinstance(term, App):
        groups.append(term.args)
        term = term.function
    return term, tuple(reversed(groups))


HEAVY = (Integral, Sum, Fold, Array, Index)


_holds_heavy, _holds_call = Holding(*HEAVY), Holding(App, Hole)


def is_heavy(term: Term, calls: bool) -> bool:
    """Whether a side of a conditional is worth evaluating only where it is taken.

    Integrals, sums and what reads arrays are; calls and holes are too (`calls`) under a plain condition, which may be
    what ends a recursion, or says that a measure is none.
    """
    return _holds_heavy(term) or (calls and _holds_call(term))


def is_lazy(term: If | Branch) -> bool:
    calls = isinstance(term, If)
    return is_heavy(term.then, calls) or is_heavy(term.orelse, calls)


def immediate(term: Term) -> tuple[Term, ...]:
    """The children that are evaluated together with the term itself."""
    match term:
        case Lam() | Integral() | Deriv():
            return ()
        case Sum():
            return (term.lo, term.hi)
        case Fold():
            return (term.lo, term.hi, term.start)
        case Array():
            return (term.size,)
        case If():
            return (term.condition,) if is_lazy(term) else children(term)
        case Branch():
            return (term.surface,) if is_lazy(term) else (term.surface, term.then, term.orelse)
        case App():
            head, groups = spine(term)
            return (head, *(a for group in groups for a in group))
        case _:
            return children(term)


def integrating(term: Prim, inexact: Callable[[Term], bool] | None) -> frozenset[Term]:
    """The summands, if they are several, that are made of integrals and arithmetic, so that none has a site; or of
    calls that lead to integrals, too, where nobody forces sites: there `inexact` says which do."""
    if term.op != "add":
        return frozenset()
    found = frozenset(arg for arg in term.args if _integrates(arg) or (inexact is not None and _calls(arg, inexact)))
    return found if len(found) > 1 else frozenset()


_holds_integral = Holding(Integral)


@lru_cache(maxsize=16384)
def _integrates(term: Term) -> bool:
    return _holds_integral(term) and Integral in (kinds := _kinds(term)) and kinds.isdisjoint((App, Branch, If, Sum))


def _calls(term: Term, inexact: Callable[[Term], bool]) -> bool:
    return (
        _holds_call(term) and App in (kinds := _kinds(term)) and kinds.isdisjoint((Branch, If, Sum)) and inexact(term)
    )


def _kinds(term: Term) -> set[type[Term]]:
    """Of what kinds the parts of a term are that stand outside of integrals and functions."""
    return {type(node) for node in outside(term, (Integral, Lam, Deriv))}


@lru_cache(maxsize=16384)
def layout(term: Term) -> TermSites:
    order = postorder(term, below=immediate)
    sites: list[Site] = []
    index: dict[tuple[Term, int], int] = {}

    def site(term: Term, which: int, entry: Site) -> None:
        index[term, which] = len(sites)
        sites.append(entry)

    for node in order:
        if isinstance(node, (If, Branch)) and is_lazy(node):
            if isinstance(node, Branch):
                site(node, 2, Side(node))
            site(node, 0, Subkernel(node, 0, function_of(node.then)))
            site(node, 1, Subkernel(node, 1, function_of(node.orelse)))
        elif isinstance(node, Branch):
            site(node, 2, Side(node))
        elif isinstance(node, Sum):
            site(node, 0, Subkernel(node, 0, lam(tuple(sorted(node.body.free | {node.variable})), node.body)))
        elif isinstance(node, App):
            site(node, 0, CallSite(node, *spine(node)))
    return TermSites(tuple(sites), index, tuple(order))
