"""Integrals that have no value, or none that refinement comes near to.

Owns `given_up` and `endless`. Where pieces at an end of a segment are as small as they get and still err, the integrand
grows there like a power of the distance, u^-a. From a = 1 on its integral is infinite: the answer is inf or -inf, or
nan where both come together. Where a is less, so that there is a value which is out of reach, or where such a piece
lies elsewhere, at a pole, the answer is nan. It is never a number.

A derivative is infinite where what it is the integral of grows so, in both of its forms (`forms`), down to the smallest
distances from the end that doubles have: of the area of x*y < t at t = 0, where sections move at the speed 1/x.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from potto.integrate.adaptive.reynolds import Totals
from potto.integrate.adaptive.saddles import beside_saddles
from potto.integrate.events import AT_A_SADDLE, BOUNDLESS
from potto.integrate.panels.iterated import siblings
from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import Pieces, Sums
from potto.integrate.rules import substitution
from potto.integrate.rules.gauss import EPS, gauss
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Ints

# The error of a value, as a part of what is added up, from which on it is no longer one; that of a piece to blame.
HOPELESS, BLAMED = 1e-2, 1e-3
# How many times the errors of integrals further in an error may be that is nothing else.
NOISE = 8.0
# How far from an end the power is read off, in lengths of the segment (or their roots, where it is a turning point),
# and how well that tells it from 1.
NEAR, NEAR_TURNING = (1e-9, 1e-10, 1e-11, 0.3, 0.5, 0.8), (1e-4, 1e-5, 1e-6, 0.3, 0.5, 0.8)
POWER = 1e-5
# Pieces that lie so close to an end are at it.
AT = 1e-6
# Up to which error, as a part of a derivative or of its integral, a derivative is not looked at; from how far from an
# end on, in lengths of the segment, and down to how far, in them and in units of the last place, it is; how many times.
SETTLED = 1e-2
NEAREST, LEAST, STEPS_OFF, LOOKS = 1e-9, 1e-200, 8, 5
# How many roundings of its ends a segment is long, at the least, whose values count.
SLIVER = 256
# A piece within a segment that is as small as this and still errs lies at a pole.
SMALLEST = 1e-12


def given_up(work: PanelBatch, p: Pieces, found: Totals, sums: Sums) -> Sums:
    """The sums, without the values of integrals that diverge at the end of a segment."""
    error, size = found.error[:, 0], found.size[:, 0]
    scale = np.stack([siblings(row, work.root) for row in size]) if work.number else size
    hopeless: Any = np.asarray(~(error <= HOPELESS * scale) & (size > 0))
    if not hopeless.any() or work.machine.exhausted():
        return sums
    owner = work.seg.owner[p.segment]
    errors = p.error.reshape(work.width, -1, p.segment.size)[:, 0]
    blamed = (~(errors <= BLAMED * size[:, owner]) & hopeless[:, owner]).any(axis=0)
    sharp = _sharp(work.seg)
    blamed &= ~_noise(work, p, errors, blamed) & sharp[p.segment]
    grows = np.zeros((work.width, work.batch, 2), dtype=bool)  # to inf, to -inf
    lost = np.zeros((work.width, work.batch), dtype=bool)
    low, high = p.u0 < AT, p.u1 > 1 - AT
    inside = blamed & (p.u1 - p.u0 < SMALLEST) & ~low & ~high
    if not inside.any() and not (blamed & (low | high)).any():
        return sums
    index = np.nonzero(hopeless.any(axis=0)[work.seg.owner] & sharp)[0]
    for upper in (False, True):
        guilty = np.isin(index, p.segment[blamed & (high if upper else low)])
        if index.size:
            sign = _growth(work, index, upper)
            sign = np.where(guilty | (np.abs(sign) == 1), sign, 0.0)
            for c in range(work.width):  # several segments may have one owner
                np.logical_or.at(grows[c, :, 0], work.seg.owner[index], sign[c] > 0)
                np.logical_or.at(grows[c, :, 1], work.seg.owner[index], sign[c] < 0)
                lost[c] |= np.isin(np.arange(work.batch), work.seg.owner[index[np.isnan(sign[c])]])
    up, down = grows[..., 0] & hopeless, grows[..., 1] & hopeless
    poles = np.zeros(work.batch, dtype=bool)
    poles[owner[inside]] = True
    lost = ((lost | (poles & ~up & ~down)) & hopeless) | (up & down)
    if not (up | down | lost).any():
        return sums
    v = np.where(lost, np.nan, np.where(up, np.inf, np.where(down, -np.inf, sums.v)))
    gone = ~np.isfinite(v) & hopeless
    return Sums(v, np.where(gone, np.inf, sums.e), np.where(gone[:, None], np.nan, sums.t),
                np.where(gone[:, None], np.inf, sums.et), gross=sums.gross)  # fmt: skip


def endless(work: PanelBatch, found: Totals) -> Array | None:
    """To which infinity derivatives go whose integrals are finite, 0 for others, nan for both at once: (k, B).

    None where all are finite, as far as can be told.
    """
    if work.number or not work.k or work.machine.overdrawn():
        return None
    error = found.moving[1] if found.fixed is None else np.minimum(found.moving[1], found.fixed[1])
    rough: Any = ~(error <= SETTLED * np.abs(found.moving[0])) & ~(error <= SETTLED * found.size[:, :1])
    index = np.nonzero(rough.any(axis=(0, 1))[work.seg.owner] & np.isfinite(work.seg.a + work.seg.b))[0]
    if not index.size:
        return None
    goes = np.zeros((2, work.k, work.batch), dtype=bool)  # up, down
    for upper in (False, True):
        for d, sign in enumerate(_without_end(work, index, upper)):
            goes[0, d, work.seg.owner[index[sign > 0]]] = True
            goes[1, d, work.seg.owner[index[sign < 0]]] = True
    rest = np.nonzero((rough.any(axis=0) & ~goes.any(axis=0)).any(axis=0))[0]
    if rest.size:
        saddles = beside_saddles(work, rest)
        goes |= np.stack((saddles > 0, saddles < 0))
        if saddles.any():
            work.machine.note(AT_A_SADDLE, work.below(np.nonzero(saddles.any(axis=0))[0]))
    up, down = goes & rough.any(axis=0)
    if not goes.any():
        return None
    work.machine.note(BOUNDLESS, work.below(np.nonzero((up | down).any(axis=0))[0]))
    return np.where(up & down, np.nan, np.where(up, np.inf, np.where(down, -np.inf, 0.0)))


def _without_end(work: PanelBatch, index: Ints, high: bool) -> list[Array]:
    """Of each direction the sign of what is integrated where it grows like 1/u, or faster, down to the smallest
    distances u from one end of a segment, in both forms of the derivative; else 0: (S,) each."""
    seg = work.seg.pick(index)
    end, reach = (seg.b if high else seg.a)[:, None], (seg.b - seg.a)[:, None]
    least = np.maximum(STEPS_OFF * EPS * np.abs(end), LEAST * reach)
    x = end + (-1 if high else 1) * NEAREST * reach * (least / (NEAREST * reach)) ** np.linspace(0, 1, LOOKS)
    u = np.abs(x - end)
    numbers, _, _ = work.integrand(index, x)
    label = 1 - u / reach if high else u / reach
    signs = []
    for d in range(work.k):
        v, dv = substitution.velocity(seg, label, d)
        fixed = numbers[:, 1 + d]
        forms = [fixed, fixed + numbers[:, 1 + work.k] * v + numbers[:, 0] * dv] if work.moving else [fixed]
        with np.errstate(all="ignore"):
            power = [np.log(np.abs(g[..., 1:] / g[..., :-1])) / np.log(u[:, :-1] / u[:, 1:]) for g in forms]
            off = POWER + 4 * EPS * np.abs(end) / u[:, 1:]
        steady = [((p >= 1 - off) & (g[..., 1:] * g[..., :1] > 0)).all(axis=-1)
                  for p, g in zip(power, forms, strict=True)]  # fmt: skip
        sign = np.where(np.logical_and.reduce(steady), np.sign(forms[0][..., -1]), 0.0)
        signs.append(sign[np.abs(sign).argmax(axis=0), np.arange(index.size)])
    return signs


def _sharp(seg: Segments) -> Bools:
    """Segments that are longer than a few roundings of their ends: on others nodes say nothing of how values grow."""
    size = np.maximum(np.abs(seg.a), np.abs(seg.b))
    return np.asarray((seg.b - seg.a > SLIVER * EPS * size) | ~np.isfinite(size))


def _noise(work: PanelBatch, p: Pieces, errors: Array, blamed: Array) -> Bools:
    """Which of the pieces err by no more than the integrals further in do, which cancel: (P,)."""
    found: Bools = np.zeros(p.segment.size, dtype=bool)
    index = np.nonzero(blamed)[0]
    if work.last or not index.size:
        return found
    rule, seg = gauss(11), work.seg.pick(p.segment[index])
    u, rest, du = substitution.grade(p.u0[index], p.u1[index], p.end[index], rule.nodes)
    x, dx, label = substitution.points(seg, u, rest)
    _, inner = work.values(seg, p.segment[index], substitution.off_the_ends(seg, x), label, dx * du)
    if inner is not None:
        off = (inner @ rule.weights).reshape(work.width, -1, index.size)[:, 0]
        found[index] = (np.isfinite(off) & (errors[:, index] <= NOISE * off)).all(axis=0)
    return found


def _growth(work: PanelBatch, index: Ints, high: bool) -> Array:
    """1 or -1 where the integrand goes to inf or -inf at an end too fast to be integrated, nan where it is not known
    what it does there, 0 where it does nothing of the kind, next to what it is elsewhere, or no longer does close to
    the end: (m, S)."""
    seg = work.seg.pick(index)
    turning = seg.turning
    end = np.abs(seg.b if high else seg.a)
    near = np.where(turning[:, None], np.array(NEAR_TURNING), np.array(NEAR))
    near = np.concatenate((near, near[:, 2:3]), axis=1)
    if (nearer := ~turning & (end < NEAREST * NEAREST * (seg.b - seg.a))).any():  # a peak may be narrower by far
        near[nearer, -1] = LEAST
    u, rest = (1 - near, near) if high else (near, 1 - near)
    x, slope, label = substitution.points(seg, u, rest)
    h, inner = work.values(seg, index, x, label, slope)
    h = h.reshape(work.width, -1, *h.shape[1:])[:, 0]
    with np.errstate(all="ignore"):
        power = np.log(h[..., 2] / h[..., 1]) / np.log(10.0)
        before = np.log(h[..., 1] / h[..., 0]) / np.log(10.0)
        nearest = np.where(turning, NEAR_TURNING[2] ** 2, NEAR[2]) * (seg.b - seg.a)
        off = POWER + 4 * EPS * np.abs(seg.b if high else seg.a) / nearest
        least = 1 - np.where(np.isfinite(off), off, POWER)
        steady = np.isinf(h[..., 2]) | ((power >= least) & (before >= least))
        counts = ~(np.abs(h[..., 2]) * near[:, 2] < BLAMED * np.abs(h[..., 3:-1]).max(axis=-1))
        counts &= ~(np.abs(h[..., -1]) * near[:, -1] < BLAMED * np.abs(h[..., 2]) * near[:, 2])
    if inner is not None:  # what integrals further in may be off says nothing of growth
        own = inner.reshape(work.width, -1, *inner.shape[1:])[:, 0, :, 2]
        counts &= ~(np.isfinite(own) & (np.abs(h[..., 2]) <= NOISE * own))
    return np.where(counts, np.where(steady, np.sign(h[..., 2]), np.nan), 0.0)
