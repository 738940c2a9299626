"""`:plot` and `:image`: pictures of functions and of their derivatives."""

from __future__ import annotations

import math
import re

from msgspec.structs import replace

from potto.applications.framed import image_of
from potto.applications.pictures import Curve, Plot
from potto.runtime.answers.printing import format_digits, format_error, format_range
from potto_repl.drawing import braille, half_blocks, room_for_curves
from potto_repl.expressions import split_items
from potto_repl.registry import command
from potto_repl.reply import Part, Refusal
from potto_repl.sampled import Spent, axes_of, curves, derivative_of, grid
from potto_repl.session import Conversation, plain_names

MOST_JUMPS = 6  # that a caption names
MOST_PIXELS = 256
_NUMBER = r"[-+]?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|pi)"
_RANGE = re.compile(rf"^(?P<what>.*?[\w)\]])\s+(?P<lo>{_NUMBER})\s+(?P<hi>{_NUMBER})$", re.DOTALL)
_PIXELS = re.compile(rf"^(?P<what>.*?[\w)\]])(?P<numbers>(?:\s+{_NUMBER})+)$", re.DOTALL)


@command("plot", "p", argument="EXPR[, EXPR…] [LO HI]", completes="expression")
def plot(session: Conversation, text: str) -> Part:
    """Draw functions of one number, by default from 0 to 1: `:plot f, deriv f 0 2`.

    An expression with one free name is drawn over that name: `:plot sin(x)/x -6 6`. Of a derivative the tangent is
    drawn. `:save plot.svg` (or `.png`) writes the last picture to a file.
    """
    what, lo, hi = _range(plain_names(text))
    if not what:
        raise Refusal("there is nothing to draw", "write `:plot f 0 1` or `:plot f, deriv f`")
    labels: list[str] = []
    drawn: list[Curve] = []
    axis, spent = "x", Spent()
    for item in split_items(what):
        axes = axes_of(session, item, 1, ":plot f 0 1")
        axis = axes.names[0]
        parts = curves(session, axes, lo, hi, spent)
        for number, part in enumerate(parts):
            labels.append(item if len(parts) == 1 else f"{item} [{number + 1}]")
            drawn.append(part)
    picture = Plot(tuple(labels), tuple(drawn), lo, hi, axis, spent.told)
    session.last_picture = picture
    width = room_for_curves(session.width())
    low, high = picture.span
    jumps = [{"of": label, "at": x, "before": a, "after": b}
             for label, curve in zip(labels, drawn, strict=True) for x, a, b in curve.jumps]  # fmt: skip
    said = _caption(picture)
    data = {"plot": labels, "from": lo, "to": hi, "low": low, "high": high, "jumps": jumps,
            "error": max((curve.error for curve in drawn), default=0.0), "points": sum(len(c.xs) for c in drawn),
            "_picture": picture, "_scale": said}  # fmt: skip
    return Part("picture", f"{braille(picture, width, unicode=session.options.unicode)}\n{said}", data)


def _caption(plot: Plot) -> str:
    """Where the curves jump, what is cut off, how far they may be off."""
    several = len(plot.curves) > 1
    low, high = plot.span
    said: list[str] = []
    for label, curve in zip(plot.labels, plot.curves, strict=True):
        of = f" of {label}" if several else ""
        seen = [jump for jump in curve.jumps if low <= min(jump[1:]) and max(jump[1:]) <= high]
        places = ", ".join(f"{format_digits(x, 4)} ({format_range(a, b, 4)})" for x, a, b in seen[:MOST_JUMPS])
        if places:
            said.append(f"jumps{of} at {plot.axis} = {places}{', ...' if len(seen) > MOST_JUMPS else ''}")
        if any(math.isfinite(y) and not low <= y <= high for y in curve.ys):
            said.append(f"what lies beyond is cut off{of}")
    worst = max((curve.error for curve in plot.curves), default=0.0)
    points = sum(len(curve.xs) for curve in plot.curves)
    return "\n".join([*said, f"{points} points, {f'error at most {format_error(worst)}' if worst else 'exact'}"])


def _range(text: str) -> tuple[str, float, float]:
    """What to draw and between which numbers. `f -1 1` is a function and a range, `x - 1` is neither."""
    text = text.strip()
    named = re.match(rf"^(.*?)\s+(?:from|over)\s+({_NUMBER})\s+(?:to\s+)?({_NUMBER})$", text, re.DOTALL)
    found = named or _RANGE.match(text)
    if found is None:
        return text, 0.0, 1.0
    what, low, high = found.groups()
    lo, hi = number(low), number(high)
    if not lo < hi:
        raise Refusal(f"the range from {low} to {high} is empty")
    return what.strip(), lo, hi


def number(text: str) -> float:
    """A number of a range."""
    from math import pi

    sign = -1.0 if text.startswith("-") else 1.0
    bare = text.lstrip("+-")
    return sign * (pi if bare == "pi" else float(bare))


@command("image", "i", argument="EXPR [by NAME] [N] [X0 X1 Y0 Y1]", completes="expression")
def image(session: Conversation, text: str) -> Part:
    """Draw a function of two numbers as an image over the unit square: `:image f`, `:image f 64 -1 1 -1 1`.

    N is the number of pixels in each direction. A tuple of three is a colour. Free names are the axes, in their order.
    `by NAME` draws the derivative by an axis or by a number of the session: `c = 0.4`, then `:image g(x, y, c) by c`.
    """
    text = plain_names(text).strip()
    found = _PIXELS.match(text)
    what, numbers = (found["what"], found["numbers"].split()) if found else (text, [])
    if not what:
        raise Refusal("there is nothing to draw", "write `:image f`")
    pixels = number(numbers.pop(0)) if len(numbers) in (1, 5) else 32.0
    if not (pixels == int(pixels) and 2 <= pixels <= MOST_PIXELS):
        raise Refusal(f"an image has from 2 to {MOST_PIXELS} pixels in each direction, not {pixels:g}")
    if len(numbers) not in (0, 4):
        raise Refusal("a box is four numbers, X0 X1 Y0 Y1", "write `:image f 64 -1 1 -1 1`")
    x0, x1, y0, y1 = map(number, numbers) if numbers else (0.0, 1.0, 0.0, 1.0)
    named = re.match(r"(.*?)\s+by\s+([^\W\d]\w*)$", what.strip(), re.DOTALL)
    if named is None:
        axes = axes_of(session, what.strip(), 2, ":image f")
    else:
        axes = derivative_of(session, named[1], 2, named[2], ":image f by NAME")
    count = int(pixels)
    box, spent = (x0, x1, y0, y1), Spent()
    picture = image_of(grid(session, axes, box, count, count, spent), count, signed=axes.dual)
    first, second = axes.names
    picture = replace(picture, label=axes.label, names=(first, second), box=box, caption=spent.told)
    session.last_picture = picture
    shown = half_blocks(picture, unicode=session.options.unicode, color=False)
    dark, light = ("blue below 0", "red above") if picture.signed else ("dark", "light")
    low, high = format_digits(picture.low, 4), format_digits(picture.high, 4)
    scale = f"{axes.label}: {low} ({dark}) to {high} ({light})"
    data = {"image": axes.label, "pixels": count, "low": picture.low, "high": picture.high, "_picture": picture,
            "_scale": scale}  # fmt: skip
    return Part("picture", f"{shown}\n{scale}", data)
