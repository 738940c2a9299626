"""Which messages of a chunk follow from others: one mistake has one message.

Owns `Reported`, `only` and `without_consequences`. Messages come from the tokens, from where the grammar stops, and
from those who make trees of what it read or was repaired into; each may only repeat, or be misled by, what another one
says.
"""

from __future__ import annotations

from potto.diagnostics import Diagnostic
from potto.syntax import kinds
from potto.syntax.messages import describe
from potto.syntax.repair import RepairStep
from potto.syntax.stops import Stop

OF_LINES = (kinds.LAST_LINE.code, kinds.NOT_A_NAME.code, kinds.DEFINITION_HEAD.code)
"""What is said of a whole line, or head, because something in it was not understood."""


class Reported:
    """What is said of a chunk, as it is found out."""

    def __init__(self, of_tokens: list[Diagnostic], end: int) -> None:
        self.of_tokens = list(of_tokens)
        self.stops: list[Diagnostic] = []
        brackets = [d.span.start for d in of_tokens if d.code == kinds.BRACKETS.code and d.related]
        self.guessed = min(brackets, default=end)
        """Where a bracket opens that is never closed. Its end is guessed, and what the grammar says of the rest is
        about the guess."""

    @property
    def all(self) -> list[Diagnostic]:
        return self.of_tokens + self.stops

    def stopped(self, stop: Stop, edits: list[RepairStep]) -> None:
        """The grammar stopped, and is repaired like this to go on."""
        if not stop.at.text:
            self._without_differential(stop)
        if stop.place.start > self.guessed or self._is_unknown(stop):
            return
        said = describe(stop, edits)
        if not any(_says(told, said) for told in self.all):
            self.stops.append(said)

    def and_foreign(self, said: Diagnostic, stop: Stop) -> list[Diagnostic]:
        """All of it, where the grammar stopped at another language's word: no one can go on there."""
        if not stop.at.text:
            self._without_differential(stop)
        code = kinds.NO_DIFFERENTIAL.code
        kept = [d for d in self.of_tokens if d.code != code or d.span.start != said.span.start]
        return [*kept, *self.stops, *([said] if stop.place.start <= self.guessed else [])]

    def and_of_trees(self, found: list[Diagnostic]) -> list[Diagnostic]:
        """All of it, where the grammar came to the end. A line that gives no result because it was not understood has
        its message already; so has what is not a name or the head of a definition."""
        places = [d.span.start for d in self.all]
        return self.all + [
            d
            for d in found
            if d.span.end <= self.guessed
            and (d.code not in OF_LINES or not any(d.span.start <= place < d.span.end for place in places))
        ]

    def _is_unknown(self, stop: Stop) -> bool:
        """Whether a character that Potto does not know stands where the parse stopped: its message is enough."""
        start = stop.before.end if stop.before is not None else 0
        end = stop.at.start if not stop.ended else None
        unknown = kinds.UNKNOWN_CHARACTER.code
        return any(
            d.code == unknown and d.span.start >= start and (end is None or d.span.end <= end) for d in self.of_tokens
        )

    def _without_differential(self, stop: Stop) -> None:
        """Where an integral breaks off, that its `d(...)` is missing too is nothing new."""
        at, code = stop.at.start, kinds.NO_DIFFERENTIAL.code
        self.of_tokens = [
            d for d in self.of_tokens if d.code != code or all(related.span.start != at for related in d.related)
        ]


def _says(told: Diagnostic, said: Diagnostic) -> bool:
    """Whether a message says already what is wrong: an `integral` alone, or a `sum` that misses two of its parts."""
    if told.code != kinds.UNFINISHED.code:
        return False
    return told.span == said.span or (told.code == said.code and bool(told.related) and told.related == said.related)


def only(said: Diagnostic, found: list[Diagnostic]) -> list[Diagnostic]:
    """A message that says all of what follows, and those ahead of it."""
    return [*(d for d in found if d.span.end <= said.span.start), said]


def without_consequences(found: list[Diagnostic]) -> list[Diagnostic]:
    """Where one closing bracket closes nothing, its partner may be missing: what was said of the text before it is
    about what that leaves behind. Bounds are counted where nothing else is wrong with them or with the integrand. What
    stands in the head of a function without `def` is read as an expression."""
    if not found:
        return found
    heads = [d.span for d in found if d.code == kinds.DEFINITION_HEAD.code]
    in_heads = {d.span.start for d in found for head in heads if head.start <= d.span.start < head.end}
    found = [d for d in found if d.code != kinds.NOT_A_NAME.code or d.span.start not in in_heads]
    bounds = [d for d in found if d.code == kinds.BOUNDS.code and d.related]
    others = [d.span.start for d in found if d not in bounds]
    doubtful = [d for d in bounds if any(d.related[0].span.start <= at < d.span.end for at in others)]
    found = [d for d in found if d not in doubtful]
    stray = [d for d in found if d.code == kinds.BRACKETS.code and not d.related]
    if len(stray) != 1:
        return found
    return [d for d in found if d.span.start >= stray[0].span.start]
