"""Curves and images as figures that can be printed, by matplotlib: axes, labels, legends, colour bars, captions.

Owns `save` and `complaint`, and is the only code beside the bench's that knows matplotlib, which is imported when a
figure is asked for. Values and derivatives stand beside each other, each with a scale of its own.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

from potto.applications.framed import OUTLINE, Image, images_svg
from potto.applications.picture_files import complaint as plain_complaint
from potto.applications.picture_files import ending_of
from potto.applications.pictures import Curve, Plot
from potto.runtime.answers.printing import format_digits

_LIBRARY = ("matplotlib", "matplotlib", "plots")
NEEDS: dict[str, tuple[str, str, str] | None] = {
    ".svg": None, ".png": _LIBRARY, ".jpg": _LIBRARY, ".jpeg": _LIBRARY, ".pdf": _LIBRARY,
}  # fmt: skip
COLORS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e")
DARK_COLORS = ("#6fb1e8", "#ff7b72", "#7ee787", "#d2a8ff", "#ffa657")  # the same on a dark ground
PAPER, INK, FAINT, NOTE = "#ffffff", "#1a1a1a", "#b0b0b0", "#555555"
DARK_PAPER, DARK_INK, DARK_FAINT, DARK_NOTE = "#0d1117", "#e6edf3", "#6e7681", "#9da7b3"
WIDTH, HEIGHT = 4.6, 3.7  # of one panel, in inches
SEEN = 1e-3  # of the height: the smallest error whose band can be seen


def has_matplotlib() -> bool:
    return find_spec("matplotlib") is not None


def complaint(path: str) -> str | None:
    """Why a figure can't be written, for a person; None if it seems that it can."""
    said = plain_complaint(path, NEEDS)
    missing = said is not None and "matplotlib" in said
    return f"{said}; a figure that ends with .svg does without" if missing else said


def save(path: str, pictures: Sequence[Plot | Image], *, caption: str = "", dark: bool = False) -> None:
    """Write a figure of pictures beside each other; its ending says the format. An SVG is ours, and holds one plot.

    Raises OSError.
    """
    if ending_of(path) == ".svg":
        images = [picture for picture in pictures if isinstance(picture, Image)]
        with open(path, "w", encoding="utf-8") as stream:
            stream.write(images_svg(images) if images else pictures[0].svg())
        return
    _written(path, pictures, caption, dark, ending_of(path).lstrip("."))


def _written(target: Any, pictures: Sequence[Plot | Image], caption: str, dark: bool, kind: str) -> None:
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with rc_context(_style(dark)):
        panels = [panel for picture in pictures for panel in _panels(picture)]
        figure = Figure(figsize=(WIDTH * len(panels), HEIGHT), layout="constrained", dpi=144)
        FigureCanvasAgg(figure)
        for number, panel in enumerate(panels):
            axes = figure.add_subplot(1, len(panels), number + 1)
            if isinstance(panel, Plot):
                _draw_plot(axes, panel, DARK_COLORS if dark else COLORS)
            else:
                _draw_image(figure, axes, panel)
        said = caption or next((p.caption for p in pictures if p.caption), "")
        if said:
            figure.supxlabel(said, fontsize=9, color=DARK_NOTE if dark else NOTE, x=0.01, ha="left")
        figure.savefig(target, format=kind)


def figure(picture: Plot | Image, ending: str) -> bytes:
    """The bytes of a picture as a figure, `.png` or whatever else matplotlib writes."""
    stream = io.BytesIO()
    _written(stream, [picture], "", False, ending.lstrip("."))
    return stream.getvalue()


def _style(dark: bool) -> dict[str, Any]:
    paper, ink, faint = (DARK_PAPER, DARK_INK, DARK_FAINT) if dark else (PAPER, INK, FAINT)
    return {
        "font.size": 10, "axes.titlesize": 11, "axes.labelsize": 10, "figure.facecolor": paper, "axes.facecolor": paper,
        "savefig.facecolor": paper, "text.color": ink, "axes.labelcolor": ink, "axes.edgecolor": faint,
        "xtick.color": ink, "ytick.color": ink, "legend.framealpha": 0.8, "legend.facecolor": paper,
        "legend.edgecolor": faint, "axes.spines.top": False, "axes.spines.right": False, "grid.color": faint,
        "grid.alpha": 0.35, "svg.hashsalt": "potto", "axes.unicode_minus": True,
    }  # fmt: skip


def _panels(picture: Plot | Image) -> list[Plot | Image]:
    """A plot as one panel of values and one of derivatives, as far as it has both."""
    if isinstance(picture, Image):
        return [picture]
    found: list[Plot | Image] = []
    for slope in (False, True):
        here = [(name, c) for name, c in zip(picture.labels, picture.curves, strict=True) if c.slope == slope]
        if here:
            labels, curves = zip(*here, strict=True)
            found.append(Plot(labels, curves, picture.lo, picture.hi, picture.axis, picture.caption, picture.marks))
    return found or [picture]


def _draw_plot(axes: Any, plot: Plot, colors: Sequence[str]) -> None:
    low, high = plot.span
    pad = 0.05 * (high - low)
    for number, (label, curve) in enumerate(zip(plot.labels, plot.curves, strict=True)):
        color = colors[number % len(colors)]
        _draw_curve(axes, curve, label, color, high - low, "o" if plot.marks else "")
        for x, a, b in curve.jumps:
            axes.plot([x, x], [a, b], color=color, lw=1, ls=":", scalex=False, scaley=False)
    beside = 0.02 * (plot.hi - plot.lo) if plot.marks else 0.0
    axes.set_xlim(plot.lo - beside, plot.hi + beside)
    axes.set_ylim(low - pad, high + pad)
    axes.set_xlabel(plot.axis)
    axes.grid(True)
    if len(plot.curves) > 1 or any(curve.error > SEEN * (high - low) for curve in plot.curves):
        axes.legend(fontsize=9)
    if len(plot.curves) == 1:
        axes.set_title(plot.labels[0])


def _draw_curve(axes: Any, curve: Curve, label: str, color: str, height: float, mark: str) -> None:
    """The pieces of a curve, and between which heights it may lie, where that can be seen."""
    for number, piece in enumerate(curve.pieces()):
        xs = [curve.xs[i] for i in piece]
        ys = [curve.ys[i] for i in piece]
        name = label if number == 0 else "_"
        axes.plot(xs, ys, color=color, lw=1.8, label=name, marker=mark or ("." if len(xs) == 1 else ""), ms=4)
        if curve.errors and curve.error > SEEN * height:
            off = [e if math.isfinite(e) else 0.0 for e in (curve.errors[i] for i in piece)]
            below, above = ([y + sign * e for y, e in zip(ys, off, strict=True)] for sign in (-1, 1))
            axes.fill_between(xs, below, above, color=color, alpha=0.25, lw=0, label="error" if number == 0 else "_")


def _draw_image(figure: Any, axes: Any, image: Image) -> None:
    import numpy as np

    axes.imshow(np.array(image.pixels, dtype=np.uint8), extent=image.box, interpolation="nearest", aspect="equal")
    if image.outlines:
        from matplotlib.collections import LineCollection

        axes.add_collection(LineCollection(image.outlines, colors=OUTLINE, linewidths=1.0), autolim=False)
    for side in ("top", "right"):
        axes.spines[side].set_visible(True)
    axes.set_title(image.label)
    axes.set_xlabel(image.names[0])
    axes.set_ylabel(image.names[1], rotation=0, labelpad=12)
    if image.map:
        _draw_bar(figure, axes, image)


def _draw_bar(figure: Any, axes: Any, image: Image) -> None:
    """The numbers that colours stand for; with a tone they stand at other distances."""
    import numpy as np
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize
    from matplotlib.ticker import MaxNLocator

    from potto.applications.colours import Paint

    paint = Paint(*image.ends, image.map, image.tone, image.signed)
    shades = ListedColormap(paint.along(np.linspace(0.0, 1.0, 256)).T)
    bar = figure.colorbar(ScalarMappable(Normalize(0.0, 1.0), shades), ax=axes, shrink=0.9, aspect=24)
    if image.tone == "linear":
        numbers = np.asarray(MaxNLocator(6).tick_values(*image.ends), dtype=float)
    else:
        numbers = np.array([paint.number(level) for level in np.linspace(0.0, 1.0, 7).tolist()])
    numbers = numbers[(numbers >= image.ends[0]) & (numbers <= image.ends[1])]
    bar.set_ticks(paint.level(numbers).tolist(), labels=[_tick(number, image) for number in numbers.tolist()])
    bar.outline.set_visible(False)


def _tick(number: float, image: Image) -> str:
    """A number of a scale in few digits; what is nothing beside the others is 0."""
    most = max(map(abs, image.ends))
    return format_digits(0.0 if abs(number) < 1e-9 * most else number, 3).replace("-", "−")
