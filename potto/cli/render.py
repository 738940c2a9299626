"""`potto render`: an image of a function, and of its derivatives."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from potto.cli.calling import add_set, arguments_in, assignment, function_in
from potto.cli.console import Console
from potto.cli.numbers import accounts, add_options, add_workers, settings_of, show_stats

if TYPE_CHECKING:
    from potto.applications.images import Grid, Sampled
    from potto.evaluating.world import World
    from potto.projects.settings import Settings
    from potto.python.functions import Function
    from potto.runtime.answers.estimate import Estimate

SUMMARY = "draw a function of two numbers as an image, and its derivatives"
EXAMPLE = "  potto render examples/worked/picture.po pixel r=0.7 --wrt r --size 512x512 -o disc.png"
MOST_PIXELS = 1 << 26


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="the program; `-` reads it from standard input")
    parser.add_argument("name", metavar="NAME", help="the function: a name, or an expression that is a function")
    parser.add_argument("given", metavar="NAME=EXPR", nargs="*", type=assignment, help="what parameters are given")
    parser.add_argument("-o", "--output", metavar="FILE", help="the image, .png or .npy (default: NAME.png)")
    parser.add_argument("--size", metavar="WxH", type=_size, default=(256, 256), help="pixels (default 256x256)")
    parser.add_argument("--box", metavar="X0,X1,Y0,Y1", type=_box, default=(0.0, 1.0, 0.0, 1.0),
                        help="what of the plane is seen (default 0,1,0,1)")  # fmt: skip
    parser.add_argument("--axes", metavar="X,Y", help="the parameters that are the axes (default: the two not given)")
    parser.add_argument("--wrt", metavar="NAME", action="append", default=[], help="draw also the derivative by this")
    parser.add_argument("--range", metavar="LO,HI", type=_range, help="what is black and what is white")
    parser.add_argument("--error", action="store_true", help="draw also the estimated error, by powers of ten")
    add_workers(parser)
    add_set(parser)
    add_options(parser)


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdecimal() and (height or width).isdecimal()) or int(width) * int(height or width) == 0:
        raise argparse.ArgumentTypeError(f"{text!r} is no size; write `256x256`")
    if int(width) * int(height or width) > MOST_PIXELS:
        raise argparse.ArgumentTypeError(f"{text!r} is more than {MOST_PIXELS:,} pixels")
    return int(width), int(height or width)


def _numbers(text: str, count: int, form: str) -> tuple[float, ...]:
    try:
        found = tuple(map(float, text.replace(",", " ").split()))
    except ValueError:
        found = ()
    pairs = list(zip(found[::2], found[1::2], strict=False))
    if len(found) != count or not all(-float("inf") < a < b < float("inf") for a, b in pairs):
        raise argparse.ArgumentTypeError(f"{text!r} is not {form}, from less to more")
    return found


def _box(text: str) -> tuple[float, ...]:
    return _numbers(text, 4, "X0,X1,Y0,Y1")


def _range(text: str) -> tuple[float, ...]:
    return _numbers(text, 2, "LO,HI")


def prepare(arguments: list[str]) -> list[str]:
    """Let a box begin with a minus: `--box -1,1,-1,1` as `--box=-1,1,-1,1`."""
    joined: list[str] = []
    for word in arguments:
        if joined and joined[-1] in ("--box", "--range"):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


class Picture(Struct):
    """What was drawn: the numbers of the value, of each derivative and of the errors, and the files."""

    function: Function
    given: dict[str, Any]
    axes: tuple[str, ...]
    wrt: tuple[str, ...]
    width: int = 0  # parts of the value
    files: list[dict[str, Any]] = []

    def call(self, *places: Any) -> tuple[Sequence[Any], Estimate]:
        """The value, the derivatives and the errors at places, as parts one after the other."""
        from potto.applications.images import flat
        from potto.python.gradients import grad
        from potto.python.tiles import Interrupted

        here = {**self.given, **dict(zip(self.axes, places, strict=True))}
        try:
            answer = (grad(self.function, self.wrt) if self.wrt else self.function)(**here)
        except Interrupted as stop:
            answer = stop.estimate
        value, error = flat(answer.value), flat(answer.error)
        self.width = len(value)
        tangents, errors = (answer.tangent, answer.tangent_error) if self.wrt else ((), ())
        return [*value, *flat(tangents), *error, *flat(errors)], answer


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.cli.opening import fail, opened, report_others

    settings = settings_of(options, console)
    if settings is None:
        return 2
    from potto.applications.images import Grid
    from potto.diagnostics import PottoError
    from potto.evaluating.world import World

    world = World(["."])
    grid = Grid(options.size[0], options.size[1], options.box)
    start = time.perf_counter()
    try:
        file = opened(world, options.file, options.set)
        picture = _picture(world, file, options)
        with accounts(options):
            found = _sampled(picture, grid, settings, options.workers, console)
    except PottoError as error:
        console.progress("")
        return fail(error, options, console)
    try:
        _write(picture, found, grid, options)
    except OSError as error:
        console.complain(f"potto render: {error}")
        return 1
    _tell(picture, found, grid, time.perf_counter() - start, options, console)
    if found.interrupted:
        return 130
    return report_others(world, file, options, console)


def _picture(world: World, file: str, options: argparse.Namespace) -> Picture:
    """What the command line asks for. Raises PottoError."""
    from potto.kernels.errors import wrong_call

    function = function_in(world, file, options.name)
    given = arguments_in(world, file, options.given)
    names = tuple(n for n in function.parameters if n not in given)
    axes = names if options.axes is None else tuple(n.strip() for n in options.axes.split(","))
    if len(axes) != 2 or not all(axes):
        many = len(names) > 2
        what = "give the others a value, `c=0.5`, until two are left" if many else "name a function of two numbers"
        left = ", ".join(f"`{n}`" for n in names) or "none"
        raise wrong_call(
            f"an image has two axes, and the parameters of `{options.name}` that are given nothing are: {left}",
            what,
        )
    known = dict.fromkeys(options.wrt)
    return Picture(function, given, axes, tuple(known))


def _sampled(picture: Picture, grid: Grid, chosen: Settings, workers: int | None, console: Console) -> Sampled:
    """All pixels, with progress for a person who waits."""
    from msgspec.structs import asdict

    from potto.applications.images import sampled
    from potto.projects.settings import settings
    from potto.python.workers import Workers
    from potto.runtime.answers.printing import format_seconds

    total, start = grid.width * grid.height, time.perf_counter()

    def progress(done: int) -> None:
        left = (time.perf_counter() - start) * (total - done) / max(done, 1)
        rest = f", {format_seconds(left)} left" if 0 < done < total and left >= 1 else ""
        console.progress(f"{100 * done // total} % of {total:,} pixels{rest}")

    with Workers(workers) as pool, settings(**asdict(chosen), executor=pool):
        found = sampled(picture.call, grid.middles(), progress)
    console.progress("")
    return found


def _write(picture: Picture, found: Sampled, grid: Grid, options: argparse.Namespace) -> None:
    """The files: value, derivatives, errors. Raises OSError."""
    from potto.applications.images import decades, limits, shades, signed

    target = options.output or f"{options.name if options.name.isidentifier() else 'image'}.png"
    stem, ending = os.path.splitext(target)
    parts, width, count = found.numbers, picture.width, len(found.numbers) // 2
    low, high = options.range or (limits(parts[:width]) if width < 3 else _color_limits(parts[:width]))
    _save(picture, target, "value", parts[:width], grid, low, high, shades)
    for number, name in enumerate(picture.wrt):
        here = parts[width * (1 + number) : width * (2 + number)]
        least, most = limits(here, even=True)
        _save(picture, f"{stem}-d{name}{ending}", f"derivative by {name}", here, grid, least, most, signed)
    if options.error:
        errors = parts[count:]
        _save(picture, f"{stem}-error{ending}", "error", errors, grid, 0.0, float(limits(errors)[1]),
              lambda rows, low, high: decades(rows))  # fmt: skip


def _color_limits(parts: Any) -> tuple[float, float]:
    """Colours between 0 and 1 are meant as they are."""
    from potto.applications.images import limits

    low, high = limits(parts)
    return (0.0, 1.0) if low >= 0 and high <= 1 else (low, high)


def _save(
    picture: Picture, path: str, what: str, parts: Any, grid: Grid, low: float, high: float,
    paint: Callable[[Any, float, float], Any],
) -> None:  # fmt: skip
    from potto.applications.images import png, save_array

    if path.endswith(".npy"):
        save_array(path, parts, grid)
    else:
        with open(path, "wb") as stream:
            stream.write(png(paint(parts, low, high), grid))
    picture.files.append({"file": path, "shows": what, "low": low, "high": high})


def _tell(
    picture: Picture, found: Sampled, grid: Grid, seconds: float, options: argparse.Namespace, console: Console
) -> None:  # fmt: skip
    from potto.applications.images import largest

    pixels = grid.width * grid.height
    most = largest(found.numbers[len(found.numbers) // 2 :])  # errors come after as many values and derivatives
    if options.json:
        from potto.runtime.answers.shown import json_number

        console.answer_json({
            "files": picture.files, "width": grid.width, "height": grid.height, "evals": found.evaluations,
            "seconds": seconds, "largest_error": json_number(most), "holes": found.holes,
            "converged": not found.reasons and not found.holes,
        })  # fmt: skip
    else:
        from potto.runtime.answers.printing import format_error, format_range

        for entry in picture.files:
            console.answer(f"{entry['file']}: {entry['shows']}, {format_range(entry['low'], entry['high'])}")
        cost = f"{found.evaluations / pixels:.1f} evaluations a pixel, largest error {format_error(most)}"
        console.answer(f"{grid.width} x {grid.height} pixels in {seconds:.2f} s, {cost}")
    if options.stats:
        show_stats(found.answers, console)
    if found.holes and found.trouble is not None:
        message = found.trouble.diagnostics[0].message
        console.complain(f"warning: {found.holes:,} pixels have no value and are gray: {message}")
    for reason in found.reasons:
        console.complain(f"warning: not as accurate everywhere as was asked: {reason}")
