"""Contact and control: the steps of the programs, and what is known of them in closed form, for numbers of mpmath."""

from __future__ import annotations

from itertools import product
from typing import Any

import mpmath as mp


def thrown(u: Any, v: Any, end: Any) -> tuple[Any, Any]:
    """Flight by flight: each begins on the floor with the speeds that the bounce has left."""
    g, left = mp.mpf(9.81), end
    x = mp.mpf(0)
    for _ in range(3):
        flight = 2 * v / g
        if left < flight:
            break
        x, left, u, v = x + u * flight, left - flight, u * mp.mpf(0.9), v * mp.mpf(0.8)
    return x + u * left, v * left - g * left**2 / 2


def stepped(stop: Any, steps: int, h: Any) -> Any:
    """The steps of the program, the contact by the formula for a quadratic instead of an integral."""
    x, v = mp.mpf(1), mp.mpf(0)
    for _ in range(steps):
        a = -(x + h * v / 2)
        y = x + h * v + h * h * a / 2
        if y > stop:
            x, v = y, v + h * a
            continue
        gap = x - stop
        free = 2 * gap / (-v + mp.sqrt(v * v - 2 * a * gap))
        w = -mp.mpf(0.8) * (v + a * free)
        x, v = stop + w * (h - free) + a * (h - free) ** 2 / 2, w + a * (h - free)
    return x


def held(speed: Any, steps: int) -> Any:
    """The pole by 60-digit arithmetic: the mean of a sign over even noise is a clamped line."""
    x, v, h, noise = mp.mpf(0.1), mp.mpf(0), mp.mpf(0.005), mp.mpf(0.4)
    for _ in range(steps):
        mean = max(mp.mpf(-1), min(mp.mpf(1), (x + speed * v) / noise))
        v = v + h * (mp.sin(x) - mean / 2 * mp.cos(x))
        x = x + h * v
    return x


def warmed(set_point: Any, cost: bool) -> Any:
    """All ways through the three hours, each with its probability."""
    noise, total = mp.mpf(3), mp.mpf(0)
    for way in product((True, False), repeat=3):
        t, share = mp.mpf(18.5), mp.mpf(1)
        for on in way:
            chance = max(mp.mpf(0), min(mp.mpf(1), (set_point - t + noise) / (2 * noise)))
            share *= chance if on else 1 - chance
            t = t - mp.mpf(0.1) * (t - 5) + (3 if on else 0)
        total += share * ((t - 20) ** 2 if cost else t)
    return total
