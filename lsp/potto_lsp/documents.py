"""The open documents: their texts as the client has them, version by version.

Owns `Document` (immutable) and `Documents`. Only the reading thread changes them; any thread may hold one.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

from msgspec import Struct

from potto_lsp.failures import InvalidParams
from potto_lsp.text import DocumentText, Encoding

logger = logging.getLogger(__name__)


class Document(Struct, frozen=True):
    """One version of an open document."""

    uri: str
    language: str
    version: int | None
    text: DocumentText


class Documents:
    """What is open now, by URI."""

    def __init__(self) -> None:
        self.encoding: Encoding = "utf-16"
        self._open: dict[str, Document] = {}

    def get(self, uri: str) -> Document | None:
        """The present version of a document, if it is open."""
        return self._open.get(uri)

    def all(self) -> tuple[Document, ...]:
        """All that are open."""
        return tuple(self._open.values())

    def open(self, params: Mapping[str, Any]) -> Document:
        """`textDocument/didOpen`. A document that is already open is replaced."""
        item = params["textDocument"]
        uri, text = item["uri"], item["text"]
        if not isinstance(uri, str) or not isinstance(text, str):
            raise InvalidParams("a document has a URI and a text")
        document = Document(uri, str(item.get("languageId", "")), _version(item), DocumentText(text, self.encoding))
        self._open[uri] = document
        return document

    def change(self, params: Mapping[str, Any]) -> Document | None:
        """`textDocument/didChange`. None if the change is out of date, or if the document is not open."""
        uri, version = params["textDocument"]["uri"], _version(params["textDocument"])
        document = self._open.get(uri)
        if document is None:
            logger.warning("a change of a document that is not open: %s", uri)
            return None
        if version is not None and document.version is not None and version < document.version:
            logger.warning("version %s of %s comes after version %s", version, uri, document.version)
            return None
        text = document.text
        for change in params["contentChanges"]:
            text = _changed(text, change)
        if version is None:
            version = document.version
        changed = Document(uri, document.language, version, text)
        self._open[uri] = changed
        return changed

    def close(self, params: Mapping[str, Any]) -> Document | None:
        """`textDocument/didClose`. None if it was not open."""
        return self._open.pop(params["textDocument"]["uri"], None)


def _version(item: Mapping[str, Any]) -> int | None:
    version = item.get("version")
    return version if isinstance(version, int) else None


def _changed(text: DocumentText, change: Mapping[str, Any]) -> DocumentText:
    inserted = change["text"]
    if not isinstance(inserted, str):
        raise InvalidParams("a change has a text")
    where = change.get("range")
    if where is None:
        return DocumentText(inserted, text.encoding)
    start, end = where["start"], where["end"]
    return text.replaced(
        text.offset(start["line"], start["character"]), text.offset(end["line"], end["character"]), inserted
    )
