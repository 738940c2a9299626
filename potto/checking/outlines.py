"""Where the surfaces of a function of a pixel are seen in its image, by symbols.

Owns `outlines`. A pixel's integral goes over a small part of the plane around it, or over offsets from it: so a surface
is seen where its condition is zero in the middle of the ranges. What depends on the index of a sum or on other things
that are bound inside is left out, and so is what holds functions that are parameters.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.checking.written_out import written_out
from potto.core.printer import format_term
from potto.core.simplify import simplify
from potto.core.terms import (
    App,
    Branch,
    Delta,
    Integral,
    Term,
    add,
    const,
    mul,
    postorder,
    substitute,
)
from potto.query import Database
from potto.syntax import nodes

MOST = 40  # outlines of one picture


def outlines(db: Database, file: str, expr: nodes.Expr, axes: Sequence[str]) -> tuple[str, ...]:
    """Functions, as Potto writes them, that are zero where a surface is seen; each depends on an axis."""
    params, whole = written_out(db, file, expr)
    found: dict[str, None] = {}
    for surface in _surfaces(whole):
        free = [name for name in params if name in surface.free]
        bound = surface.free - set(params)
        called = any(isinstance(node, App) for node in postorder(surface))
        if not bound and not called and any(name in free for name in axes):
            found[f"\\({', '.join(free)}) . {format_term(simplify(surface))}"] = None
    return tuple(found)[:MOST]


def _surfaces(whole: Term) -> list[Term]:
    """The surfaces of a body, those under integrals with the variables in the middle of their ranges."""
    found = dict.fromkeys(_conditions(whole))
    for node in postorder(whole):
        if isinstance(node, Integral):
            for surface in _conditions(node.body):
                found[_in_the_middle(node, surface)] = None
    return list(found)


def _conditions(term: Term) -> list[Term]:
    return [node.surface if isinstance(node, Branch) else node.coordinates[0]
            for node in postorder(term) if isinstance(node, Branch | Delta)]  # fmt: skip


def _in_the_middle(node: Integral, surface: Term) -> Term:
    for name, (low, high) in reversed(list(zip(node.variables, node.bounds, strict=True))):
        middle = mul(const(0.5), add(low, high))
        surface = substitute(surface, {name: middle})
    return surface
