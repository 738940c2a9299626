"""`textDocument/definition`, `declaration`, `typeDefinition`, `implementation`: where to go from a name."""

from __future__ import annotations

from potto import ide
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask

Answer = list[protocol.LocationLink] | list[protocol.Location] | None


def definition(ask: Ask) -> Answer:
    return _answer(ask, "definition", ide.definition(ask.db, ask.file, ask.offset))


def declaration(ask: Ask) -> Answer:
    return _answer(ask, "declaration", ide.declaration(ask.db, ask.file, ask.offset))


def type_definition(ask: Ask) -> Answer:
    return _answer(ask, "typeDefinition", ide.type_definition(ask.db, ask.file, ask.offset))


def implementation(ask: Ask) -> Answer:
    return _answer(ask, "implementation", ide.implementation(ask.db, ask.file, ask.offset))


def _answer(ask: Ask, method: str, found: ide.Links | None) -> Answer:
    if found is None:
        return None
    if not ask.client.can(f"textDocument.{method}.linkSupport"):
        return [convert.place(ask.analysis, target) for target in found.targets]
    return [_link(ask, found, target) for target in found.targets]


def _link(ask: Ask, found: ide.Links, target: ide.Location) -> protocol.LocationLink:
    text = ask.analysis.text(target.file)
    return {
        "originSelectionRange": ask.range(found.origin),
        "targetUri": ask.analysis.uri(target.file),
        "targetRange": convert.range_of(text, target.full),
        "targetSelectionRange": convert.range_of(text, target.span),
    }
