"""The integrals of a function as regions that can be drawn: bounds, integrand, and what its surfaces do.

Owns `regions`. Everything is a function of the function's parameters and the variables of integration, as Potto writes
it, so that numbers come from whoever evaluates programs. What a surface gains is its jump, from its negative to its
positive side, times its rate: how fast its condition grows as the chosen parameter does.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from msgspec import Struct

from potto.calculus.differentiation.boundary_terms import jumps
from potto.calculus.differentiation.dual import Differentiator
from potto.calculus.explanation.explain import equation
from potto.calculus.explanation.plain_names import plainly_named
from potto.checking.written_out import written_out
from potto.core.printer import format_term
from potto.core.simplify import simplify
from potto.core.terms import (
    ONE,
    App,
    Integral,
    Term,
    children,
    integral,
    postorder,
)
from potto.elaborate import core
from potto.query import Database
from potto.syntax import nodes

_COPY = re.compile(r"'\d+")  # the mark of a copy of a bound variable


class RegionSurface(Struct, frozen=True):
    """A surface: its equation, and as functions its condition, its rate, how that grows along each variable, and the
    jump of the integrand where the condition turns positive."""

    equation: str
    level: str
    rate: str
    slopes: tuple[str, ...]
    jump: str


class Region(Struct, frozen=True):
    """An integral: all texts are functions of `names`, the parameters and then the variables.

    bounds, rates: of each variable from and to, and how fast these move. A bound may name the variables before it.
    whole, interior: functions of the parameters alone, the integral and what it gains while surfaces and bounds stand
    still.
    """

    names: tuple[str, ...]
    variables: tuple[str, ...]
    bounds: tuple[tuple[str, str], ...]
    rates: tuple[tuple[str, str], ...]
    integrand: str
    whole: str
    interior: str
    surfaces: tuple[RegionSurface, ...]


def regions(db: Database, file: str, expr: nodes.Expr, wrt: str) -> tuple[Region, ...]:
    """The outermost integrals of a function, in order; `wrt` is the parameter that moves.

    What depends on what is bound outside of it, as an integral in a sum, is left out. Raises PottoError where an
    integrand has no derivative in symbols.
    """
    params, whole = written_out(db, file, expr)
    work = Differentiator(lambda g: core(db, g.module, g.name).term, folding=True)
    known = frozenset(params)
    return tuple(_region(node, tuple(params), work, wrt) for node in _outermost(whole) if node.free <= known)


def _outermost(whole: Term) -> Iterator[Integral]:
    stack, seen = [whole], set[Term]()
    while stack:
        node = stack.pop()
        if node in seen:
            continue
        seen.add(node)
        if isinstance(node, Integral):
            yield node
        else:
            stack.extend(reversed(children(node)))


def _region(node: Integral, params: tuple[str, ...], work: Differentiator, wrt: str) -> Region:
    node = plainly_named(node, params)
    names = (*params, *node.variables)

    def text(term: Term, over: tuple[str, ...] = names) -> str:
        return f"\\({', '.join(over)}) . {format_term(simplify(term))}"

    def interior() -> Term:
        return integral(node.variables, node.bounds, work.dual(node.body, {wrt: ONE})[1])

    def along(term: Term, name: str) -> str:
        return text(work.dual(term, {name: ONE})[1])

    found: list[RegionSurface] = []
    for item in jumps(node.body, node.variables, lambda term: ONE):
        if item.sums or any(isinstance(inner, App) for inner in postorder(item.surface)):
            continue
        slopes = tuple(along(item.surface, name) for name in node.variables)
        where = _COPY.sub("", equation(simplify(item.surface)))
        rate = along(item.surface, wrt)
        found.append(RegionSurface(where, text(item.surface), rate, slopes, text(item.jump)))
    return Region(
        names,
        node.variables,
        tuple((text(low), text(high)) for low, high in node.bounds),
        tuple((along(low, wrt), along(high, wrt)) for low, high in node.bounds),
        text(node.body),
        text(node, params),
        text(interior(), params),
        tuple(found),
    )
