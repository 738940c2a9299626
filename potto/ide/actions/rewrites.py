"""Rewrites that keep the meaning: `?:` and `if`, the inverse written down, the arguments of a call completed.

Owns `rewrites`. A rewrite is offered only if its text reads back as the same tree.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from potto.ide.actions.edits import one_file
from potto.ide.actions.fixes_of_conditions import written_inverse
from potto.ide.actions.offers import At, PendingAction, bare, reads
from potto.ide.completion.pending_calls import PendingCall, call_at
from potto.ide.completion.signature_help import called_at
from potto.ide.model import Change, Edit
from potto.ide.names.places import ChunkAt
from potto.source import Span
from potto.syntax import nodes
from potto.types import Function, Parameter, TupleOf, Type, groups_of

_NAME_BEFORE = re.compile(r"\w+ *\(")


def rewrites(place: At) -> Iterator[PendingAction]:
    """The rewrites of what the selection begins in."""
    yield from _conditional(place)
    yield from _inverse(place)
    yield from _arguments(place)


def _conditional(place: At) -> Iterator[PendingAction]:
    node = next((n for n in reversed(place.path) if isinstance(n, nodes.If)), None)
    if node is None or place.chunk is None:
        return
    chunk, found = place.chunk, node
    title = "Write it with `? :`" if node.style == "if" else "Write it with `if`"
    yield PendingAction(title, "refactor.rewrite", lambda: _swapped(place, chunk, found))


def _swapped(place: At, chunk: ChunkAt, node: nodes.If) -> Change | None:
    parts = [chunk.text[part.span.start : part.span.end] for part in (node.condition, node.then, node.orelse)]
    wanted = bare(chunk.parsed(place.db).item)
    kept = [f"({part})" for part in parts]
    for condition, then, orelse in (parts, [kept[0], *parts[1:]], [parts[0], kept[1], parts[2]], kept):
        text = f"{condition} ? {then} : {orelse}" if node.style == "if" else f"if {condition} then {then} else {orelse}"
        for written in (text, f"({text})"):
            if reads(chunk, [Edit(node.span, written)]) == wanted:
                return one_file(place.file, Edit(chunk.absolute(node.span), written))
    return None


def _inverse(place: At) -> Iterator[PendingAction]:
    if written_inverse(place) is not None:
        yield PendingAction("Write down the inverse", "refactor.rewrite", lambda: written_inverse(place))


def _arguments(place: At) -> Iterator[PendingAction]:
    call = call_at(place.db, place.file, _into_call(place.text, place.span.start))
    if call is None or call.measure:
        return
    called = called_at(place.db, place.file, call)
    if called is None:
        return
    groups = groups_of(called.type)
    left = _left(groups[called.given], call) if called.given < len(groups) else ()
    if left:
        title = f"Complete the arguments of `{called.name}`"
        yield PendingAction(title, "refactor.rewrite", lambda: _completed(place, call, left))


def _into_call(text: str, at: int) -> int:
    """A place, or, on the name in front of the parenthesis of a call, the place behind that."""
    open = _NAME_BEFORE.match(text, at)
    return at if open is None else open.end()


def _left(group: tuple[Parameter, ...], call: PendingCall) -> tuple[Parameter, ...]:
    """The parameters of a group that a call does not fill yet; nothing if one of them has no name."""
    text = [p for p in group if p.name not in call.keywords]
    left = tuple(text[call.total :]) if call.total else tuple(text)
    return left if all(p.name is not None for p in left) else ()


def _completed(place: At, call: PendingCall, left: tuple[Parameter, ...]) -> Change:
    written = ", ".join(f"{p.name}={_value(p.name or '', p.type)}" for p in left)
    before = place.text[call.open + 1 : call.close].rstrip()
    end = call.open + 1 + len(before)
    glue = "" if not before or before.endswith(",") else ", "
    glue = " " if before.endswith(",") else glue
    return one_file(place.file, Edit(Span(end, call.close), glue + written))


def _value(name: str, type: Type) -> str:
    """Something of the type to start from: a value and a tangent for a dual, the derivative of a function."""
    match type:
        case TupleOf(items, dual=True):
            return "(0, 1)" if len(items) == 2 else "0"
        case TupleOf(items):
            return f"({', '.join(_value(name, item) for item in items)})"
        case Function(parameters=parameters):
            duals = any(isinstance(p.type, TupleOf) and p.type.dual for p in parameters)
            return f"deriv({name.removeprefix('d')})" if duals else name
        case _:
            return "0"
