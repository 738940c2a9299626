"""`textDocument/codeAction`, `codeAction/resolve`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from potto import ide
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask


def code_actions(ask: Ask) -> list[protocol.CodeAction]:
    kinds = ask.optional("context", "only")
    wanted = [str(kind) for kind in kinds] if isinstance(kinds, list) else []
    diagnostics = ask.optional("context", "diagnostics")
    given = diagnostics if isinstance(diagnostics, list) else []
    return [_action(ask, action, given) for action in ide.code_actions(ask.db, ask.file, ask.span, wanted)]


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
        # Where the word will be once the change is made: only the client can say what that is in its terms.
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
