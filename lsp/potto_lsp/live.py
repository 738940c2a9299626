"""The values of live expressions (`#> e`), kept until what they mean changes.

Owns `LiveValues`. Evaluated is only what an editor shows: the files for which inlay hints were asked. A value is known
by the digests of all that its expression reaches, so that an edit elsewhere evaluates nothing.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from potto.core.terms import Global, Term, postorder
from potto.elaborate import core, elaborate_expression
from potto.query import Database, query
from potto.syntax import live_expressions, parse_expression
from potto_lsp.evaluation import Task

if TYPE_CHECKING:
    from potto.syntax.live import Live
    from potto_lsp.session import Session

Key = tuple[str, str, str | None, bytes]
MOST = 200  # live expressions of one file that are evaluated


@query
def globals_of(db: Database, file: str, name: str) -> tuple[bytes, tuple[tuple[str, str], ...]]:
    """The digest of a definition's term, and the definitions that it names."""
    return _reached(core(db, file, name).term)


def _reached(term: Term) -> tuple[bytes, tuple[tuple[str, str], ...]]:
    return term.digest, tuple((node.module, node.name) for node in postorder(term) if isinstance(node, Global))


def fingerprint(db: Database, file: str, text: str) -> bytes:
    """What the value of an expression depends on."""
    digest, reached = _reached(elaborate_expression(db, file, parse_expression(text).expr).term)
    whole, seen, todo = hashlib.blake2b(digest, digest_size=16), set(reached), list(reached)
    for target in todo:
        digest, reached = globals_of(db, *target)
        whole.update(digest)
        todo += [other for other in reached if other not in seen]
        seen.update(reached)
    return whole.digest()


@dataclass(frozen=True, slots=True)
class Value:
    """What is known of a live expression: an answer of the evaluation process."""

    answer: Mapping[str, Any]

    @property
    def label(self) -> str:
        result = self.answer.get("result")
        if result is None:
            return "= ?"
        if result["holds"] is False:
            return f"= {result['text']}, not {result['expected']}"
        return f"= {result['text']}"

    @property
    def tooltip(self) -> str:
        result = self.answer.get("result")
        if result is None:
            return f"```text\n{self.answer.get('error', '')}\n```"
        error = f"error at most {result['error']}" if "error" in result else ""
        held = {True: "as expected", False: "not as expected", None: ""}[result["holds"]]
        return "; ".join(part for part in (error, held) if part)


class LiveValues:
    """What the live expressions of the shown files give. For the thread that owns the database."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._values: dict[Key, Value] = {}
        self._waiting: dict[Key, Task] = {}
        self._shown: set[str] = set()

    def values(self, file: str) -> list[tuple[Live, Value | None]]:
        """The live expressions of a file with the values that are known; they are evaluated from now on."""
        found = [(live, self._values.get(key)) for live, key in self._keys(file)]
        if found and file not in self._shown:
            self._shown.add(file)
            self.refresh()
        return found

    def _keys(self, file: str) -> list[tuple[Live, Key]]:
        text = self._session.analysis.text(file).text
        if "#>" not in text:
            return []
        db = self._session.analysis.db
        return [
            (live, (file, live.text, live.expected, fingerprint(db, file, live.text)))
            for live in live_expressions(text)[:MOST]
        ]

    def refresh(self) -> None:
        """Evaluate what is shown and not known; forget what nobody shows any more."""
        analysis = self._session.analysis
        if analysis.settings.get("live.enabled") is False:
            return
        self._shown &= set(analysis.documents)
        wanted = {key for file in self._shown for _, key in self._keys(file)}
        for key in [key for key in self._waiting if key not in wanted]:
            self._waiting.pop(key).cancelled.set()
        self._values = {key: value for key, value in self._values.items() if key in wanted}
        for key in wanted - self._values.keys() - self._waiting.keys():
            self._waiting[key] = self._evaluate(key)

    def _evaluate(self, key: Key) -> Task:
        file, text, expected, _ = key

        def done(answer: Mapping[str, Any]) -> None:
            self._session.later(lambda: self._arrived(key, answer))

        return self._session.evaluator.put(Task("live", file, text, done, {"expected": expected}))

    def _arrived(self, key: Key, answer: Mapping[str, Any]) -> None:
        if self._waiting.pop(key, None) is None:
            return
        self._values[key] = Value(answer)
        if not self._waiting and self._session.client.can("workspace.inlayHint.refreshSupport"):
            self._session.request("workspace/inlayHint/refresh", None, None)
