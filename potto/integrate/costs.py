"""What an evaluation is spent on: evaluations of interior and boundary, cells, surfaces kept and dropped, and why.

Owns `Costs` and `counting`, which asks for them: counting takes time, so that nobody pays who does not read them. The
integrator and the sampler write; the runtime makes them a part of an estimate's `stats`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Term
from potto.kernels.cells import Array

_wanted: ContextVar[bool] = ContextVar("potto_counting", default=False)


@contextmanager
def counting() -> Iterator[None]:
    """In this block the `stats` of estimates say what the evaluation was spent on."""
    token = _wanted.set(True)
    try:
        yield
    finally:
        _wanted.reset(token)


def wanted() -> bool:
    """Whether anyone asked."""
    return _wanted.get()


def if_wanted() -> Costs | None:
    """Costs to be counted, if anyone asked for them."""
    return Costs() if wanted() else None


class SurfaceCount(Struct):
    """What became of a surface: whether it met the domain, whether it moved there, whether anyone asked if it does."""

    met: bool = False
    moves: bool = False
    asked: bool = False

    @property
    def kept(self) -> bool:
        return self.met and (self.moves or not self.asked)

    @property
    def why(self) -> str:
        if not self.met:
            return "it does not meet the domain"
        if not self.asked:
            return "cut along; no derivative is asked for"
        return "it moves: it has a boundary term" if self.moves else "nothing that is differentiated moves it"


class Costs(Struct):
    """The costs of one evaluation.

    interior: evaluations of integrands at nodes. boundary: at places that move, where boundary terms are read off.
    checks: at ends that stand still, for peaks and jumps that lie there. cells: stretches of the innermost variable
    that were integrated; empty: those left out, since the integrand vanishes there. whole: members of a batch that no
    surface crosses; looked: those that were looked at for that.
    """

    interior: int = 0
    boundary: int = 0
    checks: int = 0
    cells: int = 0
    empty: int = 0
    whole: int = 0
    looked: int = 0
    surfaces: dict[Term, SurfaceCount] = {}
    _apart: int | None = None

    def add(self, evaluations: int) -> None:
        if self._apart is None:
            self.interior += evaluations
        else:
            self._apart += evaluations

    @contextmanager
    def apart(self, share: float = 0.0) -> Iterator[None]:
        """What is evaluated here is not interior: `share` of it is boundary, the rest checks."""
        if self._apart is not None:  # within another one: that decides
            yield
            return
        self._apart = 0
        try:
            yield
        finally:
            boundary = round(share * self._apart)
            self.boundary, self.checks = self.boundary + boundary, self.checks + self._apart - boundary
            self._apart = None

    def ends(self, ta: Array, tb: Array, k: int) -> Any:
        """The same for ends of stretches, which move at these speeds, of which the first k count: (k or more, S)."""
        ta, tb = ta[:k], tb[:k]
        count = ta.shape[1] + tb.shape[1]
        moving = np.count_nonzero(ta.any(axis=0)) + np.count_nonzero(tb.any(axis=0))
        return self.apart(moving / count if count else 0.0)

    def stretches(self, there: int, kept: int) -> None:
        """How many stretches of the innermost variable there were, and on how many the integrand is not zero."""
        if self._apart is None:
            self.cells, self.empty = self.cells + kept, self.empty + there - kept

    def saw(self, surface: Term, roots: Sequence[tuple[Any, Sequence[Any]]], lo: Any, hi: Any, asked: bool) -> None:
        """The roots of a surface over one variable with their speeds, and the bounds that they may lie between."""
        seen = self.surfaces.setdefault(surface, SurfaceCount())
        seen.asked = seen.asked or asked
        low, high = np.minimum(lo, hi), np.maximum(lo, hi)
        for root, speeds in roots:
            inside = (root > low) & (root < high)
            seen.met = seen.met or bool(np.any(inside))
            seen.moves = seen.moves or any(s is not None and bool(np.any(inside & (s != 0))) for s in speeds)

    def sampled(self, surface: Term, speeds: Any) -> None:
        """The same of a surface that was met at samples, by its speeds there."""
        seen = self.surfaces.setdefault(surface, SurfaceCount())
        seen.asked = True
        seen.met = True
        seen.moves = seen.moves or bool(np.any(speeds))

    def rename(self, known: frozenset[Term], change: Callable[[Term], Term]) -> None:
        """Give other terms to the surfaces that were met beyond those known; those that become the same are one."""
        met, self.surfaces = self.surfaces, {s: seen for s, seen in self.surfaces.items() if s in known}
        for surface, seen in met.items():
            if surface not in known:
                before = self.surfaces.get(term := change(surface), SurfaceCount())
                self.surfaces[term] = SurfaceCount(
                    before.met or seen.met, before.moves or seen.moves, before.asked or seen.asked
                )

    def told(self, written: Callable[[Term], str]) -> dict[str, Any]:
        """As a part of an estimate's `stats`; `written`: the equation of a surface, in the names of the program."""
        surfaces = [{"surface": written(s), "kept": seen.kept, "why": seen.why}
                    for s, seen in self.surfaces.items()]  # fmt: skip
        return {
            "interior evaluations": self.interior,
            "boundary evaluations": self.boundary,
            "checks at still ends": self.checks,
            "cells": self.cells,
            "empty cells left out": self.empty,
            "members that no surface crosses": self.whole,
            "members looked at": self.looked,
            "surfaces": surfaces,
        }
