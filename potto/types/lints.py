"""What is not wrong but probably not meant: names that are not used, conditions that never change, still surfaces."""

from __future__ import annotations

from collections.abc import Iterator

from potto.diagnostics import Diagnostic
from potto.modules.builtins import is_builtin
from potto.source import Span
from potto.syntax import nodes
from potto.syntax.nodes import Node
from potto.syntax.walk import walk as every
from potto.types import kinds
from potto.types.context import Inference
from potto.types.flow import Walk


def lints(inference: Inference, walk: Walk, item: Node) -> Iterator[Diagnostic]:
    """The warnings about one definition, statement or expression."""
    if any(diagnostic.severity == "error" for diagnostic in (*inference.diagnostics, *walk.diagnostics)):
        return  # what is wrong may be why a name is not used
    yield from _unused(inference)
    yield from _constant_conditions(inference)
    if isinstance(item, nodes.Definition) and (item.groups or isinstance(item.body, nodes.Lambda)):
        yield from _still_surfaces(inference, walk, item)


def _unused(inference: Inference) -> Iterator[Diagnostic]:
    for local in inference.locals:
        if local.used or not local.name or local.name.startswith("_"):
            continue
        if local.kind == "local":
            yield kinds.UNUSED_LOCAL(
                local.span,
                f"`{local.name}` is not used",
                label="never used",
                help="leave it out, or begin its name with `_`",
                tags=("unnecessary",),
            )
        elif local.kind == "variable":
            yield kinds.UNUSED_VARIABLE(
                local.span,
                f"the variable of integration `{local.name}` is not used",
                label="the integrand does not vary with it",
                help="begin its name with `_` if that is meant",
                tags=("unnecessary",),
            )


def _constant_conditions(inference: Inference) -> Iterator[Diagnostic]:
    for node in inference.comparisons:
        if _literal(node.first) and all(_literal(operand.value) for operand in node.rest):
            yield kinds.CONSTANT_CONDITION(
                node.span,
                "this condition never changes: it compares numbers",
                label="always true or always false",
                help="leave the condition out",
            )


def _literal(expr: nodes.Expr) -> bool:
    while isinstance(expr, nodes.Paren | nodes.Unary):
        expr = expr.inner if isinstance(expr, nodes.Paren) else expr.operand
    return isinstance(expr, nodes.Number)


def _still_surfaces(inference: Inference, walk: Walk, item: Node) -> Iterator[Diagnostic]:
    """Surfaces that a definition without parameters places: it looks as if it could move them, and cannot. Those of
    numbers alone, `[x < 0.5]`, are meant to stand still. What is wrong or comes from elsewhere is left alone."""
    seen = set()
    for surface in walk.surfaces:
        kinds_of = {source.kind for source in surface.sources}
        if kinds_of != {"variable"} or surface.span in seen:
            continue
        if any(source.origin is not None for source in surface.sources):
            continue
        seen.add(surface.span)
        name = _constant_in(inference, item, surface.span)
        if name:
            yield kinds.STILL_SURFACE(
                surface.span,
                f"no parameter moves this surface: `{name}` is a constant",
                label="has no boundary term",
                notes=("it depends on variables of integration only, so it contributes nothing to a derivative",),
                help=f"make `{name}` a parameter, if derivatives are to be taken by it",
            )


def _constant_in(inference: Inference, item: Node, place: Span) -> str:
    """The first name in a place that means a value of the file or of an import; nothing if there is none."""
    local = {found.name for found in inference.locals}
    called: set[Span] = set()
    for node in every(item):
        match node:
            case nodes.Apply():
                called.add(node.function.span)
            case nodes.Name():
                inside = place.start <= node.span.start and node.span.end <= place.end
                if inside and node.span not in called and node.id not in local and not is_builtin(node.id):
                    return node.id
            case _:
                pass
    return ""
