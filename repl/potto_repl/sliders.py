"""A function with a slider for each of its numbers, in a notebook: its value and slopes, a curve or an image.

Owns `sliders`. Needs ipywidgets, the extra `notebook`.
"""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

from msgspec.structs import replace

from potto.applications.framed import image_of
from potto.applications.pictures import Curve, Plot
from potto.diagnostics import PottoError
from potto.extras import install_command
from potto.kernels.errors import wrong_call
from potto.python.functions import Function
from potto.python.gradients import grad
from potto.runtime.answers.rich import rows_html

POINTS, PIXELS = 200, 96  # along a curve, along a side of an image
STEPS = 100  # of a slider


def sliders(
    function: Function, /, *, axes: Sequence[str] = (), given: dict[str, Any] | None = None, **ranges: Any
) -> Any:
    """Sliders for the parameters of a function: `potto.sliders(f, t=(0, 1))`, in a Jupyter notebook.

    A pair of numbers is a parameter's range; three are its range and where it starts. Without `axes` the value is shown
    with the derivative by every slider; `axes=["x"]` draws a curve over `x`, two axes an image, each over its range.
    `given` holds what other parameters are, such as functions. Answers a widget. Raises PottoError for parameters
    without a range, and if ipywidgets is missing.
    """
    try:
        import ipywidgets
    except ImportError:
        raise wrong_call(f"sliders need ipywidgets: `{install_command('notebook')}`") from None
    boxes = {name: _range(name, box) for name, box in ranges.items()}
    fixed = given or {}
    _must_cover(function, axes, {*boxes, *fixed})
    moved = {name: ipywidgets.FloatSlider(box[2], min=box[0], max=box[1], step=(box[1] - box[0]) / STEPS,
                                          description=name, continuous_update=False)
             for name, box in boxes.items() if name not in axes}  # fmt: skip
    shown = ipywidgets.HTML()

    def update(_: Any = None) -> None:
        values = {**fixed, **{name: slider.value for name, slider in moved.items()}}
        try:
            shown.value = _shown(function, axes, boxes, values, tuple(moved))
        except PottoError as error:
            shown.value = f"<pre>{html.escape(str(error))}</pre>"

    for slider in moved.values():
        slider.observe(update, "value")
    update()
    return ipywidgets.VBox([*moved.values(), shown])


def _range(name: str, box: Any) -> tuple[float, float, float]:
    try:
        low, high, *start = map(float, box)
    except (TypeError, ValueError):
        raise wrong_call(f"the range of `{name}` is a pair of numbers, such as {name}=(0, 1)") from None
    if not low < high or len(start) > 1:
        raise wrong_call(f"the range of `{name}` is a pair of numbers, the smaller first, and where it starts")
    return low, high, start[0] if start else (low + high) / 2


def _must_cover(function: Function, axes: Sequence[str], named: set[str]) -> None:
    if len(axes) > 2:
        raise wrong_call(f"a picture has one axis or two, not {len(axes)}")
    unknown = [name for name in (*axes, *sorted(named)) if name not in function.parameters]
    if unknown:
        raise wrong_call(f"`{unknown[0]}` is not a parameter; there are {', '.join(function.parameters)}")
    missing = [name for name in function.parameters if name not in named]
    if missing:
        raise wrong_call(f"`{missing[0]}` has no range: add {missing[0]}=(0, 1), or give it a value in `given`")


def _shown(
    function: Function, axes: Sequence[str], boxes: dict[str, Any], values: dict[str, Any], moved: tuple[str, ...]
) -> str:
    if not axes:
        return _numbers(function, values, moved)
    (x0, x1, _), *more = (boxes[name] for name in axes)
    if not more:
        across = [x0 + (x1 - x0) * i / (POINTS - 1) for i in range(POINTS)]
        answer = function(**values, **{axes[0]: across})
        curve = Curve.even([float(value) for value in answer.value], x0, x1)
        return Plot((function.__name__,), (curve,), x0, x1, axes[0]).svg()
    ((y0, y1, _),) = more
    columns = [x0 + (x1 - x0) * (i + 0.5) / PIXELS for i in range(PIXELS)]
    rows = [y1 - (y1 - y0) * (i + 0.5) / PIXELS for i in range(PIXELS)]
    answer = function(**values, **{axes[0]: columns * PIXELS, axes[1]: [y for y in rows for _ in columns]})
    image = image_of([[float(value) for value in answer.value]], PIXELS)
    return replace(image, label=function.__name__, names=(axes[0], axes[1]), box=(x0, x1, y0, y1)).svg()


def _numbers(function: Function, values: dict[str, Any], moved: tuple[str, ...]) -> str:
    if not moved:
        answer = function(**values)
        return rows_html([(function.__name__, answer.value, answer.error)], "", f"{answer.evals:,} evaluations")
    found = grad(function, wrt=list(moved))(**values)
    rows = [(function.__name__, found.value, found.error)]
    slopes = [(found.tangent, found.tangent_error)] if len(moved) == 1 else zip(found.tangent, found.tangent_error)
    rows += [(f"by {name}", slope, error) for name, (slope, error) in zip(moved, slopes)]
    return rows_html(rows, "" if found.converged else "not converged", f"{found.evals:,} evaluations")
