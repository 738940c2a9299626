"""The incremental database: inputs, memoized queries with what they read, and what an edit makes of them.

Owns `Database`, `query` and the events of what ran. Knows nothing of Potto. A query is a pure function
`f(db, *hashable_args)`. Its memo keeps the nodes that it read (inputs, memos, entries of tables). After an edit a memo
is *verified*: when none of its nodes changed since, it stands; else it runs again, and if its value is equal to the
old one, whoever read it stands (early cut-off).

Durability: a memo is as durable as the least durable input below it; an edit of a less durable input does not even
look at it. Cycles: all participants of a cycle that have a fallback take it as their value, wherever the cycle was
entered (strongly connected components, as Tarjan finds them); a query without one raises `CycleError`, and in a cycle
of both kinds those without keep what they make of the others' fallbacks.
Cancellation raises `Cancelled` at the next entry into a query; a cancelled run leaves its memo as it was. A failed one
(an exception: our bug) is never taken for an answer and runs again when asked for.

Threads: one thread evaluates or writes at a time; others wait, but a memo that is up to date is handed out at once.
"""

from potto.query.database import Database
from potto.query.declare import query
from potto.query.memos import Cancelled, CycleError, Parted, QueryEvent

__all__ = ["Cancelled", "CycleError", "Database", "Parted", "QueryEvent", "query"]
