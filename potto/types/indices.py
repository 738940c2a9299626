"""The types of indices, and which of them are known to be out of range.

Owns `size_of`, a bound as a size and a number, and `goes_through`, which keeps what the index of a range reaches. Only
what is reached whenever a loop turns is told: branches of conditions are evaluated where they are taken.
"""

from __future__ import annotations

import math

from msgspec import Struct

from potto.diagnostics import Related, Suggestion, shortened, suggest
from potto.source import Span
from potto.syntax import nodes
from potto.syntax.as_written import number, without_parentheses
from potto.syntax.printer import print_expression
from potto.types import kinds
from potto.types.context import End, IndexReach, Inference, rule
from potto.types.mismatches import between
from potto.types.origins import defined
from potto.types.scope import Local
from potto.types.types import (
    UNKNOWN,
    AnySize,
    ArrayOf,
    Count,
    Function,
    Shifted,
    TupleOf,
    Type,
    Unknown,
    resolve,
    shifted,
)
from potto.types.vectors import expect_array


class _Reached(Struct, frozen=True):
    """Between what an index lies. `reach`: the range that it follows, if it does, and `down` whether against it."""

    low: End
    high: End
    reach: IndexReach | None = None
    down: bool = False


@rule(nodes.Index)
def _index(inference: Inference, node: nodes.Index) -> Type:
    type = inference.infer(node.array)
    for place, index in enumerate(node.indices):
        array = resolve(type)
        inference.number(index, "an index")
        what = "only an array has elements" if not place else f"this array has no {_ordinal(place)} index"
        type = expect_array(inference, array, node.array, what, _not_indexed(array, node), index=True)
        if isinstance(array, ArrayOf):
            _in_range(inference, shifted(array.size, 0), node, place)
    return type


def _ordinal(place: int) -> str:
    return ("first", "second", "third")[place] if place < 3 else f"{place + 1}th"


def _not_indexed(found: Type, node: nodes.Index) -> tuple[Suggestion, ...]:
    """What an index into something else may be meant as: a call of a function, a part of a tuple."""
    whole = Span(node.array.span.end, node.span.end)
    inner = node.indices[0].span.cover(node.indices[-1].span)
    if isinstance(found, Function):
        arguments = tuple(nodes.Argument(index.span, None, None, index) for index in node.indices)
        call = nodes.Apply(node.span, node.array, arguments, True)
        return (between(whole, inner, "(", ")", f"Write `{shortened(print_expression(call))}`"),)
    known = constant(node.indices[0])
    if isinstance(found, TupleOf) and len(node.indices) == 1 and known is not None and 0 <= known < len(found.items):
        return (suggest(whole, f".{known}"),)
    return ()


def _in_range(inference: Inference, size: Type, node: nodes.Index, place: int) -> None:
    index = node.indices[place]
    known = constant(index)
    if known is None:
        _whole(inference, index)
        _behind(inference, size, node, place)
        _beyond(inference, size, node, index)
    elif not isinstance(size, Count):
        _from_the_end(inference, known, node, place)
    elif not 0 <= known < size.number:
        _out_of_range(inference, known, size.number, node, place)


def _whole(inference: Inference, index: nodes.Expr) -> None:
    """Report an index that is written as a number that is not whole."""
    value = number(index)
    if value is None:
        return
    lower = max(math.floor(value), 0) if math.isfinite(value) else 0
    near = dict.fromkeys((lower, lower + 1)) if 0 < value < 1e9 else (0,)
    inference.report(kinds.NOT_WHOLE(
        index.span, f"an index must be a whole number, but this is {value:g}", label="not a whole number",
        help="elements are counted: `xs[0]`, `xs[1]`; to look between them, write `interp(places, xs, x)`",
        suggestions=tuple(suggest(index.span, str(number)) for number in near),
    ))  # fmt: skip


def whole_bounds(inference: Inference, over: nodes.Range) -> None:
    """Report a bound of a range that is written as a number that is not whole."""
    for bound, which in ((over.lo, "first"), (over.hi, "last")):
        value = number(bound)
        if value is not None and not value.is_integer():
            near = (math.floor(value), math.ceil(value)) if abs(value) < 1e9 else ()
            inference.report(kinds.NOT_WHOLE(
                bound.span, f"a range goes through whole numbers, but its {which} one is {value:g}",
                label="not a whole number", help="`floor` and `ceil` round to a whole number",
                suggestions=tuple(suggest(bound.span, str(number)) for number in near),
            ))  # fmt: skip


def _behind(inference: Inference, size: Type, node: nodes.Index, place: int) -> None:
    """Report an index that is the size of the array, or more, whatever that is: `xs[n]`, `xs[len(xs)]`."""
    index = node.indices[place]
    at = shifted(size_of(inference, index), 0)
    if isinstance(at, Count) and isinstance(size, Count):
        if at.number >= size.number:
            _out_of_range(inference, at.number, size.number, node, place)
        return
    written, known = _end(at), _end(size)
    if written is None or known is None or written.base is not known.base or written.offset < known.offset:
        return
    last = _moved(index, known.offset - 1 - written.offset)
    message = f"the index `{print_expression(index)}` is out of range: it is not below the number of elements"
    inference.report(kinds.OUT_OF_RANGE(
        index.span, message, label="behind the last", related=defined(inference, node.array, "is defined here"),
        help=f"indices count from 0, so the last one is `{last}`", suggestions=(suggest(index.span, last),),
    ))  # fmt: skip


def _moved(expr: nodes.Expr, by: int) -> str:
    """The text of an index or a bound, `n - 1`, that is larger by so much."""
    written = without_parentheses(expr)
    known = constant(written)
    if known is not None:
        return str(known + by)
    if isinstance(written, nodes.Chain):
        *before, last = written.rest
        offset = constant(last.value)
        if offset is not None and last.op in "+-":
            by += offset if last.op == "+" else -offset
            written = nodes.Chain(written.span, written.first, tuple(before)) if before else written.first
    return print_expression(written) + (f" {'+' if by > 0 else '-'} {abs(by)}" if by else "")


def _beyond(inference: Inference, size: Type, node: nodes.Index, index: nodes.Expr) -> None:
    """Report an index that follows a range out of the array: `xs[i + 1]` for all `i` of `xs`."""
    reached, known = _reached(inference, index), _end(size)
    if reached is None or reached.reach is None:
        return
    low, high, over = reached.low, reached.high, reached.reach.over
    if low.base is None and low.offset < 0:
        by, why = low.offset, f"it reaches {low.offset}, and no array has one below 0"
    elif known is not None and high.base is known.base and high.offset >= known.offset:
        by, why = high.offset - known.offset + 1, "it reaches the number of elements, and the last index is one less"
        if known.base is None:
            why = f"it reaches {high.offset}, and the array has {_elements(known.offset)}"
    else:
        return
    name, upper = reached.reach.name, (by > 0) is not reached.down
    bound = over.hi if upper else over.lo
    fit = _moved(bound, by if reached.down else -by)
    way = f"`{name}` goes from `{print_expression(over.lo)}` to `{print_expression(over.hi)}`"
    related = (Related(over.span, way), *defined(inference, node.array, "is defined here"))
    inference.report(kinds.OUT_OF_RANGE(
        index.span, f"the index `{print_expression(index)}` is out of range: {why}",
        label="behind the last" if by > 0 else "below 0", related=related,
        help=f"let `{name}` {'end' if upper else 'begin'} with `{fit}`", suggestions=(suggest(bound.span, fit),),
    ))  # fmt: skip


def _from_the_end(inference: Inference, known: int, node: nodes.Index, place: int) -> None:
    """Report an index below 0 into an array of any size."""
    if known >= 0:
        return
    index, array = node.indices[place], without_parentheses(node.array)
    help, suggestions = "indices count from 0", tuple[Suggestion, ...]()
    if isinstance(array, nodes.Name) and not place:
        help += f"; the last element is `{array.id}[len({array.id}) - 1]`"
        suggestions = (suggest(index.span, f"len({array.id}) - {-known}"),)
    message = f"the index {known} is out of range: no array has one below 0"
    inference.report(kinds.OUT_OF_RANGE(index.span, message, label="below 0", help=help, suggestions=suggestions))


def _elements(count: int) -> str:
    return f"{count} element{'' if count == 1 else 's'}" if count else "no elements"


def _out_of_range(inference: Inference, known: int, size: int, node: nodes.Index, place: int) -> None:
    index, last = node.indices[place], size - 1
    if last < 0:
        count, label, help = "no elements", "there are none", "an array without elements has no index"
    else:
        count = _elements(size)
        label, help = f"not in 0..{last}", f"indices count from 0, so the last one is {last}"
    if known < 0 <= last:
        help += f"; the last element is `[{last}]`"
    message = f"the index {known} is out of range: {'each row' if place else 'the array'} has {count}"
    meant = size + known if -size <= known < 0 else last
    suggestions = (suggest(index.span, str(meant)),) if last >= 0 else ()
    related = defined(inference, node.array, "is defined here" if place else f"has {count}")
    inference.report(
        kinds.OUT_OF_RANGE(index.span, message, label=label, related=related, help=help, suggestions=suggestions)
    )


def constant(expr: nodes.Expr) -> int | None:
    """The whole number that is written."""
    found = number(expr)
    return int(found) if found is not None and found.is_integer() else None


def size_of(inference: Inference, expr: nodes.Expr) -> Type:
    """A bound as a size and a number: `n - 1`, `len(xs) - 1`, `3`. Negative ones are counted too."""
    expr = without_parentheses(expr)
    known = constant(expr)
    if known is not None:
        return Count(known)
    match expr:
        case nodes.Name(id=name) if name in inference.sizes:
            meaning = inference.meanings.get(id(expr))
            return inference.sizes[name] if isinstance(meaning, Local) and meaning.kind == "size" else UNKNOWN
        case nodes.Apply(function=nodes.Name(id="len"), arguments=(nodes.Argument(value=array),)):
            found = resolve(inference.types.get(id(array), UNKNOWN))
            return found.size if isinstance(found, ArrayOf) else UNKNOWN
        case nodes.Chain(first=first, rest=(nodes.Operand(op="+" | "-" as op, value=value),)):
            size, offset = size_of(inference, first), constant(value)
            if offset is None or isinstance(resolve(size), Unknown):
                return UNKNOWN
            offset = offset if op == "+" else -offset
            return Count(size.number + offset) if isinstance(size, Count) else shifted(size, offset)
        case _:
            return UNKNOWN


# What the index of a range reaches


def goes_through(inference: Inference, local: Local, over: nodes.Range) -> None:
    """Keep what the index of a range reaches. An outer index that this range depends on may reach less in here, where
    the range is empty at its ends."""
    lo, hi = _reached(inference, over.lo), _reached(inference, over.hi)
    if lo is None or hi is None or (lo.reach and hi.reach) or not _at_most(lo.low, hi.high):
        inference.reaches = {}
        return
    outer = lo.reach or hi.reach
    kept = {key: reach for key, reach in inference.reaches.items() if reach is not outer}
    inference.reaches = {**kept, id(local): IndexReach(local.name, over, lo.low, hi.high)}


def _at_most(low: End, high: End) -> bool:
    """Whether a range has elements, as far as sizes that have a name are not 0."""
    return low.base is None is not high.base or (low.base is high.base and low.offset <= high.offset)


def _end(size: Type) -> End | None:
    match resolve(size):
        case Count(number):
            return End(None, number)
        case Shifted(base, offset):
            return End(resolve(base), offset)
        case AnySize() | Unknown():
            return None
        case other:
            return End(other, 0)


def _reached(inference: Inference, expr: nodes.Expr) -> _Reached | None:
    """Between what a sum of sizes, numbers and at most one index lies; None of what is not known."""
    expr = without_parentheses(expr)
    if not isinstance(expr, nodes.Chain):
        return _reached_by(inference, expr)
    found = _reached_by(inference, expr.first)
    for operand in expr.rest:
        more = _reached_by(inference, operand.value)
        if found is None or more is None or operand.op not in "+-" or (found.reach and more.reach):
            return None
        down = operand.op == "-"
        low, high = (
            _sum(found.low, more.high if down else more.low, down),
            _sum(found.high, more.low if down else more.high, down),
        )
        if low is None or high is None:
            return None
        found = _Reached(low, high, found.reach or more.reach, found.down or (down and more.reach is not None))
    return found


def _reached_by(inference: Inference, expr: nodes.Expr) -> _Reached | None:
    meaning = inference.meanings.get(id(without_parentheses(expr)))
    reach = inference.reaches.get(id(meaning)) if isinstance(meaning, Local) else None
    if reach is not None:
        return _Reached(reach.low, reach.high, reach)
    end = _end(size_of(inference, expr))
    return None if end is None else _Reached(end, end)


def _sum(a: End, b: End, down: bool) -> End | None:
    """The sum or the difference of two ends, where that is a size and a number again."""
    if b.base is None:
        return End(a.base, a.offset - b.offset if down else a.offset + b.offset)
    if down:
        return End(None, a.offset - b.offset) if a.base is b.base else None
    return End(b.base, a.offset + b.offset) if a.base is None else None
