"""Gauss rules that also say how well they did.

Owns `GaussRule`. From the values of an integrand at the Gauss nodes of a piece one matrix gives its Legendre
coefficients; the first is the integral, and how the others decay tells how far the rule is from the truth. No second
set of nodes is needed. (Decay of coefficients against analyticity: Trefethen, Approximation Theory and Practice, ch. 8
and 19.)
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from msgspec import Struct

from potto.kernels.cells import Array, Bools, Ints

EPS = 2.0**-52
AHEAD = 0.7
# How many times larger than at all nodes an integrand must be at an end of their stretch to be taken for a peak there.
PEAK = 8.0


class GaussRule(Struct, frozen=True):
    """The Gauss rule with n nodes on [0, 1].

    nodes: (n,), weights: (n,). transform: (n, n), values at the nodes times it are the coefficients of the shifted
    Legendre polynomials, scaled so that the k-th counts by its size on [0, 1]. ends: (n, 2), coefficients times it
    are the interpolant's values at 0 and 1. slopes: (n,), bounds of the derivatives of the polynomials in the mean.
    derivative: (n, n), values times it are the interpolant's derivatives at the nodes.
    """

    nodes: Array
    weights: Array
    transform: Array
    ends: Array
    slopes: Array
    derivative: Array


@lru_cache(maxsize=64)
def gauss(n: int) -> GaussRule:
    x, w = np.polynomial.legendre.leggauss(n)
    k = np.arange(n)
    vander = np.polynomial.legendre.legvander(x, n - 1)
    transform = (w / 2)[:, None] * vander * (2 * k + 1)
    ends = np.stack([(-1.0) ** k, np.ones(n)], axis=1)
    derivative = transform @ (2 * np.polynomial.legendre.legval(x, np.polynomial.legendre.legder(np.eye(n))))
    return GaussRule((x + 1) / 2, w / 2, transform, ends, k * (k + 1.0), derivative)


def truncation(size: Array, singular: Bools | bool = False) -> Array:
    """A bound of how far the rule's integral is off, from the decay of its Legendre coefficients: their sizes (P, n).

    The integral errs by about the 2n-th coefficient. The decay is read off pairs of coefficients (functions even or
    odd on the piece have every other one zero), at the end and over the upper half, and the slower of the two is
    followed for fewer than n further steps: for analytic integrands, where the decay is geometric, that is safe by
    orders of magnitude. Where the decay slows down, and on the pieces that are `singular` (P,), at whose ends an
    integrand may be no more than a power of the distance, the coefficients are taken to go on as those of a power: they
    first fall as if geometrically, and where they stop to, single ones may be small by a change of sign, so that the
    pairs before are asked as well. A slow decay means that the integrand is not resolved: then the last
    coefficients themselves. (`benchmarks/calibration.py truncation` counts by which functions the bound is exceeded: by
    peaks that fall between the nodes and, up to 20,000 times, by powers at an end beneath something that grows; where
    either may be, panels are looked at in other ways as well.)
    """
    n = size.shape[-1]
    middle = max(n // 2 - 2, 0)
    end = size[..., -1] + size[..., -2]
    half = size[..., middle] + size[..., middle + 1]
    if n > 4:
        before = size[..., -3] + size[..., -4]
        last, mean = end / before, (end / half) ** (2 / (n - 2 - middle))
    else:  # beside what is plain, a constant or linear, all others are small: that says nothing of how fast they fall
        before = size[..., -3]
        last = mean = np.fmax(end / before, size[..., -1] / size[..., -2]) ** 2
    decay = np.fmin(np.fmax(np.fmax(last, mean), 0.0), 1.0)
    power = 4.5 if n >= 10 else 4.0 if n >= 8 else 2.0
    share = np.fmax(decay**power, np.fmin(1.0, (decay - 0.3) / 0.3))
    slowing = (last > 1.15 * mean) | singular
    if slowing.any():
        if n >= 8:
            fall = np.fmin(before / (size[..., -5] + size[..., -6]), 1.0)
            last, end = (np.where(singular, np.fmax(*pair), pair[0]) for pair in ((last, fall), (end, before * fall)))
        share = np.where(slowing, np.fmax(share, decay_of_power(n, last)), share)
    return 8 * end * share  # type: ignore[no-any-return]


def decay_of_power(n: int, last: Array) -> Array:
    """By which factor the coefficients of a power of the distance to an end fall from the last one of n to the 2n-th,
    if the last two are by `last` less than the two before them.

    Those of x^p fall by (k - p)/(k + 2 + p) from the k-th to the next: that tells p, and all that follow.
    """
    ratios, falls = _falls(n)
    return np.exp(np.interp(np.sqrt(np.fmin(last, 1.0)), ratios, falls))


@lru_cache(maxsize=64)
def _falls(n: int) -> tuple[Array, Array]:
    """The ratio of neighbouring coefficients where the last pairs are, and the logarithm of what it leads to."""
    ratios, k, later = np.linspace(0.0, 1.0, 257), n - 2.5, np.arange(n - 1, 2 * n)[:, None]
    power = (k - ratios * (k + 2)) / (1 + ratios)
    return ratios, np.log((later - power) / (later + 2 + power)).sum(axis=0)


def telling(n: int) -> tuple[int, ...]:
    """Of the coefficients at n nodes, the mean and those that `analytic_truncation` asks for."""
    return (0, *range(max(n - 3 * _quarter(n), 1), n))


def _quarter(n: int) -> int:
    return max(n // 4, 2)


def quarters(n: int) -> tuple[int, float, float]:
    """Of how many coefficients a quarter of n is, and the powers of what one falls by to the next quarter that stand
    for all that follow, and for the square of what neighbours fall by."""
    w = _quarter(n)
    return w, AHEAD * n / w, 2 / w


def analytic_truncation(size: Array, n: int) -> Array:
    """The same for integrands that are known to be analytic beyond the ends of the piece, whose coefficients fall
    geometrically, though not one by one: quarters of them are compared, and the slower decay is followed for AHEAD
    times as many terms as there are nodes, of the n + 1 up to the one by which the integral errs. (How often that is
    exceeded, by which functions: `benchmarks/calibration.py analytic`; at 11 nodes, with quarters of two, it is by
    chance.)

    size: of the last three quarters of the n coefficients at least.
    """
    w, end = _quarter(n), size.shape[-1]
    last, before, first = [np.add.reduce(size[..., end - (i + 1) * w : end - i * w], -1) for i in range(3)]
    rate = np.fmin(np.fmax(np.fmax(last / before, np.sqrt(last / first)), 0.0), 1.0) ** (1 / w)
    share = np.fmax(rate ** (AHEAD * n), np.fmin(1.0, (rate * rate - 0.5) / 0.5))
    return 8 * last * share  # type: ignore[no-any-return]


def leaning(coefficients: Array) -> Ints:
    """-1 or 1 where a slowly falling tail of the coefficients (P, n) adds up at the left, or at the right end.

    That is the mark of a singularity there. Elsewhere, and where the tail falls fast, 0.
    """
    n = coefficients.shape[-1]
    tail = coefficients[:, n // 2 :]
    total = np.abs(tail).sum(axis=-1)
    signs = (-1.0) ** np.arange(n // 2, n)
    slow = np.abs(tail[:, -2:]).sum(axis=-1) > 0.01 * np.abs(tail[:, :2]).sum(axis=-1)
    left = np.abs(tail @ signs) > 0.9 * total
    right = np.abs(tail.sum(axis=-1)) > 0.9 * total
    return np.where(slow & left, -1, np.where(slow & right, 1, 0))
