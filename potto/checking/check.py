"""Everything there is to say about a file: what each floor of the front end has found, with absolute spans.

Owns the gathering and the order. The floors that check (syntax, modules, types, elaboration, diffeomorphisms) know
nothing of each other's messages; here they meet. No numbers, no files, no rendering.
"""

from __future__ import annotations

from collections.abc import Iterable

from msgspec.structs import replace

from potto.calculus.checking.diffeo import check_conditions
from potto.diagnostics import Diagnostic, Related
from potto.modules import chunk_start, module_diagnostics, statements
from potto.modules.graph import Run, name_runs
from potto.modules.misread import moved, piece_diagnostics, syntax_diagnostics
from potto.modules.texts import StatementRef, is_diffeo, piece
from potto.query import Database, query
from potto.reports.render import Located
from potto.types import check_definition, check_statement, interface

_ORDER = {"error": 0, "warning": 1, "info": 2, "hint": 3}


@query(travels=True)
def diagnostics(db: Database, file: str) -> tuple[Located, ...]:
    """Everything about a file, in the order of its text. As one memo, so that a file that an edit does not reach costs
    nothing."""
    found = [*syntax_diagnostics(db, file), *module_diagnostics(db, file)]
    for some in name_runs(db, file):
        for name, said in runs_diagnostics(db, file, some):
            start = chunk_start(db, file, name)
            found += [absolute(db, file, d, start) for d in said]
    for reference in statements(db, file):
        found += statement_diagnostics(db, file, reference)
    return tuple(Located(file, d) for d in arranged(found))


OfNames = tuple[tuple[str, tuple[Diagnostic, ...]], ...]


@query(keep=512)
def runs_diagnostics(db: Database, file: str, some: tuple[Run, ...]) -> OfNames:
    """What is said of some neighbouring runs of definitions."""
    return tuple([each for run in some for each in run_diagnostics(db, file, run)])


@query(keep=2048)
def run_diagnostics(db: Database, file: str, run: Run) -> OfNames:
    """What is said of some neighbouring definitions, by name, of those of which there is something to say."""
    found = [(name, definition_diagnostics(db, file, name)) for name in run]
    return tuple([(name, said) for name, said in found if said])


@query(travels=True)
def definition_diagnostics(db: Database, file: str, name: str) -> tuple[Diagnostic, ...]:
    """What the checks of one definition say, relative to its chunk. What it means is asked only if its types are right:
    the later checks would repeat in other words what is wrong. Of a text that the parser had to guess at nothing more
    is asked either: its diagnostics are the parser's."""
    found = check_definition(db, file, name)
    if has_errors(found) or interface(db, file, name).broken:
        return found
    return (*found, *check_conditions(db, file, name))


@query(keep=512, travels=True)
def check_ahead(db: Database, file: str, text: str) -> tuple[str, ...]:
    """Check a piece of a file before the file is asked for: what the parser says of it, and the definitions in it. The
    names of those."""
    diffeo = is_diffeo(file)
    piece_diagnostics(db, text, diffeo)
    found = tuple(piece(db, text, diffeo).texts)
    for name in found:
        definition_diagnostics(db, file, name)
    return found


def statement_diagnostics(db: Database, file: str, reference: StatementRef) -> list[Diagnostic]:
    """What the types of a statement of a script are said to be wrong in, with absolute spans: nothing where the parser
    had to guess."""
    said = () if reference.broken else check_statement(db, file, reference.statement)
    return [absolute(db, file, d, reference.start) for d in said]


def has_errors(found: Iterable[Diagnostic]) -> bool:
    """Whether there is an error among them."""
    return any(d.severity == "error" for d in found)


def errors_of(located: Iterable[Located]) -> tuple[Located, ...]:
    """The errors among them."""
    return tuple(item for item in located if item.diagnostic.severity == "error")


def absolute(db: Database, file: str, diagnostic: Diagnostic, start: int) -> Diagnostic:
    """A diagnostic of a chunk with all its places counted from the start of their files."""
    related = tuple(_place(db, file, item, start) for item in diagnostic.related)
    return replace(moved(diagnostic, start), related=related)


def _place(db: Database, file: str, related: Related, start: int) -> Related:
    where = related.file if related.file is not None else file
    if related.owner == "":
        offset = 0
    elif related.owner is None:
        offset = start if where == file else 0
    else:
        offset = chunk_start(db, where, related.owner)
    return replace(related, span=related.span.shift(offset), owner="")


def arranged(found: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Each once, by place and then by weight."""
    return sorted(dict.fromkeys(found), key=lambda d: (d.span.start, _ORDER[d.severity], d.span.end, d.code))
