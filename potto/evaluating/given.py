"""Other values for names of a program, and for parameters: what `--set NAME=EXPR` gives. Owns `give` and `apart`, and
`as_typed`: what is wrong with such a value is told in the words of the command line.

The program is checked and evaluated as if it said so itself: a definition of that name is replaced, else there is one
more. So all who use the name get the new value, functions of the file as well as what is asked for.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Sequence

from msgspec.structs import replace

from potto.checking.library import NO_SUCH_DEFINITION, Library
from potto.checking.spoiled import definition_errors
from potto.diagnostics import Diagnostic, Related
from potto.kernels.errors import wrong_call
from potto.modules import DefinitionTarget, chunk_start, definition, names, resolve
from potto.modules.usage import names_in, used_names
from potto.reports.render import Located, ProgramError, display_name
from potto.source import NOWHERE, SourceText, Span
from potto.syntax import parse_expression
from potto.types import groups_of, infer_expression, interface
from potto.types.mismatches import rows_of

Given = Sequence[tuple[str, str]]
COMMAND_LINE = "<command line>"
_LOADED = re.compile(r'\(?load\("(?P<path>[^"]*)"\)(?:\)\.(?P<column>\w+))?')


def give(library: Library, file: str, given: Given) -> None:
    """Let names at the top of a file have these values. Raises ProgramError for what is wrong with one."""
    for name, text in given:
        wrong = [Located(COMMAND_LINE, d) for d in parse_expression(text).diagnostics if d.severity == "error"]
        if wrong:
            raise as_typed(f"--set {name}=", text, wrong, library)
        library.put(file, _changed(library, file, name, _in_rows(library, file, name, text)))
    for name, text in given:
        own = definition_errors(library.db, DefinitionTarget(file, name))
        if own:
            start = _start(library, file, name) + len(f"{name} = ")
            moved = [Located(COMMAND_LINE, _moved(located.diagnostic, file, -start)) for located in own]
            raise as_typed(f"--set {name}=", text, moved, library)


def _in_rows(library: Library, file: str, name: str, text: str) -> str:
    """What a file holds as an array of records, where the name stood for such."""
    if not _LOADED.fullmatch(text) or name not in names(library.db, file):
        return text
    table = infer_expression(library.db, file, parse_expression(text).expr).type
    return rows_of(table, interface(library.db, file, name).type, text) or text


def as_typed(before: str, text: str, wrong: Iterable[Located], library: Library) -> ProgramError:
    """What is wrong with a value, shown where it was typed. before: what stands before it there. wrong: with places in
    the text; what a file holds was typed as `@heights.csv`, which is pointed at as a whole."""
    words, path, shown = _words(text)
    source = SourceText(COMMAND_LINE, f"{before}{words}")
    told = []
    for located in wrong:
        found = _moved(located.diagnostic, None, len(before))
        if path:
            whole = Span(len(before), len(source.text))
            found = replace(found, span=whole, message=found.message.replace(path, shown))
        told.append(Located(COMMAND_LINE, replace(found, suggestions=())))
    return ProgramError(told, lambda key: source if key == COMMAND_LINE else library.source(key))


def _words(text: str) -> tuple[str, str, str]:
    """A value as it was typed; where it is what a file holds, also the name of the file in the text, and as typed."""
    loaded = _LOADED.fullmatch(text)
    if loaded is None:
        return text, "", ""
    path, column = loaded["path"], loaded["column"]
    shown = display_name(path)
    return f"@{shown}:{column}" if column else f"@{shown}", path, shown


def _moved(diagnostic: Diagnostic, file: str | None, by: int) -> Diagnostic:
    """A diagnostic whose text begins elsewhere. file: where what stands before that text stays."""

    def place(related: Related) -> Related:
        if related.file not in (None, file):
            return related
        if related.span.start + by < 0:
            return replace(related, file=file)
        return replace(related, file=None, span=related.span.shift(by))

    own = diagnostic.span.shift(max(by, -diagnostic.span.start))
    return replace(diagnostic, span=own, related=tuple(map(place, diagnostic.related)))


def apart(library: Library, file: str, given: Given, function: str, taken: Collection[str]) -> tuple[Given, Given]:
    """What is said of names of a program, and what of parameters of a function. taken: parameters of which something is
    said elsewhere. Raises ProgramError for a name that may be either."""
    parameters = parameters_of(library, file, function)
    for_names, for_parameters = [], []
    for name, text in given:
        known = resolve(library.db, file, name) is not None
        if name not in parameters or (known and name in taken):
            for_names.append((name, text))
        elif known:
            raise wrong_call(
                f"`{name}` is a name of the program, and a parameter of `{function}`, too",
                f"give the parameter its value without --set: `{name}={_words(text)[0]}`",
            )
        else:
            for_parameters.append((name, text))
    return for_names, for_parameters


def parameters_of(library: Library, file: str, function: str) -> tuple[str, ...]:
    """The names of the parameters of a function that is written with a file's names in scope; none if it is none."""
    type = infer_expression(library.db, file, parse_expression(function).expr).type
    return tuple(parameter.name for group in groups_of(type) for parameter in group if parameter.name)


def nobody_asks(library: Library, file: str, given: Given, texts: Sequence[str]) -> list[str]:
    """The names that a file neither has nor uses, and none of the texts that are read in its scope."""
    strange = [name for name, _ in given if resolve(library.db, file, name) is None]
    if not strange:
        return []
    used = set(used_names(library.db, file)).union(*map(names_in, texts))
    return [name for name in strange if name not in used]


def unknown(library: Library, name: str, near: Sequence[str] = (), parameters: Sequence[str] = ()) -> ProgramError:
    """What is said of a name that nobody asks for. near: those of the program that it may be meant to be."""
    close = difflib.get_close_matches(name, [*near, *parameters], 1)
    known = ", ".join(f"`{parameter}`" for parameter in parameters)
    help = f"did you mean `{close[0]}`?" if close else f"the parameters are {known}" if known else ""
    what = (
        f"`{name}` is neither a name of the program nor a parameter"
        if parameters
        else f"the program has no `{name}`, and nothing asks for it"
    )
    return ProgramError([Located(None, NO_SUCH_DEFINITION(NOWHERE, what, help=help))], library.source)


def each_once(given: Given) -> None:
    """Raises ProgramError for a name that is given twice."""
    seen: dict[str, str] = {}
    for name, text in given:
        if name in seen:
            raise wrong_call(f"`{name}` is given twice, `{seen[name]}` and `{text}`", "leave out one of them")
        seen[name] = text


def _start(library: Library, file: str, name: str) -> int:
    item = definition(library.db, file, name)
    return chunk_start(library.db, file, name) + (0 if item is None else item.span.start)


def _changed(library: Library, file: str, name: str, text: str) -> str:
    """The text of a file with a definition. Lines stay where they are."""
    source = library.source(file)
    whole = "" if source is None else source.text
    item = definition(library.db, file, name) if name in names(library.db, file) else None
    if item is None:
        return f"{whole.rstrip()}\n{name} = {text}\n" if whole.strip() else f"{name} = {text}\n"
    start = _start(library, file, name)
    end = start + len(item.span)
    lines = whole.count("\n", start, end) - text.count("\n")
    return f"{whole[:start]}{name} = {text}" + "\n" * lines + whole[end:]
