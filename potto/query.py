"""The incremental database: inputs, memoized queries with what they read, and what an edit makes of them.

Owns `Database`, `query` and the events of what ran. Knows nothing of Potto. A query is a pure function
`f(db, *hashable_args)`. Its memo keeps the nodes that it read (inputs, memos, entries of tables). After an edit a memo
is *verified*: when none of its nodes changed since, it stands; else it runs again, and if its value is equal to the
old one, whoever read it stands (early cut-off). Verification is iterative and goes in the order of reading, so that
nothing is run that the new state of things would not ask for. Running is recursive by nature; every `SEGMENT` levels it
moves to a fresh thread (the old one waits), so that a chain of any length overflows no stack.

Durability: a memo is as durable as the least durable input below it; an edit of a less durable input does not even
look at it. Cycles: all participants of a cycle that have a fallback take it as their value, wherever the cycle was
entered (strongly connected components, as Tarjan finds them); a query without one raises `CycleError`.
Cancellation raises `Cancelled` at the next entry into a query; a cancelled run leaves its memo as it was. A failed one
(an exception: our bug) is never taken for an answer and runs again when asked for.

Threads: one thread evaluates or writes at a time; others wait, but a memo that is up to date is handed out at once.
"""

from __future__ import annotations

import contextvars
import functools
import os
import sys
import threading
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from threading import get_ident
from typing import Any, Concatenate, Final, Literal, ParamSpec, TypeVar, cast, overload

P = ParamSpec("P")
R = TypeVar("R")
K = TypeVar("K")
V = TypeVar("V")

DURABILITIES: Final = 3
SEGMENT: Final = 40  # levels of running queries on one thread: at 20 frames a level still below the limit
_GONE: Final[Any] = object()  # the value of a memo that was forgotten, or that failed
MISSING: Final[Any] = object()  # the value of an input that was never set


class Cancelled(BaseException):
    """The evaluation was cancelled. Not an `Exception`, so that no handler of errors holds it up."""


class CycleError(Exception):
    """A query needs its own answer and has no fallback: an internal error that names the cycle."""


@dataclass(frozen=True, slots=True)
class Event:
    """What happened to a query (`reused`: verified after an edit, not run) or an input (`query` is then "input")."""

    kind: Literal["executed", "reused", "input"]
    query: str
    args: tuple[Hashable, ...]


class _Input:
    """A value from outside. `source` None: it needs no verification."""

    __slots__ = ("changed_at", "durability", "key", "source", "value")

    def __init__(self, key: Hashable, value: Any, changed_at: int, durability: int) -> None:
        self.key, self.value, self.changed_at, self.durability = key, value, changed_at, durability
        self.source: None = None


class _Memo:
    """The answer of a query for its arguments. `index` is its place on the stack of running queries, or -1."""

    __slots__ = (
        "args", "changed_at", "cyclic", "deps", "durability", "entries", "index", "low", "provisional", "query",
        "source", "value", "verified_at",
    )  # fmt: skip

    def __init__(self, query: _Query, args: tuple[Hashable, ...]) -> None:
        self.query, self.args, self.value = query, args, _GONE
        self.deps: tuple[_Node, ...] = ()
        self.verified_at, self.changed_at, self.durability = -1, -1, 0
        self.entries: dict[Any, _Entry] | None = None
        self.index, self.low, self.cyclic, self.provisional = -1, 0, False, False
        self.source = self

    def __repr__(self) -> str:
        return f"{self.query.name}({', '.join(_short(arg) for arg in self.args)})"


class _Entry:
    """One key of a query whose value is a mapping: changes only when the value under that key does."""

    __slots__ = ("changed_at", "source", "value")

    def __init__(self, source: _Memo, value: Any) -> None:
        self.source, self.value, self.changed_at = source, value, source.changed_at

    @property
    def durability(self) -> int:
        return self.source.durability


_Node = _Input | _Memo | _Entry


class _Query:
    """A declared query: its function, name, fallback in a cycle, and how many memos to keep (0: all)."""

    __slots__ = ("fallback", "function", "keep", "name")

    def __init__(self, function: Callable[..., Any], fallback: Callable[..., Any] | None, keep: int) -> None:
        self.function, self.fallback, self.keep, self.name = function, fallback, keep, function.__name__


@overload
def query(function: Callable[Concatenate[Database, P], R], /) -> Callable[Concatenate[Database, P], R]: ...
@overload
def query(
    *, cycle: Callable[..., Any] | None = None, keep: int = 0
) -> Callable[[Callable[Concatenate[Database, P], R]], Callable[Concatenate[Database, P], R]]: ...
def query(
    function: Callable[..., Any] | None = None, /, *, cycle: Callable[..., Any] | None = None, keep: int = 0
) -> Any:
    """Declare a query `f(db, *hashable_args)`, called with positional arguments.

    `cycle(db, *args)` gives its value when it is found in a cycle. `keep`: about how many memos are kept, for a query
    whose arguments go out of use (texts); the longest unused go first, those of the present revision never.
    """
    if function is None:
        return lambda f: _declare(_Query(f, cycle, keep))
    return _declare(_Query(function, cycle, keep))


def _declare(entry: _Query) -> Callable[..., Any]:
    @functools.wraps(entry.function)
    def call(db: Database, *args: Hashable) -> Any:
        memo = db._memos[entry].get(args)
        if memo is not None and memo.verified_at == db.revision:
            if db._owner == get_ident():
                if db._cancelled == db._evaluation:
                    raise Cancelled
                frame = db._frame
                if frame is not None:
                    frame[memo] = None
                return memo.value
            value = memo.value
            if value is not _GONE:  # else forgotten by another thread at this very moment
                return value
        return db._demand(entry, args).value

    call.query = entry  # type: ignore[attr-defined]
    return call


class Database:
    """Inputs and memos of one world. Every query takes it as its first argument."""

    def __init__(self) -> None:
        self.revision = 1
        #: Called once for an input that is read and was never set: gives `(value, durability)`, or None for "none".
        #: Sound without a new revision, because nothing can have read it before.
        self.on_missing_input: Callable[[Hashable], tuple[Any, int] | None] | None = None
        self._inputs: dict[Hashable, _Input] = {}
        self._memos: defaultdict[_Query, dict[tuple[Hashable, ...], _Memo]] = defaultdict(dict)
        self._limits: dict[_Query, int] = {}
        self._last_changed = [1] * (DURABILITIES + 1)  # the last entry: memos that read no input
        self._lock = threading.Lock()
        self._owner = 0  # the thread that evaluates or writes
        self._evaluation, self._cancelled = 1, 0  # the number of the present evaluation and of the one to cancel
        self._frame: dict[_Node, None] | None = None  # what the running query has read
        self._running: list[_Memo] = []
        self._provisional: list[_Memo] = []  # finished members of a cycle whose first query still runs
        self._events: list[Event] | None = None
        self._print = "query" in os.environ.get("POTTO_LOG", "").split(",")

    # Inputs

    def set_input(self, key: Hashable, value: Any, durability: int = 0) -> bool:
        """Set an input; True if it changed. An equal value changes nothing and costs no revision."""
        with self.evaluating():
            self._forbid_in_queries("set_input")
            old = self._inputs.get(key)
            if old is None:
                self._inputs[key] = _Input(key, value, self.revision, durability)
                self._log("input", "input", (key,))
                return True
            differs = old.value is MISSING or not _same(old.value, value)
            if not differs and old.durability == durability:
                return False
            self.revision += 1
            self._evict()
            for level in range(max(old.durability, durability) + 1):
                self._last_changed[level] = self.revision
            old.durability = durability
            if differs:
                old.value, old.changed_at = value, self.revision
                self._log("input", "input", (key,))
            return differs

    def get_input(self, key: Hashable, default: Any = None) -> Any:
        """The value of an input; inside a query it is noted as read, also when it was never set."""
        if self._owner != get_ident():
            with self.evaluating():
                return self.get_input(key, default)
        node = self._inputs.get(key)
        if node is None:
            node = self._load(key)
        if self._frame is not None:
            self._frame[node] = None
        return default if node.value is MISSING else node.value

    def _load(self, key: Hashable) -> _Input:
        """An input that is read and was never set. What the loader reads is not read by the query that runs."""
        frame, self._frame = self._frame, None
        try:
            loaded = self.on_missing_input(key) if self.on_missing_input is not None else None
        finally:
            self._frame = frame
        value, durability = loaded if loaded is not None else (MISSING, 0)
        node = self._inputs[key] = _Input(key, value, self.revision, durability)
        return node

    def input_keys(self) -> tuple[Hashable, ...]:
        """The keys of all inputs that were set or read."""
        with self.evaluating():
            return tuple(self._inputs)

    # Reading

    def entry(self, table: Callable[..., Mapping[K, V]], args: tuple[Hashable, ...], key: K) -> V | None:
        """What the mapping `table(db, *args)` has under `key`, reading (and depending on) that alone."""
        if self._owner != get_ident():
            with self.evaluating():
                return self.entry(table, args, key)
        entry: _Query = table.query  # type: ignore[attr-defined]
        memo = self._memos[entry].get(args)
        if memo is None or memo.verified_at != self.revision or self._cancelled == self._evaluation:
            memo = self._demand_unread(entry, args)
        if memo.entries is None:
            memo.entries = {}
        node = memo.entries.get(key)
        if node is None:
            node = memo.entries[key] = _Entry(memo, memo.value.get(key))
        if self._frame is not None:
            self._frame[node] = None
        return cast("V | None", node.value)

    def _demand_unread(self, entry: _Query, args: tuple[Hashable, ...]) -> _Memo:
        """The memo of a query, up to date, without noting that it was read, unless it fails."""
        frame, self._frame = self._frame, None
        try:
            return self._demand(entry, args)
        except Exception:
            if frame is not None:
                frame[self._memos[entry][args]] = None
            raise
        finally:
            self._frame = frame

    @contextmanager
    def evaluating(self) -> Iterator[None]:
        """Hold the database: no other thread writes or evaluates. `cancel` holds for all of the block."""
        me = get_ident()
        if self._owner == me:
            yield
            return
        with self._lock:
            self._owner = me
            self._evaluation += 1
            try:
                yield
            finally:
                self._owner = 0
                self._evaluation += 1  # a cancellation that comes too late is for nobody

    def cancel(self) -> None:
        """Make the evaluation that runs now, if any, raise `Cancelled` at its next query."""
        self._cancelled = self._evaluation

    # Events

    @property
    def events(self) -> list[Event]:
        """What was recorded so far by the innermost `recording`."""
        return self._events if self._events is not None else []

    @contextmanager
    def recording(self) -> Iterator[list[Event]]:
        """Record events in the list that this gives."""
        before, self._events = self._events, []
        try:
            yield self._events
        finally:
            self._events = before

    def _log(self, kind: Literal["executed", "reused", "input"], name: str, args: tuple[Hashable, ...]) -> None:
        if self._events is not None:
            self._events.append(Event(kind, name, args))
        if self._print:
            print(f"query: {kind} {name}({', '.join(map(_short, args))})", file=sys.stderr)

    # Evicting

    def forget(self, predicate: Callable[[str, tuple[Hashable, ...]], bool]) -> int:
        """Drop the memos whose query's name and arguments fulfil `predicate`; how many. Asked again, they run again."""
        with self.evaluating():
            self._forbid_in_queries("forget")
            tables = [(table, list(table.values())) for table in self._memos.values()]
            return sum(_drop(table, [m for m in memos if predicate(m.query.name, m.args)]) for table, memos in tables)

    def forget_unused(self, revisions: int, durability: int = 0) -> int:
        """Drop the memos of at most this durability that nobody asked for in the last `revisions` revisions."""
        with self.evaluating():
            self._forbid_in_queries("forget_unused")
            before = self.revision - revisions
            return sum(
                _drop(table, [m for m in table.values() if m.verified_at < before and m.durability <= durability])
                for table in self._memos.values()
            )

    def _evict(self) -> None:
        """Bring the tables of queries that `keep` back to size. Only between evaluations: nothing is in use then."""
        for entry, table in self._memos.items():
            if entry.keep and len(table) > self._limits.get(entry, entry.keep):
                by_age = sorted(table.values(), key=lambda memo: memo.verified_at)
                newest = by_age[-1].verified_at
                surplus = by_age[: len(table) - entry.keep // 2]
                _drop(table, [memo for memo in surplus if memo.verified_at < newest])
                self._limits[entry] = max(entry.keep, 2 * len(table))  # where little could go, do not sort at each edit

    def _forbid_in_queries(self, what: str) -> None:
        if self._running:
            raise RuntimeError(f"the query {self._running[-1]} calls {what}: queries are pure")

    # Demanding, verifying, running

    def _demand(self, entry: _Query, args: tuple[Hashable, ...]) -> _Memo:
        """The memo of a query, up to date, noted as read by the running query."""
        if self._owner != get_ident():
            with self.evaluating():
                return self._demand(entry, args)
        if self._cancelled == self._evaluation:
            raise Cancelled
        table = self._memos[entry]
        memo = table.get(args)
        if memo is None:
            memo = table[args] = _Memo(entry, args)
        if self._frame is not None:
            self._frame[memo] = None
        if memo.index >= 0 or memo.provisional:
            self._meet_cycle(memo)
        elif memo.verified_at < 0:
            self._run(memo)
        elif memo.verified_at != self.revision:
            self._refresh(memo)
        return memo

    def _refresh(self, root: _Memo) -> None:
        """Bring a memo up to date, its nodes first; without recursion."""
        stack, places, revision = [root], [0], self.revision
        while stack:
            memo = stack[-1]
            if memo.verified_at == revision:
                must_run = False
            elif memo.verified_at < 0:
                must_run = True
            else:
                below = self._verify(memo, places)
                if isinstance(below, _Memo):
                    stack.append(below)
                    places.append(0)
                    continue
                must_run = below
            while must_run:
                must_run = not self._run_for(memo, memo is root)
                if must_run:  # it failed, or is no more: whoever read it must find out by running
                    stack.pop()
                    places.pop()
                    memo = stack[-1]
            stack.pop()
            places.pop()

    def _verify(self, memo: _Memo, places: list[int]) -> _Memo | bool:
        """Go on verifying a memo at `places[-1]`: True if it must run, False if it stands, or the node to do first."""
        revision, since, last_changed = self.revision, memo.verified_at, self._last_changed
        if last_changed[memo.durability] > since:
            durability, deps = DURABILITIES, memo.deps
            for place in range(places[-1], len(deps)):
                dep = deps[place]
                source = dep.source
                if source is not None and source.verified_at != revision:
                    if source.verified_at >= 0 and last_changed[source.durability] <= source.verified_at:
                        source.verified_at = revision
                    elif source.index >= 0 or source.provisional:
                        return True
                    else:
                        places[-1] = place
                        return source
                if dep.changed_at > since:
                    return True
            for dep in deps:
                if dep.durability < durability:
                    durability = dep.durability
            memo.durability = durability
        memo.verified_at = revision
        if self._events is not None or self._print:
            self._log("reused", memo.query.name, memo.args)
        return False

    def _run_for(self, memo: _Memo, asked: bool) -> bool:
        """Run a memo that is found stale; False if that gave no value and it was not asked for by itself."""
        table = self._memos[memo.query]
        if asked:
            table[memo.args] = memo
            self._run(memo)
            return True
        if table.get(memo.args) is not memo:
            return False
        try:
            self._run(memo)
        except Exception:
            return False  # not swallowed: its reader runs next, asks for it again and meets the exception itself
        return memo.verified_at == self.revision

    def _run(self, memo: _Memo) -> None:
        """Run a query and keep its answer."""
        if self._cancelled == self._evaluation:
            raise Cancelled
        index, caller, mark = len(self._running), self._frame, len(self._provisional)
        frame: dict[_Node, None] = {}
        memo.index, memo.low, memo.cyclic, fresh = index, index, False, memo.value is _GONE and memo.verified_at < 0
        self._running.append(memo)
        self._frame = frame
        if self._events is not None or self._print:
            self._log("executed", memo.query.name, memo.args)
        try:
            value = self._answer(memo)
            self._keep(memo, value, frame)
        except BaseException as error:
            self._fail(memo, frame, mark, fresh, isinstance(error, Exception))
            raise
        finally:
            memo.index = -1
            self._running.pop()
            self._frame = caller
        if memo.low < index:
            memo.provisional = True
            self._provisional.append(memo)
            for member in self._provisional[mark:]:  # what hung on this one now hangs on what this one hangs on
                member.low = min(member.low, memo.low)
        elif memo.cyclic:
            self._close_cycle(memo, mark)

    def _answer(self, memo: _Memo) -> Any:
        function, args = memo.query.function, memo.args
        try:
            if memo.index % SEGMENT == SEGMENT - 1:
                value = self._on_fresh_stack(function, args)
            else:
                value = function(self, *args)
        except CycleError:
            if memo.query.fallback is None or not (memo.cyclic or memo.low < memo.index):
                raise
            return memo.query.fallback(self, *args)
        if memo.query.fallback is not None and (memo.cyclic or memo.low < memo.index):
            return memo.query.fallback(self, *args)
        return value

    def _keep(self, memo: _Memo, value: Any, frame: dict[_Node, None]) -> None:
        memo.deps = tuple(frame)
        memo.durability = min((dep.durability for dep in memo.deps), default=DURABILITIES)
        self._replace(memo, value)
        memo.verified_at = -1 if memo.low < memo.index else self.revision

    def _fail(self, memo: _Memo, frame: dict[_Node, None], mark: int, fresh: bool, failed: bool) -> None:
        """Leave no half-made answers. A cancelled memo stays as it was; a failed one will differ from what it was."""
        for member in self._provisional[mark:]:
            member.provisional = False
            _drop(self._memos[member.query], [member])
            member.deps, member.verified_at = (), -1
        del self._provisional[mark:]
        if failed:
            memo.value, memo.verified_at, memo.changed_at, memo.deps = _GONE, -1, self.revision, ()
            memo.durability = min((dep.durability for dep in frame), default=DURABILITIES)
            for entry in (memo.entries or {}).values():
                entry.value, entry.changed_at = _GONE, self.revision
        elif fresh:
            self._memos[memo.query].pop(memo.args, None)

    # Cycles

    def _meet_cycle(self, memo: _Memo) -> None:
        """The running query asks for one that runs, or for a finished member of a cycle that is still open."""
        low = memo.index if memo.index >= 0 else memo.low
        for above in self._running[low + 1 :]:
            above.low = min(above.low, low)
        self._running[low].cyclic = True
        if memo.index < 0:
            return
        if memo.query.fallback is None:
            path = " -> ".join(map(repr, [*self._running[low:], memo]))
            raise CycleError(f"a query needs its own answer: {path}")
        self._replace(memo, memo.query.fallback(self, *memo.args))

    def _replace(self, memo: _Memo, value: Any) -> None:
        """Give a memo a value. An equal one is no change, and the old object stays."""
        if memo.value is not _GONE and _same(memo.value, value):
            return
        memo.value, memo.changed_at = value, self.revision
        for key, entry in (memo.entries or {}).items():
            new = value.get(key)
            if not _same(entry.value, new):
                entry.value, entry.changed_at = new, self.revision

    def _close_cycle(self, first: _Memo, mark: int) -> None:
        """All members of a cycle depend on all that any of them read outside it."""
        members = [*self._provisional[mark:], first]
        del self._provisional[mark:]
        inside = set(members)
        outside = tuple(dict.fromkeys(dep for m in members for dep in m.deps if dep.source not in inside))
        durability = min((dep.durability for dep in outside), default=DURABILITIES)
        for member in members:
            member.deps, member.durability, member.provisional = outside, durability, False
            member.verified_at = self.revision

    def _on_fresh_stack(self, function: Callable[..., Any], args: tuple[Hashable, ...]) -> Any:
        """Call a function on a new thread, which owns the database while this one waits."""
        answer: list[Any] = []
        owner, context = self._owner, contextvars.copy_context()

        def work() -> None:
            self._owner = get_ident()
            try:
                answer.append((context.run(function, self, *args), None))
            except BaseException as error:
                answer.append((None, error))

        thread = threading.Thread(target=work, name="potto-query", daemon=True)
        thread.start()
        try:
            thread.join()
        except BaseException:  # interrupted while waiting: the other thread must be out of the database first
            self.cancel()
            thread.join()
            raise
        finally:
            self._owner = owner
        value, error = answer[0]
        if error is not None:
            raise error
        return value


def _drop(table: dict[tuple[Hashable, ...], _Memo], memos: list[_Memo]) -> int:
    """Detach memos from their table and free their values. Their readers still verify through what they had read."""
    dropped = 0
    for memo in memos:
        if memo.index < 0 and not memo.provisional and table.pop(memo.args, None) is not None:
            memo.value, memo.entries = _GONE, None
            dropped += 1
    return dropped


def _same(old: Any, new: Any) -> bool:
    if old is new:
        return True
    try:
        return bool(old == new)
    except RecursionError:  # values nested deeper than `==` can walk: to run a reader once more is always right
        return False


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:40]}...{text[-16:]}"
