"""Values of expressions over grids of numbers: what pictures are made of.

Owns `curves` and `grid`. An expression is a function of one or two numbers, or names that mean nothing: these are the
axes. A derivative counts with its tangent. Where the program has no value, a picture has a hole.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Sequence
from typing import Any

from msgspec import Struct
from msgspec.structs import asdict, replace

from potto.applications.images import Sampled, flat, largest, sampled
from potto.applications.pictures import Curve
from potto.modules.builtins import is_builtin
from potto.modules.free import free_references
from potto.projects.settings import Settings, settings
from potto.python.arrays import evenly
from potto.python.functions import Function
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.printing import format_error
from potto.syntax import nodes, parse_expression
from potto.types.types import Diffeo, Real, TupleOf, resolve
from potto.types.types import Function as FunctionType
from potto_repl.adaptive import Point, followed
from potto_repl.expressions import Asked, checked, without_parens
from potto_repl.reply import Refusal
from potto_repl.session import Conversation

Pair = tuple[float, float]  # a value and its error
TRIAL = 4  # points of a curve that say how long the others will take, where somebody watches
MOMENT = 0.2  # seconds between two looks at how far it is
BANDS = 16  # of an image, one after the other, where somebody watches
RTOL = 1e-5  # of a picture: finer than any pixel


class Axes(Struct, frozen=True):
    """A function of the axes and of whatever is fixed after them.

    dual: its parameters are duals, and the derivative by the parameter `by` is drawn.
    """

    label: str
    names: tuple[str, ...]
    function: Function
    dual: bool
    by: int = 0
    fixed: tuple[float, ...] = ()


def axes_of(session: Conversation, text: str, count: int, usage: str) -> Axes:
    """An expression as a function of its axes. Raises Refusal, ProgramError."""
    free = free_names(session, text)
    called = [name for name in free if re.search(rf"\b{re.escape(name)}\s*\(", text)]
    if called:
        raise Refusal(f"`{called[0]}` is not defined", f"define it first, such as `def {called[0]}(x) x^2`")
    if free:
        if len(free) != count:
            listed = ", ".join(f"`{name}`" for name in free)
            other = {1: "`:plot` draws over one name", 2: "`:image` draws over two"}.get(len(free))
            help = other or "define the others first, such as `c = 0.5`"
            raise Refusal(f"`{text}` has {len(free)} names that mean nothing: {listed}; {count} can be drawn", help)
        asked = checked(session, f"\\({', '.join(free)}) . ({text})", usage)
    else:
        asked = checked(session, text, usage)
    if not isinstance(asked.type, FunctionType | Diffeo) or len(asked.groups) != 1 or len(asked.groups[0]) != count:
        what = "one number" if count == 1 else f"{count} numbers"
        raise Refusal(f"`{text}` is not a function of {what}", f"write `{usage}`, or leave a name free: `sin(x)`")
    return _axes(session, text, asked)


def derivative_of(session: Conversation, text: str, count: int, by: str, usage: str) -> Axes:
    """The derivative of an expression over axes by one of them, or by a number of the session. Raises Refusal."""
    plain = axes_of(session, text, count, usage)
    names = list(plain.names)
    fixed: tuple[float, ...] = ()
    inside = f"({text})({', '.join(names)})" if not free_names(session, text) else f"({text})"
    if by not in names:
        if session.target(by) is None:
            axes = ", ".join(names)
            raise Refusal(f"`{by}` is neither an axis ({axes}) nor a number of the session", f"write `{usage}`")
        value = session.evaluate(by, session.settings).estimate.value
        if not isinstance(value, float):
            raise Refusal(f"`{by}` is not a number")
        names, fixed = [*names, by], (value,)
    asked = checked(session, f"deriv(\\({', '.join(names)}) . {inside})", usage)
    function = Function(session.world, session.file, asked.expr, asked.type)
    return Axes(f"d/d{by} {text}", plain.names, function, True, names.index(by), fixed)


def _axes(session: Conversation, text: str, asked: Asked) -> Axes:
    types = [resolve(parameter.type) for parameter in asked.groups[0]]
    dual = all(isinstance(type, TupleOf) and type.dual for type in types)
    if not dual and not all(isinstance(type, Real) or not isinstance(type, TupleOf | FunctionType) for type in types):
        raise Refusal(f"the parameters of `{text}` are not all numbers")
    names = tuple(p.name or f"x{i + 1}" for i, p in enumerate(asked.groups[0]))
    names = tuple(name[1:] if dual and name.startswith("d") else name for name in names)
    return Axes(text, names, Function(session.world, session.file, asked.expr, asked.type), dual)


def free_names(session: Conversation, text: str) -> list[str]:
    """The names of an expression that mean nothing, in order."""
    parsed = parse_expression(text)
    if any(d.severity == "error" for d in parsed.diagnostics) or isinstance(without_parens(parsed.expr), nodes.Name):
        return []
    known = session.names()
    found = dict.fromkeys(node.id for node in free_references(parsed.expr) if isinstance(node, nodes.Name))
    return [name for name in found if name not in known and not is_builtin(name) and not name.startswith("_")]


class Spent(Struct):
    """What a picture has cost so far, and its largest error."""

    evaluations: int = 0
    error: float = 0.0

    def take(self, found: Sampled) -> None:
        worst = largest(found.numbers[len(found.numbers) // 2 :])
        self.evaluations, self.error = self.evaluations + found.evaluations, worst if worst > self.error else self.error

    @property
    def told(self) -> str:
        """For a caption: `error at most 2.1e-15, 130 evaluations`."""
        count = f"{self.evaluations:,} evaluation{'' if self.evaluations == 1 else 's'}"
        return f"{f'error at most {format_error(self.error)}' if self.error else 'exact'}, {count}"


def curves(session: Conversation, axes: Axes, lo: float, hi: float, spent: Spent) -> list[Curve]:
    """The components of a function of one number, each as a curve with its errors and jumps."""
    asked = 0

    def evaluate(places: Sequence[float]) -> list[Point]:
        nonlocal asked
        before, asked = asked, asked + len(places)
        found: list[Point] = []
        for start, stop in _portions(len(places), session.progress is not None):
            if session.progress is not None:
                done = before + start
                session.progress(f"{axes.label}: {done} of {asked} points", done / asked, open=True)
            found += zip(*_sampled(session, axes, [_array(places[start:stop])], spent), strict=True)
        return found

    return [replace(curve, slope=axes.dual) for curve in followed(evaluate, lo, hi)]


def _portions(count: int, watched: bool) -> Iterator[tuple[int, int]]:
    """Where to break off: a few points first where somebody watches, then as many as take a moment."""
    start, size = 0, TRIAL if watched else count
    while start < count:
        begun = time.perf_counter()
        stop = min(start + size, count)
        yield start, stop
        spent, start = time.perf_counter() - begun, stop
        size = max(TRIAL, int(size * MOMENT / max(spent, MOMENT / count)))


def grid(
    session: Conversation, axes: Axes, box: tuple[float, float, float, float], columns: int, rows: int, spent: Spent
) -> list[list[float]]:
    """The components of a function of two numbers at the middles of pixels, row by row from the top."""
    x0, x1, y0, y1 = box
    dx, dy = (x1 - x0) / columns, (y1 - y0) / rows
    across = evenly(x0 + dx / 2, x1 - dx / 2, columns)
    down = evenly(y1 - dy / 2, y0 + dy / 2, rows)
    points = [[x for _ in range(rows) for x in across.tolist()], [y for y in down.tolist() for _ in range(columns)]]
    size = max(1, rows // BANDS) * columns if session.progress is not None else rows * columns
    found: list[list[float]] = []
    if session.progress is not None:
        session.progress(f"{axes.label}: {rows * columns} pixels")
    for start in range(0, rows * columns, size):
        stop = min(start + size, rows * columns)
        parts = _sampled(session, axes, [_array(place[start:stop]) for place in points], spent)
        found = found or [[] for _ in parts]
        for pixels, part in zip(found, parts, strict=True):
            pixels += [value for value, _ in part]
        if session.progress is not None:
            session.progress(f"{axes.label}: {stop} of {rows * columns} pixels", stop / (rows * columns))
    return found


def _array(numbers: Sequence[float]) -> Any:
    found = evenly(0, 0, len(numbers))
    found[:] = numbers
    return found


def _sampled(session: Conversation, axes: Axes, places: list[Any], spent: Spent) -> list[list[Pair]]:
    """Per component the values with their errors; nan where there is none."""

    def parts(*here: Any) -> tuple[list[Any], Estimate]:
        found = _call(axes, list(here))
        return _components(found, axes, getattr(here[0], "ndim", 0)), found

    with settings(**_coarse(session.settings)):
        found = sampled(parts, places)
    spent.take(found)
    rows: list[list[float]] = found.numbers.tolist()
    count = len(rows) // 2
    return [list(zip(*pair, strict=True)) for pair in zip(rows[:count], rows[count:], strict=True)]


def _coarse(chosen: Settings) -> dict[str, Any]:
    rough = replace(chosen, rtol=max(chosen.rtol, RTOL), atol=max(chosen.atol, 1e-9))
    return asdict(rough)


def _call(axes: Axes, places: list[Any]) -> Estimate:
    places = [*places, *axes.fixed]
    given = [(place, 1.0 if i == axes.by else 0.0) for i, place in enumerate(places)] if axes.dual else places
    found: Estimate = axes.function(*given)
    return found


def _components(estimate: Estimate, axes: Axes, batch: int) -> list[Any]:
    """The values of all components, then their errors; of a batch of so many axes."""
    drawn, doubt = (estimate.tangent, estimate.tangent_error) if axes.dual else (estimate.value, estimate.error)
    if drawn is None:
        raise Refusal(f"`{axes.label}` gives a function, which cannot be drawn")
    return [*flat(drawn, batch), *flat(doubt, batch)]
