"""The LALR tables of the grammar: computed by lark when the grammar is changed, and read from `parse_tables.json`.

Owns `Tables`, `tables()`, and `write`, which makes the file: `make tables`. lark is imported only where the
file is not that of the grammar, while the grammar is worked on: importing it and computing costs a cold start more than
everything else here. The file is JSON with a digest of the grammar, so that it can neither run code nor be stale.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

from msgspec import Struct

STARTS = ("chunk", "expression")
FILE = Path(__file__).with_name("parse_tables.json")


class Production(Struct, frozen=True):
    """A reduction: `size` symbols become one `origin`; `action` names what builds its value, None passes it on."""

    origin: str
    size: int
    action: str | None


class Tables(Struct, frozen=True):
    """`rows[state][symbol]` is a state to go to (>= 0) or `~rule` to reduce by (< 0)."""

    rules: tuple[Production, ...]
    rows: tuple[dict[str, int], ...]
    starts: dict[str, int]
    ends: dict[str, int]


def grammar_text() -> str:
    """The grammar file's text."""
    return Path(__file__).with_name("grammar.lark").read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def tables() -> Tables:
    """The tables of the grammar."""
    return written() or compute(grammar_text())


def written() -> Tables | None:
    """The tables in the file; None if they are of another grammar."""
    data = json.loads(FILE.read_text(encoding="utf-8"))
    if data["grammar"] != _digest(grammar_text()):
        return None
    return Tables(
        tuple([Production(*rule) for rule in data["rules"]]), tuple(data["rows"]), data["starts"], data["ends"]
    )


def write() -> None:
    """Compute the tables of the grammar and write the file."""
    grammar = grammar_text()
    made = compute(grammar)
    rules = [[rule.origin, rule.size, rule.action] for rule in made.rules]
    data = {"grammar": _digest(grammar), "rules": rules, "rows": made.rows, "starts": made.starts, "ends": made.ends}
    FILE.write_text(json.dumps(data, separators=(",", ":")) + "\n", encoding="utf-8")


def _digest(grammar: str) -> str:
    return hashlib.sha256(grammar.encode()).hexdigest()[:24]


def compute(grammar: str) -> Tables:
    """Let lark compute the tables of a grammar."""
    table = lark_parser(grammar).parser.parser.parser.parse_table
    rules: dict[Any, int] = {}
    rows: list[dict[str, int]] = [{} for _ in table.states]
    for state, actions in table.states.items():
        for symbol, (action, target) in actions.items():
            rows[state][str(symbol)] = target if action.name == "Shift" else ~rules.setdefault(target, len(rules))
    known = tuple(Production(str(rule.origin.name), len(rule.expansion), _action(rule)) for rule in rules)
    _skip_units(rows, known)
    return Tables(known, tuple(rows), dict(table.start_states), dict(table.end_states))


def _skip_units(rows: list[dict[str, int]], rules: tuple[Production, ...]) -> None:
    """Go at once to where a state leads that does nothing but pass a value on, whatever comes next."""
    passes: dict[int, str] = {}
    for state, row in enumerate(rows):
        actions = set(row.values())
        if len(actions) == 1:
            rule = rules[~action] if (action := actions.pop()) < 0 else None
            if rule is not None and rule.size == 1 and rule.action is None:
                passes[state] = rule.origin
    for row in rows:
        for symbol, target in row.items():
            # Not after a token: a value is passed on only where there is one already.
            while symbol.islower() and target in passes:
                target = row[passes[target]]
            row[symbol] = target


def lark_parser(grammar: str) -> Any:
    """lark's own parser of the grammar, over tokens of ours; also the oracle of the tests."""
    from lark import Lark, Token
    from lark.lexer import Lexer

    class Tokens(Lexer):
        """Gives lark the `(kind, text, start)` triples that it was called with."""

        __future_interface__ = 2

        def __init__(self, _configuration: Any) -> None:
            pass

        def lex(self, lexer_state: Any, parser_state: Any) -> Iterator[Token]:
            for kind, text, start in lexer_state.text:
                yield Token(kind, text, start)

    return Lark(grammar, parser="lalr", lexer=Tokens, start=list(STARTS), keep_all_tokens=True)


def _action(rule: Any) -> str | None:
    if rule.alias:
        return str(rule.alias)
    return None if len(rule.expansion) == 1 else str(rule.origin.name)
