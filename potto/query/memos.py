"""The parts of the database: inputs, memos, entries of tables and events; and what can go wrong."""

from __future__ import annotations

import sys
from collections.abc import Callable, Hashable, Iterable, Mapping
from typing import Any, Final, Literal

from msgspec import Struct

DURABILITIES: Final = 3  # of inputs: 0, 1, 2; this one is for memos that read no input
FOREVER: Final = sys.maxsize  # the revision up to which such a memo counts as verified
GONE: Final[Any] = object()  # the value of a memo that was dropped or that failed
MOST_BELOW: Final = 1024  # most nodes that `Below` collects
MISSING: Final[Any] = object()  # the value of an input that was never set


class Cancelled(BaseException):
    """The evaluation was cancelled. Not an `Exception`, so that handlers of errors let it through."""


class Strayed(BaseException):
    """A query that was run only to verify another one meets a query that was running before: it is abandoned."""


class CycleError(Exception):
    """A query needs its own answer and has no fallback. An internal error; its text shows the cycle."""


class QueryEvent(Struct, frozen=True):
    """What happened to a query or input (`query` is then "input"). `reused`: verified after an edit without a run."""

    kind: Literal["executed", "reused", "input"]
    query: str
    args: tuple[Hashable, ...]


class Parted(Struct, frozen=True):
    """A mapping made of parts, as the answer of a query that runs after every edit. Parts shared with the previous
    answer are skipped when the two are compared. `place` says which part holds a key."""

    parts: tuple[Mapping[Any, Any], ...]
    place: Mapping[Any, int]

    def get(self, key: Any) -> Any:
        """The value under a key, or None."""
        place = self.place.get(key)
        return None if place is None else self.parts[place][key]

    def may_differ(self, old: Parted) -> set[Any]:
        """The keys whose values may differ from those of another table."""
        here, there = set(map(id, self.parts)), set(map(id, old.parts))
        own = [part for part in self.parts if id(part) not in there]
        return {key for part in (*own, *(part for part in old.parts if id(part) not in here)) for key in part}


class Query:
    """A declared query: its function and name, its fallback in a cycle, how many memos to `keep` (0: all), whether its
    answers travel to other databases (see `parcels`), and whether most edits below it leave its answer alone (`cuts`).
    """

    __slots__ = ("cuts", "fallback", "function", "keep", "name", "travels")

    def __init__(
        self, function: Callable[..., Any], fallback: Callable[..., Any] | None, keep: int, travels: bool, cuts: bool
    ) -> None:
        self.function, self.fallback, self.keep, self.name = function, fallback, keep, function.__name__
        self.travels, self.cuts = travels, cuts


class Former:
    """A value that a node had, and the first and the last revision in which it had it. Whoever was verified between
    these rests on that value."""

    __slots__ = ("first", "last", "value")

    def __init__(self, value: Any, first: int, last: int) -> None:
        self.value, self.first, self.last = value, first, last


class Input:
    """A value from outside. Its `source` is None, since it needs no verification. `former` and `again` are as those of
    a memo."""

    __slots__ = ("again", "changed_at", "durability", "former", "source", "value")

    def __init__(self, value: Any, changed_at: int, durability: int) -> None:
        self.value, self.changed_at, self.durability = value, changed_at, durability
        self.former: Former | None = None
        self.again: Former | None = None
        self.source: None = None


class Memo:
    """The answer of a query for its arguments.

    `index` is its place on the stack of running queries, or -1. `low` is the lowest place that it reaches through a
    cycle. `cyclic`: it runs, and a cycle leads back to it. `provisional`: it has finished, but its cycle has not.
    `ring`: the cycle that it is part of, itself included. Its members run together, see `break_ring`.

    `leaves` are the nodes of durability 0 that it depends on in the end: inputs, entries of tables, and memos known or
    declared to absorb most edits (`cuts`). The memo stands as long as no leaf and nothing durable changes. None if
    there are too many, or if they are not known. `found` collects everything below many leaves, once it was needed.

    `former` is the value before this one; `again` says when it had this one before, if it has come back. A mistake is
    mended, an edit is taken back: then all that was not asked for meanwhile stands. For what was asked for, `before`
    is this memo as it stood before its last run, outside the database's tables: if all that it had read is as it was
    then, its answer is recalled.
    """

    __slots__ = (
        "again",
        "args",
        "before",
        "changed_at",
        "cuts",
        "cyclic",
        "deps",
        "durability",
        "entries",
        "former",
        "found",
        "index",
        "leaves",
        "low",
        "provisional",
        "query",
        "ring",
        "source",
        "value",
        "verified_at",
    )

    def __init__(self, query: Query, args: tuple[Hashable, ...]) -> None:
        self.query, self.args, self.value = query, args, GONE
        self.deps: tuple[Node, ...] = ()
        self.leaves: tuple[Leaf, ...] | None = None
        self.found: Below | None = None
        self.cuts = query.cuts
        self.verified_at, self.changed_at, self.durability = -1, -1, 0
        self.entries: dict[Any, MappingEntry] | None = None
        self.former: Former | None = None
        self.again: Former | None = None
        self.before: Memo | None = None
        self.index, self.low, self.cyclic, self.provisional = -1, 0, False, False
        self.ring: tuple[Memo, ...] = ()
        self.source: Memo | None = self

    def __repr__(self) -> str:
        return f"{self.query.name}({', '.join(short(arg) for arg in self.args)})"

    def break_ring(self) -> None:
        """Make all members of its cycle run when they are next asked for. An answer that was found inside a cycle says
        nothing to one that runs by itself: it would take it for an answer from outside."""
        for member in self.ring:
            member.ring, member.verified_at = (), -1

    def kept(self) -> Memo | None:
        """This memo as it stands, for `before`. Of a member of a cycle nothing is kept: its answer rests on more than
        what it has read. Nobody reads what is kept, so it needs no `source`, and is freed with its last reference: as
        its own source it would be a cycle for the garbage collector, one for each query that an edit runs."""
        if self.value is GONE or self.verified_at < 0 or self.ring or self.durability:
            return None
        memo = Memo(self.query, self.args)
        memo.value, memo.deps, memo.leaves, memo.verified_at = self.value, self.deps, self.leaves, self.verified_at
        memo.source = None
        return memo

    def recall(self, before: Memo, revision: int, changes: set[Node]) -> None:
        """Become again what it was before its last run, which is kept in turn."""
        self.before = self.kept()
        self.break_ring()
        self.put(before.value, revision, changes)
        self.deps, self.leaves, self.durability = before.deps, before.leaves, before.durability
        self.verified_at = before.verified_at

    def join(self, ring: tuple[Memo, ...], revision: int, changes: set[Node]) -> None:
        """Become a member of a cycle that has just closed. This counts as a change, even if the value is the old one:
        what lies between a reader and this may be another member now, with another value."""
        self.ring, self.provisional = ring, False
        nodes: list[Node] = [self, *(self.entries or {}).values()]
        for node in nodes:
            node.changed_at = revision
        changes.update(nodes)

    def put(self, value: Any, revision: int, changes: set[Node]) -> None:
        """Set the value. If it is equal, nothing has changed and the old object stays. Whatever others may have read
        before is added to `changes`."""
        if self.changed_at < 0:  # its first one
            self.value, self.changed_at = value, revision
            return
        if self.value is not GONE and same(self.value, value):
            return
        old, entries = self.value, self.entries
        changes.add(self)
        renew(self, value, revision)
        if entries is None:
            return
        changed: Iterable[Any] = entries
        if isinstance(value, Parted) and isinstance(old, Parted):
            changed = value.may_differ(old) & entries.keys()
        for key in changed:
            entry, new = entries[key], value.get(key)
            if not same(entry.value, new):
                renew(entry, new, revision)
                changes.add(entry)

    def put_error(self, durability: int, revision: int, changes: set[Node]) -> None:
        """The query failed: its next value counts as changed."""
        self.value, self.verified_at, self.changed_at, self.again = GONE, -1, revision, None
        self.deps, self.leaves, self.durability = (), None, durability
        changes.add(self)
        for entry in (self.entries or {}).values():
            entry.value, entry.changed_at, entry.again = GONE, revision, None
            changes.add(entry)


class MappingEntry:
    """One key of a query whose value is a mapping. It changes only when the value under that key does."""

    __slots__ = ("again", "changed_at", "former", "key", "source", "value")

    def __init__(self, source: Memo, key: Any) -> None:
        self.source, self.key, self.value, self.changed_at = source, key, source.value.get(key), source.changed_at
        self.former: Former | None = None
        self.again: Former | None = None

    @property
    def durability(self) -> int:
        return self.source.durability


class Below:
    """Everything below some leaves.

    `nodes` are the leaves and what they depend on in turn. `sources` are the memos among them that read inputs
    themselves: once these are up to date, all changes among the nodes are known. Valid from the revision `since` on, as
    long as none of the nodes changes. What has changed before while the leaves did not is `noisy`, as the text of a
    file that is edited: it counts as an input, so that what absorbs its changes is among the sources.
    """

    __slots__ = ("leaves", "nodes", "noisy", "since", "sources")

    def __init__(self, leaves: tuple[Leaf, ...], since: int, changed: frozenset[Node]) -> None:
        self.leaves, self.since = leaves, since
        noisy = set[Node]()
        nodes: dict[Node, None] = dict.fromkeys(leaves)
        sources: dict[Memo, None] = {}
        seen = set[Memo]()
        todo = list(leaves)
        for leaf in todo:
            source = leaf.source
            if source is None or source in seen:
                continue
            seen.add(source)
            below = source.leaves
            if below is None or len(nodes) > MOST_BELOW or None in [node.source for node in below]:
                sources[source] = None
                continue
            if not changed.isdisjoint(below):
                noisy |= changed.intersection(below)
                sources[source] = None
                continue
            todo += [node for node in below if node not in nodes]
            nodes.update(dict.fromkeys(below))
        self.nodes, self.sources, self.noisy = frozenset(nodes), tuple(sources), frozenset(noisy)


def entry_of(memo: Memo, key: Any) -> MappingEntry:
    """The entry of a memo whose value is a mapping."""
    if memo.entries is None:
        memo.entries = {}
    node = memo.entries.get(key)
    if node is None:
        node = memo.entries[key] = MappingEntry(memo, key)
    return node


Node = Input | Memo | MappingEntry
Leaf = Node


def renew(node: Node, value: Any, revision: int) -> None:
    """Give a node another value.

    The one that it has counts as right until now, also where the node itself was verified long ago: a reader that was
    verified since, by what lies far below, rests on it all the same.
    """
    old, former = node.value, node.former
    node.again = None
    if former is not None and same(former.value, value):
        node.again, value = former, former.value
    if old is not GONE and old is not MISSING and node.changed_at < revision:
        node.former = Former(old, node.changed_at, revision - 1)
    node.value, node.changed_at = value, revision


def has_returned(node: Node, revision: int) -> bool:
    """Whether a node that has changed since a revision has the value again that it had then."""
    again = node.again
    return again is not None and again.first <= revision <= again.last


def same(old: Any, new: Any) -> bool:
    """Whether two values are equal, so that nothing has changed."""
    if old is new:
        return True
    try:
        return bool(old == new)
    except RecursionError:  # nested too deeply for `==`; running the reader once more is always right
        return False


def drop(table: dict[tuple[Hashable, ...], Memo], memos: list[Memo]) -> int:
    """Remove memos from their table and free their values. Their readers can still be verified through what these had
    read."""
    dropped = 0
    for memo in memos:
        if memo.index < 0 and not memo.provisional and table.pop(memo.args, None) is not None:
            memo.value, memo.entries, memo.former, memo.before = GONE, None, None, None
            memo.break_ring()
            dropped += 1
    return dropped


def short(value: object) -> str:
    """A value, shortened for a log."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:40]}...{text[-16:]}"
