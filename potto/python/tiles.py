"""Large batches in tiles: progress, interruption that keeps what is done, and as many processes as an executor has.

Owns `in_tiles` and `Interrupted`. A batch is evaluated in blocks, whose size the first call of a function finds out by
the clock and the process keeps: so answers are the same to the last bit wherever and in whatever company a block is
evaluated, by the same backend. (They are not quite if members are blocked otherwise: numpy adds up rows and columns in
another order then, which changes the last one or two digits, far within the error bars.) A tile is as many blocks as
take half a second, or fewer, so that every worker gets some; tiles go to the executor of `potto.settings`. What an
executor loses (a process that was killed, a machine that is gone) is evaluated again: by it, and then here.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from itertools import groupby, pairwise
from typing import Any

from msgspec import Struct, field
from msgspec.structs import replace

from potto.integrate.costs import wanted
from potto.kernels.cells import Value, all_arrays, map_arrays
from potto.kernels.making import making
from potto.projects.settings import current, executor
from potto.python.arguments import LEAST, PATIENCE, Batch, cut, flattened
from potto.python.following import followed
from potto.python.tasks import Task, Tiled, whole
from potto.runtime.answers.batches import joined, unfinished, with_what_was_made
from potto.runtime.answers.estimate import Estimate
from potto.runtime.evaluation.gauge import Overtime, advancing, patient

# Members of a block: as many as take ENOUGH seconds at least, tried from PILOT on; after less than LITTLE with 64 times
# as many, else with twice as many. What is cut in a block costs a few milliseconds whatever there is of it: 16 blocks
# of what takes 20 ms in one would take 80. Longer blocks could not be shared evenly; but where a block costs far more
# than its members (64 pixels whose edges are searched 0.14 s, 1,024 of them 0.4), they are four times as large each
# time, as long as a member of them costs less than FALLS of what one cost before, and they take less than LONG. Then
# AHEAD times as large ones are tried in the middle of the batch.
PILOT, MOST = 1 << 6, 1 << 18
ENOUGH, LITTLE, LONG = 0.1, 0.005, 1.0
# Where a block takes longer than PATIENCE a single member is done first, then so many: up to ten are done one by one
# where they are cut. Blocks may take as long as LONGEST where that pays: twelve members that take 0.7 s each take 2.1
# together.
SEVERAL, LONGEST = 16, 8.0
FALLS = 0.6
# The first block is asked again: what it takes may only be what everything takes for the first time. So is a larger one
# that takes less than COLD seconds, if a member of it costs DEARER times what one cost before: kernels are made at the
# size that first needs them.
COLD, DEARER = 2.0, 2.0
# How many times as large blocks are tried where those twice as large cost as much; if a batch has so many at least.
AHEAD, BLOCKS = 8, 64
TILE = 0.5  # seconds of a tile by the clock, at the most
SHARES = 4  # tiles a worker gets at least, where there are enough blocks: who is done first takes more
WORTH = 0.3  # seconds of work from which on others are asked to help; executors may say otherwise, by `worth`
TRIES = 2  # of an executor at a tile
SMOOTH = 0.5  # seconds that a whole batch may take in blocks twice as large next time, where blocks may grow
MOST_SIZES = 4096

Part = tuple[int, int]  # members first..stop-1


class Interrupted(KeyboardInterrupt):
    """A batch was interrupted. `estimate` has what was done until then; the other members are nan."""

    def __init__(self, estimate: Estimate) -> None:
        super().__init__("interrupted")
        self.estimate = estimate


def in_tiles(
    function: Tiled, given: Any, wrt: tuple[str, ...], arguments: list[tuple[str, Value]], batch: Batch
) -> Estimate:
    """The estimate of a call, in tiles if its batch is large, or takes long. Raises Interrupted, PottoError."""
    with followed():
        if batch.size < 2 or any(a.size != batch.size for _, value in arguments for a in all_arrays(value)):
            return whole(function, given, wrt, arguments, batch)
        return _many(function, given, wrt, arguments, batch)


def _many(
    function: Tiled, given: Any, wrt: tuple[str, ...], arguments: list[tuple[str, Value]], batch: Batch
) -> Estimate:
    """The estimate for several members, whose arrays all have one number for each."""
    count, chosen = batch.size, current(function._world.settings(function._file))
    key, first = (function._call(given).elaborated, wrt, chosen, count < LEAST), PILOT
    if count < LEAST and _sizes.get(key, (count, False))[0] >= count:
        try:
            with patient(_later_than(PATIENCE if key not in _sizes else math.inf)):
                return whole(function, given, wrt, arguments, batch)
        except Overtime:
            first = 1

    def here(part: Part) -> Estimate:
        size, at = part[1] - part[0], slice(*part)
        some = [(name, map_arrays(value, lambda a: a[at] if size > 1 else float(a[part[0]])))
                for name, value in arguments]  # fmt: skip
        return whole(function, given, wrt, some, Batch((size,)))

    bare = function.bare()

    @cache
    def flat() -> Any:
        return flattened(given, batch)

    def task(parts: list[Part]) -> Task:
        return Task(bare, tuple(cut(flat(), slice(*part)) for part in parts), wrt, chosen, wanted())

    found = _Tiles(count, here, task, key, first).run(None if function._world._held else executor())
    return batch.shaped(found, own=True)


# Of blocks, for functions called before, and whether larger ones would take too long; else the batch was small.
_sizes: dict[Any, tuple[int, bool]] = {}
_growing: ContextVar[bool] = ContextVar("_growing", default=False)


@contextmanager
def growing() -> Iterator[None]:
    """Within this, what was short in blocks is asked in larger ones next time: their size was found out when everything
    was new. For who asks the same again and again, and needs no last bit of an answer: frames of a preview."""
    before = _growing.set(True)
    try:
        yield
    finally:
        _growing.reset(before)


class _Tiles(Struct):
    """One batch. key: for whom the size of blocks is kept. first: the size that is tried first; 1 where more are known
    to take long. done: the answers so far, by the first member of their
    block. tried: those of blocks that only told the size, with that member. again: how many blocks were lost. spent:
    seconds that the last block took that was evaluated here; total: all of them."""

    count: int
    here: Callable[[Part], Estimate]
    task: Callable[[list[Part]], Task]
    key: Any
    first: int = PILOT
    done: dict[int, Estimate] = field(default_factory=dict)
    tried: list[tuple[int, Estimate]] = field(default_factory=list)
    blocks: list[Part] = field(default_factory=list)
    again: int = 0
    spent: float = 0.0
    total: float = 0.0
    start: float = field(default_factory=time.perf_counter)

    def run(self, pool: Executor | None) -> Estimate:
        with advancing() as told:
            try:
                self._all(pool, told)
            except KeyboardInterrupt:
                if not (self.blocks and self.done):
                    self.blocks = self._salvaged()
                if not self.done:
                    raise
                raise Interrupted(self.estimate()) from None
        return self.estimate()

    def _all(self, pool: Executor | None, told: Callable[[float, int], None]) -> None:
        size = self._size()
        self.blocks = list(_parts(self.count, size))
        for number, block in enumerate(self.blocks):
            if block[0] not in self.done:
                self._alone(block)
            told(block[1] / self.count, sum(part.evals for part in self.done.values()))
            rest = self.blocks[number + 1 :]
            if pool is not None and self.spent * len(rest) > getattr(pool, "worth", WORTH):
                return self._shared(pool, rest, told)
        if _growing.get() and len(self.blocks) > 1 and self.total <= SMOOTH:
            _sizes[self.key] = 2 * size, True
        return None

    def _size(self) -> int:
        """The size of blocks, by trying where it is not known; one that was taken is done."""
        size, most = _sizes.get(self.key, (PILOT, False)) if self.first > 1 else (1, False)
        tried, each, long = size, math.inf, LONG if self.first > 1 else LONGEST
        while not most and 2 * size <= self.count and size < MOST:
            if not self._done_within(PATIENCE if each == math.inf else 2 * long, (0, size)):
                if each < math.inf:
                    size, most = tried, True
                    break
                size, tried, long = 1, 1, LONGEST
                continue
            first = each == math.inf and long == LONG
            cold = first or (self.spent < COLD and self.spent > DEARER * each * size)
            if cold and self.spent >= ENOUGH:
                self._put_aside()
                self._alone((0, size))
            fallen, each = self.spent < FALLS * each * size, self.spent / size
            most = self.spent >= (long if fallen else ENOUGH)
            if most:
                if not fallen and long > LONG and size > tried:  # to no avail
                    size = tried
                    self._put_aside()
                break
            tried, steps = size, 64 if self.spent < LITTLE else 2 if self.spent < ENOUGH else 4
            size = min(max(size * steps, SEVERAL), MOST)
            self._put_aside()
        if not most and self.spent:  # twice as many take less than twice ENOUGH, and so may all
            while size < self.count and size < MOST and self.spent * self.count <= 2 * ENOUGH * tried:
                size *= 2
        if most and self.spent:
            size = self._further(size)
        if len(_sizes) > MOST_SIZES:
            _sizes.clear()
        _sizes[self.key] = size, most
        return size

    def _further(self, size: int) -> int:
        """A size at which blocks in the middle of the batch cost far less than at this one, if there is such a size. Of
        a picture the first rows may be empty; and what is cut at few members of a block is done one by one, at many
        together, so that what a member costs first stays, and then falls."""
        while self.spent < LONG and BLOCKS * size <= self.count:
            first = self.count // (2 * AHEAD * size) * AHEAD * size
            each = self._again_at((first, first + size)) / size
            self.tried.append((first, self.done.pop(first)))
            larger, most = (first, first + AHEAD * size), FALLS * each * AHEAD * size
            self._alone(larger)
            if self.spent > most:
                self._again_at(larger)
            last = self.done.pop(first)
            if self.spent > most:
                self.tried.append((first, last))
                break
            size *= AHEAD
            self._put_aside()
            self.done[first] = last
        return size

    def _again_at(self, block: Part) -> float:
        """The seconds that a block takes when what it needs was made, by one like it."""
        if block[0] not in self.done:
            self._alone(block)
        self.tried.append((block[0], self.done[block[0]]))
        self._alone(block)
        return self.spent

    def _done_within(self, seconds: float, block: Part) -> bool:
        """Whether a block is done; it is given up when it takes longer, unless it is a single member."""
        with patient(_later_than(seconds if block[1] - block[0] > 1 else math.inf)):
            try:
                self._alone(block)
            except Overtime:
                self.spent = seconds
                return False
        return True

    def _put_aside(self) -> None:
        self.tried += self.done.items()
        self.done.clear()

    def _salvaged(self) -> list[Part]:
        """The blocks of a batch that was interrupted while their size was tried: of those that were, the largest ones
        that are apart, and what is missing."""

        def end(first: int, part: Estimate) -> int:
            return first + int(part.member_converged.size)

        for first, part in sorted(self.tried, key=lambda each: -each[1].member_converged.size):
            if all(end(first, part) <= other or end(other, own) <= first for other, own in self.done.items()):
                self.done[first] = part
        self.tried = [(first, part) for first, part in self.tried if self.done.get(first) is not part]
        edges = [
            0,
            *(edge for first, part in sorted(self.done.items()) for edge in (first, end(first, part))),
            self.count,
        ]
        return [(start, stop) for start, stop in pairwise(edges) if stop > start]

    def _alone(self, block: Part) -> Estimate:
        # By the clock, a processor that others use as well would be a slow function.
        start, made = time.thread_time(), making.worked
        found = self.done[block[0]] = self.here(block)
        self.spent = time.thread_time() - start - (making.worked - made)
        self.total += self.spent
        return found

    def _shared(self, pool: Executor, rest: list[Part], told: Callable[[float, int], None]) -> None:
        """The rest by others."""
        most = max(1, len(rest) // (SHARES * workers_of(pool)))
        each = max(1, min(most, round(TILE / max(self.spent, 1e-6))))
        waiting: dict[Future[list[Estimate] | None], tuple[list[Part], int]] = {}
        try:
            for first in range(0, len(rest), each):
                self._ask(pool, rest[first : first + each], 1, waiting)
            while waiting:
                finished, _ = wait(waiting, return_when=FIRST_COMPLETED)
                for future in finished:
                    tile, tries = waiting.pop(future)
                    self._take(pool, future, tile, tries, waiting)
                members = sum(part.member_converged.size for part in self.done.values())
                told(members / self.count, sum(part.evals for part in self.done.values()))
        finally:
            for future in waiting:
                future.cancel()

    def _ask(self, pool: Executor, tile: list[Part], tries: int, waiting: dict[Any, Any]) -> None:
        """Give a tile to the executor; if it takes none any more, do it here."""
        try:
            waiting[pool.submit(Task.answers, self.task(tile))] = tile, tries
        except RuntimeError:  # it is broken, or shut down
            self._again(tile)

    def _take(
        self, pool: Executor, future: Future[list[Estimate] | None], tile: list[Part], tries: int, waiting: Any
    ) -> None:  # fmt: skip
        """What became of a tile. Whatever went wrong over there says nothing of the program: it is done again."""
        try:
            answers = future.result()
        except (Exception, CancelledError):
            answers = None
            if tries < TRIES:
                self.again += len(tile)
                return self._ask(pool, tile, tries + 1, waiting)
        if answers is None:
            return self._again(tile)
        self.done.update({first: answer for (first, _), answer in zip(tile, answers, strict=True)})
        return None

    def _again(self, tile: list[Part]) -> None:
        self.again += len(tile)
        for block in tile:
            self._alone(block)

    def estimate(self) -> Estimate:
        """All that is done, in order."""
        some = next(iter(self.done.values()))
        parts: list[Estimate] = []
        for done, run in groupby(self.blocks, lambda block: block[0] in self.done):
            together = list(run)  # what is missing is one part, however many blocks it would have been
            parts += (
                [self.done[first] for first, _ in together]
                if done
                else [unfinished(some, together[-1][1] - together[0][0])]
            )
        found = with_what_was_made(joined(parts), [part for _, part in self.tried])
        stats = {**found.stats, "blocks": len(self.blocks)}
        if self.again:
            stats["blocks done again"] = self.again
        return replace(found, seconds=time.perf_counter() - self.start, stats=stats)


def _later_than(seconds: float) -> Callable[[], bool]:
    """Whether this thread has worked for longer than that since, without what it has made."""
    start, made = time.thread_time(), making.worked
    return lambda: time.thread_time() - start - (making.worked - made) > seconds


def _parts(count: int, size: int) -> Iterator[Part]:
    """Blocks of this size; what is left at the end goes with the last one, unless it is more than half a block."""
    start = 0
    while start < count:
        stop = start + size if count - start > size + size // 2 else count
        yield start, stop
        start = stop


def workers_of(pool: Executor) -> int:
    """How many tiles an executor works on at once, as far as one can tell."""
    known = getattr(pool, "_max_workers", None)
    return known if isinstance(known, int) and known > 0 else os.cpu_count() or 1
