"""Random measures for programs, each with its density in numpy.

Owns `measures`. What is infinite ends where 1e-17 of the measure is left.
"""

from __future__ import annotations

import random

import numpy as np
from plain_quadrature import Array, Environment, Program, Record
from program_nodes import Binder, Node, call, minus, name, number, over, plus, power, times, weighted
from scipy import special

SPREAD = 9.0  # standard deviations


def _normal(v: str, m: Node, sd: float) -> tuple[str, Node, Node, Node]:
    wide, s = number(SPREAD * sd), number(sd)
    density = call(lambda x, c: np.exp(-0.5 * ((x - c) / sd) ** 2) / (sd * np.sqrt(2 * np.pi)), "%s%s", name(v), m)
    return f"normal({m.text}, {s.text})", minus(m, wide), plus(m, wide), density


def _uniform(v: str, m: Node, width: float) -> tuple[str, Node, Node, Node]:
    high = plus(m, number(width))
    return f"uniform({m.text}, {high.text})", m, high, number(1 / width)


def _exponential(v: str, rate: float) -> tuple[str, Node, Node, Node]:
    density = call(lambda x: rate * np.exp(-rate * x), "%s", name(v))
    return f"exponential({rate!r})", number(0.0), number(40 / rate), density


def _beta(v: str, a: float, b: float) -> tuple[str, Node, Node, Node]:
    mass = special.beta(a, b)
    density = call(lambda x: np.clip(x, 0, 1) ** (a - 1) * np.clip(1 - x, 0, 1) ** (b - 1) / mass, "%s", name(v))
    return f"beta({a!r}, {b!r})", number(0.0), number(1.0), density


def _categorical(v: str, weights: list[Node], fixed: bool) -> Binder:
    """0, 1, 2, each as often as its weight says."""

    def within(body: Program) -> Program:
        def run(env: Environment, record: Record | None, n: int) -> Array:
            found = [w(env, record, n) for w in weights]
            parts = [w * body({**env, v: np.full(n, float(k))}, record, n) for k, w in enumerate(found)]
            return sum(parts) / sum(found)

        return run

    return Binder(v, f"{v} ~ categorical({', '.join(w.text for w in weights)})", within, fixed)


def measures(pick: random.Random, v: str, parameters: list[Node], outer: list[Node]) -> Binder:
    """Of a variable; a mean may be a parameter or a variable further out."""
    places = [number(0.0), number(0.5), *parameters, *outer]
    m, sd = pick.choice(places), pick.choice((1.0, 0.5, 0.1, 2.0))
    fixed = m not in outer
    kind = pick.randrange(7)
    if kind == 6:
        weights = [number(1.0), number(pick.choice((0.0, 0.5, 2.0))), plus(power(m, 2), number(0.25))]
        return _categorical(v, weights, fixed)
    if kind < 4:
        text, lo, hi, density = (
            _normal(v, m, sd), _uniform(v, m, sd), _exponential(v, pick.choice((1.0, 2.0, 0.5))),
            _beta(v, *pick.choice(((2.0, 3.0), (1.0, 1.0), (3.0, 1.0), (2.0, 2.0)))),
        )[kind]  # fmt: skip
        return Binder(v, f"{v} ~ {text}", weighted(v, lo, hi, density), fixed)
    text, _, _, density = _normal(v, m, sd)
    if kind == 4:
        lo, hi = minus(m, number(sd)), plus(m, number(pick.choice((0.5, 2.0)) * sd))
        part = weighted(v, lo, hi, density)
        whole = part(number(1.0).run)

        def within(body: Program) -> Program:
            return over(Node("", part(body)), Node("", whole)).run

        return Binder(v, f"{v} ~ truncated({text}, {lo.text}, {hi.text})", within, fixed)
    other, lo, hi, flat = _uniform(v, m, 1.0)
    _, low, high, density = _normal(v, m, sd)
    first, second = weighted(v, low, high, density), weighted(v, lo, hi, flat)

    def mixed(body: Program) -> Program:
        return over(plus(Node("", first(body)), times(number(2.0), Node("", second(body)))), number(3.0)).run

    return Binder(v, f"{v} ~ mixture(1, {text}, 2, {other})", mixed, fixed)
