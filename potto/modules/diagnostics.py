"""What is said about a file as a whole: whether it can be read, its imports, its definitions side by side.

Owns `module_diagnostics`. What is wrong inside a definition is said by the parser and by the types.
"""

from __future__ import annotations

import os.path
from collections.abc import Iterator

from potto.diagnostics import Diagnostic, Related
from potto.modules.builtins import is_builtin
from potto.modules.import_checks import import_diagnostics, unreadable
from potto.modules.kinds import DEFINED_TWICE, HIDES_BUILTIN, HIDES_IMPORT, UNREADABLE
from potto.modules.lookup import bindings
from potto.modules.misread import shift
from potto.modules.texts import (
    DefinitionPlace,
    Unreadable,
    content,
    defined_twice,
    import_starts,
    imports,
    names,
    places,
)
from potto.query import Database, query
from potto.source import Span


@query
def module_diagnostics(db: Database, file: str) -> tuple[Diagnostic, ...]:
    """Everything about a file that concerns more than one of its definitions; all spans are absolute."""
    text = content(db, file)
    if not isinstance(text, str):
        return (_no_text(text, file),)
    starts = import_starts(db, file)
    found = [shift(said, starts[number]) for number, said in import_diagnostics(db, file)]
    found += _definitions(db, file)
    return tuple(sorted(found, key=lambda said: said.span))


def _no_text(problem: Unreadable | None, file: str) -> Diagnostic:
    nowhere, name = Span(0, 0), os.path.basename(file)
    if problem is None:
        return UNREADABLE(nowhere, f"there is no file `{name}`", notes=(f"the file would be {file}",))
    return unreadable(problem, file, nowhere, f"`{name}`")


def _definitions(db: Database, file: str) -> Iterator[Diagnostic]:
    imported = _imported(db, file)
    for name in dict.fromkeys((*defined_twice(db, file), *_hiding(db, file))):
        first, *others = [_span(place) for place in places(db, file, name)]
        for other in others:
            yield DEFINED_TWICE(
                other,
                f"`{name}` is defined twice in this file",
                label="defined again",
                related=(Related(first, f"`{name}` is defined here first", owner=""),),
                help="rename one of the two, or leave one out; the last one counts",
            )
        if name in imported:
            yield HIDES_IMPORT(
                first,
                f"the definition of `{name}` hides the `{name}` that is imported",
                label="hides the import",
                related=(Related(imported[name], "imported here", owner=""),),
                help="rename the definition, or import the other one under another name with `as`",
            )
        if is_builtin(name):
            yield HIDES_BUILTIN(
                first,
                f"the definition of `{name}` hides the builtin `{name}`",
                label="a builtin in other files",
                help="give it another name",
            )


@query
def _hiding(db: Database, file: str) -> tuple[str, ...]:
    """The definitions that are called like an import or a builtin."""
    imported = {name for item in imports(db, file) for name, _ in bindings(item)}
    return tuple([name for name in names(db, file) if name in imported or is_builtin(name)])


def _imported(db: Database, file: str) -> dict[str, Span]:
    """Where each imported name is bound first, absolutely."""
    found: dict[str, Span] = {}
    for start, item in zip(import_starts(db, file), imports(db, file)):
        for name, _ in bindings(item):
            found.setdefault(name, item.span.shift(start))
    return found


def _span(place: DefinitionPlace) -> Span:
    return place.span.shift(place.start)
