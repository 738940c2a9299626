"""Pieces of programs: each its source and what it means, as a program for `plain_quadrature`.

Owns `Node`, what makes nodes of nodes, and what binds variables: ranges and measures.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from plain_quadrature import Array, Environment, Program, Record, integral
from scipy import special


@dataclass(frozen=True)
class Node:
    """A piece of source and what it means."""

    text: str
    run: Program

    def __call__(self, env: Environment, record: Record | None, n: int) -> Array:
        return self.run(env, record, n)


def number(value: float) -> Node:
    return Node(repr(value) if value >= 0 else f"({value!r})", lambda env, record, n: np.full(n, float(value)))


def name(text: str, written: str = "") -> Node:
    return Node(written or text, lambda env, record, n: env[text])


OPERATORS: dict[str, Any] = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide}


def apply(op: str, a: Node, b: Node) -> Node:
    f = OPERATORS[op]
    return Node(f"({a.text} {op} {b.text})", lambda env, record, n: f(a(env, record, n), b(env, record, n)))


plus, minus, times, over = (partial(apply, op) for op in "+-*/")


def power(a: Node, exponent: int) -> Node:
    return Node(f"({a.text})^{exponent}", lambda env, record, n: a(env, record, n) ** exponent)


def call(function: Any, shape: str, *args: Node) -> Node:
    """A function of numbers, as numpy knows it and as Potto writes it."""
    texts = tuple(a.text for a in args)
    return Node(shape % texts, lambda env, record, n: function(*(a(env, record, n) for a in args)))


# Smooth and defined everywhere, of one argument and of two.
SMOOTH: tuple[tuple[Any, str], ...] = (
    (np.sin, "sin(%s)"), (np.cos, "cos(%s)"), (np.tanh, "tanh(%s)"), (np.arctan, "atan(%s)"),
    (special.erf, "erf(%s)"), (special.erfc, "erfc(%s)"), (special.j0, "besselj0(%s)"), (special.j1, "besselj1(%s)"),
    (lambda x: np.sinc(x / math.pi), "sinc(%s)"), (lambda x: 1 / np.cosh(np.clip(x, -700, 700)), "sech(%s)"),
    (lambda x: np.exp(0.5 * np.sin(x)), "exp(0.5*sin(%s))"), (lambda x: np.sqrt(1 + x * x), "sqrt(1 + (%s)^2)"),
    (lambda x: np.log1p(x * x), "log(1 + (%s)^2)"), (lambda x: np.log1p(x * x), "log1p((%s)^2)"),
    (lambda x: np.expm1(np.sin(x)), "expm1(sin(%s))"), (lambda x: np.tan(np.sin(x)), "tan(sin(%s))"),
    (lambda x: np.arcsin(0.9 * np.sin(x)), "asin(0.9*sin(%s))"),
    (lambda x: np.arccos(0.8 * np.cos(x)), "acos(0.8*cos(%s))"),
    (lambda x: np.sinh(np.sin(x)), "sinh(sin(%s))"), (lambda x: np.cosh(np.tanh(x)), "cosh(tanh(%s))"),
    (lambda x: special.gamma(2 + np.sin(x)), "gamma(2 + sin(%s))"),
    (lambda x: special.gammaln(1.5 + x * x), "lgamma(1.5 + (%s)^2)"),
    (lambda x: special.digamma(2 + np.cos(x)), "digamma(2 + cos(%s))"),
    (lambda x: special.erfinv(0.8 * np.sin(x)), "erfinv(0.8*sin(%s))"),
    (lambda x: 1 / (1 + x * x), "1/(1 + (%s)^2)"), (lambda x: (1 + x * x) ** 0.3, "(1 + (%s)^2)^0.3"),
    (lambda x: (1 + x * x) ** -1.5, "pow(1 + (%s)^2, -1.5)"), (np.negative, "(-%s)"),
)  # fmt: skip
OF_TWO: tuple[tuple[Any, str], ...] = (
    (lambda x, y: np.hypot(1 + x * x, y), "hypot(1 + (%s)^2, %s)"),
    (lambda x, y: np.arctan2(x, 1 + y * y), "atan2(%s, 1 + (%s)^2)"),
    (lambda x, y: (2 + np.sin(x)) ** np.cos(y), "(2 + sin(%s))^cos(%s)"),
    (lambda x, y: x / (1 + y * y), "(%s)/(1 + (%s)^2)"),
)


def note(record: Record | None, *margins: Array) -> None:
    if record is not None:
        record.extend(("sign", margin) for margin in margins)


def bent(op: str, *args: Node) -> Node:
    """abs, min, max or clamp."""

    def run(env: Environment, record: Record | None, n: int) -> Array:
        values = [a(env, record, n) for a in args]
        if op == "abs":
            note(record, 0 + values[0])
            return np.abs(values[0])
        if op == "clamp":
            note(record, values[0] - values[1], values[2] - values[0])
            return np.clip(*values)
        note(record, values[0] - values[1])
        return np.minimum(*values) if op == "min" else np.maximum(*values)

    return Node(f"{op}({', '.join(a.text for a in args)})", run)


def compare(op: str, a: Node, b: Node) -> Node:
    def run(env: Environment, record: Record | None, n: int) -> Array:
        x, y = a(env, record, n), b(env, record, n)
        note(record, x - y)
        return {"<": x < y, "<=": x <= y, ">": x > y, ">=": x >= y}[op]

    return Node(f"{a.text} {op} {b.text}", run)


def between(a: Node, x: Node, b: Node) -> Node:
    both = logic("and", compare("<=", a, x), compare("<", x, b))
    return Node(f"{a.text} <= {x.text} < {b.text}", both.run)


def logic(op: str, *args: Node) -> Node:
    def run(env: Environment, record: Record | None, n: int) -> Array:
        values = [a(env, record, n) for a in args]
        return ~values[0] if op == "not" else (values[0] & values[1] if op == "and" else values[0] | values[1])

    texts = [f"({a.text})" for a in args]
    return Node(f"not {texts[0]}" if op == "not" else f" {op} ".join(texts), run)


def chosen(shape: str, condition: Node, then: Node, orelse: Node) -> Node:
    def run(env: Environment, record: Record | None, n: int) -> Array:
        return np.where(condition(env, record, n), then(env, record, n), orelse(env, record, n))

    return Node(shape % (condition.text, then.text, orelse.text), run)


def diffeo(surface: Node, then: Node, orelse: Node) -> Node:
    inner = chosen("%s%s%s", compare(">=", surface, number(0.0)), then, orelse)
    return Node(f"(if diffeo({surface.text}) then {then.text} else {orelse.text})", inner.run)


@dataclass(frozen=True)
class Binder:
    """What a variable ranges over. within: the integral of a body over it. fixed: it follows no other variable.

    factor: what the source says of a body that is written in another variable.
    """

    variable: str
    text: str
    within: Callable[[Program], Program]
    fixed: bool
    factor: str = ""

    @property
    def drawn(self) -> bool:
        return "~" in self.text


def ranged(variable: str, text: str, lo: Node, hi: Node, fixed: bool, factor: str = "") -> Binder:
    return Binder(variable, text, lambda body: integral(variable, lo, hi, body), fixed, factor)


def weighted(variable: str, lo: Node, hi: Node, density: Node) -> Callable[[Program], Program]:
    return lambda body: integral(variable, lo, hi, times(Node("", body), density).run)


def integrals(binders: Sequence[Binder], body: Node, nested: bool = False) -> Node:
    """`nested`: written one inside of the other; so are ranges beside measures."""
    run: Program = body
    for binder in reversed(binders):
        run = binder.within(run)
    factor = "".join(binder.factor for binder in binders)
    text = f"({body.text}){factor}"
    if nested or len({binder.drawn for binder in binders}) > 1 or len(binders) == 1:
        for binder in reversed(binders):
            bounds = f"({binder.text})" if binder.drawn else binder.text
            text = f"(integral {bounds} {text} d({binder.variable}))"
        return Node(text, run)
    box, names = ", ".join(binder.text for binder in binders), ", ".join(binder.variable for binder in binders)
    return Node(f"(integral ({box}) {text} d({names}))", run)


def spike(lo: Node, hi: Node, slope: float, place: Node, variable: str, body: Node) -> Program:
    """The integral of delta(slope*variable - place) times a body."""

    def run(env: Environment, record: Record | None, n: int) -> Array:
        a, b, x = lo(env, record, n), hi(env, record, n), place(env, record, n) / slope
        note(record, x - a, b - x, b - a)
        inside = ((a < x) & (x < b)) * 1.0 - ((b < x) & (x < a)) * 1.0
        return inside * body({**env, variable: x}, record, n) / abs(slope)

    return run
