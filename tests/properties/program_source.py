"""Random well-typed programs of Potto, each with its meaning as a program for `plain_quadrature`.

Owns `random_program`. Parameters t and s, integrals over one to three variables, one inside another, over ranges and
measures, and everything that a condition, a bound and a call may look like. A program has many
spellings: written out, behind calls and `let`, in another order of variables, mirrored, scaled, nested.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from plain_quadrature import Array, Environment, Program, Record
from program_kinds import (
    around,
    chosen_plainly,
    declared,
    delta_of_a_function,
    differentiated,
    endless,
    guarded,
    rendered,
)
from program_measures import measures
from program_nodes import (
    Binder,
    Node,
    apply,
    bent,
    between,
    call,
    chosen,
    compare,
    diffeo,
    integrals,
    logic,
    minus,
    name,
    number,
    over,
    plus,
    power,
    ranged,
    spike,
    times,
)
from program_terms import PARAMETERS, Terms

# How a variable may be written: in another one of which it is this multiple, shifted by that.
WRITTEN = ((-1.0, 0.0), (-1.0, 0.0), (2.0, 0.0), (0.5, 1.0), (1.0, -3.0), (1e-8, 0.0), (1e6, 0.0), (-3.0, 0.25))
SCALES = (2.0, 0.5, 3.0, 1e8, 1e-8, 0.1)


class Source(Terms):
    """One random program in the making."""

    # Conditions

    def affine(self, names: list[str]) -> Node:
        total: Node | None = None
        for v in names:
            factor = self.pick(1.0, 1.0, 2.0, 0.5, 3.0, 0.7, -1.0, -2.0)
            part = self.name(v) if factor == 1.0 else times(number(factor), self.name(v))
            total = part if total is None else self.swapped("+", total, part)
        assert total is not None
        return total

    def conic(self, names: list[str], p: Node) -> Node:
        total = power(self.name(names[0]), 2)
        for v in names[1:]:
            square = power(self.name(v), 2)
            op = self.pick("+", "+", "-")
            total = apply(op, total, times(self.constant(), square) if self.likely(0.5) else square)
        if len(names) > 1 and self.likely(0.3):
            total = plus(total, times(number(self.pick(0.5, -1.0, 1.5)), times(*map(self.name, names[:2]))))
        return plus(total, times(p, self.name(names[0]))) if self.likely(0.3) else total

    def last(self, names: list[str]) -> Node:
        return self.name(names[-1]) if len(names) > 1 else self.parameter()

    def searched(self, names: list[str]) -> Node:
        """Has no roots in closed form along a variable, or several."""
        x, y = self.name(names[0]), self.name(names[-1])
        a = number(self.pick(0.5, 1.0, 1.5, 2.5))
        cube = power(x, 3)
        return self.one_of((
            (0.20, lambda: minus(cube, times(a, y))),
            (0.35, lambda: plus(cube, power(y, 3)) if y != x else minus(cube, times(a, x))),
            (0.50, lambda: call(lambda u, v: u * np.exp(-v * v), "%s*exp(-(%s)^2)", x, y)),
            (0.65, lambda: plus(call(lambda u: np.cos(2 * u), "cos(2*%s)", x), call(np.cos, "cos(%s)", times(a, y)))),
            (0.80, lambda: plus(call(lambda u: np.exp(0.5 * u), "exp(0.5*%s)", x), times(a, power(y, 2)))),
            (1.01, lambda: plus(self.smooth(names, 2), times(a, x))),
        ))  # fmt: skip

    def surface(self, names: list[str]) -> tuple[Node, Node]:
        """Two sides of a comparison; now and then ones that were met before."""
        known = [(a, b) for free, a, b in self.met if free <= set(names)]
        if known and self.likely(0.25):
            a, b = self.pick(*known)
            # the same, or nearly: parallel to it, or turned a little
            return (a, b) if self.likely(0.7) else (a, plus(b, number(self.pick(1e-8, 1e-15, 1e-3, 0.1))))
        p, some = self.parameter(), names if self.likely(0.7) else [self.pick(*names)]
        if self.likely(0.3):
            some = some[::-1]
        second = self.name(some[-1]) if len(some) > 1 else p
        makers: tuple[tuple[float, Callable[[], tuple[Node, Node]]], ...] = (
            (0.34, lambda: (self.affine(some), p)),
            (0.47, lambda: (self.conic(some, p), times(p, p) if self.likely(0.3) else p)),
            (0.55, lambda: (times(self.name(names[0]), self.last(names)), p)),
            (0.60, lambda: (times(p, self.name(some[0])), plus(number(0.3), times(number(0.5), second)))),
            (0.65, lambda: (call(lambda u: np.exp(0.8 * u), "exp(0.8*%s)", self.affine(some)), plus(number(1.0), p))),
            (0.71, lambda: (call(np.sin, "sin(%s)", times(number(self.pick(2.0, 5.0)), self.affine(some))),
                            times(number(0.7), p))),
            (0.81, lambda: (self.searched(some), p)),
            (0.84, lambda: (call(lambda x, y: x / (1 + y * y), "%s/(1 + (%s)^2)", self.name(some[0]), second), p)),
            (0.86, lambda: (call(np.hypot, "hypot(%s, %s)", self.name(some[0]), minus(second, p)), self.constant())),
            (0.87, lambda: (around(self.name(some[0]), minus(second, p)), times(number(0.7), p))),
            (0.91, lambda: (bent("abs", minus(self.affine(some), p)), number(0.4))),
            (0.94, lambda: (bent(self.pick("min", "max"), self.name(some[0]), times(number(0.7), second)), p)),
            (0.97, lambda: (plus(self.name(some[0]), times(self.constant(), self.bracket(self.comparison(names)))), p)),
            (1.01, lambda: (self.smooth(names + PARAMETERS, 2), self.smooth(names, 1))),
        )  # fmt: skip
        at = self.random.random()
        return next(make for bound, make in makers if at < bound)()

    def comparison(self, names: list[str]) -> Node:
        a, b = self.surface(names)
        if self.likely(0.4):
            self.met.append((set(names), a, b))
        if self.likely(0.08):
            return between(a, b, plus(a, number(0.3)))
        op = self.pick("<", "<=", ">", ">=")
        plain = compare(op, self.behind(a, names), b)
        turned = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}[op]
        if not self.styled(0.5):
            return plain
        c = self.chosen_style(*SCALES)
        return Node(self.chosen_style(
            f"{b.text} {turned} {a.text}", f"{c!r}*{a.text} {op} {c!r}*{b.text}", f"{a.text} - {b.text} {op} 0",
            f"-{c!r}*{a.text} {turned} -{c!r}*{b.text}", f"({b.text} - {a.text})/{c!r} {turned} 0",
        ), plain.run)  # fmt: skip

    def condition(self, names: list[str], depth: int = 2) -> Node:
        at = self.random.random()
        if not depth or at < 0.6:
            return self.comparison(names)
        first = self.condition(names, depth - 1)
        if at > 0.9:
            return logic("not", first)
        return self.joined("and" if at < 0.77 else "or", first, self.condition(names, depth - 1))

    # What jumps

    def jump(self, names: list[str]) -> Node:
        every = names + PARAMETERS
        at = self.random.random()
        if at < 0.47:
            return self.behind(self.bracket(self.condition(names)), names, "bracket")
        if at < 0.50:
            return self.behind(guarded(self, names), names, "guarded")
        if at < 0.53:
            return declared(self, names)
        if at < 0.55:
            return chosen_plainly(self, self.bracket(self.comparison(names)), self.smooth(every, 1))
        if at < 0.75:
            shape = self.pick("(if [%s] then %s else %s)", "([%s] ? %s : %s)")
            return chosen(shape, self.condition(names), self.smooth(every, 1), self.smooth(every, 1))
        if at < 0.85:
            return self.step(names)
        if at < 0.95:
            return diffeo(minus(self.affine(names), self.parameter()), self.smooth(every, 1), self.smooth(every, 1))
        return self.passed(every)

    def step(self, names: list[str]) -> Node:
        """A function that branches on its parameters."""
        u = minus(*self.surface(names))
        if self.likely(0.4):
            body = self.bracket(compare(self.pick("<", ">"), name("u"), number(self.pick(0.0, 0.2))))
            if self.likely(0.5):
                body = times(body, plus(number(1.0), name("u")))
            f = self.define("step")
            self.definitions.append(f"def {f}(u) {body.text}")
            return Node(f"{f}({u.text})", lambda env, record, n: body({"u": u(env, record, n)}, record, n))
        w = self.smooth(names + PARAMETERS, 1)
        left = power(name("u"), 2) if self.likely(0.3) else times(number(2.0), name("u"))
        body = self.bracket(compare("<", left, name("w")))
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
        body = times(self.bracket(compare("<", name("a"), name("b"))), plus(name("a"), number(2.0)))
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
        last, at = self.pick(2, 3, 6), self.affine(names)
        body = self.bracket(compare("<", at, times(name(self.pick(*PARAMETERS)), name("k"))))

        def run(env: Environment, record: Record | None, n: int) -> Array:
            return sum(body({**env, "k": np.full(n, float(k))}, record, n) for k in range(1, last + 1))

        if self.styled(0.3):  # written out
            return Node(f"({' + '.join(f'(let k = {k} in {body.text})' for k in range(1, last + 1))})", run)
        return Node(f"(sum k in 1..{last} ({body.text}))", run)

    def fold(self, names: list[str]) -> Node:
        """A state that is stepped a few times, by recursion, perhaps with a jump at each step."""
        last, x = self.pick(2, 3, 5), self.smooth([*names, *PARAMETERS], 1)
        below = compare("<", self.affine(names), times(name(self.pick(*PARAMETERS)), name("k")))
        grown = times(self.bracket(below), self.constant()) if self.likely(0.6) else times(number(0.3), name("k"))
        step = plus(times(number(self.pick(0.5, -0.5, 0.9)), name("state")), grown)
        f, given = self.define("fold"), ", ".join(dict.fromkeys([*names, *PARAMETERS]))
        written = {v: self.written.get(v, v) for v in names}
        here = ", ".join([*(written[v] for v in names), *PARAMETERS])
        text = step.text
        for v in names:  # inside of the function a variable is written as it is
            text = text.replace(written[v], v)
        self.definitions.append(f"def {f}(k, state, {given})\n    if k > 0 then {f}(k - 1, {text}, {given}) else state")

        def run(env: Environment, record: Record | None, n: int) -> Array:
            state = x(env, record, n)
            for k in range(last, 0, -1):
                state = step({**env, "k": np.full(n, float(k)), "state": state}, record, n)
            return state

        return Node(f"{f}({last}, {x.text}, {here})", run)

    def body(self, names: list[str]) -> Node:
        every, jump = names + PARAMETERS, self.jump(names)
        return self.behind(self.one_of((
            (0.35, lambda: self.swapped("*", jump, self.rough(every, self.pick(1, 2)))),
            (0.50, lambda: self.swapped("+", times(jump, self.smooth(every, 1)), self.jump(names))),
            (0.60, lambda: self.swapped("*", jump, self.jump(names))),
            (0.65, lambda: call(np.sin, "sin(%s)", plus(times(number(3.0), jump), self.smooth(every, 1)))),
            (0.70, lambda: over(number(1.0), plus(number(1.0), power(jump, 2)))),
            (0.75, lambda: power(jump, self.pick(2, 3))),
            (0.80, lambda: bent(self.pick("min", "max"), jump, self.smooth(every, 1))),
            (0.84, lambda: call(np.exp, "exp(%s)", call(np.sin, "sin(%s)", jump))),
            (0.88, lambda: self.total(names)),
            (0.92, lambda: self.fold(names)),
            (1.01, lambda: self.rough(every, 2)),
        )), names, "body")  # fmt: skip

    # Integrals

    def bounds(self, outer: list[str]) -> tuple[Node, Node, bool]:
        """Both, and whether they follow no other variable."""
        at, fixed = self.random.random(), True
        if at < 0.03 and outer:
            step = times(number(0.5), self.bracket(self.comparison(outer)))
            lo, hi, fixed = self.parameter(), plus(number(1.0), step), False
        elif at < 0.40:
            low, high = self.pick((0.0, 1.0), (-1.0, 1.0), (0.0, 2.0), (-0.5, 1.5))
            lo, hi = number(low), number(high)
        elif at < 0.75:
            lo, hi = number(0.0) if at < 0.6 else self.parameter(), self.parameter()
        elif outer and at < 0.95:
            v, fixed = self.name(self.pick(*outer)), False
            lo, hi = number(0.0), self.one_of((
                (0.25, lambda: v),
                (0.50, lambda: plus(v, name(self.pick(*PARAMETERS)))),
                (0.75, lambda: minus(number(1.0), v)),
                (1.01, lambda: call(lambda x: np.sqrt(0.1 + x * x), "sqrt(0.1 + %s^2)", v)),
            ))  # fmt: skip
        else:
            lo, hi = self.smooth(PARAMETERS, 1), number(1.0)
        return (hi, lo, fixed) if self.likely(0.15) else (lo, hi, fixed)

    def range(self, v: str, outer: list[str]) -> Binder:
        """A range; the variable is perhaps written in another one."""
        lo, hi, fixed = self.bounds(outer)
        if not self.styled(0.3):
            return ranged(v, f"[{lo.text}, {hi.text}]", lo, hi, fixed)
        slope, shift = self.chosen_style(*WRITTEN)
        self.written[v] = f"({slope!r}*{v} + {shift!r})" if shift else f"({slope!r}*{v})"
        text = ", ".join(f"({end.text} - {shift!r})/{number(slope).text}" for end in (lo, hi))
        return ranged(v, f"[{text}]", lo, hi, fixed, f"*{number(slope).text}")

    def binder(self, v: str, outer: list[str], drawn: bool) -> Binder:
        if drawn:
            return measures(self.random, v, [name(p) for p in PARAMETERS], [self.name(x) for x in outer])
        return endless(self, v, outer) if self.likely(0.05) else self.range(v, outer)

    def integral(self, outer: list[str], new: list[str]) -> Node:
        binders, names, drawn = [], list(outer), self.likely(0.2)
        for v in new:
            binders.append(self.binder(v, names, drawn or self.likely(0.05)))
            names.append(v)
        body = self.body(names)
        whole = integrals(binders, body)
        if self.styled(0.3) and all(binder.fixed for binder in binders):
            assert self.style is not None
            order = self.style.sample(binders, len(binders))
            return Node(integrals(order, body, nested=self.styled(0.3)).text, whole.run)
        return integrals(binders, body, nested=self.styled(0.2))

    def spiked(self) -> Node:
        """An integral with a delta, of the innermost variable or of several."""
        names = self.pick(["x"], ["x", "y"])
        outer = [self.range(v, []) for v in names[:-1]]
        lo, hi, _ = self.bounds(names[:-1])
        kind, v = self.random.random(), names[-1]
        if kind < 0.5:
            place = plus(self.parameter(), self.affine(names[:-1])) if outer else self.parameter()
            body = self.smooth(names + PARAMETERS, 1)
            if kind < 0.25:
                whole = delta_of_a_function(self, v, lo, hi, place, body)
            else:
                whole = differentiated(self, v, lo, hi, place)
            inner = Binder(v, f"[{lo.text}, {hi.text}]", lambda body: body, True)
            return integrals([*outer, inner], whole, nested=self.styled(0.3))
        slope, v = self.pick(1.0, -1.0, 2.0, 0.5), names[-1]
        place = plus(self.parameter(), self.affine(names[:-1])) if outer else self.parameter()
        body = self.smooth(names + PARAMETERS, 1) if self.likely(0.5) else self.jump(names)
        text = f"({body.text})*delta({number(slope).text}*{v} - {place.text})"
        inner = Binder(v, f"[{lo.text}, {hi.text}]", lambda _: spike(lo, hi, slope, place, v, body), True)
        return integrals([*outer, inner], Node(text, body.run), nested=self.styled(0.3))

    def nested(self) -> Node:
        """An integral whose integrand is a function of another one."""
        over = self.range("x", [])
        inner = self.integral(["x"], ["y"])
        outer = self.one_of((
            (0.20, lambda: power(inner, 2)),
            (0.40, lambda: call(np.sin, "sin(%s)", inner)),
            (0.60, lambda: call(lambda u: np.exp(np.sin(u)), "exp(sin(%s))", inner)),
            (0.73, lambda: bent("max", inner, number(0.3))),
            (0.86, lambda: bent("abs", inner)),
            (1.01, lambda: times(inner, self.jump(["x"]))),
        ))  # fmt: skip
        return integrals([over], times(self.behind(outer, ["x"]), self.smooth(["x", *PARAMETERS], 1)))

    def program(self, flat: bool) -> Node:
        whole = self.one_of((
            (0.40, lambda: self.integral([], ["x"])),
            (0.44, lambda: times(self.integral([], ["x"]), self.integral([], ["z"]))),
            (0.50, self.spiked),
            (0.52, lambda: self.integral([], ["x"]) if flat else rendered(self)),
            (0.76, lambda: self.integral([], ["x"] if flat else ["x", "y"])),
            (0.80, lambda: self.integral([], ["x"] if flat else ["x", "y", "z"])),
            (1.01, lambda: self.integral([], ["x"]) if flat else self.nested()),
        ))  # fmt: skip
        if self.likely(0.15):
            plain = chosen("(if %s then %s else %s)", compare("<", name("t"), number(0.6)), name("t"), name("s"))
            whole = plus(whole, plain)
        whole = self.behind(whole, [], "whole")
        return call(np.sin, "sin(%s)", whole) if self.likely(0.15) else whole


def random_program(seed: int, flat: bool = False, spelling: int = 0, unit: float = 1.0) -> tuple[str, Program]:
    """The source of a function f(t, s), and its meaning. `flat`: integrals over one variable only.

    unit: what one of t comes to in the source, which then is f(t*unit, s).
    """
    source = Source(seed, spelling)
    whole = source.program(flat)
    name = "f" if unit == 1.0 else "plain"
    ends = [f"def {name}(t, s)\n    {whole.text}\n"]
    if unit != 1.0:
        ends.append(f"def f(t, s) plain(t/{unit!r}, s)\n")
    return "\n".join([*source.definitions, *ends]), whole.run
