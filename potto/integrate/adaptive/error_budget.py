"""What the integrals of a batch amount to so far, and so how far off each of their pieces may be.

Owns `Tally`, and `filled`: where an integrand takes up little of its range, nodes that hardly count need less accuracy.
"""

from __future__ import annotations

import numpy as np

from potto.integrate.panels.iterated import siblings
from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import Pieces
from potto.kernels.cells import Array, Ints

LEAST = 1e-6  # the relative accuracy that is asked of every node


class Tally:
    """Running totals per integral, by which tolerances are measured: (m * (1 + k), B), and how many pieces there are.

    gross: what the pieces amount to without regard to sign, which is what rounding is measured by: (B,).

    For the outermost variable the magnitude of the result counts; further in, where results are added up once more,
    the largest magnitude of what is added up, among all that go into the same answer.
    """

    def __init__(self, work: PanelBatch, p: Pieces) -> None:
        owner = work.seg.owner[p.segment]
        self.count = np.bincount(owner, minlength=work.batch)
        x = self.channels(work, p)
        self.total = np.empty((x.shape[0], work.batch))
        for i, row in enumerate(x):
            self.total[i] = np.bincount(owner, row, minlength=work.batch)
        self.gross: Array = np.zeros(work.batch)
        self.gross += np.bincount(owner, p.size.max(axis=0), minlength=work.batch)
        self.scale: Array | None = None

    def channels(self, work: PanelBatch, p: Pieces) -> Array:
        x = p.size if work.number else p.integral
        rows = x.shape[0] // work.width
        return x.reshape(work.width, rows, -1)[:, : 1 + work.k].reshape(-1, x.shape[-1])

    def replace(self, work: PanelBatch, old: Pieces, new: Pieces) -> None:
        for p, sign in ((old, -1), (new, 1)):
            owner = work.seg.owner[p.segment]
            np.add.at(self.count, owner, sign)
            np.add.at(self.gross, owner, sign * p.size.max(axis=0))
            for i, row in enumerate(self.channels(work, p)):
                np.add.at(self.total[i], owner, sign * row)
        self.scale = None

    def whole(self, work: PanelBatch) -> Array:
        """The size of the answer that each of these integrals goes into, values and tangents together: (B,)."""
        largest = np.abs(self.total).max(axis=0)
        return siblings(largest, work.root) if work.number else largest

    def shares(self, work: PanelBatch, owner: Ints) -> Array:
        """The error that one piece of each of these integrals may have: (m * (1 + k), P)."""
        if self.scale is None:
            scale = np.abs(self.total)
            if work.number:
                scale = np.stack([siblings(row, work.root) for row in scale])
            self.scale = np.maximum(work.machine.atol, work.machine.rtol * scale)
        shares: Array = self.scale[:, owner] / (2 * self.count[owner])
        if work.slack is not None:  # what is not resolved at all says nothing of its error
            most = np.maximum(1.0, LEAST / work.machine.rtol)
            shares = shares * np.minimum(work.slack[owner], most)
        return shares


def filled(work: PanelBatch, p: Pieces) -> Array:
    """Which part of its range each integrand of a batch takes up, at the least: its mean over its largest, (B,)."""
    owner, length = work.seg.owner[p.segment], (work.seg.b - work.seg.a)[p.segment] * (p.u1 - p.u0)
    reach = np.bincount(owner, length, minlength=work.batch)
    share = np.ones(work.batch)
    for row in p.size.reshape(work.width, -1, owner.size)[:, : 1 + work.k].reshape(-1, owner.size):
        most = np.zeros(work.batch)
        np.maximum.at(most, owner, row / length)
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.bincount(owner, row, minlength=work.batch) / (most * reach)
        share = np.where(most > 0, np.fmin(share, np.nan_to_num(part)), share)
    return share
