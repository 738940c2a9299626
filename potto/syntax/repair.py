"""The cheapest way on from where the grammar has no action.

Owns `find_repair`: a search over insertions, deletions and replacements of tokens, cheapest first, on the states alone
(no values are built), in the manner of Diekmann and Tratt, "Don't Panic!" (2020). A repair counts when the next four
tokens, or all that are left, go through after it. The search is bounded: where it gives up, the caller does without.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Literal

from potto.syntax.tables import Tables
from potto.syntax.tokens import KEYWORDS, Token

Stack = tuple[int, "Stack | None"]
"""A stack of states that shares its lower part: (state, below)."""

ENOUGH = 4
MOST_STEPS = 1200

_INSERT: dict[str, int] = {
    "NAME": 2,
    "THEN": 2,
    "ELSE": 2,
    "IN": 2,
    "IMPORT": 2,
    "COLON": 3,
    "EQ": 4,
    "RPAR": 4,
    "RSQB": 4,
    "LPAR": 4,
    "LSQB": 4,
    "COMMA": 3,
    "SEMI": 4,
    "DOT": 3,
    "DOTDOT": 3,
    "BINOP": 4,
    "SUMBODY": 1,
    "TILDE": 4,
}
"""What may be inserted, and what it costs."""

_DELETE: dict[str, int] = {
    "INDENT": 20,
    "DEDENT": 20,
    "NEWLINE": 9,
    "LPAR": 5,
    "RPAR": 5,
    "LSQB": 5,
    "RSQB": 5,
    "D": 6,
    "NAME": 3,
    "NUMBER": 3,
    "MEMBER": 3,
    "SUMBODY": 1,
    "NOBOUNDS": 20,
}
_DELETE_OTHER = 3
_REPLACE = 1


@dataclass(frozen=True, slots=True)
class Edit:
    """One step of a repair: insert a token of `kind`, delete the next one, read it as `kind`, or take it as it is."""

    action: Literal["insert", "delete", "replace", "shift"]
    kind: str


_Trail = tuple[Edit, "_Trail | None"]
"""The steps of a repair so far, last first; shared between the branches of the search."""


class _Search:
    """One search from one error."""

    def __init__(self, tables: Tables, end: int, tokens: list[Token]) -> None:
        self.rows, self.rules, self.end, self.tokens = tables.rows, tables.rules, end, tokens
        self.queue: list[tuple[int, int, int, Stack, int, int, bool, _Trail | None]] = []
        self.count = 0
        self.seen: set[tuple[int, int, int, bool]] = set()
        self.stacks: dict[tuple[int, int], Stack] = {}

    def push(self, cost: int, stack: Stack, index: int, run: int, deleted: bool, trail: _Trail | None) -> None:
        if (id(stack), index, run, deleted) not in self.seen:
            self.count += 1
            # Of two repairs of one cost, the one that has read further comes first.
            heapq.heappush(self.queue, (cost, -index, self.count, stack, index, run, deleted, trail))

    def advance(self, stack: Stack, kind: str) -> Stack | None:
        """The stack after reading a token of `kind`; None if it can't be read. At `$END`: the stack at the end."""
        rows, rules = self.rows, self.rules
        while True:
            action = rows[stack[0]].get(kind)
            if action is None:
                return None
            if action >= 0:
                return self.grown(stack, action)
            rule = rules[~action]
            below: Stack | None = stack
            for _ in range(rule.size):
                assert below is not None
                below = below[1]
            assert below is not None
            stack = self.grown(below, rows[below[0]][rule.origin])
            if kind == "$END" and stack[0] == self.end:
                return stack

    def grown(self, below: Stack, state: int) -> Stack:
        """The stack with a state on it; equal stacks are one object, so that their identity tells them apart."""
        return self.stacks.setdefault((id(below), state), (state, below))

    def run(self, stack: Stack, index: int) -> list[Edit] | None:
        self.push(0, stack, index, 0, False, None)
        for _ in range(MOST_STEPS):
            if not self.queue:
                return None
            cost, _, _, stack, index, run, deleted, trail = heapq.heappop(self.queue)
            key = (id(stack), index, run, deleted)
            if key in self.seen:
                continue
            self.seen.add(key)
            if run >= ENOUGH:
                return _edits(trail)
            token = self.tokens[index]
            after = self.advance(stack, token.kind)
            if after is not None:
                if token.kind == "$END":
                    return _edits(trail)
                self.push(cost, after, index + 1, run + 1, False, (Edit("shift", token.kind), trail))
            self._others(cost, stack, index, deleted, trail, token)
        return None

    def _others(self, cost: int, stack: Stack, index: int, deleted: bool, trail: _Trail | None, token: Token) -> None:
        row = self.rows[stack[0]]
        if not deleted:
            # Insertions come before deletions at one place, or each pair would be tried in both orders.
            for kind, price in _INSERT.items():
                if kind in row:
                    after = self.advance(stack, kind)
                    if after is not None:
                        self.push(cost + price, after, index, 0, False, (Edit("insert", kind), trail))
        if token.kind == "$END":
            return
        kind_instead = _instead(token)
        if kind_instead is not None and kind_instead in row:
            after = self.advance(stack, kind_instead)
            if after is not None:
                self.push(cost + _REPLACE, after, index + 1, 0, False, (Edit("replace", kind_instead), trail))
        price = _DELETE.get(token.kind, _DELETE_OTHER) if token.text or token.kind != "LPAR" else 1
        self.push(cost + price, stack, index + 1, 0, True, (Edit("delete", token.kind), trail))


def _instead(token: Token) -> str | None:
    """What a token may have been meant as: `=` as `==`, a reserved word as a name."""
    if token.kind == "EQ":
        return "BINOP"
    if token.text in KEYWORDS:
        return "NAME"
    return None


def _edits(trail: _Trail | None) -> list[Edit]:
    edits: list[Edit] = []
    while trail is not None:
        edits.append(trail[0])
        trail = trail[1]
    edits.reverse()
    while edits and edits[-1].action == "shift":
        edits.pop()
    return edits


def find_repair(tables: Tables, end: int, states: list[int], tokens: list[Token], index: int) -> list[Edit] | None:
    """The cheapest repair for the token at `index` in these states, or None if none is near."""
    stack: Stack = (states[0], None)
    for state in states[1:]:
        stack = (state, stack)
    return _Search(tables, end, tokens).run(stack, index)
