"""The values of live expressions (`#> e`) and of the points at which definitions are looked at.

Owns `LiveValues`. Only what an editor shows is evaluated: the live expressions of files for which it asked for inlay
hints, and then a point of each of their definitions. A value is stored under the digests of everything that its
expression reaches, so an edit elsewhere evaluates nothing.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator, Mapping
from operator import is_
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from potto import ide
from potto.core.terms import Global, Term, postorder
from potto.diagnostics import Diagnostic
from potto.elaborate import core, elaborate_expression
from potto.ide.names.live_expressions import piece_lives
from potto.modules import names
from potto.modules.texts import groups_of_pieces
from potto.query import Database, query
from potto.reports.render import Located
from potto.source import Span
from potto.syntax import parse_expression
from potto_lsp.evaluation import LIVE, POINTS, EvaluationTask

if TYPE_CHECKING:
    from potto.syntax.live import Live
    from potto_lsp.connection import Connection

MOST = 200  # live expressions of one file that are evaluated
TOGETHER = 20  # definitions whose points are asked for together
MOST_ASKED = 50  # definitions of other files whose points are kept
PAUSE = 0.15  # seconds between two requests that make the client refresh its hints


@query
def globals_of(db: Database, file: str, name: str) -> tuple[bytes, tuple[tuple[str, str], ...]]:
    """The digest of a definition's term, and the definitions that it refers to."""
    return _reached(core(db, file, name).term)


def _reached(term: Term) -> tuple[bytes, tuple[tuple[str, str], ...]]:
    return term.digest, tuple((node.module, node.name) for node in postorder(term) if isinstance(node, Global))


@query(keep=4096)
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


class Key(Struct, frozen=True):
    """Something to evaluate. `meaning` is the digest of everything that it reaches."""

    do: str
    file: str
    text: str
    more: tuple[tuple[str, Any], ...]
    meaning: bytes


Keys = tuple[Key, ...]


@query
def live_keys(db: Database, file: str) -> Keys:
    """The first live expressions of a file."""
    found: list[Key] = []
    for group in groups_of_pieces(db, file):
        found += _group_keys(db, file, group)
        if len(found) >= MOST:
            break
    return tuple(found[:MOST])


@query(keep=512)
def _group_keys(db: Database, file: str, group: tuple[str, ...]) -> Keys:
    """Those of some pieces of the file."""
    return tuple(
        [
            Key("live", file, live.text, (("expected", live.expected),), fingerprint(db, file, live.text))
            for text in group
            for live in piece_lives(db, text)
        ]
    )


@query
def looked_at_keys(db: Database, file: str) -> Keys:
    """The points of the first definitions that a file's expressions look at."""
    targets = ide.looked_at(db, file)[:MOST]
    some = [targets[start : start + TOGETHER] for start in range(0, len(targets), TOGETHER)]
    return tuple([key for each in some for key in _some_point_keys(db, each)])


@query(keep=128)
def _some_point_keys(db: Database, targets: tuple[tuple[str, str], ...]) -> Keys:
    """The points of some definitions. Grouped, since all of them are asked for at every key."""
    return tuple([key for target in targets for key in point_keys(db, *target)])


@query
def point_keys(db: Database, file: str, name: str) -> Keys:
    """The points of a definition that somebody asked about."""
    return tuple([_point_key(db, file, point) for point in _asked_points(db, file, name)])


def _asked_points(db: Database, file: str, name: str) -> tuple[ide.CallPoint, ...]:
    if name not in names(db, file) or not ide.is_sound(db, file, name):
        return ()
    return tuple(point for point in ide.points(db, file, name) if not point.chosen)


def _point_key(db: Database, file: str, point: ide.CallPoint) -> Key:
    return Key("point", file, point.text, (("slopes", point.slopes),), fingerprint(db, file, point.text))


class Value(Struct, frozen=True):
    """What is known of a live expression: an answer of the evaluation process."""

    answer: Mapping[str, Any]

    @property
    def result(self) -> Mapping[str, Any]:
        found = self.answer.get("result")
        return found if isinstance(found, Mapping) else {}

    @property
    def label(self) -> str:
        text = self.result.get("shown", "?")
        return f"= {text}, not {self.result['expected']}" if self.result.get("holds") is False else f"= {text}"

    @property
    def tooltip(self) -> str:
        if not self.result or "tooltip" in self.result:
            return f"```text\n{self.result.get('tooltip') or self.answer.get('error', '')}\n```"
        error = f"error at most {self.result['error']}" if "±" in self.result.get("shown", "") else ""
        error = "exact" if self.result.get("exact") else error
        held = {True: "as expected", False: "not as expected", None: ""}[self.result["holds"]]
        return "; ".join(part for part in (error, held) if part)


def shown(point: ide.CallPoint, value: Value) -> str:
    """A point in markdown: the value and the slopes there, with error bars; nothing if there is no value."""
    if not value.result or value.result.get("error") is None:
        return ""
    lines = [f"- `{point.text}` = {value.result['shown']}"]
    lines += [f"    - by `{s['by']}`: {s['shown']}" for s in value.result["slopes"]]
    return "\n".join(lines)


class LiveValues:
    """The values of the expressions in shown files. For the thread that owns the database."""

    def __init__(self, session: Connection) -> None:
        self._session = session
        self._values: dict[Key, Value] = {}
        self._waiting: dict[Key, EvaluationTask] = {}
        self._seen: tuple[Keys, ...] = ()  # what was wanted when it was last looked at
        self._shown: set[str] = set()
        self._asked: dict[tuple[str, str], None] = {}
        self._wrong: set[str] = set()  # files in which something was to be said about a value
        self._told: dict[str, float] = {}

    # What is known

    def values(self, file: str) -> list[tuple[Live, Value | None]]:
        """The live expressions of a file, with the values known so far. From now on they are evaluated."""
        found = [(live, self._values.get(key)) for live, key in self._live(file)]
        if found and file not in self._shown:
            self._shown.add(file)
            self.refresh()
        return found

    @property
    def enabled(self) -> bool:
        """Whether anything is evaluated without being asked for."""
        return self._session.analysis.settings.get("live.enabled") is not False

    def at_points(self, file: str, name: str) -> list[tuple[ide.CallPoint, Value]]:
        """What is known of a definition at its points. From now on they are evaluated."""
        found = [(point, self._values.get(key)) for point, key in self._points(file, name)]
        if any(value is None for _, value in found) and (file, name) not in self._asked:
            self._asked[file, name] = None
            if len(self._asked) > MOST_ASKED:
                del self._asked[next(iter(self._asked))]
            self.refresh()
        return [(point, value) for point, value in found if value is not None]

    def diagnostics(self, file: str) -> tuple[Located, ...]:
        """What is wrong with the live expressions of an open file: what the checker found, and wrong values. A bug of
        ours loses these diagnostics only."""
        try:
            return self._diagnostics(file)
        except Exception as error:
            self._session.analysis.failed(file, "live expressions", error)
            return ()

    def _diagnostics(self, file: str) -> tuple[Located, ...]:
        analysis = self._session.analysis
        document = analysis.document(file)
        if document is None or "#>" not in document.text.text:
            return ()
        found = list(ide.live_diagnostics(analysis.db, file))
        if file in self._wrong:
            for live, value in ((live, self._values.get(key)) for live, key in self._live(file)):
                found += () if value is None else _said(live, value)
        return tuple(Located(file, said) for said in found)

    # What is to be known

    def _live(self, file: str) -> Iterator[tuple[Live, Key]]:
        if "#>" not in self._session.analysis.text(file).text:
            return iter(())
        db = self._session.analysis.db
        return zip(ide.live_in(db, file), live_keys(db, file))

    def _points(self, file: str, name: str) -> Iterator[tuple[ide.CallPoint, Key]]:
        db = self._session.analysis.db
        return zip(_asked_points(db, file, name), point_keys(db, file, name))

    def _wanted(self) -> tuple[Keys, ...]:
        """The live expressions of the shown files in the order of the text, then the points of their definitions and of
        those that were asked for. The same objects as before if nothing has changed."""
        db = self._session.analysis.db
        shown = [table(db, file) for table in (live_keys, looked_at_keys) for file in self._shown]
        return (*shown, *(point_keys(db, *each) for each in self._asked))

    def refresh(self) -> None:
        """Evaluate what is shown and not known yet; forget what is not shown any more."""
        if not self.enabled or not (self._shown or self._asked):
            return
        self._shown &= set(self._session.analysis.documents)
        wanted = self._wanted()
        if len(wanted) == len(self._seen) and all(map(is_, wanted, self._seen)):
            return
        self._seen = wanted
        keys = {key: None for found in wanted for key in found}
        for key in [key for key in self._waiting if key not in keys]:
            self._waiting.pop(key).cancelled.set()
        self._values = {key: value for key, value in self._values.items() if key in keys}
        for urgency, do in ((LIVE, "live"), (POINTS, "point")):
            for key in keys:
                if key.do == do and key not in self._values and key not in self._waiting:
                    self._waiting[key] = self._evaluate(key, urgency)

    def _evaluate(self, key: Key, urgency: int) -> EvaluationTask:
        def done(answer: Mapping[str, Any]) -> None:
            self._session.later(lambda: self._arrived(key, answer))

        return self._session.evaluator.put(
            EvaluationTask(key.do, key.file, key.text, done, dict(key.more), urgency=urgency)
        )

    def _arrived(self, key: Key, answer: Mapping[str, Any]) -> None:
        if self._waiting.pop(key, None) is None:
            return
        self._values[key] = value = Value(answer)
        if key.do != "live":
            self._tell("codeLens", "point")
            return
        if value.result.get("said"):
            self._wrong.add(key.file)
        before = self._session.publisher.known(key.file)
        self._session.publisher.push(key.file)
        if self._session.publisher.known(key.file) != before:
            self._session.diagnostics_changed()
        self._tell("inlayHint", "live")

    def _tell(self, what: str, do: str) -> None:
        """Ask the client to refresh what shows these values: once the last one has arrived, and not too often."""
        now = time.monotonic()
        last = not any(waiting.do == do for waiting in self._waiting)
        due = last or now - self._told.get(what, 0.0) > PAUSE
        if due and self._session.client.can(f"workspace.{what}.refreshSupport"):
            self._told[what] = now
            self._session.request(f"workspace/{what}/refresh", None, None)


def _said(live: Live, value: Value) -> Iterator[Diagnostic]:
    """What came out of a live expression as diagnostics of its file."""
    for said in value.result.get("said", ()):
        place = live.expected_span if said["where"] == "<expected>" else live.text_span
        if place is not None:
            start, end = said["span"]
            span = Span(place.start + start, place.start + end)
            notes = tuple(said["notes"])
            yield Diagnostic(said["code"], said["severity"], said["message"], span, notes=notes, help=said["help"])
