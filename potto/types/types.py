"""Types: what a value is and, for numbers, what they vary with.

Owns the closed union `Type`. Inference works on the same classes, with `Meta` for what is not known yet; no `Meta`
leaves it. What flows from which parameter to where is not in the type but in `values`; the types carry what is printed:
`star` (accepts what varies), the variables of integration of a number inside an integral, and where a result jumps.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeGuard, assert_never

from msgspec import Struct


class Real(Struct, frozen=True):
    """A number. `star`: a parameter that accepts what varies. `variables`: the variables of integration it varies with.

    `jumps` are the variables and parameters across whose surfaces it jumps: its derivative is a `Dist` over them.
    It is not printed.
    """

    star: bool = False
    variables: tuple[str, ...] = ()
    jumps: tuple[str, ...] = ()


class Dist(Struct, frozen=True):
    """A distribution over variables (or parameters): only an integral over them turns it into a number."""

    variables: tuple[str, ...] = ()


class RecordName(Struct, frozen=True):
    """Which record a tuple is: its definition, and the names of the fields. texts: the columns of a file of data that
    are not among them, as they hold no numbers; gaps: those that are not, as they lack values, with the first line
    without one. dual: it is the dual of one that holds functions, whose fields are the
    duals of its."""

    file: str
    name: str
    fields: tuple[str, ...]
    texts: tuple[str, ...] = ()
    gaps: tuple[tuple[str, int], ...] = ()
    dual: bool = False

    @property
    def shown(self) -> str:
        """The name of the type."""
        return f"D {self.name}" if self.dual else self.name


class TupleOf(Struct, frozen=True):
    """A tuple. `dual`: a value and its tangent, for which a plain number may be given. `record`: its fields have names,
    and it is told from other tuples by its own."""

    items: tuple[Type, ...]
    dual: bool = False
    record: RecordName | None = None


class ArrayOf(Struct, frozen=True):
    """An array of items of one type. `size` is a Count, a SizeVar, Shifted, AnySize or a Meta."""

    size: Type
    item: Type


class Count(Struct, frozen=True):
    """A size that is known."""

    number: int


class SizeVar(Struct, frozen=True):
    """A size of a finished type: any number, the same wherever the name stands."""

    name: str


class Shifted(Struct, frozen=True):
    """A size that differs from another one, which is not known, by a number."""

    base: Type
    offset: int


class AnySize(Struct, frozen=True):
    """A size that is known at run time only. It fits every other."""


class Parameter(Struct, frozen=True):
    """A parameter of a function type; the name is None where it is not known (a function that is a parameter)."""

    name: str | None
    type: Type


class Function(Struct, frozen=True):
    """A function of one group of parameters. A group of n also accepts one tuple of n, and back."""

    parameters: tuple[Parameter, ...]
    result: Type


class Diffeo(Struct, frozen=True):
    """What a diffeomorphism gives: a tuple of `dims` numbers that may stand as a condition. None: any number."""

    dims: int | None


class Truth(Struct, frozen=True):
    """What a comparison gives. Local names may hold one; parameters and results may not."""


class TypeVariable(Struct, frozen=True):
    """A type variable of a finished type: any type, the same wherever the name stands."""

    name: str


class Unknown(Struct, frozen=True):
    """The type of what is wrong. It fits everything, so that one mistake gives one message."""


@dataclass(eq=False, repr=False, slots=True)
class Meta:
    """A type that inference does not know yet. `level`: the depth of the binding that it belongs to.

    size: of a size, the name that it would like to have.
    """

    level: int
    found: Type | None = None
    size: str | None = None


Size = Count | SizeVar | Shifted | AnySize
Type = Real | Dist | TupleOf | ArrayOf | Size | Function | Diffeo | Truth | TypeVariable | Unknown | Meta

REAL = Real()
TRUTH = Truth()
UNKNOWN = Unknown()
ANY_SIZE = AnySize()


def resolve(type: Type) -> Type:
    """Follow what is known about a `Meta`, shortening the way."""
    if not isinstance(type, Meta) or type.found is None:
        return type
    root: Type = type
    while isinstance(root, Meta) and root.found is not None:
        root = root.found
    while isinstance(type, Meta) and type.found is not None:
        type.found, type = root, type.found
    return root


def shifted(size: Type, offset: int) -> Type:
    """A size so much larger. By 0: the same in the form that others are compared with, whatever was found since."""
    size = resolve(size)
    match size:
        case Count(number):
            return Count(max(0, number + offset))
        case Shifted(base, before):
            return shifted(base, before + offset)
        case AnySize() | Unknown():
            return size
        case _:
            return Shifted(size, offset) if offset else size


def dual_of_array(size: Type, dual: Type) -> Type:
    """The dual of an array of items with this dual: the array of values, then the array of tangents."""
    if _is_transposed(dual):
        return TupleOf(tuple(ArrayOf(size, part) for part in dual.items), dual=True)
    return ArrayOf(size, dual)


def _is_transposed(dual: Type) -> TypeGuard[TupleOf]:
    """Whether a dual is a value and its tangent; one with functions in it has its parts side by side."""
    return isinstance(dual, TupleOf) and len(dual.items) == 2 and not holds_functions(dual)


def function(groups: Iterable[tuple[Parameter, ...]], result: Type) -> Type:
    """The type of a function of several groups."""
    for group in reversed(tuple(groups)):
        result = Function(group, result)
    return result


def groups_of(type: Type) -> tuple[tuple[Parameter, ...], ...]:
    """The groups of parameters of a function type, one per call."""
    groups = []
    type = resolve(type)
    while isinstance(type, Function):
        groups.append(type.parameters)
        type = resolve(type.result)
    return tuple(groups)


def result_of(type: Type) -> Type:
    """What a function gives when it has all its groups; any other type itself."""
    type = resolve(type)
    while isinstance(type, Function):
        type = resolve(type.result)
    return type


AXES = "xyzw"


def place_of(name: str) -> int | None:
    """Which item of a tuple a field is: `0`, `1`, … or `x`, `y`, `z`, `w`."""
    if name.isdigit():
        return int(name[:9])
    return AXES.index(name) if len(name) == 1 and name in AXES else None


def holds_functions(type: Type) -> bool:
    """Whether it is a function, or a tuple or array in which there is one."""
    if isinstance(type, Real):
        return False
    match resolve(type):
        case Function() | Diffeo():
            return True
        case TupleOf(items):
            return any(holds_functions(item) for item in items)
        case ArrayOf(_, item):
            return holds_functions(item)
        case _:
            return False


def dual_name(name: str) -> str:
    """The name that `deriv` gives to a parameter."""
    return "d" + name


def without_d(parameters: Sequence[Parameter]) -> dict[str, int]:
    """The parameters of a derivative by the names of those that they are the duals of: `deriv(f)(x=(2, 1))`."""
    found: dict[str, int] = {}
    for place, parameter in enumerate(parameters):
        type = resolve(parameter.type)
        if parameter.name is not None and parameter.name[:1] == "d" and isinstance(type, TupleOf) and _of_two(type):
            found[parameter.name[1:]] = place
    return found


def _of_two(type: TupleOf) -> bool:
    """Whether a type is that of a dual: of a number, or of a tuple, which is two tuples of one length."""
    parts = [resolve(item) for item in type.items]
    sizes = {len(part.items) for part in parts if isinstance(part, TupleOf)}
    return type.dual or (len(parts) == 2 and len(sizes) == 1 and all(isinstance(part, TupleOf) for part in parts))


def derivative_type(type: Type) -> Type:
    """D of a type: `D Real = (Real, Real)`, or `(Real, Dist)` where it jumps, `D (A -> B) = D A -> D B`."""
    return _derivative(resolve(type), frozenset())


def with_items(type: TupleOf, items: tuple[Type, ...]) -> TupleOf:
    """The same tuple, or record, of other items."""
    return TupleOf(items, type.dual, type.record)


def dual_of_tuple(duals: tuple[Type, ...], dual: bool = False, record: RecordName | None = None) -> Type:
    """The dual of a tuple of numbers (and tuples of them): the tuple of values, then the tuple of tangents.

    What is not a tuple of numbers (a function in it, something wrong) keeps its duals side by side.
    """
    pairs = [d.items for d in duals if _is_transposed(d)]
    if len(pairs) != len(duals):
        return TupleOf(duals, dual, record and RecordName(record.file, record.name, record.fields, dual=True))
    values, tangents = (TupleOf(tuple(p[place] for p in pairs), record=record) for place in (0, 1))
    return TupleOf((values, tangents), dual or record is not None)


def _derivative(type: Type, parameters: frozenset[str]) -> Type:
    """`parameters`: names of the enclosing groups, which get a `d`; variables of integration keep theirs."""

    def renamed(names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(dual_name(name) if name in parameters else name for name in names)

    type = resolve(type)
    match type:
        case Real(star, variables, jumps):
            primal = Real(star, variables, renamed(jumps))
            return TupleOf((primal, Dist(renamed(jumps)) if jumps else Real(star, variables)), dual=True)
        case Dist(variables):
            return TupleOf((Dist(renamed(variables)), Dist(renamed(variables))), dual=True)
        case TupleOf(items, dual):
            return dual_of_tuple(tuple(_derivative(item, parameters) for item in items), dual, type.record)
        case ArrayOf(size, item):
            return dual_of_array(size, _derivative(item, parameters))
        case Function(group, result):
            inner = parameters | {p.name for p in group if p.name is not None}
            duals = tuple(
                Parameter(None if p.name is None else dual_name(p.name), _derivative(p.type, frozenset()))
                for p in group
            )
            return Function(duals, _derivative(result, inner))
        case Diffeo(dims):
            return UNKNOWN if dims is None else dual_of_tuple((TupleOf((REAL, REAL), dual=True),) * dims)
        case TypeVariable():  # a number, for want of better knowledge
            return TupleOf((Real(star=True), Real(star=True)), dual=True)
        case Truth() | Unknown() | Meta() | Count() | SizeVar() | Shifted() | AnySize():
            return UNKNOWN
        case _:
            assert_never(type)
