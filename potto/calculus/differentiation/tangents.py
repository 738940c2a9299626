"""Tangents under an integral: the calls of derivatives in an integrand, and what of them may be a distribution.

Owns `Site` and `Sites`. A site is a call of `deriv(f)` whose arguments vary; its tangents have deltas where f jumps. A
site is *hard* if they surely have, for f jumps by itself, and soft if f's only jumps are inside integrals, where they
are smoothed unless a surface comes to lie along the variable that is integrated over.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from potto.calculus.differentiation.derivative import zero_like
from potto.calculus.inlining.expand import Resolve, expanded
from potto.calculus.surfaces.branch_assignment import branches_of
from potto.calculus.surfaces.trace import spine
from potto.core.terms import (
    ZERO,
    App,
    Branch,
    Deriv,
    Global,
    If,
    Integral,
    Lam,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    add,
    app,
    mul,
    postorder,
    proj,
    tuple_,
)
from potto.primitives import PRIMITIVES

# How a value is built: None is a number, a tuple has the shapes of its items, the rest are functions.
Shape = Any
FUNCTION = "function"
Shapes = Callable[[str], Shape]


class NotShifted(Exception):
    """The deltas of a derivative that are not found: says why."""


@dataclass(frozen=True, slots=True)
class Site:
    """A call of a derivative in an integrand.

    order: how many derivatives are taken there. function: what is derived, without them. groups: the duals it is given.
    """

    call: App
    order: int
    function: Term
    groups: tuple[tuple[Term, ...], ...]


def site_of(call: App) -> Site | None:
    head, groups = spine(call)
    order = 0
    while isinstance(head, Deriv):
        head, order = head.function, order + 1
    return Site(call, order, head, groups) if order else None


class Sites:
    """The sites of one integrand, whose calls that lead to derivatives are carried out.

    shapes: how the values of free variables are built.
    """

    def __init__(self, body: Term, variables: Iterable[str], resolve: Resolve, shapes: Shapes) -> None:
        self.resolve = resolve
        self.shapes = shapes
        self.jumping: dict[App, Site] = {}
        self.hard: set[App] = set()
        bound = _bound(body) | frozenset(variables)
        inner = {node.function for node in postorder(body) if isinstance(node, App)}
        for node in postorder(body):
            site = site_of(node) if isinstance(node, App) and node not in inner else None
            if site is not None:
                self.jumping.update(self._judged(site, bound))

    def _judged(self, site: Site, bound: frozenset[str]) -> dict[App, Site]:
        if not site.call.free & bound:
            return {}
        plain = expanded(self.shifted(site, ()), self.resolve)
        parts = postorder(plain)
        derived = any(isinstance(node, Deriv) for node in parts)
        bent = any(isinstance(node, Prim) and PRIMITIVES[node.op].kinks(*node.args) for node in parts)
        if not any(isinstance(node, Branch) for node in parts) and not (bent and (derived or site.order > 1)):
            return {}
        if derived or branches_of(plain, plain.free) or (bent and site.order > 1):
            self.hard.add(site.call)
        return {site.call: site}

    # The function at shifted arguments

    def shifted(self, site: Site, steps: tuple[tuple[int, Term], ...]) -> Term:
        """What the function gives where its arguments have gone some steps along their tangents.

        steps: which tangent (its place in the path of projections, read as a binary number) and how far.
        """
        result = site.function
        for group in site.groups:
            result = app(result, tuple(self._argument(a, site.order, steps) for a in group))
        return result

    def _argument(self, arg: Term, order: int, steps: tuple[tuple[int, Term], ...]) -> Term:
        if isinstance(arg, Deriv):
            for _ in range(order):
                if not isinstance(arg, Deriv):
                    raise NotShifted("a function that is given to it is not written as a derivative")
                arg = arg.function
            return arg
        if isinstance(arg, Lam) or (isinstance(arg, Global) and isinstance(self.resolve(arg), Lam)):
            raise NotShifted("a function that is given to it is written by hand for duals")
        inner = self.pair(arg)
        if inner is not None:
            if inner.order != order:
                raise NotShifted("derivatives of different orders are given to each other")
            return self.shifted(inner, steps)
        components = self.components(arg, order)
        value = components[0]
        for place, step in steps:
            value = self._moved(value, step, components[place])
        return value

    def _moved(self, value: Term, step: Term, tangent: Term) -> Term:
        """value + step*tangent, for numbers and tuples."""
        if tangent is ZERO:
            return value
        shape = self.shape(value)
        if shape is None:
            return add(value, mul(step, tangent))
        return tuple_(self._moved(proj(value, i), step, proj(tangent, i)) for i in range(len(shape)))

    def pair(self, arg: Term) -> Site | None:
        """The site that an argument is all of."""
        return site_of(arg) if isinstance(arg, App) else _whole_pair(arg)

    def components(self, arg: Term, order: int) -> list[Term]:
        """The value of a dual and its tangents: of a dual of duals (v, t), (w, u) these are v, t, w, u."""
        value, tangent = self.split(arg)
        if order == 1:
            return [value, tangent]
        return [*self.components(value, order - 1), *self.components(tangent, order - 1)]

    def split(self, arg: Term) -> tuple[Term, Term]:
        shape = self.shape(arg)
        if shape is None:
            return arg, ZERO
        if shape == FUNCTION:
            raise NotShifted("a function that is given to it is written by hand for duals")
        if len(shape) != 2:
            raise NotShifted("a value that is no dual is given to a derivative")
        first, second = proj(arg, 0), proj(arg, 1)
        if (shape[0] is None) != (shape[1] is None):
            raise NotShifted("a value that is no dual is given to a derivative")
        return first, second

    def shape(self, term: Term) -> Shape:
        match term:
            case Var(name=name):
                return self.shapes(name)
            case Tuple(items=items):
                return tuple(map(self.shape, items))
            case Proj(term=inner, index=index):
                whole = self.shape(inner)
                if whole is None or index >= len(whole):
                    raise NotShifted("a part of something that has none is taken")
                return whole[index]
            case If(then=then) | Branch(then=then):
                return self.shape(then)
            case Sum(body=body) | Integral(body=body):
                return self.shape(body)
            case Global():
                known = self.resolve(term)
                return self.shape(known) if known is not None else _unknown()
            case App():
                site = site_of(term)
                if site is not None:
                    inside = self.shape(expanded(self.shifted(site, ()), self.resolve))
                    for _ in range(site.order):
                        inside = (inside, inside)
                    return inside
                whole = expanded(term, self.resolve)
                return self.shape(whole) if whole is not term else _unknown()
            case Lam() | Deriv():
                return _unknown()
            case _:
                return None

    def zero(self, site: Site) -> Term:
        """A tangent that is 0, built like what the function gives."""
        return zero_like(expanded(self.shifted(site, ()), self.resolve))


def _unknown() -> Shape:
    raise NotShifted("it is not known what a function gives")


def _whole_pair(arg: Term) -> Site | None:
    """`(v, w)` of `let (v, w) = deriv(g)(…)`."""
    items = arg.items if isinstance(arg, Tuple) else ()
    if len(items) != 2 or not all(isinstance(item, Proj) for item in items):
        return None
    whole = items[0].term  # type: ignore[union-attr]
    if any(item is not proj(whole, place) for place, item in enumerate(items)):
        return None
    return site_of(whole) if isinstance(whole, App) else None


def _bound(body: Term) -> frozenset[str]:
    found: set[str] = set()
    for node in postorder(body):
        if isinstance(node, Integral):
            found.update(node.variables)
        elif isinstance(node, Sum):
            found.add(node.variable)
    return frozenset(found)
