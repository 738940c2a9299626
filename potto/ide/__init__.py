"""Editor features as pure questions in offsets and strings.

Owns what an editor may ask; one module a feature. Knows neither a protocol nor numbers: `potto_lsp` translates. Every
question takes the database first and answers also on broken text.
"""

from potto.ide.acting import code_actions, resolve_code_action
from potto.ide.calling import incoming_calls, outgoing_calls, prepare_call_hierarchy
from potto.ide.colours import semantic_tokens
from potto.ide.completing import completions, completions_after, resolve_completion
from potto.ide.documents import kind_of
from potto.ide.explaining import derivative_markdown, diffeo_markdown
from potto.ide.explaining import sound as is_sound
from potto.ide.finding import highlights, references
from potto.ide.folds import folding_ranges
from potto.ide.formatting import format_document, format_on_type, format_range
from potto.ide.hints import inlay_hints, resolve_inlay_hint
from potto.ide.hovers import hover
from potto.ide.lenses import code_lenses, resolve_code_lens
from potto.ide.linking import document_links, linked_editing
from potto.ide.living import live_diagnostics, live_in
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
    Fold,
    Highlight,
    Hover,
    InlayHint,
    InlineValue,
    Links,
    Location,
    ParameterText,
    Refused,
    Renaming,
    SemanticToken,
    Signature,
    SignatureHelp,
    WorkspaceSymbol,
)
from potto.ide.moving import rename_files
from potto.ide.outlines import document_symbols, workspace_symbols
from potto.ide.points import Point, point_of, points
from potto.ide.renaming import prepare_rename, rename
from potto.ide.scenes import Scene, SceneParameter, scene, scenes
from potto.ide.selecting import selection_ranges
from potto.ide.signatures import signature_help
from potto.ide.symbols import definition_at
from potto.ide.targets import declaration, definition, implementation, type_definition
from potto.ide.values import inline_values

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
    "Fold",
    "Highlight",
    "Hover",
    "InlayHint",
    "InlineValue",
    "Links",
    "Location",
    "ParameterText",
    "Point",
    "Refused",
    "Renaming",
    "Scene",
    "SceneParameter",
    "SemanticToken",
    "Signature",
    "SignatureHelp",
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
    "workspace_symbols",
]
