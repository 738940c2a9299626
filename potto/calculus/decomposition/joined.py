"""Integrals of integrals as one integral over all of their variables.

Owns `joined`. `integral A (integral B f d(y)) d(x)` means the integral of f over the region that both bounds describe.
As one integral its variables can change places, a surface may be cut along any of them, and nothing is lost to the
accuracy of an inner result: nested, a ball that touches its box has an inner integral that behaves like a square root.
Inner integrals that are added up are one where their bounds are the same, and so is what is added to one over a box of
numbers, by its mean. Owns `in_joined_summands`, for sums of others.

An inner integral that does not vary with the variables around it stays: it is one number, found once.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from potto.calculus.algebra.ranges import range_of
from potto.calculus.decomposition.finite import is_finite
from potto.calculus.decomposition.guards import is_guard
from potto.calculus.inlining.currying import arguments_of, sizes_of, uncurry
from potto.calculus.inlining.expand import Resolve, Step, driven, named
from potto.calculus.surfaces.trace import spine
from potto.core.binders import apart
from potto.core.terms import (
    ZERO,
    App,
    Branch,
    Const,
    Deriv,
    Global,
    If,
    Integral,
    Lam,
    Prim,
    Term,
    add,
    apply,
    bound_apart,
    div,
    if_,
    integral,
    mul,
    postorder,
    rename_bound,
    sub,
    substitute,
    with_integrand,
)

NONE = ZERO  # what is no integral that could be joined


def joined(term: Integral, resolve: Resolve) -> Integral:
    """An equal integral, or the same one where nothing can be joined. `resolve` gives the terms of definitions."""
    changed = False
    while True:
        inner = _as_one(_found(term, resolve))
        if inner is None:
            return apart(term) if changed else term  # type: ignore[return-value]
        term, changed = _one(term, inner), True


def in_joined_summands(term: Integral, resolve: Resolve) -> tuple[Integral, ...]:
    """Integrals whose sum this one is, where its body adds up integrals that can be joined with it one by one; none
    where there is only one, or where more than one may be infinite, as only their sum may be finite then."""
    parts = _by_bounds(_parts(_found(term, resolve)))
    if len(parts) < 2:
        return ()
    each = tuple(with_integrand(term, part) for part in parts)
    whole = (_one(part, part.body) if isinstance(part.body, Integral) else part for part in each)
    return each if sum(not is_finite(part) for part in whole) < 2 else ()


def _found(term: Integral, resolve: Resolve) -> Term:
    return driven(_inner(term.body, frozenset(term.variables), resolve, frozenset()))


def _parts(found: Term) -> list[Term]:
    """What is found to be added up."""
    parts: list[Term] = []
    waiting = [found]
    while waiting:
        item = waiting.pop()
        if isinstance(item, Prim) and item.op == "add":
            waiting.extend(reversed(item.args))
        else:
            parts.append(item)
    return parts


def _by_bounds(parts: list[Term]) -> list[Term]:
    """Integrals over the same region as one, and what is none, added up, at the end."""
    found: dict[tuple[tuple[Term, Term], ...], Integral] = {}
    others: list[Term] = []
    for part in parts:
        if not isinstance(part, Integral):
            others.append(part)
            continue
        key = _with_names(part, tuple(f"{place}@joined" for place in range(len(part.variables)))).bounds
        first = found.get(key)
        if first is None:
            found[key] = part
            continue
        first = bound_apart(first, part.free)
        found[key] = _over(first, add(first.body, _with_names(part, first.variables).body))
    return [*found.values(), add(*others)] if others else list(found.values())


def _with_names(term: Integral, names: tuple[str, ...]) -> Integral:
    return rename_bound(term, dict(zip(term.variables, names, strict=True)))


def _as_one(found: Term) -> Integral | None:
    """The one integral that a sum is, with the mean of what is added to it."""
    match _by_bounds(_parts(found)):
        case [Integral() as whole]:
            return whole
        case [Integral() as whole, rest] if not isinstance(rest, Integral) and not _heavy(rest):
            ends = [end for pair in whole.bounds for end in pair]
            lengths = [sub(hi, lo) for lo, hi in whole.bounds]
            if all(isinstance(end, Const) and math.isfinite(end.value) for end in ends) and all(
                range_of(length).positive for length in lengths
            ):
                whole = bound_apart(whole, rest.free)
                return _over(whole, add(whole.body, div(rest, mul(*lengths))))
    return None


def _one(outer: Integral, inner: Integral) -> Integral:
    inner = bound_apart(inner, outer.free.union(outer.variables))
    return integral(
        outer.variables + inner.variables, outer.bounds + inner.bounds, inner.body, outer.hints + inner.hints
    )


def _inner(body: Term, around: frozenset[str], resolve: Resolve, within: frozenset[Term]) -> Step:
    """The body as an integral that varies with the variables around it, and whose bounds do not jump with them, or as a
    sum with such integrals; else NONE. within: the definitions that are being looked into, none of which is within
    itself."""
    match body:
        case Integral():
            jumps = any(isinstance(n, Branch | App) for pair in body.bounds for b in pair for n in postorder(b))
            return body if body.free & around and not jumps else NONE
        case Prim(op="neg", args=(arg,)):
            return _with((yield _inner(arg, around, resolve, within)), body, 0)
        case Prim(op="div", args=(above, below)) if not _heavy(below):
            return _with((yield _inner(above, around, resolve, within)), body, 0)
        case Prim(op="mul"):
            return (yield _among_factors(body, around, resolve, within))
        case Prim(op="add"):
            found = list[Term]()
            for arg in body.args:
                found.append((yield _inner(arg, around, resolve, within)))
            if all(item is NONE for item in found):
                return NONE
            return add(*(arg if item is NONE else item for arg, item in zip(body.args, found, strict=True)))
        case If() if is_guard(body) and body.condition.free.isdisjoint(around):
            inner = yield _inner(body.then, around, resolve, within)
            return _each(inner, body.condition.free, lambda part: if_(body.condition, part, body.orelse))
        case App():
            head, _ = spine(body)
            made = None if head in within else _called(body, resolve)
            if made is None:
                return NONE
            return (yield _inner(made, around, resolve, within | {head} if isinstance(head, Global) else within))
        case _:
            return NONE


def _among_factors(body: Prim, around: frozenset[str], resolve: Resolve, within: frozenset[Term]) -> Step:
    """Of a product the only factor that is an integral, or a sum with some, with the others inside of it."""
    heavy = [at for at, factor in enumerate(body.args) if _heavy(factor) or isinstance(factor, App)]
    found = list[tuple[int, Term]]()
    for at in heavy:
        inner = yield _inner(body.args[at], around, resolve, within)
        if inner is not NONE:
            found.append((at, inner))
    others = [at for at in heavy if all(at != place for place, _ in found)]
    if len(found) != 1 or any(_heavy(body.args[at]) for at in others):
        return NONE
    at, inner = found[0]
    return _with(inner, body, at)


def _with(inner: Term, body: Prim, at: int) -> Term:
    """What is found of an argument with what the body does to it done to each summand."""
    return _each(inner, body.free, lambda part: apply(body.op, *body.args[:at], part, *body.args[at + 1 :]))


def _each(inner: Term, names: frozenset[str], change: Callable[[Term], Term]) -> Term:
    """The sum with every summand changed, of an integral the integrand. names: what is free in what changes it."""
    if inner is NONE:
        return NONE
    parts = [bound_apart(part, names) if isinstance(part, Integral) else part for part in _parts(inner)]
    return add(*(_over(part, change(part.body)) if isinstance(part, Integral) else change(part) for part in parts))


def _heavy(term: Term) -> bool:
    return any(isinstance(node, Integral) for node in postorder(term))


def _over(term: Integral, body: Term) -> Integral:
    return integral(term.variables, term.bounds, body, term.hints)


def _called(call: App, resolve: Resolve) -> Term | None:
    """What a call of a definition gives, if that may be an integral."""
    head, groups = spine(call)
    if isinstance(head, Global):
        head = named(head, resolve) or head
    if not isinstance(head, Lam):
        return None
    params, body = uncurry(head, sizes_of(groups))
    args = arguments_of(head, groups)
    if len(args) != len(params) or isinstance(body, Deriv) or (isinstance(body, If) and not is_guard(body)):
        return None
    return substitute(body, dict(zip(params, args, strict=True)))
