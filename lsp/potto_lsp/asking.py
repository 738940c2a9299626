"""A request as a feature sees it: the database, the file, and what was asked, in offsets.

Owns `Ask`. Its properties read the parameters and raise `InvalidParams` where they are malformed, so that an adapter
is convert, ask, convert.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from potto.source import Span
from potto_lsp import convert, protocol
from potto_lsp.failures import InvalidParams
from potto_lsp.uris import to_key

if TYPE_CHECKING:
    from potto.query import Database
    from potto_lsp.analysis import Analysis
    from potto_lsp.client import Client
    from potto_lsp.documents import Document
    from potto_lsp.session import ClientSession
    from potto_lsp.text import DocumentText


def uri_of(params: Any) -> str | None:
    """The URI of the document that parameters are about, if any."""
    item = params.get("textDocument") if isinstance(params, Mapping) else None
    uri = item.get("uri") if isinstance(item, Mapping) else None
    return uri if isinstance(uri, str) else None


def about(params: Any) -> str | None:
    """The URI of any document that parameters name, including items to resolve and arguments of commands."""
    found = uri_of(params)
    if found is not None or not isinstance(params, Mapping):
        return found
    data, item, arguments = params.get("data"), params.get("item"), params.get("arguments")
    places = [each.get("uri") for each in (data, item) if isinstance(each, Mapping)]
    places += arguments[:1] if isinstance(arguments, list) else []
    return next((uri for uri in places if isinstance(uri, str)), None)


class Ask(Struct, dict=True):
    """One request."""

    session: ClientSession
    params: Any

    @property
    def analysis(self) -> Analysis:
        return self.session.analysis

    @property
    def db(self) -> Database:
        return self.session.analysis.db

    @property
    def client(self) -> Client:
        return self.session.client

    @property
    def uri(self) -> str:
        uri = uri_of(self.params)
        if uri is None:
            raise InvalidParams("`textDocument.uri` is missing")
        return uri

    @cached_property
    def file(self) -> str:
        return to_key(self.uri)

    @property
    def document(self) -> Document | None:
        return self.analysis.document(self.file)

    @property
    def text(self) -> DocumentText:
        return self.analysis.text(self.file)

    @property
    def offset(self) -> int:
        """`position`"""
        return self._offset(self.get("position"))

    @property
    def span(self) -> Span:
        """`range`"""
        return self.to_span(self.get("range"))

    def to_span(self, written: Any) -> Span:
        """A range of the document."""
        if not isinstance(written, Mapping):
            raise InvalidParams("a range has a start and an end")
        start, end = self._offset(written.get("start")), self._offset(written.get("end"))
        return Span(min(start, end), max(start, end))

    def offsets(self, name: str) -> list[int]:
        """A list of positions."""
        return [self._offset(written) for written in self.items(name)]

    def _offset(self, written: Any) -> int:
        line = written.get("line") if isinstance(written, Mapping) else None
        character = written.get("character") if isinstance(written, Mapping) else None
        if not isinstance(line, int) or not isinstance(character, int) or line < 0 or character < 0:
            raise InvalidParams("a position has a line and a character, which are not negative")
        return self.text.offset(line, character)

    def get(self, name: str) -> Any:
        """A required parameter."""
        if not isinstance(self.params, Mapping) or self.params.get(name) is None:
            raise InvalidParams(f"`{name}` is missing")
        return self.params[name]

    def optional(self, *path: str) -> Any:
        """An optional parameter; None if it is missing."""
        found = self.params
        for name in path:
            found = found.get(name) if isinstance(found, Mapping) else None
        return found

    def string(self, name: str) -> str:
        """A parameter that is a string."""
        found = self.get(name)
        if not isinstance(found, str):
            raise InvalidParams(f"`{name}` is a string")
        return found

    def items(self, name: str) -> list[Any]:
        """A parameter that is a list."""
        found = self.get(name)
        if not isinstance(found, list):
            raise InvalidParams(f"`{name}` is a list")
        return found

    def range(self, span: Span) -> protocol.Range:
        """A span of the document as a range. Answers about whole files convert thousands, so this is a point at which
        they can be cancelled."""
        self.db.give_way()
        return convert.range_of(self.text, span)

    def position(self, offset: int) -> protocol.Position:
        """An offset of the document as a position, likewise."""
        self.db.give_way()
        return convert.position(self.text, offset)
