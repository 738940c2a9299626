"""Editor features as pure questions in offsets and strings.

Owns what an editor may ask; one module a feature. Knows neither a protocol nor numbers: `potto_lsp` translates. Every
question takes the database first and answers also on broken text.
"""

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
from potto.ide.hover.derivatives import derivative_markdown, diffeo_markdown
from potto.ide.hover.derivatives import sound as is_sound
from potto.ide.hover.hovers import hover
from potto.ide.model import (
    TOKEN_MODIFIERS,
    TOKEN_TYPES,
    Call,
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
from potto.ide.names.documents import kind_of
from potto.ide.names.live_expressions import live_diagnostics, live_in
from potto.ide.names.points import Point, looked_at, point_of, points
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
    "Call",
    "CallItem",
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
    "Highlight",
    "Hover",
    "InlayHint",
    "InlineValue",
    "Links",
    "Location",
    "Offer",
    "ParameterText",
    "Point",
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
    "hover",
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
