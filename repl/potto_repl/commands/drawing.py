"""`:plot` and `:image`: pictures of functions and of their derivatives."""

from __future__ import annotations

import re

from potto_repl.drawing import braille, half_blocks
from potto_repl.expressions import split_items
from potto_repl.pictures import Plot, image_of
from potto_repl.registry import command
from potto_repl.reply import Part, Refusal
from potto_repl.sampled import axes_of, curve, grid
from potto_repl.session import Conversation, plain_names

POINTS = 401
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
    curves: list[tuple[float, ...]] = []
    axis = "x"
    for item in split_items(what):
        axes = axes_of(session, item, 1, ":plot f 0 1")
        axis = axes.names[0]
        parts = curve(session, axes, lo, hi, POINTS)
        for number, part in enumerate(parts):
            labels.append(item if len(parts) == 1 else f"{item} [{number + 1}]")
            curves.append(tuple(part))
    picture = Plot(tuple(labels), tuple(curves), lo, hi, axis)
    session.last_picture = picture
    width = max(20, min(session.width() - 14, 72))
    low, high = picture.span
    data = {"plot": labels, "from": lo, "to": hi, "low": low, "high": high, "_picture": picture}
    return Part("picture", braille(picture, width, unicode=session.options.unicode), data)


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


@command("image", "i", argument="EXPR [N] [X0 X1 Y0 Y1]", completes="expression")
def image(session: Conversation, text: str) -> Part:
    """Draw a function of two numbers as an image over the unit square: `:image f`, `:image f 64 -1 1 -1 1`.

    N is the number of pixels in each direction. A tuple of three is a colour. Free names are the axes, in their
    order; of a derivative the tangent by the first number is drawn.
    """
    text = plain_names(text).strip()
    found = _PIXELS.match(text)
    what, numbers = (found["what"], found["numbers"].split()) if found else (text, [])
    if not what:
        raise Refusal("there is nothing to draw", "write `:image f`")
    pixels = max(2, min(int(number(numbers.pop(0))), MOST_PIXELS)) if len(numbers) in (1, 5) else 32
    if len(numbers) not in (0, 4):
        raise Refusal("a box is four numbers, X0 X1 Y0 Y1", "write `:image f 64 -1 1 -1 1`")
    x0, x1, y0, y1 = map(number, numbers) if numbers else (0.0, 1.0, 0.0, 1.0)
    axes = axes_of(session, what.strip(), 2, ":image f")
    picture = image_of(grid(session, axes, (x0, x1, y0, y1), pixels, pixels), pixels)
    session.last_picture = picture
    shown = half_blocks(picture, unicode=session.options.unicode, color=False)
    scale = f"{what.strip()}: {picture.low:.4g} (dark) to {picture.high:.4g} (light)"
    data = {"image": what.strip(), "pixels": pixels, "low": picture.low, "high": picture.high, "_picture": picture,
            "_scale": scale}  # fmt: skip
    return Part("picture", f"{shown}\n{scale}", data)
