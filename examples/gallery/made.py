"""Entries of the gallery made: pictures in a folder, and what they took."""

from __future__ import annotations

import contextlib
import io
import json
import re
import runpy
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from curves import plot
from tables import Chapter, Curve, Driver, Entry, Picture

import potto
from potto.__main__ import main as command

POINTS, QUICK_POINTS = 241, 5
GOOD = 1e-8  # how far off a number of a curve may be, as a part of its size or of 1, that nothing is said of it


@dataclass(frozen=True)
class Shown:
    """A picture: its file in the folder, and what it shows."""

    file: str
    caption: str


@dataclass(frozen=True)
class Made:
    """An entry with its pictures; seconds, evaluations and the largest estimated error where they are known."""

    title: str
    about: str
    source: str
    files: tuple[Shown, ...] = ()
    seconds: float | None = None
    error: float | None = None
    evaluations: int | None = None
    detail: str = ""
    failure: str = ""


def make(entry: Entry, chapter: Chapter, out: Path, quick: bool) -> Made:
    """Make its pictures. What goes wrong is said in `failure`: the other entries are still made."""
    stem = f"{chapter.name}-{re.sub(r'[^a-z0-9]+', '-', entry.title.lower()).strip('-')}"
    try:
        match entry:
            case Curve():
                return _curve(entry, chapter, out, stem, quick)
            case Picture():
                return _picture(entry, chapter, out, stem, quick)
            case Driver():
                return _driver(entry, chapter, out, quick)
    except (potto.PottoError, RuntimeError) as error:
        return Made(entry.title, entry.about, chapter.name, failure=str(error))


def _curve(entry: Curve, chapter: Chapter, out: Path, stem: str, quick: bool) -> Made:
    text = (chapter.folder / f"{entry.program}.po").read_text(encoding="utf-8")
    module = potto.Workspace(chapter.folder).compile(f"{text}\nshown_in_the_gallery = {entry.function}\n")
    function = potto.deriv(module.shown_in_the_gallery)
    places = np.linspace(*entry.range, QUICK_POINTS if quick else POINTS)
    start = time.perf_counter()
    found = function((places, np.ones_like(places)))
    seconds = time.perf_counter() - start
    value, slope = (
        np.broadcast_to(np.asarray(part, dtype=float), places.shape) for part in (found.value, found.tangent)
    )
    if not (np.isfinite(value).all() and np.isfinite(slope).all()):
        raise RuntimeError("it has no value somewhere")
    (out / f"{stem}.svg").write_text(plot(places, value, slope, entry.over), encoding="utf-8")
    error = float(max(np.max(found.error), np.max(found.tangent_error)))
    shown = Shown(f"{stem}.svg", f"by {entry.over}")
    source = f"{chapter.name}/{entry.program}.po"
    detail = f"{places.size} values"
    rough = int((np.maximum(_relative(found.error, value), _relative(found.tangent_error, slope)) > GOOD).sum())
    if rough:
        detail += f", of which {rough} are less sure than {GOOD:.0e}"
    return Made(entry.title, entry.about, source, (shown,), seconds, error, None, detail)


def _relative(error: Any, number: Any) -> Any:
    """Errors as parts of the numbers' size, or of 1."""
    return np.asarray(error, dtype=float) / np.maximum(np.abs(number), 1)


def _picture(entry: Picture, chapter: Chapter, out: Path, stem: str, quick: bool) -> Made:
    width, height = entry.quick if quick else entry.size
    words = [
        "render",
        str(chapter.folder / f"{entry.program}.po"),
        entry.function,
        "--json",
        "--workers",
        "1",
        "-o",
        str(out / f"{stem}.png"),
    ]
    words += [f"{name}={value}" for name, value in entry.given]
    words += ["--size", f"{width}x{height}", "--box", ",".join(map(str, entry.box))]
    if entry.pixel:
        words += ["--set", f"{entry.pixel}=({entry.box[1]} - {entry.box[0]})/{width}"]
    words += [word for name in entry.wrt for word in ("--wrt", name)]
    said, trouble = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(trouble):
        status = command([*words, *entry.options])
    if status != 0:
        raise RuntimeError(trouble.getvalue().strip() or said.getvalue().strip())
    answer = json.loads(said.getvalue())
    if not answer["converged"]:
        raise RuntimeError(_trouble(answer["holes"], trouble.getvalue()))
    files = tuple(Shown(Path(file["file"]).name, _told(file)) for file in answer["files"])
    source, error = f"{chapter.name}/{entry.program}.po", float(answer["largest_error"])
    detail = f"{width} x {height}, {answer['evals']:,} evaluations"
    return Made(entry.title, entry.about, source, files, answer["seconds"], error, answer["evals"], detail)


def _told(file: Mapping[str, Any]) -> str:
    """What a picture shows, with the numbers at the ends of its colours."""
    return f"{file['shows']}, {file['low']:.3g} to {file['high']:.3g}"


def _trouble(holes: int, said: str) -> str:
    """Why a picture is not as it should be, by what the command said beside it."""
    if holes:
        return f"{holes:,} of its pixels have no value"
    warnings = [line.removeprefix("warning: ") for line in said.splitlines() if line.startswith("warning: ")]
    return "; ".join(warnings) or "it is not as accurate as was asked"


def _driver(entry: Driver, chapter: Chapter, out: Path, quick: bool) -> Made:
    start = time.perf_counter()
    answers = runpy.run_path(str(chapter.folder / entry.file))["pictures"](out, quick)
    elapsed = time.perf_counter() - start
    files = tuple(Shown(answer["file"], answer["caption"]) for answer in answers)
    seconds = sum(answer["seconds"] for answer in answers if "seconds" in answer) or elapsed
    errors = [float(answer["error"]) for answer in answers if "error" in answer]
    evaluations = sum(answer.get("evaluations", 0) for answer in answers) or None
    source, error = f"{chapter.name}/{entry.file}", max(errors) if errors else None
    return Made(entry.title, entry.about, source, files, seconds, error, evaluations)
