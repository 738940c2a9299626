"""Jumps that stand under an inner integral but do not vary with it, brought to where a trace can reach them.

Owns `hoisted`. Of `integral [0, 1] exp(integral [0, 1] [x < t]*y d(y)) d(x)` the branch is a matter of x alone: the
inner integral is then one of two, and choosing between them is a branch of the outer integrand. Where a call hides
such a branch, the call is carried out first. What stays out of reach (a bound that jumps with a variable of the same
integral, a sum whose index decides) is left as it is.
"""

from __future__ import annotations

from collections.abc import Iterable

from potto.calculus.surfaces.discontinuities import carried_out, findings
from potto.calculus.surfaces.finding import Finding, Resolve
from potto.core.terms import (
    Branch,
    Integral,
    Prim,
    Sum,
    Term,
    add,
    bound_names,
    branch,
    integral,
    neg,
    postorder,
    transform,
    with_integrand,
    with_summand,
)

MOST = 6  # branches taken out of one integral: each doubles the integrals that there are


def hidden(term: Integral, found: Iterable[Finding], resolve: Resolve) -> bool:
    """Whether a trace can't force some jump: one inside an inner integral, or one of a bound."""
    names = set(term.variables)
    if any(f.kind == "jump" and not f.path and f.surface.free & names for f in found):
        return True
    return any(jumps_in(b, term.variables[:n], resolve) for n, pair in enumerate(term.bounds) for b in pair)


def hoisted(term: Integral, resolve: Resolve) -> Integral:
    """An equal integral whose integrand's jumps have been taken out of the integrals inside of it.

    `resolve` gives the functions that a call may be replaced by: not one that stands for its derivative.
    """
    term = split_at_bounds(term, resolve)
    body = _taken_out(term.body)
    known = carried_out(body, resolve)
    return with_integrand(term, body if known is body else _taken_out(known))


def split_at_bounds(term: Integral, resolve: Resolve) -> Integral:
    """An integral whose bounds jump with its own variables as one inside the other."""
    for level in range(1, len(term.variables)):
        outer = set(term.variables[:level])
        if any(jumps_in(bound, outer, resolve) for bound in term.bounds[level]):
            inner = integral(term.variables[level:], term.bounds[level:], term.body, term.hints[level:])
            return integral(term.variables[:level], term.bounds[:level], inner, term.hints[:level])
    return term


def jumps_in(bound: Term, variables: Iterable[str], resolve: Resolve) -> bool:
    """Whether a bound jumps as some variables vary."""
    names = set(variables)
    if not names & bound.free:
        return False
    return any(f.kind == "jump" and f.surface.free & names for f in findings(bound, resolve))


def _taken_out(body: Term) -> Term:
    return transform(body, lambda _, new: _outside(new) if isinstance(new, Integral) else new)


def _outside(term: Integral) -> Term:
    """The integral with the branches that don't vary with anything inside of it in front of it."""
    if not any(isinstance(node, Branch) for node in postorder(term)):
        return term
    body, inside = term.body, _names(term)
    if isinstance(body, Sum) and body.variable not in term.free and not inside & (body.lo.free | body.hi.free):
        return with_summand(body, _outside(with_integrand(term, body.body)))
    found = [
        node
        for node in reversed(postorder(term))
        if isinstance(node, Branch) and node.surface.free and not inside & node.surface.free
    ]
    if found and isinstance(body, Prim) and body.op == "add":
        return add(*(_outside(with_integrand(term, arg)) for arg in body.args))
    if found and isinstance(body, Prim) and body.op == "neg":
        return neg(_outside(with_integrand(term, body.args[0])))
    return _chosen(term, found[:MOST])


def _names(term: Term) -> set[str]:
    """All names that a term binds."""
    return {name for node in postorder(term) for name in bound_names(node)}


def _chosen(term: Term, branches: list[Branch]) -> Term:
    """The term in each of the cases of its branches, chosen by them."""
    if not branches:
        return term
    first, rest = branches[0], branches[1:]
    if not any(_same(node, first) for node in postorder(term)):
        return _chosen(term, rest)
    then, orelse = (_chosen(_with(term, first, side), rest) for side in (True, False))
    return branch(first.coordinates, first.strict, then, orelse)


def _same(node: Term, decided: Branch) -> bool:
    return isinstance(node, Branch) and node.surface is decided.surface and node.strict == decided.strict


def _with(term: Term, decided: Branch, side: bool) -> Term:
    """The term where one branch is decided, wherever its surface is met."""

    def change(node: Term, new: Term) -> Term:
        if isinstance(new, Branch) and _same(node, decided):
            return new.then if side else new.orelse
        return new

    return transform(term, change)
