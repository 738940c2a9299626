"""Second derivatives: the Hessian times a vector, all its components in one run, and the whole of it.

Owns `hvp`, `hessian` and `second_gradient`. The derivative of a function along a direction is a function of duals; its
gradient, with one tangent for each parameter, is the product. It is taken through the boundary terms of the first
derivative. The matrix is the products with all unit vectors, as one batch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from msgspec.structs import replace

from potto.kernels.cells import Cell, Rows, Value, map_cells
from potto.kernels.errors import wrong_call
from potto.python.arguments import batch_of
from potto.python.functions import Function, bound, deriv
from potto.python.gradient_functions import GradientFunction, in_given_form
from potto.python.moving import PRIMAL
from potto.python.named_parameters import Names, parameters_to_vary
from potto.python.remade import remade
from potto.python.slopes import Gradient
from potto.runtime.answers.estimate import Estimate, OneSided


@remade
def hvp(function: Function, along: Mapping[str, Any]) -> Callable[..., Gradient]:
    """The Hessian of a function times the vector `along`, over the parameters that it names; the others stand still.

    `potto.hvp(f, {"a": 1.0, "b": 2.0})(0.3, 0.6)` takes what `f` takes. In the answer `tangent` is the product by the
    parameters of `along`, in their order (one number if there is one), and `answer["a"]` its component by `a`.
    Raises PottoError where the function has no second derivative, or the names are none of its parameters.
    """
    names = parameters_to_vary(function, tuple(along))
    twice = _twice(function, names)
    along = {name: function.in_form(f"the tangent of {name}", along[name], name) for name in names}

    def product(*args: Any, **kwargs: Any) -> Gradient:
        given = _named(function, args, kwargs)
        return in_given_form(_product(twice(given, along), given, names), function, args, kwargs)

    return product


@remade
def hessian(function: Function, wrt: Names = None) -> Callable[..., Estimate]:
    """All second derivatives of a function that gives one number, by the parameters in `wrt`, or by the first one.

    `value` and `error` have the shape (*batch, parameters, parameters): batch is what arrays broadcast to, and there
    are not axes where one parameter is named that is one number. Raises as `hvp` does, and for a tuple.
    """
    names = parameters_to_vary(function, wrt)
    twice = _twice(function, names)

    def matrix(*args: Any, **kwargs: Any) -> Estimate:
        given = _named(function, args, kwargs)
        count = sum(_count(given[name]) for name in names if name in given)
        axes = len(batch_of(given.items()).shape or ())
        units = iter(np.eye(count).reshape(count, count, *(1,) * axes))
        found = twice(given, {name: _like(given[name], units) for name in names if name in given})
        if isinstance(found.value[0], tuple):
            raise wrong_call("only a function that gives one number has a Hessian", "take one component of the answer")
        product = _product(found, given, names)
        single = len(names) == 1 and not isinstance(given[names[0]], tuple | list | Rows)
        sides = (product.tangent, product.tangent_error)
        value, error = (_as_matrix(list(_leaves(side, 1 + axes)), single) for side in sides)
        common = {name: getattr(product, name) for name in Estimate.__struct_fields__}
        told = {"value": value, "error": error, "tangent": None, "tangent_error": None}
        members = np.all(found.member_converged, axis=0) if axes else None
        reasons = {why: np.any(where, axis=0) if axes else True for why, where in found.shortfalls.items()}
        return Estimate(**{**common, **told, "member_converged": members, "shortfalls": reasons})

    return matrix


@remade
def second_gradient(function: Function, first: tuple[str, ...], then: tuple[str, ...]) -> Callable[..., Gradient]:
    """The derivatives by `first`, as value, and theirs by `then`: what `grad(grad(f, first), then)` is.

    In the form of a gradient: `tangent` is, for each parameter of `then`, of the form of the value. Raises PottoError
    where one of the parameters is not one number.
    """
    names = tuple(dict.fromkeys((*first, *then)))
    slopes, curvatures = GradientFunction(function, first), hessian(function, names)

    def twice(*args: Any, **kwargs: Any) -> Gradient:
        slope, matrix = slopes(*args, **kwargs), curvatures(*args, **kwargs)
        sizes = [0 if np.ndim(part) > np.ndim(slope.value) or isinstance(part, tuple | dict | list) else 1
                 for part in (slope.tangent if len(first) > 1 else (slope.tangent,))]  # fmt: skip
        axes = 2 if len(names) > 1 else 0
        if not all(sizes) or matrix.ndim != np.ndim(slope.value) + axes:
            raise wrong_call("the gradient of a gradient is taken by numbers", "`potto.hessian` is for all others")

        def block(whole: Any) -> Any:
            if len(names) == 1:
                return whole
            each = [[_cell(whole[..., names.index(a), names.index(b)]) for a in first] for b in then]
            rows = [tuple(row) if len(row) > 1 else row[0] for row in each]
            return tuple(rows) if len(rows) > 1 else rows[0]

        common = {name: getattr(matrix, name) for name in Estimate.__struct_fields__}
        told = {"value": slope.tangent, "error": slope.tangent_error, "tangent": block(matrix.value),
                "tangent_error": block(matrix.error), "evals": slope.evals + matrix.evals, "seconds":
                slope.seconds + matrix.seconds, "converged": slope.converged and matrix.converged}  # fmt: skip
        return Gradient(**{**common, **told, "wrt": then})

    return twice


def _cell(part: Any) -> Any:
    return part if np.ndim(part) else float(part)


def _twice(function: Function, names: tuple[str, ...]) -> Callable[[dict[str, Any], Mapping[str, Any]], Gradient]:
    """From arguments, and a direction, to the derivatives of (f, f' v) by the numbers that are named."""
    once = deriv(function)
    duals = dict(zip(function.parameters, once.parameters, strict=True))
    moving = tuple(duals[name] + PRIMAL for name in names)

    def found(given: dict[str, Any], along: Mapping[str, Any]) -> Gradient:
        pairs = {duals[name]: _dual(argument, along.get(name)) for name, argument in given.items()}
        gradient = once.in_tiles((), pairs, moving)
        assert isinstance(gradient, Gradient)
        return gradient

    return found


def _named(function: Function, args: tuple[Any, ...], kwargs: dict[str, Any]) -> dict[str, Any]:
    """The arguments of a call by the names of their parameters."""
    given: dict[str, Any] = {}
    for name, argument in bound(function, args, kwargs):
        if name not in function.parameters:
            raise wrong_call(f"the parameter for {argument!r} has no name, and second derivatives are taken by names")
        given[name] = function.in_form(name, argument.value if isinstance(argument, Estimate) else argument, name)
    return given


def _dual(argument: Any, direction: Any) -> Any:
    """An argument with its tangent: that of the vector, or none."""
    if isinstance(argument, Function):
        return deriv(argument)
    return argument, _like(argument, None) if direction is None else direction


def _like(argument: Any, numbers: Iterator[Any] | None) -> Any:
    """These numbers, or zeros, in the form of an argument; those of an array element by element."""
    if isinstance(argument, tuple | list):
        return type(argument)([_like(item, numbers) for item in argument])
    if isinstance(argument, Rows):
        if numbers is None:
            return map_cells(argument, lambda _: Cell(0.0))
        return _filled(argument, np.stack([next(numbers) for _ in range(_count(argument))]), 0)
    return 0.0 if numbers is None else next(numbers)


def _filled(value: Value, block: Any, inner: int) -> Value:
    """A value of these numbers: behind `inner` axes of places an axis of its numbers, and then those of a batch."""
    if isinstance(value, Rows):
        shape = block.shape
        split = block.reshape(*shape[:inner], value.size, _count(value.item), *shape[inner + 1 :])
        return Rows(_filled(value.item, split, inner + 1), value.size)
    if isinstance(value, tuple):
        ends = np.cumsum([_count(item) for item in value])[:-1]
        parts = np.split(block, ends, axis=inner)
        return tuple(_filled(item, part, inner) for item, part in zip(value, parts, strict=True))
    return Cell(np.squeeze(block, axis=inner))


def _count(argument: Any) -> int:
    """How many numbers an argument has."""
    if isinstance(argument, tuple | list):
        return sum(map(_count, argument))
    return argument.size * _count(argument.item) if isinstance(argument, Rows) else 1


def _leaves(argument: Any, batch: int) -> Iterator[Any]:
    """The numbers of derivatives; of arrays, behind the axes of a batch, element by element."""
    if isinstance(argument, tuple | list):
        for item in argument:
            yield from _leaves(item, batch)
    elif np.ndim(argument) > batch:
        yield from np.moveaxis(argument.reshape(*argument.shape[:batch], -1), -1, 0)
    else:
        yield argument


def _product(found: Gradient, given: Mapping[str, Any], names: tuple[str, ...]) -> Gradient:
    """Of the derivatives of (f, f' v), those of f' v."""

    def part(tangents: Any) -> Any:
        items = tangents if len(names) > 1 else (tangents,)
        parts = tuple(_last(item, given[name]) for item, name in zip(items, names, strict=True))
        return parts if len(names) > 1 else parts[0]

    count = sum(_count(given[name]) for name in names)
    return replace(
        found, value=found.value[0], error=found.error[0], tangent=part(found.tangent),
        tangent_error=part(found.tangent_error), wrt=names, notes=_own_notes(found, count),
    )  # fmt: skip


def _own_notes(found: Gradient, count: int) -> tuple[OneSided, ...]:
    """Of notes on (f, f' v) by so many numbers, what they say of f' v.

    It may be one number to both sides: then there is nothing to note.
    """
    batch, size = np.shape(found.value[0]), 2 * count * np.prod(np.shape(found.value[0]))
    notes = []
    for note in found.notes:
        sides = [np.asarray(side) for side in (note.backward, note.forward, note.backward_error, note.forward_error)]
        if sides[0].size == size:  # else it is of one integral, by what that depends on
            sides = [np.squeeze(side.reshape(2, count, *batch)[1]) for side in sides]
        backward, forward, before, beyond = sides
        if not np.array_equal(backward, forward) or not np.isfinite(backward).all():
            notes.append(replace(note, backward=backward, forward=forward, backward_error=before, forward_error=beyond))
    return tuple(notes)


def _last(slopes: Any, argument: Any) -> Any:
    """The second of each pair (that of f, that of f' v), in the form of a parameter."""
    if isinstance(argument, Rows) or (isinstance(argument, list) and isinstance(slopes, np.ndarray)):
        return slopes[..., 1]  # of an array, pairs are the last axis
    if isinstance(argument, tuple | list):
        return type(argument)([_last(part, item) for part, item in zip(slopes, argument, strict=True)])
    return slopes[1]


def _as_matrix(rows: list[Any], single: bool) -> Any:
    """Products with the unit vectors of a batch, by parameter: their components, (parameters, units, *batch)."""
    whole = np.moveaxis(np.asarray(rows, dtype=float), (0, 1), (-1, -2))
    if single:
        whole = whole[..., 0, 0]
    return whole if whole.ndim else float(whole)
