"""Which definitions can have a condition under an integral: seen from their words and from the types of what they use.

Owns `may_integrate`. Most definitions of most programs cannot; of those no term is made to be looked through.
"""

from __future__ import annotations

from potto.modules import chunk_text, references
from potto.modules.graph import refer
from potto.modules.lookup import DefinitionTarget
from potto.query import Database
from potto.types import shape
from potto.types.types import ArrayOf, Dist, Function, Real, Truth, TupleOf, Type

_INTEGRALS = ("integral", "∫")


def may_integrate(db: Database, file: str, name: str) -> bool:
    """Whether a condition can come under an integral in a definition: under one of its own, or because it gives a
    function to another definition, which may integrate over what it is given. (What others do with numbers is for
    their own check.)"""
    text = chunk_text(db, file, name)
    if text is None or any(word in text for word in _INTEGRALS):
        return True
    targets = {refer(db, file, path, used) for path, used in references(db, file, name)}
    found = (shape(db, target.file, target.name) for target in targets if isinstance(target, DefinitionTarget))
    return not all(map(_takes_numbers, found))


def _takes_numbers(type: Type) -> bool:
    """Whether neither a parameter in any group is a function, or could be, nor the value itself hides one."""
    while isinstance(type, Function):
        if not all(_is_number(parameter.type) for parameter in type.parameters):
            return False
        type = type.result
    return _is_number(type)


def _is_number(type: Type) -> bool:
    if isinstance(type, TupleOf):
        return all(map(_is_number, type.items))
    if isinstance(type, ArrayOf):
        return _is_number(type.item)
    return isinstance(type, Real | Dist | Truth)
