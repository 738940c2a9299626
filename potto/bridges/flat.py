"""A function of Potto as one of rows of numbers: what all bridges have in common.

Owns `FlatFunction` and `Leaf`. The parameters that a bridge passes on are rows of numbers, (*batch, numbers), and so
are the answers: values (*batch, answers), slopes (*batch, answers, moving), curvatures (*batch, answers, moving,
moving). How rows are put together from arguments is the library's own work, so that it differentiates that itself; one
batch, of whatever shape, is one call of Potto.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from potto.kernels.cells import Array
from potto.kernels.errors import wrong_call
from potto.python.arrays import axes_of
from potto.python.functions import Function, component, must_be_function
from potto.python.gradients import value_and_jacobian
from potto.python.hessian import hessian
from potto.python.named_parameters import Names, parameters_to_vary
from potto.types import format_type
from potto.types.types import ArrayOf, Dist, Parameter, Real, TupleOf, Type, TypeVariable, groups_of, resolve, result_of

Shapes = tuple[tuple[int, ...], ...]
Stack = Callable[[Sequence[Any]], Any]
"""Arrays of one shape as one array, along a new last axis."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """An array that a parameter is made of: `fields` lead to it through records. It has `axes` axes of its own behind
    those of a batch; of a tuple of numbers `items` says how many there are."""

    parameter: str
    fields: tuple[str, ...]
    axes: int
    items: int = 0


class FlatFunction:
    """A function of Potto of rows of numbers. The order of numbers is that of the leaves.

    moving: the leaves that are differentiated by. still: the others.
    """

    def __init__(self, function: Function, wrt: Names = None, given: Mapping[str, Any] | None = None) -> None:
        must_be_function(function)
        self.function, self.given = function, dict(given or {})
        groups = groups_of(function._type)
        self.parameters = tuple(_named(p, function) for group in groups for p in group if p.name not in self.given)
        known = {p.name for group in groups for p in group}
        for name in self.given:
            if name not in known:
                raise wrong_call(f"`{function.written}` has no parameter `{name}`, which is given")
        self.names = tuple(p.name or "" for p in self.parameters)
        self.wrt = self.names if wrt is None else parameters_to_vary(function, wrt)
        for name in self.wrt:
            if name not in self.names:
                raise wrong_call(f"`{name}` is given, so nothing can be differentiated by it")
        leaves = [leaf for p in self.parameters for leaf in _leaves(p.name or "", (), p.type)]
        self.moving = tuple(leaf for leaf in leaves if leaf.parameter in self.wrt)
        self.still = tuple(leaf for leaf in leaves if leaf.parameter not in self.wrt)
        self.answers = _answers(function)

    # Arguments

    def bound(self, args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> dict[str, Any]:
        """The arguments of a call by name. Raises PottoError where they are not those of the parameters."""
        if len(args) > len(self.names):
            raise wrong_call(f"`{self.function.written}` takes {len(self.names)} arguments, and is given {len(args)}")
        found = dict(zip(self.names, args))
        for name, argument in kwargs.items():
            if name in found or name not in self.names:
                what = "is given twice" if name in found else "is not a parameter that is left"
                raise wrong_call(f"`{name}` {what} of `{self.function.written}`")
            found[name] = argument
        missing = [f"`{name}`" for name in self.names if name not in found]
        if missing:
            raise wrong_call(f"`{self.function.written}` needs {', '.join(missing)}")
        return found

    def parts(self, leaves: Sequence[Leaf], given: Mapping[str, Any], stack: Stack) -> list[Any]:
        """The arrays that the leaves are given."""
        found = []
        for leaf in leaves:
            part = given[leaf.parameter]
            for field in leaf.fields:
                if not isinstance(part, Mapping) or field not in part:
                    raise wrong_call(f"`{leaf.parameter}` is a record: give a dict that has `{field}`")
                part = part[field]
            if isinstance(part, tuple | list):
                part = stack(part)
            if leaf.items and tuple(part.shape[-1:] if hasattr(part, "shape") else ()) != (leaf.items,):
                raise wrong_call(f"`{leaf.parameter}` is a tuple of {leaf.items} numbers, and is given something else")
            if len(getattr(part, "shape", ())) < leaf.axes:
                raise wrong_call(f"`{leaf.parameter}` needs an array of {leaf.axes} axes or more")
            found.append(part)
        return found

    def shaped(self, rows: Any) -> Any:
        """An answer's rows as the function has it: a number, or a tuple of numbers."""
        return rows[..., 0] if self.answers is None else tuple(rows[..., place] for place in range(self.answers))

    @property
    def width(self) -> int:
        """How many numbers an answer has."""
        return self.answers or 1

    # Values and derivatives

    def values(self, shapes: tuple[Shapes, Shapes], moving: Array, still: Array) -> tuple[Array, Array]:
        """Values and their errors."""
        batch, arguments = self._arguments(shapes, moving, still)
        if 0 in batch:
            return np.zeros((*batch, self.width)), np.zeros((*batch, self.width))
        found = self.function(**arguments)
        return self._rows(found.value, batch), self._rows(found.error, batch)

    def slopes(self, shapes: tuple[Shapes, Shapes], moving: Array, still: Array) -> tuple[Array, Array, Array]:
        """Values, their errors, and the derivatives by all that moves."""
        batch, arguments = self._arguments(shapes, moving, still)
        count = moving.shape[-1]
        if 0 in batch:
            return (*self.values(shapes, moving, still), np.zeros((*batch, self.width, count)))
        value, slopes = value_and_jacobian(self.function, self.wrt)(**arguments)
        rows = np.reshape(slopes.value, (*batch, self.width, count))
        return self._rows(value.value, batch), self._rows(value.error, batch), rows

    def curvatures(self, shapes: tuple[Shapes, Shapes], moving: Array, still: Array) -> tuple[Array, ...]:
        """Values, their errors, first and second derivatives by all that moves."""
        first = self.slopes(shapes, moving, still)
        batch, arguments = self._arguments(shapes, moving, still)
        count = moving.shape[-1]
        whole = np.zeros((*batch, self.width, count, count))
        for place in range(self.width if 0 not in batch else 0):
            one = self.function if self.answers is None else component(self.function, place)
            found = hessian(one, self.wrt)(**arguments)
            whole[..., place, :, :] = np.reshape(found.value, (*batch, count, count))
        return (*first, whole)

    def _arguments(
        self, shapes: tuple[Shapes, Shapes], moving: Array, still: Array
    ) -> tuple[tuple[int, ...], dict[str, Any]]:
        batch = np.broadcast_shapes(moving.shape[:-1], still.shape[:-1])
        given = dict(self.given)
        for leaves, sizes, rows in zip((self.moving, self.still), shapes, (moving, still), strict=True):
            wide = np.broadcast_to(np.asarray(rows, dtype=np.float64), (*batch, rows.shape[-1]))
            at = 0
            for leaf, shape in zip(leaves, sizes, strict=True):
                size = int(np.prod(shape))
                part = wide[..., at : at + size].reshape((*batch, *shape))
                at += size
                _put(given, leaf, part)
        return batch, given

    def _rows(self, value: Any, batch: tuple[int, ...]) -> Array:
        parts = [value] if self.answers is None else list(value)
        return np.stack([np.broadcast_to(np.asarray(part, dtype=float), batch) for part in parts], axis=-1)


def _put(given: dict[str, Any], leaf: Leaf, part: Array) -> None:
    """Give a parameter, or a field of one, its numbers."""
    path = (leaf.parameter, *leaf.fields)
    for name in path[:-1]:
        given = given.setdefault(name, {})
    given[path[-1]] = tuple(np.moveaxis(part, -1, 0)) if leaf.items else part


def _named(parameter: Parameter, function: Function) -> Parameter:
    if parameter.name is None:
        raise wrong_call(f"the parameters of `{function.written}` have no names", "write it as `\\t . …`")
    return parameter


def _leaves(name: str, fields: tuple[str, ...], type: Type) -> Iterator[Leaf]:
    """The arrays that a parameter is made of. Raises PottoError for one that no array can be."""
    found = resolve(type)
    if isinstance(found, Real | Dist | TypeVariable):
        yield Leaf(name, fields, 0)
        return
    if isinstance(found, TupleOf) and found.record is not None:
        for field, item in zip(found.record.fields, found.items, strict=True):
            yield from _leaves(name, (*fields, field), item)
        return
    if isinstance(found, TupleOf) and all(
        isinstance(resolve(item), Real | Dist | TypeVariable) for item in found.items
    ):
        yield Leaf(name, fields, 1, len(found.items))
        return
    axes = axes_of(found) if isinstance(found, ArrayOf) else None
    if axes is None:
        shown = format_type(found)
        raise wrong_call(f"`{name}` is {shown}, which is not an array", f"give it at once: `given={{'{name}': …}}`")
    yield Leaf(name, fields, axes)


def _answers(function: Function) -> int | None:
    """How many numbers the answer is a tuple of; None of one number. Raises PottoError for anything else."""
    result = resolve(result_of(function._type))
    if isinstance(result, Real | Dist | TypeVariable):
        return None
    if isinstance(result, TupleOf) and all(
        isinstance(resolve(item), Real | Dist | TypeVariable) for item in result.items
    ):
        return len(result.items)
    raise wrong_call(
        f"`{function.written}` gives {format_type(result)}, and a number or a tuple of numbers can be passed on",
        "give one element, and call it over an array of places",
    )
