"""Integrals over one variable of polynomials in x and in brackets whose ends move evenly: exactly, in rationals.

Owns `Stretch` and `random_stretch`. Ends are p + q t; between neighbouring ends each condition is true or false, which
is asked in the middle. What it comes to is a piecewise polynomial of t.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

Value = Callable[[Fraction, Fraction], Fraction]  # of x and t


@dataclass(frozen=True)
class Part:
    """A piece of an integrand: its source, what it is, and where it jumps."""

    text: str
    value: Value
    ends: tuple[Callable[[Fraction], Fraction], ...]


@dataclass(frozen=True)
class Stretch:
    """The integral of a part from x0 + u0 t to x1 + u1 t."""

    bounds: tuple[float, float, float, float]
    part: Part

    @property
    def text(self) -> str:
        x0, u0, x1, u1 = map(number, self.bounds)
        return f"def f(t)\n    integral [{x0} + {u0}*t, {x1} + {u1}*t] {self.part.text} d(x)"

    def value(self, t: Fraction) -> Fraction:
        x0, u0, x1, u1 = map(Fraction, self.bounds)
        a, b = x0 + u0 * t, x1 + u1 * t
        low, high = min(a, b), max(a, b)
        inner = sorted(e for end in self.part.ends if low < (e := end(t)) < high)
        places = [low, *inner, high]
        total = sum((self._cell(p, q, t) for p, q in itertools.pairwise(places)), Fraction(0))
        return total if a <= b else -total

    def _cell(self, p: Fraction, q: Fraction, t: Fraction) -> Fraction:
        """By Milne's open rule, which is exact for cubics and asks nothing at the ends."""
        if p == q:
            return Fraction(0)
        h, middle = (q - p) / 4, (p + q) / 2
        left, centre, right = (self.part.value(x, t) for x in (middle - h, middle, middle + h))
        return (q - p) * (2 * left - centre + 2 * right) / 3

    def rate(self, t: Fraction, step: Fraction) -> Fraction:
        return (self.value(t + step) - self.value(t)) / step


def number(x: float) -> str:
    return f"({x!r})" if x < 0 else repr(x)


def moving(p: float, q: float) -> Callable[[Fraction], Fraction]:
    return lambda t: Fraction(p) + Fraction(q) * t


PLACES = (0.0, 0.0, 0.5, 1.0, -1.0, 0.25, 1e-8, 0.3, 2.0, -0.7, 1e-17)
SPEEDS = (1.0, 1.0, -1.0, 0.0, 0.0, 2.0, 0.5)


def condition(pick: random.Random) -> Part:
    """A bracket: affine, or of a distance."""
    p, q, r, d = pick.choice(PLACES), pick.choice(SPEEDS), pick.choice((0.0, 0.25, 0.5, 1.0)), pick.choice(SPEEDS)
    place, radius = f"({number(p)} + {number(q)}*t)", f"({number(r)} + {number(d)}*t)"
    at, wide = moving(p, q), moving(r, d)

    both = (lambda t: at(t) - wide(t), lambda t: at(t) + wide(t))
    kind = pick.randrange(8)
    truth = {
        0: (f"x < {place}", lambda x, t: x < at(t), (at,)),
        1: (f"x >= {place}", lambda x, t: x >= at(t), (at,)),
        2: (f"0 < {place} - x", lambda x, t: x < at(t), (at,)),
        3: (f"3*x - 3*{place} > 0", lambda x, t: x > at(t), (at,)),
        4: (f"abs(x - {place}) < {radius}", lambda x, t: abs(x - at(t)) < wide(t), both),
        5: (f"(x - {place})^2 < {radius}^2", lambda x, t: abs(x - at(t)) < abs(wide(t)), both),
        6: (f"max(x - {place}, {place} - x) >= {radius}", lambda x, t: abs(x - at(t)) >= wide(t), both),
        7: (f"min(x, 2*x) < {place}", lambda x, t: min(x, 2 * x) < at(t), (at, lambda t: at(t) / 2)),
    }[kind]
    text, holds, ends = truth
    if pick.random() < 0.15:
        return Part(f"not {text}" if kind else f"not ({text})", lambda x, t: Fraction(not holds(x, t)), ends)
    return Part(text, lambda x, t: Fraction(bool(holds(x, t))), ends)


def bracket(pick: random.Random) -> Part:
    a = condition(pick)
    if pick.random() < 0.3:
        b, op = condition(pick), pick.choice(("and", "or"))
        join = min if op == "and" else max
        return Part(f"[({a.text}) {op} ({b.text})]", lambda x, t: join(a.value(x, t), b.value(x, t)), a.ends + b.ends)
    return Part(f"[{a.text}]", a.value, a.ends)


def integrand(pick: random.Random, depth: int = 2) -> Part:
    a = bracket(pick)
    kind = pick.randrange(9) if depth else 0
    if kind <= 2:
        return a
    b = integrand(pick, depth - 1)
    ends = a.ends + b.ends
    match kind:
        case 3:
            return Part(f"({a.text}*{b.text})", lambda x, t: a.value(x, t) * b.value(x, t), ends)
        case 4:
            return Part(f"({a.text} + {b.text})", lambda x, t: a.value(x, t) + b.value(x, t), ends)
        case 5:
            return Part(f"({a.text} - 2*{b.text})^2", lambda x, t: (a.value(x, t) - 2 * b.value(x, t)) ** 2, ends)
        case 6:
            return Part(f"(if {a.text} then {b.text} else 3)", lambda x, t: b.value(x, t) if a.value(x, t) else
                        Fraction(3), ends)  # fmt: skip
        case 7:
            return Part(f"{a.text}*(2 - x)", lambda x, t: a.value(x, t) * (2 - x), a.ends)
        case _:
            return Part(f"1/(1 + {a.text})", lambda x, t: 1 / (1 + a.value(x, t)), a.ends)


def random_stretch(pick: random.Random) -> Stretch:
    bounds = pick.choice((
        (0.0, 0.0, 1.0, 0.0), (-1.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0), (1.0, -1.0, 1.0, 1.0), (0.0, 0.0, 0.5, 1.0),
        (1.0, 0.0, 0.0, 0.0), (0.5, 1.0, 0.0, 0.0), (0.0, 1.0, 1.0, 1.0), (-1.0, 0.0, 0.0, 0.0), (0.3, 0.0, 0.3, 0.0),
    ))  # fmt: skip
    return Stretch(bounds, integrand(pick))
