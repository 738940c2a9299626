"""Random measures for programs, each with its density in numpy.

Owns `measures`. What is infinite ends where 1e-17 of the measure is left.
"""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
from plain_quadrature import Array, Environment, Program, Record, integral
from program_nodes import Binder, Node, call, minus, name, note, number, over, plus, power, times, weighted
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


def _gamma(v: str, a: float, rate: float) -> tuple[str, Node, Node, Node]:
    mass = special.gamma(a) / rate**a
    density = call(lambda x: np.maximum(x, 0) ** (a - 1) * np.exp(-rate * x) / mass, "%s", name(v))
    return f"gamma({a!r}, {rate!r})", number(0.0), number(60 / rate), density


def _triangular(v: str, m: Node, wide: float) -> tuple[str, Node, Node, Node]:
    """Its two sides are as wide; where it is highest it bends."""
    low, high = minus(m, number(wide)), plus(m, number(wide))

    def run(env: Environment, record: Record | None, n: int) -> Array:
        off = env[v] - m(env, record, n)
        note(record, off)
        return np.maximum(1 - np.abs(off) / wide, 0) / wide

    return f"triangular({low.text}, {m.text}, {high.text})", low, high, Node("", run)


def _student_t(v: str, m: Node, sd: float) -> tuple[str, Node, Node, Node]:
    """Only the shape, for what is truncated."""
    density = call(lambda x, c: (1 + ((x - c) / sd) ** 2 / 3) ** -2.0, "%s%s", name(v), m)
    return f"student_t(3, {m.text}, {number(sd).text})", m, m, density


def _cauchy(v: str, m: Node, sd: float) -> tuple[str, Node, Node, Node]:
    density = call(lambda x, c: 1 / (1 + ((x - c) / sd) ** 2), "%s%s", name(v), m)
    return f"cauchy({m.text}, {number(sd).text})", m, m, density


def _by_quantile(v: str, text: str, quantile: Callable[[Array, Array], Array], m: Node, fixed: bool) -> Binder:
    """What is spread too far for a density: an integral over the share that lies below."""
    share = f"share of {v}"

    def within(body: Program) -> Program:
        def run(env: Environment, record: Record | None, n: int) -> Array:
            return body({**env, v: quantile(env[share], m(env, record, n))}, record, n)

        return integral(share, number(0.0).run, number(1.0).run, run)

    return Binder(v, f"{v} ~ {text}", within, fixed)


def _counted(v: str, text: str, chances: Callable[[Environment, int], list[Array]], fixed: bool) -> Binder:
    """Whole numbers from 0 on, each with its chance."""

    def within(body: Program) -> Program:
        def run(env: Environment, record: Record | None, n: int) -> Array:
            found = enumerate(chances(env, n))
            return sum(w * body({**env, v: np.full(n, float(k))}, record, n) for k, w in found)

        return run

    return Binder(v, f"{v} ~ {text}", within, fixed)


def _whole_numbers(pick: random.Random, v: str, m: Node, fixed: bool) -> Binder:
    p = over(number(1.0), plus(number(1.1), power(m, 2)))
    kind = pick.randrange(3)
    if kind == 2:
        rate = plus(number(0.5), over(number(1.0), plus(number(1.0), power(m, 2))))

        def of_poisson(env: Environment, n: int) -> list[Array]:
            r = rate(env, None, n)
            return [np.exp(k * np.log(r) - r - special.gammaln(k + 1.0)) for k in range(40)]

        return _counted(v, f"poisson({rate.text})", of_poisson, fixed)
    trials = 1 if kind == 0 else 3

    def of_trials(env: Environment, n: int) -> list[Array]:
        q = p(env, None, n)
        return [special.binom(trials, k) * q**k * (1 - q) ** (trials - k) for k in range(trials + 1)]

    return _counted(v, f"bernoulli({p.text})" if kind == 0 else f"binomial(3, {p.text})", of_trials, fixed)


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
    kind = pick.choice((*range(7), *range(5), *range(7, 11)))
    if kind == 7:
        return _whole_numbers(pick, v, m, fixed)
    if kind == 8:
        wide = number(sd).text
        if pick.random() < 0.5:
            return _by_quantile(v, f"logistic({m.text}, {wide})", lambda u, c: c + sd * special.logit(u), m, fixed)
        text = f"lognormal({m.text}, 0.4)"
        return _by_quantile(v, text, lambda u, c: np.exp(c + 0.4 * special.ndtri(u)), m, fixed)
    if kind in (9, 10):
        text, lo, hi, density = _gamma(v, pick.choice((1.0, 2.0, 3.5)), 1.5) if kind == 9 else _triangular(v, m, sd)
        return Binder(v, f"{v} ~ {text}", weighted(v, lo, hi, density), fixed)
    if kind == 6:
        weights = [number(1.0), number(pick.choice((0.0, 0.5, 2.0))), plus(power(m, 2), number(0.25))]
        return _categorical(v, weights, fixed)
    if kind < 4:
        text, lo, hi, density = (
            _normal(v, m, sd), _uniform(v, m, sd), _exponential(v, pick.choice((1.0, 2.0, 0.5))),
            _beta(v, *pick.choice(((2.0, 3.0), (1.0, 1.0), (3.0, 1.0), (2.0, 2.0)))),
        )[kind]  # fmt: skip
        return Binder(v, f"{v} ~ {text}", weighted(v, lo, hi, density), fixed)
    text, _, _, density = pick.choice((_normal, _normal, _cauchy, _student_t))(v, m, sd)
    if kind == 4:
        lo, hi = minus(m, number(sd)), plus(m, number(pick.choice((0.5, 2.0)) * sd))
        part = weighted(v, lo, hi, density)
        whole = part(number(1.0).run)

        def within(body: Program) -> Program:
            return over(Node("", part(body)), Node("", whole)).run

        return Binder(v, f"{v} ~ truncated({text}, {lo.text}, {hi.text})", within, fixed)
    other, lo, hi, flat = _uniform(v, m, 1.0)
    text, low, high, density = _normal(v, m, sd)
    first, second = weighted(v, low, high, density), weighted(v, lo, hi, flat)

    def mixed(body: Program) -> Program:
        return over(plus(Node("", first(body)), times(number(2.0), Node("", second(body)))), number(3.0)).run

    return Binder(v, f"{v} ~ mixture(1, {text}, 2, {other})", mixed, fixed)
