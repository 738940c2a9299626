"""What is known of a function by symbols alone: its surfaces, and its derivative as interior and boundary.

Owns `surfaces` and `derivative_facts`, the answers of `potto deriv` and of `Function.surfaces`. The derivative is that
of `calculus.explain`, of a definition with its calls carried out, each part written as a formula of its own; the
editor and the prompt lay the same out in a definition's own words. No numbers are computed.
"""

from __future__ import annotations

import re

from msgspec import Struct

from potto.calculus.checking.conditions import conditions_of
from potto.calculus.checking.diffeo import exported
from potto.calculus.decomposition.guards import unguarded
from potto.calculus.explanation.bound_names import as_written
from potto.calculus.explanation.decimals import in_decimals
from potto.calculus.explanation.explain import describe, explain_derivative
from potto.calculus.explanation.fields import fields_of
from potto.calculus.explanation.layout import WIDTH, DerivativeText, IntegralText, Show, meets
from potto.calculus.explanation.notation import Notation, numbers_of
from potto.calculus.inlining.expand import expanded
from potto.calculus.surfaces.branch_cuts import opened
from potto.core.simplify import normalized_surface, simplify
from potto.core.terms import App, Branch, Const, Delta, Deriv, Global, Integral, Lam, Term, global_, postorder
from potto.elaborate import core, elaborate_expression
from potto.modules import is_recursive
from potto.query import Database
from potto.syntax import nodes
from potto.syntax.typesetting import broken, unicode
from potto.types import derivative_type, format_type, interface

LONG = 800  # characters that a person still reads
_COPY = re.compile(r"'\d+")  # the mark of a copy of a bound variable: `x'1` is another x


class PartFacts(Struct, frozen=True):
    """One integral of a definition, or its body around them, and the parts of its derivative; as Potto writes it.

    interior: the integral of the integrand's derivative. boundary: per surface its jump times its speed, at the
    surface. bounds: what bounds that move bring in. reason: why a part has no symbolic form (which is
    empty then), or nothing. continuous: surfaces that move and on which nothing jumps. each: the indices of what the
    integral stands in.
    """

    value: str
    interior: str
    boundary: tuple[str, ...]
    bounds: tuple[str, ...]
    reason: str = ""
    continuous: tuple[str, ...] = ()
    each: str = ""


class DerivativeFacts(Struct, frozen=True):
    """What `potto deriv` says of a definition."""

    name: str
    type: str
    derivative_type: str
    surfaces: tuple[str, ...]
    integrals: tuple[PartFacts, ...]
    body: PartFacts | None
    derivative: str = ""  # the whole of it, deltas integrated out
    where: tuple[str, ...] = ()  # what the parameters of measures must be
    tangents: tuple[str, ...] = ()  # the names of tangents in these formulas
    divisors: tuple[str, ...] = ()  # what must not be 0 for the whole to have a value

    @property
    def text(self) -> str:
        """As Potto writes it."""
        return self._laid_out(lambda formula: formula)

    @property
    def typeset(self) -> str:
        """The same formulas with the signs of mathematics, over several lines where they are long."""
        return self._laid_out(lambda formula: unicode(formula, self.tangents))

    def _laid_out(self, show: Show) -> str:
        lines = [f"{self.name} : {self.type}", f"deriv({self.name}) : {self.derivative_type}"]
        for number, item in enumerate(self.integrals):
            lines += ["", f"integral {number + 1} of {len(self.integrals)}" if len(self.integrals) > 1 else "integral"]
            lines += _lines(item, show)
        if self.body is not None:
            lines += ["", "body" if self.integrals else "function", *_lines(self.body, show)]
        said = [part.interior for part in (*self.integrals, self.body) if part is not None and not part.boundary]
        if self.derivative and said != [self.derivative]:
            long = f"left out, {len(self.derivative):,} characters long: --json has it"
            lines += ["", *_part("whole", (show(self.derivative) if len(self.derivative) <= LONG else long,))]
        lines += _part("for", tuple([show(f"{divisor} != 0") for divisor in self.divisors]))
        surfaces = tuple(map(show_equation(show), self.surfaces)) or ("none",)
        lines += ["", *_part("surfaces", surfaces), *_part("where", tuple(map(show, self.where)))]
        return "\n".join(lines)


def _lines(item: PartFacts, show: Show) -> list[str]:
    note = (item.reason,) if item.reason else ()
    meeting = tuple(meets(show(where)) for where in item.continuous)
    boundary = (*map(show, item.boundary), *meeting) or (() if item.reason else ("0",))
    return [
        *_part("value", (show(item.value),)),
        *_part("for each", (show(item.each),) if item.each else ()),
        *_part("interior", (show(item.interior),) if item.interior else ()),
        *_part("boundary", boundary if item.interior or item.boundary or item.continuous else ()),
        *_part("bounds", tuple(map(show, item.bounds))),
        *_part("note", note),
    ]


def show_equation(show: Show) -> Show:
    """An equation, side by side."""
    return lambda equation: " = ".join(map(show, equation.split(" = ")))


def _part(word: str, texts: tuple[str, ...]) -> list[str]:
    lines: list[str] = []
    for number, text in enumerate(texts):
        first, *more = broken("", text, WIDTH)
        lines.append(f"  {word if not number else '':<9} {first}")
        lines += [f"{' ' * 14}{line.strip()}" for line in more]
    return lines


def surfaces(db: Database, file: str, expr: nodes.Expr) -> tuple[str, ...]:
    """Where the value or the integrand of an expression jumps: `x + y + c = 0`, each once."""
    term = elaborate_expression(db, file, expr).term
    return tuple(_surfaces(db, term, Notation(numbers=numbers_of(db, term, expr))))


def _surfaces(db: Database, term: Term, notation: Notation) -> dict[str, None]:
    while isinstance(term, Deriv | Global):  # another name for it, or its derivative, has the same ones
        term = term.function if isinstance(term, Deriv) else core(db, term.module, term.name).term
    found = conditions_of(term, lambda g: exported(db, g.module, g.name), lambda g: core(db, g.module, g.name).term)
    own = [node.surface if isinstance(node, Branch) else node.coordinates[0]
           for node in postorder(opened(term)) if isinstance(node, Branch | Delta)]  # fmt: skip
    known = [condition.surface for condition in found]
    readable = [surface for surface in own if not any(isinstance(node, App) for node in postorder(surface))]
    each: dict[Term, Term] = {}
    for surface in map(simplify, (*known, *readable)):
        each.setdefault(normalized_surface(surface)[0], surface)
    crossed = (surface for surface in each.values() if not isinstance(surface, Const))
    over = {name for node in postorder(term) if isinstance(node, Integral) for name in node.variables}
    over.update(name for condition in found for name in condition.variables)
    return dict.fromkeys(_COPY.sub("", notation.equation(notation.fields(surface), over)) for surface in crossed)


def derivative_facts(db: Database, file: str, name: str) -> DerivativeFacts | None:
    """The derivative of a definition in symbols; None for one that is not a function."""
    whole = core(db, file, name).term
    term, type = whole, interface(db, file, name).type
    while isinstance(term, Deriv | Global):
        if isinstance(term, Global):
            type = interface(db, term.module, term.name).type
            term = core(db, term.module, term.name).term
        else:
            term = term.function
    if not isinstance(term, Lam):
        return None
    if not is_recursive(db, file, name):
        term = expanded(term, lambda g: _unless_recursive(db, g))
    notation = Notation(fields_of(db, type), numbers_of(db, global_(file, name)))
    type = interface(db, file, name).type
    derived = format_type(derivative_type(type))
    if term is whole:
        found = explain_derivative(db, file, name)
    else:
        found = describe(term, name, derived, lambda g: core(db, g.module, g.name).term, notation)
    return DerivativeFacts(
        name,
        format_type(type),
        derived,
        tuple(_surfaces(db, whole, notation)) or _of_calls(found),
        tuple(map(_integral_facts, found.integrals)),
        None if found.alone else _body_facts(term, found, notation),
        found.tangent,
        found.conditions,
        tuple(sorted(found.tangents)),
        found.divisors,
    )


def _of_calls(found: DerivativeText) -> tuple[str, ...]:
    """The surfaces that a function has through the functions that it calls."""
    there = (*found.surfaces, *(surface for item in found.integrals for surface in item.surfaces))
    return tuple(dict.fromkeys(surface.equation for surface in there))


def _unless_recursive(db: Database, target: Global) -> Term | None:
    return None if is_recursive(db, target.module, target.name) else core(db, target.module, target.name).term


def _integral_facts(found: IntegralText) -> PartFacts:
    reason = f"the boundary is found numerically: {found.reason}" if found.reason else ""
    deltas = tuple(map(found.over, found.deltas))
    return PartFacts(found.over(found.integrand), found.over(found.interior) if found.interior else "", deltas,
                     found.bounds, reason, found.continuous, found.each)  # fmt: skip


def _body_facts(term: Term, found: DerivativeText, notation: Notation) -> PartFacts:
    """A body that is not an integral by itself; what it is around its integrals is seen in the whole derivative."""
    while isinstance(term, Lam):
        term = term.body
    interior = "" if found.integrals else found.smooth
    value = notation.text(simplify(in_decimals(notation.fields(as_written(unguarded(term)[0])))))
    return PartFacts(value, interior, found.deltas, (), "; ".join(found.problems), found.continuous)
