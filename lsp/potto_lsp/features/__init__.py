"""The table of features: which adapter answers which method, and what the client is told of it.

Owns `FEATURES`, `capabilities` and `load_features`. An adapter is a function from an `Ask` to what is sent. Its module
is loaded when it is first needed, so that the greeting waits for none. `pace` says what a question waits for, see
`work`: `slow` is for those that look through a whole file or the workspace.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from msgspec import Struct

if TYPE_CHECKING:
    from potto_lsp.asking import Ask

COMMANDS = ("potto.evaluate", "potto.differentiate", "potto.preview", "potto.more")
# The legend of semantic tokens, which the greeting announces; a test holds it against that of `potto.ide`.
TOKEN_TYPES = (
    "namespace", "type", "parameter", "variable", "property", "function", "keyword", "comment", "number", "operator",
    "macro",
)  # fmt: skip
TOKEN_MODIFIERS = (
    "declaration", "definition", "readonly", "defaultLibrary", "integration", "plain", "diffeo", "documentation",
)  # fmt: skip


class Feature(Struct, frozen=True, dict=True):
    """A method, the adapter (`module.function`) and the capability that announces it."""

    method: str
    adapter: str
    announces: Mapping[str, Any] = {}
    pace: Literal["quick", "diagnosis", "slow"] = "quick"

    def load(self) -> None:
        """Load the adapter."""
        _ = self.answer

    @cached_property
    def answer(self) -> Callable[[Ask], Any]:
        """The adapter."""
        module, _, function = self.adapter.partition(".")
        found: Callable[[Ask], Any] = getattr(importlib.import_module(f"potto_lsp.features.{module}"), function)
        return found


_DOCUMENT = "textDocument/"
_ALL = (
    Feature(_DOCUMENT + "hover", "hovering.hover", {"hoverProvider": True}),
    Feature(
        _DOCUMENT + "completion",
        "completing.complete",
        {"completionProvider": {"triggerCharacters": [".", "\\", "~"], "resolveProvider": True,
                                "completionItem": {"labelDetailsSupport": True}}},
    ),
    Feature("completionItem/resolve", "completing.resolve"),
    Feature(
        _DOCUMENT + "signatureHelp",
        "helping.signature_help",
        {"signatureHelpProvider": {"triggerCharacters": ["(", ",", " "], "retriggerCharacters": [")", "="]}},
    ),
    Feature(_DOCUMENT + "definition", "targets.definition", {"definitionProvider": True}),
    Feature(_DOCUMENT + "declaration", "targets.declaration", {"declarationProvider": True}),
    Feature(_DOCUMENT + "typeDefinition", "targets.type_definition", {"typeDefinitionProvider": True}),
    Feature(_DOCUMENT + "implementation", "targets.implementation", {"implementationProvider": True}),
    Feature(_DOCUMENT + "references", "occurrences.references", {"referencesProvider": True}, pace="slow"),
    Feature(_DOCUMENT + "documentHighlight", "occurrences.highlights", {"documentHighlightProvider": True}),
    Feature(_DOCUMENT + "documentSymbol", "outlines.document_symbols", {"documentSymbolProvider": True}, pace="slow"),
    Feature("workspace/symbol", "outlines.workspace_symbols", {"workspaceSymbolProvider": True}, pace="slow"),
    Feature(_DOCUMENT + "prepareCallHierarchy", "call_hierarchies.prepare", {"callHierarchyProvider": True}),
    Feature("callHierarchy/incomingCalls", "call_hierarchies.incoming", pace="slow"),
    Feature("callHierarchy/outgoingCalls", "call_hierarchies.outgoing", pace="slow"),
    Feature(_DOCUMENT + "rename", "renaming.rename", {"renameProvider": {"prepareProvider": True}}, pace="slow"),
    Feature(_DOCUMENT + "prepareRename", "renaming.prepare"),
    Feature("workspace/willRenameFiles", "renaming.will_rename_files", pace="slow"),
    Feature(
        _DOCUMENT + "codeAction",
        "acting.code_actions",
        {"codeActionProvider": {"resolveProvider": True, "codeActionKinds": [
            "quickfix", "refactor.extract", "refactor.inline", "refactor.rewrite", "source.organizeImports",
            "source.fixAll"]}},
    ),
    Feature("codeAction/resolve", "acting.resolve"),
    Feature(_DOCUMENT + "codeLens", "lenses.code_lenses", {"codeLensProvider": {"resolveProvider": True}}, pace="slow"),
    Feature("codeLens/resolve", "lenses.resolve", pace="slow"),
    Feature(_DOCUMENT + "inlayHint", "hinting.inlay_hints", {"inlayHintProvider": {"resolveProvider": True}},
            pace="slow"),
    Feature("inlayHint/resolve", "hinting.resolve"),
    Feature(_DOCUMENT + "inlineValue", "hinting.inline_values", {"inlineValueProvider": True}),
    Feature(
        _DOCUMENT + "semanticTokens/full",
        "token_colours.full",
        {"semanticTokensProvider": {
            "legend": {"tokenTypes": list(TOKEN_TYPES), "tokenModifiers": list(TOKEN_MODIFIERS)},
            "full": {"delta": True}, "range": True}},
        pace="slow",
    ),
    Feature(_DOCUMENT + "semanticTokens/full/delta", "token_colours.delta", pace="slow"),
    Feature(_DOCUMENT + "semanticTokens/range", "token_colours.in_range", pace="slow"),
    Feature(_DOCUMENT + "foldingRange", "text_ranges.folding_ranges", {"foldingRangeProvider": True}, pace="slow"),
    Feature(_DOCUMENT + "selectionRange", "text_ranges.selection_ranges", {"selectionRangeProvider": True}),
    Feature(_DOCUMENT + "linkedEditingRange", "linking.linked_editing", {"linkedEditingRangeProvider": True}),
    Feature(_DOCUMENT + "documentLink", "linking.document_links", {"documentLinkProvider": {}}, pace="slow"),
    Feature(_DOCUMENT + "formatting", "formatting.document", {"documentFormattingProvider": True}, pace="slow"),
    Feature(_DOCUMENT + "rangeFormatting", "formatting.in_range", {"documentRangeFormattingProvider": True}),
    Feature(
        _DOCUMENT + "onTypeFormatting",
        "formatting.on_type",
        {"documentOnTypeFormattingProvider": {"firstTriggerCharacter": "\n", "moreTriggerCharacter": [")", "]"]}},
    ),
    Feature(
        _DOCUMENT + "diagnostic",
        "diagnosing.document",
        {"diagnosticProvider": {"identifier": "potto", "interFileDependencies": True, "workspaceDiagnostics": True}},
        pace="diagnosis",
    ),
    Feature("workspace/diagnostic", "diagnosing.workspace", pace="slow"),
    Feature("potto/scenes", "previewing.scenes", pace="slow"),
    Feature("potto/sample", "previewing.sample"),
    Feature("potto/pixel", "previewing.pixel"),
    Feature("potto/viewPage", "viewing.page"),
    Feature("potto/viewed", "viewing.viewed"),
    Feature("potto/view", "viewing.view"),
    Feature(
        "workspace/executeCommand",
        "commands.execute",
        {"executeCommandProvider": {"commands": list(COMMANDS), "workDoneProgress": True}},
    ),
)  # fmt: skip
FEATURES = {feature.method: feature for feature in _ALL}

_FILES = {"filters": [{"scheme": "file", "pattern": {"glob": "**/*.{po,diffeo}"}}, {"scheme": "file", "pattern": {
    "glob": "**", "matches": "folder"}}]}  # fmt: skip


def capabilities(encoding: str) -> dict[str, Any]:
    """What the server can do, as it says in its greeting."""
    found: dict[str, Any] = {
        "positionEncoding": encoding,
        "textDocumentSync": {"openClose": True, "change": 2, "save": {"includeText": False}},
        "workspace": {
            "workspaceFolders": {"supported": True, "changeNotifications": True},
            "fileOperations": {"willRename": _FILES, "didRename": _FILES, "didCreate": _FILES, "didDelete": _FILES},
        },
    }
    for feature in _ALL:
        found.update(feature.announces)
    return found


def load_features() -> None:
    """Load all adapters, so that the first question doesn't wait for its own."""
    for feature in FEATURES.values():
        feature.load()
