"""Reductions of integrals and their bounds. See `build` for the conventions."""

from __future__ import annotations

from potto.diagnostics import Related
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.groups import Context, Parenthesized, Values, as_binders, plain
from potto.syntax.nodes import Apply, Binder, Expr, Integral, Interval, MeasureBound, Name


def interval(_: Context, v: Values) -> Interval:
    return Interval(Span(v[0].start, v[4].end), v[1], v[3])


def measure(context: Context, v: Values) -> MeasureBound:
    group: Parenthesized = v[3]
    values = tuple(plain(context, written) for written in group.written)
    span = Span(v[0].start, group.span.end)
    shape, arguments, inner = _opened(v[2].text, values)
    return MeasureBound(span, v[0].text, v[0].span, v[2].text, v[2].span, arguments, shape, inner)


def _opened(name: str, values: tuple[Expr, ...]) -> tuple[str, tuple[Expr, ...], tuple[tuple[str, Span], ...]]:
    """The shape of a measure, its arguments and those of the measures inside, and their names."""
    shapes: list[str] = []
    arguments: list[Expr] = []
    inner: list[tuple[str, Span]] = []
    for place, value in enumerate(values):
        within = (name == "truncated" and place == 0) or (name == "mixture" and place % 2 == 1)
        if within and isinstance(value, Apply) and isinstance(value.function, Name):
            inner.append((value.function.id, value.function.span))
            shape, more, deeper = _opened(value.function.id, tuple(a.value for a in value.arguments))
            inner.extend(deeper)
        else:
            shape, more = "_", (value,)
        shapes.append(shape)
        arguments.extend(more)
    return f"{name}({', '.join(shapes)})", tuple(arguments), tuple(inner)


def integral(context: Context, v: Values) -> Integral:
    _word, bounds, body, d, group = v
    span = Span(v[0].start, group.span.end)
    if group.virtual:
        end = Span(group.span.end, group.span.end)
        named = [b.variable if isinstance(b, MeasureBound) else "" for b in bounds]
        return Integral(span, tuple(bounds), body, tuple(Binder(end, id) for id in named))
    variables = as_binders(context, group, "variable of integration")
    _match_bounds(context, bounds, variables, Span(d.start, group.span.end))
    return Integral(span, tuple(bounds), body, variables)


def integral_unbounded(context: Context, v: Values) -> Integral:
    """An integral whose bounds are missing, as the lexer has said."""
    variables = as_binders(context, v[4], "variable of integration")
    return Integral(Span(v[0].start, v[4].span.end), (), v[2], variables)


def _match_bounds(context: Context, bounds: Values, variables: tuple[Binder, ...], place: Span) -> None:
    if len(bounds) != len(variables):
        over = Span(bounds[0].span.start, bounds[-1].span.end)
        several = "; those of several stand in parentheses: `([0, 1], [0, 1])`" if len(bounds) == 1 else ""
        context.report(
            kinds.BOUNDS(
                place,
                f"{_count(len(variables), 'variable')} of integration, but bounds for {len(bounds)}",
                related=(Related(over, f"bounds for {len(bounds)}"),),
                help=f"give one `[lo, hi]` (or `x ~ …`) for each variable, in the order of `d(...)`{several}",
            )
        )
        return
    for bound, variable in zip(bounds, variables):
        if isinstance(bound, MeasureBound) and bound.variable != variable.name and variable.name:
            context.report(
                kinds.BOUNDS(
                    variable.span,
                    f"this variable is `{variable.name}`, but its bound is for `{bound.variable}`",
                    related=(Related(bound.variable_span, f"the bound for `{bound.variable}`"),),
                    help="write the variables of `d(...)` in the order of the bounds",
                )
            )


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
