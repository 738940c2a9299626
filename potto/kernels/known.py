"""What is known of a value while the kernel that computes it is written.

Owns `Known`: the parts of a number, of a tuple or a list, or the name of a value that only the run will know more of.
"""

from __future__ import annotations

from msgspec import Struct

from potto.kernels.emit import Scalar


class Structure(Struct, frozen=True):
    """A tuple or a list whose parts are known while compiling."""

    parts: tuple[Known, ...]
    is_list: bool


class Dynamic(Struct, frozen=True):
    """A value whose kind is known only at run time: the variable that holds it and what it may carry."""

    name: str
    inexact: bool
    moves: tuple[bool, ...]


Known = Scalar | Structure | Dynamic


def is_inexact(known: Known) -> bool:
    """Whether it carries an error."""
    if isinstance(known, Structure):
        return any(map(is_inexact, known.parts))
    return known.inexact if isinstance(known, Dynamic) else not known.exact


def moves(known: Known, direction: int) -> bool:
    """Whether it may have a tangent in a direction."""
    if isinstance(known, Structure):
        return any(moves(p, direction) for p in known.parts)
    if isinstance(known, Dynamic):
        return known.moves[direction]
    return known.t[direction] is not None
