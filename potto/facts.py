"""What is known of a function by symbols alone: its surfaces, and its derivative as interior and boundary.

Owns `surfaces` and `derivative_facts`, the answers of `potto deriv` and of `Function.surfaces`. The formulas are
those of the calculus; here they are put together and printed. No numbers are computed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from potto.calculus.boundary import NoClosedForm, at_bounds, jumps
from potto.calculus.branch_cuts import opened
from potto.calculus.conditions import conditions_of
from potto.calculus.diffeo import exported
from potto.calculus.dual import dual
from potto.calculus.expand import expanded
from potto.calculus.guards import unguarded
from potto.core.printer import format_term
from potto.core.simplify import simplify
from potto.core.terms import (
    ZERO,
    App,
    Branch,
    Delta,
    Deriv,
    Global,
    Integral,
    Lam,
    Term,
    Var,
    deriv,
    integral,
    postorder,
    var,
)
from potto.diagnostics import PottoError
from potto.elaborate import core, elaborate_expression
from potto.modules import is_recursive
from potto.query import Database
from potto.syntax import nodes
from potto.types import derivative_type, format_type, interface

_COPY = re.compile(r"'\d+")  # the mark of a copy of a bound variable: `x'1` is another x


@dataclass(frozen=True, slots=True)
class PartFacts:
    """One integral of a definition, or its body around them, and the parts of its derivative; as Potto writes it.

    interior: the integral of the integrand's derivative. boundary: per surface its jump times its speed, at the
    surface. bounds: what bounds that move bring in. reason: why a part has no symbolic form (which is
    empty then), or nothing.
    """

    value: str
    interior: str
    boundary: tuple[str, ...]
    bounds: tuple[str, ...]
    reason: str = ""


@dataclass(frozen=True, slots=True)
class DerivativeFacts:
    """What `potto deriv` says of a definition."""

    name: str
    type: str
    derivative_type: str
    surfaces: tuple[str, ...]
    integrals: tuple[PartFacts, ...]
    body: PartFacts | None
    where: tuple[str, ...] = ()  # what the parameters of measures must be

    @property
    def text(self) -> str:
        lines = [f"{self.name} : {self.type}", f"deriv({self.name}) : {self.derivative_type}"]
        for number, item in enumerate(self.integrals):
            lines += ["", f"integral {number + 1} of {len(self.integrals)}" if len(self.integrals) > 1 else "integral"]
            lines += _lines(item)
        if self.body is not None:
            lines += ["", "body" if self.integrals else "function", *_lines(self.body)]
        lines += ["", *_part("surfaces", self.surfaces or ("none",)), *_part("where", self.where)]
        return "\n".join(lines)


def _lines(item: PartFacts) -> list[str]:
    note = (item.reason,) if item.reason else ()
    boundary = item.boundary or (() if item.reason else ("0",))
    return [
        *_part("value", (item.value,)),
        *_part("interior", (item.interior,) if item.interior else ()),
        *_part("boundary", boundary),
        *_part("bounds", item.bounds),
        *_part("note", note),
    ]


def _part(word: str, texts: tuple[str, ...]) -> list[str]:
    return [f"  {word if not number else '':<9} {text}" for number, text in enumerate(texts)]


def surfaces(db: Database, file: str, expr: nodes.Expr) -> tuple[str, ...]:
    """Where the value or the integrand of an expression jumps: `x + y + c = 0`, each once."""
    return tuple(_surfaces(db, elaborate_expression(db, file, expr).term))


def _surfaces(db: Database, term: Term) -> dict[str, None]:
    while isinstance(term, Deriv | Global):  # another name for it, or its derivative, has the same ones
        term = term.function if isinstance(term, Deriv) else core(db, term.module, term.name).term
    found = conditions_of(term, lambda g: exported(db, g.module, g.name), lambda g: core(db, g.module, g.name).term)
    own = [node.surface if isinstance(node, Branch) else node.coordinates[0]
           for node in postorder(opened(term)) if isinstance(node, Branch | Delta)]  # fmt: skip
    known = [condition.surface for condition in found]
    readable = [surface for surface in own if not any(isinstance(node, App) for node in postorder(surface))]
    texts = (format_term(simplify(surface)) for surface in (*known, *readable))
    return dict.fromkeys(f"{_COPY.sub('', text)} = 0" for text in texts)


def derivative_facts(db: Database, file: str, name: str) -> DerivativeFacts | None:
    """The derivative of a definition in symbols; None for one that is no function."""
    term = core(db, file, name).term
    while isinstance(term, Deriv | Global):
        term = term.function if isinstance(term, Deriv) else core(db, term.module, term.name).term
    if not isinstance(term, Lam):
        return None
    body, parameters = term.body, [*term.params]
    while isinstance(body, Lam):
        parameters += body.params
        body = body.body
    if not is_recursive(db, file, name):
        body = expanded(body, lambda g: _unless_recursive(db, g))
    body, conditions = unguarded(body)
    tangents = _tangents(parameters, body)
    found = tuple(_integral_facts(node, tangents) for node in _outermost(body))
    type = interface(db, file, name).type
    return DerivativeFacts(
        name,
        format_type(type),
        format_type(derivative_type(type)),
        tuple(_surfaces(db, core(db, file, name).term)),
        found,
        None if isinstance(body, Integral) else _body_facts(body, tangents),
        conditions,
    )


def _unless_recursive(db: Database, target: Global) -> Term | None:
    return None if is_recursive(db, target.module, target.name) else core(db, target.module, target.name).term


def _tangents(parameters: list[str], body: Term) -> Mapping[str, Term]:
    """For each parameter the name of its tangent; a function's is its derivative."""
    heads = {node.function.name for node in postorder(body) if isinstance(node, App) and isinstance(node.function, Var)}
    return {p: deriv(var(p)) if p in heads else var(f"d{p}") for p in parameters}


def _outermost(body: Term) -> Iterator[Integral]:
    """The integrals that stand in no other one."""
    inside = {inner for node in postorder(body) if isinstance(node, Integral) for inner in postorder(node.body)}
    return (node for node in postorder(body) if isinstance(node, Integral) and node not in inside)


def _integral_facts(node: Integral, tangents: Mapping[str, Term]) -> PartFacts:
    def over(body: Term) -> str:
        return format_term(simplify(integral(node.variables, node.bounds, simplify(body), node.hints)))

    def rate(term: Term) -> Term:
        return dual(term, tangents)[1]

    interior, reason = "", ""
    boundary: tuple[str, ...] = ()
    bounds: tuple[str, ...] = ()
    try:
        slope = rate(node.body)
        interior = "0" if slope is ZERO else over(slope)
        boundary = tuple(
            over(jump.contribution)
            for jump in jumps(opened(node.body), node.variables, rate)
            if jump.rate is not ZERO
        )
        bounds = tuple(format_term(simplify(term)) for term in at_bounds(node, rate))
    except (PottoError, NoClosedForm) as error:
        reason = f"no symbolic form: {_why(error)}"
    return PartFacts(format_term(node), interior, boundary, bounds, reason)


def _body_facts(body: Term, tangents: Mapping[str, Term]) -> PartFacts:
    """A body that is no integral by itself. Where a parameter crosses a surface, the derivative has a delta of it."""
    interior, reason = "", ""
    boundary: tuple[str, ...] = ()
    try:
        interior = format_term(simplify(dual(body, tangents)[1]))
        boundary = tuple(
            format_term(simplify(jump.contribution))
            for jump in jumps(opened(body), body.free, lambda term: dual(term, tangents)[1])
            if jump.rate is not ZERO
        )
    except (PottoError, NoClosedForm) as error:
        reason = f"no symbolic form: {_why(error)}"
    return PartFacts(format_term(body), interior, boundary, (), reason)


def _why(error: PottoError | NoClosedForm) -> str:
    return error.diagnostics[0].message if isinstance(error, PottoError) else str(error)
