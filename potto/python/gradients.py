"""Derivatives of functions of Potto for Python: gradients, Jacobians, products with vectors from either side.

Owns `grad`, `value_and_grad`, `jacobian`, `vjp` and `jvp`; their answers are in `slopes`. By many parameters it is
differentiated in reverse, by few forward: that is chosen here, and both give the same. What is differentiated by is
named; without names it is the first parameter. All numbers come with their errors, and arrays broadcast as in a call.
Second derivatives are in `applications/hessian`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, overload

import numpy as np
from msgspec.structs import asdict, replace

from potto.kernels.cells import Cell, Value, all_cells, map_cells, pad
from potto.kernels.chunks import POINTS
from potto.kernels.errors import wrong_call
from potto.kernels.sweeps import Swept, swept
from potto.kernels.tape import Node, Untaped
from potto.projects.settings import current
from potto.python.accepting import as_given
from potto.python.arguments import Batch, value_of
from potto.python.calls import Call
from potto.python.described import typeset_derivative
from potto.python.forms import as_matrix, bounds_of, by_name, in_lists, must_match, tangents_of, weighted
from potto.python.functions import Function, bound
from potto.python.moving import each_moving, moved, own, size, with_own, with_places
from potto.python.named_parameters import Names, parameters_to_vary
from potto.python.remade import remade
from potto.python.sided import with_sides
from potto.python.slopes import Gradient, Slopes
from potto.python.tiles import LEAST
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.records import named, named_answer
from potto.runtime.evaluate import Clock, bar, number, report, told
from potto.runtime.evaluation.derivatives.sides import as_a_whole
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.record import Record
from potto.types.types import REAL

# Parameters, from which on a tape is swept back instead of carrying a tangent for each: it costs 2.5 to 3.4 values
# whatever their number, tangents 1.6 at 4 and, where all depends on all, 2.7 at 12 and 4.8 at 64; the first call costs
# half as much from 8 on (`benchmarks/gradients.py ways`). What integrals carry is the same either way.
MANY = 12
SWEEP = 6  # tangents that cost what a sweep does, of which each number of an answer takes one
NOTHING: Swept = (None, None)


@overload
def grad(function: Function, wrt: Names = None) -> GradientFunction: ...
@overload
def grad(function: GradientFunction, wrt: Names = None) -> Callable[..., Gradient]: ...
def grad(function: Function | GradientFunction, wrt: Names = None) -> Any:
    """The function with its derivatives by the parameters named in `wrt`, or by the first one.

    It takes plain numbers. In the answer, `tangent` is the derivative by the one parameter, or a tuple of them in the
    order of `wrt`; `answer["c"]` is the one by `c`. The derivative by a tuple is a tuple, that by a record a tuple with
    its fields, or a dict where the record is given as one. Of `grad(f)` it is the second derivative: `value` is what
    `grad(f)` has as `tangent`.
    Raises PottoError if the function has no such parameter, or one of them is not a number.
    """
    if isinstance(function, GradientFunction):
        from potto.applications.hessian import second_gradient  # which differentiates by what is here

        return second_gradient(function._function, function._wrt, parameters_to_vary(function._function, wrt))
    return GradientFunction(function, parameters_to_vary(function, wrt))


@remade
def value_and_grad(function: Function, wrt: Names = None) -> Callable[..., tuple[Estimate, Estimate]]:
    """The value and the derivatives by the parameters named in `wrt`, or by the first one, as two estimates.

    `value, slope = potto.value_and_grad(f)(0.3)`. The second one is what `grad` has as `tangent`. Raises as that does.
    """
    gradient = grad(function, wrt)

    def pair(*args: Any, **kwargs: Any) -> tuple[Estimate, Estimate]:
        found = gradient(*args, **kwargs)
        return replace(_plain(found), tangent=None, tangent_error=None), Slopes.of(found)

    return pair


@remade
def jacobian(function: Function, wrt: Names = None) -> Callable[..., Estimate]:
    """All derivatives as one array: by the numbers of the function's answer, and by those of the parameters in `wrt`.

    `value` and `error` have the shape (*batch, answers, parameters): batch is what arrays broadcast to, and an axis is
    left out where the answer is one number, and where one parameter is named that is one number. Raises as `grad` does.
    """
    pair = value_and_jacobian(function, wrt)
    return lambda *args, **kwargs: pair(*args, **kwargs)[1]


@remade
def value_and_jacobian(function: Function, wrt: Names = None) -> Callable[..., tuple[Estimate, Estimate]]:
    """The value and what `jacobian` has of it, in one run. Raises as that does."""
    names = parameters_to_vary(function, wrt)

    def pair(*args: Any, **kwargs: Any) -> tuple[Estimate, Estimate]:
        run = _Run(*function.prepared(args, kwargs, {}), {})
        value = run.along_each(names)
        tangents, bounds = (
            tuple(run.one_by_one(list(map(number, side(cell))), names) for cell in all_cells(value))
            for side in (tangents_of, bounds_of)
        )
        found = run.answer(value, tangents, bounds)
        own = run.own(*names)
        single = isinstance(value, Cell), len(names) == 1 and isinstance(own[names[0]], Cell)
        count = sum(size(name, value) for name, value in own.items())
        slopes, errors = (as_matrix(part, count, run.batch, *single) for part in (found.tangent, found.tangent_error))
        plain = replace(found, tangent=None, tangent_error=None)
        return plain, replace(plain, value=slopes, error=errors)

    return pair


@remade
def vjp(function: Function, cotangent: Any, wrt: Names = None) -> Callable[..., Gradient]:
    """The product of a cotangent with the Jacobian: the derivatives of `cotangent` times the function's answer.

    `potto.vjp(f, (1.0, -2.0), wrt=["a"])(0.3)` takes what `f` takes; `value` is that of `f`, and `tangent` the product
    in the form that `grad` has. The cotangent has the form of the answer: a number, or a tuple; arrays broadcast with
    those of the call. Raises as `grad` does, and where the form is another.
    """
    names = parameters_to_vary(function, wrt)

    def product(*args: Any, **kwargs: Any) -> Gradient:
        extra = {"cotangent": function.in_form("cotangent", cotangent, None)}
        run = _Run(*function.prepared(args, kwargs, extra), extra)
        value, total = run.along_each_together(names, in_lists(run.extra["cotangent"]))
        return in_given_form(run.gradient(value, total, names), function, args, kwargs)

    return product


@remade
def jvp(function: Function, along: Mapping[str, Any], *tangents: Any) -> Callable[..., Estimate]:
    """The product of the Jacobian with a vector: the derivative along a direction, over the parameters that it names.

    `potto.jvp(f, {"a": 1.0, "b": 2.0})(0.3, 0.6)` takes what `f` takes; the other parameters stand still. In the answer
    `tangent` is the derivative. Raises PottoError if the function has no such parameter, one of them is not a
    number, a tangent does not have the form of its parameter, or the direction is given as JAX takes it, by places.
    """
    if tangents or not isinstance(along, Mapping):
        name = next(iter(function.parameters), "") if isinstance(function, Function) else ""
        raise wrong_call(
            "`jvp` takes the direction alone, as a dict by the names of parameters",
            f'write `potto.jvp(f, {{"{name or "x"}": 1.0}})(…)`: what it gives is called as `f` is',
        )
    names = parameters_to_vary(function, tuple(along))

    def product(*args: Any, **kwargs: Any) -> Estimate:
        labels = {
            label: function.in_form(label, tangent, name)
            for name, tangent in along.items()
            if (label := f"the tangent of {name}")
        }
        run = _Run(*function.prepared(args, kwargs, labels), labels)
        tangents = dict(zip(names, run.extra.values(), strict=True))
        moving = {name: moved(name, value, tangents[name]) for name, value in run.own(*names).items()}
        value = run.evaluated(moving, run.machine.with_directions(1), lambda value: value)
        return named_answer(run.batch.shaped(report(value, run.machine, run.clock)), run.call.result)

    return product


class GradientFunction:
    """A function that also answers with its derivatives by some of its parameters."""

    def __init__(self, function: Function, wrt: tuple[str, ...]) -> None:
        self._function = function
        self._wrt = wrt

    def __call__(self, *args: Any, **kwargs: Any) -> Gradient:
        args, kwargs = self._function.by_place(args, kwargs)
        known = None if kwargs else self._function.at_once(args, self._wrt)
        if known is not None:
            assert isinstance(known, Gradient)
            return known
        found = self._function.in_tiles(args, kwargs, self._wrt)
        assert isinstance(found, Gradient)
        return in_given_form(found, self._function, args, kwargs)

    def _repr_latex_(self) -> str | None:
        """For notebooks: the derivative as a formula, with its interior and its boundary."""
        return typeset_derivative(self._function._world, self._function._file, self._function._expr)

    def __repr__(self) -> str:
        return f"<gradient of {self._function!r} by {', '.join(self._wrt)}>"


def gradient(call: Call, arguments: Sequence[tuple[str, Value]], wrt: tuple[str, ...], batch: Batch) -> Gradient:
    """The estimate of a call with its derivatives by the arguments named in `wrt`, for all of a batch at once."""
    run = _Run(call, arguments, batch, {})
    value = run.along_each(wrt)
    found = run.gradient(value, value, wrt)
    if batch.size < LEAST:
        run.keep(found, wrt)
    return found


def in_given_form(found: Gradient, function: Function, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Gradient:
    """The gradient in the form of what was given: by a record a record, or a dict where that is one, by a tuple that is
    an array an array."""
    given = dict(bound(function, args, kwargs))
    if all(isinstance(argument, float | int) for argument in given.values()):
        return found
    types = {name: function.type_of(name) for name in found.wrt}

    def form(parts: Any, own: Callable[[str, Any], Any]) -> Any:
        each = [own(name, part)
                for name, part in zip(found.wrt, parts if len(found.wrt) > 1 else (parts,), strict=True)]  # fmt: skip
        return tuple(each) if len(each) > 1 else each[0]

    def as_it_was(name: str, part: Any) -> Any:
        return as_given(given.get(name), named(part, types[name]), types[name])

    sides = [form(side, as_it_was) for side in (found.tangent, found.tangent_error)]
    dicts = any(isinstance(given.get(name), Mapping | list) for name in found.wrt)
    records = [form(side, lambda name, part: named(part, types[name])) for side in sides] if dicts else None
    return replace(found, tangent=sides[0], tangent_error=sides[1], as_records=records)


class _Run:
    """A call of a function on its way to derivatives. extra: values that broadcast with the arguments."""

    def __init__(
        self, call: Call, arguments: Sequence[tuple[str, Value]], batch: Batch, extra: Mapping[str, Any]
    ) -> None:
        self.call, self.arguments, self.batch = call, arguments, batch
        self.given = dict(arguments)
        self.extra = {name: value_of(name, item, batch, lambda _: None) for name, item in extra.items()}
        self.machine = self._machine()
        self.clock = Clock()
        self.moved: tuple[Sequence[Value], Machine] = (), self.machine  # what was evaluated last, and by what
        self.whole = False  # whether derivatives by all elements of an array are one array, as a tape gives them

    def _machine(self) -> Machine:
        world = self.call.world
        return world.program.machine(current(world.settings(self.call.file)))

    def along_each(self, wrt: tuple[str, ...]) -> Value:
        """The value, with a tangent for each number of the parameters named."""

        directions = sum(size(name, value) for name, value in self.own(*wrt).items())

        def swept_back(value: Value, seeds: Sequence[Node]) -> Value:
            if len(all_cells(value)) * SWEEP > max(directions, SWEEP):
                raise Untaped
            return map_cells(value, lambda cell: Cell(cell.v, cell.e, *_swept([(cell, 1.0)], seeds)))

        return self._differentiated(wrt, swept_back, lambda value: value)

    def along_each_together(self, wrt: tuple[str, ...], weights: Value) -> tuple[Value, Value]:
        """The value, and the sum of its numbers, each times its weight, with such tangents."""

        def swept_back(value: Value, seeds: Sequence[Node]) -> Value:
            must_match(value, weights)
            pairs = zip(all_cells(value), (weight.v for weight in all_cells(weights)), strict=True)
            return map_cells(value, lambda cell: Cell(cell.v, cell.e)), Cell(0.0, None, *_swept(list(pairs), seeds))

        def forward(value: Value) -> Value:
            must_match(value, weights)
            return value, weighted(value, weights)

        found = self._differentiated(wrt, swept_back, forward)
        assert isinstance(found, tuple)
        return found[0], found[1]

    def _differentiated(
        self, wrt: tuple[str, ...], swept_back: Callable[[Value, Sequence[Node]], Value],
        forward: Callable[[Value], Value],
    ) -> Value:  # fmt: skip
        """What one of these makes of the value: of a tape with its seeds, or of tangents."""
        own = self.own(*wrt)
        directions = sum(size(name, value) for name, value in own.items())
        shape = () if self.batch.shape is None else (max(1, int(np.prod(self.batch.shape))),)
        small = np.prod(shape) <= POINTS  # a tape keeps arrays for all operations
        if directions >= MANY and small:
            try:
                return self._taped(own, shape, swept_back, forward)
            except Untaped:
                self.machine, self.whole = self._machine(), False
        numbers = iter(range(directions))
        moving = {name: each_moving(value, numbers, directions) for name, value in own.items()}
        found = self.evaluated(moving, self.machine.with_directions(directions), forward)
        if directions == len(own) or directions >= MANY or not small or not _nowhere(found):
            return found
        # Elements that stand still where a slope is infinite: of infinity times 0 a tape knows nothing.
        machine, self.machine = self.machine, self._machine()
        try:
            return self._taped(own, shape, swept_back, forward)
        except Untaped:
            self.machine, self.whole = machine, False
            return found

    def _taped(
        self, own: dict[str, Value], shape: tuple[int, ...], swept_back: Callable[[Value, Sequence[Node]], Value],
        forward: Callable[[Value], Value],
    ) -> Value:  # fmt: skip
        """The value with what its tape, swept back, has for each number. Raises Untaped."""
        seeds: list[Any] = []

        def seeded(cell: Cell, places: tuple[int, ...]) -> Cell:
            seeds.append(Node((), (*places, *shape)))
            return Cell(cell.v, cell.e, (seeds[-1],))

        moving = {name: with_places(value, (), seeded) for name, value in own.items()}
        self.whole = True
        found = self.evaluated(moving, self.machine.taped(), lambda value: swept_back(value, seeds))
        return found if not self.machine.record.edges else self._with_sides(found, own, seeds, forward)

    def _with_sides(
        self, found: Value, own: dict[str, Value], seeds: Sequence[Node], forward: Callable[[Value], Value]
    ) -> Value:
        def run(moving: dict[str, Value], directions: int) -> tuple[Value, Record]:
            machine = self._machine().with_directions(directions)
            return self.evaluated(moving, machine, forward), machine.record

        return with_sides(found, self.machine.record, own, seeds, run)

    def evaluated(self, moving: Mapping[str, Value], machine: Machine, ended: Callable[[Value], Value]) -> Value:
        """What `ended` makes of the value that this machine finds where these parameters move."""
        k = machine.directions
        values = [pad(with_own(name, value, moving), k) for name, value in self.arguments]
        self.moved = values, machine
        with self.clock:
            value = in_lists(as_a_whole(machine, self.call.elaborated, tuple(values), self.called))
            if not _numbers(value):
                raise wrong_call("only a number or a tuple of numbers has a gradient")
            with np.errstate(all="ignore"):
                return ended(pad(value, k))

    def called(self, machine: Machine, values: Value) -> Value:
        assert isinstance(values, tuple)
        return self.call.value(values, machine)

    def own(self, *names: str) -> dict[str, Value]:
        """What is differentiated by, as it is given. Raises PottoError if that is nothing."""
        return {name: own(name, self.given) for name in names}

    def keep(self, found: Estimate, wrt: tuple[str, ...]) -> None:
        """Keep what answers a call of this kind at once, if anything does."""
        values, machine = self.moved
        if all(isinstance(value, Cell) for value in values) and not (self.whole and self.batch.shape is not None):
            self.call.keep([value.v for value in values], values, found, wrt, machine)  # type: ignore[union-attr]

    def answer(self, value: Value, tangents: Any, bounds: Any) -> Estimate:
        found = report(value, self.machine, self.clock)
        shaped = self.batch.shaped(replace(found, tangent=tangents, tangent_error=bounds))
        return replace(shaped, value=named(shaped.value, self.call.result))

    def one_by_one(self, slopes: list[Any], names: tuple[str, ...]) -> tuple[Any, ...]:
        """The derivatives by each number of the parameters, those of an array element by element."""

        def flat(form: Any) -> list[Any]:
            return [x for item in form for x in flat(item)] if isinstance(form, tuple | list) else [form]

        return tuple(flat(by_name(slopes, self.own(*names), self.whole)))

    def gradient(self, value: Value, moving: Value, wrt: tuple[str, ...]) -> Gradient:
        """The estimate of a value, with the derivatives of `moving` in the form of the parameters."""
        own = self.own(*wrt)
        directions = range(len(all_cells(tuple(own.values()))) if self.whole
                           else sum(size(name, value) for name, value in own.items()))  # fmt: skip
        form = self.call.result if moving is value else REAL
        tangents = [named(told(moving, lambda cell, d=d: cell.t[d]), form) for d in directions]  # type: ignore[misc]
        bounds = [told(moving, lambda cell, d=d: bar(cell.et[d])) for d in directions]  # type: ignore[misc]
        forms = (by_name(part, own, self.whole) for part in (tangents, bounds))
        found = self.answer(value, *(form[0] if len(wrt) == 1 else form for form in forms))
        return Gradient(**asdict(found), wrt=wrt)


def _swept(answers: Sequence[tuple[Cell, Any]], seeds: Sequence[Node]) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """The derivatives by the seeds of a sum of answers, each times a weight, and how far off they may be."""
    nodes: list[tuple[Any, Any]] = [(cell.t[0], weight) for cell, weight in answers]
    found = swept([(node, weight) for node, weight in nodes if isinstance(node, Node)])
    return tuple(found.get(seed, NOTHING)[0] for seed in seeds), tuple(found.get(seed, NOTHING)[1] for seed in seeds)


def _nowhere(value: Value) -> bool:
    """Whether a number has derivatives that are none."""
    return any(np.any(np.isfinite(cell.v) & np.isnan(x)) for cell in all_cells(value) for x in cell.t if x is not None)


def _plain(found: Estimate) -> Estimate:
    return Estimate(**{name: getattr(found, name) for name in Estimate.__struct_fields__})


def _numbers(value: Value) -> bool:
    return isinstance(value, Cell) or (isinstance(value, tuple | list) and all(map(_numbers, value)))


__all__ = ["GradientFunction", "grad", "jacobian", "jvp", "value_and_grad", "vjp"]
