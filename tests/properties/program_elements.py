"""The given things of random programs with arrays: their elements, loops through them, and terms over both.

Owns `Elements`, from which `program_arrays` makes whole programs, `Clause` and `reduced`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from plain_quadrature import Array, Environment, Record
from program_nodes import Node, apply, call, chosen, compare, name, note, number, power
from program_terms import Terms

SMOOTH: tuple[tuple[Any, str], ...] = (
    (np.sin, "sin(%s)"), (np.tanh, "tanh(%s)"), (lambda x: np.exp(-x * x), "exp(-(%s)^2)"),
    (lambda x: np.sqrt(1 + x * x), "sqrt(1 + (%s)^2)"), (lambda x: 1 / (1 + x * x), "1/(1 + (%s)^2)"),
)  # fmt: skip
FIELDS = ("at.x", "at.y", "r")


@dataclass(frozen=True)
class Clause:
    """What a loop goes through: its source, how often it goes round, what it binds at each turn, and what that may be
    called in the body: numbers, whole numbers below a length, and records."""

    text: str
    count: int
    bind: Callable[[Environment, int, int], Environment]
    numbers: tuple[Node, ...]
    index: tuple[str, int, int] | None = None  # its least and greatest value
    spot: str = ""


def part(array: str, place: int, text: str) -> Node:
    """An element of an array of the environment, whose second axis is that of its elements."""
    return Node(text, lambda env, record, n: env[array][:, place])


class Elements(Terms):
    """Terms over what is given and what loops go through."""

    def __init__(self, seed: int, spelling: int) -> None:
        super().__init__(seed, spelling)
        self.sizes = {"xs": self.pick(1, 2, 3, 5), "ys": self.pick(2, 3, 4), "spots": self.pick(1, 2, 4)}
        self.grid = self.pick((1, 3), (2, 2), (3, 4), (4, 1))
        self.known = [name("t"), name("s")]  # numbers that vary with no variable of integration
        self.varying: list[Node] = []
        self.indices: list[tuple[str, int, int]] = []
        self.records = ["c"]

    @contextmanager
    def inside(self, clauses: Sequence[Clause], *more: Node) -> Iterator[None]:
        kept = self.known, self.varying, self.indices, self.records
        self.known = [*self.known, *(node for clause in clauses for node in clause.numbers)]
        self.varying = [*self.varying, *more]
        self.indices = [*self.indices, *(clause.index for clause in clauses if clause.index is not None)]
        self.records = [*self.records, *(clause.spot for clause in clauses if clause.spot)]
        yield
        self.known, self.varying, self.indices, self.records = kept

    # Elements

    def fresh(self, stem: str) -> str:
        made = self.define(stem)
        self.definitions.append(f"# {made}")
        return made

    def index(self, size: int) -> Node:
        """A whole number below a size."""
        usable = [known for known in self.indices if known[1] >= 0 and known[2] < size]
        if usable and self.likely(0.8):
            found, lo, hi = self.pick(*usable)
            back = number(hi + lo)
            return self.pick(name(found), name(found), Node(f"{hi + lo} - {found}", apply("-", back, name(found)).run))
        place = self.pick(*range(size))
        if self.likely(0.15):
            other = self.pick(*range(size))
            shape = compare("<", name("t"), name("s"))
            return chosen("if %s then %s else %s", shape, Node(str(place), number(place).run),
                          Node(str(other), number(other).run))  # fmt: skip
        return Node(str(place), number(place).run)

    def element(self) -> Node:
        """A number of what is given, or of what loops go through."""
        which = self.pick("xs", "xs", "ys", "p", "record", "spots", "photo", "len")
        if which in ("xs", "ys"):
            return self.indexed(which, self.sizes[which], f"{which}[%s]")
        if which == "p":
            place = self.pick(0, 1)
            return part("p", place, f"p.{self.pick('xy'[place], place)}")
        if which == "record":
            return self.field(self.pick(*self.records))
        if which == "spots":
            field = self.pick("at.x", "at.y", "r")
            return self.indexed(f"spots.{field}", self.sizes["spots"], f"spots[%s].{field}")
        if which == "len":
            return Node("len(xs)", number(self.sizes["xs"]).run)
        rows, columns = self.grid
        row, column = self.index(rows), self.index(columns)

        def run(env: Environment, record: Record | None, n: int) -> Array:
            places = row(env, record, n) * columns + column(env, record, n)
            return env["photo"][np.arange(n), places.astype(int)]

        return Node(f"photo[{row.text}, {column.text}]", run)

    def indexed(self, array: str, size: int, shape: str) -> Node:
        place = self.index(size)
        return Node(
            shape % place.text, lambda env, record, n: env[array][np.arange(n), place(env, record, n).astype(int)]
        )

    def field(self, of: str) -> Node:
        which = self.pick("at.x", "at.y", "r", "at.0")
        return name(f"{of}.{which.replace('.0', '.x')}", f"{of}.{which}")

    def leaf(self, plain: bool) -> Node:
        if self.varying and not plain and self.likely(0.5):
            return self.pick(*self.varying)
        if self.likely(0.6):
            return self.element()
        return self.pick(*self.known) if self.likely(0.75) else self.constant()

    def smooth_term(self, depth: int, plain: bool = False) -> Node:
        if depth <= 0:
            return self.leaf(plain)
        a, b = self.smooth_term(depth - 1, plain), self.smooth_term(depth - 1, plain)
        return self.one_of((
            (0.55, lambda: self.swapped(self.pick("+", "-", "*"), a, b)),
            (0.65, lambda: power(a, 2)),
            (1.01, lambda: call(*self.pick(*SMOOTH), a)),
        ))  # fmt: skip

    def condition(self, plain: bool = False) -> Node:
        op = self.pick("<", "<=", ">", ">=")
        first = compare(op, self.smooth_term(1, plain), self.smooth_term(1, plain))
        if plain or self.likely(0.7):
            return first
        second = compare(op, self.smooth_term(0), self.smooth_term(1))
        return self.joined(self.pick("and", "or"), first, second)

    # What goes through arrays

    def clause(self) -> Clause:
        kind = self.pick("range", "range", "of length", "xs", "spots")
        v = self.fresh({"xs": "x", "spots": "d"}.get(kind, "i"))
        if kind == "xs":
            return Clause(f"{v} in xs", self.sizes["xs"], lambda env, k, n: {**env, v: env["xs"][:, k]}, (name(v),))
        if kind == "spots":

            def bound(env: Environment, k: int, n: int) -> Environment:
                return {**env, **{f"{v}.{field}": env[f"spots.{field}"][:, k] for field in FIELDS}}

            return Clause(f"{v} in spots", self.sizes["spots"], bound, (), None, v)
        lo, hi = (
            (0, self.sizes["xs"] - 1) if kind == "of length" else self.pick((0, 2), (1, 3), (2, 2), (0, 1), (-1, 1))
        )
        last = self.pick("len(xs) - 1", "n - 1") if kind == "of length" else str(hi)

        def counted(env: Environment, k: int, n: int) -> Environment:
            return {**env, v: np.full(n, float(lo + k))}

        return Clause(f"{v} in {lo}..{last}", hi - lo + 1, counted, (name(v),), (v, lo, hi))

    def clauses(self, most: int = 2) -> list[Clause]:
        return [self.clause() for _ in range(2 if most > 1 and self.likely(0.2) else 1)]


def reduced(op: str, clauses: Sequence[Clause], body: Node, env: Environment, record: Record | None, n: int) -> Array:
    values = [np.broadcast_to(value, (n,)) for value in turns(clauses, body, env, record, n)]
    if op in ("sum", "product"):
        return np.sum(values, axis=0) if op == "sum" else np.prod(values, axis=0)
    found = values[0]
    for value in values[1:]:
        note(record, found - value)
        found = np.minimum(found, value) if op == "min" else np.maximum(found, value)
    return found


def turns(clauses: Sequence[Clause], body: Node, env: Environment, record: Record | None, n: int) -> Iterator[Array]:
    if not clauses:
        yield body(env, record, n)
        return
    for k in range(clauses[0].count):
        yield from turns(clauses[1:], body, clauses[0].bind(env, k, n), record, n)
