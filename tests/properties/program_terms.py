"""Random terms of programs, and the ways to spell what is the same.

Owns `Terms`, from which `program_source` makes whole programs. What a program means is drawn from one stream of random
numbers, how it is spelled from another.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

from program_nodes import (
    OF_TWO,
    SMOOTH,
    Node,
    apply,
    bent,
    call,
    chosen,
    logic,
    name,
    number,
    power,
)

PARAMETERS = ["t", "s"]
Makers = tuple[tuple[float, Callable[[], Node]], ...]


class Terms:
    """Terms of one random program in the making, and the ways to spell them."""

    def __init__(self, seed: int, spelling: int) -> None:
        self.random = random.Random(seed)
        self.style = random.Random(f"{seed} {spelling}") if spelling else None
        self.definitions: list[str] = []
        self.met: list[tuple[set[str], Node, Node]] = []
        self.written: dict[str, str] = {}

    def pick(self, *choices: Any) -> Any:
        return self.random.choice(choices)

    def likely(self, probability: float) -> bool:
        return self.random.random() < probability

    def styled(self, probability: float) -> bool:
        """Whether to spell something otherwise."""
        return self.style is not None and self.style.random() < probability

    def chosen_style(self, *choices: Any) -> Any:
        assert self.style is not None
        return self.style.choice(choices)

    def one_of(self, makers: Makers) -> Node:
        at = self.random.random()
        return next(make for bound, make in makers if at < bound)()

    # Spellings

    def define(self, stem: str) -> str:
        return f"{stem}{len(self.definitions) + 1}"

    def behind(self, node: Node, names: list[str], stem: str = "part") -> Node:
        """The same, perhaps as a call of a function or with a local name."""
        if self.styled(0.12):
            f, given = self.define(stem), ", ".join(dict.fromkeys([*names, *PARAMETERS]))
            self.definitions.append(f"def {f}({given}) {node.text}")
            return Node(f"{f}({given})", node.run)
        if self.styled(0.06):
            local = self.define("local")
            self.definitions.append(f"# {local}")  # takes the number
            return Node(f"(let {local} = {node.text} in {local})", node.run)
        return node

    def swapped(self, op: str, a: Node, b: Node) -> Node:
        whole = apply(op, a, b)
        return Node(f"({b.text} {op} {a.text})", whole.run) if op in "+*" and self.styled(0.3) else whole

    def name(self, text: str) -> Node:
        return name(text, self.written.get(text, ""))

    def bracket(self, condition: Node) -> Node:
        run = chosen("%s%s%s", condition, number(1.0), number(0.0)).run
        if self.styled(0.4):
            shape = self.chosen_style("(if [%s] then 1 else 0)", "([%s] ? 1 : 0)", "(1 - [not (%s)])", "[%s]^2",
                                      "(1 - (if [%s] then 0 else 1))", "abs([%s])", "[[%s] > 0.5]")  # fmt: skip
            return Node(shape % condition.text, run)
        return Node(f"[{condition.text}]", run)

    def joined(self, op: str, first: Node, second: Node) -> Node:
        whole = logic(op, first, second)
        if self.styled(0.2):
            other = {"and": "or", "or": "and"}[op]
            return Node(f"not ((not ({first.text})) {other} (not ({second.text})))", whole.run)
        if self.styled(0.2):
            return Node(f"({second.text}) {op} ({first.text})", whole.run)
        return whole

    # Terms

    def constant(self) -> Node:
        return number(self.pick(0.5, 2.0, 0.3, 1.0, 0.25, 1.5, 3.0, 0.7, round(self.random.uniform(0.1, 2), 2)))

    def smooth(self, names: list[str], depth: int) -> Node:
        """Smooth and defined everywhere."""
        if not depth:
            return self.name(self.pick(*names)) if self.likely(0.7) else self.constant()
        a = self.smooth(names, depth - 1)
        return self.one_of((
            (0.45, lambda: self.swapped(self.pick("+", "-", "*"), a, self.smooth(names, depth - 1))),
            (0.55, lambda: power(a, self.pick(2, 2, 3))),
            (0.90, lambda: call(*self.pick(*SMOOTH), a)),
            (1.01, lambda: call(*self.pick(*OF_TWO), a, self.smooth(names, depth - 1))),
        ))  # fmt: skip

    def rough(self, names: list[str], depth: int) -> Node:
        a = self.smooth(names, depth)
        if self.likely(0.7):
            return self.behind(a, names)
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
