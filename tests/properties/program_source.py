"""Random well-typed programs of Potto, each with its meaning as a program for `plain_quadrature`.

Owns `random_program`. Parameters t and s, integrals over one and two variables, one inside another, and everything
that a condition, a bound and a call may look like.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from plain_quadrature import Array, Environment, Program, Record, integral

PARAMETERS = ["t", "s"]


@dataclass(frozen=True)
class Node:
    """A piece of source and what it means."""

    text: str
    run: Program

    def __call__(self, env: Environment, record: Record | None, n: int) -> Array:
        return self.run(env, record, n)


def number(value: float) -> Node:
    return Node(repr(value) if value >= 0 else f"({value!r})", lambda env, record, n: np.full(n, float(value)))


def name(text: str) -> Node:
    return Node(text, lambda env, record, n: env[text])


OPERATORS: dict[str, Any] = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide}


def apply(op: str, a: Node, b: Node) -> Node:
    f = OPERATORS[op]
    return Node(f"({a.text} {op} {b.text})", lambda env, record, n: f(a(env, record, n), b(env, record, n)))


def power(a: Node, exponent: int) -> Node:
    return Node(f"({a.text})^{exponent}", lambda env, record, n: a(env, record, n) ** exponent)


def call(function: Any, a: Node, text: str = "") -> Node:
    shape = text or {np.arctan: "atan(%s)"}.get(function, f"{function.__name__}(%s)")
    return Node(shape % a.text, lambda env, record, n: function(a(env, record, n)))


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


def bracket(condition: Node) -> Node:
    return Node(f"[{condition.text}]", chosen("%s%s%s", condition, number(1.0), number(0.0)).run)


def diffeo(surface: Node, then: Node, orelse: Node) -> Node:
    inner = chosen("%s%s%s", compare(">=", surface, number(0.0)), then, orelse)
    return Node(f"(if diffeo({surface.text}) then {then.text} else {orelse.text})", inner.run)


Bounds = tuple[str, Node, Node]


def integrals(bounds: Sequence[Bounds], body: Node) -> Node:
    run: Program = body
    for variable, lo, hi in reversed(bounds):
        run = integral(variable, lo, hi, run)
    if len(bounds) == 1:
        variable, lo, hi = bounds[0]
        return Node(f"(integral [{lo.text}, {hi.text}] ({body.text}) d({variable}))", run)
    box = ", ".join(f"[{lo.text}, {hi.text}]" for _, lo, hi in bounds)
    return Node(f"(integral ({box}) ({body.text}) d({', '.join(v for v, _, _ in bounds)}))", run)


def expectation(bounds: Sequence[Bounds], body: Node) -> Node:
    """Over uniform measures."""
    volume: Node = number(1.0)
    for _, lo, hi in bounds:
        volume = apply("*", volume, apply("-", hi, lo))
    box = ", ".join(f"{v} ~ uniform({lo.text}, {hi.text})" for v, lo, hi in bounds)
    names = ", ".join(v for v, _, _ in bounds)
    return Node(f"(integral ({box}) ({body.text}) d({names}))", apply("/", integrals(bounds, body), volume).run)


class Source:
    """One random program in the making."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.definitions: list[str] = []
        self.met: list[tuple[set[str], Node, Node]] = []

    def pick(self, *choices: Any) -> Any:
        return self.random.choice(choices)

    def likely(self, probability: float) -> bool:
        return self.random.random() < probability

    # Terms

    def constant(self) -> Node:
        return number(self.pick(0.5, 2.0, 0.3, 1.0, 0.25, 1.5, 3.0, 0.7, round(self.random.uniform(0.1, 2), 2)))

    def smooth(self, names: list[str], depth: int) -> Node:
        """Smooth and defined everywhere."""
        if not depth:
            return name(self.pick(*names)) if self.likely(0.7) else self.constant()
        a, square = self.smooth(names, depth - 1), lambda: power(self.smooth(names, depth - 1), 2)
        makers: tuple[tuple[float, Callable[[], Node]], ...] = (
            (0.45, lambda: apply(self.pick("+", "-", "*"), a, self.smooth(names, depth - 1))),
            (0.55, lambda: power(a, self.pick(2, 2, 3))),
            (0.63, lambda: call(np.sin, a)),
            (0.68, lambda: call(np.cos, a)),
            (0.74, lambda: call(np.exp, apply("*", number(0.5), call(np.sin, a)))),
            (0.80, lambda: apply("/", a, apply("+", number(1.0), square()))),
            (0.85, lambda: call(np.sqrt, apply("+", number(1.0), power(a, 2)))),
            (0.90, lambda: call(np.tanh, a)),
            (0.93, lambda: call(np.arctan, a)),
            (0.96, lambda: call(np.negative, a, "(-%s)")),
            (1.01, lambda: call(np.log, apply("+", number(1.0), power(a, 2)))),
        )
        return self.one_of(makers)

    def one_of(self, makers: tuple[tuple[float, Callable[[], Node]], ...]) -> Node:
        at = self.random.random()
        return next(make for bound, make in makers if at < bound)()

    def rough(self, names: list[str], depth: int) -> Node:
        a = self.smooth(names, depth)
        if self.likely(0.7):
            return a
        op = self.pick("abs", "min", "max", "clamp")
        others = {"abs": [], "clamp": [number(-0.4), number(0.6)]}.get(op)
        return bent(op, a, *([self.smooth(names, max(depth - 1, 0))] if others is None else others))

    def parameter(self) -> Node:
        """A term over the parameters."""
        a = name(self.pick(*PARAMETERS))
        return self.one_of((
            (0.50, lambda: a),
            (0.65, lambda: apply(self.pick("+", "-", "*"), a, self.constant())),
            (0.80, lambda: apply(self.pick("+", "-", "*"), a, name(self.pick(*PARAMETERS)))),
            (0.87, self.constant),
            (1.01, lambda: self.smooth(PARAMETERS, 2)),
        ))  # fmt: skip

    # Conditions

    def affine(self, names: list[str]) -> Node:
        total: Node | None = None
        for v in names:
            factor = self.pick(1.0, 1.0, 2.0, 0.5, 3.0, 0.7, -1.0, -2.0)
            part = name(v) if factor == 1.0 else apply("*", number(factor), name(v))
            total = part if total is None else apply("+", total, part)
        assert total is not None
        return total

    def squares(self, names: list[str], p: Node) -> Node:
        total = power(name(names[0]), 2)
        for v in names[1:]:
            total = apply("+", total, power(name(v), 2))
        return apply("+", total, apply("*", p, name(names[0]))) if self.likely(0.3) else total

    def surface(self, names: list[str]) -> tuple[Node, Node]:
        """Two sides of a comparison; now and then ones that were met before."""
        known = [(a, b) for free, a, b in self.met if free <= set(names)]
        if known and self.likely(0.25):
            pair: tuple[Node, Node] = self.pick(*known)
            return pair
        p, some = self.parameter(), names if self.likely(0.7) else [self.pick(*names)]
        second = name(some[-1]) if len(some) > 1 else p
        at = self.random.random()
        if at < 0.40:
            return self.affine(some), p
        if at < 0.55:
            return self.squares(some, p), apply("*", p, p) if self.likely(0.3) else p
        if at < 0.68:
            return apply("*", name(names[0]), name(names[-1]) if len(names) > 1 else self.parameter()), p
        if at < 0.76:
            return apply("*", p, name(some[0])), apply("+", number(0.3), apply("*", number(0.5), second))
        if at < 0.84:
            return call(np.exp, apply("*", number(0.8), self.affine(some))), apply("+", number(1.0), p)
        if at < 0.90:
            return call(np.sin, apply("*", number(2.0), self.affine(some))), apply("*", number(0.7), p)
        if at < 0.94:
            return bent("abs", apply("-", self.affine(some), p)), number(0.4)
        if at < 0.97:
            return bent(self.pick("min", "max"), name(some[0]), apply("*", number(0.7), second)), p
        return self.smooth(names + PARAMETERS, 2), self.smooth(names, 1)

    def comparison(self, names: list[str]) -> Node:
        a, b = self.surface(names)
        at = self.random.random()
        if at < 0.15:
            factor = number(self.pick(2.0, 0.5, 3.0))
            a, b = apply("*", factor, a), apply("*", factor, b)
        elif at < 0.25:
            a, b = b, a
        elif at < 0.32:
            a, b = apply("-", a, b), number(0.0)
        elif at < 0.38:
            a, b = apply("*", number(-2.0), a), apply("*", number(-2.0), b)
        if self.likely(0.4):
            self.met.append((set(names), a, b))
        if self.likely(0.08):
            return between(a, b, apply("+", a, number(0.3)))
        return compare(self.pick("<", "<=", ">", ">="), a, b)

    def condition(self, names: list[str], depth: int = 1) -> Node:
        at = self.random.random()
        if not depth or at < 0.55:
            return self.comparison(names)
        first = self.condition(names, depth - 1)
        if at > 0.85:
            return logic("not", first)
        return logic("and" if at < 0.7 else "or", first, self.condition(names, depth - 1))

    # What jumps

    def jump(self, names: list[str]) -> Node:
        every = names + PARAMETERS
        at = self.random.random()
        if at < 0.55:
            return bracket(self.condition(names))
        if at < 0.75:
            shape = self.pick("(if [%s] then %s else %s)", "([%s] ? %s : %s)")
            return chosen(shape, self.condition(names), self.smooth(every, 1), self.smooth(every, 1))
        if at < 0.85:
            return self.step(names)
        if at < 0.95:
            return diffeo(apply("-", *self.surface(names)), self.smooth(every, 1), self.smooth(every, 1))
        return self.passed(every)

    def define(self, stem: str) -> str:
        return f"{stem}{len(self.definitions) + 1}"

    def step(self, names: list[str]) -> Node:
        """A function that branches on its parameters."""
        u = apply("-", *self.surface(names))
        if self.likely(0.4):
            body = bracket(compare(self.pick("<", ">"), name("u"), number(self.pick(0.0, 0.2))))
            if self.likely(0.5):
                body = apply("*", body, apply("+", number(1.0), name("u")))
            f = self.define("step")
            self.definitions.append(f"def {f}(u) {body.text}")
            return Node(f"{f}({u.text})", lambda env, record, n: body({"u": u(env, record, n)}, record, n))
        w = self.smooth(names + PARAMETERS, 1)
        left = power(name("u"), 2) if self.likely(0.3) else apply("*", number(2.0), name("u"))
        body = bracket(compare("<", left, name("w")))
        f = self.define("step")

        def run(env: Environment, record: Record | None, n: int) -> Array:
            return body({"u": u(env, record, n), "w": w(env, record, n)}, record, n)

        if self.likely(0.6):
            self.definitions.append(f"def {f}(u, w) {body.text}")
            return Node(f"{f}({u.text}, {w.text})", run)
        self.definitions.append(f"{f} = \\u . \\w . {body.text}")
        return Node(f"(({f} ({u.text})) ({w.text}))", run)

    def passed(self, every: list[str]) -> Node:
        """A function that is passed to another: with some of its arguments, or inside a lambda."""
        x, p = self.smooth(every, 1), name(self.pick(*PARAMETERS))
        body = apply("*", bracket(compare("<", name("a"), name("b"))), apply("+", name("a"), number(2.0)))
        f, g = self.define("apply"), self.define("curried")
        self.definitions.append(f"def {f}(h, v) h(v)*h(v) + 1")
        self.definitions.append(f"{g} = \\a . \\b . {body.text}")
        inside = self.likely(0.5)

        def run(env: Environment, record: Record | None, n: int) -> Array:
            v, q = x(env, record, n), p(env, record, n)
            h = body({"a": v, "b": q} if inside else {"a": q, "b": v}, record, n)
            return h * h + 1

        function = f"\\v . {g} v ({p.text})" if inside else f"{g} ({p.text})"
        return Node(f"{f}({function}, {x.text})", run)

    def total(self, names: list[str]) -> Node:
        last, at = self.pick(2, 3), self.affine(names)
        body = bracket(compare("<", at, apply("*", name(self.pick(*PARAMETERS)), name("k"))))

        def run(env: Environment, record: Record | None, n: int) -> Array:
            return sum(body({**env, "k": np.full(n, float(k))}, record, n) for k in range(1, last + 1))

        return Node(f"(sum k in 1..{last} ({body.text}))", run)

    def body(self, names: list[str]) -> Node:
        every, jump = names + PARAMETERS, self.jump(names)
        return self.one_of((
            (0.35, lambda: apply("*", jump, self.rough(every, self.pick(1, 2)))),
            (0.50, lambda: apply("+", apply("*", jump, self.smooth(every, 1)), self.jump(names))),
            (0.60, lambda: apply("*", jump, self.jump(names))),
            (0.68, lambda: call(np.sin, apply("+", apply("*", number(3.0), jump), self.smooth(every, 1)))),
            (0.74, lambda: apply("/", number(1.0), apply("+", number(1.0), power(jump, 2)))),
            (0.80, lambda: power(jump, self.pick(2, 3))),
            (0.86, lambda: bent(self.pick("min", "max"), jump, self.smooth(every, 1))),
            (0.90, lambda: call(np.exp, call(np.sin, jump))),
            (0.95, lambda: self.total(names)),
            (1.01, lambda: self.rough(every, 2)),
        ))  # fmt: skip

    # Integrals

    def bounds(self, outer: list[str]) -> tuple[Node, Node]:
        at = self.random.random()
        if at < 0.40:
            low, high = self.pick((0.0, 1.0), (-1.0, 1.0), (0.0, 2.0), (-0.5, 1.5))
            lo, hi = number(low), number(high)
        elif at < 0.75:
            lo, hi = number(0.0) if at < 0.6 else self.parameter(), self.parameter()
        elif outer and at < 0.95:
            v = name(self.pick(*outer))
            lo, hi = number(0.0), self.one_of((
                (0.25, lambda: v),
                (0.50, lambda: apply("+", v, name(self.pick(*PARAMETERS)))),
                (0.75, lambda: apply("-", number(1.0), v)),
                (1.01, lambda: call(np.sqrt, apply("+", number(0.1), power(v, 2)))),
            ))  # fmt: skip
        else:
            lo, hi = self.smooth(PARAMETERS, 1), number(1.0)
        return (hi, lo) if self.likely(0.15) else (lo, hi)

    def integral(self, outer: list[str], new: list[str]) -> Node:
        box, names = [], list(outer)
        for v in new:
            box.append((v, *self.bounds(names)))
            names.append(v)
        body = self.body(names)
        if self.likely(0.1):
            top = apply("+", number(1.0), power(name(self.pick(*PARAMETERS)), 2))
            return expectation([(v, number(0.0), top) for v in new], body)
        return integrals(box, body)

    def nested(self) -> Node:
        """An integral whose integrand is a function of another one."""
        lo, hi = self.bounds([])
        inner = self.integral(["x"], ["y"])
        outer = self.one_of((
            (0.20, lambda: power(inner, 2)),
            (0.40, lambda: call(np.sin, inner)),
            (0.60, lambda: call(np.exp, call(np.sin, inner))),
            (0.73, lambda: bent("max", inner, number(0.3))),
            (0.86, lambda: bent("abs", inner)),
            (1.01, lambda: apply("*", inner, self.jump(["x"]))),
        ))  # fmt: skip
        return integrals([("x", lo, hi)], apply("*", outer, self.smooth(["x", *PARAMETERS], 1)))

    def program(self, flat: bool) -> Node:
        whole = self.one_of((
            (0.40, lambda: self.integral([], ["x"])),
            (0.48, lambda: apply("*", self.integral([], ["x"]), self.integral([], ["z"]))),
            (0.80, lambda: self.integral([], ["x"] if flat else ["x", "y"])),
            (1.01, lambda: self.integral([], ["x"]) if flat else self.nested()),
        ))  # fmt: skip
        if self.likely(0.15):
            plain = chosen("(if %s then %s else %s)", compare("<", name("t"), name("s")), name("t"), name("s"))
            whole = apply("+", whole, plain)
        return call(np.sin, whole) if self.likely(0.15) else whole


def random_program(seed: int, flat: bool = False) -> tuple[str, Program]:
    """The source of a function f(t, s), and its meaning. `flat`: integrals over one variable only."""
    source = Source(seed)
    whole = source.program(flat)
    return "\n".join([*source.definitions, f"def f(t, s)\n    {whole.text}\n"]), whole.run
