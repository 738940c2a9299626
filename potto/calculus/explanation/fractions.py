"""Numbers of a formula as its program writes them: 1/2, or 0.5 where it has decimals.

Owns `as_the_program_writes`. A term has a number alone, 0.5, whichever way it was written or came about.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any, TypeVar

from msgspec import Struct
from msgspec.structs import fields, replace

from potto.syntax import nodes
from potto.syntax.walk import walk

_DECIMAL = re.compile(r"(?:([/^])|(?<![\w.]))(\d+\.\d+)(?![\w.])(?=(\^?))")  # no place in a tuple, `w.0.1`
_TENTHS = re.compile(r"(?<![\w.*/^)\]])(\d+)/(10+)(?![\w.^])")
_LARGEST = 64  # of what a person divides by

_Found = TypeVar("_Found", bound=Struct)


def as_the_program_writes(found: _Found, program: nodes.Node | None) -> _Found:
    """What is said of a program, with the numbers in its formulas as that has them."""
    written: _Found = _rewritten(found, program is not None and any(map(_is_decimal, walk(program))))
    return written


def _is_decimal(node: nodes.Node) -> bool:
    return isinstance(node, nodes.Number) and not node.text.isdigit()


def _rewritten(found: Any, decimals: bool) -> Any:
    match found:
        case str():
            return _TENTHS.sub(_decimal, found) if decimals else _DECIMAL.sub(_fraction, found)
        case tuple():
            return tuple([_rewritten(item, decimals) for item in found])
        case Struct():
            return replace(found, **{f.name: _rewritten(getattr(found, f.name), decimals) for f in fields(found)})
        case _:
            return found


def _fraction(found: re.Match[str]) -> str:
    before, value = found[1] or "", Fraction(found[2])
    if value.denominator > _LARGEST or value.denominator & (value.denominator - 1):
        return found[0]
    return f"{before}({value})" if before or found[3] else str(value)


def _decimal(found: re.Match[str]) -> str:
    digits = len(found[2]) - 1
    return f"{int(found[1]) / int(found[2]):.{digits}f}".rstrip("0").rstrip(".")
