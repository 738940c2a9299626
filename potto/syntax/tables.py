"""The LALR tables of the grammar: computed by lark once, then read from a cache in the user's cache folder.

Owns `Tables` and `tables()`. lark is imported only when the cache has to be filled: importing it costs more than
everything else here. The cache is JSON under a name that holds a hash of the grammar, so that it can neither run code
nor be stale; when it can't be read or written, the tables are computed again.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

from msgspec import Struct

from potto.store import cache_folder

STARTS = ("chunk", "expression")
_FORMAT = 2


class Rule(Struct, frozen=True):
    """A reduction: `size` symbols become one `origin`; `action` names what builds its value, None passes it on."""

    origin: str
    size: int
    action: str | None


class Tables(Struct, frozen=True):
    """`rows[state][symbol]` is a state to go to (>= 0) or `~rule` to reduce by (< 0)."""

    rules: tuple[Rule, ...]
    rows: tuple[dict[str, int], ...]
    starts: dict[str, int]
    ends: dict[str, int]


def grammar_text() -> str:
    """The grammar file's text."""
    return Path(__file__).with_name("grammar.lark").read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def tables() -> Tables:
    """The tables of the grammar, from the cache if it has them."""
    grammar = grammar_text()
    key = hashlib.sha256(f"{_FORMAT}\n{grammar}".encode()).hexdigest()[:24]
    folder = cache_folder()
    if folder is None:
        return compute(grammar)
    path = folder / f"grammar-{key}.json"
    cached = _read(path)
    if cached is None:
        _write(path, cached := compute(grammar))
    return cached


def compute(grammar: str) -> Tables:
    """Let lark compute the tables of a grammar."""
    table = lark_parser(grammar).parser.parser.parser.parse_table
    rules: dict[Any, int] = {}
    rows: list[dict[str, int]] = [{} for _ in table.states]
    for state, actions in table.states.items():
        for symbol, (action, target) in actions.items():
            rows[state][str(symbol)] = target if action.name == "Shift" else ~rules.setdefault(target, len(rules))
    known = tuple(Rule(str(rule.origin.name), len(rule.expansion), _action(rule)) for rule in rules)
    _skip_units(rows, known)
    return Tables(known, tuple(rows), dict(table.start_states), dict(table.end_states))


def _skip_units(rows: list[dict[str, int]], rules: tuple[Rule, ...]) -> None:
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


def _read(path: Path) -> Tables | None:
    """The cached tables; None if there are none, or none that can be trusted to be whole."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        rules = tuple(Rule(origin, size, action) for origin, size, action in data["rules"])
        rows = tuple(data["rows"])
        starts, ends = data["starts"], data["ends"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return Tables(rules, rows, starts, ends)


def _write(path: Path, computed: Tables) -> None:
    """Write the cache in one step. That it can't be written (a read-only home) costs time, nothing else."""
    data = {
        "rules": [[rule.origin, rule.size, rule.action] for rule in computed.rules],
        "rows": computed.rows,
        "starts": computed.starts,
        "ends": computed.ends,
    }
    import tempfile

    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".grammar-", suffix=".tmp")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump(data, file, separators=(",", ":"))
        os.replace(temporary, path)
    except OSError:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)
