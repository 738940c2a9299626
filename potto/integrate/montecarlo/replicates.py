"""Means of samples that come in chunks, and what is known of their errors.

Owns `Moments` (independent points: a variance) and `Replicates` (several randomizations of one set of points: the
spread of their means). Samples are `Sums`, the last axis the samples; what comes out has no such axis.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct

from potto.integrate.pieces import Sums
from potto.kernels.cells import Array

LOOK_BACK = 5
# The part of a step that is hidden from 16 randomizations once in 1e6 times: (1 - p)^16.
HIDDEN = 0.58


class _Spread(Struct):
    """Mean and variance of one part, put together from those of the chunks (Chan, Golub and LeVeque)."""

    counts: list[int] = []
    means: list[Array] = []
    variances: list[Array] = []

    def add(self, x: Array, spread: bool) -> None:
        n = x.shape[-1]
        mean = np.add.reduce(x, axis=-1) / n
        self.counts.append(n)
        self.means.append(mean)
        if spread:
            off = x - mean[..., None]
            self.variances.append(np.einsum("...i,...i->...", off, off) / n)
        else:
            self.variances.append(np.zeros_like(mean))

    def outcome(self) -> tuple[Array, Array]:
        """The mean, and the variance of the mean."""
        count = sum(self.counts)
        shares = np.array(self.counts) / count
        means, variances = np.stack(self.means, axis=-1), np.stack(self.variances, axis=-1)
        mean = (means * shares).sum(axis=-1)
        variance = (variances * shares).sum(axis=-1) + ((means - mean[..., None]) ** 2 * shares).sum(axis=-1)
        return mean, variance / max(count - 1, 1)


class Moments:
    """The mean of independent samples."""

    def __init__(self) -> None:
        self.parts = {name: _Spread() for name in ("v", "e", "t", "et")}

    def add(self, samples: Sums) -> None:
        for name, part in self.parts.items():
            part.add(getattr(samples, name), name in ("v", "t"))  # nobody asks how errors vary

    @property
    def mean(self) -> Sums:
        return Sums(*(part.outcome()[0] for part in self.parts.values()))

    @property
    def variance(self) -> Sums:
        return Sums(*(part.outcome()[1] for part in self.parts.values()))


class Replicates:
    """Sums of means over several randomizations of the same points, which come one after the other in the samples.

    The spread of their means says little where all of them happen to agree: of an integrand that jumps across one
    coordinate, the N points of each see only which of two neighbouring points the jump falls between, and the rare
    outcome may not be among them. Two things stand against that: the spread is not taken to shrink faster than 1/N from
    what it was with fewer points, and in one dimension the largest step between neighbours counts as such a jump.
    """

    def __init__(self, count: int, widening: float) -> None:
        self.count, self.widening = count, widening
        self.totals: dict[str, Any] = dict.fromkeys(("v", "e", "t", "et"), 0.0)
        self.fixed: dict[str, Any] = dict.fromkeys(self.totals, 0.0)
        self.steps: dict[str, Any] = dict.fromkeys(("v", "t"), 0.0)
        self.spreads: list[dict[str, Any]] = []

    def add(self, samples: Sums) -> None:
        for name in self.totals:
            self.totals[name] = self.totals[name] + self._apart(getattr(samples, name)).sum(axis=-1)

    def look_for_steps(self, blocks: list[tuple[Array, Sums]]) -> None:
        """Note how much samples at neighbouring points differ, of which there is one in each of n equal parts."""
        if not blocks:
            return
        n = sum(u.shape[1] for u, _ in blocks)
        values = {name: [self._apart(getattr(s, name)) for _, s in blocks] for name in self.steps}
        values = {name: parts for name, parts in values.items() if any(part.any() for part in parts)}
        largest = {name: np.zeros(parts[0].shape[:-2]) for name, parts in values.items()}
        for row in range(self.count):  # one after the other: of all there are more than a cache holds
            places = np.concatenate([u[row] for u, _ in blocks])
            at = np.minimum((places * n).astype(np.int64), n - 1)
            for name, parts in values.items():
                ordered = np.empty((*largest[name].shape, n))
                ordered[..., at] = np.concatenate([x[..., row, :] for x in parts], axis=-1)
                steps = np.abs(np.diff(ordered)).max(axis=-1, initial=0.0)
                largest[name] = np.maximum(largest[name], steps)
        for name, most in largest.items():
            self.steps[name] = self.steps[name] + most

    def _apart(self, x: Array) -> Array:
        return x.reshape(*x.shape[:-1], self.count, x.shape[-1] // self.count)

    def fix(self, sample: Sums) -> None:
        """A term that nothing is drawn for."""
        for name in self.fixed:
            self.fixed[name] = self.fixed[name] + getattr(sample, name)

    def estimate(self, points: int) -> Sums:
        """The mean after `points` of each, twice as many as the time before, and its error."""
        means = {name: self.totals[name] / points + self.fixed[name] for name in self.totals}
        root = self.widening / np.sqrt(self.count)
        self.spreads.append({name: root * means[name].std(axis=-1, ddof=1) for name in ("v", "t")})
        off = {}
        for name, steps in self.steps.items():
            before = [s[name] / 2.0**back for back, s in enumerate(reversed(self.spreads[-LOOK_BACK:]))]
            self.steps[name] = 0.0
            off[name] = np.maximum(np.max(before, axis=0), HIDDEN * steps / points)
        v, e, t, et = (means[name].mean(axis=-1) for name in ("v", "e", "t", "et"))
        return Sums(v, e + off["v"], t, et + off["t"])


def added(terms: list[Sums]) -> Sums:
    """Terms with as many components each, or one that stands for all."""
    first = terms[0]
    v, e, t, et = first.v, first.e, first.t, first.et
    for x in terms[1:]:
        v, e, t, et = v + x.v, e + x.e, t + x.t, et + x.et
    return Sums(v, e, t, et)
