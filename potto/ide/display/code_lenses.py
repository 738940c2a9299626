"""Code lenses: what can be done with a definition, above it.

Owns `code_lenses`, `resolve_code_lens` and `offered`. A definition has two at most: its value, and all the rest.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from msgspec.structs import replace

from potto.ide.hover.derivatives import derivative_text
from potto.ide.model import CodeLens, Offer
from potto.ide.names.descriptions import Kind, kind_of, name_span, written_kind
from potto.ide.names.live_points import points
from potto.ide.names.places import PieceAt, pieces_of
from potto.ide.names.symbols import DefinitionSymbol
from potto.ide.navigation.references import occurrences_of
from potto.query import Database, query

LONG_CALL = 40  # characters of a call beyond which a title does not show it


def code_lenses(db: Database, file: str) -> tuple[CodeLens, ...]:
    """For each definition its value and what more can be done with it; for a script, running it."""
    found: list[CodeLens] = []
    for at in pieces_of(db, file):
        for lens in piece_lenses(db, file, at.text, at.hidden):
            if lens.command != "run" or not any(other.command == "run" for other in found):
                found.append(replace(lens, span=lens.span.shift(at.start)))
    return tuple(found)


@query(keep=1024)
def piece_lenses(db: Database, file: str, text: str, hidden: tuple[str, ...]) -> tuple[CodeLens, ...]:
    """The lenses of a piece of a file, relative to it. Only the first statement can be run."""
    found: list[CodeLens] = []
    running = False
    for chunk, name in PieceAt(file, 0, text, hidden).chunks(db):
        sketch = chunk.sketch(db)
        if name is not None:
            span = chunk.absolute(sketch.name_span)
            if _asked_as(db, file, name) in ("constant", "function"):
                found.append(CodeLens(span, "value", (file, name)))
            found.append(CodeLens(span, "more", (file, name), "more"))
        elif sketch.kind == "statement" and not running:
            running = True
            found.append(CodeLens(chunk.absolute(sketch.span), "run", (file,), "run"))
    return tuple(found)


def _asked_as(db: Database, file: str, name: str) -> Kind:
    """What a definition can be asked for as. A record is not asked as the function that makes it: what goes in comes
    out."""
    written = written_kind(db, file, name)
    return written if written == "record" else kind_of(db, file, name)


def resolve_code_lens(db: Database, lens: CodeLens) -> CodeLens:
    """A lens with its title: where a function is evaluated."""
    if lens.command != "value" or lens.title:
        return lens
    file, name = lens.arguments
    text, title = _call(db, file, name, "evaluate")
    return replace(lens, arguments=(file, text), title=title)


def _call(db: Database, file: str, name: str, do: Literal["evaluate", "differentiate"]) -> tuple[str, str]:
    """What is evaluated of a definition, and how that is called."""
    point = next(iter(points(db, file, name)), None)
    text = name if point is None else point.text
    return text, do if point is None or text == name or len(text) > LONG_CALL else f"{do} {text}"


def offered(db: Database, file: str, name: str) -> Iterator[Offer]:
    """What can be done with a definition."""
    kind = _asked_as(db, file, name)
    if kind in ("constant", "function"):
        text, title = _call(db, file, name, "evaluate")
        yield Offer("evaluate", title, (file, text))
    if kind == "function":
        text, title = _call(db, file, name, "differentiate")
        yield Offer("differentiate", title, (file, text))
    if kind in ("function", "diffeo"):
        yield Offer("showDerivative", _derivative_title(db, file, name), (file, name))
    count = sum(1 for _, o in occurrences_of(db, file, DefinitionSymbol(file, name)) if o.role != "define")
    title = "1 reference" if count == 1 else f"{count} references"
    yield Offer("showReferences", title, (file, name, str(name_span(db, file, name).start)))


def _derivative_title(db: Database, file: str, name: str) -> str:
    found = derivative_text(db, file, name)
    count = 0 if found is None else len({s.equation for item in found.integrals for s in item.surfaces})
    if not count:
        return "show derivative"
    return f"show derivative ({count} surface{'' if count == 1 else 's'})"
