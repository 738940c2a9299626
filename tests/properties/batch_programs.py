"""Random programs for batches: pictures, and integrals over boxes, measures and moving ranges, of parameters in awkward
places.

Owns `drawn`. A picture is an integrand over the boxes of pixels, which are the batch. Of the others the parameters t
and s are: multiples of 1/8 as often as not, so that surfaces meet corners and one another; ranges without length,
surfaces that are nearly parallel, numbers like 1e-8 and 1e8.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

Numbers = np.ndarray
PARAMETERS = ("t", "s", "t*s", "-t", "0.5", "(t + s)/2", "t - s", "1e-8*t")
MEASURES = (
    "normal(0.5, 0.3)",
    "exponential(2)",
    "uniform(0, 1)",
    "normal(t, 0.1)",
    "gamma(2, 3)",
    "triangular(0, s, 2)",
)
RANGES = ("[0, 1]", "[0, 1]", "[0, 1]", "[0, t*t + 0.1]", "[s, 1]", "[t, s]", "[0, 1e-8]", "[t, t]", "[-1, 1]")
RTOLS = (1e-4, 1e-6, 1e-8, 1e-8, 1e-10)


@dataclass(frozen=True)
class Drawn:
    """A program f with its arguments: numbers, or arrays of one length. moving: by which of them it is differentiated.

    others: the same with its variables in other orders.
    """

    text: str
    others: tuple[str, ...]
    arguments: tuple[Numbers | float, ...]
    moving: tuple[str, ...]
    rtol: float

    @property
    def size(self) -> int:
        return max(np.size(x) for x in self.arguments)

    def at(self, i: int) -> tuple[float, ...]:
        """The arguments of one member."""
        return tuple(float(x[i]) if isinstance(x, np.ndarray) else x for x in self.arguments)


class _Written:
    """One program in the making."""

    def __init__(self, pick: random.Random, variables: str) -> None:
        self.pick, self.variables = pick, variables

    def number(self, low: float, high: float) -> float:
        return round(self.pick.uniform(low, high), 2)

    def any(self, *ways: str) -> str:
        return self.pick.choice(ways)

    def variable(self) -> str:
        return self.pick.choice(self.variables)

    def parameter(self) -> str:
        return self.any(*PARAMETERS)

    def affine(self) -> str:
        factors = (self.pick.choice((-1, -0.5, 0.5, 1, 1, 2, 1e-8)) for _ in self.variables)
        return f"({' + '.join(f'{c}*{v}' for c, v in zip(factors, self.variables, strict=True))} - {self.parameter()})"

    def ball(self) -> str:
        squares = " + ".join(f"({v} - {self.number(0, 1)})^2" for v in self.variables)
        return f"({squares} - {self.number(0.02, 0.5)}*abs({self.parameter()}))"

    def surface(self) -> str:
        v, w, p = self.variable(), self.variable(), self.parameter()
        some: Sequence[Callable[[], str]] = (
            self.affine, self.affine, self.affine, self.ball,
            lambda: f"({v} - {p})",
            lambda: f"({v}*{w} - {p})",
            lambda: f"({v} - t*{w})",
            lambda: f"(sin({self.number(1, 6)}*{v}) - {w} + {p})",
            lambda: f"(exp({v}*t) - {w} - 1)",
            lambda: f"({v}^3 - {w}*t + {self.number(-0.3, 0.3)})",
            lambda: f"(abs({v} - t) - {self.number(0, 0.4)})",
            lambda: f"(max({v}, {w}*s) - {self.number(0, 0.8)})",
            lambda: f"(1e8*({v} - {p}))",
        )  # fmt: skip
        return self.pick.choice(some)()

    def factor(self) -> str:
        v = self.variable()
        return self.any(
            "1", v, f"{v}*t", f"exp({v}*s)", f"1/({v}*{v} + 0.2)", f"sqrt(abs({v}) + 0.01)", f"abs({v} - t)",
            f"cos(9*{v})", "t*t", f"max({v}, s)", f"sqrt(abs({v}))", f"exp(-({v} - t)^2*40)", f"{v}*{self.variable()}",
        )  # fmt: skip

    def condition(self) -> str:
        return self.any(
            f"[{self.surface()} > 0]",
            f"[{self.surface()} > 0]",
            f"[{self.surface()} > 0 and {self.surface()} > 0]",
            f"[{self.surface()} > 0 or {self.surface()} >= 0]",
            f"(if [{self.surface()} >= 0] then {self.factor()} else {self.factor()})",
            f"(1 - [{self.surface()} < 0])",
        )

    def body(self) -> str:
        return " + ".join(f"({self.factor()})*{self.condition()}" for _ in range(self.pick.choice((1, 1, 2))))


def drawn(number: int) -> Drawn:
    """Everything from a number."""
    pick = random.Random(number)
    return _picture(pick) if pick.random() < 0.4 else _integral(pick)


def _integral(pick: random.Random) -> Drawn:
    """An integral in one to three variables, of t and s."""
    variables = "xyz"[: pick.choice((1, 1, 1, 2, 2, 2, 2, 3))]
    written = _Written(pick, variables)
    ranges = [pick.choice(RANGES if pick.random() < 0.7 else MEASURES) for _ in variables]
    count = 24 if len(variables) < 3 else 12
    t = np.array([pick.choice((pick.randrange(9) / 8, pick.random(), 1e-8, 1.0)) for _ in range(count)])
    s = np.array([pick.choice((pick.randrange(9) / 8, pick.random(), x, 1 - x, x + 1e-9)) for x in t])
    body = written.body()
    texts = [_integrated("def f(t, s)", variables, ranges, body, order) for order in _orders(pick, len(variables))]
    held = pick.random() < 0.3
    return Drawn(texts[0], tuple(texts[1:]), (t, 0.5 if held else s), ("t", "s"), pick.choice(RTOLS))


def _picture(pick: random.Random) -> Drawn:
    """An integrand over the boxes of pixels at u and v, of t and s."""
    written = _Written(pick, "xy")
    body, h = written.body(), pick.choice((1 / 8, 1 / 8, 0.1))
    u, v = (x.ravel() * h for x in np.meshgrid(np.arange(10.0), np.arange(10.0)))
    ranges = [f"[u, u + {h!r}]", f"[v, v + {h!r}]"]
    texts = [_integrated("def f(t, s, u, v)", "xy", ranges, body, order) for order in _orders(pick, 2)]
    t, s = (pick.choice((pick.randrange(9) / 8, round(pick.random(), 3), 1e-8)) for _ in "ts")
    return Drawn(texts[0], tuple(texts[1:]), (t, s, u, v), ("t", "s"), pick.choice(RTOLS))


def _orders(pick: random.Random, count: int) -> list[list[int]]:
    """Two orders of so many variables, or the only one."""
    orders = [list(range(count)), list(range(count))]
    pick.shuffle(orders[0])
    orders[1] = [*orders[0][1:], orders[0][0]]
    return orders[: min(2, count)]


def _integrated(head: str, variables: str, ranges: Sequence[str], body: str, order: Sequence[int]) -> str:
    names = [variables[i] for i in order]
    over = [f"{variables[i]} ~ {r}" if "(" in (r := ranges[i]) and r[0] != "[" else r for i in order]
    bounds = over[0] if len(over) == 1 and over[0][0] == "[" else f"({', '.join(over)})"
    return f"{head} integral {bounds} {body} d({', '.join(names)})\n"
