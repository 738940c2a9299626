"""What the curves of the gallery are by other means than Potto.

Owns `CURVES`: by chapter, program and function, as in the tables of the gallery, value and derivative at a number, on
its two sides.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
from exact_dynamics import held, stepped, thrown, warmed
from exact_fields import ARROW, SITES, WAVES, balls, bright, cell_area, two_bands
from exact_probability import (
    VOLATILITY,
    accepted,
    call,
    digital,
    expected_cost,
    knocked_out,
    truncated_moments,
)
from exact_worked import above_the_ray, mean_beyond, misfit, quarter_in_the_square
from level_sets_reference import Given, integral
from polygons import area

Pair = tuple[float, float]


def differences(f: Callable[[Any], Any], digits: int = 40, step: float = 1e-15) -> Callable[[float], tuple[Pair, Pair]]:
    """Value and slope behind a place and before it: these differ at a kink."""

    def sides(place: float) -> tuple[Pair, Pair]:
        with mp.workdps(digits):
            here, h = mp.mpf(place), mp.mpf(step)
            value = f(here)
            backward, forward = (value - f(here - h)) / h, (f(here + h) - value) / h
            return (float(value), float(backward)), (float(value), float(forward))

    return sides


def smooth(f: Callable[[Any], Pair], digits: int = 40) -> Callable[[float], tuple[Pair, Pair]]:
    """Value and slope where these are known together, and there is no kink."""

    def sides(place: float) -> tuple[Pair, Pair]:
        with mp.workdps(digits):
            found = f(mp.mpf(place))
        return found, found

    return sides


def _parked(switch: Any) -> Any:
    """After two units of time, of which the engine is full ahead in the first."""
    s = max(mp.mpf(0), min(mp.mpf(2), switch))
    return 4 * s - s * s - 2


def _square(e: Any) -> Pair:
    """States of a square lattice below an energy: its density is a complete elliptic integral, by the arithmetic
    and geometric mean."""

    def density(x: Any) -> Any:
        return 1 / (4 * mp.pi * mp.agm(1, abs(x) / 4)) if x else mp.inf

    if abs(e) >= 4:
        return (0.0 if e < 0 else 1.0), 0.0
    half = mp.quad(density, [0, abs(e)])
    return float(mp.mpf(1) / 2 + mp.sign(e) * half), float(density(e))


def _bands(e: Any) -> Any:
    inside = mp.mpf(0.5) < abs(e) < mp.mpf(1.5)
    return two_bands(e, mp.mpf(1), mp.mpf(0.5)) if inside else 1 + mp.sign(e) * (abs(e) > 1)


def _balls(apart: Any) -> Pair:
    """Two balls that touch or not: sections from where they begin, or from their middle."""
    if 2 * mp.exp(-(apart**2)) > 0.5:
        return balls(apart, mp.mpf(1) / 2, lambda x: mp.mpf(1))

    def g(x: Any) -> Any:
        return mp.exp(-((x + apart) ** 2)) + mp.exp(-((x - apart) ** 2))

    def rate(x: Any) -> Any:
        return 2 * ((x - apart) * mp.exp(-((x - apart) ** 2)) - (x + apart) * mp.exp(-((x + apart) ** 2))) / g(x)

    ends = [mp.findroot(lambda x: g(x) - 0.5, apart + d * mp.sqrt(mp.log(2))) for d in (-1, 1)]
    places = [ends[0], apart, ends[1]]
    value = 4 * mp.quad(lambda x: mp.sqrt(abs(mp.log(2 * g(x)))), places)
    return float(value), float(2 * mp.quad(lambda x: rate(x) / mp.sqrt(abs(mp.log(2 * g(x)))), places))


def _cell(t: Any) -> Any:
    """Of the bilinear cell, whose area above t and below 1 - t are the same."""
    return bright(t) if t >= 0.5 else 1 - bright(1 - t)


def _clouds(t: Any) -> Pair:
    def waves(x: Any, y: Any, given: Given) -> Any:
        return sum(np.cos(a * x + b * y + c) for a, b, c in WAVES) / 4 - given["t"]

    lit = lambda x, y, given: np.where(np.real(waves(x, y, given)) > 0, 0.25, 0.0)  # noqa: E731
    value, slopes = integral([waves], lit, (0, 2, 0, 2), {"t": float(t)}, 33, 144)
    return value, slopes["t"]


def _gained(w: Any) -> Pair:
    """The plate: what it bears and costs, where the sum of its bumps is high enough."""

    def height(x: Any, y: Any, given: Given) -> Any:
        weights = 0.5, given["w"], 0.5
        return sum(k * np.exp(-4 * ((x - i / 2) ** 2 + (y - 0.5) ** 2)) for i, k in enumerate(weights)) - 0.5

    def earned(x: Any, y: Any, given: Given) -> Any:
        bears = 1 / (1 + 4 * (x - 0.5) ** 2 + 4 * y**2) - 0.6
        return np.where(np.real(height(x, y, given)) > 0, bears, 0.0)

    value, slopes = integral([height], earned, (0, 1, 0, 1), {"w": float(w)}, 21, 48, 24)
    return value, slopes["w"]


def _book(s: Any) -> Any:
    calls = sum(n * call(s, VOLATILITY, k) for n, k in ((2, 90), (-1, 100), (3, 110)))
    return calls + 20 * digital(s, VOLATILITY, 105) - 5 * knocked_out(s, VOLATILITY, 95, 130)


def _site(x: Any) -> Any:
    sites = [(mp.mpf(a), mp.mpf(b)) for a, b in SITES]
    return cell_area([*sites[:2], (x, sites[2][1]), *sites[3:]], 0)


def _tip(x: Any) -> Any:
    corners = [(mp.mpf(a), mp.mpf(b)) for a, b in ARROW]
    return area([corners[0], (x, corners[1][1]), *corners[2:]])


def _misses(t: Any) -> Any:
    """A fifth is sick, with scores around 3/2, and costs 5 if missed; the others cost 1 as false alarms."""
    return mp.ncdf(t - mp.mpf(3) / 2) + mp.mpf(0.8) * mp.ncdf(-t)


CURVES: dict[tuple[str, str, str], Callable[[float], tuple[Pair, Pair]]] = {
    ("dynamics", "ball_and_wall", r"\w . place(2, w, 0.5)"): differences(
        lambda w: w - (2 - w) / 2 if w < 2 else mp.mpf(2)
    ),
    ("dynamics", "three_impacts", r"\v . fst(landing(2, v, 2.2))"): differences(
        lambda v: thrown(mp.mpf(2), v, mp.mpf(2.2))[0]
    ),
    ("dynamics", "spring_and_stop", "rebound"): differences(lambda s: stepped(s, 3000, mp.mpf(0.001))),
    ("dynamics", "parking", r"\s . place(2, s)"): differences(_parked),
    ("dynamics", "balancing", "tilt"): differences(lambda s: held(s, 1000)),
    ("dynamics", "room", "cost"): differences(lambda s: warmed(s, True)),
    ("probability", "truncated", r"\a . mean(a, 2)"): differences(lambda a: truncated_moments(a, 2)[0]),
    ("probability", "censored", r"\t . survival(t, 1.5, 0.4)"): differences(
        lambda t: mp.exp(-((mp.mpf(0.4) * t) ** mp.mpf(1.5)))
    ),
    ("probability", "newsvendor", "best"): differences(expected_cost),
    ("probability", "options", r"\s . digital(market with spot = s, 105, 1)"): differences(
        lambda s: digital(s, VOLATILITY, 105)
    ),
    ("probability", "options", "by_spot"): differences(_book, 30, 1e-12),
    ("probability", "threshold", r"\t . cost(t, 5, 1)"): differences(_misses),
    ("probability", "acceptance", r"\n . posterior_mean(1.5, n)"): differences(lambda n: accepted(mp.mpf(1.5), n)),
    ("fields", "bands", "below"): differences(lambda e: mp.acos(-e / 2) / mp.pi),
    ("fields", "bands", r"\e . filled(e, 1, 0.5)"): differences(_bands),
    ("fields", "bands", "square"): smooth(_square),
    ("fields", "metaballs", r"\a . area(a, 1, 0.5)"): smooth(_balls),
    ("fields", "noise", "bright"): differences(_cell, 40, 1e-12),
    ("fields", "noise", "clouds"): smooth(_clouds),
    ("fields", "plate", r"\w . gain([0.5, w, 0.5], 0.6)"): smooth(_gained),
    ("fields", "voronoi", r"\x . cell([(0.2, 0.3), (0.7, 0.2), (x, 0.6), (0.15, 0.8), (0.85, 0.75)], 0)"): differences(
        _site
    ),
    ("fields", "polygon", r"\x . area([(0.1, 0.1), (x, 0.5), (0.2, 0.9), (0.4, 0.45)])"): differences(_tip),
    ("worked", "contact_time", "before"): differences(lambda t: min(max(t, mp.mpf(0)), mp.mpf(1))),
    ("worked", "disc", "quarter"): differences(quarter_in_the_square),
    ("worked", "polar", "above"): differences(above_the_ray),
    ("worked", "robot_arm", r"\l . reach(l, 0.5)"): differences(lambda length: 2 * mp.acos(1 / (2 * length)) / mp.pi),
    ("worked", "thermostat", r"\s . on(19, s, 1)"): differences(lambda s: mp.ncdf(s - 19)),
    ("worked", "shortfall", r"\q . shortfall(q, 0, 1)"): differences(mean_beyond),
    ("worked", "histogram", r"\m . misfit(m, 1.2)"): differences(misfit),
}
