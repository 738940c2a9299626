"""The types of arrays and of what goes through them: indices, sums and the like, folds, comprehensions, fields."""

from __future__ import annotations

import math

from potto.diagnostics import Related, Suggestion, shortened, suggest
from potto.modules.texts import definition
from potto.source import Span
from potto.syntax import nodes
from potto.syntax.printer import print_expression
from potto.syntax.written import number, without_parentheses
from potto.types import kinds
from potto.types.context import Inference, rule
from potto.types.infer import value_only
from potto.types.integrals import summed
from potto.types.mismatches import between, describe, mismatch
from potto.types.scope import Global, Local
from potto.types.types import (
    ANY_SIZE,
    REAL,
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
from potto.types.unify import unify
from potto.types.vectors import expect_array, field


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
    known = _constant(node.indices[0])
    if isinstance(found, TupleOf) and len(node.indices) == 1 and known is not None and 0 <= known < len(found.items):
        return (suggest(whole, f".{known}"),)
    return ()


def _in_range(inference: Inference, size: Type, node: nodes.Index, place: int) -> None:
    index = node.indices[place]
    known = _constant(index)
    if known is None:
        _whole(inference, index)
        _behind(inference, size, node, index)
    elif not isinstance(size, Count):
        _from_the_end(inference, known, node, place)
    elif not 0 <= known < size.number:
        _out_of_range(inference, known, size.number, node, index)


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


def _behind(inference: Inference, size: Type, node: nodes.Index, index: nodes.Expr) -> None:
    """Report an index that is the size of the array, or more, whatever that is: `xs[n]`, `xs[len(xs)]`."""
    at = shifted(_size(inference, index), 0)
    if isinstance(at, Count) and isinstance(size, Count):
        if at.number >= size.number:
            _out_of_range(inference, at.number, size.number, node, index)
        return
    (base, offset), (same, count) = _apart(at), _apart(size)
    if base is not same or isinstance(base, AnySize | Unknown) or offset < count:
        return
    written = without_parentheses(index)
    first = written.first if isinstance(written, nodes.Chain) else written
    lower = count - _apart(_size(inference, first))[1] - 1
    last = print_expression(first) + (f" {'+' if lower > 0 else '-'} {abs(lower)}" if lower else "")
    message = f"the index `{print_expression(index)}` is out of range: it is not below the number of elements"
    inference.report(kinds.OUT_OF_RANGE(
        index.span, message, label="behind the last", related=_defined(inference, node.array, "is defined here"),
        help=f"indices count from 0, so the last one is `{last}`", suggestions=(suggest(index.span, last),),
    ))  # fmt: skip


def _apart(size: Type) -> tuple[Type, int]:
    """A size as another one and how much larger it is."""
    return (size.base, size.offset) if isinstance(size, Shifted) else (size, 0)


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


def _out_of_range(inference: Inference, known: int, size: int, node: nodes.Index, index: nodes.Expr) -> None:
    last = size - 1
    if last < 0:
        count, label, help = "no elements", "there are none", "an array without elements has no index"
    else:
        count = f"{size} element{'s' if last else ''}"
        label, help = f"not in 0..{last}", f"indices count from 0, so the last one is {last}"
    if known < 0 <= last:
        help += f"; the last element is `[{last}]`"
    message = f"the index {known} is out of range: the array has {count}"
    meant = size + known if -size <= known < 0 else last
    suggestions = (suggest(index.span, str(meant)),) if last >= 0 else ()
    related = _defined(inference, node.array, f"has {count}")
    inference.report(
        kinds.OUT_OF_RANGE(index.span, message, label=label, related=related, help=help, suggestions=suggestions)
    )


def _defined(inference: Inference, array: nodes.Expr, what: str) -> tuple[Related, ...]:
    """Where the name of an array, or of what it is a part of, gets its meaning."""
    array = without_parentheses(array)
    while isinstance(array, nodes.Field | nodes.Index):
        array = without_parentheses(array.value if isinstance(array, nodes.Field) else array.array)
        what = "is defined here"
    if isinstance(array, nodes.Member):
        meaning, what = inference.owners.get(id(array)) or inference.meanings.get(id(array)), "is defined here"
    else:
        meaning = inference.meanings.get(id(array))
    if isinstance(meaning, Local):
        return (Related(meaning.span, f"`{meaning.name}` {what}"),)
    if not isinstance(meaning, Global):
        return ()
    file, name = meaning.target.file, meaning.target.name
    item = definition(inference.outside.db, file, name)
    if not isinstance(item, nodes.Definition):
        return ()
    return (Related(item.name_span, f"`{name}` {what}", file, name),)


def _constant(expr: nodes.Expr) -> int | None:
    """The whole number that is written."""
    found = number(expr)
    return int(found) if found is not None and found.is_integer() else None


@rule(nodes.Field)
def _field(inference: Inference, node: nodes.Field) -> Type:
    return field(inference, inference.infer(node.value), node.name, node, node.name_span)


@rule(nodes.Text)
def _text(inference: Inference, node: nodes.Text) -> Type:
    inference.report(kinds.MISMATCH(node.span, "the name of a file stands in `load(…)` alone"))
    return UNKNOWN


# What goes through arrays and ranges


def _clauses(inference: Inference, clauses: tuple[nodes.Clause, ...], what: str) -> list[Type]:
    """The variables of clauses in scope, each seeing those before; how often each goes round."""
    sizes: list[Type] = []
    for clause in clauses:
        over, variable = clause.over, clause.variable
        if isinstance(over, nodes.Range):
            inference.number(over.lo, f"the first value of {what}")
            inference.number(over.hi, f"the last value of {what}")
            sizes.append(_count(inference, over))
            inference.local(variable, variable.name, variable.span, "index", REAL)
            continue
        found = inference.infer(over)
        item = expect_array(inference, found, over, f"{what} goes through an array or a range `lo..hi`")
        array = resolve(found)
        sizes.append(array.size if isinstance(array, ArrayOf) else UNKNOWN)
        inference.local(variable, variable.name, variable.span, "loop", item)
    return sizes


def _count(inference: Inference, over: nodes.Range) -> Type:
    """How many numbers a range has, as far as that is written."""
    lo, hi = _size(inference, over.lo), _size(inference, over.hi)
    return shifted(hi, 1 - lo.number) if isinstance(lo, Count) and not isinstance(hi, Unknown) else ANY_SIZE


def _size(inference: Inference, expr: nodes.Expr) -> Type:
    """A bound as a size and a number: `n - 1`, `len(xs) - 1`, `3`. Negative ones are counted too."""
    expr = without_parentheses(expr)
    constant = _constant(expr)
    if constant is not None:
        return Count(constant)
    match expr:
        case nodes.Name(id=name) if name in inference.sizes:
            meaning = inference.meanings.get(id(expr))
            return inference.sizes[name] if isinstance(meaning, Local) and meaning.kind == "size" else UNKNOWN
        case nodes.Apply(function=nodes.Name(id="len"), arguments=(nodes.Argument(value=array),)):
            found = resolve(inference.types.get(id(array), UNKNOWN))
            return found.size if isinstance(found, ArrayOf) else UNKNOWN
        case nodes.Chain(first=first, rest=(nodes.Operand(op="+" | "-" as op, value=value),)):
            size, offset = _size(inference, first), _constant(value)
            if offset is None or isinstance(resolve(size), Unknown):
                return UNKNOWN
            offset = offset if op == "+" else -offset
            return Count(size.number + offset) if isinstance(size, Count) else shifted(size, offset)
        case _:
            return UNKNOWN


@rule(nodes.Reduction)
def _reduction(inference: Inference, node: nodes.Reduction) -> Type:
    what = {"sum": "a sum", "product": "a product"}.get(node.op, f"`{node.op}`")
    with inference.scope.inside():
        sizes = _clauses(inference, node.clauses, what)
        if node.op in ("min", "max"):
            _not_empty(inference, node, sizes)
        if node.op != "sum":
            inference.number(node.body, f"what `{node.op}` is taken of")
            return REAL
        body = inference.infer(node.body)
    return summed(inference, body, node.body, "what is summed")


def _not_empty(inference: Inference, node: nodes.Reduction, sizes: list[Type]) -> None:
    """Report a least or greatest of what is known to have no elements."""
    which = {"min": "least", "max": "greatest"}[node.op]
    for clause, size in zip(node.clauses, sizes):
        count = resolve(size)
        if isinstance(count, Count) and count.number <= 0:
            what = "range" if isinstance(clause.over, nodes.Range) else "array"
            inference.report(kinds.EMPTY(
                clause.over.span, f"`{node.op}` goes through an empty {what}, which has no {which} element",
                label="empty", help=f"give a value that also counts: `{node.op}(a, b)` of two numbers",
            ))  # fmt: skip


@rule(nodes.Fold)
def _fold(inference: Inference, node: nodes.Fold) -> Type:
    state = inference.infer(node.start)
    value_only(inference, state, node.start, "the state of a fold is made of numbers")
    with inference.scope.inside():
        _clauses(inference, node.clauses, "a fold")
        fits = _bind_state(inference, node, state)
        body = inference.infer(node.body)
    if not fits:
        return UNKNOWN
    if not unify(body, state):
        inference.report(mismatch(
            body, state, node.body, "each step of a fold gives a state like the first one: this",
            (Related(node.start.span, "the state at first"),),
        ))  # fmt: skip
    return state


def _bind_state(inference: Inference, node: nodes.Fold, state: Type) -> bool:
    """The names of the state in scope; False if there are not as many parts."""
    targets = node.targets
    if len(targets) == 1:
        inference.local(targets[0], targets[0].name, targets[0].span, "loop", state)
        return True
    parts: tuple[Type, ...] = tuple(inference.fresh() for _ in targets)
    fits = unify(state, TupleOf(parts))
    if not fits:
        message = f"{len(parts)} names are bound here, but the state is {describe(state)}"
        inference.report(kinds.MISMATCH(node.start.span, message, label=describe(state)))
        parts = (UNKNOWN,) * len(targets)
    for target, part in zip(targets, parts):
        inference.local(target, target.name, target.span, "loop", part)
    return fits


@rule(nodes.Comprehension)
def _comprehension(inference: Inference, node: nodes.Comprehension) -> Type:
    with inference.scope.inside():
        sizes = _clauses(inference, node.clauses, "an array")
        found = inference.infer(node.body)
    if not isinstance(resolve(found), Function):
        value_only(inference, found, node.body, "an array holds numbers, tuples or functions")
    for size in reversed(sizes):
        found = ArrayOf(size, found)
    return found
