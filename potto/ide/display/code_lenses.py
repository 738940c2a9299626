"""Code lenses: what can be done with a definition, above it. Owns `code_lenses` and `resolve_code_lens`."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec.structs import replace

from potto.ide.hover.derivatives import derivative_text
from potto.ide.model import CodeLens
from potto.ide.names.documents import kind_of
from potto.ide.names.live_expressions import lives
from potto.ide.names.places import all_chunks, owner
from potto.ide.names.points import points
from potto.ide.names.symbols import DefinitionSymbol
from potto.ide.navigation.references import occurrences_of
from potto.query import Database
from potto.source import Span

LONG_CALL = 40  # characters of a call beyond which a title does not show it


def code_lenses(db: Database, file: str) -> tuple[CodeLens, ...]:
    """For each definition: evaluate or differentiate it, show its derivative, and who uses it; for scripts: run."""
    found: list[CodeLens] = []
    running = False
    for chunk in all_chunks(db, file):
        sketch, name = chunk.sketch(db), owner(db, chunk)
        if name is not None:
            found += _of_definition(db, file, name, chunk.absolute(sketch.name_span))
        elif sketch.kind == "statement" and not running:
            running = True
            found.append(CodeLens(chunk.absolute(sketch.span), "run", (file,), "run"))
        for live in lives(db, chunk.text) if "#>" in chunk.text else ():
            found.append(CodeLens(chunk.absolute(live.span), "evaluate", (file, live.text), "evaluate"))
    return tuple(sorted(found, key=lambda lens: lens.span.start))


def _of_definition(db: Database, file: str, name: str, span: Span) -> Iterator[CodeLens]:
    match kind_of(db, file, name):
        case "constant":
            yield CodeLens(span, "evaluate", (file, name), "evaluate")
        case "function":
            yield CodeLens(span, "evaluate", (file, name))
            yield CodeLens(span, "differentiate", (file, name))
            yield CodeLens(span, "showDerivative", (file, name))
        case _:
            yield CodeLens(span, "showDerivative", (file, name), "show derivative")
    yield CodeLens(span, "showReferences", (file, name, str(span.start)))


def resolve_code_lens(db: Database, lens: CodeLens) -> CodeLens:
    """A lens with its title: where a function is evaluated, how many surfaces it has, how often it is used."""
    match lens.command, lens.arguments:
        case "evaluate" | "differentiate", (file, name) if not lens.title:
            point = next(iter(points(db, file, name)), None)
            if point is None:
                return replace(lens, title=lens.command)
            titled = f"{lens.command} {point.text}" if len(point.text) <= LONG_CALL else lens.command
            return replace(lens, arguments=(file, point.text), title=titled)
        case "showDerivative", (file, name):
            return replace(lens, title=_derivative_title(db, file, name))
        case "showReferences", (file, name, _):
            symbol = DefinitionSymbol(file, name)
            count = sum(1 for _, o in occurrences_of(db, file, symbol) if o.role != "define")
            return replace(lens, title="1 reference" if count == 1 else f"{count} references")
        case _:
            return lens


def _derivative_title(db: Database, file: str, name: str) -> str:
    found = derivative_text(db, file, name)
    count = 0 if found is None else len({s.equation for item in found.integrals for s in item.surfaces})
    if not count:
        return "show derivative"
    return f"show derivative ({count} surface{'' if count == 1 else 's'})"
