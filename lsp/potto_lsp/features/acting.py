"""`textDocument/codeAction`, `codeAction/resolve`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, cast

from potto import ide
from potto.source import Span
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask

_DIGITS = frozenset("0123456789.e+-(), ")  # of numbers and tuples of them: anything else is not a value to write down


def code_actions(ask: Ask) -> list[protocol.CodeAction]:
    kinds = ask.optional("context", "only")
    wanted = [str(kind) for kind in kinds] if isinstance(kinds, list) else []
    diagnostics = ask.optional("context", "diagnostics")
    given = diagnostics if isinstance(diagnostics, list) else []
    actions = ide.code_actions(ask.db, ask.file, ask.span, wanted)
    if not ask.client.lists("textDocument.codeAction.resolveSupport.properties", "edit"):
        whole = (ide.resolve_code_action(ask.db, action) for action in actions)  # it takes no edits later
        actions = tuple(action for action in whole if not action.disabled)
    found = [_action(ask, action, given) for action in actions]
    return [*found, *(_action(ask, action, given) for action in _expecting(ask, wanted))]


def _expecting(ask: Ask, wanted: list[str]) -> Iterator[ide.CodeAction]:
    """For a live expression whose value is known: expect that value, if it isn't expected already."""
    if "#>" not in ask.text.text or (wanted and "quickfix" not in wanted):
        return
    span = ask.span
    for live, value in ask.session.live.values(ask.file):
        end = live.span.end if live.expected_span is None else live.expected_span.end
        if value is None or not (span.start <= end and live.span.start <= span.end):
            continue
        text = value.result.get("text", "")
        if not text or not set(text) <= _DIGITS or (live.expected is not None and value.result["holds"] is not False):
            continue
        edit = ide.Edit(live.expected_span or Span(end, end), text if live.expected_span else f"\n#= {text}")
        change = ide.Change((ide.FileEdits(ask.file, (edit,)),))
        yield ide.CodeAction(f"Expect {text}", "quickfix", change, ("P0530",) if live.expected_span else ())


def _action(ask: Ask, action: ide.CodeAction, given: list[Any]) -> protocol.CodeAction:
    found: protocol.CodeAction = {"title": action.title, "kind": action.kind}
    if fixed := [said for said in given if isinstance(said, Mapping) and said.get("code") in action.codes]:
        found["diagnostics"] = fixed
    if action.preferred:
        found["isPreferred"] = True
    if action.disabled and ask.client.can("textDocument.codeAction.disabledSupport"):
        found["disabled"] = {"reason": action.disabled}
    if action.data:
        found["data"] = {"uri": ask.uri, "kind": action.kind, "action": list(action.data)}
    _add_change(ask, found, action, ask.uri)
    return found


def _add_change(ask: Ask, found: protocol.CodeAction, action: ide.CodeAction, uri: str) -> None:
    if action.change is None:
        return
    found["edit"] = convert.workspace_edit(ask.analysis, ask.client, action.change)
    if action.rename_at is not None and ask.client.lists("experimental.commands.commands", "potto.rename"):
        # The place of the word after the change; only the client can convert it into its own terms.
        found["command"] = {"title": "rename", "command": "potto.rename", "arguments": [uri, action.rename_at]}


def resolve(ask: Ask) -> Any:
    uri, data = ask.optional("data", "uri"), ask.optional("data", "action")
    if not isinstance(ask.params, Mapping) or not isinstance(uri, str) or not isinstance(data, list):
        return ask.params
    kind, title = cast(Any, ask.optional("data", "kind")), str(ask.params.get("title", ""))
    action = ide.resolve_code_action(ask.db, ide.CodeAction(title, kind, data=tuple(map(str, data))))
    found: Any = dict(ask.params)
    _add_change(ask, found, action, uri)
    return found
