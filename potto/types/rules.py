"""The plain-condition rule in words: what varies inside an integral and must not.

Owns the messages P0301 to P0305 and those about deltas. A message shows the place in the definition at hand, where the
variable is bound, and the way between: local names, arguments, and for a demand of another definition its places there,
which are looked up only now (`Reasons`).
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from potto.diagnostics import Diagnostic, Kind, Related
from potto.modules.lookup import DefinitionTarget
from potto.primitives import PRIMITIVES
from potto.source import Span
from potto.syntax import nodes
from potto.syntax.printer import print_expression
from potto.types import kinds
from potto.types.algebra import steps
from potto.types.context import Inference
from potto.types.reasons import GivenVariable, Reason
from potto.types.values import Sink, SinkKind, Source, Trail

MAX_STEPS = 6  # steps of a way that a message shows
MAX_DEPTH = 8  # definitions that it follows

KINDS: dict[SinkKind, Kind] = {
    "condition": kinds.VARYING_CONDITION,
    "jump": kinds.VARYING_JUMP,
    "sum": kinds.VARYING_SUM,
    "count": kinds.VARYING_SUM,
    "index": kinds.VARYING_CONDITION,
    "equality": kinds.EQUALITY,
    "declared": kinds.DECLARED_PLAIN,
}


class Violation(Struct, frozen=True):
    """A sink reached by variables of integration, the ways there, and where to show it for want of a better place."""

    sink: Sink
    variables: Mapping[Source, Trail]
    fallback: Span


def violation(inference: Inference, found: Violation) -> Diagnostic:
    """The message about a broken rule."""
    return _Wording(inference, found).diagnostic()


class _Wording:
    def __init__(self, inference: Inference, found: Violation) -> None:
        self.outside = inference.outside
        self.sink = found.sink
        self.variables = sorted(found.variables, key=lambda source: source.span)
        self.ways = {source: steps(found.variables[source]) for source in self.variables}
        self.span = self._primary(found.fallback)

    def diagnostic(self) -> Diagnostic:
        reason = self._reason()
        message = self._foreign(reason) if self._elsewhere() else self._here()
        label = "varies inside the integral"
        return KINDS[self.sink.kind](
            self.span, message, label=label, related=tuple(self._related(reason)), help=self._help(reason)
        )

    def _elsewhere(self) -> bool:
        return self.sink.origin is not None or self.sink.kind == "declared"

    def _primary(self, fallback: Span) -> Span:
        """The place here: the sink's own, or the argument that carries the variable to a place elsewhere."""
        if not self._elsewhere() and self.sink.span.end > 0:
            return self.sink.span
        for way in self.ways.values():
            for step in reversed(way):
                if step.argument:
                    return step.span
        return fallback

    def _reason(self) -> Reason | None:
        if not isinstance(self.sink.origin, DefinitionTarget):
            return None
        return self.outside.reasons(self.sink.origin).reason(self.sink.kind, self.sink.number)

    def _names(self) -> str:
        names = list(dict.fromkeys(self._variable(source) for source in self.variables))
        if len(names) == 1:
            return f"the variable of integration {names[0]}"
        return f"the variables of integration {', '.join(names[:-1])} and {names[-1]}"

    def _variable(self, source: Source) -> str:
        if not isinstance(source.origin, DefinitionTarget):
            return f"`{source.name}`"
        given, owner = self._origin(source)
        return f"`{given.variable}` of `{owner.name}`" if given is not None else f"of `{owner.name}`"

    def _origin(self, source: Source) -> tuple[GivenVariable | None, DefinitionTarget]:
        """Where another definition's variable of integration is bound."""
        target, number = source.origin, source.number
        assert isinstance(target, DefinitionTarget)
        given = self.outside.reasons(target).given_at(number)
        for _ in range(MAX_DEPTH):
            if given is None or given.further is None:
                break
            target, number = given.further
            given = self.outside.reasons(target).given_at(number)
        return given, target

    def _here(self) -> str:
        match self.sink.kind:
            case "jump":
                return f"`{self.sink.node}` jumps, so its argument may not depend on {self._names()}"
            case "sum":
                return f"this bound of a sum depends on {self._names()}"
            case "count":
                return f"how far this measure counts depends on {self._names()}"
            case "index":
                return f"this index depends on {self._names()}"
            case "equality":
                return f"`{self.sink.node}` over {self._names()} holds on a set of measure zero"
            case _:
                return f"this condition depends on {self._names()}"

    def _foreign(self, reason: Reason | None) -> str:
        owner = self.sink.origin
        name = f"`{owner.name}`" if isinstance(owner, DefinitionTarget) else "this function"
        parameter = reason.parameter if reason else "its parameter"
        does = {
            "jump": f"applies a builtin that jumps to {parameter}",
            "sum": f"bounds a sum by {parameter}",
            "count": f"bounds the count of a measure by {parameter}",
            "index": f"indexes by {parameter}",
            "equality": f"tests the equality of {parameter}",
            "declared": f"declares {parameter} to be `Real`",
        }.get(self.sink.kind, f"decides a plain condition by {parameter}")
        return f"{name} {does}, which depends on {self._names()} here"

    def _related(self, reason: Reason | None) -> list[Related]:
        found = [self._bound(source) for source in self.variables]
        shown: list[Related] = []
        for way in self.ways.values():
            shown += [Related(step.span, step.message) for step in way if step.span != self.span]
        if len(shown) > MAX_STEPS:
            shown = [*shown[: MAX_STEPS // 2], *shown[-MAX_STEPS // 2 :]]
        found += shown
        if self.sink.origin is None and self.sink.kind == "declared":
            found.append(Related(self.sink.span, "declared `Real` here"))
        if reason is not None and isinstance(self.sink.origin, DefinitionTarget):
            found += self._elsewhere_related(self.sink.origin, reason)
        return list(dict.fromkeys(found))

    def _bound(self, source: Source) -> Related:
        if not isinstance(source.origin, DefinitionTarget):
            return Related(source.span, f"`{source.name}` is bound here")
        given, owner = self._origin(source)
        if given is None:
            return Related(self.span, f"an integral of `{owner.name}` varies it")
        return Related(given.span, f"`{given.variable}` is bound here", owner.file, owner.name)

    def _elsewhere_related(self, target: DefinitionTarget, reason: Reason) -> list[Related]:
        found: list[Related] = []
        current: Reason | None = reason
        for _ in range(MAX_DEPTH):
            if current is None:
                break
            file, owner = target.file, target.name
            found += [Related(s.span, s.message, file, owner) for s in current.steps if s.span != current.span]
            found.append(Related(current.span, current.text, file, owner))
            if current.further is None:
                break
            target, number = current.further
            current = self.outside.reasons(target).reason(current.kind, number)
        return found

    def _help(self, reason: Reason | None) -> str:
        where = f"in `{self.sink.origin.name}` " if isinstance(self.sink.origin, DefinitionTarget) else ""
        match self.sink.kind:
            case "jump":
                shown = PRIMITIVES[self.sink.node].brackets if self.sink.node in PRIMITIVES else "`[x >= 1]`"
                return f"{where}write its jumps as brackets, so that their boundary terms are counted: {shown}"
            case "sum":
                return f"{where}sum to a fixed bound and put a bracket into the terms, `[i <= x]`"
            case "count":
                return f"{where}write a sum to a fixed bound, of weighted terms: `sum k in 0..50 (weight(k, x)*…)`"
            case "index":
                return f"{where}sum over all elements, each with a bracket that says where it counts: `[i <= x] * …`"
            case "equality":
                return f"{where}write `[x < t]` for a jump, or `delta(x - t)` for the surface itself"
            case "declared":
                return f"{where}declare the parameter `Real*`, or leave the annotation out"
            case _:
                shown = f"`[{condition_text(self.sink.node)}]`" if not where else "in brackets, `[…]`"
                bracket = f"{where}state the jump as a diffeomorphic condition, {shown}"
                return f"{bracket}, so that its boundary term is counted"


def condition_text(node: object) -> str:
    """A condition as it is to stand in brackets."""
    if isinstance(node, nodes.Compare | nodes.Name | nodes.Logic):
        text = print_expression(node)
        return text if len(text) <= 60 else "…"
    return "…"


REASON_TEXT: dict[SinkKind, str] = {
    "condition": "this plain condition decides by it",
    "jump": "this is given to a builtin that jumps",
    "sum": "this is a bound of a sum",
    "count": "this decides how far a measure counts",
    "index": "this is an index",
    "equality": "this is an equality",
    "declared": "declared `Real` here",
}


# Deltas


def product_of_deltas(expr: nodes.Expr) -> Diagnostic:
    return kinds.DELTA_PRODUCT(
        expr.span,
        "the product of two deltas on the same surface has no meaning",
        label="the same delta again",
        help="a delta may be a factor only once",
    )


def nonlinear(expr: nodes.Expr, what: str) -> Diagnostic:
    return kinds.DELTA_PRODUCT(
        expr.span,
        f"a delta is not a number: you cannot {what}",
        label="a distribution",
        help="a delta may only be added, and multiplied with a number",
    )


def lone_delta(node: nodes.Apply) -> Diagnostic:
    return kinds.LONE_DELTA(
        node.span,
        "this delta varies with no variable of integration and no parameter",
        label="outside of an integral",
        help="a delta has a meaning under an integral over what its argument varies with",
    )


def shown_delta(expr: nodes.Expr) -> Diagnostic:
    return kinds.LONE_DELTA(
        expr.span,
        "this is a distribution, not a number",
        label="outside of an integral",
        help="integrate it over the variables of its deltas",
    )
