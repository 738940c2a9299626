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


CURVED = ("x^2 + t*x < c", "t*x^2 + x < c", "x^2 - t*x + c/8 > 0", "sin(3*x) < t", "cos(2*x + t) > c", "sin(x^2) < t",
          "x^3 < t", "sqrt(x + t) < 1 + c/4", "tan(x) < t", "log(1 + x) < t*c", "x^2 < t*c", "(x - t)*(x - c/2) < 0",
          "sin(x) + cos(x) > 1 + t/3", "t*x^2 + c*x < 1/3", "abs(x^2 - t) < c/2", "cos(t*x) < 1 - c/3")  # fmt: skip
PLANES_CURVED = ("x^2 + y^2 + t*x < c", "(x - t)^2 + y^2 < c^2", "y < t*x^2", "y^2 < t*x", "x^2 - y^2 < t",
                 "sin(x + y) < t", "x^2 + x*y + y^2 < c", "x^2/t^2 + y^2/c^2 < 1", "y < sin(3*x)*t",
                 "max(x, y) < t")  # fmt: skip
SUMS = ("sum i in 1..3 (integral [0, 1] [i*x < t]*x^i*{0} d(x))",
        "integral [0, 1] (sum i in 1..3 ([x < t/i]*{0}*i)) d(x)",
        "sum i in 0..2 (integral [0, 1] [x^2 < t*c/(i + 1)]*{0} d(x))",
        "(sum i in 1..2 (integral [0, i] [{1}]*{0} d(x)))^2")  # fmt: skip
FUNCTIONS = ("integral [0, 1] g(x)*[{1}]*{0} d(x)", "integral [0, 1] [x < g(t)]*{0} d(x)",
             "g(integral [0, 1] [{1}]*{0} d(x))", "integral [0, g(c)] [x < t]*{0} d(x)",
             "integral ([0, 1], [0, 1]) g(x)*[y < t*g(x)] d(x, y)",
             "integral [0, 1] (if [{1}] then g(x*t) else {0}) d(x)")  # fmt: skip
ARRAYS = ("sum i in 0..2 (integral [0, 1] [x < xs[i]*t]*{0} d(x))",
          "integral [0, 1] (sum i in 0..2 (xs[i]*[{1}]*{0})) d(x)",
          "xs[1]*(integral [0, xs[0]] [{1}]*{0} d(x))", "sum p in xs (p*integral [0, 1] [x < p*c]*{0} d(x))",
          "integral [0, 1] [xs[0]*x^2 + xs[1]*x < xs[2]*t]*{0} d(x)")  # fmt: skip
CALLS = ("h(x, t)*[{1}]", "[x < k(t, c)]*h(x, c)", "h(x, k(c, t))*[x < t]", "h(k(x, t), c)*[{1}]")


def program(rng: random.Random) -> tuple[str, str]:
    """A definition `f` of any kind, and the name of that: of numbers, a function or an array too."""
    condition = rng.choice(CURVED if rng.random() < 0.7 else CONDITIONS)
    factor = rng.choice(FACTORS)
    match rng.randrange(7):
        case 0:
            return definition(rng), "plain"
        case 1:
            bounds = rng.choice(("[0, 1]", "[-1, 2]", "[0, t]", "[-t, 3]"))
            whole = f"(integral {bounds} {factor}*[{condition}] d(x))"
            return f"def f(t, c) {rng.choice(AROUND).format(whole)}\n", "curved"
        case 2:
            body = f"integral ([0, 1], [-1, 1]) [{rng.choice(PLANES_CURVED)}]*{factor} d(x, y)"
            return f"def f(t, c) {body}\n", "curved plane"
        case 3:
            return f"def f(t, c) {rng.choice(SUMS).format(factor, condition)}\n", "sum"
        case 4:
            return f"def f(t, c, g) {rng.choice(FUNCTIONS).format(factor, condition)}\n", "function"
        case 5:
            return f"def f(t, c, xs: [3] Real) {rng.choice(ARRAYS).format(factor, condition)}\n", "array"
        case _:
            head = "def h(x, t) x*t + x^2\n\ndef k(t, c) t*c/2 + t^2/3\n\n"
            body = f"integral [0, 1] {rng.choice(CALLS).format(factor, condition)} d(x)"
            return f"{head}def f(t, c) {rng.choice(AROUND).format(f'({body})')}\n", "call"
