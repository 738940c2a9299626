"""What was said about a file in an earlier session, kept on disk, and whether it still holds.

Owns `Verdicts`. With the diagnostics of a file all is kept that they were found from: which texts, folders and roots
the checks have read, as digests. They hold as long as every one of those is the same, whatever else has changed; so an
opened file is told of before anything is checked. What is on disk is plain JSON, in a folder of the user's own that
carries a digest of this program: another version of it finds nothing. What cannot be read, is not whole or belongs to
somebody else counts as not there.
"""

from __future__ import annotations

import json
import logging
import os
import re
import stat
import sys
import tempfile
from collections.abc import Hashable, Iterator, Mapping
from pathlib import Path
from typing import Any

from potto import store
from potto.diagnostics import Diagnostic, Related, Replacement, Suggestion
from potto.digests import blake2b
from potto.modules.texts import content
from potto.query import Database
from potto.reports.render import Located
from potto.source import Span

logger = logging.getLogger(__name__)
FOLDER = "checked-"
MOST_FILES = 500  # verdicts kept; the least recently used go first
MOST_READ = 5_000  # texts and folders that a verdict may rest on
MOST_BYTES = 4_000_000  # of one verdict

_CODE = re.compile(r"P\d{4}")
Reads = dict[str, str]  # what was read, and the digest of what it was


class Verdicts:
    """The verdicts of one database. For the thread that owns it."""

    def __init__(self, db: Database) -> None:
        self._db = db
        self._folder: Path | None = None
        self._kept: dict[str, tuple[Located, ...]] = {}

    def of(self, file: str) -> tuple[Located, ...] | None:
        """What was said about a file, if it still holds."""
        path = self._path(file)
        loaded = None if path is None else _load(path, file)
        if loaded is None:
            return None
        reads, found = loaded
        if not reads or any(self._digest(key) != digest for key, digest in reads.items()):
            return None
        self._kept[file] = found
        return found

    def keep(self, file: str, found: tuple[Located, ...], query: str) -> None:
        """Keep what the query of this name found out about a file."""
        path = self._path(file)
        if path is None or self._kept.get(file) is found:
            return
        keys = self._db.inputs_below(query, (file,))
        if keys is None or len(keys) > MOST_READ:
            return
        reads = {name: self._digest(name) for name in dict.fromkeys(map(_name, keys)) if name is not None}
        _store(path, {"file": file, "reads": reads, "found": [_plain(located) for located in found]})
        self._kept[file] = found

    def _path(self, file: str) -> Path | None:
        if self._folder is None:
            kept = store.cache_folder()
            if kept is None:
                return None
            self._folder = kept / f"{FOLDER}{program_digest()}"
        if not os.path.isabs(file) or not _is_ours(self._folder):
            return None
        return self._folder / f"{_hashed(file)}.json"

    def _digest(self, name: str) -> str:
        """The digest of what is read under a name now."""
        kind, _, path = name.partition(":")
        if kind == "text":
            return _hashed(content(self._db, path))
        key: Hashable = (kind, path) if path else (kind,)
        return _hashed(self._db.get_input(key))


def _name(key: Hashable) -> str | None:
    """How a verdict calls an input. An open file and the one on disk are one text."""
    match key:
        case ("file" | "overlay", str(path)):
            return f"text:{path}"
        case (str(kind), str(path)):
            return f"{kind}:{path}"
        case (str(kind),):
            return kind
    return None


def _hashed(value: object) -> str:
    return blake2b(repr(value).encode("utf-8", "surrogatepass"), digest_size=16).hexdigest()


def program_digest() -> str:
    """A digest of this program."""
    import potto
    import potto_lsp

    return store.digest_of((*potto.__path__, *potto_lsp.__path__)).hex()


def _is_ours(folder: Path) -> bool:
    """Whether only this user can have written into a folder. Makes it if it doesn't exist."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return False
    if not stat.S_ISDIR(status.st_mode):
        return False
    return sys.platform == "win32" or (status.st_uid == os.getuid() and not status.st_mode & 0o022)


def _load(path: Path, file: str) -> tuple[Reads, tuple[Located, ...]] | None:
    """The verdict in a file; None if it is missing or damaged."""
    try:
        if path.stat().st_size > MOST_BYTES:
            return None
        data = json.loads(path.read_bytes())
        reads = {str(name): str(digest) for name, digest in data["reads"].items()}
        found = tuple(_located(plain) for plain in data["found"])
        if data["file"] != file:
            return None
        os.utime(path)
        return reads, found
    except OSError:
        return None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        logger.info("the verdict %s cannot be read", path)
        return None


def _store(path: Path, data: Mapping[str, Any]) -> None:
    """Write a verdict in one step. If that fails, the next start takes longer, nothing else."""
    temporary = None
    try:
        body = json.dumps(data, separators=(",", ":")).encode()
        if len(body) > MOST_BYTES:
            return
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".verdict-")
        with os.fdopen(handle, "wb") as stream:
            stream.write(body)
        os.replace(temporary, path)
        temporary = None
        _trim(path.parent)
    except OSError:
        logger.info("the verdict %s cannot be written", path)
    finally:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)


def _trim(folder: Path) -> None:
    """Delete the oldest verdicts beyond the limit, and those of other versions of this program."""
    with os.scandir(folder) as listed:
        entries = [entry for entry in listed if entry.name.endswith(".json")]
    if len(entries) > MOST_FILES:
        for entry in sorted(entries, key=lambda entry: entry.stat().st_mtime)[: len(entries) - MOST_FILES]:
            Path(entry.path).unlink(missing_ok=True)
    for other in folder.parent.glob(f"{FOLDER}*"):
        if other != folder and other.is_dir() and not other.is_symlink():
            clear(other)


def clear(folder: Path) -> None:
    """Delete the verdicts of one version of this program."""
    try:
        for path in folder.glob("*.json"):
            path.unlink(missing_ok=True)
        folder.rmdir()
    except OSError:
        logger.info("%s cannot be deleted", folder)


# Diagnostics as plain data


def _plain(located: Located) -> dict[str, Any]:
    said = located.diagnostic
    return {
        "file": located.file, "code": said.code, "severity": said.severity, "message": said.message,
        "span": [said.span.start, said.span.end], "label": said.label, "notes": said.notes, "help": said.help,
        "tags": said.tags,
        "suggestions": [[s.title, [[e.span.start, e.span.end, e.text] for e in s.edits]] for s in said.suggestions],
        "related": [[r.span.start, r.span.end, r.message, r.file, r.owner] for r in said.related],
    }  # fmt: skip


def _located(plain: Mapping[str, Any]) -> Located:
    """The diagnostic in plain data. Raises ValueError, KeyError or TypeError if it is none."""
    code, severity = plain["code"], plain["severity"]
    if severity not in ("error", "warning", "info", "hint") or not _CODE.fullmatch(code):
        raise ValueError(f"there is no diagnostic {code} that is {severity}")
    tags = tuple(tag for tag in plain["tags"] if tag in ("unnecessary", "deprecated"))
    related = tuple(
        Related(_span(start, end), str(message), _optional(file), _optional(owner))
        for start, end, message, file, owner in plain["related"]
    )
    said = Diagnostic(
        code, severity, str(plain["message"]), _span(*plain["span"]), str(plain["label"]), related,
        tuple(map(str, plain["notes"])), str(plain["help"]), tags, tuple(_suggestions(plain["suggestions"])),
    )  # fmt: skip
    return Located(_optional(plain["file"]), said)


def _suggestions(plain: Any) -> Iterator[Suggestion]:
    for title, edits in plain:
        yield Suggestion(str(title), tuple(Replacement(_span(start, end), str(text)) for start, end, text in edits))


def _span(start: Any, end: Any) -> Span:
    if not (isinstance(start, int) and isinstance(end, int) and 0 <= start <= end):
        raise ValueError("no place in a text")
    return Span(start, end)


def _optional(value: Any) -> str | None:
    return None if value is None else str(value)
