"""An integral all about which is settled in a region of its parameters, as one straight function of Python.

Owns `SettledRegion`, and `accurate`. Which parameters are read, where they lie, what the function of machine code is
told, how many cells there are and how many tangents, is the same at every call: where there is machine code, what is
left around it is written out once, as a text with these numbers in it; where there is none, all that numpy does is
(`sum_text`), as soon as that pays. To find all this out again takes as long as the nodes do.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from types import CodeType
from typing import Any

import numpy as np
from msgspec import Struct

from potto.integrate.fixed.moving_sums import MovingTotals, summed
from potto.integrate.fixed.proved_sums.alone import LEFT, RegionPart
from potto.integrate.fixed.proved_sums.sum_text import RepeatedSum, SumText
from potto.integrate.fixed.straight import StraightIntegral
from potto.integrate.pieces import Evaluator, numbers_at
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.proved_orders import Region
from potto.kernels.making import counts
from potto.kernels.native.objects import Loaded
from potto.kernels.native.promotion import Promotion

# How far off a rule may be for a sum that cancels, as a part of what it is when nothing does.
NOISE = 1e-12
# Up to how many cells their numbers have names of their own.
FEW = 4
Box = Sequence[tuple[str, float, float]]
Faces = Sequence[tuple[RegionPart, Loaded]]
At = Callable[[dict[str, Any]], MovingTotals | None]


class SettledRegion(Struct, eq=False):
    """An integral all over a region of its parameters, which run along tangents that stay the same.

    machine: one that keeps track of rounding. box: per parameter, between which numbers. truncation: a bound of what
    the rule leaves out, of the value and each tangent. sums: those that numpy adds up. straight: the function for the
    region; None as long as these have not taken long enough. awaited: the function of machine code for which numpy
    stands in until it is due; None where it does for good.
    """

    plan: StraightIntegral
    region: Region
    machine: Evaluator
    box: tuple[tuple[str, float, float], ...]
    truncation: list[float]
    sums: RepeatedSum
    straight: At | None
    awaited: Promotion | None

    @classmethod
    def of(
        cls, plan: StraightIntegral, region: Region, machine: Evaluator, box: Mapping[str, tuple[float, float]],
        truncation: list[float], faces: Faces | None, awaited: Promotion | None, sums: RepeatedSum,
    ) -> SettledRegion:  # fmt: skip
        """faces: integrands with their functions of machine code; none where numpy adds up."""
        places = tuple((name, low, high) for name, (low, high) in box.items())
        straight = by_machine_code(places, faces, truncation, machine) if faces else None
        return cls(plan, region, machine.tracking(), places, truncation, sums, straight, awaited)

    def at(self, env: dict[str, Any]) -> MovingTotals | None:
        """The value and its tangents; None outside of the region, and where they are not accurate enough."""
        if self.awaited is None:
            return self._added(env) if self.straight is None else self.straight(env)
        if self.awaited.due:
            return None
        with self.awaited.by_numpy():
            return self._added(env) if self.straight is None else self.straight(env)

    def _added(self, env: dict[str, Any]) -> MovingTotals | None:
        """What numpy adds up, by the function for the region once that pays."""
        for name, low, high in self.box:
            if not low <= env[name].v <= high:
                return None
        text = self.sums.text(lambda: self._text(env))
        if text is not None:
            self.straight = text.at_region(self.region, _limits(self.box, self.truncation, self.machine))
            return self.straight(env)  # type: ignore[no-any-return]
        plan, machine, start = self.plan, self.machine, time.thread_time()
        with np.errstate(all="ignore"):
            frame = numbers_at(plan.frames[0], machine, env)
            found = summed(plan.variables, plan.frames, self.region, machine, env, frame)
        self.sums.spent += time.thread_time() - start
        return None if found is None else accurate(found, self.truncation, machine.rtol, machine.atol)

    @np.errstate(all="ignore")
    def _text(self, env: Mapping[str, Any]) -> SumText:
        after = _enough(len(self.truncation), "nodes")
        return SumText.of(self.plan, self.region, self.machine, env, _inside(self.box), after)


def accurate(found: MovingTotals, truncation: Sequence[float], rtol: float, atol: float) -> MovingTotals | None:
    """The answer, if it is as accurate as was asked for, or as its rounding allows."""
    errors, unit, least, part = [], EPS * max(found.gross), 0.5 * atol, 0.5 * rtol
    for x, rounding, gross, beyond in zip(found.number, found.error, found.gross, truncation, strict=True):
        asked = part * abs(x)
        if asked < least:
            asked = least
        if not rounding <= asked or not (beyond <= asked or beyond <= NOISE * gross or beyond <= unit):
            return None
        errors.append(rounding + beyond)
    return MovingTotals(found.number, errors, found.gross, found.nodes)


def by_machine_code(box: Box, faces: Faces, truncation: Sequence[float], machine: Evaluator) -> At:
    """What `SettledRegion.at` is where machine code adds up."""
    k1, nodes = len(truncation), sum(part.nodes for part, _ in faces)
    scope = {"counts": counts, "left": LEFT, **_limits(box, truncation, machine)}
    lines = _inside(box)
    for i, (part, function) in enumerate(faces):
        scope |= {f"idle{i}": part.idle, f"layout{i}": part.layout, f"call{i}": function.call, f"share{i}": part.share}
        lines += _of_face(part, i, k1)
    lines += [f"counts.native_points += {nodes}", *_enough(k1, f"{nodes}")]
    exec(_compiled("def at(env):\n    " + "\n    ".join(lines) + "\n"), scope)
    return scope["at"]  # type: ignore[no-any-return]


def _limits(box: Box, truncation: Sequence[float], machine: Evaluator) -> dict[str, Any]:
    """What `_inside` and `_enough` call by name."""
    ends = {f"{end}{i}": place[at] for i, place in enumerate(box) for end, at in (("low", 1), ("high", 2))}
    beyond = {f"beyond{d}": bound for d, bound in enumerate(truncation)}
    return {"MovingTotals": MovingTotals, "half": 0.5 * machine.rtol, "least": 0.5 * machine.atol, **ends, **beyond}


def _inside(box: Box) -> list[str]:
    """The lines that see to it that parameters are in the region."""
    return [f"if not low{i} <= env[{name!r}].v <= high{i}: return None" for i, (name, _, _) in enumerate(box)]


def _enough(k1: int, nodes: str) -> list[str]:
    """The lines that end with the numbers n0 ..., their errors e0 ... and their sizes g0 ..., if these are what
    `accurate` lets pass."""
    lines, every = [], range(k1)
    for d in every:
        lines += [
            f"asked = half*abs(n{d})",
            "if asked < least: asked = least",
            f"if not e{d} <= asked or not (beyond{d} <= asked or beyond{d} <= {NOISE!r}*g{d} or "
            f"beyond{d} <= {EPS!r}*{_largest([f'g{c}' for c in every])}): return None",
        ]
    numbers, errors, gross = (", ".join(row) for row in zip(*((f"n{d}", f"e{d} + beyond{d}", f"g{d}") for d in every),
                                                            strict=True))  # fmt: skip
    return [*lines, f"return MovingTotals([{numbers}], [{errors}], [{gross}], {nodes})"]


@lru_cache(maxsize=512)
def _compiled(text: str) -> CodeType:
    return compile(text, "<settled>", "exec")


def _of_face(part: RegionPart, i: int, k1: int) -> list[str]:
    """The lines for an integrand, which add to the numbers n0 ..., their errors e0 ... and their sizes g0 ..."""
    count, add = len(part.cells), "+=" if i else "="
    numbers = ", ".join(f"env[{n!r}].v" if d < 0 else f"env[{n!r}].t[{d}]" for n, d in part.reads)
    rows = [[f"r{row}_{cell}" for cell in range(count)] if count <= FEW else [f"r{row}"] for row in range(3 * k1 + 1)]
    targets = ", ".join(f"({''.join(f'{x}, ' for x in row)})" if count <= FEW else row[0] for row in rows)
    lines = [
        f"try: layout = idle{i}.pop()",
        f"except IndexError: layout = layout{i}()",
        f"layout.pack(layout.constants, 0, {numbers})" if numbers else "pass",
        f"call{i}(*layout.where)",
        f"{targets}, = layout.out.tolist()",
        f"idle{i}.append(layout)",
        f"if not ({' and '.join(f'{x} > 0' for x in rows[-1])}): return None"
        if count <= FEW
        else f"if not min({rows[-1][0]}) > 0: return None",
    ]
    for d in range(k1):
        own, most, off = (rows[part * k1 + d] for part in range(3))
        sizes = " + ".join(f"abs({x})" for x in own) if count <= FEW else f"sum(map(abs, {own[0]}))"
        lines += [
            f"most = {_total(most, count)}",
            f"size = {sizes}",
            "if size > most: most = size",
            f"n{d} {add} {_total(own, count)}",
            f"e{d} {add} share{i}*({_total(off, count)}) + left*most",
            f"g{d} {add} most",
        ]
    return lines


def _total(row: Sequence[str], count: int) -> str:
    return " + ".join(row) if count <= FEW else f"sum({row[0]})"


def _largest(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"max({', '.join(names)})"
