"""What an integral view shows of the place where the cursor is: the function, which of its integrals, and conditions.

Owns `Viewed` and `viewed`, by which picture and text point at each other.
"""

from __future__ import annotations

from msgspec import Struct

from potto.ide.display.scenes import scene
from potto.ide.hover.derivatives import condition_places
from potto.ide.names.live_expressions import wrong_with
from potto.ide.names.places import chunk_at, owner
from potto.query import Database
from potto.source import Span
from potto.syntax import nodes
from potto.syntax.walk import children


class ViewedCondition(Struct, frozen=True):
    """A condition: what its surface is called in pictures, and where it is written."""

    equation: str
    span: Span


class Viewed(Struct, frozen=True):
    """A function with an integral. which: the number of the integral at the cursor, from 0. lit: the equation of the
    condition there, or nothing. span: the whole definition."""

    name: str
    span: Span
    which: int
    conditions: tuple[ViewedCondition, ...]
    lit: str = ""


def viewed(db: Database, file: str, offset: int) -> Viewed | None:
    """What there is to see at a place; None where it is in no function whose parameters are numbers."""
    chunk = chunk_at(db, file, offset)
    name = None if chunk is None else owner(db, chunk)
    seen = None if chunk is None or name is None else scene(db, file, name)
    if chunk is None or name is None or seen is None:
        return None
    fitting = [(p.name, [text for text in p.fits if not wrong_with(db, file, text)]) for p in seen.parameters]
    given = tuple((parameter, texts[0]) for parameter, texts in fitting if texts)  # as the picture begins with
    places = condition_places(db, file, name, given)
    conditions = tuple(ViewedCondition(equation, chunk.absolute(span)) for span, equation in places)
    around = [c for c in conditions if c.span.start - 1 <= offset <= c.span.end + 1]  # with the brackets
    lit = min(around, key=lambda c: len(c.span)).equation if around else ""
    item = chunk.parsed(db).item
    own = _integrals(item.body) if isinstance(item, nodes.Definition) else []
    relative = offset - chunk.start
    which = next((n for n, span in enumerate(own) if span.start <= relative <= span.end), 0)
    return Viewed(name, Span(chunk.start, chunk.start + len(chunk.text.rstrip())), which, conditions, lit)


def _integrals(body: nodes.Expr) -> list[Span]:
    """Where the integrals that are in no other one are written."""
    found: list[Span] = []
    stack: list[nodes.Node] = [body]
    while stack:
        node = stack.pop()
        if isinstance(node, nodes.Integral):
            found.append(node.span)
        else:
            stack.extend(reversed(list(children(node))))
    return sorted(found)
