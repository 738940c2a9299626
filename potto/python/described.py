"""What Python's own tools say about functions of Potto: signatures, annotations and docstrings, from the program.

Owns `signature_of`, `annotations_of`, `comment_of`, `identifier`, `typeset_derivative` and `Doc`.
"""

from __future__ import annotations

from inspect import Parameter as Slot
from inspect import Signature
from keyword import iskeyword
from typing import Any

from potto.evaluating.world import World
from potto.modules import DefinitionTarget, resolve
from potto.syntax import nodes
from potto.types import format_type
from potto.types.types import Parameter, Type, groups_of, result_of


def signature_of(type: Type) -> Signature:
    """The parameters of a function, with their types as Potto writes them; those of all groups that are to come."""
    parameters = [parameter for group in groups_of(type) for parameter in group]
    slots = [_named(parameter, place) for place, parameter in enumerate(parameters)]
    unnamed = [place for place, (_, named) in enumerate(slots) if not named]
    last = unnamed[-1] if unnamed else -1  # what stands before one that has no name is given by place as well
    return Signature(
        [
            Slot(
                name, Slot.POSITIONAL_ONLY if place <= last else Slot.POSITIONAL_OR_KEYWORD,
                annotation=format_type(parameter.type),
            )
            for place, (parameter, (name, _)) in enumerate(zip(parameters, slots, strict=True))
        ],
        return_annotation=format_type(result_of(type)),
    )  # fmt: skip


def _named(parameter: Parameter, place: int) -> tuple[str, bool]:
    """The name of a parameter in Python, and whether it can be given by it."""
    name = parameter.name
    return (name, True) if name is not None and identifier(name) else (f"argument_{place + 1}", False)


def identifier(name: str) -> bool:
    """Whether Python can write a name."""
    return name.isidentifier() and not iskeyword(name)


def annotations_of(type: Type) -> dict[str, str]:
    """The types by the names of parameters, and that of the answer under `return`."""
    signature = signature_of(type)
    found = {name: slot.annotation for name, slot in signature.parameters.items()}
    return {**found, "return": signature.return_annotation}


def comment_of(world: World, file: str, expr: nodes.Expr | None) -> str | None:
    """The comment above the definition that a name stands for; without a name, that at the head of the file."""
    from potto.ide.names.descriptions import documentation, module_documentation

    if expr is None:
        return module_documentation(world.db, file) or None
    target = resolve(world.db, file, expr.id) if isinstance(expr, nodes.Name) else None
    if not isinstance(target, DefinitionTarget):
        return None
    return documentation(world.db, target.file, target.name) or None


def typeset_derivative(world: World, file: str, expr: nodes.Expr) -> str | None:
    """The derivative of what an expression stands for, as notebooks typeset it; None where no formula is known."""
    from potto.checking.typeset import derivative_latex, function_derivative

    found = function_derivative(world.db, file, expr, "f")
    text = derivative_latex(found, found.name)
    return None if text is None else f"${text}$"


class Doc:
    """The docstring of a class, and of its instances the comment of what they stand for."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __get__(self, found: Any, owner: Any = None) -> str | None:
        return self.text if found is None else comment_of(found._world, found._file, getattr(found, "_expr", None))
