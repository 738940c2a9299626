"""The values of a function over a grid, with its derivative and the errors of both. For the evaluation process alone.

Owns `sample` and `sides`. All places are one batch. Numbers travel as base64 of little-endian floats: values in 64
bits, bounds of errors in 32, rounded up. Where a function has no value there is a nan.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from potto.diagnostics import PottoError
from potto.projects.settings import settings
from potto.python.api import Module, expression
from potto.python.functions import Function
from potto.python.gradients import grad
from potto.python.tiles import growing
from potto.runtime.answers.estimate import Estimate

if TYPE_CHECKING:
    from potto.evaluating.world import World

RTOL = 1e-6
Array = np.ndarray[Any, np.dtype[Any]]


class NoSamples(Exception):
    """Why something cannot be sampled, for the user to read."""


def sample(
    world: World, file: str, name: str, axes: Sequence[Mapping[str, Any]], values: Mapping[str, Any],
    wrt: str | None, rtol: float | None,
) -> dict[str, Any]:  # fmt: skip
    """Components of the value, and of the derivative by `wrt`, at the middles of cells; rows from the top.

    Two axes span rows and columns; one goes from end to end. Raises NoSamples, ProgramError.
    """
    module = Module(world, file)
    function = getattr(module, name, None)
    if not isinstance(function, Function):
        raise NoSamples(f"`{name}` is not a function")
    places, shape = _places(axes)
    given = {key: argument(module, key, value) for key, value in values.items() if key not in places} | places
    with settings(rtol=rtol or RTOL), growing():
        try:
            estimate = function(**given) if wrt is None else grad(function, [wrt])(**given)
        except (PottoError, TypeError) as error:
            raise NoSamples(str(error)) from None
    if not isinstance(estimate, Estimate):
        raise NoSamples(f"`{name}` needs values for more parameters")
    found = {"shape": list(shape), **_numbers("value", estimate.value, estimate.error, shape)}
    if wrt is not None:
        found |= _numbers("tangent", estimate.tangent, estimate.tangent_error, shape)
    return {
        **found, "evals": estimate.evals, "seconds": estimate.seconds, "compileSeconds": estimate.compile_seconds,
        "converged": estimate.converged, "reasons": list(estimate.reasons), "method": estimate.method,
    }  # fmt: skip


FAR = 1e300  # pixels: farther than any picture goes


def sides(
    world: World, file: str, surfaces: Sequence[Mapping[str, Any]], values: Mapping[str, Any],
    cell: Mapping[str, float],
) -> list[dict[str, Any]]:  # fmt: skip
    """For each surface, which `side` the middle of a pixel is on (1, -1, or 0 where it has no value), and roughly how
    many `pixels` away it is: less than half of one means that it goes through the pixel. `cell`: the sides of the
    pixel."""
    module = Module(world, file)
    around = [{}, *({axis: turn * size / 2} for axis, size in cell.items() for turn in (-1, 1))]
    found = []
    for surface in surfaces:
        function = argument(module, "surface", surface["text"])
        named = {name: argument(module, name, values[name]) for name in surface["parameters"]}
        places = [
            np.array([named[name] + shift.get(name, 0.0) for shift in around]) if name in cell else named[name]
            for name in surface["parameters"]
        ]
        at = np.broadcast_to(np.asarray(function(*places).value, dtype=float), len(around))
        slope = float(np.abs(at[1::2] - at[2::2]).sum())
        if not np.isfinite(at[0]):
            found.append({"side": 0, "pixels": FAR})
        else:
            found.append({"side": int(np.sign(at[0])), "pixels": min(abs(float(at[0])) / slope, FAR) if slope else FAR})
    return found


def _places(axes: Sequence[Mapping[str, Any]]) -> tuple[dict[str, Array], tuple[int, ...]]:
    """The values of the axes at every place, and the form of the grid."""
    if len(axes) == 1:
        (axis,) = axes
        return {axis["name"]: np.linspace(axis["from"], axis["to"], axis["count"])}, (axis["count"],)
    across, down = axes
    if across["name"] == down["name"]:
        raise NoSamples("the two axes are two parameters")
    xs, ys = np.meshgrid(_middles(across), _middles(down)[::-1])
    return {across["name"]: xs, down["name"]: ys}, xs.shape


def _middles(axis: Mapping[str, Any]) -> Array:
    low, high, count = float(axis["from"]), float(axis["to"]), axis["count"]
    middles: Array = low + (np.arange(count) + 0.5) * ((high - low) / count)
    return middles


def argument(module: Module, name: str, value: Any) -> Any:
    """A number, a tuple of numbers, or the text of an expression in the module's names. It may also be `m.f`, a
    function of a module that this one doesn't import."""
    if isinstance(value, list):
        return tuple(argument(module, name, item) for item in value)
    if isinstance(value, str):
        return _meant(module, name, value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise NoSamples(f"`{name}` is given neither a number nor an expression")
    return float(value)


def _meant(module: Module, name: str, text: str) -> Any:
    if not text.strip():
        raise NoSamples(f"`{name}` needs a value")
    try:
        file, there = module._world.home(module._file, text)
        found = expression(Module(module._world, file), there)
    except PottoError as error:
        raise NoSamples(f"`{name}`: " + "; ".join(d.message for d in error.diagnostics)) from None
    return found.value if isinstance(found, Estimate) else found


def _numbers(name: str, value: Any, error: Any, shape: tuple[int, ...]) -> dict[str, list[str]]:
    values = value if isinstance(value, tuple) else (value,)
    errors = error if isinstance(error, tuple) else (error,) * len(values)
    return {
        name: [_packed(_spread(part, shape)) for part in values],
        f"{name}Error": [_packed(_rounded_up(_spread(part, shape))) for part in errors],
    }


def _spread(part: Any, shape: tuple[int, ...]) -> Array:
    return np.broadcast_to(np.asarray(part, dtype="<f8"), shape)


def _rounded_up(bounds: Array) -> Array:
    with np.errstate(over="ignore"):
        near = bounds.astype("<f4")
        return np.where(near < bounds, np.nextafter(near, np.float32(np.inf)), near).astype("<f4")


def _packed(numbers: Array) -> str:
    return base64.b64encode(np.ascontiguousarray(numbers).tobytes()).decode("ascii")
