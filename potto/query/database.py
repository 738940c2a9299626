"""`Database`: inputs, reading, threads, events and forgetting."""

from __future__ import annotations

from collections.abc import Callable, Container, Hashable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from threading import get_ident
from typing import Any, TypeVar, cast

from potto.query.engine import Engine
from potto.query.memos import (
    FOREVER,
    GONE,
    MISSING,
    Cancelled,
    Input,
    Memo,
    Node,
    Parted,
    Query,
    QueryEvent,
    drop,
    entry_of,
    renew,
    same,
)

K = TypeVar("K")
V = TypeVar("V")
MOST_ARGUMENTS = 200_000


class Database(Engine):
    """Inputs and memos. Every query takes the database as its first argument."""

    def __init__(self) -> None:
        super().__init__()
        #: Called once for an input that is read but was never set. Gives `(value, durability)`, or None for "none".
        #: This needs no new revision: nothing can have read the input before.
        self.on_missing_input: Callable[[Hashable], tuple[Any, int] | None] | None = None
        self._inputs: dict[Hashable, Input] = {}
        self._limits: dict[Query, int] = {}

    # Inputs

    def set_input(self, key: Hashable, value: Any, durability: int = 0) -> bool:
        """Set an input. Returns whether it changed: setting an equal value starts no new revision."""
        with self.evaluating():
            self._forbid_in_queries("set_input")
            old = self._inputs.get(key)
            if old is None:
                self._inputs[key] = Input(value, self.revision, durability)
                self._log("input", "input", (key,))
                return True
            differs = old.value is MISSING or not same(old.value, value)
            if not differs and old.durability == durability:
                return False
            self._next_revision()
            self._evict()
            for level in range(max(old.durability, durability) + 1):
                self._last_changed[level] = self.revision
            old.durability = durability
            if differs:
                renew(old, value, self.revision)
                self._changes[self.revision].add(old)
                self._log("input", "input", (key,))
            return differs

    def get_input(self, key: Hashable, default: Any = None) -> Any:
        """The value of an input. A running query is recorded as its reader, even if the input was never set."""
        if self._owner != get_ident():
            with self.evaluating():
                return self.get_input(key, default)
        node = self._inputs.get(key)
        if node is None:
            node = self._load(key)
        if self._frame is not None:
            self._frame[node] = None
        return default if node.value is MISSING else node.value

    def _load(self, key: Hashable) -> Input:
        """Load an input that is read but was never set. What the loader itself reads is not recorded for the running
        query."""
        frame, self._frame = self._frame, None
        try:
            loaded = self.on_missing_input(key) if self.on_missing_input is not None else None
        finally:
            self._frame = frame
        value, durability = loaded if loaded is not None else (MISSING, 0)
        node = self._inputs[key] = Input(value, self.revision, durability)
        return node

    def has_input(self, key: Hashable) -> bool:
        """Whether an input was ever set or read."""
        return key in self._inputs

    def input_keys(self) -> tuple[Hashable, ...]:
        """The keys of all inputs that were set or read."""
        with self.evaluating():
            return tuple(self._inputs)

    def inputs(self) -> tuple[tuple[Hashable, Input], ...]:
        """All inputs that were set or read, under their keys."""
        with self.evaluating():
            return tuple((key, node) for key, node in self._inputs.items())

    # Answers found elsewhere, see `parcels`

    def input(self, key: Hashable) -> Input:
        """An input, loaded if it was never read."""
        with self.evaluating():
            return self._inputs.get(key) or self._load(key)

    def memo(self, table: Callable[..., Any], args: tuple[Hashable, ...]) -> Memo:
        """The memo of a query, up to date."""
        query: Query = table.query  # type: ignore[attr-defined]
        with self.evaluating():
            return self._demand_unread(query, args)

    def is_current(self, node: Node) -> bool:
        """Whether a node is what a reader would get now. Brings it up to date first if necessary."""
        source = node.source
        if source is not None and source.verified_at < self.revision:
            self._demand_unread(source.query, source.args)
            return source.verified_at >= self.revision
        return True

    def adopt(self, table: Callable[..., Any], args: tuple[Hashable, ...], value: Any, deps: Iterable[Node]) -> Memo:
        """Take over an answer that was found elsewhere from the nodes `deps`. An answer that is already known here
        stays."""
        self._forbid_in_queries("adopt")
        if self._cancelled == self._evaluation:
            raise Cancelled
        query: Query = table.query  # type: ignore[attr-defined]
        memos = self._memos[query]
        memo = memos.get(args)
        if memo is None:
            args = self._arguments.setdefault(args, args)
            memo = memos[args] = Memo(query, args)
        elif memo.verified_at >= self.revision:
            return memo
        memo.break_ring()
        memo.put(value, self.revision, self._changes[self.revision])
        self._depend(memo, dict.fromkeys(deps))
        return memo

    # Reading

    def entry(self, table: Callable[..., Mapping[K, V] | Parted], args: tuple[Hashable, ...], key: K) -> V | None:
        """The value under `key` in the mapping `table(db, *args)`. The reader depends on this entry alone."""
        if self._owner != get_ident():
            with self.evaluating():
                return self.entry(table, args, key)
        query: Query = table.query  # type: ignore[attr-defined]
        memo = self._memos[query].get(args)
        if memo is None or memo.verified_at < self.revision or self._cancelled == self._evaluation:
            memo = self._demand_unread(query, args)
        node = entry_of(memo, key)
        if self._frame is not None:
            self._frame[node] = None
        return cast("V | None", node.value)

    def former(self, table: Callable[..., V], args: tuple[Hashable, ...]) -> V | None:
        """The last answer of a query, current or not; None if there is none. It is not recorded as read, so the
        caller's result must not depend on it."""
        query: Query = table.query  # type: ignore[attr-defined]
        memo = self._memos[query].get(args)
        return None if memo is None or memo.value is GONE else cast("V", memo.value)

    def _demand_unread(self, query: Query, args: tuple[Hashable, ...]) -> Memo:
        """The memo of a query, up to date. It is recorded as read only if it fails."""
        frame, self._frame = self._frame, None
        try:
            return self._demand(query, args)
        except Exception:
            if frame is not None:
                frame[self._memos[query][args]] = None
            raise
        finally:
            self._frame = frame

    def inputs_below(self, name: str, args: tuple[Hashable, ...]) -> tuple[Hashable, ...] | None:
        """The keys of all inputs that the answer of the query `name` depends on; None if there is no current answer."""
        with self.evaluating():
            query = next((query for query in self._memos if query.name == name), None)
            memo = None if query is None else self._memos[query].get(args)
            if memo is None or memo.verified_at < self.revision:
                return None
            keys = {id(node): key for key, node in self._inputs.items()}
            found: dict[Hashable, None] = {}
            seen, stack = {memo}, [memo]
            while stack:
                for dep in stack.pop().deps:
                    source = dep.source
                    if source is None:
                        found[keys[id(dep)]] = None
                    elif source not in seen:
                        seen.add(source)
                        stack.append(source)
            return tuple(found)

    @contextmanager
    def evaluating(self) -> Iterator[None]:
        """Hold the database, so that no other thread writes or evaluates. `cancel` applies to the whole block."""
        if self._owner == get_ident():
            yield
            return
        self._acquire()
        try:
            yield
        finally:
            self._release()

    def give_way(self) -> None:
        """Raise `Cancelled` if this evaluation was cancelled. Queries check this themselves; call it in long work
        between them."""
        if self._cancelled == self._evaluation:
            raise Cancelled

    # Events

    @property
    def events(self) -> list[QueryEvent]:
        """What the innermost `recording` has recorded so far."""
        return self._events if self._events is not None else []

    @contextmanager
    def recording(self) -> Iterator[list[QueryEvent]]:
        """Record events in the list that this yields."""
        before, logs, self._events, self._logs = self._events, self._logs, [], True
        try:
            yield self._events
        finally:
            self._events, self._logs = before, logs

    # Forgetting

    def forget(
        self, predicate: Callable[[str, tuple[Hashable, ...]], bool], names: Container[str] | None = None
    ) -> int:
        """Drop the memos whose query name and arguments satisfy `predicate`. Returns how many. They run again when
        asked for.

        `names` limits the search to these queries.
        """
        with self.evaluating():
            self._forbid_in_queries("forget")
            tables = [(query.name, t) for query, t in self._memos.items() if names is None or query.name in names]
            return sum(drop(t, [memo for memo in t.values() if predicate(name, memo.args)]) for name, t in tables)

    def _evict(self) -> None:
        """Shrink the tables of queries that declare `keep`. Runs only between evaluations, when no memo is in use.

        The least recently used memos go first. A memo that reads no input counts as verified forever, which hides
        whether it is used; so it is set back to the present revision, and dropped at the next sweep if nobody asked for
        it.
        """
        if len(self._arguments) > MOST_ARGUMENTS:
            self._arguments.clear()  # this only makes equal tuples share memory
        for query, table in self._memos.items():
            if not query.keep or len(table) <= self._limits.get(query, query.keep):
                continue
            by_age = sorted(table.values(), key=lambda memo: memo.verified_at)
            surplus = by_age[: len(table) - query.keep // 2]
            drop(table, [memo for memo in surplus if memo.verified_at < self.revision - 1])
            for memo in table.values():
                if memo.verified_at == FOREVER:
                    memo.verified_at = self.revision
            self._limits[query] = max(query.keep, len(table) + query.keep // 2)

    def _forbid_in_queries(self, what: str) -> None:
        if self._running:
            raise RuntimeError(f"the query {self._running[-1]} calls {what}: queries are pure")
