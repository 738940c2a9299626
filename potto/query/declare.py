"""`query` turns a function into a query."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable
from threading import get_ident
from typing import Any, Concatenate, ParamSpec, TypeVar, overload

from potto.query.database import Database
from potto.query.memos import GONE, Cancelled, Query

P = ParamSpec("P")
R = TypeVar("R")


@overload
def query(function: Callable[Concatenate[Database, P], R], /) -> Callable[Concatenate[Database, P], R]: ...
@overload
def query(
    *, cycle: Callable[..., Any] | None = None, keep: int = 0, travels: bool = False, cuts: bool = False
) -> Callable[[Callable[Concatenate[Database, P], R]], Callable[Concatenate[Database, P], R]]: ...
def query(
    function: Callable[..., Any] | None = None,
    /,
    *,
    cycle: Callable[..., Any] | None = None,
    keep: int = 0,
    travels: bool = False,
    cuts: bool = False,
) -> Any:
    """Declare a query `f(db, *hashable_args)`, called with positional arguments.

    `cycle(db, *args)` gives its value when it is part of a cycle. `keep`: roughly how many memos to keep, for
    queries on texts that go out of use; the least recently used go first, never those of the present revision.
    `travels`: its answers can be pickled and are worth sending, see `parcels`. `cuts`: most edits of what it reads
    leave its answer as it is, so readers depend on the answer and not on what lies below. Of other queries this is
    noticed once it happens.
    """
    if function is None:
        return lambda f: _declare(Query(f, cycle, keep, travels, cuts))
    return _declare(Query(function, cycle, keep, travels, cuts))


def _declare(declared: Query) -> Callable[..., Any]:
    @functools.wraps(declared.function)
    def call(db: Database, *args: Hashable) -> Any:
        # Everything that a hit needs, in one place: this is the hottest code of the front end.
        memo = db._memos[declared].get(args)
        if memo is not None and memo.verified_at >= db.revision:
            if db._owner == get_ident():
                if db._cancelled == db._evaluation:
                    raise Cancelled
                frame = db._frame
                if frame is not None:
                    frame[memo] = None
                return memo.value
            value = memo.value
            if value is not GONE:  # else another thread has just dropped it
                return value
        return db._demand(declared, args).value

    call.query = declared  # type: ignore[attr-defined]
    return call
