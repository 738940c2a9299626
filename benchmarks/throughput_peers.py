"""Peers at eq. (1), those that can be imported: how long they take, and how far off they are.

Owns `one_integral`. Each is asked in the way that its users have: values are exact up to their rule, derivatives of
what jumps are not theirs to find.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from typing import Any, TextIO

import numpy as np
from abilities import duration
from run import ROOT, exact_quad
from throughput_lines import Asked, timed

C = -0.7
PEERS = ("scipy", "vegas", "jax", "quadax", "teg")
Peer = tuple[str, Callable[[], float], bool]  # what it does, how, whether that is the derivative


def one_integral(out: TextIO, asked: Asked) -> None:
    """A line for each peer, and which are not here."""
    missing = [name for name in PEERS if importlib.util.find_spec(name) is None]
    value, rate = exact_quad(C)
    out.write("\n  peers at one call of eq. (1)\n")
    for name, run, derivative in _peers():
        exact = rate if derivative else value
        far, seconds = abs(run() / exact - 1), timed(run, asked)
        out.write(f"  {name:44} {duration(seconds):>10}  {'derivative' if derivative else 'value'} off by {far:.1e}\n")
    if missing:
        out.write(f"  not installed: {', '.join(missing)}\n")


def _peers() -> Iterator[Peer]:
    yield from _scipy()
    if importlib.util.find_spec("vegas") is not None:
        yield _vegas()
    if importlib.util.find_spec("jax") is not None:
        yield from _jax(importlib.util.find_spec("quadax") is not None)


def _scipy() -> Iterator[Peer]:
    from scipy.integrate import dblquad, nquad

    def masked(y: float, x: float) -> float:
        z = x + y + C
        return 1 / (ROOT * z + 2) ** 2 if z >= 0 else 0.0

    options = {"epsabs": 1e-4, "epsrel": 1e-4}
    yield "scipy nquad, masked, 1e-4", lambda: float(nquad(masked, [(0, 1), (0, 1)], opts=options)[0]), False

    def by_hand() -> float:
        first = dblquad(masked, 0, -C, lambda x: -C - x, 1)[0]
        return float(first + dblquad(masked, -C, 1, 0, 1)[0])

    yield "scipy dblquad, cut by hand", by_hand, False


def _vegas() -> Peer:
    import vegas

    @vegas.batchintegrand
    def masked(x: Any) -> Any:
        z = x[:, 0] + x[:, 1] + C
        return np.where(z >= 0, 1 / (ROOT * z + 2) ** 2, 0.0)

    def run() -> float:
        return float(vegas.Integrator([[0, 1], [0, 1]])(masked, nitn=10, neval=10_000).mean)

    return "vegas, 1e5 points", run, False


def _jax(quadax: bool) -> Iterator[Peer]:
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    cells = (jnp.arange(1000) + 0.5) / 1000

    def mean(c: Any) -> Any:
        z = cells[:, None] + cells + c
        return jnp.where(z >= 0, 1 / (ROOT * z + 2) ** 2, 0.0).mean()

    slope = jax.jit(jax.grad(mean))
    yield "JAX of a sum of 1e6 points", lambda: float(slope(C)), True
    if not quadax:
        return
    from quadax import quadgk

    def inner(x: Any, c: Any, cut: bool) -> Any:
        def s(y: Any) -> Any:
            z = x + y + c
            return 1 / (ROOT * z + 2) ** 2 if cut else jnp.where(z >= 0, 1 / (ROOT * z + 2) ** 2, 0.0)

        return quadgk(s, jnp.array([jnp.maximum(-c - x, 0.0) if cut else 0.0, 1.0]))[0]

    for name, cut in (("quadax, breakpoints by hand", True), ("quadax with where", False)):

        def whole(c: Any, cut: bool = cut) -> Any:
            ends = jnp.stack([jnp.zeros(()), -c, jnp.ones(())]) if cut else jnp.array([0.0, 1.0])
            return quadgk(jnp.vectorize(lambda x: inner(x, c, cut)), ends)[0]

        rate = jax.jit(jax.grad(whole))
        yield name, lambda rate=rate: float(rate(C)), True
