"""Many files checked at once: helper processes that send what they have found out to the database that wants it.

Owns `Crew`, the helpers of one database, and `helper`, what such a process runs. The answers are memos with all that
they rest on (`potto.query.parcels`): the database takes them over as if it had found them itself, and whatever was
edited in between is checked here. Nothing waits for a helper. The files, and the pieces of open ones, are worked off
from one end here and from the other end by them; what has not come when it is reached is checked here, so a helper that
dies or hangs costs time only.
"""

from potto.crew.crew import Crew, helpers_for

__all__ = ["Crew", "helpers_for"]
