"""The LALR automaton: runs the tables over tokens and builds values.

Owns `Automaton`. A small driver over lark's tables, since lark's own costs three times as much for each token; the
tests hold the two against each other. Where no action is left it stops and says where; `repair` finds a way on.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from potto.syntax import build, build_arrays, build_integrals, build_items, build_types
from potto.syntax.groups import Context
from potto.syntax.parse_tables import Tables, tables
from potto.syntax.tokens import Token

Action = Callable[[Context, list[Any]], Any]


@lru_cache(maxsize=1)
def _reductions() -> tuple[tuple[int, str, Action | None], ...]:
    """For each rule: its size, its origin, and what builds its value (None: the value of its one symbol)."""
    out: list[tuple[int, str, Action | None]] = []
    for rule in tables().rules:
        action: Action | None = None
        if rule.action is not None:
            home = next(
                home
                for home in (build, build_arrays, build_integrals, build_items, build_types)
                if hasattr(home, rule.action)
            )
            action = getattr(home, rule.action)
        out.append((rule.size, rule.origin, action))
    return tuple(out)


class Automaton:
    """The state of one parse: parallel stacks of states and values."""

    __slots__ = ("context", "end", "rows", "start", "states", "tables", "values")

    def __init__(self, context: Context, start: str) -> None:
        self.tables: Tables = tables()
        self.rows = self.tables.rows
        self.context = context
        self.start = start
        self.states = [self.tables.starts[start]]
        self.end = self.tables.ends[start]
        self.values: list[Any] = []

    def run(self, tokens: list[Token], index: int) -> int:
        """Shift tokens from `index` on; gives the index of the token without an action, or past the end."""
        rows, states, values, context = self.rows, self.states, self.values, self.context
        reductions, end, state = _reductions(), self.end, self.states[-1]
        count = len(tokens)
        while index < count:
            token = tokens[index]
            kind = token[0]
            while True:
                action = rows[state].get(kind)
                if action is None:
                    return index
                if action >= 0:
                    state = action
                    states.append(state)
                    values.append(token)
                    break
                size, origin, build_value = reductions[~action]
                if size == 1:
                    if build_value is not None:
                        values[-1] = build_value(context, values[-1:])
                    state = states[-1] = rows[states[-2]][origin]
                else:
                    taken = values[-size:] if size else []
                    if size:
                        del states[-size:], values[-size:]
                    values.append(build_value(context, taken))  # type: ignore[misc]
                    state = rows[states[-1]][origin]
                    states.append(state)
                if state == end and kind == "$END":
                    return count
            index += 1
        return index

    def possible(self) -> frozenset[str]:
        """The kinds of tokens that can come next."""
        rules = self.tables.rules

        def goes(kind: str) -> bool:
            pending = list(self.states[-1:])
            height = len(self.states) - 1  # how much of the real stack stands under `pending`
            while True:
                action = self.rows[pending[-1]].get(kind)
                if action is None:
                    return False
                if action >= 0:
                    return True
                rule = rules[~action]
                for _ in range(rule.size):
                    pending.pop()
                    if not pending:
                        height -= 1
                        pending.append(self.states[height])
                pending.append(self.rows[pending[-1]][rule.origin])
                if kind == "$END" and pending[-1] == self.end:
                    return True

        return frozenset(kind for kind in self.rows[self.states[-1]] if kind.isupper() and goes(kind))

    @property
    def result(self) -> Any:
        """The value of the whole, once `run` has gone past the end."""
        return self.values[-1]
