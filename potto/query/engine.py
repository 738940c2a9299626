"""Demanding, verifying and running queries, and the cycles met on the way.

Verification is iterative. Running is recursive by nature: every `SEGMENT` levels it moves to a new thread, which owns
the database while the old one waits. So a chain of any length fits on the stack.
"""

from __future__ import annotations

import os
import sys
import threading
from collections import defaultdict
from collections.abc import Callable, Hashable
from threading import get_ident
from typing import Any, Final, Literal

from potto.query.leaves import leaves_of
from potto.query.memos import (
    DURABILITIES,
    FOREVER,
    GONE,
    Below,
    Cancelled,
    CycleError,
    Memo,
    Node,
    Query,
    QueryEvent,
    Strayed,
    drop,
    has_returned,
    short,
)
from potto.query.stacks import on_fresh_stack

STEPS: Final = 10
FEW: Final = 16
RESTING: Final = 32  # revisions before `Below` is worked out again for other leaves than it was of
LOGGED: Final = 16  # revisions for which the changes are kept
LEAVES_FIRST: Final = 8  # that are run early on the way to one memo; after that it is walked
ONCE: Final = Below((), -FOREVER, frozenset())  # of a memo that was verified once: it may never be again
SEGMENT: Final = 40  # levels of running queries on one thread: with 20 frames each, still below Python's limit


class Engine:
    """The memos, and what keeps them right. See `Database` for its interface."""

    def __init__(self) -> None:
        self.revision = 1
        self._memos: defaultdict[Query, dict[tuple[Hashable, ...], Memo]] = defaultdict(dict)
        self._arguments: dict[tuple[Hashable, ...], tuple[Hashable, ...]] = {}  # most are shared by a dozen memos
        self._last_changed = [1] * (DURABILITIES + 1)  # by durability; what reads no input never changes
        self.few = FEW  # leaves to check one by one; if there are more, check first whether anything below them changed
        self._changes: dict[int, set[Node]] = {1: set()}  # what changed in each of the last revisions
        self._lock = threading.Lock()
        self._owner = 0  # the thread that evaluates or writes
        self._evaluation, self._cancelled = 1, 0  # the numbers of the present evaluation and of the one to cancel
        self.look_around: Callable[[], None] = lambda: None  # called before each query that runs
        self._frame: dict[Node, None] | None = None  # what the running query has read
        self._running: list[Memo] = []
        self._floor = 0  # the lowest place among these that a cycle may reach
        self._provisional: list[Memo] = []  # finished members of a cycle whose first query still runs
        self._events: list[QueryEvent] | None = None
        self._print = "query" in os.environ.get("POTTO_LOG", "").split(",")
        self._logs = self._print

    def cancel(self) -> None:
        """Make the running evaluation, if any, raise `Cancelled` at its next query."""
        self._cancelled = self._evaluation

    def _next_revision(self) -> None:
        self.revision += 1
        self._changes[self.revision] = set()
        self._changes.pop(self.revision - LOGGED, None)

    def _acquire(self) -> None:
        self._lock.acquire()
        self._owner = get_ident()
        self._evaluation += 1

    def _release(self) -> None:
        self._owner = 0
        self._evaluation += 1  # a cancellation that comes too late has no effect
        self._lock.release()

    def _log(self, kind: Literal["executed", "reused", "input"], name: str, args: tuple[Hashable, ...]) -> None:
        if self._events is not None:
            self._events.append(QueryEvent(kind, name, args))
        if self._print:
            print(f"query: {kind} {name}({', '.join(map(short, args))})", file=sys.stderr)

    # Demanding and verifying

    def _demand(self, query: Query, args: tuple[Hashable, ...]) -> Memo:
        """The memo of a query, up to date, recorded as read by the running query."""
        if self._owner != get_ident():
            self._acquire()
            try:
                return self._demand(query, args)
            finally:
                self._release()
        if self._cancelled == self._evaluation:
            raise Cancelled
        table = self._memos[query]
        memo = table.get(args)
        if memo is None:
            shared = args if query.keep else self._arguments.setdefault(args, args)
            memo = table[shared] = Memo(query, shared)
        if self._frame is not None:
            self._frame[memo] = None
        if memo.index >= 0 or memo.provisional:
            self._meet_cycle(memo)
        elif memo.verified_at < 0:
            self._run(memo)
        elif memo.verified_at < self.revision and self._verify(memo, [0]) is not False:
            self._refresh(memo)
        return memo

    def _refresh(self, root: Memo) -> None:
        """Bring a memo up to date, starting with the nodes that it reads. Does not recurse.

        A memo that must run is looked at as it was `before`: if that stands, its answer is recalled.

        What is run ahead of its turn (a leaf, or what another member of the cycle or an earlier run has read) might not
        be read at all by the queries that run now. So it must not close a cycle with them: their places are below its
        floor.
        """
        stack, places, floors, revision = [root], [0], [self._floor], self.revision
        while stack:
            memo = stack[-1]
            if memo.verified_at >= revision:
                must_run = False
            elif memo.verified_at < 0:
                must_run = True
            else:
                below, before = self._verify(memo, places), memo.before
                if isinstance(below, Memo):
                    floors.append(len(self._running) if places[-1] < 0 or memo.ring else floors[-1])
                    stack.append(below)
                    places.append(0)
                    continue
                if below and before is not None:
                    if before.verified_at < revision:
                        floors.append(len(self._running))
                        stack.append(before)
                        places.append(-LEAVES_FIRST)
                        continue
                    memo.recall(before, revision, self._changes[revision])
                    below = False
                must_run = below
            while must_run:
                must_run = not self._run_again(memo, memo is root, floors[-1])
                if must_run:  # it failed, strayed, was dropped or is of `before`: its readers must run
                    del stack[-1], places[-1], floors[-1]
                    memo = stack[-1]
            del stack[-1], places[-1], floors[-1]

    def _verify(self, memo: Memo, places: list[int]) -> Memo | bool:
        """Continue verifying a memo from `places[-1]`: True if it must run, False if it stands, or the node to do
        first.

        Nodes are checked in the order in which they were read. One is looked at only if all those before it stand;
        otherwise the query might not read it any more. What has come back stands, but is seen here alone, where all
        that the memo read is up to date: were it seen in the leaves (`_stands`), what lies between might be of another
        time.
        """
        revision, since, last_changed = self.revision, memo.verified_at, self._last_changed
        stands: bool | Memo = last_changed[memo.durability] <= since
        if not stands and -LEAVES_FIRST < places[-1] <= 0:
            stands = self._stands(memo, STEPS)
            if isinstance(stands, Memo):
                places[-1] -= 1
                return stands
        if not stands:
            deps = memo.deps
            for place in range(max(places[-1], 0), len(deps)):
                dep = deps[place]
                source = dep.source
                if source is not None and source.verified_at < revision:
                    if source.verified_at >= 0 and last_changed[source.durability] <= source.verified_at:
                        source.verified_at = revision
                    elif source.index >= 0 or source.provisional:
                        return True
                    elif self._stands(source, STEPS) is True:  # the usual case: no need to go there and come back
                        source.verified_at = revision
                        if self._logs:
                            self._log("reused", source.query.name, source.args)
                    else:
                        places[-1] = place
                        return source
                if dep.changed_at > since and not has_returned(dep, since):
                    return True
            memo.durability = min([dep.durability for dep in deps], default=DURABILITIES)
            memo.leaves = leaves_of(deps)
        memo.verified_at = revision if memo.durability < DURABILITIES else FOREVER
        if self._logs:
            self._log("reused", memo.query.name, memo.args)
        return False

    def _stands(self, memo: Memo, steps: int) -> bool | Memo:
        """Whether nothing that a memo depends on has changed, found out without walking through everything in between.

        A leaf may have leaves of its own; after `steps` levels this gives up and leaves the rest to the walk. It may
        also return a memo instead of False: run this one first, since it has absorbed changes before and may do so
        again.
        """
        since, revision, leaves = memo.verified_at, self.revision, memo.leaves
        if leaves is None or not steps or memo.index >= 0 or memo.provisional or self._last_changed[1] > since:
            return False
        found = memo.found or ONCE
        known = found.leaves is leaves and found.since == since > revision - LOGGED
        if known:
            below = self._many_stand(memo, found, steps)
            if below is not False:
                return below
        for leaf in leaves:
            source = leaf.source
            if source is not None and source.verified_at < revision:
                below = self._source_stands(source, memo, steps)
                if below is not True:
                    return below
            if leaf.changed_at > since:
                return False
        if len(leaves) > self.few and (known or found.since < revision - RESTING):
            later = range(max(since, revision - LOGGED) + 1, revision + 1)
            changed = found.noisy.union(*[self._changes[each] for each in later])
            memo.found = ONCE if memo.found is None else Below(leaves, revision, changed)
        return True

    def _many_stand(self, memo: Memo, found: Below, steps: int) -> bool | Memo:
        """Whether nothing at all has changed below many leaves. If something has, check them one by one."""
        for source in found.sources:
            if source.verified_at < self.revision:
                stands = self._source_stands(source, memo, steps)
                if stands is not True:
                    return stands
        for later in range(found.since + 1, self.revision + 1):
            if not self._changes[later].isdisjoint(found.nodes):
                return False
        found.since = self.revision
        return True

    def _source_stands(self, source: Memo, memo: Memo, steps: int) -> bool | Memo:
        """Whether the memo that a leaf belongs to stands. If so, it is now up to date."""
        if source.verified_at < 0 or source is memo:
            return False
        below = self._stands(source, steps - 1)
        if below is not True:
            return source if below is False and self._runs_alone(source) else below
        source.verified_at = self.revision
        if self._logs:
            self._log("reused", source.query.name, source.args)
        return True

    def _runs_alone(self, memo: Memo) -> bool:
        """Whether a memo can be run before the memos between it and its reader."""
        return memo.index < 0 and not memo.provisional and self._memos[memo.query].get(memo.args) is memo

    def _run_again(self, memo: Memo, asked: bool, floor: int) -> bool:
        """Run a stale memo. False if this gave no value and nobody asked for it directly."""
        table = self._memos[memo.query]
        if asked:
            table[memo.args] = memo
            self._run(memo)
            return True
        if table.get(memo.args) is not memo:
            return False
        before, self._floor = self._floor, floor
        try:
            self._run(memo)
        except Exception:
            return False  # not swallowed: its reader runs next and gets the same exception
        except Strayed:
            if floor < len(self._running):  # the query that was run ahead is among them
                raise
            return False
        finally:
            self._floor = before
        return memo.verified_at >= self.revision

    # Running

    def _run(self, memo: Memo) -> None:
        """Run a query and keep its answer."""
        self.look_around()
        if self._cancelled == self._evaluation:
            raise Cancelled
        index, caller, mark = len(self._running), self._frame, len(self._provisional)
        frame: dict[Node, None] = {}
        fresh, before, changed_at = memo.value is GONE and memo.verified_at < 0, memo.kept(), memo.changed_at
        memo.break_ring()
        memo.index, memo.low, memo.cyclic = index, index, False
        self._running.append(memo)
        self._frame = frame
        if self._logs:
            self._log("executed", memo.query.name, memo.args)
        try:
            memo.put(self._answer(memo), self.revision, self._changes[self.revision])
            if not fresh and memo.changed_at == changed_at:
                memo.cuts = True
            self._depend(memo, frame)
            memo.before = before or memo.before
        except BaseException as error:
            self._fail(memo, frame, mark, fresh, isinstance(error, Exception))
            raise
        finally:
            memo.index = -1
            self._running.pop()
            self._frame = caller
        if memo.low < index:
            memo.provisional, memo.verified_at = True, -1
            self._provisional.append(memo)
            for member in self._provisional[mark:]:  # if it depended on this one, then on what this depends on
                member.low = min(member.low, memo.low)
        elif memo.cyclic:
            self._close_cycle(memo, mark)

    def _answer(self, memo: Memo) -> Any:
        function, fallback, args = memo.query.function, memo.query.fallback, memo.args
        try:
            if memo.index % SEGMENT == SEGMENT - 1:
                value = self._on_fresh_stack(function, args)
            else:
                value = function(self, *args)
        except CycleError:
            if fallback is None or not (memo.cyclic or memo.low < memo.index):
                raise
            return fallback(self, *args)
        if fallback is not None and (memo.cyclic or memo.low < memo.index):
            return fallback(self, *args)
        return value

    def _depend(self, memo: Memo, frame: dict[Node, None]) -> None:
        """Record what a memo depends on. One that reads no input stands forever."""
        durability, kept = DURABILITIES, list[Node]()
        for dep in frame:
            level = dep.durability
            if level < DURABILITIES:
                kept.append(dep)
                if level < durability:
                    durability = level
        memo.durability, memo.deps = durability, tuple(kept)
        memo.leaves = () if durability else leaves_of(memo.deps)
        memo.verified_at = self.revision if durability < DURABILITIES else FOREVER

    def _fail(self, memo: Memo, frame: dict[Node, None], mark: int, fresh: bool, failed: bool) -> None:
        """Leave no half-made answers. A cancelled memo stays as it was, unless it was given the value of its fallback;
        a failed one counts as changed."""
        for member in self._provisional[mark:]:
            member.provisional = False
            drop(self._memos[member.query], [member])
            member.deps, member.verified_at = (), -1
        del self._provisional[mark:]
        if failed:
            durability = min((dep.durability for dep in frame), default=0)
            memo.put_error(durability, self.revision, self._changes[self.revision])
        elif fresh:
            self._memos[memo.query].pop(memo.args, None)
        elif memo.cyclic:
            memo.verified_at = -1

    def _on_fresh_stack(self, function: Callable[..., Any], args: tuple[Hashable, ...]) -> Any:
        """Call a function on a new thread, which owns the database while this one waits."""
        owner = self._owner

        def work() -> Any:
            self._owner = get_ident()
            return function(self, *args)

        try:
            return on_fresh_stack(work, self.cancel)
        finally:
            self._owner = owner

    # Cycles

    def _meet_cycle(self, memo: Memo) -> None:
        """The running query asks for one that is running, or for a finished member of a cycle that is still open."""
        low = memo.index if memo.index >= 0 else memo.low
        if low < self._floor:
            raise Strayed
        for above in self._running[low + 1 :]:
            above.low = min(above.low, low)
        self._running[low].cyclic = True
        if memo.index < 0:
            return
        if memo.query.fallback is None:
            path = " -> ".join(map(repr, [*self._running[low:], memo]))
            raise CycleError(f"a query needs its own answer: {path}")
        memo.put(memo.query.fallback(self, *memo.args), self.revision, self._changes[self.revision])

    def _close_cycle(self, first: Memo, mark: int) -> None:
        """Make a ring of the members of a cycle: all depend on everything that any of them read outside it."""
        ring = tuple(dict.fromkeys((*self._provisional[mark:], first)))
        del self._provisional[mark:]
        inside = set(ring)
        outside = dict.fromkeys(dep for member in ring for dep in member.deps if dep.source not in inside)
        for member in ring:
            member.join(ring, self.revision, self._changes[self.revision])
            self._depend(member, outside)
