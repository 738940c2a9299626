"""Helpers of these tests: programs from text, the terms of their definitions, and terms as text."""

from __future__ import annotations

from textwrap import dedent

from lint import lint

from potto.core.printer import format_term
from potto.core.terms import Term
from potto.elaborate import Elaborated, core
from potto.query import Database


def program(text: str, **others: str) -> Database:
    """A database with `text` as the file `<text>` and other files in the root `/`."""
    db = Database()
    db.set_input(("roots",), ("/",))
    db.set_input(("overlay", "<text>"), dedent(text))
    for name, content in others.items():
        stem, _, suffix = name.partition("__")
        db.set_input(("overlay", f"/{stem}.{suffix or 'po'}"), dedent(content))
    return db


def elaborated(text: str, name: str = "f", **others: str) -> Elaborated:
    """A definition's elaboration, which keeps the invariants of core terms."""
    found = core(program(text, **others), "<text>", name)
    assert lint(found.term) == []
    assert not found.term.free
    return found


def term(text: str, name: str = "f", **others: str) -> Term:
    return elaborated(text, name, **others).term


def shown(text: str, name: str = "f", **others: str) -> str:
    return format_term(term(text, name, **others))
