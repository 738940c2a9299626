"""What is said about the imports of a file, one by one. Spans are relative to the import's chunk."""

from __future__ import annotations

import os.path
from collections.abc import Iterator

from potto.diagnostics import Diagnostic, Kind
from potto.modules.builtins import is_builtin
from potto.modules.graph import import_cycle
from potto.modules.hints import elsewhere, library_hint, looked_in, near_modules
from potto.modules.kinds import (
    CIRCULAR,
    HIDES_BUILTIN,
    IMPORTED_TWICE,
    ITSELF,
    MUTUAL,
    NO_MODULE,
    NOT_IN_MODULE,
    NOT_TEXT,
    TWO_FILES,
    TWO_MEANINGS,
    UNREADABLE,
    UNUSED_IMPORT,
)
from potto.modules.lookup import (
    ImportBinding,
    Trail,
    bindings,
    find_module,
    is_written,
    locate,
    meaning,
    trail,
    written_names,
)
from potto.modules.texts import Importing, Unreadable, imports, names, outline, problem
from potto.modules.usage import unused_imports
from potto.query import Database, query
from potto.reports.near import did_you_mean, instead, near_names
from potto.source import Span
from potto.syntax import nodes

Said = tuple[int, Diagnostic]  # the number of the import, and what is said about it


@query(travels=True)
def import_diagnostics(db: Database, file: str) -> tuple[Said, ...]:
    """Everything about the imports of a file, by the number of the import."""
    items = imports(db, file)
    found = [(number, said) for number, item in enumerate(items) for said in _check(db, file, item)]
    found += _repeated(items)
    wrong = {number for number, said in found if said.severity == "error"}
    found += ((number, said) for number, said in _unused(db, file, items) if number not in wrong)
    if not any(said.code == CIRCULAR.code for _, said in found):
        found += _mutual(db, file, items)
    return tuple(found)


def _check(db: Database, file: str, item: Importing) -> Iterator[Diagnostic]:
    if not is_written(item.module):
        return
    found = locate(db, file, item.module)
    if found is None:
        if not _names_modules(db, file, item):
            yield _no_module(db, file, item)
        return
    if found.other is not None:
        first, second = os.path.basename(found.file), os.path.basename(found.other)
        yield TWO_FILES(
            item.module_span,
            f"`{item.module}` is both `{first}` and `{second}`",
            label=f"`{first}` is taken",
            help="rename one of the files",
        )
    if found.file == file:
        yield ITSELF(
            item.module_span,
            f"the module `{item.module}` imports itself",
            label="this is the file that you are in",
            help="use its names directly; all definitions of a file see each other",
        )
        return
    no_text = problem(db, found.file)
    if no_text is not None:
        yield unreadable(no_text, found.file, item.module_span, f"the module `{item.module}`")
    elif isinstance(item, nodes.FromImport):
        for imported in written_names(item):
            yield from _check_name(db, file, item, imported, found.file)


def _names_modules(db: Database, file: str, item: Importing) -> bool:
    """`from pkg import m` of a folder: fine if every name is a module in it."""
    if isinstance(item, nodes.Import) or not written_names(item):
        return False
    return all(find_module(db, file, f"{item.module}.{imported.name}") is not None for imported in written_names(item))


def _no_module(db: Database, file: str, item: Importing) -> Diagnostic:
    near = near_modules(db, file, item.module)
    wanted = [imported.name for imported in written_names(item)] if isinstance(item, nodes.FromImport) else []
    return NO_MODULE(
        item.module_span,
        f"there is no module `{item.module}`",
        label="not found",
        notes=looked_in(db, file, item.module),
        help=did_you_mean(near) or library_hint(item.module, wanted),
        suggestions=instead(item.module_span, near),
    )


def _check_name(
    db: Database, file: str, item: nodes.FromImport, imported: nodes.ImportedName, module: str
) -> Iterator[Diagnostic]:
    bound = imported.alias or imported.name
    search = trail(db, module, imported.name)
    if search.circular:
        yield _circular(file, item, imported, search)
    elif search.target is None and not _unknowable(db, search):
        if find_module(db, file, f"{item.module}.{imported.name}") is None:
            yield _not_in_module(db, file, item, imported, search)
    elif imported.name == bound and is_builtin(bound):
        yield HIDES_BUILTIN(
            imported.name_span,
            f"the imported `{bound}` hides the builtin `{bound}`",
            label="a builtin in other files",
            help=f"import it under another name: `{imported.name} as my_{bound}`",
        )


def _circular(file: str, item: nodes.FromImport, imported: nodes.ImportedName, search: Trail) -> Diagnostic:
    steps = [file, *(step.file for step in search.steps)]
    first = search.steps[0].file if steps.count(file) < 2 else file
    path = " -> ".join(f"`{_stem(step)}`" for step in [*steps[: _turn(steps)], first])
    return CIRCULAR(
        imported.name_span,
        f"`{imported.name}` is imported in a circle: {path}",
        label=f"`{item.module}` imports it again",
        notes=("no module on the way defines it",),
        help="define it in one of these modules",
    )


def _turn(steps: list[str]) -> int:
    """How many steps are made before the first file comes again."""
    return next((place for place, step in enumerate(steps) if step in steps[:place]), len(steps))


def _unknowable(db: Database, search: Trail) -> bool:
    """Whether the name may well be there: in a file that cannot be read, or in what is half-written."""
    last = search.steps[-1]
    return problem(db, last.file) is not None or outline(db, last.file).nameless


def _not_in_module(
    db: Database, file: str, item: nodes.FromImport, imported: nodes.ImportedName, search: Trail
) -> Diagnostic:
    last = search.steps[-1]
    near = near_names(last.name, names(db, last.file))
    other = elsewhere(db, file, last.name)
    message = f"the module `{item.module}` has no `{imported.name}`"
    label = "not defined there"
    if isinstance(meaning(db, last.file, last.name), ImportBinding):
        message, label = (
            f"`{imported.name}` cannot be imported from the module `{item.module}`",
            "its import there fails",
        )
    elif len(search.steps) > 1:
        message = f"{message}: it is to come from `{_stem(last.file)}`, which does not define `{last.name}`"
    helps = [did_you_mean(near)] if near else []
    if other is not None:
        helps.append(f"it is defined in the module `{other}`: `from {other} import {last.name}`")
    return NOT_IN_MODULE(
        imported.name_span, message, label=label, help="; ".join(helps), suggestions=instead(imported.name_span, near)
    )


def _repeated(items: tuple[Importing, ...]) -> Iterator[Said]:
    """Names that two imports bind."""
    seen: dict[str, ImportBinding] = {}
    for number, item in enumerate(items):
        for (bound, imported), span in zip(bindings(item), _spans(item)):
            before = seen.setdefault(bound, imported)
            if before is imported:
                continue
            if before == imported:
                yield (
                    number,
                    IMPORTED_TWICE(
                        span,
                        f"`{bound}` is imported already",
                        label="once more",
                        help="leave this one out",
                        tags=("unnecessary",),
                    ),
                )
            else:
                yield (
                    number,
                    TWO_MEANINGS(
                        span,
                        f"`{bound}` is imported from `{before.module}` already",
                        label=f"now from `{imported.module}`",
                        help=f"give one of them another name: `{imported.name or bound} as other_{bound}`",
                    ),
                )


def _unused(db: Database, file: str, items: tuple[Importing, ...]) -> Iterator[Said]:
    unused = unused_imports(db, file)
    defined, seen = set(names(db, file)), set[str]()
    for number, item in enumerate(items):
        for (bound, _), span in zip(bindings(item), _spans(item)):
            if bound in unused and bound not in seen and bound not in defined:
                yield (
                    number,
                    UNUSED_IMPORT(
                        item.span if isinstance(item, nodes.Import) or len(written_names(item)) == 1 else span,
                        f"the import `{bound}` is not used",
                        label="never used",
                        help="leave it out",
                        tags=("unnecessary",),
                    ),
                )
            seen.add(bound)


def _mutual(db: Database, file: str, items: tuple[Importing, ...]) -> Iterator[Said]:
    """A circle of files, said once in each of them, at the import with which it begins there."""
    cycle = import_cycle(db, file)
    if not cycle:
        return
    for number, item in enumerate(items):
        targets = {find_module(db, file, module) for module in _modules(item)}
        if cycle[1] in targets:
            path = " -> ".join(f"`{_stem(step)}`" for step in cycle)
            yield (
                number,
                MUTUAL(
                    item.module_span,
                    f"modules import each other: {path}",
                    label="leads back here",
                    help="move what they share into a module of its own",
                ),
            )
            return


def _modules(item: Importing) -> Iterator[str]:
    yield item.module
    if isinstance(item, nodes.FromImport):
        yield from (f"{item.module}.{imported.name}" for imported in written_names(item))


def _spans(item: Importing) -> tuple[Span, ...]:
    """The places of what an import binds, in the order of `bindings`."""
    if isinstance(item, nodes.FromImport):
        return tuple(imported.span for imported in written_names(item))
    return (item.alias_span or item.module_span,)


def unreadable(problem: Unreadable, path: str, span: Span, what: str) -> Diagnostic:
    """What is said of a file that is there but gives no text."""
    kind: Kind = NOT_TEXT if problem.reason == "not text" else UNREADABLE
    match problem.reason:
        case "folder":
            message = f"{what} is a folder, not a file"
        case "not a file":
            message = f"{what} is not an ordinary file"
        case "too large":
            message = f"{what} is too large to be a program ({problem.detail})"
        case "no access":
            message = f"{what} cannot be read: {problem.detail}"
        case "not text":
            message = f"{what} is not UTF-8 text: {problem.detail} at byte {problem.offset}"
    help = "save it as UTF-8" if kind is NOT_TEXT else ""
    notes = () if path.endswith("<stdin>") else (f"the file is {path}",)
    return kind(span, message, notes=notes, help=help)


def _stem(file: str) -> str:
    return os.path.splitext(os.path.basename(file))[0]
