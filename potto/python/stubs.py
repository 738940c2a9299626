"""What a program defines, as a stub of Python: for type checkers and editors, which cannot read programs.

Owns `stub`. A file is a class of the kind `potto.Module`, each of its functions one of the kind `potto.Function` whose
`__call__` has the parameters of the program.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence

from potto.checking.check import definition_diagnostics, has_errors
from potto.evaluating.world import World
from potto.modules import DefinitionTarget, names, resolve
from potto.python.described import comment_of, identifier
from potto.source import Span
from potto.syntax import nodes
from potto.types import format_type, interface
from potto.types.types import ArrayOf, Diffeo, Dist, Function, Parameter, Real, TupleOf, Type, Unknown, groups_of
from potto.types.types import resolve as known

HEAD = '''\
"""{title}: types for checkers, written by `potto stubs`.

    from typing import TYPE_CHECKING, cast
    if TYPE_CHECKING:
        from {module} import {name}
    m = cast("{name}", potto.load({title!r}))
"""

from collections.abc import Mapping, Sequence
from typing import Any, SupportsFloat, overload

from numpy.typing import ArrayLike
from potto import Estimate, Function, Module

Number = SupportsFloat | ArrayLike
'''


def stub(world: World, file: str) -> str:
    """The text of the stub of a file. What is broken in it is left out."""
    leaf = os.path.splitext(os.path.basename(file))[0]
    name = "".join(word[:1].upper() + word[1:] for word in _word(leaf).split("_")) or "Program"
    classes: list[str] = []
    members: list[str] = []
    for defined in _defined(world, file):
        type = known(interface(world.db, file, defined).type)
        doc = comment_of(world, file, nodes.Name(Span(0, 0), defined))
        if isinstance(type, Function | Diffeo):
            classes.append(_function(f"_{defined}", type, doc))
            members.append(f"    {defined}: _{defined}")
        elif not isinstance(type, Unknown):
            members += [f"    {defined}: Estimate", *([_quoted(doc)] if doc else [])]
    head = HEAD.format(title=os.path.basename(file), module=_word(leaf), name=name)
    doc = comment_of(world, file, None)
    body = [*([_quoted(doc)] if doc else []), *members] or ["    ..."]
    return "\n\n".join([head.rstrip(), *classes, "\n".join([f"class {name}(Module):", *body])]) + "\n"


def _defined(world: World, file: str) -> Iterator[str]:
    """The names that a file defines itself, which Python can write."""
    for name in sorted(names(world.db, file)):
        target = resolve(world.db, file, name)
        own = isinstance(target, DefinitionTarget) and target.file == file and identifier(name)
        if own and not has_errors(definition_diagnostics(world.db, file, name)):
            yield name


def _word(text: str) -> str:
    """A file's name as a module of Python."""
    kept = "".join(char if char.isalnum() else "_" for char in text)
    return kept if kept[:1].isalpha() else f"_{kept}"


def _function(name: str, type: Function | Diffeo, doc: str | None) -> str:
    """The class of a function: called with all groups, or with the first ones, for a function of the others."""
    groups = groups_of(type)
    lines = [f"class {name}(Function):", _quoted(f"`{format_type(type)}`" + (f"\n\n{doc}" if doc else ""))]
    calls = [([*sum(groups[:count], ())], "Function" if count < len(groups) else "Estimate")
             for count in range(1, len(groups) + 1)] or [([], "Estimate")]  # fmt: skip
    for parameters, answer in calls:
        if len(calls) > 1:
            lines.append("    @overload")
        lines.append(f"    def __call__({', '.join(['self', *_slots(parameters)])}) -> {answer}: ...")
    return "\n".join(lines)


def _slots(parameters: Sequence[Parameter]) -> list[str]:
    unnamed = [place for place, p in enumerate(parameters) if not (p.name and identifier(p.name))]
    slots = [
        f"{p.name if p.name and identifier(p.name) else f'argument_{place + 1}'}: {_annotation(p.type)}"
        for place, p in enumerate(parameters)
    ]
    return slots if not unnamed else [*slots[: unnamed[-1] + 1], "/", *slots[unnamed[-1] + 1 :]]


def _annotation(type: Type) -> str:
    """What Python may give for a parameter."""
    match known(type):
        case Real() | Dist():
            return "Number"
        case TupleOf(items, record=record):
            parts = f"tuple[{', '.join(map(_annotation, items))}] | Sequence[Any] | ArrayLike"
            return f"{parts} | Mapping[str, Any]" if record is not None else parts
        case ArrayOf():
            return "ArrayLike | Sequence[Any]"
        case Function() | Diffeo():
            return "Function"
        case _:
            return "Any"


def _quoted(text: str) -> str:
    """A docstring."""
    blanks = "    "
    lines = text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"').split("\n")
    if len(lines) == 1 and not lines[0].endswith('"'):
        return f'{blanks}"""{lines[0]}"""'
    if len(lines) == 1:
        return blanks + json.dumps(text)
    return "\n".join([f'{blanks}"""{lines[0]}', *(blanks + line if line else "" for line in lines[1:]), f'{blanks}"""'])
