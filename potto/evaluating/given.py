"""Other values for names of a program, and for parameters: what `--set NAME=EXPR` gives. Owns `give` and `apart`.

The program is checked and evaluated as if it said so itself: a definition of that name is replaced, else there is one
more. So all who use the name get the new value, functions of the file as well as what is asked for.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Sequence

from potto.checking.library import NO_SUCH_DEFINITION, NOWHERE, Library
from potto.kernels.errors import wrong_call
from potto.modules import chunk_start, definition, names, resolve
from potto.modules.usage import names_in, used_names
from potto.reports.render import Located, ProgramError
from potto.source import SourceText
from potto.syntax import parse_expression
from potto.types import groups_of, infer_expression

Given = Sequence[tuple[str, str]]


def give(library: Library, file: str, given: Given) -> None:
    """Let names at the top of a file have these values. Raises ProgramError for what is no expression."""
    for name, text in given:
        wrong = [d for d in parse_expression(text).diagnostics if d.severity == "error"]
        if wrong:
            where = f"<{name}>"
            source = SourceText(where, text)
            raise ProgramError([Located(where, d) for d in wrong], lambda key, s=source: s)  # type: ignore[misc]
        library.put(file, _changed(library, file, name, text))


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
                f"give the parameter its value without --set: `{name}={text}`",
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


def _changed(library: Library, file: str, name: str, text: str) -> str:
    """The text of a file with a definition. Lines stay where they are."""
    source = library.source(file)
    whole = "" if source is None else source.text
    item = definition(library.db, file, name) if name in names(library.db, file) else None
    if item is None:
        return f"{whole.rstrip()}\n{name} = {text}\n" if whole.strip() else f"{name} = {text}\n"
    start = chunk_start(library.db, file, name) + item.span.start
    end = start + len(item.span)
    lines = whole.count("\n", start, end) - text.count("\n")
    return f"{whole[:start]}{name} = {text}" + "\n" * lines + whole[end:]
