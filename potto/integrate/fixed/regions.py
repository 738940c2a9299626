"""Regions of parameters: what is proved of rules all over them, and where their cells are the same all over.

Owns `region_of`, `known` and `settle`. A proof holds for all parameters near those that it was asked for. Where
enclosures show that these have the same cells in the same order, nobody need look for the cells again.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping

from msgspec import Struct

from potto.core.terms import Const, children
from potto.integrate.fixed.straight import StraightIntegral
from potto.integrate.rules.intervals import Interval, enclosure
from potto.integrate.rules.proved_orders import FrameCell as Stretch
from potto.integrate.rules.proved_orders import Region, proved
from potto.kernels.making import making

# The truncation error that is proved for the value, as a part of the accuracy that is asked for.
MARGIN = 1e-3
# Nobody gains by proofs for less than this.
LOOSEST = 1e-8
# A region of parameters: this part of the power of two below a parameter's size, or below the first variable's range.
REGION = 2.0**-5
TINY = 1e-280
# Into how many parts a region is cut along each parameter where its cells are not the same all over: odd numbers, so
# that parts lie in the middle of regions as well.
PARTS = 1, 15, 225
MOST_REGIONS = 512
# How far apart cuts are all over a region, as a part of the range: far more than their rounding, which sums tell.
APART = 1e-6
UNKNOWN = object()

Path = tuple[tuple[int, int], ...]
Places = tuple[tuple[str, float, float], ...]  # per parameter the middle of the region in which it lies, the radius


def _around(values: Mapping[str, float], size: Mapping[str, float], part: int = 1) -> Places | None:
    """The region in which parameters of this size lie, or one of its parts; None where they are too small for one."""
    places = []
    for name, value in values.items():
        step = math.ldexp(REGION, math.frexp(size[name])[1] - 1) / part
        if step < TINY:
            return None
        places.append((name, round(value / (2 * step)) * 2 * step, step))
    return tuple(places)


def _all_over(plan: StraightIntegral, of_parameters: Mapping[str, Interval]) -> tuple[Stretch, ...] | None:
    """The cells that there are all over a box; None where they may not be the same, or cuts be close together, or have
    other formulas."""
    box = dict(of_parameters)
    choices = enclosure(tuple([choice for choice, _ in plan.held]), box)
    if any(low != side or high != side for (low, high), (_, side) in zip(choices, plan.held, strict=True)):
        return None
    return _over(plan, box, 0, ())


def _over(plan: StraightIntegral, box: dict[str, Interval], i: int, path: Path) -> tuple[Stretch, ...] | None:
    """The same from the i-th variable on, within the stretches of a path; those of the variables are put into `box`."""
    if i == len(plan.variables):
        sides = enclosure(children(plan.surfaces.body), box)
        if any(not (lo > 0 or hi < 0) for lo, hi in sides):
            return None
        face = plan.face(tuple(bool(lo > 0) for lo, _ in sides))
        return () if isinstance(face, Const) and face.value == 0 else (Stretch(path, face),)
    ends = enclosure(plan.items[i], box)
    (a0, a1), (b0, b1) = ends[:2]
    gap = APART * (b1 - a0)
    rows = ((lo, hi, row) for row, (lo, hi) in enumerate(ends[2:], 2))
    kept = [(a0, a1, 0), *sorted(r for r in rows if not (r[1] < a0 - gap or r[0] > b1 + gap)), (b0, b1, 1)]
    if any(not (b[0] - a[1] > gap) for a, b in itertools.pairwise(kept)):
        return None
    cells: tuple[Stretch, ...] = ()
    for a, b in itertools.pairwise(kept):
        box[plan.variables[i]] = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]))
        further = _over(plan, box, i + 1, (*path, (a[2], b[2])))
        if further is None:
            return None
        cells += further
    return cells


def region_of(
    plan: StraightIntegral,
    cells: tuple[Stretch, ...],
    values: Mapping[str, float],
    reach: float,
    shortest: float,
    rtol: float,
) -> tuple[Region, Places] | None:
    """What is known of the rules for these cells, in the region in which the parameters lie; proved once.

    Regions are as large as the parameters, or as the domain where that is larger; if nothing can be proved of those,
    as the parameters alone, then as the shortest stretch.
    """
    sizes = [{n: max(abs(v), reach) for n, v in values.items()}]
    if any(abs(v) < reach / 8 for v in values.values()):
        sizes.append({n: abs(v) or reach for n, v in values.items()})
    if shortest < reach / 8:
        sizes.append({n: min(abs(v) or reach, shortest) for n, v in values.items()})
    for size in sizes:
        places = _around(values, size)
        if places is None:
            return None
        key = (cells, places, rtol)
        found = plan.regions.get(key, UNKNOWN)
        if found is UNKNOWN:
            if len(plan.regions) >= MOST_REGIONS:
                plan.regions.clear()
            middle, radius = {n: m for n, m, _ in places}, {n: r for n, _, r in places}
            with making:
                found = proved(plan.variables, plan.items, cells, middle, radius, MARGIN * rtol)
            plan.regions[key] = found
        if found is not None:
            return found, places  # type: ignore[return-value]
    return None


class Settlement(Struct, frozen=True):
    """A part of a region in which the cells are the same all over, so that they need not be looked for."""

    region: Region
    box: dict[str, Interval]


def _parts(values: Mapping[str, float], reach: float) -> Iterator[Places]:
    """The regions of parameters where the first variable runs so far, and their parts, that get smaller."""
    if 0 < reach < math.inf:
        for part in PARTS:
            places = _around(values, {n: max(abs(v), reach) for n, v in values.items()}, part)
            if places is not None:
                yield places


def known(plan: StraightIntegral, values: Mapping[str, float], reach: float, rtol: float) -> Settlement | None:
    """What is settled about these parameters."""
    for places in _parts(values, reach):
        found: Settlement | None = plan.settled.get((places, rtol))
        if found is not None and _within(values, found.box):
            return found
    return None


def settle(
    plan: StraightIntegral, region: Region, proved_in: Places, values: Mapping[str, float], reach: float, rtol: float
) -> None:
    """Keep what was proved of a region, for the largest part of it about these parameters that has the same cells all
    over; of larger ones that they have not."""
    for places in _parts(values, reach):
        if (places, rtol) in plan.settled:
            continue
        box = {
            name: (max(middle - radius, least - most), min(middle + radius, least + most))
            for (name, middle, radius), (_, least, most) in zip(places, proved_in, strict=True)
        }
        same = _within(values, box) and _all_over(plan, box) == region.cells
        if len(plan.settled) >= MOST_REGIONS:
            plan.settled.clear()
        plan.settled[places, rtol] = Settlement(region, box) if same else None
        if same:
            return


def _within(values: Mapping[str, float], box: Mapping[str, Interval]) -> bool:
    return all(box[name][0] <= value <= box[name][1] for name, value in values.items())
