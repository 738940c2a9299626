"""Arithmetic on tuples and arrays: component by component, and the builtins of vectors.

Owns `combined`, `fields` and the forms of `len dot norm cross`. What is not known yet where it meets a vector is a
number in a product, and a vector of the same shape in a sum.
"""

from __future__ import annotations

from collections.abc import Callable

from potto.diagnostics import Diagnostic, Suggestion, suggest
from potto.modules.hints import known_elsewhere
from potto.source import Span
from potto.syntax import nodes
from potto.types import kinds
from potto.types.context import Inference, NamedPart
from potto.types.format import format_type, format_types
from potto.types.lookups import image, interp
from potto.types.mismatches import array_fields, describe, no_field
from potto.types.origins import sides
from potto.types.types import (
    REAL,
    UNKNOWN,
    ArrayOf,
    Count,
    Diffeo,
    Meta,
    Real,
    TupleOf,
    Type,
    Unknown,
    place_of,
    resolve,
)
from potto.types.unify import SIZES, unify

_LEFT = {op: f"the left of `{op}`" for op in "+-*/"}
_RIGHT = {op: f"the right of `{op}`" for op in "+-*/"}


def is_vector(type: Type) -> bool:
    """Whether there is arithmetic on a value component by component; a dual is taken apart instead."""
    if isinstance(type, Real):
        return False
    found = resolve(type)
    return isinstance(found, ArrayOf) or (isinstance(found, TupleOf) and not found.dual and found.record is None)


def combined(inference: Inference, left: Type, operand: nodes.Operand, right: Type, chain: nodes.Chain) -> Type:
    """What an operator makes of two values; what stands left of it is the chain so far."""
    op, first = operand.op, chain.first
    if not is_vector(left) and not is_vector(right):
        inference.need_number(left, first, _LEFT[op])
        inference.need_number(right, operand.value, _RIGHT[op])
        return REAL
    if op in "+-":
        if isinstance(resolve(left), Unknown) or isinstance(resolve(right), Unknown):
            return UNKNOWN
        if not is_vector(left) and isinstance(resolve(left), Meta):
            unify(left, right)
        elif not is_vector(right) and isinstance(resolve(right), Meta):
            unify(right, left)
    elif not is_vector(right):
        inference.need_number(right, operand.value, _RIGHT[op])
        return left
    elif not is_vector(left) and op == "*":
        inference.need_number(left, first, _LEFT[op])
        return right
    problem = _differ(left, right)
    if problem is not None:
        inference.report(_disagree(inference, left, right, operand, chain, problem))
        return UNKNOWN
    return left if is_vector(left) else right


def _differ(a: Type, b: Type) -> tuple[Type, Type] | None:
    """The parts in which two vectors differ: their sizes, where these are all."""
    a, b = resolve(a), resolve(b)
    if isinstance(a, Unknown) or isinstance(b, Unknown):
        return None
    if isinstance(a, TupleOf) and isinstance(b, TupleOf):
        if len(a.items) != len(b.items):
            return Count(len(a.items)), Count(len(b.items))
        return next((found for x, y in zip(a.items, b.items) if (found := _differ(x, y)) is not None), None)
    if isinstance(a, ArrayOf) and isinstance(b, ArrayOf):
        return _differ(a.item, b.item) if unify(a.size, b.size) else (resolve(a.size), resolve(b.size))
    if is_vector(a) or is_vector(b):
        return a, b
    return None if unify(a, REAL) and unify(b, REAL) else (a, b)


def _left_of(chain: nodes.Chain, operand: nodes.Operand) -> nodes.Expr:
    place = next(place for place, each in enumerate(chain.rest) if each is operand)
    before = chain.rest[:place]
    return nodes.Chain(chain.first.span.cover(before[-1].value.span), chain.first, before) if before else chain.first


def _disagree(
    inference: Inference, left: Type, right: Type, operand: nodes.Operand, chain: nodes.Chain,
    problem: tuple[Type, Type],
) -> Diagnostic:  # fmt: skip
    shown, other = format_types((left, right))
    if isinstance(problem[0], SIZES) and isinstance(problem[1], SIZES):
        a, b = format_types(problem)
        return kinds.SIZES(
            operand.op_span,
            f"`{operand.op}` goes component by component, but the left has {a} and the right {b}",
            label=f"`{shown}` and `{other}`",
            related=sides(inference, (_left_of(chain, operand), left), (operand.value, right)),
            help="take as many of both",
        )
    scalar = isinstance(resolve(left), Real) != isinstance(resolve(right), Real)
    array = isinstance(resolve(right if isinstance(resolve(left), Real) else left), ArrayOf)
    sign = f" {operand.op} " if operand.op in "+-" else operand.op
    before, behind = ("1", "x") if isinstance(resolve(left), Real) else ("x", "1")
    help = f"write it for each component: `[{before}{sign}{behind} for x in xs]`" if scalar and array else ""
    rows = resolve(left)
    if isinstance(rows, ArrayOf) and is_vector(rows.item) and _differ(rows.item, right) is None:
        help = f"write it for each row: `[row{sign}v for row in rows]`"
        help += "; a matrix times a vector is `[dot(row, v) for row in rows]`" if operand.op == "*" else ""
    return kinds.TUPLE_ARITHMETIC(
        operand.op_span,
        f"`{operand.op}` has no meaning between {describe(left)} and {describe(right)}",
        label=f"`{shown}` and `{other}`",
        help=help,
    )


# Fields


def fields(inference: Inference, type: Type, node: nodes.Member) -> Type:
    """The type of `u.a.b`, where `u` is not a module."""
    head, *names = node.path.split(".")
    at = node.path_span.start + len(head) + 1
    for name in names:
        type = field(inference, type, name, node, Span(at, at + len(name)))
        at += len(name) + 1
    return field(inference, type, node.name, node, node.name_span)


def field(inference: Inference, type: Type, name: str, node: nodes.Member | nodes.Field, span: Span) -> Type:
    """The type of a part of a value; its name stands at `span`."""
    found = resolve(type)
    if isinstance(found, Unknown):
        return UNKNOWN
    if isinstance(found, Diffeo) and found.dims is not None:
        found = TupleOf((REAL,) * found.dims)
    place = place_in(found, name)
    if isinstance(found, TupleOf) and place is not None and place < len(found.items):
        inference.fields.setdefault(id(node), []).append(place)
        inference.parts.append(NamedPart(span, name, found, found.items[place]))
        return found.items[place]
    owner = node.path if isinstance(node, nodes.Member) else getattr(node.value, "id", "")
    inference.report(_no_part(inference, found, name, span, place, owner if owner.isidentifier() else "u"))
    return UNKNOWN


def place_in(type: Type, name: str) -> int | None:
    """Which item of a tuple or a record a field is."""
    record = type.record if isinstance(type, TupleOf) else None
    if record is not None:
        return record.fields.index(name) if name in record.fields else None
    return place_of(name)


def _no_part(inference: Inference, found: Type, name: str, span: Span, place: int | None, owner: str) -> Diagnostic:
    """owner: what it is written behind."""
    help, label, suggestions = "", f"of `{format_type(found)}`", tuple[Suggestion, ...]()
    if isinstance(found, TupleOf) and found.record is not None:
        return no_field(inference.outside, span, name, found.record)
    if isinstance(found, Meta):
        help, label = f"say in the head what it is: `({owner}: (Real, Real))`, or the name of a record", "of what?"
        message = f"it is not known what `.{name}` is a part of"
    elif isinstance(found, TupleOf):
        count = len(found.items)
        message = f"a tuple of {count} has no part `.{name}`"
        numbers = ", ".join(f"`.{number}`" for number in range(min(count, 4)))
        help = f"its parts are {numbers}{' and so on' if count > 4 else ''}"
    else:
        message = f"this is {describe(found)}, which has no part `.{name}`"
        if isinstance(found, ArrayOf):
            inside = place is not None and not (isinstance(size := resolve(found.size), Count) and place >= size.number)
            help = known_elsewhere(name) or f"an element is `xs[{place if inside else 0}]`"
            if inside:
                suggestions = (suggest(Span(span.start - 1, span.end), f"[{place}]"),)
    return kinds.NO_FIELD(span, message, label=label, help=help, suggestions=suggestions)


# Builtins


def vector_form(name: str) -> Callable[[Inference, nodes.Apply], Type] | None:
    """What types a call of a builtin of vectors."""
    return _FORMS.get(name)


def _types(inference: Inference, node: nodes.Apply, name: str, count: int) -> list[Type] | None:
    """The types of the arguments, where there are as many as it takes."""
    found = [inference.infer(argument.value) for argument in node.arguments]
    if len(found) == count:
        return found
    kind = kinds.TOO_MANY if len(found) > count else kinds.MISSING
    wanted = ("one vector", "two vectors", "three arguments")[count - 1]
    inference.report(kind(node.span, f"`{name}` takes {wanted}", label=f"{len(found)} given"))
    return None


def _between(name: str, form: Callable[[Inference, nodes.Apply, list[Type]], Type]) -> Callable[..., Type]:
    """A form of three arguments that looks something up."""

    def typed(inference: Inference, node: nodes.Apply) -> Type:
        found = _types(inference, node, name, 3)
        return UNKNOWN if found is None else form(inference, node, found)

    return typed


def _len(inference: Inference, node: nodes.Apply) -> Type:
    found = _types(inference, node, "len", 1)
    if found is not None:
        whole = resolve(found[0])
        if not isinstance(whole, TupleOf | Unknown):
            expect_array(inference, whole, node.arguments[0].value, "`len` counts the elements of an array")
    return REAL


def _norm(inference: Inference, node: nodes.Apply) -> Type:
    found = _types(inference, node, "norm", 1)
    if found is not None:
        _numbers(inference, found[0], node.arguments[0].value, "norm")
    return REAL


def _dot(inference: Inference, node: nodes.Apply) -> Type:
    found = _types(inference, node, "dot", 2)
    if found is not None:
        _alike(inference, found, node, "dot")
    return REAL


def _cross(inference: Inference, node: nodes.Apply) -> Type:
    found = _types(inference, node, "cross", 2) or []
    arrays = any(isinstance(resolve(type), ArrayOf) for type in found)
    result: Type = ArrayOf(Count(3), REAL) if arrays else TupleOf((REAL, REAL, REAL))
    for argument, type in zip(node.arguments, found):
        if not unify(type, result):
            inference.report(kinds.SIZES(
                argument.value.span, f"`cross` takes vectors of three numbers, but this is {describe(type)}",
                label=f"this is `{format_type(type)}`", help="both are tuples, `(a, b, c)`, or both are arrays",
            ))  # fmt: skip
            break
    return result


def _alike(inference: Inference, found: list[Type], node: nodes.Apply, name: str) -> None:
    left, right = found
    for type, other in ((left, right), (right, left)):
        if isinstance(resolve(type), Meta) and is_vector(other):
            unify(type, other)
    for argument, type in zip(node.arguments, found):
        if not _numbers(inference, type, argument.value, name):
            return
    problem = _differ(left, right)
    if problem is not None and not all(isinstance(size, SIZES) for size in problem):
        inference.report(kinds.MISMATCH(
            node.span, f"`{name}` takes two tuples or two arrays, but these are {describe(left)} and {describe(right)}",
            label="of two kinds", help="write both in parentheses, or both in brackets",
        ))  # fmt: skip
    elif problem is not None:
        a, b = format_types((left, right))
        message = f"`{name}` takes two vectors of one size, but these are `{a}` and `{b}`"
        both = sides(inference, *((item.value, type) for item, type in zip(node.arguments, found)))
        inference.report(kinds.SIZES(node.span, message, label="two sizes", related=both, help="take as many of both"))


def _numbers(inference: Inference, type: Type, expr: nodes.Expr, name: str) -> bool:
    """Whether this is a vector of numbers; what is not known yet is an array of them."""
    found = resolve(type)
    if isinstance(found, Meta):
        return unify(found, ArrayOf(inference.fresh_size("n"), REAL))
    if isinstance(found, Unknown):
        return True
    items = (found.item,) if isinstance(found, ArrayOf) else found.items if isinstance(found, TupleOf) else ()
    if items and all(unify(item, REAL) for item in items):
        return True
    inference.report(kinds.MISMATCH(
        expr.span, f"`{name}` takes a vector of numbers, but this is {describe(found)}",
        label=f"this is `{format_type(found)}`", help="a vector is a tuple or an array: `(1, 2)`, `[1, 2]`",
    ))  # fmt: skip
    return False


def expect_array(
    inference: Inference, type: Type, expr: nodes.Expr, what: str, suggestions: tuple[Suggestion, ...] = (),
    index: bool = False,
) -> Type:  # fmt: skip
    """The type of the elements of what must be an array; UNKNOWN if it is none, as is reported. index: one is asked
    for, not all that it has."""
    found = resolve(type)
    if isinstance(found, ArrayOf):
        return found.item
    if isinstance(found, Meta):
        item = inference.fresh()
        unify(found, ArrayOf(inference.fresh_size("n"), item))
        return item
    if not isinstance(found, Unknown):
        inference.report(kinds.NOT_AN_ARRAY(
            expr.span, f"{what}, but this is {describe(found)}", label=f"this is `{format_type(found)}`",
            help=_instead(found, index, expr), suggestions=suggestions,
        ))  # fmt: skip
    return UNKNOWN


def _instead(found: Type, index: bool, expr: nodes.Expr) -> str:
    from potto.types.types import Function

    if isinstance(found, Function):
        return "a function is called with parentheses: `f(i)`"
    if isinstance(found, TupleOf) and found.record is not None:
        if columns := array_fields(found):
            one = f"{expr.id if isinstance(expr, nodes.Name) else 'u'}.{columns[0]}"
            return f"it has arrays as its fields: `{one}[i]` for `i in 0..len({one}) - 1`"
        return f"its fields are {', '.join(f'`{name}`' for name in found.record.fields[:4])}"
    if isinstance(found, TupleOf):
        return "the parts of a tuple are `u.0`, `u.1`, …; an array is written `[a, b]`"
    if resolve(found) is REAL:
        return "" if index else "to count up to it, write `0..n-1`"
    return ""


_FORMS: dict[str, Callable[[Inference, nodes.Apply], Type]] = {
    "len": _len,
    "norm": _norm,
    "dot": _dot,
    "cross": _cross,
    "interp": _between("interp", interp),
    "image": _between("image", image),
}
