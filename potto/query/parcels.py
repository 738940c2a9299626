"""Answers that travel: what one database has found out, taken over by another one, in another process or later.

Owns `Sender` and `Receiver`, the two ends of one way between two processes, and `Parcel`, what goes over it: an answer
with all that it rests on and that was not sent before. A query says whether its answers travel
(`@query(travels=True)`); where they don't, what it has read stands for it. That is always sound; the answers of queries
that cut edits off should travel, so that they do so on the other side too.

With each input goes a digest of its value. The receiver takes an answer over only if all that it has read is the same
here, so nothing is ever taken over that would not have been found here. Where something it has read is not, it is found
here; if it is equal all the same, what rests on it is taken over again.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from importlib import import_module
from typing import Any

from msgspec import Struct

from potto.digests import blake2b
from potto.query.database import Database
from potto.query.memos import GONE, Input, MappingEntry, Memo, Node, Query, entry_of, same

Args = tuple[Hashable, ...]
Asked = tuple[Callable[..., Any], Args]  # a query and what it is asked about
# Everything is called by its number in the order of sending. What was read: an input and the digest of its value; an
# answer: its query, arguments and value by number, and what it has read; or a key of an answer that is a table.
InputSent = tuple[Hashable, str]
AnswerSent = tuple[int, Args, int, tuple[int, ...]]
EntrySent = tuple[int, Hashable, None]
Sent = InputSent | AnswerSent | EntrySent
MOST_BELOW = 5_000_000  # a limit on the walk down, beyond the size of any database


class Parcel(Struct, frozen=True):
    """The answer with the number `root`, together with all values and nodes that were not sent before."""

    root: int
    values: tuple[Any, ...]
    nodes: tuple[Sent, ...]


def digest(value: object) -> str:
    """A digest of an input's value."""
    return blake2b(repr(value).encode("utf-8", "surrogatepass"), digest_size=16).hexdigest()


def address(query: Query) -> tuple[str, str]:
    """Where a query is defined: its module and its name."""
    return query.function.__module__, query.function.__name__


class Sender:
    """Packs answers of a database. Valid for one revision: after an edit both ends start anew."""

    def __init__(self, db: Database) -> None:
        self._db = db
        self._numbers: dict[Node, int] = {}
        self._values: dict[Any, int] = {}
        self._views: dict[Memo, tuple[int, ...]] = {}  # what stands for a memo: itself, or what it has read
        self._keys: dict[Input, Hashable] = {}
        self._new_values: list[Any] = []
        self._new: list[Sent] = []

    def pack(self, query: Callable[..., Any], *args: Hashable) -> Parcel:
        """The parcel for an answer. The query must travel. Raises whatever the query raises."""
        return self.pack_all([(query, args)])

    def pack_all(self, asked: Sequence[Asked]) -> Parcel:
        """The parcel for some answers, whose root is the last one. One that rests on no input is named by itself: what
        has read it does not lead to it."""
        with self._db.evaluating():
            roots = [self._db.memo(query, args) for query, args in asked]
            self._new_values, self._new = [], []
            for root in roots:
                self._look_at(root)
            return Parcel(self._views[roots[-1]][0], tuple(self._new_values), tuple(self._new))

    def _look_at(self, root: Memo) -> None:
        """Visit everything that a memo depends on, from the bottom up, without recursion. Where a memo was verified by
        what lies far below, what lies between may be of another time: it is brought up to date first."""
        views, stack = self._views, [root]
        while stack:
            memo = stack[-1]
            height = len(stack)
            if memo not in views:
                if memo.verified_at < self._db.revision and memo.value is not GONE:
                    self._db.is_current(memo)
                for dep in memo.deps:
                    if (source := dep.source) is not None and source not in views:
                        stack.append(source)
                if len(stack) == height:
                    views[memo] = self._view(memo)
            if len(stack) == height:
                stack.pop()
            elif height > MOST_BELOW:
                raise RecursionError("a memo rests on itself")

    def _view(self, memo: Memo) -> tuple[int, ...]:
        below: dict[int, None] = {}
        for dep in memo.deps:
            number = self._numbers.get(dep)
            if number is not None:
                below[number] = None
            elif isinstance(dep, Input):
                below[self._input(dep)] = None
            elif isinstance(dep, MappingEntry) and _is_sent(dep.source):
                below[self._number(dep, (self._views[dep.source][0], dep.key, None))] = None
            else:
                for number in self._views[dep if isinstance(dep, Memo) else dep.source]:
                    below[number] = None
        if memo.value is GONE and memo.verified_at < 0 and not memo.deps:
            raise LookupError(f"{memo!r} has failed")
        if not _is_sent(memo):
            return tuple(below)
        query, value = self._value(address(memo.query)), self._value(memo.value)
        return (self._number(memo, (query, memo.args, value, tuple(below))),)

    def _number(self, node: Node, sent: Sent) -> int:
        number = self._numbers[node] = len(self._numbers)
        self._new.append(sent)
        return number

    def _input(self, node: Input) -> int:
        if node not in self._keys:
            self._keys = {node: key for key, node in self._db.inputs()}
        return self._number(node, (self._keys[node], digest(node.value)))

    def _value(self, value: Any) -> int:
        """The number of a value. Equal values are sent once and are one object on the other side."""
        key: Any = (type(value), value)
        try:
            number = self._values.get(key)
        except TypeError:  # a table
            key, number = object(), None
        if number is None:
            number = self._values[key] = len(self._values)
            self._new_values.append(value)
        return number


def _is_sent(memo: Memo) -> bool:
    """Whether an answer is sent itself, and not what it has read: it travels, and was not dropped."""
    return memo.query.travels and memo.value is not GONE


class Receiver:
    """Takes the parcels of one sender, in the order in which they were sent."""

    def __init__(self, db: Database) -> None:
        self._db = db
        self._values: list[Any] = []
        self._nodes: list[Node | None] = []  # as they are here; None: not to be found
        self._there: list[Any] = []  # the value that each had there; of an input, the digest
        self._stood: list[int] = []  # the revision in which each was looked at; less than 0 if it differed
        self._digests: dict[Input, tuple[int, str]] = {}
        self._begun: int | None = None  # where the nodes of a parcel begin that was not taken to its end

    def take(self, parcel: Parcel) -> bool:
        """Take over everything that depends on nothing that differs here. Returns whether the answer itself is the same
        here.

        After a cancellation, call it again with the same parcel: it continues where it was.
        """
        with self._db.evaluating():
            if self._begun is None:
                self._values += parcel.values
                self._begun = len(self._nodes)
            for sent in parcel.nodes[len(self._nodes) - self._begun :]:
                node, there = self._taken(sent)
                self._there.append(there)
                self._stood.append(0)
                self._nodes.append(node)
            stands = self._stands(parcel.root)
            self._begun = None
            return stands

    def _taken(self, sent: Sent) -> tuple[Node | None, Any]:
        """A node as it is here, and the value that it had there."""
        if len(sent) == 2:
            return self._db.input(sent[0]), sent[1]
        if len(sent) == 3:
            number, key, _ = sent
            table = self._nodes[number]
            entry = entry_of(table, key) if isinstance(table, Memo) and self._is_current(table) else None
            return entry, self._there[number].get(key)
        (module, name), there = self._values[sent[0]], self._values[sent[2]]
        query = getattr(import_module(module), name)
        if all(map(self._stands, sent[3])):
            below = [node for number in sent[3] if (node := self._nodes[number]) is not None]
            return self._db.adopt(query, sent[1], there, below), there
        try:
            return self._db.memo(query, sent[1]), there
        except Exception:  # whoever asks for it will see that
            return None, there

    def _stands(self, number: int) -> bool:
        """Whether a node is here what it was there."""
        revision = self._db.revision
        if abs(self._stood[number]) != revision:
            self._stood[number] = revision if self._is_same(self._nodes[number], self._there[number]) else -revision
        return self._stood[number] > 0

    def _is_same(self, node: Node | None, there: Any) -> bool:
        if node is None or not self._is_current(node):
            return False
        return self._digest(node) == there if isinstance(node, Input) else same(node.value, there)

    def _is_current(self, node: Node) -> bool:
        """Whether a node is in use here. It is up to date then."""
        try:
            return self._db.is_current(node) and node.value is not GONE
        except Exception:
            return False

    def _digest(self, node: Input) -> str:
        known = self._digests.get(node)
        if known is None or known[0] != node.changed_at:
            known = self._digests[node] = (node.changed_at, digest(node.value))
        return known[1]
