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
    v, e = polynomial.v, polynomial.e
    n = v.shape[0] - 1
    known = np.isfinite(v / v[-1]).all(axis=0)
    companions = np.zeros((v.shape[1], n, n))
    companions[:, range(1, n), range(n - 1)] = 1.0
    companions[known, :, -1] = (-v[:-1] / v[-1]).T[known]
    middle: Any = np.linalg.eigvals(companions).T.astype(complex)
    value, size, off = (np.zeros(middle.shape, of) for of in (complex, float, float))
    for k in reversed(range(n + 1)):
        value, size, off = value * middle + v[k], size * np.abs(middle) + np.abs(v[k]), off * np.abs(middle) + e[k]
    apart = middle[:, None] - middle[None]
    apart[range(n), range(n)] = np.abs(v[-1]) - e[-1]
    least = np.abs(apart.prod(axis=1))
    radius = n * (np.abs(value) + off + ROUNDED * size) / least
    radius = np.where(known & (np.abs(v[-1]) > e[-1]) & np.isfinite(radius), radius, np.inf)
    together = ~(np.abs(middle[:, None] - middle[None]) > radius[:, None] + radius[None])
    for _ in range(n.bit_length() - 1):  # what hangs together with what hangs together
        together = (together[:, :, None] & together[None]).any(axis=1)
    return RootDiscs(middle, radius, together)
