"""Conversions between a client's URIs and the keys of the database.

A key is a normalized absolute path. For what is not on a disk (`untitled:Untitled-1`) it is the URI in angle brackets.
"""

from __future__ import annotations

import os
import re
from urllib.parse import quote, unquote, urlsplit

_DRIVE = re.compile(r"^/[A-Za-z]:")


def to_key(uri: str) -> str:
    """The key for a URI."""
    try:
        parts = urlsplit(uri)
    except ValueError:  # a broken address in brackets
        return f"<{uri}>"
    if parts.scheme != "file":
        return f"<{uri}>"
    path = unquote(parts.path)
    if os.name == "nt":
        if parts.netloc:
            path = f"//{parts.netloc}{path}"
        elif _DRIVE.match(path):
            path = path[1].upper() + path[2:]
    return os.path.abspath(path) if path and "\0" not in path else f"<{uri}>"


def to_uri(key: str) -> str:
    """A URI for a key, as we write it; a client may write the same one differently."""
    if key.startswith("<"):
        return key[1:-1]
    path = key.replace(os.sep, "/")
    if not path.startswith("/"):
        path = "/" + path
    return "file://" + quote(path, safe="/~!$&'()*+,;=@-._")
