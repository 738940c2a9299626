"""The code behind a pixel of a picture: the conditions of the function that is drawn, as functions of its parameters.

Owns `PixelCondition` and `pixel_conditions`. A pixel's integral covers a small part of the plane, so its conditions are
evaluated in the middle of their ranges, as in `checking/outlines`.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from potto.calculus.checking.conditions import Condition
from potto.calculus.explanation.notation import written_notation
from potto.calculus.inlining.currying import parameters_of
from potto.core.printer import format_term
from potto.core.simplify import simplify
from potto.core.terms import App, Branch, Delta, Integral, Term, add, const, mul, postorder, substitute
from potto.elaborate import core
from potto.ide.hover.derivatives import (
    Functions,
    condition_places,
    conditions,
    is_sound,
    shown_equation,
)
from potto.query import Database, query
from potto.source import Span


class PixelCondition(Struct, frozen=True):
    """A condition of a definition that is drawn.

    file, name, span: where it is written, in the definition itself or in one that it calls, relative to the chunk of
    that. text: a Potto function of `parameters` that is positive on one side of its surface and negative on the other.
    """

    equation: str
    file: str
    name: str
    span: Span
    parameters: tuple[str, ...]
    text: str


@query
def pixel_conditions(db: Database, file: str, name: str, given: Functions = ()) -> tuple[PixelCondition, ...]:
    """The conditions of a definition, and of functions that it is given, that depend on its parameters only, in the
    order of the text; those that are under no integral last."""
    if not is_sound(db, file, name):
        return ()
    elaborated = core(db, file, name)
    notation = written_notation(db, file, name)
    spans, params, middles = dict(elaborated.origins), parameters_of(elaborated.term), _middles(elaborated.term)
    shown = frozenset(condition_places(db, file, name, given))
    under = conditions(db, file, name, given)
    known = {condition.written for condition in under}
    beside = [c for c in conditions(db, file, name, given, params) if c.written not in known]
    found: dict[PixelCondition, None] = {}
    for condition in (*under, *beside):
        span, equation = spans.get(condition.anchor), shown_equation(condition.surface, condition.variables, notation)
        surface = _in_the_middle(condition.surface, middles)
        if span is None or surface.free - set(params):
            continue
        if condition.written in known and (span, equation) not in shown:
            continue
        if any(isinstance(n, App) for n in postorder(surface)):
            continue
        free = tuple(p for p in params if p in surface.free)
        text = f"\\({', '.join(free)}) . {format_term(simplify(surface))}"
        found[PixelCondition(equation, *_place(db, file, name, condition, span), free, text)] = None
    return tuple(found)


def _place(db: Database, file: str, name: str, condition: Condition, call: Span) -> tuple[str, str, Span]:
    """The file, the definition and the span where a condition is written. If none of the definitions on the way
    contains it, the call that leads to it."""
    for module, called in ((g.module, g.name) for g in reversed(condition.path)):
        for term, span in core(db, module, called).origins:
            if isinstance(term, Branch | Delta) and term.coordinates == condition.written:
                return module, called, span
    return file, name, call


def _middles(term: Term) -> dict[str, Term]:
    """The middle of the range of each variable of integration."""
    return {
        name: mul(const(0.5), add(low, high))
        for node in postorder(term)
        if isinstance(node, Integral)
        for name, (low, high) in zip(node.variables, node.bounds, strict=True)
    }


def _in_the_middle(surface: Term, middles: Mapping[str, Term]) -> Term:
    """A surface with each variable in the middle of its range. Inner ranges come first, since they may depend on outer
    variables."""
    for _ in middles:
        inside = {name: middles[name] for name in surface.free & middles.keys()}
        if not inside:
            break
        surface = substitute(surface, inside)
    return surface
