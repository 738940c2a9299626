"""What the page of an integral view asks, answered: values in, a picture and numbers out.

Owns `Answers`, which the page's server and the evaluation process of editors share. Nothing queues here: who asks
sends the newest values only when the last answer has come.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from contextlib import nullcontext
from typing import Any

import msgspec

from potto.applications.integral_pictures import comment, integral_svg, remarks, told, typeset
from potto.applications.integral_scenes import IntegralScene, Shot
from potto.applications.integral_views import FRAME
from potto.calculus.explanation.layout import DerivativeText
from potto.diagnostics import PottoError
from potto.evaluating.world import World
from potto.ide.display.scenes import scenes
from potto.ide.display.views import viewed
from potto.ide.hover.derivatives import derivative_text
from potto.modules import chunk_start
from potto.projects.settings import settings
from potto.syntax.typesetting import mathml

QUICK = 1e-4  # the accuracy of what is seen while a slider is dragged: less than a pixel
UNSEEN = 0.25  # seconds that files may have changed unseen while a slider is dragged: there may be thousands
MOST = 400  # characters of a formula that is shown


class Answers:
    """Answers about the functions of one file. name, given, wrt: what the page begins with."""

    def __init__(
        self, world: World, file: str, name: str | None = None, given: Mapping[str, str] | None = None,
        wrt: str | None = None,
    ) -> None:  # fmt: skip
        self.world, self.file, self.name, self.given, self.wrt = world, file, name, dict(given or {}), wrt
        self._scenes: dict[tuple[str, frozenset[tuple[str, str]]], IntegralScene] = {}
        self._revision = -1
        self._refreshed = -math.inf

    def answer(self, path: str, asked: Mapping[str, Any]) -> dict[str, Any] | None:
        """What goes back as JSON; None for a question that there is not. An error of the program is an `error`."""
        self._refresh(bool(asked.get("quick")))
        if self._revision != self.world.db.revision:
            self._scenes.clear()
            self._revision = self.world.db.revision
        try:
            match path:
                case "/names":
                    names = [scene.name for scene in scenes(self.world.db, self.file, drawable=False)]
                    return {"names": names, "chosen": self.name or (names[0] if names else "")}
                case "/open":
                    return self._open(asked)
                case "/formulas":
                    return {"formulas": self._formulas(str(asked["name"]))}
                case "/look":
                    return self._look(asked)
        except PottoError as error:
            return {"error": str(error)}
        except (KeyError, TypeError, ValueError):
            return {"error": "the question is not one of this page"}
        return None

    def _refresh(self, quick: bool) -> None:
        """Look at the disk again."""
        now = time.monotonic()
        if not quick or now - self._refreshed > UNSEEN:
            self.world.refresh()
            self._refreshed = now

    def _scene(self, asked: Mapping[str, Any]) -> IntegralScene:
        """What is asked for: a function, and what its parameters that are functions are given, where that is chosen."""
        name = str(asked["name"])
        functions = {str(each): str(text) for each, text in (asked.get("functions") or {}).items()}
        key = name, frozenset(functions.items())
        if key not in self._scenes:
            given = {**(self.given if name == self.name else {}), **functions}
            made = self._scenes[key] = IntegralScene(self.world, self.file, name, given)
            self._scenes[name, frozenset(made.functions.items())] = made
            self._revision = self.world.db.revision
        return self._scenes[key]

    def _open(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """What there is to choose, and the text with its conditions."""
        found = self._scene(asked)
        wrt = self.wrt if self.wrt in found.parameters else found.moving
        return {
            "values": found.values, "wrt": wrt, "indices": found.indices, "integrals": len(found.regions(wrt)),
            "functions": found.functions, "fits": found.fits, "sections": found.sections, **self._text(found.name),
        }  # fmt: skip

    def _formulas(self, name: str) -> list[dict[str, str]]:
        found = derivative_text(self.world.db, self.file, name)
        return [] if found is None else [
            {"part": part, "of": str(number), "math": mathml(text, found.tangents)}
            for number, part, text in _parts(found) if len(text) <= MOST
        ]  # fmt: skip

    def _text(self, name: str) -> dict[str, Any]:
        """The definition as it is written, and where its conditions are in that."""
        start = chunk_start(self.world.db, self.file, name)
        source = self.world.source(self.file)
        seen = None if start is None else viewed(self.world.db, self.file, start)
        if source is None or seen is None:
            return {"source": "", "conditions": []}
        text, start = source.text[seen.span.start : seen.span.end], seen.span.start
        while text.startswith("#"):  # what is written above the definition
            line, _, text = text.partition("\n")
            start += len(line) + 1
        marks = [
            {"equation": c.equation, "from": c.span.start - start, "to": c.span.end - start} for c in seen.conditions
        ]
        return {"source": text, "conditions": marks}

    def _look(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        found = self._scene(asked)
        values = {name: float(asked["values"][name]) for name in found.values}
        wrt, which = str(asked["wrt"]), int(asked["which"])
        sections = {str(each): float(at) for each, at in (asked.get("sections") or {}).items()}
        ghost = float(asked.get("ghost") or 0.0) or None  # a step of 0 shows no difference
        start = time.perf_counter()
        with settings(rtol=QUICK) if asked.get("quick") else nullcontext():
            shot = found.look(values, wrt, which, ghost, bool(asked.get("nodes")), bool(asked.get("quick")), sections)
        svg = integral_svg(shot.view, dark=bool(asked.get("dark")))
        seconds = time.perf_counter() - start
        return {
            "svg": svg, "numbers": msgspec.to_builtins(shot.numbers), "told": told(shot.numbers, wrt),
            "surfaces": _surfaces(shot), "remarks": remarks(shot.view), "indices": shot.indices, "seconds": seconds,
            "sections": {held.name: (held.at, held.low, held.high) for held in shot.view.held}, "slow": seconds > FRAME,
        }  # fmt: skip


def _parts(found: DerivativeText) -> list[tuple[int, str, str]]:
    """Of each integral, with its number, the formulas of interior and boundary."""
    parts: list[tuple[int, str, str]] = []
    for number, item in enumerate(found.integrals):
        parts.append((number, "integral", item.over(item.integrand)))
        parts += [(number, "interior", item.over(item.interior))] if item.interior else []
        parts += [(number, "boundary", item.over(text)) for text in item.deltas]
        parts += [(number, "moving bound", text) for text in item.bounds]
    return parts


def _surfaces(shot: Shot) -> list[dict[str, Any]]:
    return [
        {
            "equation": typeset(s.equation),
            "condition": s.condition,
            "comment": comment(s),
            "gain": s.gain,
        }
        for s in shot.view.surfaces
    ]
