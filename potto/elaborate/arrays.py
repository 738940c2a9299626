"""Arrays, and what goes through them: indices, sums and the like, folds, comprehensions, fields, arithmetic of vectors.

An array is gone through by the places of its elements. Several clauses are binders inside of each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from potto.core.terms import (
    ONE,
    ZERO,
    Array,
    Const,
    Index,
    Length,
    ListOf,
    Term,
    add,
    app,
    apply,
    array,
    const,
    data,
    deriv,
    div,
    fold,
    global_,
    hole,
    if_,
    index,
    length,
    list_of,
    mul,
    neg,
    postorder,
    prim,
    proj,
    sub,
    substitute,
    sum_,
    tuple_,
    var,
)
from potto.data.mistakes import DataMistake
from potto.data.values import SEPARATOR, RecordColumns, Shape
from potto.elaborate.context import Elaboration, rule
from potto.elaborate.shapes import is_vector
from potto.elaborate.values import LocalNames, Value
from potto.modules.data import DataFile, data_file
from potto.syntax import nodes
from potto.types.loading import type_of
from potto.types.types import ANY_SIZE, AnySize, ArrayOf, TupleOf, Type, holds_functions, resolve


@rule(nodes.Index)
def _index(elaboration: Elaboration, node: nodes.Index, scope: LocalNames) -> Value:
    found = elaboration.term(node.array, scope)
    for place in node.indices:
        found = elaboration.note(index(found, elaboration.term(place, scope)), node.span)
    return found


@rule(nodes.Field)
def _field(elaboration: Elaboration, node: nodes.Field, scope: LocalNames) -> Value:
    return elaboration.field(elaboration.term(node.value, scope), node.name)


def shaped(elaboration: Elaboration, shape: TupleOf, parts: Sequence[Term]) -> Term:
    """A tuple, or a record, of these parts."""
    record = shape.record
    if record is None:
        return tuple_(parts)
    elaboration.shapes.meets_records = True
    return app(global_(record.file, record.name), tuple(parts))


def standing(elaboration: Elaboration, whole: Term, type: Type) -> Term:
    """The dual of a value that stands still: with tangents that are 0; where there are functions in it, its parts with
    theirs, and the functions derived."""
    if not holds_functions(type):
        return tuple_((whole, zeros(elaboration, whole, type)))
    match resolve(type):
        case TupleOf(items):
            parts = enumerate(items)
            return tuple_([standing(elaboration, elaboration.part_of(whole, n), item) for n, item in parts])
        case ArrayOf(_, item):
            return _each(elaboration, whole, lambda element: standing(elaboration, element, item))
        case _:
            return deriv(whole)


def zeros(elaboration: Elaboration, whole: Term, type: Type) -> Term:
    """The tangent of a value that stands still: a value like it, of zeros."""
    match resolve(type):
        case TupleOf(items) as shape:
            parts = [zeros(elaboration, elaboration.part_of(whole, n), item) for n, item in enumerate(items)]
            return shaped(elaboration, shape, parts)
        case ArrayOf(_, item):
            return _each(elaboration, whole, lambda element: zeros(elaboration, element, item))
        case _:
            return ZERO


def _each(elaboration: Elaboration, whole: Term, made: Callable[[Term], Term]) -> Term:
    """An array of what is made of each element of another one."""
    if isinstance(whole, ListOf):
        return list_of(map(made, whole.items))
    place = elaboration.fresh("k")
    elaboration.numbers.add(place)
    return array(place, length(whole), made(index(whole, var(place))))


@rule(nodes.Text)
def _text(elaboration: Elaboration, node: nodes.Text, scope: LocalNames) -> Value:
    return hole("the name of a file has no value by itself")


@rule(nodes.With)
def _with(elaboration: Elaboration, node: nodes.With, scope: LocalNames) -> Value:
    whole = elaboration.term(node.record, scope)
    given = {argument.name: elaboration.term(argument.value, scope) for argument in node.arguments}
    shape = elaboration.shapes.of(whole)
    if not isinstance(shape, TupleOf) or shape.record is None or not given.keys() <= set(shape.record.fields):
        return hole("this is not a record with such fields")
    parts = [given.get(name) or elaboration.field(whole, name) for name in shape.record.fields]
    return shaped(elaboration, shape, parts)


def loaded(elaboration: Elaboration, written: str) -> Term:
    """What a file of data holds: the columns of a table are the fields of a record."""
    found = data_file(elaboration.db, elaboration.file, written)
    if isinstance(found, DataMistake):
        return hole(f"{written}: {found.message}")
    whole = _held(found, found.shape, "")
    elaboration.shapes.known[whole] = type_of(found.shape, found.path)
    return whole


def _held(file: DataFile, shape: Shape, name: str) -> Term:
    """What a file of data holds under a name."""
    if not isinstance(shape, RecordColumns):
        return data(file.path, file.digest, name)
    return tuple_([_held(file, item, f"{name}{SEPARATOR if name else ''}{own}") for own, item in shape.fields])


# What goes through ranges and arrays

Binder = Callable[[str, Term, Term, Term], Term]


def _through(
    elaboration: Elaboration,
    clauses: Sequence[nodes.Clause],
    scope: LocalNames,
    bind: Binder,
    body: Callable[[LocalNames], Term],
) -> Term:
    """The body inside of the binders of clauses: `bind` makes one of an index, its range, and what is inside."""
    if not clauses:
        return body(scope)
    clause, rest = clauses[0], clauses[1:]
    if isinstance(clause.over, nodes.Range):
        lo, hi = elaboration.term(clause.over.lo, scope), elaboration.term(clause.over.hi, scope)
        name, inner = elaboration.bind_number(clause.variable.name, scope)
        elaboration.counted.add(name)
    else:
        whole = elaboration.term(clause.over, scope)
        name = elaboration.fresh("i")
        elaboration.numbers.add(name)
        lo, hi = ZERO, sub(length(whole), ONE)
        inner = scope.bind({clause.variable.name: index(whole, var(name))})
    return bind(name, lo, hi, _through(elaboration, rest, inner, bind, body))


@rule(nodes.Reduction)
def _reduction(elaboration: Elaboration, node: nodes.Reduction, scope: LocalNames) -> Value:
    def body(inner: LocalNames) -> Term:
        return elaboration.term(node.body, inner)

    if node.op == "sum":
        return _through(elaboration, node.clauses, scope, sum_, body)
    return _through(elaboration, node.clauses, scope, _FOLDED[node.op](elaboration), body)


def _multiplied(elaboration: Elaboration) -> Binder:
    def bind(name: str, lo: Term, hi: Term, body: Term) -> Term:
        state = elaboration.fresh("p")
        return fold(name, lo, hi, state, ONE, mul(var(state), body))

    return bind


def _extreme(op: str) -> Callable[[Elaboration], Binder]:
    def binder(elaboration: Elaboration) -> Binder:
        def bind(name: str, lo: Term, hi: Term, body: Term) -> Term:
            state = elaboration.fresh("m")
            first = substitute(body, {name: lo})
            if not _reads_element(body, name, hi):
                first = _unless_empty(elaboration, lo, hi, first)
            return fold(name, add(lo, ONE), hi, state, first, apply(op, var(state), body))

        return bind

    return binder


def _reads_element(body: Term, name: str, hi: Term) -> bool:
    """Whether a body reads an array whose elements a name counts: the first one of an empty array is refused anyway."""
    return any(
        isinstance(node, Index) and node.index is var(name) and sub(length(node.array), ONE) is hi
        for node in postorder(body)
    )


def _unless_empty(elaboration: Elaboration, lo: Term, hi: Term, first: Term) -> Term:
    """What a least or a greatest begins with. Over a range that turns out to be empty that is an element that is not
    there, as over an empty array."""
    if isinstance(lo, Const) and isinstance(hi, Const):
        return first  # whether it is empty has been checked
    place = elaboration.fresh("i")
    elaboration.numbers.add(place)
    return if_(prim("lt", hi, lo), index(array(place, ZERO, var(place)), ZERO), first)


_FOLDED: dict[str, Callable[[Elaboration], Binder]] = {
    "product": _multiplied,
    "min": _extreme("min"),
    "max": _extreme("max"),
}


@rule(nodes.Comprehension)
def _comprehension(elaboration: Elaboration, node: nodes.Comprehension, scope: LocalNames) -> Value:
    def bind(name: str, lo: Term, hi: Term, body: Term) -> Term:
        if lo is not ZERO:
            body = substitute(body, {name: add(var(name), lo)})
        return array(name, add(sub(hi, lo), ONE), body)

    return _through(elaboration, node.clauses, scope, bind, lambda inner: elaboration.term(node.body, inner))


@rule(nodes.Fold)
def _fold(elaboration: Elaboration, node: nodes.Fold, scope: LocalNames) -> Value:
    start = elaboration.term(node.start, scope)
    return _stepped(elaboration, node, node.clauses, scope, start)


def _stepped(
    elaboration: Elaboration, node: nodes.Fold, clauses: Sequence[nodes.Clause], scope: LocalNames, start: Term
) -> Term:
    """The state after all steps of the clauses; those of a later clause are steps of one of an earlier."""
    if not clauses:
        return elaboration.term(node.body, _with_state(node, start, scope))
    state = elaboration.fresh(node.targets[0].name if len(node.targets) == 1 else "state")
    elaboration.shapes.names[state] = elaboration.shapes.of(start)

    def bind(name: str, lo: Term, hi: Term, body: Term) -> Term:
        return fold(name, lo, hi, state, start, body)

    return _through(
        elaboration, clauses[:1], scope, bind,
        lambda inner: _stepped(elaboration, node, clauses[1:], inner, var(state)),
    )  # fmt: skip


def _with_state(node: nodes.Fold, state: Term, scope: LocalNames) -> LocalNames:
    if len(node.targets) == 1:
        return scope.bind({node.targets[0].name: state})
    return scope.bind({target.name: proj(state, place) for place, target in enumerate(node.targets)})


# Vectors

Operation = Callable[..., Term]


def combined(elaboration: Elaboration, op: str, a: Term, b: Term) -> Term:
    """`a op b`, component by component where one of them is a vector."""
    return lifted(elaboration, _OPERATIONS[op], (a, elaboration.shapes.of(a)), (b, elaboration.shapes.of(b)))


_OPERATIONS: dict[str, Operation] = {"+": add, "-": sub, "*": mul, "/": div}


def negated(elaboration: Elaboration, term: Term) -> Term:
    return lifted(elaboration, neg, (term, elaboration.shapes.of(term)))


def lifted(elaboration: Elaboration, operation: Operation, *operands: tuple[Term, Type]) -> Term:
    """An operation on numbers done to the components of vectors; a number goes with every component."""
    operands = tuple((term, resolve(type)) for term, type in operands)
    wide = next((type for _, type in operands if is_vector(type)), None)
    if isinstance(wide, TupleOf):
        return tuple_(
            lifted(elaboration, operation, *(_item(operand, place) for operand in operands))
            for place in range(len(wide.items))
        )
    if isinstance(wide, ArrayOf):
        place = elaboration.fresh("k")
        elaboration.numbers.add(place)
        size = together(*((term, type) for term, type in operands if isinstance(type, ArrayOf)))
        parts = [_element(operand, var(place), size) for operand in operands]
        return array(place, size, lifted(elaboration, operation, *parts))
    return operation(*(term for term, _ in operands))


def _item(operand: tuple[Term, Type], place: int) -> tuple[Term, Type]:
    term, type = operand
    return (proj(term, place), resolve(type.items[place])) if isinstance(type, TupleOf) else operand


def _element(operand: tuple[Term, Type], place: Term, size: Term) -> tuple[Term, Type]:
    term, type = operand
    return (element(term, place, size), resolve(type.item)) if isinstance(type, ArrayOf) else operand


def together(first: tuple[Term, Type], *others: tuple[Term, Type], rising: bool = False) -> Term:
    """The size of arrays that go element by element; what their types don't tell of it is seen to when they are met."""
    term, type = first
    known = resolve(type.size) if isinstance(type, ArrayOf) else ANY_SIZE
    for other, its in others:
        if isinstance(known, AnySize) or not isinstance(its, ArrayOf) or known != resolve(its.size):
            return length(term, rising, other)
    return length(term, rising)


def as_long_as(elaboration: Elaboration, whole: Term, first: Term) -> Term:
    """An array that must be as long as another one, where their types don't tell whether it is."""
    shapes = elaboration.shapes.of(first), elaboration.shapes.of(whole)
    if not any(isinstance(shape, ArrayOf) and isinstance(resolve(shape.size), AnySize) for shape in shapes):
        return whole
    size = length(whole, like=first)
    if size is length(whole):
        return whole
    if isinstance(whole, Array):
        return array(whole.variable, size, whole.body)
    place = elaboration.fresh("k")
    elaboration.numbers.add(place)
    return array(place, size, index(whole, var(place)))


def element(whole: Term, place: Term, size: Term) -> Term:
    """The element at a place below `size`; of an array of just that size, which is made on the spot, what it makes."""
    own = length(size.array) if isinstance(size, Length) else size
    if isinstance(whole, Array) and whole.size in (size, own):
        return substitute(whole.body, {whole.variable: place})
    return index(whole, place)


def of_vectors(elaboration: Elaboration, name: str, args: Sequence[Term]) -> Term:
    """A builtin of vectors applied."""
    wanted = 1 if name in ("len", "norm") else 2
    if len(args) != wanted:
        return hole(f"`{name}` takes {wanted} argument{'s' if wanted > 1 else ''}")
    if name == "len":
        shape = elaboration.shapes.of(args[0])
        return const(float(len(shape.items))) if isinstance(shape, TupleOf) else length(args[0])
    if name == "norm":
        return apply("sqrt", _dot(elaboration, args[0], args[0]))
    return _dot(elaboration, *args) if name == "dot" else _cross(elaboration, *args)


def _dot(elaboration: Elaboration, u: Term, v: Term) -> Term:
    shape = elaboration.shapes.of(u)
    if isinstance(shape, TupleOf):
        return add(*(mul(proj(u, place), proj(v, place)) for place in range(len(shape.items))))
    place, size = elaboration.fresh("k"), together((u, shape), (v, elaboration.shapes.of(v)))
    elaboration.numbers.add(place)
    return sum_(place, ZERO, sub(size, ONE), mul(element(u, var(place), size), element(v, var(place), size)))


def _cross(elaboration: Elaboration, u: Term, v: Term) -> Term:
    arrays = isinstance(elaboration.shapes.of(u), ArrayOf)

    def part(whole: Term, at: int) -> Term:
        return index(whole, const(float(at))) if arrays else proj(whole, at)

    def minor(i: int, j: int) -> Term:
        return sub(mul(part(u, i), part(v, j)), mul(part(u, j), part(v, i)))

    parts = (minor(1, 2), minor(2, 0), minor(0, 1))
    return list_of(parts) if arrays else tuple_(parts)
