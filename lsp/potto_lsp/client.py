"""What the client says about itself in its greeting: capabilities, folders, encoding.

Owns `Client`, which never fails: whatever is missing or malformed counts as not supported.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from potto_lsp.text import ENCODINGS, Encoding


@dataclass(frozen=True)
class Client:
    """The parameters of `initialize`."""

    params: Mapping[str, Any] = field(default_factory=dict)

    def can(self, path: str) -> bool:
        """Whether a capability such as `textDocument.diagnostic` is there and not false."""
        found = self.value(path)
        return found is not None and found is not False

    def value(self, path: str) -> Any:
        """A capability, or None."""
        found: Any = self.params.get("capabilities")
        for part in path.split("."):
            if not isinstance(found, Mapping):
                return None
            found = found.get(part)
        return found

    def lists(self, path: str, value: object) -> bool:
        """Whether a capability is a list with a value in it."""
        found = self.value(path)
        return isinstance(found, list) and value in found

    @property
    def encoding(self) -> Encoding:
        """The first of the client's encodings of positions that we know; UTF-16 if it offers none."""
        offered = self.value("general.positionEncodings")
        for encoding in offered if isinstance(offered, list) else ():
            if encoding in ENCODINGS:
                known: Encoding = encoding
                return known
        return "utf-16"

    @property
    def folders(self) -> list[str]:
        """The URIs of the workspace's folders."""
        folders = self.params.get("workspaceFolders")
        if isinstance(folders, list):
            found = [folder.get("uri") for folder in folders if isinstance(folder, Mapping)]
            return [uri for uri in found if isinstance(uri, str)]
        uri, path = self.params.get("rootUri"), self.params.get("rootPath")
        if isinstance(uri, str):
            return [uri]
        if isinstance(path, str) and path:
            from potto_lsp.uris import to_uri

            return [to_uri(path)]
        return []

    @property
    def process(self) -> int | None:
        """The client's process; the server ends with it."""
        found = self.params.get("processId")
        return found if isinstance(found, int) and not isinstance(found, bool) and found > 0 else None

    @property
    def options(self) -> Mapping[str, Any]:
        """Settings that come with the greeting."""
        found = self.params.get("initializationOptions")
        return found if isinstance(found, Mapping) else {}

    @property
    def presents(self) -> bool:
        """Whether the client has Potto commands of its own, and so shows the answers of ours by itself."""
        found = self.value("experimental.commands.commands")
        return isinstance(found, list) and any(str(name).startswith("potto.") for name in found)

    @property
    def pulls(self) -> bool:
        """Whether the client asks for diagnostics itself; then none are pushed."""
        return self.can("textDocument.diagnostic")
