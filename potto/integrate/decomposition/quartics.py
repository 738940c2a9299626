"""The roots of polynomials whose coefficients are known up to a radius: all of them, in discs.

Owns `RootDiscs` and `roots_in_discs`. Eigenvalues of the companion matrix are near the roots; the discs of radius
n*|w_i| around them, w_i the corrections of Weierstrass, hold all roots, and as many of them as hang together hold as
many roots (Smith 1970, Error bounds for zeros of a polynomial). That takes nothing for granted of how the eigenvalues
came about, and holds for all polynomials within the radii at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct

from potto.integrate.decomposition.balls import Ball
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Ints

ROUNDED = 16 * EPS  # of the sizes of its summands: how far off the value of a polynomial of few terms is


class RootDiscs(Struct, frozen=True):
    """Discs of the complex plane around all roots of polynomials: middles and radii (n, N), infinite where nothing is
    known. together: (n, n, N) which of them hang together."""

    middle: Array
    radius: Array
    together: Bools

    @property
    def real(self) -> Bools:
        """The discs in which a real root may be."""
        touching = np.abs(self.middle.imag) <= self.radius
        return np.asarray((self.together & touching[None]).any(axis=1))

    def united(self, which: Ints, at: Ints) -> Ball:
        """What holds the real parts of all roots of discs that hang together, around their mean: of roots that are one
        that is much nearer to it than the discs are narrow."""
        real, radius, together = self.middle.real[:, at], self.radius[:, at], self.together[which, :, at].T
        mean = (real * together).sum(axis=0) / together.sum(axis=0)
        return Ball(mean, np.where(together, np.abs(real - mean) + radius, 0.0).max(axis=0, initial=0.0))


def roots_in_discs(polynomial: Ball) -> RootDiscs:
    """Discs around the roots of polynomials (n + 1, N), the constants first."""
    v = polynomial.v
    n = v.shape[0] - 1
    known = np.isfinite(v / v[-1]).all(axis=0)
    companions = np.zeros((v.shape[1], n, n))
    companions[:, range(1, n), range(n - 1)] = 1.0
    companions[known, :, -1] = (-v[:-1] / v[-1]).T[known]
    middle = np.linalg.eigvals(companions).T.astype(complex)
    radius, together = _discs(polynomial, middle, known)
    close = np.nonzero(known & (together.sum(axis=(0, 1)) > n))[0]
    if close.size:
        some = polynomial[:, close]
        middle[:, close] = _spread(some, middle[:, close])
        radius[:, close], together[:, :, close] = _discs(some, middle[:, close], known[close])
    return RootDiscs(middle, radius, together)


def _discs(polynomial: Ball, middle: Array, known: Bools) -> tuple[Array, Bools]:
    """The radii (n, N) of discs around approximations, and which of them hang together."""
    n, lead = middle.shape[0], polynomial[-1]
    apart = middle[:, None] - middle[None]
    apart[range(n), range(n)] = np.abs(lead.v) - lead.e
    largest = np.abs(_value(polynomial, middle)) + _rounding(polynomial, middle)
    radius = n * largest / np.abs(apart.prod(axis=1))
    radius = np.where(known & (np.abs(lead.v) > lead.e) & np.isfinite(radius), radius, np.inf)
    gap = np.abs(middle[:, None] - middle[None])
    together: Any = ~(gap > radius[:, None] + radius[None])
    for _ in range(n.bit_length() - 1):  # what hangs together with what hangs together
        together = (together[:, :, None] & together[None]).any(axis=1)
    return radius, together


def _spread(polynomial: Ball, middle: Array) -> Array:
    """Approximations (n, N), those that rounding does not tell from a multiple root spread on a circle about their mean
    as large as that leaves in doubt: Smith's discs grow without bound as approximations come closer than that."""
    n, batch = middle.shape
    done, at = np.zeros((n, batch), dtype=bool), np.arange(batch)
    lead = np.abs(polynomial.v[-1])
    for k in range(n, 1, -1):
        for i in range(n):
            gap = np.abs(middle - middle[i])
            order = np.argsort(gap, axis=0, kind="stable")
            own, others = order[:k], order[k:]
            mean = middle[own, at].mean(axis=0)
            beside = np.abs(mean - middle[others, at]).prod(axis=0)
            reach = (_rounding(polynomial, mean[None])[0] / (lead * beside)) ** (1 / k)
            wide = np.abs(middle[own, at] - mean).max(axis=0)
            some = np.nonzero((wide <= reach) & np.isfinite(reach) & ~done[own, at].any(axis=0))[0]
            angles = np.exp(1j * np.pi * (2 * np.arange(k) + 1) / k)[:, None]
            middle[own[:, some], some] = mean[some] + reach[some] * angles
            done[own[:, some], some] = True
    return middle


def _value(polynomial: Ball, places: Array) -> Array:
    """Polynomials at places (P, N)."""
    found = np.zeros(places.shape, dtype=complex)
    for v in polynomial.v[::-1]:
        found = found * places + v
    return found


def _rounding(polynomial: Ball, places: Array) -> Array:
    """How far off those are: by rounding, and by the radii of the coefficients."""
    size, far = np.zeros(places.shape), np.abs(places)
    for v, e in zip(polynomial.v[::-1], polynomial.e[::-1], strict=True):
        size = size * far + ROUNDED * np.abs(v) + e
    return size
