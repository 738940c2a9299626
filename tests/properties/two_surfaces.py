"""Random programs with two or three surfaces, of which some have no closed form along a variable, or repeat along it.

Owns `two_surfaces`: the source of a function f(t) over a square, and the region that it means for `plain_sections`.
"""

from __future__ import annotations

import random

import numpy as np
from plain_sections import Function, Region


class _Source:
    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)

    def some(self, low: float, high: float) -> float:
        return round(self.random.uniform(low, high), 2)

    def level(self, other: str, low: float, high: float) -> str:
        """What a function is compared with: a number, the parameter, or what moves with the other variable."""
        at = self.random.random()
        if at < 0.45:
            return f"{self.random.choice([1.0, 1.0, 0.5])!r}*t"
        if at < 0.7:
            return f"({self.some(0.2, 1.0)!r}*t + ({self.some(-0.8, 0.8)!r})*{other})"
        return f"t*{other}" if at < 0.85 else f"({self.some(low, high)!r})"

    def periodic(self, a: str, b: str) -> str:
        function = self.random.choice(["sin", "sin", "cos", "tan"])
        inside = f"{self.some(0.8, 1.5 if function == 'tan' else 5.0)!r}*{a}"
        if self.random.random() < 0.3:
            inside += self.random.choice([" + t", f" + ({self.some(-1.0, 1.0)!r})*{b}"])
            inside = inside if function != "tan" else f"0.5*({inside})"
        return f"{function}({inside}) {self.random.choice('<>')} {self.level(b, -0.8, 0.8)}"

    def searched(self, a: str, b: str) -> str:
        """Monotone in one variable, without a root in closed form there."""
        p = repr(self.some(0.5, 1.5))
        left = self.random.choice([
            f"{a}^3 + {p}*{a}", f"exp(0.5*{a}) + {a}", f"{a}^5 + {p}*{a}", f"0.3*sin(2*{a}) + {a}",
            f"atan({a}) + 0.5*{a}", f"log(2 + {a}) + {a}", f"sinh({a}) + {p}*{a}",
        ])  # fmt: skip
        return f"{left} {self.random.choice('<>')} {self.level(b, 0.1, 1.5)}"

    def plain(self, a: str, b: str) -> str:
        at = self.random.random()
        if at < 0.5:
            return f"{a} {self.random.choice('<>')} {self.random.choice([1.0, 1.0, 0.7, 1.6])!r}*{b}"
        if at < 0.75:
            return f"{a} + {self.some(0.3, 2.0)!r}*{b} < t + 0.4"
        return f"{a}^2 + {b}^2 < t + 0.3"

    def program(self) -> tuple[str, Region]:
        makers = self.random.choice([
            (self.periodic, self.plain), (self.searched, self.plain), (self.periodic, self.searched),
            (self.periodic, self.periodic), (self.searched, self.searched), (self.periodic, self.searched, self.plain),
        ])  # fmt: skip
        conditions = [make(*(("x", "y") if self.random.random() < 0.4 else ("y", "x"))) for make in makers]
        weight = self.random.choice(["1", "1", "1", "exp(x*y)", "(x + t)", "cos(x - y)"])
        low = self.random.choice([0.0, 0.0, 0.0, -0.5])
        order = self.random.choice(["x, y", "y, x"])
        body = "*".join([*(f"[{condition}]" for condition in conditions), weight])
        source = f"def f(t)\n    integral ([{low!r}, 1], [{low!r}, 1]) {body} d({order})\n"

        return source, Region([_function(_difference(c)) for c in conditions], _function(weight), low, 1.0)


def _difference(condition: str) -> str:
    left, right = condition.split(" < ") if " < " in condition else reversed(condition.split(" > "))
    return f"({left}) - ({right})"


def _function(text: str) -> Function:
    """The numpy function that a formula of these programs means; Python spells all but its powers alike."""
    names = {name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "sinh")} | {"atan": np.arctan}
    made: Function = eval(f"lambda x, y, t: {text.replace('^', '**')}", names)
    return made


def two_surfaces(seed: int) -> tuple[str, Region]:
    """The source of a function f(t), and its meaning."""
    return _Source(seed).program()
