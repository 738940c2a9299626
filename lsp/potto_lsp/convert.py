"""Conversions between offsets and positions, and from values of Potto to those of the protocol.

Owns every conversion that more than one feature needs. Nothing behind it knows UTF-16.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from potto_lsp import protocol
from potto_lsp.text import DocumentText

if TYPE_CHECKING:
    from potto.diagnostics import Diagnostic, Related
    from potto.ide import Change, Edit, FileEdits, FileRename
    from potto.ide import Location as Place
    from potto.reports.render import Located
    from potto.source import Span
    from potto_lsp.analysis import Analysis
    from potto_lsp.client import Client

SEVERITIES = {"error": 1, "warning": 2, "info": 3, "hint": 4}
TAGS = {"unnecessary": 1, "deprecated": 2}


def position(text: DocumentText, offset: int) -> protocol.Position:
    """A position of a text."""
    line, character = text.position(offset)
    return {"line": line, "character": character}


def range_of(text: DocumentText, span: Span) -> protocol.Range:
    """A range of a text."""
    return {"start": position(text, span.start), "end": position(text, span.end)}


def location(analysis: Analysis, file: str, span: Span) -> protocol.Location:
    """A range of a file."""
    return {"uri": analysis.uri(file), "range": range_of(analysis.text(file), span)}


def place(analysis: Analysis, found: Place) -> protocol.Location:
    """A place to go to."""
    return location(analysis, found.file, found.span)


def markdown(text: str) -> protocol.MarkupContent:
    """A text in markdown."""
    return {"kind": "markdown", "value": text}


def markup(client: Client, capability: str, text: str) -> protocol.MarkupContent:
    """A text in markdown, or as plain text for clients that say they show no markdown."""
    formats = client.value(capability)
    if not isinstance(formats, list) or "markdown" in formats or not formats:
        return markdown(text)
    return {"kind": "plaintext", "value": plain(text)}


def plain(text: str) -> str:
    """Our markdown without its markup."""
    lines = [line for line in text.splitlines() if not line.startswith("```")]
    unmarked = (re.sub(r"^\*([^*].*)\*$", r"\1", line.replace("**", "").replace("`", "")) for line in lines)
    return "\n".join("" if line == "---" else line for line in unmarked)


def text_edits(text: DocumentText, edits: Iterable[Edit]) -> list[protocol.TextEdit]:
    """Edits of one text."""
    return [{"range": range_of(text, edit.span), "newText": edit.text} for edit in edits]


def workspace_edit(analysis: Analysis, client: Client, change: Change) -> protocol.WorkspaceEdit:
    """A change of the workspace, with versions if the client understands them."""
    if not client.can("workspace.workspaceEdit.documentChanges"):
        return {"changes": {analysis.uri(f.file): text_edits(analysis.text(f.file), f.edits) for f in change.files}}
    changes: list[Any] = [_document_edit(analysis, edits) for edits in change.files]
    if client.lists("workspace.workspaceEdit.resourceOperations", "rename"):
        changes += [_file_rename(analysis, rename) for rename in change.renames]
    return {"documentChanges": changes}


def _document_edit(analysis: Analysis, edits: FileEdits) -> dict[str, Any]:
    document = analysis.document(edits.file)
    version = None if document is None else document.version
    return {
        "textDocument": {"uri": analysis.uri(edits.file), "version": version},
        "edits": text_edits(analysis.text(edits.file), edits.edits),
    }


def _file_rename(analysis: Analysis, rename: FileRename) -> dict[str, Any]:
    from potto_lsp.uris import to_uri

    return {"kind": "rename", "oldUri": analysis.uri(rename.old), "newUri": to_uri(rename.new)}


# Diagnostics


def diagnostics(
    analysis: Analysis, client: Client, found: Iterable[Located], file: str, text: DocumentText
) -> list[protocol.Diagnostic]:
    """What there is to say about a file with this text."""
    return [_diagnostic(analysis, client, located.diagnostic, file, text) for located in found]


def _diagnostic(
    analysis: Analysis, client: Client, said: Diagnostic, file: str, text: DocumentText
) -> protocol.Diagnostic:
    ways = ("textDocument.publishDiagnostics", "textDocument.diagnostic")
    tells = any(client.can(f"{way}.relatedInformation") for way in ways)
    result: protocol.Diagnostic = {
        "range": range_of(text, said.span),
        "severity": SEVERITIES[said.severity],
        "code": said.code,
        "source": "potto",
        "message": _message(said, () if tells else said.related),
    }
    if (page := page_uri(said.code)) is not None:
        result["codeDescription"] = {"href": page}
    if said.tags:
        result["tags"] = [TAGS[tag] for tag in said.tags]
    if tells and said.related:
        result["relatedInformation"] = [_related(analysis, related, file) for related in said.related]
    return result


def _related(analysis: Analysis, related: Related, file: str) -> protocol.RelatedInformation:
    return {"location": location(analysis, related.file or file, related.span), "message": related.message}


def _message(said: Diagnostic, related: Sequence[Related]) -> str:
    lines = [said.message]
    if said.label and said.label not in said.message:
        lines[0] += f" ({said.label})"
    lines += [f"note: {other.message}" for other in related]
    lines += [f"note: {note}" for note in said.notes]
    if said.help:
        lines.append(f"help: {said.help}")
    return "\n".join(lines)


_pages: dict[str, str | None] = {}


def page_uri(code: str) -> str | None:
    """Where the page of a diagnostic is."""
    if code not in _pages:
        from potto.reports.pages import folder

        home = folder()
        path = None if home is None else home / f"{code}.md"
        _pages[code] = path.as_uri() if path is not None and path.is_file() else None
    return _pages[code]
