"""Definitions of two parameters at random: integrals of things that bend, jump and move, and what is around them."""

from __future__ import annotations

import random

FACTORS = ("x", "t", "c", "x*t", "x^2", "exp(-c*x)", "sin(3*x + t)", "(x - t)", "1/(1 + x^2)", "max(x, c)",
           "sqrt(1 + t*x^2)", "(2*c - x)", "abs(x - c)", "cos(t)", "0.5")  # fmt: skip
CONDITIONS = ("x < t", "t < x", "x^2 < t", "c*x < t", "x + c > t", "(x - t)^2 < 0.04", "x < t and x > c/2",
              "exp(x) < 1 + t", "x < t + c", "abs(x - t) < c/3", "x < 0.5 or x > t", "x^2 + t*x < c", "x < t*c",
              "1/(1 + x) < t")  # fmt: skip
BOUNDS = ("[0, 1]", "[0, t]", "[-1, 1]", "[c/4, 1]", "[t, t + 1]", "[-c, t^2]")
PLANES = ("x + y < t", "y < t*x", "x^2 + y^2 < t^2", "x - y < c", "y < c and x < t", "x < t*y + c", "x*y < t*c",
          "x + t*y < 1")  # fmt: skip
AROUND = ("{}", "2*({})", "({})^2", "sin({})", "t*({}) - c", "exp(c*({}))", "({})/(1 + c)")


def definition(rng: random.Random) -> str:
    """A definition `f(t, c)`, maybe of calls of another one."""
    first = rng.choice(AROUND).format(_integral(rng))
    match rng.randrange(5):
        case 0:
            return f"def f(t, c) {first} + {_integral(rng)}\n"
        case 1:
            inner = rng.choice(("g(t*c, c)", "g(c, t)*t", "g(t, c)^2", "g(t, 0.4)/g(0.6, c + 1)"))
            return f"def g(t, c) {_integral(rng)} + 1\n\ndef f(t, c) {inner}\n"
        case _:
            return f"def f(t, c) {first}\n"


def _integral(rng: random.Random) -> str:
    factors = [rng.choice(FACTORS) for _ in range(rng.randrange(3))]
    if rng.random() < 0.3:
        body = "*".join([*factors, f"[{rng.choice(PLANES)}]"])
        return f"(integral ([0, 1], [0, 1]) {body} d(x, y))"
    if rng.random() < 0.3:
        choice = f"(if [{rng.choice(CONDITIONS)}] then {rng.choice(FACTORS)} else {rng.choice(FACTORS)})"
        factors.append(choice)
    if rng.random() < 0.8 or not factors:
        factors.append(f"[{rng.choice(CONDITIONS)}]")
    return f"(integral {rng.choice(BOUNDS)} {'*'.join(factors)} d(x))"
