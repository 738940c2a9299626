"""Parameters that move: each number of them along a direction of its own, or all along a tangent.

Owns `size`, `each_moving`, `with_places` and `moved`; `PRIMAL`, `own` and `with_own`: names for what moves. `p` names a
parameter, and `p.0` the number of one that is a number and its tangent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from potto.kernels.cells import Cell, Rows, Value, listed
from potto.kernels.errors import wrong_call
from potto.python.derivative_forms import form_of

PRIMAL = ".0"


def own(name: str, given: Mapping[str, Value]) -> Value:
    """What a name stands for. Raises PottoError if its parameter is given nothing."""
    parameter = name.removesuffix(PRIMAL)
    if parameter not in given:
        raise wrong_call(f"`{name}` is given no value, so there is nothing to differentiate by")
    value = given[parameter]
    if parameter == name:
        return value
    assert isinstance(value, tuple)
    return value[0]


def with_own(name: str, given: Value, moving: Mapping[str, Value]) -> Value:
    """A parameter where this moves, by names."""
    if name in moving:
        return moving[name]
    if name + PRIMAL not in moving:
        return given
    assert isinstance(given, tuple)
    return moving[name + PRIMAL], *given[1:]


def size(name: str, value: Value) -> int:
    """How many numbers a parameter has."""
    if isinstance(value, Cell):
        return 1
    if isinstance(value, tuple):
        return sum(size(name, item) for item in value)
    if isinstance(value, Rows):
        return value.size * size(name, value.item)
    kind = "list" if isinstance(value, list) else "function"
    raise wrong_call(
        f"`{name}` is a {kind} and not a number, so there is no derivative by it", "name other parameters in `wrt`"
    )


def each_moving(value: Value, numbers: Iterator[int], directions: int) -> Value:
    """The parameter, each of its numbers moving in a direction of its own."""
    if isinstance(value, tuple):
        return tuple(each_moving(item, numbers, directions) for item in value)
    if isinstance(value, Rows):
        return listed([each_moving(row, numbers, directions) for row in value.rows()])
    assert isinstance(value, Cell)
    own = next(numbers)
    return Cell(value.v, value.e, (None,) * own + (1.0,) + (None,) * (directions - own - 1))


def with_places(value: Value, places: tuple[int, ...], change: Callable[[Cell, tuple[int, ...]], Cell]) -> Value:
    """The value with `change` done to its cells, which is told how many elements the arrays around each have."""
    if isinstance(value, tuple):
        return tuple(with_places(item, places, change) for item in value)
    if isinstance(value, Rows):
        return Rows(with_places(value.item, (*places, value.size), change), value.size)
    assert isinstance(value, Cell)
    return change(value, places)


def moved(name: str, value: Value, tangent: Value) -> Value:
    """The parameter, moving along the tangent."""
    size(name, value)
    if isinstance(value, Cell) and isinstance(tangent, Cell):
        return Cell(value.v, value.e, (tangent.v,), (tangent.e,))
    if isinstance(value, tuple) and isinstance(tangent, tuple) and len(value) == len(tangent):
        return tuple(moved(name, *pair) for pair in zip(value, tangent, strict=True))
    if isinstance(value, Rows) and isinstance(tangent, Rows) and value.size == tangent.size:
        return Rows(moved(name, value.item, tangent.item), value.size)
    raise wrong_call(f"the tangent of `{name}` must have its form, {form_of(value)}")
