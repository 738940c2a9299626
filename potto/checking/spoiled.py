"""What stands in the way of an expression: the errors of the definitions that it leads to, and no others.

Owns `standing_in_the_way`. An error spoils its own definition, and so whatever needs that one; everything else of the
file goes on to mean what it says. No numbers.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec.structs import replace

from potto.checking.check import absolute, definition_diagnostics, has_errors, statement_diagnostics
from potto.diagnostics import Diagnostic
from potto.modules import (
    DefinitionTarget,
    StatementRef,
    chunk_start,
    chunks,
    module_diagnostics,
    refer,
    references,
    resolve_module,
    syntax_diagnostics,
)
from potto.modules.builtins import is_builtin
from potto.modules.free import Reference, references_in
from potto.modules.lookup import bindings, meaning, trail
from potto.modules.texts import head, import_starts, imports, is_diffeo, outline
from potto.query import Database, query
from potto.reports.render import Located
from potto.syntax import nodes

Way = tuple[str, ...]  # the definitions on the way from an expression, the last one included


def standing_in_the_way(db: Database, file: str, node: nodes.Expr | nodes.Statement) -> tuple[Located, ...]:
    """The errors of all definitions that an expression or statement of a file needs, with how it comes to them.

    A name that a broken import or a broken piece of text may have meant counts as a definition with its error. What
    is wrong with the expression itself is not among them.
    """
    found: dict[Located, Way] = {}
    seen: set[DefinitionTarget] = set()
    queue: list[tuple[str, Reference, Way]] = [(file, reference, ()) for reference in references_in(node).every]
    for at, (path, name), way in queue:
        target = refer(db, at, path, name)
        if isinstance(target, DefinitionTarget):
            if target not in seen:
                seen.add(target)
                further = (*way, target.name)
                for located in definition_errors(db, target):
                    found.setdefault(located, further)
                used = references(db, target.file, target.name)
                queue += [(target.file, reference, further) for reference in used]
        elif target is None and not (path is None and is_builtin(name)):
            for located in _missing(db, at, path, name):
                found.setdefault(located, (*way, name))
    return tuple(replace(located, diagnostic=_led(located.diagnostic, way)) for located, way in found.items())


def _led(diagnostic: Diagnostic, way: Way) -> Diagnostic:
    """The error with a note about which definition it spoils, and how one came to it."""
    through = " through " + ", ".join(f"`{name}`" for name in way[:-1]) if way[:-1] else ""
    return replace(diagnostic, notes=(*diagnostic.notes, f"`{way[-1]}` is broken by this; it is needed{through} here"))


def definition_errors(db: Database, target: DefinitionTarget) -> tuple[Located, ...]:
    """All errors in the text of a definition, with absolute spans."""
    file, name = target.file, target.name
    found = definition_diagnostics(db, file, name)
    own: list[Diagnostic] = []
    if has_errors(found):
        start = chunk_start(db, file, name)
        own = [absolute(db, file, d, start) for d in found if d.severity == "error"]
    beside = file_errors(db, file)
    if beside:
        start = chunk_start(db, file, name)
        own += _within(db, file, beside, {start})
    return tuple(Located(file, d) for d in dict.fromkeys(own))


@query
def file_errors(db: Database, file: str) -> tuple[Diagnostic, ...]:
    """The errors of a file that no check of a definition finds: of its syntax, its imports, names defined twice."""
    return tuple(d for d in (*syntax_diagnostics(db, file), *module_diagnostics(db, file)) if d.severity == "error")


def statement_errors(db: Database, file: str, reference: StatementRef) -> tuple[Located, ...]:
    """What keeps a statement of a script from being run: its own errors and those of the definitions that it needs."""
    beside = _within(db, file, file_errors(db, file), {reference.start})
    said = statement_diagnostics(db, file, reference)
    own = dict.fromkeys((*beside, *(d for d in said if d.severity == "error")))
    spoiled = standing_in_the_way(db, file, reference.statement)
    return (*(Located(file, d) for d in own), *spoiled)


def _within(db: Database, file: str, found: tuple[Diagnostic, ...], starts: set[int]) -> list[Diagnostic]:
    """Those that lie in the chunks which start at some places."""
    spans = [(chunk.start, chunk.start + len(chunk.text)) for chunk in chunks(db, file) if chunk.start in starts]
    return [d for d in found if any(start <= d.span.start <= end for start, end in spans)]


def _missing(db: Database, file: str, path: str | None, name: str) -> Iterator[Located]:
    """The errors of the imports that a name without a meaning should have come from, or of what cannot be read at all
    and may have defined it."""
    if path is not None:
        module = resolve_module(db, file, path)
        if module is not None:
            yield from _missing(db, module, None, name)
            return
        name = path
    steps = trail(db, file, name).steps
    for step in steps:
        beside = file_errors(db, step.file)
        places = {
            start
            for start, item in zip(import_starts(db, step.file), imports(db, step.file), strict=True)
            if any(bound == step.name for bound, _ in bindings(item))
        }
        yield from (Located(step.file, d) for d in _within(db, step.file, beside, places))
    last = steps[-1]
    if meaning(db, last.file, last.name) is None and outline(db, last.file).nameless:
        yield from (Located(last.file, d) for d in _nameless(db, last.file))


def _nameless(db: Database, file: str) -> list[Diagnostic]:
    """The errors of the pieces of a file of which not even the name can be read."""
    diffeo = is_diffeo(file)
    described = [(chunk, head(db, chunk.text, diffeo)) for chunk in chunks(db, file)]
    starts = {c.start for c, d in described if d.kind == "broken" and d.name is None}
    return _within(db, file, file_errors(db, file), starts)
