"""The shapes of the protocol's values, as far as the server makes them: plain dictionaries that a type checker checks.

The messages of a session are JSON from end to end, so nothing is converted twice and nothing of this costs anything
when the server starts.
"""

from __future__ import annotations

from typing import Any, NotRequired, TypedDict


class Position(TypedDict):
    line: int
    character: int


class Range(TypedDict):
    start: Position
    end: Position


class Location(TypedDict):
    uri: str
    range: Range


class LocationLink(TypedDict):
    originSelectionRange: Range
    targetUri: str
    targetRange: Range
    targetSelectionRange: Range


class MarkupContent(TypedDict):
    kind: str
    value: str


class TextEdit(TypedDict):
    range: Range
    newText: str


class Command(TypedDict):
    title: str
    command: str
    arguments: NotRequired[list[Any]]


class RelatedInformation(TypedDict):
    location: Location
    message: str


class CodeDescription(TypedDict):
    href: str


class Diagnostic(TypedDict):
    range: Range
    severity: int
    code: NotRequired[str]
    codeDescription: NotRequired[CodeDescription]
    source: str
    message: str
    tags: NotRequired[list[int]]
    relatedInformation: NotRequired[list[RelatedInformation]]


class Hover(TypedDict):
    contents: MarkupContent
    range: Range


class CompletionItem(TypedDict, total=False):
    label: str
    labelDetails: dict[str, str]
    kind: int
    detail: str
    documentation: MarkupContent
    sortText: str
    filterText: str
    insertTextFormat: int
    textEdit: TextEdit
    additionalTextEdits: list[TextEdit]
    command: Command
    data: Any


class CompletionList(TypedDict):
    isIncomplete: bool
    items: list[CompletionItem]


class ParameterInformation(TypedDict):
    label: list[int]
    documentation: NotRequired[MarkupContent]


class SignatureInformation(TypedDict):
    label: str
    documentation: NotRequired[MarkupContent]
    parameters: list[ParameterInformation]
    activeParameter: NotRequired[int]


class SignatureHelp(TypedDict):
    signatures: list[SignatureInformation]
    activeSignature: int
    activeParameter: NotRequired[int]


class DocumentSymbol(TypedDict):
    name: str
    detail: str
    kind: int
    range: Range
    selectionRange: Range
    children: list[DocumentSymbol]


class SymbolInformation(TypedDict):
    name: str
    kind: int
    location: Location
    containerName: NotRequired[str]


class DocumentHighlight(TypedDict):
    range: Range
    kind: int


class CallHierarchyItem(TypedDict):
    name: str
    kind: int
    detail: str
    uri: str
    range: Range
    selectionRange: Range
    data: list[str]


class CodeAction(TypedDict):
    title: str
    kind: str
    diagnostics: NotRequired[list[Any]]
    isPreferred: NotRequired[bool]
    disabled: NotRequired[dict[str, str]]
    edit: NotRequired[WorkspaceEdit]
    command: NotRequired[Command]
    data: NotRequired[Any]


class WorkspaceEdit(TypedDict, total=False):
    changes: dict[str, list[TextEdit]]
    documentChanges: list[Any]


class CodeLens(TypedDict):
    range: Range
    command: NotRequired[Command]
    data: NotRequired[Any]


class InlayHint(TypedDict):
    position: Position
    label: str
    kind: NotRequired[int]
    tooltip: NotRequired[MarkupContent]
    textEdits: NotRequired[list[TextEdit]]
    paddingLeft: NotRequired[bool]
    paddingRight: NotRequired[bool]
    data: NotRequired[Any]


class FoldingRange(TypedDict):
    startLine: int
    endLine: int
    kind: NotRequired[str]


class SelectionRange(TypedDict):
    range: Range
    parent: NotRequired[SelectionRange]


class DocumentLink(TypedDict):
    range: Range
    target: str
    tooltip: str
