"""The paper's studies in one run: `python benchmarks/paper.py [--large] [--only PART] [--plot FILE]`.

Programs that Teg was published with: what it takes to compile them with their gradients, to evaluate, both, and their
size. The same of what the prototype was published with: a triangle in a pixel beside the figures of its authors, more
and more jumps, shaders swapped under many. Shaders apart against whole programs. The paper's figures at their sizes, by
numpy and by machine code, with their goals; a mesh fitted along Potto's gradient and along one by hand. Times are those
of the processor, on one thread. Every answer is held to another way of finding it before it has a time.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):  # before numpy is loaded
    os.environ.setdefault(variable, "1")
os.environ["POTTO_CACHE"] = "off"  # what is compiled is to be compiled here

import numpy as np  # noqa: E402
from mesh_by_hand import loss_and_gradient  # noqa: E402
from paper_peers import asked  # noqa: E402
from paper_programs import PROGRAMS, Program, differences  # noqa: E402
from paper_studies import STUDIES  # noqa: E402
from paper_timing import HEAD, Compiled, shown, size, timed  # noqa: E402

import potto  # noqa: E402

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
BACKENDS = ("numpy", "native")


class Row(NamedTuple):
    """What was measured, in seconds; goal: nan if there is none."""

    name: str
    seconds: float
    goal: float = float("nan")
    note: str = ""

    def __str__(self) -> str:
        met = (
            ""
            if self.goal != self.goal
            else f"goal {shown(self.goal)}: {'met' if self.seconds <= self.goal else 'NOT MET'}"
        )
        return f"  {self.name:65} {shown(self.seconds):>10}  {met:24} {self.note}".rstrip()


def compiled(program: Program) -> Compiled:
    """From its text to the gradient, and that once more. Raises ValueError if the answer is wrong."""
    wrt = list(program.parameters[: program.moving])

    def first() -> tuple[Any, potto.Module]:
        module = potto.compile(program.text)
        gradient = potto.grad(getattr(module, program.function), wrt)
        gradient(*program.place)
        return gradient, module

    whole, (gradient, module) = timed(first)
    again, found = timed(lambda: gradient(*program.place), 5)
    slopes = np.array([float(t) for t in (found.tangent if program.moving > 1 else [found.tangent])])
    off = max(
        abs(float(found.value) - program.exact(program.place)), float(np.abs(slopes - differences(program)).max())
    )
    if not off < 1e-9:
        raise ValueError(f"{program.name} is off by {off:.1e}")
    return Compiled(program.name, whole - again, again, size(module), off)


def programs(options: argparse.Namespace) -> dict[str, list[Compiled]]:
    """The programs of Teg's publication and the prototype's studies; the peers where they are."""
    print("\nprograms: from text to the gradient in all parameters, and the gradient once more")
    potto.grad(potto.compile("def f(t) integral [0, 1] [x < t]*x d(x)").f, "t")(0.4)  # what is imported is not counted
    print(HEAD)
    found = {"Teg's programs": listed(map(compiled, PROGRAMS))}
    for peer, folder in (("teg", options.teg), ("prototype", options.prototype)):
        answer = asked(peer, folder)
        if "missing" in answer:
            print(f"  {peer:34} SKIPPED: {answer['missing']}")
            continue
        off = abs(answer["slope"] - 1)
        print(Compiled(f"{peer}, a step", answer["compile"], answer["evaluate"], 0, off))
    for name, (title, study) in STUDIES.items():
        print(f"\n{name}: {title}\n{HEAD}")
        found[name] = listed(study())
    return found


def listed(rows: Iterable[Compiled]) -> list[Compiled]:
    found = []
    for row in rows:
        print(row, flush=True)
        found.append(row)
    return found


def image(side: int) -> potto.Module:
    text = (EXAMPLES / "paper" / "image.po").read_text(encoding="utf-8")
    return potto.Workspace(EXAMPLES / "paper").compile(text.replace("h = 1 / 256", f"h = 1 / {side}"))


def places(side: int, low: float = 0.0, high: float = 1.0) -> tuple[Any, Any]:
    line = low + (np.arange(side) + 0.5) / side * (high - low)
    x, y = np.meshgrid(line, line)
    return x, y


SHADERS = {"const": "1", "lin": "1 / (sqrt(2) * (x + y + c) + 2)", "quad": "1 / (sqrt(2) * (x + y + c) + 2)^2"}
WHOLE = """
def pixel(px, py, c)
    integral ([px - 1/128, px + 1/128], [py - 1/128, py + 1/128]) {shader} * [x + y + c >= 0] d(x, y) * 4096
"""


def shaders(options: argparse.Namespace) -> Iterator[Row]:
    """The renderer once, then other shaders; and whole programs with each shader written in."""
    module, (x, y) = image(64), places(64)
    with potto.settings(backend="numpy"):
        for name in SHADERS:
            call = lambda name=name: potto.deriv(module.pixel)(  # noqa: E731
                x, y, dc=(-0.8, 1.0), dshader=potto.deriv(getattr(module, f"{name}_shader")))  # fmt: skip
            first, found = timed(call)
            count, again = int(found.stats["kernels compiled"]), timed(call, 3)[0]
            title = f"renderer with the {name} shader" if name == "const" else f"swapped for the {name} shader"
            goal = float("nan") if name == "const" else 0.02
            yield Row(title, max(first - again, 0.0), goal, f"{count} kernels")
        for name, shader in SHADERS.items():
            start = time.process_time()
            whole = potto.compile(WHOLE.format(shader=shader))
            first, _ = timed(lambda whole=whole: potto.deriv(whole.pixel)(x, y, dc=(-0.8, 1.0)))
            first += time.process_time() - start - first
            again, _ = timed(lambda whole=whole: potto.deriv(whole.pixel)(x, y, dc=(-0.8, 1.0)), 3)
            yield Row(f"a whole program with the {name} shader", max(first - again, 0.0))
    yield from swapped_under_a_triangle()


def swapped_under_a_triangle() -> Iterator[Row]:
    """Shaders with thresholds of their own: by a process that is the first to see them, and by the next one."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"POTTO_CACHE": folder}
        for seen in ("new", "from disk"):
            script = Path(__file__).with_name("paper_swaps.py")
            run = subprocess.run([sys.executable, str(script)], env=environment, stdout=subprocess.PIPE, check=True)
            for name, times in json.loads(run.stdout).items():
                first = name == "by_depth"
                title = f"a triangle in space, {'' if first else 'swapped for '}{name}, {seen}"
                note = f"a pixel {shown(times['pixel'])}"
                took = times["compile"] + times["plan"]
                yield Row(title, took, float("nan") if first else 0.02, note)


def second_figure(options: argparse.Namespace) -> Iterator[Row]:
    module, (x, y) = image(512), places(512)
    for backend, goal in zip(BACKENDS, (2.0, 0.2), strict=True):
        with potto.settings(backend=backend):

            def six() -> None:
                for name in SHADERS:
                    shader = potto.deriv(getattr(module, f"{name}_shader"))
                    potto.deriv(module.pixel)(x, y, dc=(-0.8, 1.0), dshader=shader)

            first, again = timed(six)[0], timed(six, 3)[0]
            yield Row(f"six images, 512 x 512, {backend}", again, goal, f"{shown(first)} with compiling")


def first_figure(options: argparse.Namespace) -> Iterator[Row]:
    side = 512 if options.large else 128
    text = (EXAMPLES / "raytrace" / "main.po").read_text(encoding="utf-8")
    x, y = places(side, -0.6, 0.6)
    light = {"dlx": (0.2, 0.0), "dthreshold": (0.8, 0.0)}
    for backend, goal in zip(BACKENDS, (60.0, 5.0), strict=True):
        module = potto.Workspace(EXAMPLES / "raytrace").compile(text.replace("h = 1 / 256", f"h = 1.2 / {side}"))
        with potto.settings(backend=backend, rtol=1e-8, atol=1e-7):
            for name, more in (("by_depth", {}), ("two_tones", light), ("by_law", light | {"dthreshold": (0.3, 0.0)})):
                function = potto.deriv(getattr(module, name))
                call = lambda function=function, more=more: function(  # noqa: E731
                    x, y, dq=(-0.2, 1.0), dex=(0.0, 0.0), dfocal=(1.0, 0.0), **more)  # fmt: skip
                first, _ = timed(call)
                again, found = timed(call)
                if not np.all(found.converged):
                    raise ValueError(f"{name} has pixels that are not as accurate as asked for")
                goals = goal if options.large else float("nan")
                note = f"{shown(first)} with compiling"
                yield Row(f"{name}, value and derivative, {side} x {side}, {backend}", again, goals, note)


def third_figure(options: argparse.Namespace) -> Iterator[Row]:
    sys.path.insert(0, str(EXAMPLES / "stylize"))
    import fit
    import target

    photo = target.evening(128)
    for backend, goal in zip(BACKENDS, (1.0, 0.05), strict=True):
        for kind in fit.TERMS:
            mesh = fit.grid(7, kind)
            mesh.corners += np.random.default_rng(0).uniform(-0.01, 0.01, mesh.corners.shape)
            slopes, place = fit.slopes_by_potto(kind), (mesh.corners, mesh.faces, mesh.colours, photo)
            with potto.settings(backend=backend):
                run = partial(slopes, *place)
                first, again = timed(run)[0], timed(run, 3)
            if kind == "constant":
                theirs = loss_and_gradient(*place)
                off = max(float(np.abs(np.asarray(a) - b).max()) for a, b in zip(again[1], theirs, strict=True))
                if not off < 1e-12:
                    raise ValueError(f"the gradient is off by {off:.1e} of one by hand")
            yield Row(f"a step of 98 {kind} triangles on 128 x 128, {backend}", again[0],
                      goal if kind == "constant" else float("nan"), f"{shown(first)} with compiling")  # fmt: skip
    yield Row(
        "the same by hand in numpy", timed(lambda: loss_and_gradient(*place[:2], mesh.colours[:, :1], photo), 3)[0]
    )
    fits = ("Potto, native", None), ("by hand", loss_and_gradient), ("by hand, slopes rounded otherwise", _rounded())
    for name, slopes in fits:
        with potto.settings(backend="native"):
            seconds, mesh = timed(lambda slopes=slopes: fit.fitted("constant", photo, 7, 100, slopes))
        yield Row(f"100 steps, {name}", seconds, note=f"loss {mesh.losses[0]:.5f} to {mesh.losses[-1]:.5f}")
    if options.large:
        with potto.settings(backend="native"):
            seconds, mesh = timed(lambda: fit.fitted("constant", target.evening(512), 22, 100))
        note = f"loss {mesh.losses[0]:.5f} to {mesh.losses[-1]:.5f}"
        yield Row("100 steps of 968 triangles on 512 x 512, native", seconds, 600.0, note)


def _rounded() -> Any:
    """The slopes by hand, changed by as much as those of two right programs differ: what of a fit is chance."""
    random = np.random.default_rng(0)

    def slopes(*place: Any) -> Any:
        loss, *both = loss_and_gradient(*place)
        return loss, *(part + random.uniform(-1e-14, 1e-14, part.shape) for part in both)

    return slopes


PARTS = {
    "shaders": ("shaders apart, 64 x 64: what compiling takes", shaders),
    "figure-2": ("the second figure", second_figure),
    "figure-1": ("the first figure", first_figure),
    "figure-3": ("the third figure", third_figure),
}


def plot(path: str, found: dict[str, list[Compiled]], rows: dict[str, list[Row]]) -> None:
    """Bars: of programs compiling, evaluating, both, and their sizes; then the times of each part."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    panels: list[tuple[str, list[str], list[float]]] = []
    for title, part in found.items():
        for column in ("compiling", "evaluating", "total", "size"):
            unit = "terms" if column == "size" else "s"
            sizes = [float(getattr(row, column)) for row in part]
            panels.append((f"{title}: {column}, {unit}", [row.name.strip() for row in part], sizes))
    for name, times in rows.items():
        panels.append((PARTS[name][0] + ", s", [row.name for row in times], [row.seconds for row in times]))
    figure, axes = plt.subplots(-(-len(panels) // 2), 2, figsize=(13, 2.6 * -(-len(panels) // 2)), squeeze=False)
    for axis in axes.flat[len(panels) :]:
        axis.set_axis_off()
    for axis, (title, labels, values) in zip(axes.flat, panels, strict=False):
        places = range(len(labels), 0, -1)  # names may repeat
        axis.barh(places, values, color=["#9a9a9a" if "published" in label else "#1b6ca8" for label in labels])
        axis.set_yticks(places, labels)
        axis.set_xscale("log")
        axis.set_xlim(10.0 ** math.floor(math.log10(min(values))), 10.0 ** math.ceil(math.log10(max(values))))
        axis.set_title(title, fontsize=9)
        axis.tick_params(labelsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    print(f"\n{path}: what was measured, as bars")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", metavar="PART", action="append", choices=("programs", *PARTS), help="may be repeated")
    parser.add_argument("--large", action="store_true", help="the first figure on 512 x 512, a fit of 968 triangles")
    parser.add_argument("--teg", metavar="FOLDER", type=Path, help="a clone of github.com/ChezJrk/Teg")
    parser.add_argument("--prototype", metavar="FOLDER", type=Path, help="a clone of github.com/divicomp/potto")
    parser.add_argument("--plot", metavar="FILE", help="draw what was measured (needs matplotlib)")
    options = parser.parse_args()
    wanted = options.only or ["programs", *PARTS]
    found = programs(options) if "programs" in wanted else {}
    rows: dict[str, list[Row]] = {}
    for name, (title, part) in PARTS.items():
        if name in wanted:
            print(f"\n{name}: {title}")
            rows[name] = []
            for row in part(options):
                rows[name].append(row)
                print(row, flush=True)
    if options.plot:
        plot(options.plot, found, rows)


if __name__ == "__main__":
    main()
