"""Code actions: what can be done about the selection.

Owns `code_actions` and `resolve_code_action`. The kinds of actions are in modules of their own, each a function from a
place to offers. An action is listed without its change; to resolve it looks its offer up again and carries it out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from msgspec.structs import replace

from potto.ide.actions.extract import extractions
from potto.ide.actions.inline import inlinings
from potto.ide.actions.offers import At, PendingAction, at
from potto.ide.actions.organize_imports import organizations
from potto.ide.actions.quick_fixes import fixes
from potto.ide.actions.rewrites import rewrites
from potto.ide.model import CodeAction
from potto.query import Database
from potto.source import Span

SOURCES: tuple[Callable[[At], Iterable[PendingAction]], ...] = (fixes, rewrites, extractions, inlinings, organizations)


def code_actions(db: Database, file: str, span: Span, kinds: Sequence[str] = ()) -> tuple[CodeAction, ...]:
    """The actions for a selection; `kinds`: only those, or those below them (`refactor` has `refactor.extract`)."""
    found: dict[str, CodeAction] = {}
    for offer in _offers(at(db, file, span)):
        if kinds and not any(offer.kind == kind or offer.kind.startswith(kind + ".") for kind in kinds):
            continue
        codes = () if offer.diagnostic is None else (offer.diagnostic.code,)
        spans = () if offer.diagnostic is None else (offer.diagnostic.span,)
        data = (file, str(span.start), str(span.end), offer.title)
        found.setdefault(
            offer.title, CodeAction(offer.title, offer.kind, None, codes, spans, offer.preferred, data=data)
        )
    return tuple(found.values())


def resolve_code_action(db: Database, action: CodeAction) -> CodeAction:
    """An action with its change; `disabled` says why if there is none any more."""
    match action.data:
        case (file, start, end, title):
            for offer in _offers(at(db, file, Span(int(start), int(end)))):
                if offer.title == title:
                    change = offer.make()
                    if change is not None:
                        return replace(action, change=change, rename_at=offer.rename_at())
            return replace(action, disabled="the text has changed, or the result would not mean the same")
        case _:
            return action


def _offers(place: At) -> Iterable[PendingAction]:
    for source in SOURCES:
        yield from source(place)
