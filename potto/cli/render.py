"""`potto render`: an image of a function, and of its derivatives; an animation over a parameter."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from potto.cli.calling import add_set, assignment, called, with_values
from potto.cli.console import Console
from potto.cli.evaluation_options import accounts, add_options, add_workers, settings_of, show_stats

if TYPE_CHECKING:
    from potto.applications.images import Grid
    from potto.cli.rendering import Drawn, Layer
    from potto.evaluating.world import World
    from potto.projects.settings import Settings

SUMMARY = "draw a function of two numbers as an image, and its derivatives"
EXAMPLE = """  potto render examples/worked/picture.po pixel r=0.7 --wrt r --size 512x512 -o disc.png
  potto render examples/worked/picture.po pixel --over r=0.1..1.2 --frames 60 -o disc.gif"""
MOST_PIXELS = 1 << 26
MOST_FRAMES, MOST_IN_FRAMES = 10_000, 1 << 27  # all of them are in memory at once
FRAMES = 60  # if nobody says
SIDE = 256  # pixels, if nobody says
MAPS, DIVERGING = ("gray", "viridis", "magma"), ("red-blue", "brick-navy", "purple-orange")
TONES = ("linear", "srgb", "log")


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="the program; `-` reads it from standard input")
    parser.add_argument("name", metavar="NAME", help="the function: a name, or an expression that is a function")
    parser.add_argument("given", metavar="NAME=EXPR", nargs="*", type=assignment, help="what parameters are given")
    parser.add_argument("-o", "--output", metavar="FILE", help="the image: .png, .jpg, or the numbers themselves: "
                        ".npy, .exr (default: NAME.png); of an animation .gif, .mp4, .npy")  # fmt: skip
    _add_what_is_seen(parser)
    _add_colours(parser)
    moving = parser.add_argument_group("animation")
    moving.add_argument("--over", metavar="NAME=FROM..TO", type=_over, help="let a parameter move from frame to frame")
    moving.add_argument("--frames", metavar="N", type=_frames, help="how many (default 60)")
    moving.add_argument("--fps", metavar="N", type=_positive, help="frames a second (default 20)")
    parser.add_argument(
        "--watch", action="store_true", help="draw again whenever a file of the program or of its data changes"
    )
    add_workers(parser)
    add_set(parser)
    add_options(parser)


def _add_what_is_seen(parser: argparse.ArgumentParser) -> None:
    seen = parser.add_argument_group("what is seen")
    seen.add_argument("--size", metavar="WxH", type=_size, help="pixels (default 256x256)")
    seen.add_argument("--width", metavar="N", type=_side, help="pixels across; the height follows, so that pixels are "
                      "square")  # fmt: skip
    seen.add_argument("--height", metavar="N", type=_side, help="pixels down; the width follows")
    seen.add_argument("--box", "--viewport", metavar="X0,X1,Y0,Y1", type=_box, default=(0.0, 1.0, 0.0, 1.0),
                      help="what of the plane is seen (default 0,1,0,1); where Y0 > Y1, y grows downwards")  # fmt: skip
    seen.add_argument("--axes", metavar="X,Y", help="the parameters that are the axes (default: the two not given)")
    seen.add_argument("--wrt", metavar="NAME,…", action="append", default=[], type=_names,
                      help="draw also the derivatives by these")  # fmt: skip
    seen.add_argument("--error", action="store_true", help="draw also the estimated error, by powers of ten")


def _add_colours(parser: argparse.ArgumentParser) -> None:
    colours = parser.add_argument_group("colours")
    colours.add_argument("--range", metavar="LO,HI", type=_range, help="the numbers at both ends of the map")
    colours.add_argument("--map", choices=MAPS, default="gray", help="colours of a value (default gray)")
    colours.add_argument("--diverging", choices=DIVERGING, default="red-blue", help="colours of a derivative, around "
                         "zero (default red-blue)")  # fmt: skip
    colours.add_argument("--scale", action="store_true", help="one figure with axes, colour bars and a caption: value "
                         "and derivatives beside each other (.png, .jpg, .pdf, .svg)")  # fmt: skip
    colours.add_argument("--surfaces", action="store_true", help="draw in the figure of --scale where surfaces are")
    colours.add_argument("--tone", metavar="VALUE[,DERIVATIVE]", type=_tones, default=("linear", "linear"),
                         help="linear; srgb: the numbers are light; log: what is faint can be seen; `linear,log`: one "
                         "for the value, one for derivatives (default linear)")  # fmt: skip


def _pixels(width: int, height: int, text: str) -> tuple[int, int]:
    if width * height > MOST_PIXELS:
        raise argparse.ArgumentTypeError(f"{text} is more than {MOST_PIXELS:,} pixels")
    return width, height


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdecimal() and (height or width).isdecimal()) or int(width) * int(height or width) == 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size; write `256x256`")
    return _pixels(int(width), int(height or width), repr(text))


def _side(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= MOST_PIXELS:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of pixels; write `512`")
    return int(text)


def _frames(text: str) -> int:
    if not text.isdecimal() or not 2 <= int(text) <= MOST_FRAMES:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of frames, from 2 to {MOST_FRAMES:,}")
    return int(text)


def _positive(text: str) -> float:
    try:
        found = float(text)
    except ValueError:
        found = 0.0
    if not 0 < found <= 1000:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of frames a second; write `20`")
    return found


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if not all(name.isidentifier() for name in names):
        raise argparse.ArgumentTypeError(f"{text!r} does not name parameters; write `c` or `c,d`")
    return names


def _over(text: str) -> tuple[str, str, str]:
    name, _, way = text.partition("=")
    low, dots, high = way.partition("..")
    if not name.strip().isidentifier() or not dots or not low.strip() or not high.strip():
        raise argparse.ArgumentTypeError(f"{text!r} does not say what moves from where to where; write `c=-2..0`")
    return name.strip(), low.strip(), high.strip()


def _numbers(text: str, count: int) -> tuple[float, ...]:
    """So many finite numbers, or none."""
    try:
        found = tuple(map(float, text.replace(",", " ").split()))
    except ValueError:
        found = ()
    return found if len(found) == count and all(map(math.isfinite, found)) else ()


def _box(text: str) -> tuple[float, ...]:
    found = _numbers(text, 4)
    if not found or not (found[0] < found[1] and found[2] != found[3]):
        raise argparse.ArgumentTypeError(f"{text!r} is not X0,X1,Y0,Y1, with X0 < X1; with Y0 > Y1 it is upside down")
    return found


def _range(text: str) -> tuple[float, ...]:
    found = _numbers(text, 2)
    if not found or not found[0] < found[1]:
        raise argparse.ArgumentTypeError(f"{text!r} is not LO,HI, from less to more")
    return found


def _tones(text: str) -> tuple[str, str]:
    value, comma, slope = text.partition(",")
    if value not in TONES or (comma and slope not in TONES):
        raise argparse.ArgumentTypeError(f"{text!r} is none of {', '.join(TONES)}, or two of them as `linear,log`")
    return value, slope or value


def prepare(arguments: list[str]) -> list[str]:
    """Let a box begin with a minus."""
    return with_values(arguments, "--box", "--viewport", "--range")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.cli.files import wait

    settings = settings_of(options, console)
    if settings is None:
        return 2
    stem = options.name if options.name.isidentifier() else "image"
    target = options.output or stem + (".gif" if options.over else ".png")
    wrong = _complaint(options, target)
    if wrong is not None:
        console.complain(f"potto render: {wrong}")
        return 2
    options.frames = options.frames or FRAMES
    while True:
        changed = _changes(options) if options.watch else None  # before: what changes meanwhile is drawn next
        status = _once(options, target, settings, console)
        if changed is None or status == 130:
            return status
        console.out.flush()
        wait(changed)
        console.complain(f"-- {time.strftime('%H:%M:%S')}")


def _complaint(options: argparse.Namespace, target: str) -> str | None:
    """What is wrong with the options, before anything is computed."""
    from potto.applications import animations
    from potto.applications.picture_files import NEEDS, complaint, ending_of

    if options.size is not None and (options.width or options.height):
        return "--size says what --width and --height say: give one or the others"
    if options.over is None and (options.frames or options.fps):
        return "--frames and --fps are for an animation: say what moves, `--over c=-2..0`"
    if options.surfaces and not options.scale:
        return "--surfaces are lines in a figure: add --scale"
    if options.watch and options.file == "-":
        return "standard input is read once, and cannot be watched"
    moving = ending_of(target) in animations.NEEDS
    if options.over is None and moving and ending_of(target) not in NEEDS:
        return f"`{target}` is an animation: say what moves, `--over c=-2..0`"
    if options.over is not None and ending_of(target) in NEEDS and not moving:
        return f"`{target}` is a picture, and an animation ends with {', '.join(animations.NEEDS)}"
    width, height = _shape(options)
    if width * height > MOST_PIXELS:
        return f"{width:,} x {height:,} are more than {MOST_PIXELS:,} pixels"
    frames = (options.frames or FRAMES) if options.over is not None else 1
    if width * height * frames > MOST_IN_FRAMES:
        return f"{frames:,} frames of {width:,} x {height:,} are more than {MOST_IN_FRAMES:,} pixels"
    if options.over is not None:
        return "--scale is for pictures that stand still" if options.scale else animations.complaint(target)
    if options.scale:
        from potto.applications import figures

        return figures.complaint(target)
    return complaint(target)


def _shape(options: argparse.Namespace) -> tuple[int, int]:
    """Pixels across and down; where one is given, the other so that pixels are square."""
    if options.size is not None:
        width, height = options.size
        return width, height
    x0, x1, y0, y1 = options.box
    ratio = abs(y1 - y0) / (x1 - x0)
    width, height = options.width, options.height
    if width is None and height is None:
        return SIDE, SIDE
    if width is None:
        return max(1, round(min(height / ratio, MOST_PIXELS))), height
    return width, height or max(1, round(min(width * ratio, MOST_PIXELS)))


def grid_of(options: argparse.Namespace) -> Grid:
    """The pixels that are asked for."""
    from potto.applications.images import Grid

    return Grid(*_shape(options), options.box)


def _changes(options: argparse.Namespace) -> Callable[[], bool]:
    """What says whether something has changed since it was asked before; that the program is there now counts."""
    watched = _watched(options)

    def changed() -> bool:
        nonlocal watched
        if watched is None:
            watched = _watched(options)
            return watched is not None
        return watched.refresh()

    return changed


def _watched(options: argparse.Namespace) -> World | None:
    """The files of the program and of the data that it is given; None as long as the program is not there."""
    from potto.cli.opening import opened
    from potto.diagnostics import PottoError
    from potto.evaluating.world import World

    world = World(["."])
    try:
        file = opened(world, options.file, after=options.name)
    except PottoError:
        return None
    world.diagnostics(file)
    for _, text in (*options.set, *options.given):
        with suppress(PottoError):  # is told when it is drawn
            world.typed(file, text)
    return world


def _once(options: argparse.Namespace, target: str, settings: Settings, console: Console) -> int:
    from potto.applications.picture_files import NUMBERS, ending_of
    from potto.cli.opening import fail, report_others
    from potto.cli.rendering import drawn, layers, outlines, picture_of, save_figure
    from potto.cli.uninterrupted import uninterrupted
    from potto.diagnostics import PottoError
    from potto.evaluating.world import World

    world = World(["."])
    grid = grid_of(options)
    try:
        file, options = called(world, options, _said(options))
        picture = picture_of(world, file, options, ending_of(target) not in NUMBERS)
        with accounts(options):
            found = drawn(picture, grid, settings, options, console)
    except PottoError as error:
        console.progress("")
        return fail(error, options, console)
    try:
        with uninterrupted() as met:
            files = layers(picture, found, options, target)
            lines = outlines(world, file, picture, grid) if options.scale and options.surfaces else ()
            if options.scale and options.surfaces and not lines:
                console.complain(
                    "note: no surface can be drawn: none is seen here, or where it is takes more than symbols"
                )
            if options.scale:
                save_figure(target, files, picture, grid, _cost(found, grid, options), lines)
            for layer in () if options.scale else files:
                _write(layer, grid, options)
    except OSError as error:
        why = f"`{error.filename}` cannot be written: {error.strerror}" if error.filename else str(error)
        console.complain(f"potto render: {why}")
        return 1
    _tell(files, found, grid, options, console)
    return 130 if found.interrupted or met else report_others(world, file, options, console)


def _said(options: argparse.Namespace) -> list[tuple[str, str]]:
    """What is said of parameters beside what they are given: that they move, or are axes."""
    name, *ends = options.over or ("",)
    axes = options.axes.split(",") if options.axes else []
    return [*((name, end) for end in ends), *((axis.strip(), "0") for axis in axes)]


def _write(layer: Layer, grid: Grid, options: argparse.Namespace) -> None:
    """Raises OSError."""
    from potto.applications.animations import save_frames
    from potto.applications.picture_files import NUMBERS, ending_of, save

    if options.over is not None:
        save_frames(layer.path, layer.frames, layer.colours, grid, options.fps or 20)
    else:
        plain = ending_of(layer.path) in NUMBERS
        save(layer.path, layer.frames[0], None if plain else layer.colours(), grid)


def _tell(
    files: list[Layer], found: Drawn, grid: Grid, options: argparse.Namespace, console: Console
) -> None:  # fmt: skip
    if options.json:
        console.answer_json(_answer(files, found, grid))
    else:
        from potto.runtime.answers.printing import format_range

        for layer in files:
            ends = "0 everywhere" if layer.vanishes else format_range(layer.low, layer.high)
            console.answer(f"{layer.path}: {layer.shows}, {ends}")
        console.answer(_cost(found, grid, options))
    if options.stats:
        show_stats(found.answers, console)
        console.complain(_crossed(found, grid))
    trouble = next((part.trouble for part in found.found if part.trouble is not None), None)
    if found.holes and trouble is not None:
        console.complain(
            f"warning: {found.holes:,} pixels have no value and are gray: {trouble.diagnostics[0].message}"
        )
    if found.interrupted:
        done = (
            f"{len(found.frames)} of {options.frames} frames"
            if options.over
            else f"{found.unknown:,} pixels were not reached"
        )
        console.complain(f"interrupted: {done}")
    for reason in found.reasons:
        console.complain(f"warning: not everywhere as accurate as asked: {reason}")


def _cost(found: Drawn, grid: Grid, options: argparse.Namespace) -> str:
    cost = found.cost(grid)
    frames = f"{len(found.frames)} frames of " if options.over is not None else ""
    return f"{frames}{grid.width} x {grid.height} pixels in {found.seconds:.2f} s, {cost}"


def _crossed(found: Drawn, grid: Grid) -> str:
    """How many pixels a surface crosses, as far as one looked."""
    if found.crossed is None:
        return "pixels crossed by a surface: unknown"
    some, all = found.crossed
    what = "pixels" if all == grid.width * grid.height * len(found.frames) else "integrals"
    return f"{what} crossed by a surface: {some:,} of {all:,} ({100 * some / all:.1f} %)"


def _answer(files: list[Layer], found: Drawn, grid: Grid) -> dict[str, Any]:
    """All of it for machines."""
    from potto.runtime.answers.shown import json_number

    answer = {
        "files": [{"file": f.path, "shows": f.shows, "low": f.low, "high": f.high} for f in files],
        "width": grid.width, "height": grid.height, "frames": len(found.frames), "evals": found.evaluations,
        "seconds": found.seconds, "largest_error": json_number(found.largest), "holes": found.holes,
        "converged": not found.reasons and not found.holes and not found.interrupted,
    }  # fmt: skip
    return answer if found.crossed is None else {**answer, "crossed": found.crossed[0], "looked_at": found.crossed[1]}
