"""Names of parameters, which most callers do not need: who calls a function with all its arguments by place is told
the same whatever they are called, but for the words of messages.

Owns `without_names`, an interface with signs for names, and `with_names`, which writes the names into messages. So a
name that is being typed is no reason to infer callers again.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from msgspec.structs import replace

from potto.diagnostics import Diagnostic, Replacement
from potto.modules.lookup import DefinitionTarget
from potto.types.interfaces import Interface
from potto.types.types import REAL, Function, Parameter, TupleOf, resolve
from potto.types.unify import NUMBERS, rebuild

# Letters of a private area, which stand in no program that the parser takes: of a parameter its place and its function.
_SIGN = re.compile("\ue000([0-9]+)\ue001([^\ue000\ue001\ue002]*)\ue001([^\ue000\ue001\ue002]*)\ue002")
_LEFT = re.compile("[\ue000\ue001\ue002]")


def without_names(found: Interface, target: DefinitionTarget) -> Interface:
    """The interface of a function whose names can be written in later, without the marks that its type has and callers
    make nothing of; any other one as it is.

    Of a record, a derivative and what gives a function again the names are more than words.
    """
    type = resolve(rebuild(found.type, lambda part: REAL if isinstance(part, NUMBERS) else part))
    if not isinstance(type, Function) or found.broken or found.diffeo or found.derivative:
        return found
    result = resolve(type.result)
    if isinstance(result, Function) or (isinstance(result, TupleOf) and result.record is not None):
        return found
    if any(p.name is None or (p.name[:1] == "d" and isinstance(resolve(p.type), TupleOf)) for p in type.parameters):
        return found
    signs = (f"\ue000{place}\ue001{target.file}\ue001{target.name}\ue002" for place in range(len(type.parameters)))
    parameters = tuple([Parameter(sign, p.type) for sign, p in zip(signs, type.parameters)])
    return Interface(found.name, Function(parameters, type.result), found.flow)


def with_names(
    found: tuple[Diagnostic, ...], names: Callable[[DefinitionTarget], tuple[str | None, ...]]
) -> tuple[Diagnostic, ...] | None:
    """Messages with the names of parameters; None where one is not whole in them, as in a text that was cut short."""
    told = tuple([_named(diagnostic, names) if _has_signs(diagnostic) else diagnostic for diagnostic in found])
    return None if any(_has_signs(diagnostic) for diagnostic in told) else told


def _texts(said: Diagnostic) -> tuple[str, ...]:
    related = (near.message for near in said.related)
    edits = (text for each in said.suggestions for text in (each.title, *(edit.text for edit in each.edits)))
    return (said.message, said.label, said.help, *said.notes, *related, *edits)


def _has_signs(said: Diagnostic) -> bool:
    return any(map(_LEFT.search, _texts(said)))


def _named(said: Diagnostic, names: Callable[[DefinitionTarget], tuple[str | None, ...]]) -> Diagnostic:
    def name(sign: re.Match[str]) -> str:
        known = names(DefinitionTarget(sign[2], sign[3]))
        return (known[int(sign[1])] or "") if int(sign[1]) < len(known) else ""

    def written(text: str) -> str:
        return _SIGN.sub(name, text)

    related = tuple([replace(near, message=written(near.message)) for near in said.related])
    suggestions = tuple(
        [
            replace(each, title=written(each.title), edits=tuple([_edit(edit, written) for edit in each.edits]))
            for each in said.suggestions
        ]
    )
    return replace(
        said, message=written(said.message), label=written(said.label), help=written(said.help), related=related,
        notes=tuple(map(written, said.notes)), suggestions=suggestions,
    )  # fmt: skip


def _edit(edit: Replacement, written: Callable[[str], str]) -> Replacement:
    return Replacement(edit.span, written(edit.text))
