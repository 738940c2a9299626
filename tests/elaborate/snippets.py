"""Helpers of these tests: programs from text, the terms of their definitions, and terms as text."""

from __future__ import annotations

from textwrap import dedent

from lint import lint
from mpmath import mp

from potto.core.printer import format_term
from potto.core.reference import evaluate
from potto.core.terms import Term
from potto.elaborate import Elaborated, core, elaborate_expression
from potto.query import Database
from potto.syntax import parse_expression


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


def value(text: str, expression: str, **names: object) -> object:
    """The value of an expression in a program, by mpmath."""
    db = program(text)
    expr = parse_expression(expression)
    assert expr.expr is not None and expr.diagnostics == ()
    found = elaborate_expression(db, "<text>", expr.expr, tuple(names)).term
    assert lint(found) == []
    return evaluate(found, names, lambda file, name: core(db, file, name).term)


def close(found: object, wanted: object) -> None:
    if isinstance(wanted, tuple | list):
        assert type(found) is type(wanted) and len(found) == len(wanted)  # type: ignore[arg-type]
        for part, other in zip(found, wanted, strict=True):  # type: ignore[call-overload]
            close(part, other)
    else:
        assert abs(found - wanted) <= mp.mpf("1e-14") * max(1, abs(wanted))  # type: ignore[operator]
