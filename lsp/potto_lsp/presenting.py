"""Answers of commands, shown by the server for clients that drop them.

Owns `Presenter`. A short text becomes a message, a longer one a read-only document, a picture a file for its viewer. A
client with commands of its own (`potto.…`, see `Client.presents`) shows all of this better and is left alone.
"""

from __future__ import annotations

import base64
import os
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from potto_lsp.connection import Connection

SHORT = 2  # lines that are a message
INFO = 3


class Presenter:
    """Messages and documents for a client."""

    def __init__(self, session: Connection) -> None:
        self._session = session
        self._folder: str | None = None

    def present(self, title: str, result: Mapping[str, Any]) -> None:
        """Show the answer of a command. The title becomes the name of the document."""
        client = self._session.client
        if client.presents:
            return
        text, image = str(result.get("text", "")), result.get("image")
        can_open = client.can("window.showDocument.support")
        if isinstance(image, str) and can_open:
            self._open(f"{title}.png", base64.b64decode(image.partition(",")[2]), external=True)
        elif text.count("\n") >= SHORT and can_open:
            self._open(f"{title}.txt", (text + "\n").encode(), external=False)
        elif text:
            self._session.notify("window/showMessage", {"type": INFO, "message": text})

    def _open(self, name: str, data: bytes, external: bool) -> None:
        import tempfile  # with pathlib and shutil a hundredth of what opening a file takes, and seldom needed
        from pathlib import Path

        if self._folder is None:
            self._folder = tempfile.mkdtemp(prefix="potto-")
        path = Path(self._folder, re.sub(r"[^\w.-]+", "_", name))
        if path.exists():
            path.chmod(0o600)
        path.write_bytes(data)
        path.chmod(0o400)  # there is nothing to be edited in it
        params = {"uri": path.as_uri(), "external": external, "takeFocus": True}
        self._session.request("window/showDocument", params, None)

    def close(self) -> None:
        """Remove the files."""
        if self._folder is not None and os.path.isdir(self._folder):
            import shutil

            shutil.rmtree(self._folder, ignore_errors=True)
