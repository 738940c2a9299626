"""References in one variable, to thirty digits: the roots of the condition, and what lies between them."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import mpmath as mp

from references.tools import NODES, Truth, Value, differenced, length, line, roots, second

mpf = mp.mpf


def below(psi: Callable[[Any, Any], Any], lo: Any, hi: Any, weight: Value | None = None, nodes: int = NODES) -> Value:
    """Where psi(x, t) < 0; `weight` is an antiderivative."""
    return lambda t: length(lambda x: psi(x, t) < 0, [lambda x: psi(x, t)], lo, hi, weight, nodes)


def cubic(x: Any) -> Any:
    return x**3 - x


def damped(t: Any) -> Any:
    """x exp(-x) < t in [0, 5] outside of the two branches of Lambert's function."""
    return 5 - (-mp.lambertw(-t, -1).real + mp.lambertw(-t, 0).real)


def power(t: Any) -> Any:
    """x^x < t where x log x < log t: between the two branches of log t/W(log t)."""
    s = mp.log(t)
    return mp.e ** mp.lambertw(s, 0).real - mp.e ** mp.lambertw(s, -1).real


def clamped(t: Any) -> Any:
    def f(x: Any) -> Any:
        return x * min(max(x * x - 1, mpf(-1) / 2), mpf(1)) - t

    return length(lambda x: f(x) < 0, [f], -2, 2)


def logic(t: Any) -> Any:
    def holds(x: Any) -> bool:
        return bool((cubic(x) < t and not mp.sin(5 * x) > mpf(0.3)) or x > mpf(1.2))

    surfaces = [lambda x: cubic(x) - t, lambda x: mp.sin(5 * x) - mpf(0.3), lambda x: x - mpf(1.2)]
    return length(holds, surfaces, -1.5, 1.5)


def within(t: Any) -> Any:
    low = t - mpf(0.4)
    return length(lambda x: low <= cubic(x) < t, [lambda x: cubic(x) - t, lambda x: cubic(x) - low], -1.5, 1.5)


def moving_bound(t: Any) -> Any:
    def f(x: Any) -> Any:
        return mp.sin(4 * x) - x + t - mpf(0.5)

    return length(lambda x: f(x) < 0, [f], 0, t, mp.exp)


def jump_within_quotient(t: Any) -> Any:
    def f(x: Any) -> Any:
        return 1 / (1 + x * x * (cubic(x) < t))

    return line(f, [lambda x: cubic(x) - t], -1.5, 1.5)


def jump_within_sine(t: Any) -> Any:
    def psi(x: Any) -> Any:
        return mp.exp(x) - 3 * x - t

    return line(lambda x: mp.sin(3 * (psi(x) < 0) + x), [psi], -1, 2)


def normal_waves(t: Any) -> Any:
    """sin(3x) < t under a normal density: outside of the arcs about the crests."""
    a = mp.asin(t) / 3
    crests = (mp.ncdf(2 * k * mp.pi / 3 + mp.pi / 3 - a) - mp.ncdf(2 * k * mp.pi / 3 + a) for k in range(-12, 13))
    return 1 - mp.fsum(crests)


def exponential_waves(t: Any) -> Any:
    """sin(3x) < t under exp(-x): a geometric series of arcs."""
    a, period = mp.asin(t) / 3, 2 * mp.pi / 3
    return 1 - (mp.exp(-a) - mp.exp(a - mp.pi / 3)) / (1 - mp.exp(-period))


def normal_beats(t: Any) -> Any:
    def f(x: Any) -> Any:
        return mp.sin(3 * x) + mp.cos(x) - t

    return length(lambda x: f(x) < 0, [f], -15, 15, mp.ncdf, 3000)


def normal_cubic(t: Any) -> Any:
    return below(lambda x, t: cubic(x) - t, -15, 15, mp.ncdf, 3000)(t)


def bell(s: Any, at: Any) -> Value:
    """The integral of exp(-((x - at)/s)^2/2) from -inf."""
    return lambda x: s * mp.sqrt(2 * mp.pi) * mp.ncdf((x - at) / s)


def spike_cut(t: Any) -> Any:
    mass = bell(mpf(1e-4), mpf(0.3183))
    return mass(t) - mass(mpf(-1))


def spike_moved(t: Any) -> Any:
    """(1 + x) times a spike at t: its mean is t, and what lies beyond [-1, 1] is nothing."""
    return mpf(1e-4) * mp.sqrt(2 * mp.pi) * (1 + t)


def sum_of_brackets(t: Any) -> Any:
    parts = (length(lambda x, k=k: mp.sin(k * x) < t, [lambda x, k=k: mp.sin(k * x) - t], 0, 2) / k
             for k in range(1, 6))  # fmt: skip
    return mp.fsum(parts)


def bracket_within(t: Any) -> Any:
    def f(x: Any) -> Any:
        return mpf(0.3) * (x < t) + cubic(x) + mpf(0.2) * t - mpf(0.1)

    cuts = [lambda x: x - t, lambda x: cubic(x) + mpf(0.3) + mpf(0.2) * t - mpf(0.1),
            lambda x: cubic(x) + mpf(0.2) * t - mpf(0.1)]  # fmt: skip
    return length(lambda x: f(x) < 0, cuts, -1.5, 1.5)


def thermostat(steps: int) -> Value:
    """The mean of u after steps of u -> 0.8 u + 0.5 [u < t]: pieces of lines, cut where one of them passes t."""

    def value(t: Any) -> Any:
        lines = [(mpf(0), mpf(2), mpf(1), mpf(0))]  # from, to, slope, offset
        for _ in range(steps):
            cut = []
            for a, b, slope, offset in lines:
                at = min(max((t - offset) / slope, a), b)
                cut += [(a, at, slope * mpf(0.8), offset * mpf(0.8) + mpf(0.5)),
                        (at, b, slope * mpf(0.8), offset * mpf(0.8))]  # fmt: skip
            lines = [part for part in cut if part[1] > part[0]]
        return mp.fsum((b - a) * (slope * (a + b) / 2 + offset) for a, b, slope, offset in lines)

    return value


def delta_cubic(t: Any) -> Any:
    """exp(r)/|3 r^2 - 1| over the roots."""
    return mp.fsum(mp.exp(r) / abs(3 * r * r - 1) for r in roots(lambda x: cubic(x) - t, -1.5, 1.5))


def sum_of_deltas(t: Any) -> Any:
    """exp(r)/(3 r^2 + i) over the root of each."""
    found = ((i, r) for i in (1, 2, 3) for r in roots(lambda x, i=i: x**3 + i * x - t, 0, 1))
    return mp.fsum(mp.exp(r) / (3 * r * r + i) for i, r in found)


def delta_damped(t: Any) -> Any:
    found = (-mp.lambertw(-t, k).real for k in (-1, 0))
    return mp.fsum(1 / abs((1 - r) * mp.exp(-r)) for r in found)


def band(t: Any) -> Any:
    """cos k + 0.3 cos 2k < t: a quadratic in cos k, of which one root is a cosine."""
    c = (-1 + mp.sqrt(1 + mpf(2.4) * (mpf(0.3) + t))) / mpf(1.2)
    return 2 * (mp.pi - mp.acos(c))


def frequency(t: Any) -> Any:
    """sin(t x) < 0.3 in [0, 10]: whole arcs, and the last one in part."""
    a, last = mp.asin(mpf(0.3)), 10 * t
    arcs = itertools.takewhile(lambda k: 2 * mp.pi * k < last, itertools.count())
    above = (max(mpf(0), min(last, 2 * mp.pi * k + mp.pi - a) - (2 * mp.pi * k + a)) for k in arcs)
    return 10 - mp.fsum(above) / t


def waves_summed(x: Any) -> Any:
    return mp.fsum(mp.sin(k * x) / k for k in range(1, 5))


BELOW: dict[str, Value] = {
    "cubic": below(lambda x, t: cubic(x) - t, -1.5, 1.5, mp.exp),
    "quintic": below(lambda x, t: x**5 - 4 * x**3 + 3 * x - t, -2, 2, mp.sin),
    "waves": below(lambda x, t: mp.cos(x) + mp.cos(2.5 * x) - t, 0, 6),
    "hump": below(lambda x, t: t - x / (1 + x**4), 0, 3),
    "soft step": below(lambda x, t: mp.tanh(3 * x) - x / 2 - t, -3, 3),
    "logarithm": below(lambda x, t: mp.log(1 + x) - x / 3 - t, -0.9, 4),
    "root and square": below(lambda x, t: mp.sqrt(1 + x * x) - mpf(0.4) * x * x - t, -3, 3),
    "error function": below(lambda x, t: mp.erf(x) - x / 2 - t, -2.5, 2.5),
    "many roots": below(lambda x, t: t - mp.sin(40 * x) - x * x, 0, 1.2, lambda x: x * x / 2),
    "near a fold": below(lambda x, t: x**3 - 3 * x - t, -2.5, 2.5),
    "magnitude": below(lambda x, t: abs(cubic(x)) - t, -1.5, 1.5),
    "larger of two": below(lambda x, t: max(x * x - 1, mp.sin(3 * x)) - t, -2, 2),
    "smaller of two": below(lambda x, t: t - min(mp.cos(2 * x), x * x / 4), -3, 3),
    "behind a call": below(lambda x, t: cubic(x) - t, -1.5, 1.5, lambda x: x * x / 2),
    "sum within": below(lambda x, t: waves_summed(x) - t, 0, 3),
}

VALUES: dict[str, tuple[Value, float]] = {
    **{name: (value, 1e-9 if name == "near a fold" else 1e-6) for name, value in BELOW.items()},
    "damped": (damped, 1e-6), "power": (power, 1e-6), "clamped": (clamped, 1e-6), "logic": (logic, 1e-6),
    "within": (within, 1e-6), "moving bound": (moving_bound, 1e-6), "quotient": (jump_within_quotient, 1e-6),
    "sine of a jump": (jump_within_sine, 1e-6), "normal waves": (normal_waves, 1e-6),
    "exponential waves": (exponential_waves, 1e-6), "normal beats": (normal_beats, 1e-6),
    "normal cubic": (normal_cubic, 1e-6), "spike, cut": (spike_cut, 1e-8), "spike, moved": (spike_moved, 1e-6),
    "sum of brackets": (sum_of_brackets, 1e-6), "bracket within": (bracket_within, 1e-6),
    "thermostat, 4 steps": (thermostat(4), 1e-6), "thermostat, 8 steps": (thermostat(8), 1e-6),
    "delta of a cubic": (delta_cubic, 1e-6), "delta, damped": (delta_damped, 1e-6), "band, 1-D": (band, 1e-6),
    "density of states, 1-D": (lambda t: differenced(band)(t)[1], 1e-6), "frequency": (frequency, 1e-6),
    "sum of deltas": (sum_of_deltas, 1e-6), "length zero": (lambda t: mp.exp(t) - 1, 1e-6),
}  # fmt: skip


def squared_difference(t: Any) -> Truth:
    """([x < t] - [x < 1/2])^2 is 1 between the two."""
    return abs(t - mpf(0.5)), mp.sign(t - mpf(0.5))


TRUTHS: dict[str, Callable[[Any], Truth]] = {
    **{name: differenced(value, step) for name, (value, step) in VALUES.items()},
    "squared difference": squared_difference,
}
SECONDS: dict[str, Value] = {
    name: second(VALUES[name][0], 1e-5)
    for name in (
        "cubic",
        "quintic",
        "damped",
        "waves",
        "normal waves",
        "moving bound",
        "delta of a cubic",
        "delta, damped",
        "sum of deltas",
    )
}
