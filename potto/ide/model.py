"""What the features of an editor answer with: plain values in offsets and strings.

Owns the data classes that cross the border of `potto.ide`. All spans are absolute in their file and count code points;
files are the keys of the database. Texts for people are markdown. Nothing here knows a protocol.
"""

from __future__ import annotations

from typing import Literal

from msgspec import Struct

from potto.source import Span

# Places and changes


class Location(Struct, frozen=True):
    """A place to go to. `span` is what to select, `full` the whole definition around it."""

    file: str
    span: Span
    full: Span


class Links(Struct, frozen=True):
    """Where one may go from `origin`, the word under the cursor."""

    origin: Span
    targets: tuple[Location, ...]


class Edit(Struct, frozen=True):
    """Put `text` in the place of `span`; edits of one file do not overlap and are in order."""

    span: Span
    text: str


class FileEdits(Struct, frozen=True):
    """The edits of one file, in order."""

    file: str
    edits: tuple[Edit, ...]


class FileRename(Struct, frozen=True):
    """A file that moves, after its edits were made."""

    old: str
    new: str


class Change(Struct, frozen=True):
    """A change of the workspace: edits first, then moves of files."""

    files: tuple[FileEdits, ...]
    renames: tuple[FileRename, ...] = ()


class Refused(Struct, frozen=True):
    """Why something that was asked for is not done, for the user to read."""

    message: str


# Hover, completion, signatures


class Hover(Struct, frozen=True):
    """What to show about the word at `span`."""

    span: Span
    markdown: str


CompletionKind = Literal[
    "variable", "parameter", "constant", "function", "diffeo", "module", "keyword", "snippet", "builtin", "measure",
    "symbol", "argument", "type", "command", "field", "record", "file",
]  # fmt: skip


class Completion(Struct, frozen=True):
    """One proposal. It replaces `span` by `insert` (with `$1`, `${2:name}`, `$0` in it if `snippet`).

    `sort` orders proposals; `filter` is what is matched against the typed word. `detail` and `documentation` may be
    empty until `resolve_completion` was asked. `edits` go with it elsewhere in the file (an import). `data` says what
    to resolve: strings alone, so that it can go through a protocol and back.
    """

    label: str
    kind: CompletionKind
    span: Span
    insert: str
    sort: str
    filter: str = ""
    snippet: bool = False
    detail: str = ""
    description: str = ""
    documentation: str = ""
    edits: tuple[Edit, ...] = ()
    data: tuple[str, ...] = ()
    retrigger: bool = False


class Completions(Struct, frozen=True):
    """Proposals for the word at `span`. `incomplete`: ask again as more is typed."""

    span: Span
    items: tuple[Completion, ...]
    incomplete: bool = False


class ParameterText(Struct, frozen=True):
    """One parameter: its place in the signature's label, and what there is to say about it."""

    span: Span
    documentation: str = ""


class Signature(Struct, frozen=True):
    """A function's signature; `active` is the parameter that is being filled, or None."""

    label: str
    documentation: str
    parameters: tuple[ParameterText, ...]
    active: int | None


class SignatureHelp(Struct, frozen=True):
    """The signatures of the call at hand, one for each group of parameters; `active` is the group being filled."""

    signatures: tuple[Signature, ...]
    active: int


# Symbols, highlights, hierarchies

SymbolKind = Literal[
    "function", "constant", "diffeo", "module", "variable", "parameter", "local", "statement", "record", "field",
]  # fmt: skip


class DocumentSymbol(Struct, frozen=True):
    """A definition (or a local name in one) for an outline."""

    name: str
    detail: str
    kind: SymbolKind
    span: Span
    selection: Span
    children: tuple[DocumentSymbol, ...] = ()


class WorkspaceSymbol(Struct, frozen=True):
    """A definition anywhere in the workspace; `container` is its module."""

    name: str
    kind: SymbolKind
    container: str
    location: Location


class Highlight(Struct, frozen=True):
    """An occurrence of the name at hand in this file."""

    span: Span
    kind: Literal["read", "write", "text"]


class CallItem(Struct, frozen=True):
    """A definition in a hierarchy of calls; `data` is `(file, name)`."""

    name: str
    detail: str
    kind: SymbolKind
    location: Location
    data: tuple[str, str]


class HierarchyCall(Struct, frozen=True):
    """Who calls or is called, and the places of the calls (in the caller's file)."""

    item: CallItem
    spans: tuple[Span, ...]


class Renaming(Struct, frozen=True):
    """What a rename would change: the word and the text to start from."""

    span: Span
    placeholder: str


# Actions, lenses, hints, tokens

ActionKind = Literal[
    "quickfix", "refactor.extract", "refactor.inline", "refactor.rewrite", "source.organizeImports", "source.fixAll",
]  # fmt: skip


class CodeAction(Struct, frozen=True):
    """Something that can be done here.

    `change` is None until `resolve_code_action` was asked. `codes` are those of the diagnostics that it fixes, `spans`
    their places. `preferred`: the obvious choice. `disabled` says why it can't be done. `rename_at`: start a rename
    there after the change.
    """

    title: str
    kind: ActionKind
    change: Change | None = None
    codes: tuple[str, ...] = ()
    spans: tuple[Span, ...] = ()
    preferred: bool = False
    disabled: str = ""
    rename_at: int | None = None
    data: tuple[str, ...] = ()


class CodeLens(Struct, frozen=True):
    """A line above a definition that can be clicked. `command` is run with `arguments`; no title: ask to resolve."""

    span: Span
    command: Literal["value", "more", "run"]
    arguments: tuple[str, ...]
    title: str = ""


class Offer(Struct, frozen=True):
    """Something that can be done with a definition: a command, what it is called, and its arguments."""

    command: Literal["evaluate", "differentiate", "showDerivative", "showReferences"]
    title: str
    arguments: tuple[str, ...]


class InlayHint(Struct, frozen=True):
    """A text that is shown but not written. `edits` would write it. `tooltip` may come with `resolve_inlay_hint`."""

    offset: int
    label: str
    kind: Literal["type", "parameter"]
    pad_left: bool = False
    pad_right: bool = False
    tooltip: str = ""
    edits: tuple[Edit, ...] = ()
    data: tuple[str, ...] = ()


TOKEN_TYPES = (
    "namespace", "type", "parameter", "variable", "property", "function", "keyword", "comment", "number", "operator",
    "macro",
)  # fmt: skip
TOKEN_MODIFIERS = (
    "declaration", "definition", "readonly", "defaultLibrary", "integration", "plain", "diffeo", "documentation",
)  # fmt: skip


class SemanticToken(Struct, frozen=True):
    """A coloured word: a type from `TOKEN_TYPES` and modifiers from `TOKEN_MODIFIERS`. It never crosses the end of a
    line."""

    span: Span
    type: str
    modifiers: tuple[str, ...] = ()


# The rest


class Foldable(Struct, frozen=True):
    """Something to fold, from the end of its first line to the end of `span`."""

    span: Span
    kind: Literal["region", "comment", "imports"]


class DocumentLink(Struct, frozen=True):
    """The module of an import, and the file that it means."""

    span: Span
    target: str
    tooltip: str


class InlineValue(Struct, frozen=True):
    """A text to show at the end of a line, or an expression for an evaluator to show there."""

    span: Span
    text: str
    kind: Literal["text", "expression"]
