"""Functions of Potto for Python: called with numbers, arrays and each other.

Owns `Function` and `deriv`. A function is an expression with the file whose names it uses; a call is that expression
applied, elaborated once per form of call and then run on values. What parameters the arguments of a call are for is
found in `labels`.
"""

from __future__ import annotations

import builtins
from collections.abc import Mapping
from inspect import Signature
from types import MappingProxyType
from typing import Any

from msgspec.structs import replace

from potto.diagnostics import PottoError
from potto.evaluating.world import World
from potto.kernels.cells import Rows, Value
from potto.kernels.errors import wrong_call
from potto.python.accepting import accepted, with_tangents
from potto.python.arguments import (
    NUMBERS,
    Batch,
    Kinds,
    batch_of,
    is_dual,
    kinds_of,
    misfit,
    moving,
    numbers_of,
    value_of,
)  # fmt: skip
from potto.python.arrays import has_arrays, must_not_be_masked, with_arrays
from potto.python.calls import Call, Form
from potto.python.described import Doc, annotations_of, signature_of, typeset_derivative
from potto.python.labels import Given, labelled
from potto.python.tiles import in_tiles
from potto.python.travel import Travelling
from potto.runtime.answers.estimate import Estimate
from potto.runtime.evaluation.functions import Closure
from potto.source import NOWHERE
from potto.syntax import nodes, print_expression
from potto.types import derivative_type, format_type, infer_expression
from potto.types.kinds import NO_TANGENT
from potto.types.motionless import GENERAL, LONGEST, MOTIONLESS
from potto.types.queries import is_derivative
from potto.types.types import Function as FunctionType
from potto.types.types import Parameter, TupleOf, Type, groups_of, result_of

NOTHING: Mapping[str, Any] = MappingProxyType({})


def deriv(function: Function) -> Function:
    """The derivative: a function of duals `(value, tangent)`, which gives a dual."""
    must_be_function(function)
    if function._derivative is None:  # the same one each time: it knows what its calls have told
        world, file, type = function._world, function._file, derivative_type(function._type)
        if function._given:  # of what is left, so it is derived as a whole
            expr, _ = world.typed(file, rf"\(f : {function.type}) . deriv(f)")
            function._derivative = Function(world, file, expr, type, (((function,), {}),))
        else:
            function._derivative = Function(world, file, _call_of("deriv", function._expr), type)
    return function._derivative


def must_be_function(function: object) -> None:
    """Raise PottoError for anything else."""
    if not isinstance(function, Function):
        raise wrong_call(f"a function of Potto is needed here, not a Python {type(function).__name__}")


class Function(Travelling):
    """A function of Potto, to be called with numbers, tuples, numpy arrays (which broadcast) and other functions.

    A call that gives all arguments of all groups is evaluated; one that gives the first groups only is a function of
    the others. `__doc__` is the comment above its definition, `__signature__` and `__annotations__` have its types.
    """

    __doc__ = Doc(__doc__)

    def __init__(self, world: World, file: str, expr: nodes.Expr, type: Type, given: Given = ()) -> None:
        self._world = world
        self._file = file
        self._expr = expr
        self._type = type
        self._given = given
        self._calls: dict[Form, Call] = {}
        self._fitting: dict[Kinds, int] = {}  # arguments of which kinds are known to fit, since which texts
        self._known: tuple[int, Value] | None = None
        self._derives: tuple[int, bool] | None = None
        self._groups: tuple[int, tuple[tuple[Parameter, ...], ...]] | None = None
        self._derivative: Function | None = None

    def bare(self) -> Function:
        """Itself without what it was given, as it travels."""
        return type(self)(self._world, self._file, self._expr, self._whole)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        args, kwargs = self.by_place(args, kwargs)
        known = None if kwargs else self.at_once(args)
        if known is not None:
            return known
        kinds = () if kwargs or self._given else kinds_of(args)
        if kinds and self._fitting.get(kinds) == self._world.db.revision:
            call, values = self._call(((args, kwargs),)), numbers_of(args)
            found = call.run(values, NUMBERS)
            call.keep(args, values, found)
            return found
        given = (*self._given, (args, kwargs))
        rest = groups_of(self._type)[1:]
        if rest and (args or kwargs) and len(args) + len(kwargs) <= len(groups_of(self._type)[0]):
            assert isinstance(self._type, FunctionType)
            return Function(self._world, self._file, self._expr, self._type.result, given)
        return self._run(given)

    def by_place(self, args: tuple[Any, ...], kwargs: dict[str, Any]) -> tuple[tuple[Any, ...], dict[str, Any]]:
        """The arguments in the order of the parameters, where they are all of these, each under its name."""
        groups, count = self._parameter_groups if kwargs and not self._given else (), len(args)
        if len(groups) != 1 or count + len(kwargs) != len(group := groups[0]):
            return args, kwargs
        try:
            return (*args, *[kwargs[parameter.name] for parameter in group[count:]]), {}  # type: ignore[index]
        except KeyError:
            return args, kwargs

    def at_once(self, args: tuple[Any, ...], wrt: tuple[str, ...] = ()) -> Estimate | None:
        """The estimate of a call with plain numbers near those of before, with its derivatives by the parameters
        named; None where it takes more than the rule of one integral."""
        call = None if self._given else self._calls.get(((len(args), ()),))
        return None if call is None else call.at_once(args, wrt)

    def _run(self, given: Given) -> Estimate:
        asked, given = given, self._taken(given)
        arguments, batch = self._arguments(given)
        if self._is_derivative():
            self._must_move(given)
        kinds = () if len(given) != 1 or given[0][1] else kinds_of(asked[0][0])
        if kinds and given == asked:
            self._fitting[kinds] = self._world.db.revision
        found = in_tiles(self, given, (), arguments, batch)
        if batch.size == 1 and len(asked) == 1 and not asked[0][1]:
            self._call(given).keep(asked[0][0], [value for _, value in arguments], found)
        return found

    def in_tiles(self, args: tuple[Any, ...], kwargs: dict[str, Any], wrt: tuple[str, ...]) -> Estimate:
        """The estimate of a call with its derivatives by the parameters named; a large batch in tiles."""
        given = self._taken((*self._given, (args, kwargs)))
        return in_tiles(self, given, wrt, *self._arguments(given))

    def prepared(
        self, args: tuple[Any, ...], kwargs: dict[str, Any], extra: Mapping[str, Any]
    ) -> tuple[Call, builtins.list[tuple[str, Value]], Batch]:
        """A call that is to be run: its arguments as values, and the batch that they make with `extra`."""
        given = self._taken((*self._given, (args, kwargs)))
        return self._call(given), *self._arguments(given, extra)

    def _taken(self, given: Given) -> Given:
        """What is given, as numbers, arrays and tuples; with arrays of Python as arrays of Potto where parameters are
        such. Raises PottoError."""
        groups = self._parameter_groups
        arrays = any(has_arrays(parameter.type) for group in groups for parameter in group)
        sizes: dict[str, tuple[str, int]] = {}

        def taken(label: str, argument: Any, type: Type | None) -> Any:
            must_not_be_masked(label, argument)
            argument = accepted(argument, type)
            if isinstance(argument, tuple | Mapping | list) and self._is_derivative():
                argument = with_tangents(argument, type, _derived)
            return with_arrays(label, argument, type, sizes) if arrays and type is not None else argument

        found = iter([taken(*each) for each in labelled(given, groups)])
        return tuple((tuple(next(found) for _ in args), {name: next(found) for name in words}) for args, words in given)

    def in_form(self, label: str, argument: Any, parameter: str | None) -> Any:
        """Something that goes with a parameter, or with the answer, with arrays where that has them."""
        type = result_of(self._whole) if parameter is None else self.type_of(parameter)
        return with_arrays(label, accepted(argument, type), type, {})

    def type_of(self, parameter: str) -> Type:
        """The type of a parameter that there is."""
        return next(p.type for group in self._parameter_groups for p in group if p.name == parameter)

    def _is_derivative(self) -> bool:
        """Whether this is the derivative of a function, whose arguments are all that moves."""
        revision = self._world.db.revision
        if self._derives is None or self._derives[0] != revision:
            self._derives = revision, is_derivative(self._world.db, self._file, self._expr)
        return self._derives[1]

    def _must_move(self, given: Given) -> None:
        """Raise PottoError if no argument has a tangent: whatever is evaluated, the derivative would be 0."""
        groups = self._parameter_groups
        if any(_carries(argument, type) for _, argument, type in labelled(given, groups)):
            return
        first = groups[0][0].type
        single = isinstance(first, TupleOf) and not isinstance(first.items[0], TupleOf)  # else tangents of tangents
        text = moving(print_expression(self._expr), given) if single else ""
        help = f"write `{text}`" if text and len(text) <= LONGEST else GENERAL
        raise PottoError([replace(NO_TANGENT(NOWHERE, MOTIONLESS, help=help), severity="error")])

    def _call(self, given: Given) -> Call:
        form = tuple((len(args), tuple(words)) for args, words in given)
        if form not in self._calls:
            self._calls[form] = Call(self._world, self._file, self._expr, form)
        return self._calls[form]

    def _arguments(
        self, given: Given, extra: Mapping[str, Any] = NOTHING
    ) -> tuple[builtins.list[tuple[str, Value]], Batch]:
        """The arguments as values, under the names of their parameters. Raises PottoError for what does not fit."""
        found = labelled(given, self._parameter_groups)
        for label, argument, type in found:
            complaint = None if type is None else misfit(label, argument, type, _type_of(argument))
            if complaint is not None:
                raise wrong_call(complaint)
        batch = batch_of([*((label, argument) for label, argument, _ in found), *extra.items()])
        return [(label, value_of(label, argument, batch, _function_value)) for label, argument, _ in found], batch

    def _value(self) -> Value:
        """The function as a value. Raises PottoError."""
        revision = self._world.db.revision
        if self._known is not None and self._known[0] == revision:
            return self._known[1]
        arguments, _ = self._arguments(self._given)
        value = self._call(self._given).value([value for _, value in arguments])
        if isinstance(value, Closure) and not value.captured:  # nothing in it was computed, under settings of its own
            self._known = revision, value
        return value

    @property
    def _parameter_groups(self) -> tuple[tuple[Parameter, ...], ...]:
        """The parameters of all groups, also of those that are given; once for the present texts."""
        revision = self._world.db.revision
        if self._groups is None or self._groups[0] != revision:
            self._groups = revision, groups_of(self._whole)
        return self._groups[1]

    @property
    def _whole(self) -> Type:
        """The type before any group was given."""
        return infer_expression(self._world.db, self._file, self._expr).type

    @property
    def type(self) -> str:
        """The type, as it is printed everywhere."""
        return format_type(self._type)

    @property
    def __name__(self) -> str:
        return self.written

    @property
    def __signature__(self) -> Signature:
        return signature_of(self._type)

    @property
    def __annotations__(self) -> dict[str, str]:  # type: ignore[override]
        return annotations_of(self._type)

    @property
    def written(self) -> str:
        """The expression that it stands for, without the groups that are given."""
        return print_expression(self._expr)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters of all groups, those that are given already included; nameless ones are empty."""
        return tuple(parameter.name or "" for group in self._parameter_groups for parameter in group)

    @property
    def surfaces(self) -> tuple[str, ...]:
        """The conditions across which the function's value or integrand jumps, as Potto writes them."""
        from potto.checking.facts import surfaces

        return surfaces(self._world.db, self._file, self._expr)

    def _repr_latex_(self) -> str | None:
        """For notebooks: a derivative as a formula, with its interior and its boundary. Other functions have none."""
        match self._expr:
            case nodes.Apply(function=nodes.Name(id="deriv"), arguments=(argument,)) if self._is_derivative():
                return typeset_derivative(self._world, self._file, argument.value)
            case _:
                return None

    def __repr__(self) -> str:
        given = "".join(
            f"({', '.join([*map(repr, args), *(f'{name}={value!r}' for name, value in words.items())])})"
            for args, words in self._given
        )
        return f"<Potto function {print_expression(self._expr)}{given} : {self.type}>"


def _type_of(argument: Any) -> Type | None:
    """The type of an argument that is a function."""
    return argument._type if isinstance(argument, Function) else None


def _derived(argument: Any) -> Any:
    """The derivative of a function that is none; anything else as it is."""
    plain = isinstance(argument, Function) and not is_dual(result_of(argument._type))
    return deriv(argument) if plain else argument


def _function_value(argument: Any) -> Value | None:
    return argument._value() if isinstance(argument, Function) else None


def _carries(argument: Any, type: Type | None) -> bool:
    """Whether an argument of a derivative has a tangent, or may have."""
    if isinstance(argument, tuple):  # of a group, if it is not known what for
        return type is not None or any(isinstance(item, tuple | list | Rows | Function) for item in argument)
    return type is None or isinstance(argument, list | Rows | Function)


def bound(function: Function, args: tuple[Any, ...], kwargs: dict[str, Any]) -> builtins.list[tuple[str, Any]]:
    """The arguments of a call under the names of their parameters. Raises PottoError if some are missing."""
    found = labelled((*function._given, (args, kwargs)), groups_of(function._whole))
    return [(label, argument) for label, argument, _ in found]


def component(function: Function, place: int) -> Function:
    """The function of one number of a tuple that a function gives; it takes what is left to be given."""
    names = [[parameter.name or "" for parameter in group] for group in function._parameter_groups]
    body: nodes.Expr = function._expr
    for group in names:
        given = tuple(nodes.Argument(NOWHERE, None, None, nodes.Name(NOWHERE, name)) for name in group)
        body = nodes.Apply(NOWHERE, body, given, True)
    groups = tuple(tuple(nodes.Parameter(NOWHERE, name) for name in group) for group in names)
    expr = nodes.Lambda(NOWHERE, groups, nodes.Field(NOWHERE, body, str(place), NOWHERE))
    type: Type = infer_expression(function._world.db, function._file, expr).type
    for _ in function._given:
        assert isinstance(type, FunctionType)
        type = type.result
    return Function(function._world, function._file, expr, type, function._given)


def _call_of(name: str, argument: nodes.Expr) -> nodes.Expr:
    """`name(argument)` as a tree."""
    given = (nodes.Argument(NOWHERE, None, None, argument),)
    return nodes.Apply(NOWHERE, nodes.Name(NOWHERE, name), given, True)
