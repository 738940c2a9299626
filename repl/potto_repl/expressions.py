"""Expressions that commands are given: parsed, checked and taken apart, in the scope of the session.

Owns `checked`, `call_of` and `split_items`. They raise ProgramError for what is wrong with an expression, so that it is
shown with carets.
"""

from __future__ import annotations

from typing import cast

from msgspec import Struct

from potto.checking.check import absolute
from potto.evaluating.answering import EXPRESSION
from potto.reports.render import Located, ProgramError
from potto.syntax import nodes, print_expression
from potto.types import Type, infer_expression
from potto.types.types import Function, Parameter, groups_of
from potto_repl.reply import Refusal
from potto_repl.session import Conversation, plain_names


class Asked(Struct, frozen=True):
    """An expression and its type."""

    text: str
    expr: nodes.Expr
    type: Type

    @property
    def groups(self) -> tuple[tuple[Parameter, ...], ...]:
        """The groups of parameters of a function; none for anything else."""
        return groups_of(self.type) if isinstance(self.type, Function) else ()


def checked(session: Conversation, text: str, usage: str) -> Asked:
    """The expression in an argument. Raises Refusal where there is none, ProgramError where it is wrong."""
    text = plain_names(text)
    if not text.strip():
        raise Refusal("an expression is missing", f"write `{usage}`")
    expr = session.world.parse(text)
    inferred = infer_expression(session.db, session.file, expr)
    wrong = [absolute(session.db, session.file, d, 0) for d in inferred.diagnostics if d.severity == "error"]
    if wrong:
        raise ProgramError([Located(EXPRESSION, d) for d in wrong], session.world.sources(text))
    return Asked(text, expr, inferred.type)


def without_parens(expr: nodes.Expr) -> nodes.Expr:
    while isinstance(expr, nodes.Paren):
        expr = expr.inner
    return expr


class Called(Struct, frozen=True):
    """A call of a function: its head, and what each parameter is given, all groups in a row."""

    head: Asked
    given: tuple[tuple[str, nodes.Expr], ...]


def call_of(session: Conversation, text: str, usage: str) -> Called:
    """An argument such as `f(0.3, g)` or `f 0.3` as a call. Raises Refusal if it is none."""
    asked = checked(session, text, usage)
    expr, groups = without_parens(asked.expr), list[tuple[nodes.Argument, ...]]()
    while isinstance(expr, nodes.Apply):
        groups.insert(0, expr.arguments)
        expr = without_parens(expr.function)
    if not groups:
        what = "is a function: give it its arguments" if asked.groups else "is not a call of a function"
        raise Refusal(f"`{text.strip()}` {what}", f"write `{usage}`")
    head = checked(session, print_expression(expr), usage)
    parameters = head.groups
    given: list[tuple[str, nodes.Expr]] = []
    if len(parameters) < len(groups):
        raise Refusal(f"`{head.text}` is not a function of known parameters", f"write `{usage}`")
    for group, arguments in zip(parameters, groups):
        given += _filled(group, arguments)
    if len(parameters) != len(groups):
        raise Refusal(f"`{text.strip()}` is still a function: give it the arguments of all its groups")
    return Called(head, tuple(given))


def _filled(group: tuple[Parameter, ...], arguments: tuple[nodes.Argument, ...]) -> list[tuple[str, nodes.Expr]]:
    """What each parameter of a group is given: keywords by name, the others in order, or one tuple for all."""
    by_name = {a.name: a.value for a in arguments if a.name is not None}
    rest = [a.value for a in arguments if a.name is None]
    if len(rest) == 1 and len(group) > 1 and isinstance(without_parens(rest[0]), nodes.Tuple):
        rest = list(cast(nodes.Tuple, without_parens(rest[0])).items)
    values = iter(rest)
    filled = []
    for place, parameter in enumerate(group):
        name = parameter.name or ("x" if len(group) == 1 else f"x{place + 1}")
        value = by_name[name] if name in by_name else next(values, None)
        if value is None:
            raise Refusal(f"no value is given for `{name}`")
        filled.append((name, value))
    return filled


def split_items(text: str) -> list[str]:
    """The items between commas that stand outside of brackets."""
    items, depth, start = [], 0, 0
    for place, char in enumerate(text):
        depth += (char in "([{") - (char in ")]}")
        if char == "," and depth == 0:
            items.append(text[start:place].strip())
            start = place + 1
    return [item for item in (*items, text[start:].strip()) if item]
