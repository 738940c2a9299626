"""Signature help: the groups of parameters of the call at the cursor, and which one is being filled.

Owns `signature_help`. Keywords fill parameters by name, in any place; the others fill those that are left, in order.
Derivatives take duals under names with a `d` in front.
"""

from __future__ import annotations

from msgspec import Struct

from potto.ide.completion.form_help import form_help, signature
from potto.ide.completion.pending_calls import PendingCall, call_at, juxtaposed_at
from potto.ide.hover.hovers import typed_parameters
from potto.ide.hover.local_names import local_type
from potto.ide.model import ParameterText, Signature, SignatureHelp
from potto.ide.names.descriptions import documentation
from potto.ide.names.index import call_head
from potto.ide.names.keywords import SPECIALS
from potto.ide.names.places import ChunkAt, chunk_at
from potto.ide.names.symbols import LocalSymbol, callee
from potto.measures import COMPOSITIONS, MEASURES
from potto.modules import resolve
from potto.primitives import PRIMITIVES
from potto.query import Database
from potto.source import Span
from potto.syntax import nodes
from potto.types import Function, Parameter, Type, derivative_type, format_type, groups_of, interface, result_of


class CallAtHand(Struct, frozen=True):
    """What a call is of: its name, its type, how many groups were given before."""

    name: str
    type: Type
    given: int
    documentation: str
    plain: tuple[str, ...] = ()


def signature_help(db: Database, file: str, offset: int) -> SignatureHelp | None:
    """The signatures of the call at an offset, group by group."""
    beside = juxtaposed_at(db, file, offset)
    applied = None if beside is None else called_at(db, file, beside)
    if beside is not None and applied is not None and (found := _groups(applied, beside)) is not None:
        return found
    return _of_call(db, file, offset) or form_help(db, file, offset)


def _of_call(db: Database, file: str, offset: int) -> SignatureHelp | None:
    call = call_at(db, file, offset)
    if call is None:
        return None
    head, given, derived = call_head(call.function)
    if call.measure:
        return _measure(head, call)
    called = called_at(db, file, call)
    if called is not None:
        return _groups(called, call)
    if isinstance(head, nodes.Name) and not given and not derived:
        return _builtin(db, file, head.id, call)
    return None


def called_at(db: Database, file: str, call: PendingCall) -> CallAtHand | None:
    """The function that is called, if it has a type: a definition, or a local name."""
    return called_in(db, file, call, chunk_at(db, file, call.function_span.start))


def called_in(db: Database, file: str, call: PendingCall, chunk: ChunkAt | None) -> CallAtHand | None:
    """The same for a call in a chunk."""
    head, given, derived = call_head(call.function)
    if isinstance(head, nodes.Name):
        local = None if chunk is None else _local(db, chunk, call.function_span.start - chunk.start, head.id)
        if local is not None:
            return _derived(head.id, local_type(db, local), given, derived, "", ())
    target = callee(db, file, call.function)
    if target is None:
        return None
    found = interface(db, target.file, target.name)
    said = documentation(db, target.file, target.name)
    return _derived(target.name, found.type, target.given, target.derived, said, found.plain)


def _derived(name: str, type: Type, given: int, derived: int, said: str, plain: tuple[str, ...]) -> CallAtHand:
    for _ in range(derived):
        type = derivative_type(type)
    prefix = "d" * derived
    return CallAtHand(prefix + name, type, given, said, tuple(prefix + p for p in plain))


def _local(db: Database, chunk: ChunkAt, place: int, name: str) -> LocalSymbol | None:
    for number, binder in chunk.index(db).visible(place):
        if binder.name == name:
            return LocalSymbol(chunk, number, binder)
    return None


def _groups(called: CallAtHand, call: PendingCall) -> SignatureHelp | None:
    groups = groups_of(called.type)
    if not isinstance(called.type, Function) or called.given >= len(groups):
        return None
    label, spans = _label(called, groups)
    signatures = tuple(
        Signature(
            label,
            called.documentation,
            tuple(ParameterText(span, _parameter(p, called.plain)) for span, p in zip(spans[number], group)),
            active_parameter(group, call) if number == called.given else None,
        )
        for number, group in enumerate(groups)
    )
    return SignatureHelp(signatures, called.given)


def _label(called: CallAtHand, groups: tuple[tuple[Parameter, ...], ...]) -> tuple[str, list[list[Span]]]:
    text, spans = called.name, []
    for group in groups:
        places: list[Span] = []
        text += "("
        for number, parameter in enumerate(group):
            text += ", " if number else ""
            shown = format_type(parameter.type)
            shown = shown if parameter.name is None else f"{parameter.name}: {shown}"
            places.append(Span(len(text), len(text) + len(shown)))
            text += shown
        text += ")"
        spans.append(places)
    return f"{text} -> {format_type(result_of(called.type))}", spans


def _parameter(parameter: Parameter, plain: tuple[str, ...]) -> str:
    return "must not vary with a variable of integration" if parameter.name in plain else ""


def active_parameter(group: tuple[Parameter, ...], call: PendingCall) -> int | None:
    """The parameter that the argument at the cursor fills."""
    names = [parameter.name for parameter in group]
    if call.keyword is not None:
        return names.index(call.keyword) if call.keyword in names else None
    left = [number for number, name in enumerate(names) if name is None or name not in call.keywords]
    return left[call.positional] if call.positional < len(left) else None


def _measure(head: nodes.Expr, call: PendingCall) -> SignatureHelp | None:
    if not isinstance(head, nodes.Name):
        return None
    measure = MEASURES.get(head.id) or COMPOSITIONS.get(head.id)
    if measure is None:
        return None
    return signature(f"{measure.name}(", measure.parameters, ")", measure.doc, _within(call, measure.parameters))


def _builtin(db: Database, file: str, name: str, call: PendingCall) -> SignatureHelp | None:
    if resolve(db, file, name) is not None:
        return None
    special = SPECIALS.get(name)
    if special is not None and "->" in special.type:
        taken = special.parameters
        return signature(f"{name}(", taken, f") : {special.type}", special.doc, _within(call, taken))
    primitive = PRIMITIVES.get(name)
    if primitive is None or not primitive.surface:
        return None
    parameters = typed_parameters(primitive)
    return signature(f"{name}(", parameters, ") -> Real", primitive.doc, min(call.positional, len(parameters) - 1))


def _within(call: PendingCall, parameters: tuple[str, ...]) -> int | None:
    return call.positional if call.positional < len(parameters) else None
