"""Random programs with arrays, records, folds, look-ups and functions in arrays, each with its meaning by plain numpy.

Owns `array_program` and `given_arrays`. The program is `f(t, s)`, which hands arrays made of t and s to `g`: slopes can
be asked for along t and s as of any program, and in reverse by all elements of what `g` is given.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from plain_quadrature import Array, Environment, Program, Record
from program_elements import FIELDS, Elements, part, reduced
from program_nodes import (
    Node,
    apply,
    bent,
    call,
    chosen,
    compare,
    integrals,
    name,
    note,
    number,
    plus,
    power,
    ranged,
    times,
)

HEAD = """record Spot(at: (Real, Real), r: Real)
def reach(d: Spot, u) [d.at.x - u < d.r]*(u - d.at.y)
def bump(w) \\u . exp(-(u - w)^2)
"""
GIVEN = "xs: [n] Real, ys: [m] Real, p: (Real, Real), c: Spot, spots: [k] Spot, photo: [h, w] Real"


class Scene(Elements):
    """One random program with arrays in the making."""

    def reduction(self, depth: int) -> Node:
        op, clauses = self.pick("sum", "sum", "sum", "product", "min", "max"), self.clauses()
        with self.inside(clauses):
            body = self.term(depth - 1)
        if op == "product":
            body = call(np.tanh, "tanh(%s)", body)
        shape = f"({op} {', '.join(clause.text for clause in clauses)} ({body.text}))"
        if self.styled(0.2) and len(clauses) == 1 and op == "sum":
            v = self.fresh("v")
            shape = f"(sum {v} in [{body.text} for {clauses[0].text}] ({v}))"
        return Node(shape, partial(reduced, op, clauses, body))

    def picked(self, depth: int) -> Node:
        """An element of an array that is made here."""
        clauses = self.clauses()
        with self.inside(clauses):
            body = self.term(depth - 1)
        places = [self.pick(*range(clause.count)) for clause in clauses]

        def run(env: Environment, record: Record | None, n: int) -> Array:
            for clause, place in zip(clauses, places, strict=True):
                env = clause.bind(env, place, n)
            return body(env, record, n)

        made = ", ".join(clause.text for clause in clauses)
        return Node(f"[{body.text} for {made}][{', '.join(map(str, places))}]", run)

    def folded(self, depth: int) -> Node:
        """A state of one number, of two, or of a record, stepped a few times."""
        clause, kind = self.clause(), self.pick("one", "two", "record")
        names = {"one": [self.fresh("q")], "two": [self.fresh("q"), self.fresh("w")]}.get(kind, [])
        of = self.fresh("e") if kind == "record" else ""
        starts = [self.term(depth - 1) for _ in range(3 if of else len(names))]
        states = names or [f"{of}.at.x", f"{of}.at.y", f"{of}.r"]
        with self.inside([clause], *(name(state) for state in states)):
            steps = [self.step(depth - 1) for _ in states]
        text = ", ".join(step.text for step in steps)
        begun = ", ".join(start.text for start in starts)
        if of:
            made = "Spot(at=({}, {}), r={})".format
            text, begun = made(*(step.text for step in steps)), made(*(start.text for start in starts))
        target = of or (names[0] if len(names) == 1 else f"({', '.join(names)})")
        loop = f"fold {target} = {begun if of or len(names) == 1 else f'({begun})'} for {clause.text} ("
        loop += f"{text if of or len(names) == 1 else f'({text})'})"
        place = self.pick(*range(len(states)))
        taken = f"({loop})" if len(states) == 1 else f"({loop}).{['at.x', 'at.y', 'r'][place] if of else place}"

        def run(env: Environment, record: Record | None, n: int) -> Array:
            values = [start(env, record, n) for start in starts]
            for k in range(clause.count):
                at = {**clause.bind(env, k, n), **dict(zip(states, values, strict=True))}
                values = [step(at, record, n) for step in steps]
            return values[place]

        return Node(taken, run)

    def step(self, depth: int) -> Node:
        """Of a state that stays small: bounded by a smooth function, or a mean; perhaps with a jump."""
        smooth = call(np.sin, "sin(%s)", self.smooth_term(max(depth, 1)))
        if self.likely(0.35):
            return chosen("(if [%s] then %s else %s)", self.condition(), smooth, times(number(0.5), self.leaf(False)))
        return plus(times(number(0.5), self.leaf(False)), smooth)

    # Look-ups, vectors, records, functions

    def interpolated(self, depth: int) -> Node:
        size = self.sizes["ys"]
        gap = plus(number(0.3), power(name("t"), 2))
        places = [times(number(float(k)), gap) if self.likely(0.5) else number(0.1 + 0.8 * k) for k in range(1)]
        places += [
            plus(number(0.7 * k), times(number(0.1), call(np.sin, "sin(%s)", name("s")))) for k in range(1, size)
        ]
        at = self.smooth_term(depth)

        def run(env: Environment, record: Record | None, n: int) -> Array:
            xs, x = np.stack([np.broadcast_to(p(env, record, n), (n,)) for p in places], axis=1), at(env, record, n)
            for k in range(size):
                note(record, x - xs[:, k])
            into = np.clip((x[:, None] - xs[:, :-1]) / np.diff(xs, axis=1), 0, 1)
            return env["ys"][:, 0] + np.sum(into * np.diff(env["ys"], axis=1), axis=1)

        return Node(f"interp([{', '.join(p.text for p in places)}], ys, {at.text})", run)

    def looked_up(self, depth: int) -> Node:
        u, v = self.smooth_term(depth), self.leaf(False)

        def run(env: Environment, record: Record | None, n: int) -> Array:
            rows, columns = self.grid
            total, weights = np.zeros(n), []
            for where, count in ((u, columns), (v, rows)):
                raw = where(env, record, n) * count - 0.5
                for k in range(count):
                    note(record, raw - k)
                weights.append(np.maximum(0, 1 - np.abs(np.clip(raw, 0, count - 1)[:, None] - np.arange(count))))
            for row in range(rows):
                total = total + weights[1][:, row] * np.sum(
                    weights[0] * env["photo"][:, row * columns : (row + 1) * columns], axis=1
                )
            return total

        return Node(f"image(photo, {u.text}, {v.text})", run)

    def of_vectors(self, depth: int) -> Node:
        a, b = self.term(depth - 1), self.leaf(False)
        p = [part("p", 0, "p.x"), part("p", 1, "p.y")]
        pair = f"({a.text}, {b.text})"
        return self.one_of((
            (0.25, lambda: Node(f"dot(p, {pair})", plus(times(p[0], a), times(p[1], b)).run)),
            (0.45, lambda: call(lambda u, v: np.sqrt(1 + u * u + v * v), "norm((1, %s, %s))", a, b)),
            (0.60, lambda: Node(f"(p - {pair}).y", apply("-", p[1], b).run)),
            (0.75, lambda: Node(f"({a.text}*p + {pair}).x", plus(times(a, p[0]), a).run)),
            (0.90, lambda: Node(f"(xs*xs + xs)[{self.sizes['xs'] - 1}]", self.last_of_xs())),
            (1.01, lambda: Node(f"cross(0.5*(1, 2, 3), (p.x, {a.text}, 1)).z",
                                apply("-", times(number(0.5), a), times(number(1.0), p[0])).run)),
        ))  # fmt: skip

    def last_of_xs(self) -> Program:
        return lambda env, record, n: env["xs"][:, -1] ** 2 + env["xs"][:, -1]

    def of_records(self, depth: int) -> Node:
        a, of = self.term(depth - 1), self.pick(*self.records)
        x, y, r = (name(f"{of}.{field}") for field in ("at.x", "at.y", "r"))
        return self.one_of((
            (0.25, lambda: Node(f"({of} with r = {a.text}).r", a.run)),
            (0.40, lambda: Node(f"({of} with at = ({a.text}, 2)).at.x", a.run)),
            (0.60, lambda: Node(f"Spot(r={a.text}, at=(1, {r.text})).at.y", r.run)),
            (1.01, lambda: self.reached(a, of, x, y, r)),
        ))  # fmt: skip

    def reached(self, u: Node, of: str, x: Node, y: Node, r: Node) -> Node:
        inside = chosen("%s%s%s", compare("<", apply("-", x, u), r), number(1.0), number(0.0))
        return Node(f"reach({of}, {u.text})", times(inside, apply("-", u, y)).run)

    def of_functions(self, depth: int) -> Node:
        a, w, place = self.smooth_term(depth), self.leaf(True), self.pick(0, 1, 2)
        run = (call(np.sin, "%s", a), call(lambda u, v: np.exp(-((u - v) ** 2)), "%s%s", a, w), bent("abs", a))[place]
        return Node(f"[sin, bump({w.text}), abs][{place}]({a.text})", run.run)

    # Terms, integrals, the program

    def term(self, depth: int) -> Node:
        if depth <= 0:
            return self.smooth_term(1) if self.likely(0.6) else self.bracket(self.condition())
        makers: tuple[Callable[[], Node], ...] = (
            partial(self.reduction, depth), partial(self.reduction, depth), partial(self.reduction, depth),
            partial(self.picked, depth), partial(self.folded, depth), partial(self.folded, depth),
            partial(self.interpolated, 1), partial(self.looked_up, 1), partial(self.of_vectors, depth),
            partial(self.of_records, depth), partial(self.of_functions, 1),
            lambda: times(self.bracket(self.condition()), self.term(depth - 1)),
            lambda: chosen("(if [%s] then %s else %s)", self.condition(), self.term(depth - 1), self.term(depth - 1)),
            lambda: chosen("(if %s then %s else %s)", self.condition(True), self.term(depth - 1), self.leaf(False)),
            lambda: bent(self.pick("min", "max"), self.term(depth - 1), self.leaf(False)),
            lambda: plus(self.term(depth - 1), self.term(depth - 1)),
        )  # fmt: skip
        return self.pick(*makers)()

    def integral(self, depth: int, variables: Sequence[str] = ("x",)) -> Node:
        binders = []
        for v in variables:
            lo, hi = number(self.pick(0.0, -0.5)), number(1.0) if self.likely(0.6) else self.leaf(plain=True)
            binders.append(ranged(v, f"[{lo.text}, {hi.text}]", lo, hi, True))
        with self.inside((), *map(name, variables)):
            body = self.term(depth)
        return integrals(binders, body)

    def program(self, two: bool) -> Node:
        at = self.random.random()
        if at < 0.6:
            return self.integral(2, ("x", "y") if two and at < 0.2 else ("x",))
        if at < 0.75:
            return self.term(3)
        clauses = self.clauses(1)
        with self.inside(clauses):
            body = self.integral(1)
        if self.likely(0.4):
            body = call(np.tanh, "tanh(%s)", body)
        return Node(f"(sum {clauses[0].text} ({body.text}))", partial(reduced, "sum", clauses, body))

    def arguments(self) -> tuple[list[str], Callable[[Environment, int], Environment]]:
        """What f hands to g, as source and as numbers; all of it moves with t and s."""
        made: dict[str, list[Node]] = {}
        counts = {**self.sizes, "p": 2, "c": 3, "photo": math.prod(self.grid), "spots": 3 * self.sizes["spots"]}
        for key, count in counts.items():
            made[key] = [self.given(place) for place in range(count)]
        text = {key: [node.text for node in nodes] for key, nodes in made.items()}
        spot = "Spot(at=({}, {}), r={})".format
        rows, columns = self.grid
        lines = [text["photo"][k * columns : (k + 1) * columns] for k in range(rows)]
        written = [
            f"[{', '.join(text['xs'])}]", f"[{', '.join(text['ys'])}]", f"({', '.join(text['p'])})", spot(*text["c"]),
            f"[{', '.join(spot(*text['spots'][k : k + 3]) for k in range(0, counts['spots'], 3))}]",
            f"[{', '.join('[' + ', '.join(line) + ']' for line in lines)}]",
        ]  # fmt: skip

        def bind(env: Environment, n: int) -> Environment:
            found = {
                key: np.stack([np.broadcast_to(node(env, None, n), (n,)) for node in nodes], axis=1)
                for key, nodes in made.items()
            }
            for place, field in enumerate(FIELDS):
                env = {**env, f"c.{field}": found["c"][:, place], f"spots.{field}": found["spots"][:, place::3]}
            return {**env, **{key: found[key] for key in ("xs", "ys", "p", "photo")}}

        return written, bind

    def given(self, place: int) -> Node:
        value = number(round(self.random.uniform(-0.5, 1.5), 3))
        moving = times(number(self.pick(0.3, -0.4, 0.7)), name(self.pick("t", "s")))
        return plus(value, moving) if self.likely(0.6) else value


def array_program(seed: int, flat: bool = False, spelling: int = 0, unit: float = 1.0) -> tuple[str, Program]:
    """The source of f(t, s), which calls g with arrays, and its meaning. `flat`: integrals over one variable only."""
    scene = Scene(seed, spelling)
    whole = scene.program(not flat)
    written, bind = scene.arguments()
    name = "f" if unit == 1.0 else "plain"
    ends = [f"def g({GIVEN}, t, s)\n    {whole.text}\n", f"def {name}(t, s)\n    g({', '.join(written)}, t, s)\n"]
    if unit != 1.0:
        ends.append(f"def f(t, s) plain(t/{unit!r}, s)\n")
    definitions = [line for line in scene.definitions if not line.startswith("#")]
    return "\n".join([HEAD, *definitions, *ends]), lambda env, record, n: whole(bind(env, n), record, n)


def given_arrays(seed: int, flat: bool, t: float, s: float) -> dict[str, Any]:
    """What f of the program of a seed, as it stands, gives g, as Python gives it."""
    scene = Scene(seed, 0)
    scene.program(not flat)
    env = scene.arguments()[1]({"t": np.array([t]), "s": np.array([s])}, 1)
    x, y, r = (env[f"spots.{field}"][0] for field in FIELDS)
    spots = [((float(a), float(b)), float(c)) for a, b, c in zip(x, y, r, strict=True)]
    c = ((env["c.at.x"].item(), env["c.at.y"].item()), env["c.r"].item())
    found = {"xs": env["xs"][0], "ys": env["ys"][0], "p": tuple(env["p"][0].tolist()), "c": c, "spots": spots}
    return {**found, "photo": env["photo"][0].reshape(scene.grid), "t": t, "s": s}
