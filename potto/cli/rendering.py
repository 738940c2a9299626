"""What `potto render` draws: a function with its axes, its pixels frame by frame, and the layers that become files."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field
from msgspec.structs import replace

from potto.cli.calling import argument_in, arguments_in, function_in
from potto.cli.console import Console
from potto.cli.evaluation_options import totals

if TYPE_CHECKING:
    from potto.applications.colours import Paint
    from potto.applications.framed import Image
    from potto.applications.images import Grid, Sampled
    from potto.evaluating.world import World
    from potto.projects.settings import Settings
    from potto.python.functions import Function
    from potto.runtime.answers.estimate import Estimate

OUTLINED = 256  # places across and down at which surfaces are looked for
COLOURS = ("r", "g", "b")  # the fields of a record that is a colour, whatever their order


class Picture(Struct):
    """What the command line asks for. over: a parameter with its value in each frame. drawable: whether one or three
    numbers a pixel are wanted, since they become colours."""

    function: Function
    given: dict[str, Any]
    axes: tuple[str, ...]
    wrt: tuple[str, ...]
    over: tuple[str, Sequence[float]] | None = None
    drawable: bool = True
    width: int = 0  # parts of the value

    def call(self, *places: Any) -> tuple[Sequence[Any], Estimate]:
        """The value, the derivatives and the errors at places, as parts one after the other."""
        from potto.python.gradients import grad
        from potto.python.tiles import Interrupted

        here = {**self.given, **dict(zip(self.axes, places, strict=True))}
        try:
            answer = (grad(self.function, self.wrt) if self.wrt else self.function)(**here)
        except Interrupted as stop:
            answer = stop.estimate
        batch = getattr(places[0], "ndim", 0)
        value, error = self._parts(answer.value, batch), self._parts(answer.error, batch)
        self._must_be_drawable(len(value))
        several = len(self.wrt) > 1
        slopes = [p for part in _each(answer.tangent, several) for p in self._parts(part, batch)] if self.wrt else []
        doubts = [p for part in _each(answer.tangent_error, several) for p in self._parts(part, batch)]
        return [*value, *slopes, *error, *(doubts if self.wrt else ())], answer

    def _parts(self, value: Any, batch: int) -> list[Any]:
        from potto.applications.images import flat
        from potto.types.types import TupleOf, resolve, result_of

        found = flat(value, batch)
        result = resolve(result_of(self.function._type))
        record = result.record if isinstance(result, TupleOf) else None
        if record is not None and len(found) == 3 and sorted(record.fields) == sorted(COLOURS):
            return [found[record.fields.index(name)] for name in COLOURS]
        return found

    def _must_be_drawable(self, width: int) -> None:
        from potto.kernels.errors import wrong_call

        self.width = width
        if self.drawable and width not in (1, 3):
            raise wrong_call(
                f"a picture shows one number a pixel, or three as red, green and blue, and this function gives {width}",
                "draw a part of it, `\\(x, y) . f(x, y).0`, or write all numbers to a .npy or .exr file",
            )


def _each(tangent: Any, several: bool) -> Sequence[Any]:
    return tangent if several else (tangent,)


def picture_of(world: World, file: str, options: argparse.Namespace, drawable: bool) -> Picture:
    """What the command line asks for. Raises PottoError."""
    from potto.kernels.errors import wrong_call

    function = function_in(world, file, options.name)
    given = arguments_in(world, file, options.given)
    over = _frames(world, file, function, options)
    fixed = {*given, *([over[0]] if over is not None else [])}
    names = tuple(n for n in function.parameters if n not in fixed)
    axes = names if options.axes is None else tuple(n.strip() for n in options.axes.split(","))
    for name in axes:
        if name and name not in function.parameters:
            raise wrong_call(f"`{options.name}` has no parameter `{name}` to be an axis", _listed(function))
        if name in fixed:
            how = "is given a value" if name in given else "moves"
            raise wrong_call(f"`{name}` {how} and is an axis, too", f"leave out `{name}=…`, or name another axis")
    if len(axes) == 2 and axes[0] == axes[1]:
        raise wrong_call(f"both axes are `{axes[0]}`", "name two parameters, `--axes x,y`")
    if len(axes) != 2 or not all(axes):
        many = len(names) > 2
        what = "give the others a value, `c=0.5`, until two are left" if many else "name a function of two numbers"
        left = ", ".join(f"`{n}`" for n in names) or "none"
        raise wrong_call(
            f"an image has two axes, and the parameters of `{options.name}` that are given nothing are: {left}",
            what,
        )
    wrt = dict.fromkeys(name for names in options.wrt for name in names)
    return Picture(function, given, axes, tuple(wrt), over, drawable)


def _listed(function: Function) -> str:
    return f"its parameters are {', '.join(f'`{name}`' for name in function.parameters)}"


def _frames(
    world: World, file: str, function: Function, options: argparse.Namespace
) -> tuple[str, Sequence[float]] | None:
    """The parameter that moves from frame to frame, and its values. Raises PottoError."""
    from potto.kernels.errors import wrong_call
    from potto.python.arrays import evenly

    if options.over is None:
        return None
    name, low, high = options.over
    if name not in function.parameters:
        raise wrong_call(f"`{options.name}` has no parameter `{name}` to move", _listed(function))
    if any(name == known for known, _ in options.given):
        raise wrong_call(f"`{name}` is given a value and moves, too", f"leave out `{name}=…` or `--over {name}=…`")
    ends = [argument_in(world, file, text) for text in (low, high)]
    if not all(isinstance(end, float) for end in ends):
        raise wrong_call(f"`{name}` moves from one number to another", "write `--over c=-2..0`")
    return name, evenly(ends[0], ends[1], options.frames).tolist()


class Drawn(Struct):
    """All frames, (parts, n) each: values and derivatives, the errors if they are wanted, and how it went."""

    frames: list[Any] = field(default_factory=list)
    errors: list[Any] = field(default_factory=list)
    found: list[Sampled] = field(default_factory=list)
    largest: float = float("nan")
    seconds: float = 0.0
    interrupted: bool = False
    rough: dict[str, None] = field(default_factory=dict)  # why numbers are not as accurate as was asked

    @property
    def answers(self) -> list[Estimate]:
        return [answer for found in self.found for answer in found.answers]

    @property
    def evaluations(self) -> int:
        return sum(found.evaluations for found in self.found)

    @property
    def holes(self) -> int:
        return sum(found.holes for found in self.found)

    @property
    def reasons(self) -> list[str]:
        """Why numbers are not as accurate as was asked; that somebody did not want to wait is none."""
        from potto.runtime.answers.batches import INTERRUPTED

        return [reason for reason in self.rough if reason != INTERRUPTED.message]

    @property
    def unknown(self) -> int:
        """How many pixels of the last frame have no value."""
        return sum(1 for number in self.frames[-1][0].tolist() if number != number)

    @property
    def crossed(self) -> tuple[int, int] | None:
        """How many integrals a surface may cross, of how many; None where nobody looked."""
        stats = totals(self.answers)
        looked = stats.get("members looked at", 0)
        return (looked - stats["members that no surface crosses"], looked) if looked else None

    def cost(self, grid: Grid) -> str:
        """What the pixels took, and how far they may be off."""
        from potto.runtime.answers.printing import format_error

        each = self.evaluations / (grid.width * grid.height * len(self.frames))
        return f"{each:.1f} evaluations a pixel, largest error {format_error(self.largest)}"

    def take(self, found: Sampled, keep_errors: bool, picture: Picture, chosen: Settings) -> None:
        """One more frame. Colours are accurate relative to the largest value of an image, numbers each to itself."""
        from potto.applications.images import accurate, largest

        half = len(found.numbers) // 2
        errors = found.numbers[half:]
        images = zip(_images(found.numbers[:half], picture.width), _images(errors, picture.width), strict=True)
        if not picture.drawable or not all(accurate(*image, chosen.rtol, chosen.atol) for image in images):
            self.rough.update(dict.fromkeys(found.reasons))
        self.frames.append(found.numbers[:half].copy())
        if keep_errors:
            self.errors.append(errors.copy())
        here = largest(errors)
        self.largest = here if not self.largest >= here else self.largest
        found.numbers = errors[:0]
        self.found.append(found)


def _images(parts: Any, width: int) -> list[Any]:
    """The parts of the value, then those of each derivative."""
    return [parts[first : first + width] for first in range(0, len(parts), width)]


def drawn(
    picture: Picture, grid: Grid, chosen: Settings, options: argparse.Namespace, console: Console
) -> Drawn:  # fmt: skip
    """All pixels of all frames, with progress for a person who waits. Raises PottoError."""
    from msgspec.structs import asdict

    from potto.applications.images import sampled
    from potto.projects.settings import settings
    from potto.python.workers import Workers

    values = (0.0,) if picture.over is None else picture.over[1]
    progress = _Progress(console, grid.width * grid.height, len(values))
    found = Drawn()
    with Workers(options.workers) as pool, settings(**asdict(chosen), executor=pool):
        for number, value in enumerate(values):
            if picture.over is not None:
                picture.given[picture.over[0]] = value
            progress.frame = number
            try:
                found.take(sampled(picture.call, grid.middles(), progress), options.error, picture, chosen)
            except KeyboardInterrupt:
                if not found.frames:
                    raise
                found.interrupted = True
            found.interrupted = found.interrupted or found.found[-1].interrupted
            if found.interrupted:  # what is done is kept
                break
    console.progress("")
    found.seconds = time.perf_counter() - progress.start
    return found


class _Progress:
    """How far all frames are, and how long the rest will take."""

    def __init__(self, console: Console, pixels: int, frames: int) -> None:
        self.console, self.pixels, self.frames = console, pixels, frames
        self.frame, self.start = 0, time.perf_counter()

    def __call__(self, done: int) -> None:
        from potto.evaluating.progress import duration

        total, done = self.pixels * self.frames, done + self.pixels * self.frame
        left = (time.perf_counter() - self.start) * (total - done) / max(done, 1)
        rest = f", {duration(left)} left" if 0 < done < total and left >= 1 else ""
        of = f"frame {self.frame + 1} of {self.frames}, " if self.frames > 1 else ""
        self.console.progress(f"{of}{100 * done // total} % of {total:,} pixels{rest}")


class Layer(Struct):
    """One file: what it shows, its parts in every frame, and how they become colours; None for an error map."""

    path: str
    shows: str
    frames: list[Any]
    paint: Paint | None
    low: float
    high: float

    @property
    def vanishes(self) -> bool:
        """Whether all that is known of it is 0."""
        from potto.applications.colours import limits

        return all(limits(parts) == (0.0, 0.0) for parts in self.frames)

    def colours(self, frame: int = 0) -> Any:
        """The bytes (n, 3) of a frame."""
        from potto.applications.colours import decades

        parts = self.frames[frame]
        return decades(parts) if self.paint is None else self.paint.colours(parts)


def layers(picture: Picture, found: Drawn, options: argparse.Namespace, target: str) -> list[Layer]:
    """The files: value, derivatives, errors."""
    from potto.applications.colours import Paint, limits, usual

    stem, ending = os.path.splitext(target)
    width = picture.width

    def part(first: int) -> list[Any]:
        return [frame[first : first + width] for frame in found.frames]

    def ends(frames: list[Any], even: bool) -> tuple[float, float]:
        each = [usual(frame, even=even) for frame in frames]
        return min(low for low, _ in each), max(high for _, high in each)

    low, high = options.range or ends(part(0), False)
    layers = [Layer(target, "value", part(0), Paint(low, high, options.map, options.tone[0]), low, high)]
    for number, name in enumerate(picture.wrt):
        here = part(width * (1 + number))
        low, high = ends(here, True)
        paint = Paint(low, high, options.diverging, options.tone[1], even=True)
        layers.append(Layer(f"{stem}-d{name}{ending}", f"derivative by {name}", here, paint, low, high))
    if options.error:
        most = max(limits(errors)[1] for errors in found.errors)
        layers.append(Layer(f"{stem}-error{ending}", "error", found.errors, None, 0.0, most))
    return layers


Lines = tuple[tuple[tuple[float, float], tuple[float, float]], ...]


def save_figure(path: str, files: list[Layer], picture: Picture, grid: Grid, caption: str, lines: Lines = ()) -> None:
    """One figure of all layers, each with its axes and its scale. Raises OSError."""
    from potto.applications import figures

    figures.save(path, images(files, picture, grid, caption, lines), caption=caption)
    for layer in files:
        layer.path = path


def outlines(world: World, file: str, picture: Picture, grid: Grid) -> Lines:
    """Where the surfaces of the function are seen in its image, as far as that can be told by symbols."""
    from potto.applications.contours import zero_lines
    from potto.applications.images import Grid, flat, sampled
    from potto.checking.outlines import outlines as functions
    from potto.cli.calling import function_in
    from potto.diagnostics import PottoError

    fine = Grid(OUTLINED, OUTLINED, grid.box)
    xs, ys = fine.sides()
    found: list[Any] = []
    for text in functions(world.db, file, picture.function._expr, picture.axes):
        try:
            surface = function_in(world, file, text)

            def call(*places: Any, surface: Function = surface) -> tuple[Sequence[Any], Estimate]:
                here = {**picture.given, **dict(zip(picture.axes, places, strict=True))}
                answer = surface(**{name: here[name] for name in surface.parameters})
                return flat(answer.value, getattr(places[0], "ndim", 0)), answer

            numbers = sampled(call, fine.middles()).numbers
        except PottoError:  # it has no values here, or cannot be said again
            continue
        found += zero_lines(numbers[0].reshape(OUTLINED, OUTLINED), xs, ys).tolist()
    return tuple(((a, b), (c, d)) for (a, b), (c, d) in found)


def images(
    files: list[Layer], picture: Picture, grid: Grid, caption: str, lines: Lines = ()
) -> list[Image]:  # fmt: skip
    """Layers as what figures are made of."""
    return [replace(_image(layer, picture, grid, caption), outlines=lines) for layer in files]


def _image(layer: Layer, picture: Picture, grid: Grid, caption: str) -> Image:
    from potto.applications.colours import DECADES
    from potto.applications.framed import Image
    from potto.applications.picture_files import pixels

    first, second = picture.axes
    name = picture.function.written
    what, by, parameter = layer.shows.partition(" by ")
    label = name if what == "value" else f"{what} of {name}{by}{parameter}"
    paint = layer.paint
    if paint is None:
        label += f", from black at 1e-{DECADES} to white at 1"
    rows = tuple(tuple(map(tuple, row)) for row in pixels(layer.colours(), grid).tolist())
    bare = paint is None or picture.width >= 3
    return Image(
        rows, layer.low, layer.high, paint is not None and paint.even and not bare, label, (first, second), grid.box,
        "" if bare or paint is None else paint.map, "linear" if paint is None else paint.tone, (layer.low, layer.high),
        caption,
    )  # fmt: skip
