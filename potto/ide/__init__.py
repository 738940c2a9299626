"""Editor features as pure questions in offsets and strings.

Owns what an editor may ask; one module a feature. Knows neither a protocol nor numbers: `potto_lsp` translates. Every
question takes the database first and answers also on broken text. A module is loaded when one of its questions is first
asked: an opened file is checked before hovers and quick fixes are loaded.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from potto.ide.model import (
    TOKEN_MODIFIERS,
    TOKEN_TYPES,
    CallItem,
    Change,
    CodeAction,
    CodeLens,
    Completion,
    Completions,
    DocumentLink,
    DocumentSymbol,
    Edit,
    FileEdits,
    FileRename,
    Foldable,
    HierarchyCall,
    Highlight,
    Hover,
    InlayHint,
    InlineValue,
    Links,
    Location,
    Offer,
    ParameterText,
    Refused,
    Renaming,
    SemanticToken,
    Signature,
    SignatureHelp,
    WorkspaceSymbol,
)

if TYPE_CHECKING:
    from potto.ide.actions.code_actions import code_actions, resolve_code_action
    from potto.ide.completion.completing import completions, completions_after, resolve_completion
    from potto.ide.completion.signature_help import signature_help
    from potto.ide.display.code_lenses import code_lenses, offered, resolve_code_lens
    from potto.ide.display.folding_ranges import folding_ranges
    from potto.ide.display.formatting import format_document, format_on_type, format_range
    from potto.ide.display.inlay_hints import inlay_hints, resolve_inlay_hint
    from potto.ide.display.inline_values import inline_values
    from potto.ide.display.scenes import Scene, SceneParameter, scene, scenes
    from potto.ide.display.semantic_tokens import semantic_tokens
    from potto.ide.display.views import Viewed, viewed
    from potto.ide.hover.derivatives import derivative_markdown, diffeo_markdown, is_sound
    from potto.ide.hover.hovers import hover_at
    from potto.ide.names.descriptions import kind_of
    from potto.ide.names.live_expressions import live_diagnostics, live_in
    from potto.ide.names.live_points import CallPoint, looked_at, point_of, points
    from potto.ide.names.symbols import definition_at
    from potto.ide.navigation.call_hierarchy import incoming_calls, outgoing_calls, prepare_call_hierarchy
    from potto.ide.navigation.links import document_links, linked_editing
    from potto.ide.navigation.moved_files import rename_files
    from potto.ide.navigation.outlines import document_symbols, workspace_symbols
    from potto.ide.navigation.references import highlights, references
    from potto.ide.navigation.renaming import prepare_rename, rename
    from potto.ide.navigation.selection_ranges import selection_ranges
    from potto.ide.navigation.targets import declaration, definition, implementation, type_definition

__all__ = [
    "TOKEN_MODIFIERS",
    "TOKEN_TYPES",
    "CallItem",
    "CallPoint",
    "Change",
    "CodeAction",
    "CodeLens",
    "Completion",
    "Completions",
    "DocumentLink",
    "DocumentSymbol",
    "Edit",
    "FileEdits",
    "FileRename",
    "Foldable",
    "HierarchyCall",
    "Highlight",
    "Hover",
    "InlayHint",
    "InlineValue",
    "Links",
    "Location",
    "Offer",
    "ParameterText",
    "Refused",
    "Renaming",
    "Scene",
    "SceneParameter",
    "SemanticToken",
    "Signature",
    "SignatureHelp",
    "Viewed",
    "WorkspaceSymbol",
    "code_actions",
    "code_lenses",
    "completions",
    "completions_after",
    "declaration",
    "definition",
    "definition_at",
    "derivative_markdown",
    "diffeo_markdown",
    "document_links",
    "document_symbols",
    "folding_ranges",
    "format_document",
    "format_on_type",
    "format_range",
    "highlights",
    "hover_at",
    "implementation",
    "incoming_calls",
    "inlay_hints",
    "inline_values",
    "is_sound",
    "kind_of",
    "linked_editing",
    "live_diagnostics",
    "live_in",
    "looked_at",
    "offered",
    "outgoing_calls",
    "point_of",
    "points",
    "prepare_call_hierarchy",
    "prepare_rename",
    "references",
    "rename",
    "rename_files",
    "resolve_code_action",
    "resolve_code_lens",
    "resolve_completion",
    "resolve_inlay_hint",
    "scene",
    "scenes",
    "selection_ranges",
    "semantic_tokens",
    "signature_help",
    "type_definition",
    "viewed",
    "workspace_symbols",
]

_HOMES = {
    "actions.code_actions": "code_actions resolve_code_action",
    "completion.completing": "completions completions_after resolve_completion",
    "completion.signature_help": "signature_help",
    "display.code_lenses": "code_lenses offered resolve_code_lens",
    "display.folding_ranges": "folding_ranges",
    "display.formatting": "format_document format_on_type format_range",
    "display.inlay_hints": "inlay_hints resolve_inlay_hint",
    "display.inline_values": "inline_values",
    "display.scenes": "Scene SceneParameter scene scenes",
    "display.semantic_tokens": "semantic_tokens",
    "display.views": "Viewed viewed",
    "hover.derivatives": "derivative_markdown diffeo_markdown is_sound",
    "hover.hovers": "hover_at",
    "names.descriptions": "kind_of",
    "names.live_expressions": "live_diagnostics live_in",
    "names.live_points": "CallPoint looked_at point_of points",
    "names.symbols": "definition_at",
    "navigation.call_hierarchy": "incoming_calls outgoing_calls prepare_call_hierarchy",
    "navigation.links": "document_links linked_editing",
    "navigation.moved_files": "rename_files",
    "navigation.outlines": "document_symbols workspace_symbols",
    "navigation.references": "highlights references",
    "navigation.renaming": "prepare_rename rename",
    "navigation.selection_ranges": "selection_ranges",
    "navigation.targets": "declaration definition implementation type_definition",
}
_HOME = {name: home for home, names in _HOMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'potto.ide' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"potto.ide.{_HOME[name]}"), name)
    return value
