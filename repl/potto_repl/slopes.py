"""The derivative of a call by each of its numbers: `f(0.3, g)` becomes `deriv(f)((0.3, 1), deriv(g))`.

Owns `Slope`, `slopes` and `all_slopes`. It is written in Potto itself, so that it means what the same text at the
prompt means.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from msgspec import Struct

from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.shown import as_dual
from potto.syntax import nodes, print_expression
from potto.types.types import ArrayOf, Diffeo, Function, Parameter, TupleOf, holds_functions, resolve
from potto_repl.expressions import Called, checked
from potto_repl.reply import Refusal
from potto_repl.session import Conversation
from potto_repl.shown_values import Parts, parts_of

_NO_NUMBERS = (Function, Diffeo, TupleOf, ArrayOf)


class Slope(Struct, frozen=True):
    """The derivative by one parameter: the call that gives it, its value, and its parts."""

    name: str
    text: str
    expr: nodes.Expr
    dual: Estimate
    parts: Parts | None


def slopes(session: Conversation, called: Called) -> Iterator[Slope]:
    """The derivative by each number that the call is given. Raises ProgramError, Refusal."""
    numbers = numbers_of(called)
    if not numbers:
        raise _nothing(called, "number")
    yield from _by_each(session, called, numbers)


def all_slopes(session: Conversation, called: Called) -> Iterator[Slope]:
    """The same, and the derivative by each array, tuple or record of numbers, in its shape."""
    parameters = [parameter for group in called.head.groups for parameter in group]
    pairs = zip(parameters, called.given, strict=True)
    names = [name for parameter, (name, _) in pairs if not holds_functions(parameter.type)]
    if not names:
        raise _nothing(called, "number, and nothing made of numbers,")
    yield from _by_each(session, called, names)


def _by_each(session: Conversation, called: Called, names: Sequence[str]) -> Iterator[Slope]:
    numbers = numbers_of(called)
    for place, name in enumerate(names):
        if session.progress is not None:
            session.progress(f"by {name}", place / len(names))
        number = name in numbers
        text = dual_text(called, name) if number else f"({_text(called)}, {_gradient(called, name)})"
        expr = checked(session, text, ":grad f(0.3)").expr
        dual = as_dual(session.evaluate(text, session.settings).estimate)
        parts = parts_of(session.world, session.file, expr, dual, session.settings) if number else None
        yield Slope(name, text, expr, dual, parts)


def _nothing(called: Called, what: str) -> Refusal:
    why = f"`{called.head.text}` has no {what} among its parameters"
    return Refusal(f"{why}, so there is nothing to differentiate by")


def _arguments(called: Called) -> str:
    rest = iter(called.given)
    groups = [", ".join(print_expression(next(rest)[1]) for _ in group) for group in called.head.groups]
    return "".join(f"({group})" for group in groups)


def _text(called: Called) -> str:
    return f"({called.head.text}){_arguments(called)}"


def _gradient(called: Called, name: str) -> str:
    return f"grad({called.head.text}, {name}){_arguments(called)}"


def numbers_of(called: Called) -> list[str]:
    """The parameters that are numbers."""
    parameters = [parameter for group in called.head.groups for parameter in group]
    pairs = zip(parameters, called.given, strict=True)
    return [name for parameter, (name, _) in pairs if not isinstance(resolve(parameter.type), _NO_NUMBERS)]


def dual_text(called: Called, wrt: str, tangent: float = 1) -> str:
    """The call of the derivative in the direction of one parameter."""
    rest = iter(called.given)
    groups = [", ".join(_dual(p, *next(rest), wrt, tangent) for p in group) for group in called.head.groups]
    return f"deriv({called.head.text}){''.join(f'({group})' for group in groups)}"


def _dual(parameter: Parameter, name: str, value: nodes.Expr, wrt: str, tangent: float) -> str:
    text, type = print_expression(value), resolve(parameter.type)
    if name == wrt:
        return f"({text}, {tangent!r})"
    if isinstance(type, Function | Diffeo):
        return f"deriv({text})"
    if isinstance(type, ArrayOf) or (isinstance(type, TupleOf) and type.record is not None):
        return text
    return f"({text}, {_zeros(type)})" if isinstance(type, TupleOf) else f"({text}, 0)"


def _zeros(type: TupleOf) -> str:
    parts = [_zeros(inner) if isinstance(inner := resolve(item), TupleOf) else "0" for item in type.items]
    return f"({', '.join(parts)})"
