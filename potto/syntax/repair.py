"""The cheapest way on from where the grammar has no action.

Owns `find_repair`: a search over insertions, deletions and replacements of tokens, cheapest first, on the states alone
(no values are built), in the manner of Diekmann and Tratt, "Don't Panic!" (2020). A repair counts when the next four
tokens, or all that are left, go through after it. The search is bounded: where it gives up, the caller does without.
"""

from __future__ import annotations

import heapq
from typing import Literal, NamedTuple

from potto.syntax.parse_tables import Tables
from potto.syntax.tokens import KEYWORDS, Token

Stack = tuple[int, "Stack | None"]
"""A stack of states that shares its lower part: (state, below)."""

ENOUGH = 4
MOST_STEPS = 600

_INSERT: dict[str, int] = {
    "NAME": 2,
    "THEN": 2,
    "ELSE": 2,
    "IN": 2,
    "IMPORT": 2,
    "COLON": 3,
    "EQ": 4,
    "COMMA": 3,
    "SEMI": 4,
    "DOT": 3,
    "DOTDOT": 3,
    "BINOP": 4,
    "SUMBODY": 1,
    "TILDE": 4,
    "LPAR": 4,
}
"""What may be inserted, and what it costs. Brackets are balanced already (see `nesting`), so that none is inserted but
an empty pair of parentheses, here `LPAR`."""

_DELETE: dict[str, int] = {
    "INDENT": 20,
    "DEDENT": 20,
    "NEWLINE": 9,
    "LPAR": 7,
    "RPAR": 7,
    "LSQB": 7,
    "RSQB": 7,
    "D": 6,
    "NAME": 3,
    "NUMBER": 3,
    "MEMBER": 3,
    "SUMBODY": 1,
    "NOBOUNDS": 20,
}
_DELETE_OTHER = 3
_REPLACE = 1
_GO_BACK = 3
"""What it costs more to change the word before the place where the parse stopped: a stray `if` shows only after it."""


class RepairStep(NamedTuple):
    """One step of a repair: insert a token of `kind`, delete the next one, read it as `kind`, or take it as it is."""

    action: Literal["insert", "delete", "replace", "shift"]
    kind: str
    back: bool = False
    """Whether it is about the token before the one where the parse stopped."""


_STRAY = frozenset({"SUM", "LET", "IF", "LAMBDA", "FOR", "DIFFEO"})
_EMPTY_GROUP = RepairStep("insert", "LPAR")
_Trail = tuple[RepairStep, "_Trail | None"]
"""The steps of a repair so far, last first; shared between the branches of the search."""


class _Branch(NamedTuple):
    """A state of the search, ordered by cost; of two of one cost, the one that has read further comes first.

    `stack` is as it was before `edit`, which is only carried out when the branch's turn comes: most never do.
    """

    cost: int
    ahead: int
    order: int
    stack: Stack
    at: int
    run: int
    edit: RepairStep | None
    trail: _Trail | None


class _Search:
    """One search from one error."""

    def __init__(self, tables: Tables, end: int, tokens: list[Token]) -> None:
        self.rows, self.rules, self.end, self.tokens = tables.rows, tables.rules, end, tokens
        self.queue: list[_Branch] = []
        self.count = 0
        self.seen: set[tuple[int, int, int, bool]] = set()
        self.stacks: dict[tuple[int, int], Stack] = {}

    def push(
        self, cost: int, stack: Stack, index: int, run: int, edit: RepairStep | None, trail: _Trail | None
    ) -> None:
        self.count += 1
        heapq.heappush(self.queue, _Branch(cost, -index, self.count, stack, index, run, edit, trail))

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

    def edited(self, stack: Stack, edit: RepairStep) -> Stack | None:
        """The stack after an insertion or a replacement."""
        after = self.advance(stack, edit.kind)
        if after is not None and edit == _EMPTY_GROUP:
            return self.advance(after, "RPAR")
        return after

    def go_back(self, stack: Stack, index: int) -> None:
        """Consider to do without the word at `index`, the last one that was read, or to take it for a name."""
        token = self.tokens[index]
        if token.kind not in _STRAY or not any(token.text for token in self.tokens[index + 1 : index + 1 + ENOUGH]):
            return  # nothing follows: it is being typed
        self.push(_GO_BACK + _DELETE_OTHER, stack, index + 1, 0, RepairStep("delete", token.kind, True), None)
        if token.text in KEYWORDS:
            self.push(_GO_BACK + _REPLACE, stack, index + 1, 0, RepairStep("replace", "NAME", True), None)

    def run(self) -> list[RepairStep] | None:
        for _ in range(MOST_STEPS):
            if not self.queue:
                return None
            branch = heapq.heappop(self.queue)
            stack, edit, trail = branch.stack, branch.edit, branch.trail
            deleted = False
            if edit is not None:
                deleted = edit.action == "delete"
                edited = stack if deleted else self.edited(stack, edit)
                if edited is None:
                    continue
                stack, trail = edited, (edit, trail)
            key = (id(stack), branch.at, branch.run, deleted)
            if key in self.seen:
                continue
            self.seen.add(key)
            if branch.run >= ENOUGH:
                return _edits(trail)
            token = self.tokens[branch.at]
            after = self.advance(stack, token.kind)
            if after is not None:
                if token.kind == "$END":
                    return _edits(trail)
                shift = RepairStep("shift", token.kind)
                self.push(branch.cost, after, branch.at + 1, branch.run + 1, None, (shift, trail))
            if after is None or branch.run == 0:
                self._branch(branch.cost, stack, branch.at, deleted, trail, token)
        return None

    def _branch(self, cost: int, stack: Stack, index: int, deleted: bool, trail: _Trail | None, token: Token) -> None:
        """What else could be done here than read on."""
        row = self.rows[stack[0]]
        if not deleted:
            # Insertions come before deletions at one place, or each pair would be tried in both orders.
            for kind, price in _INSERT.items():
                if kind in row:
                    self.push(cost + price, stack, index, 0, RepairStep("insert", kind), trail)
        if token.kind == "$END":
            return
        instead = _instead(token)
        if instead is not None and instead in row:
            self.push(cost + _REPLACE, stack, index + 1, 0, RepairStep("replace", instead), trail)
        price = _DELETE.get(token.kind, _DELETE_OTHER) if token.text or token.kind != "LPAR" else 1
        self.push(cost + price, stack, index + 1, 0, RepairStep("delete", token.kind), trail)


def _instead(token: Token) -> str | None:
    """What a token may have been meant as: `=` as `==`, a reserved word as a name."""
    if token.kind == "EQ":
        return "BINOP"
    if token.text in KEYWORDS:
        return "NAME"
    return None


def _edits(trail: _Trail | None) -> list[RepairStep]:
    edits: list[RepairStep] = []
    while trail is not None:
        edits.append(trail[0])
        trail = trail[1]
    edits.reverse()
    while edits and edits[-1].action == "shift":
        edits.pop()
    return edits


def find_repair(
    tables: Tables, end: int, tokens: list[Token], index: int, states: list[int], before: list[int] | None
) -> list[RepairStep] | None:
    """The cheapest repair for the token at `index`, or None if none is near.

    `states` are those in which it can't be read; `before`, if they are known, those before the token ahead of it.
    """
    search = _Search(tables, end, tokens)
    search.push(0, _stack(states), index, 0, None, None)
    if before is not None and index > 1:
        search.go_back(_stack(before), index - 1)
    return search.run()


def _stack(states: list[int]) -> Stack:
    stack: Stack = (states[0], None)
    for state in states[1:]:
        stack = (state, stack)
    return stack
