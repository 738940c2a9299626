"""What is said of a type that does not fit where it stands, in the same words wherever that is.

Owns `describe`, a type in the middle of a sentence, and the diagnostics that several rules share.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

from potto.diagnostics import Diagnostic, Related, Replacement, Suggestion, shortened
from potto.modules.texts import definition, source
from potto.reports.near import did_you_mean, instead, near_names
from potto.source import Span
from potto.syntax import nodes
from potto.syntax.printer import print_expression
from potto.types import kinds
from potto.types.format import format_type, format_types
from potto.types.scope import Local, Outside
from potto.types.types import (
    REAL,
    ArrayOf,
    Count,
    Diffeo,
    Dist,
    Function,
    Meta,
    Real,
    RecordName,
    Truth,
    TupleOf,
    Type,
    holds_functions,
    resolve,
)
from potto.types.unify import parts, unify

BY_PARTS = "give the duals of its parts: `(value, tangent)` for a number, `deriv(f)` for a function `f`"
_TABLES = (".csv", ".tsv")


def misused_derivative(node: nodes.Expr) -> Diagnostic:
    return kinds.MISMATCH(
        node.span,
        "the derivative of this function takes and gives pairs, `(value, tangent)`, but is used otherwise",
        label="its derivative does not fit",
        help="take the value or the tangent of the derivative: `fst(…)`, `snd(…)`",
    )


def describe(type: Type) -> str:
    """A type in the middle of a sentence."""
    found = resolve(type)
    match found:
        case Real() | Dist():
            return "a number"
        case Function():
            return f"a function `{format_type(found)}`"
        case TupleOf(record=record) if record is not None:
            return f"a record `{record.shown}`"
        case TupleOf(items):
            return f"a tuple of {len(items)}"
        case ArrayOf(size):
            known = resolve(size)
            return f"an array of {known.number}" if isinstance(known, Count) else "an array"
        case Truth():
            return "a comparison"
        case Diffeo():
            return "a diffeomorphism's result"
        case _:
            return f"`{format_type(found)}`"


def mismatch(
    actual: Type, expected: Type, expr: nodes.Expr, what: str, related: tuple[Related, ...] = ()
) -> Diagnostic:
    """`what` is the sentence's head: "the argument `x` of `f`". related: where it is said what is expected."""
    if isinstance(resolve(actual), Truth):
        return comparison(expr, f"{what} must be {describe(expected)}")
    shown, wanted = format_types((actual, expected))
    kind, help = kinds.MISMATCH, ""
    if differs_in_size(actual, expected):
        kind, help = kinds.SIZES, "take as many of both"
    elif isinstance(resolve(actual), Function) and isinstance(resolve(expected), Function):
        undone = needs_deriv(actual, expected)
        help = "give the derivative of the function: `deriv(…)`" if undone else ""
    elif isinstance(resolve(actual), Function):
        help = "apply the function to arguments"
    elif isinstance(resolve(actual), Real) and isinstance(resolve(expected), Diffeo):
        help = "it decides a condition there; a number is compared first: `if t > 0 then … else …`"
    elif isinstance(resolve(actual), Real) and isinstance(resolve(expected), Function):
        help = "it is applied there, as a function; if a product is meant, write it with `*`"
    elif isinstance(resolve(actual), ArrayOf) and isinstance(resolve(expected), Real):
        help = "write it for each element, `[… for x in xs]`, or take one, `xs[i]`"
    elif is_whole_dual(actual, expected):
        help = BY_PARTS
    elif isinstance(resolve(expected), ArrayOf | TupleOf):
        help = _columns(resolve(actual), resolve(expected), expr)
    message = f"{what} must be `{wanted}`, but this is `{shown}`"
    return kind(expr.span, message, label=f"this is `{shown}`", related=related, help=help)


def is_whole_dual(actual: Type, expected: Type) -> bool:
    """Whether a value and its tangent are given where functions in it want each part with its own."""
    given, wanted = resolve(actual), resolve(expected)
    if not isinstance(given, TupleOf) or len(given.items) != 2 or not holds_functions(wanted):
        return False
    halves = [resolve(item) for item in given.items]
    if isinstance(wanted, ArrayOf):
        return all(isinstance(half, ArrayOf) for half in halves)
    if not isinstance(wanted, TupleOf):
        return False
    count = len(wanted.items)
    return all(isinstance(half, TupleOf) and len(half.items) == count for half in halves)


def _columns(actual: Type, expected: Type, expr: nodes.Expr) -> str:
    """What to write where a table stands for one of its columns, or for its rows, or a record for another one; of
    columns that are not fields, and the reverse, which."""
    if not isinstance(actual, TupleOf) or actual.record is None or not isinstance(expr, nodes.Name | nodes.Member):
        return ""
    if isinstance(expected, TupleOf):
        return _field_by_field(actual.record, expected.record, print_expression(expr))
    item = resolve(expected.item) if isinstance(expected, ArrayOf) else expected
    if isinstance(item, TupleOf) and item.record is not None and _is_table(actual):
        missing = [f"`{field}`" for field in item.record.fields if field not in actual.record.fields]
        gaps = [gap for gap in actual.record.gaps if gap[0] in item.record.fields]
        if gaps:
            return " and ".join(f"its column `{field}` has no value in line {line}" for field, line in gaps)
        if not missing:
            return f"write its rows, `{rows_of(actual, expected, print_expression(expr))}`"
        others = ", ".join(f"`{field}`" for field in actual.record.fields)
        return f"it has no column {', '.join(missing)}, which `{item.record.name}` needs; its columns are {others}"
    arrays = [f"`{print_expression(expr)}.{name}`" for name in array_fields(actual)[:3]]
    return f"take one of its columns: {', '.join(arrays)}" if arrays else ""


def _field_by_field(given: RecordName, wanted: RecordName | None, name: str) -> str:
    """A record made of the fields of another one, if that has them all."""
    if wanted is None or not set(wanted.fields) <= set(given.fields):
        return ""
    return f"write `{wanted.name}({', '.join(f'{field}={name}.{field}' for field in wanted.fields)})`"


def _is_table(type: TupleOf) -> bool:
    """Whether what is loaded has columns that are equally long."""
    columns = [resolve(item) for item in type.items]
    sizes = {resolve(column.size) for column in columns if isinstance(column, ArrayOf)}
    return (
        type.record is not None
        and "." in type.record.name
        and len(sizes) == 1
        and len(array_fields(type)) == len(columns)
    )


def rows_of(table: Type, wanted: Type, name: str) -> str | None:
    """The rows of a table as an array of records; None where they are not one."""
    actual, expected = resolve(table), resolve(wanted)
    item = resolve(expected.item) if isinstance(expected, ArrayOf) else None
    if not isinstance(actual, TupleOf) or not isinstance(item, TupleOf) or not _is_table(actual):
        return None
    columns, record = actual.record, item.record
    if columns is None or record is None or not set(record.fields) <= set(columns.fields):
        return None
    first = resolve(actual.items[0])
    size = resolve(first.size) if isinstance(first, ArrayOf) else first
    last = size.number - 1 if isinstance(size, Count) else 0
    fields = ", ".join(f"{field}={name}.{field}[i]" for field in record.fields)
    return f"[{record.name}({fields}) for i in 0..{last}]"


def array_fields(type: TupleOf) -> list[str]:
    """The fields of a record that are arrays: of a table, its columns."""
    fields = () if type.record is None else type.record.fields
    return [name for name, item in zip(fields, type.items) if isinstance(resolve(item), ArrayOf)]


def differs_in_size(actual: Type, expected: Type) -> bool:
    """Whether two types would be one, were it not for the sizes of arrays."""
    apart = False
    waiting = [(actual, expected)]
    while waiting:
        a, b = map(resolve, waiting.pop())
        if isinstance(a, ArrayOf) and isinstance(b, ArrayOf):
            waiting.append((a.item, b.item))
            apart = apart or not unify(a.size, b.size)
        elif isinstance(a, TupleOf) and isinstance(b, TupleOf) and len(a.items) == len(b.items):
            if a.record != b.record:
                return False
            waiting += zip(a.items, b.items)
        elif not unify(a, b):
            return False
    return apart


def sized_by(expected: Type, others: Iterable[tuple[Type, nodes.Expr]]) -> tuple[Related, ...]:
    """Which of other arguments, by the types of their parameters, says how many elements are expected."""
    mine = _named_sizes(expected)
    for type, expr in others:
        for meta in _named_sizes(type):
            known = resolve(meta)
            if meta in mine and isinstance(known, Count):
                return (Related(expr.span, f"so `{meta.size or 'n'}` is {known.number}"),)
    return ()


def _named_sizes(type: Type) -> list[Meta]:
    """The sizes in a type that have names, as what they are found to be is known."""
    found: list[Meta] = []
    waiting = [type]
    while waiting:
        part = waiting.pop()
        if isinstance(part, Meta) and part.size is not None:
            found.append(part)
        elif isinstance(part, Meta):
            waiting += [] if part.found is None else [part.found]
        else:
            waiting += parts(part)
    return found


def needs_deriv(actual: Type, expected: Type) -> bool:
    """Whether a function was given where the derivative of one is expected."""
    given, wanted = resolve(actual), resolve(expected)
    while isinstance(given, Function) and isinstance(wanted, Function):
        if len(given.parameters) != len(wanted.parameters):
            return False
        for mine, theirs in zip(given.parameters, wanted.parameters):
            expects = resolve(theirs.type)
            if isinstance(expects, TupleOf) and expects.dual and isinstance(resolve(mine.type), Real):
                return True
        given, wanted = resolve(given.result), resolve(wanted.result)
    return isinstance(wanted, TupleOf) and wanted.dual and isinstance(given, Real)


def comparison(expr: nodes.Expr, what: str) -> Diagnostic:
    """A comparison stands where it cannot."""
    return kinds.TRUTH_ESCAPES(
        expr.span,
        f"{what}, but this is a comparison",
        label="true and false are not values",
        help="put it in brackets, `[x < t]`, for 1 where it holds and 0 elsewhere",
        suggestions=(around(expr.span, "[", "]", f"Write `[{shortened(print_expression(expr))}]`"),),
    )


def not_a_number(found: Type, expr: nodes.Expr, where: str) -> Diagnostic:
    match found:
        case TupleOf(record=record):
            parts = "`u.0`, or all of them, `(a, b) = …`" if record is None else f"`c.{record.fields[0]}`"
            return kinds.TUPLE_ARITHMETIC(
                expr.span,
                f"{where} must be a number, but this is {describe(found)}",
                label="a tuple" if record is None else "a record",
                help=f"take one of its parts, {parts}",
            )
        case Diffeo():
            return kinds.TUPLE_ARITHMETIC(
                expr.span,
                f"{where} must be a number, but this is a diffeomorphism's result",
                label="a tuple of coordinates",
                help="use it as a condition, `… ? a : b`, or take it apart, `(u, v) = …`",
            )
        case ArrayOf():
            return kinds.LIST_INSIDE(
                expr.span,
                f"{where} must be a number, but this is {describe(found)}",
                label=describe(found),
                help="take one of its elements, `xs[i]`, or add them up, `sum x in xs (x)`",
            )
        case Function():
            return kinds.ESCAPES(
                expr.span,
                f"{where} must be a number, but this is a function",
                label=f"this is `{format_type(found)}`",
                help="apply it to arguments",
            )
        case Truth():
            return comparison(expr, f"{where} must be a number")
        case _:
            return mismatch(found, REAL, expr, where)


def shadowing(local: Local, before: Local) -> Diagnostic:
    kinds_of = {"parameter": "parameter", "variable": "variable of integration", "size": "size"}
    what = kinds_of.get(before.kind, "local name")
    return kinds.SHADOWED(
        local.span,
        f"`{local.name}` hides the {what} of the same name",
        label="hides it from here on",
        related=(Related(before.span, f"the {what} `{before.name}` is bound here"),),
        help="give one of them another name",
    )


def no_field(
    outside: Outside, span: Span, name: str, record: RecordName, given: Collection[str | None] = ()
) -> Diagnostic:
    """What is said of a field that a record doesn't have. given: the names beside it, which it is not meant to be."""
    item = definition(outside.db, record.file, record.name) if "." not in record.name else None  # else it is data
    related = _header(outside, record, name)
    if item is not None:
        related = (Related(item.name_span, f"`{record.name}` is defined here", record.file, record.name),)
    near = near_names(name, [field for field in record.fields if field not in given])
    help = did_you_mean(near) or "it has " + ", ".join(f"`{name}`" for name in record.fields)
    label = f"no field `{name}`"
    message = f"a record `{record.name}` has {label}"
    if record.name.endswith(_TABLES):
        label = f"no column `{name}`"
        message = f"`{record.name}` has {label}"
    elif "." in record.name:  # another file of data
        label = f"holds no `{name}`"
        message = f"`{record.name}` {label}"
    if name in record.texts:
        label = "holds text"
        column = "the column " if record.name.endswith(_TABLES) else ""
        message = f"{column}`{name}` of `{record.name}` holds text, which programs cannot use"
        help = (
            f"only {'columns of ' if column else ''}numbers are loaded; write a number for each text, such as 0 and 1, "
        )
        help += "in another column" if column else "under another name"
    if (line := dict(record.gaps).get(name)) is not None:
        label = "lacks values"
        column = "the column " if record.name.endswith(_TABLES) else ""
        message = f"{column}`{name}` of `{record.name}` has no value in line {line}"
        help = f"leave {'rows' if column else 'entries'} that lack a value out of the file, or write a number there"
    return kinds.UNKNOWN_FIELD(span, message, label=label, related=related, help=help, suggestions=instead(span, near))


def _header(outside: Outside, record: RecordName, name: str) -> tuple[Related, ...]:
    """The place in a table where its columns are named: a name that is there, or all of them."""
    text = source(outside.db, record.file) if record.name.endswith(_TABLES) else None
    if text is None:
        return ()
    for start, line in zip(text.line_starts, text.text.splitlines(), strict=False):
        if line.strip() and not line.lstrip().startswith("#"):
            at = line.find(name) if name in record.texts or name in dict(record.gaps) else -1
            span = Span(start, start + len(line.rstrip())) if at < 0 else Span(start + at, start + at + len(name))
            said = "its columns are named here" if at < 0 else "text in every row"
            if at >= 0 and name not in record.texts:
                said = f"no value in line {dict(record.gaps)[name]}"
            return (Related(span, said, record.file, ""),)
    return ()


def around(span: Span, before: str, after: str, title: str) -> Suggestion:
    """Something written on both sides of what stands in a place."""
    edits = (Replacement(Span(span.start, span.start), before), Replacement(Span(span.end, span.end), after))
    return Suggestion(title, edits)


def between(whole: Span, inner: Span, before: str, after: str, title: str) -> Suggestion:
    """Other brackets around what stands within a place."""
    left, right = Span(whole.start, inner.start), Span(inner.end, whole.end)
    return Suggestion(title, (Replacement(left, before), Replacement(right, after)))


def of_one(node: nodes.Apply) -> str:
    """What to write where the greatest or the least of one thing is asked for: of an array that is."""
    name, of = getattr(node.function, "id", ""), node.arguments
    if name not in ("max", "min") or len(of) != 1:
        return ""
    extreme = "greatest" if name == "max" else "least"
    return f"the {extreme} element of an array is `{name} x in {getattr(of[0].value, 'id', 'xs')} (x)`"
