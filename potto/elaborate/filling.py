"""Which arguments fill which parameters.

Owns `fill`. Keywords bind by name in any group, the others fill the parameters that are left, in order. A group of n
takes one tuple of n, and one parameter that is a tuple takes its n parts. Groups after the last argument stay open. The
checker of types has the same rules and reports what does not fit; here that gives a reason, for a `Hole`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic, TypeVar

from msgspec import Struct

from potto.elaborate.values import Groups
from potto.types.types import dual_name

V = TypeVar("V")


class GivenArgument(Struct, Generic[V], frozen=True):
    """One argument of a call."""

    name: str | None
    value: V


class Spread(Struct, Generic[V], frozen=True):
    """One argument that fills a whole group."""

    value: V


class TupleArgument(Struct, Generic[V], frozen=True):
    """Several arguments that fill one parameter, a tuple."""

    values: tuple[V, ...]


Filling = tuple[V, ...] | Spread[V] | TupleArgument[V]


def fill(groups: Groups, given: Sequence[GivenArgument[V]], tuples: bool) -> list[Filling[V]] | str:
    """What the groups get, as far as the arguments go, or why they do not fit.

    `tuples`: whether an only argument may be a tuple for a group of several.
    """
    first = groups[0]
    if all(argument.name is None for argument in given):
        if not given:
            return [()] if not first else "the arguments are missing"
        if len(given) == 1 and len(first) > 1 and tuples:
            return [Spread(given[0].value)]
        if len(groups) == len(first) == 1 and len(given) > 1 and first[0].dims in (None, len(given)):
            return [TupleArgument(tuple(argument.value for argument in given))]
    return _placed(groups, given)


def _placed(groups: Groups, given: Sequence[GivenArgument[V]]) -> list[Filling[V]] | str:
    parameters = [slot.name for group in groups for slot in group]
    taken: dict[int, V] = {}
    for argument in given:
        if argument.name is None:
            continue
        places = [place for place, name in enumerate(parameters) if name == argument.name]
        places = places or [place for place, name in enumerate(parameters) if name == dual_name(argument.name)]
        if not places:
            return f"there is no parameter `{argument.name}`"
        if places[-1] in taken:
            return f"the parameter `{argument.name}` is given twice"
        taken[places[-1]] = argument.value
    left = iter([place for place in range(len(parameters)) if place not in taken])
    for argument in given:
        if argument.name is None:
            place = next(left, None)
            if place is None:
                return "there are too many arguments"
            taken[place] = argument.value
    return _grouped(groups, taken)


def _grouped(groups: Groups, taken: dict[int, V]) -> list[Filling[V]] | str:
    filled: list[Filling[V]] = []
    start, end = 0, max(taken) + 1
    for group in groups:
        if start >= end:
            break
        places = range(start, start + len(group))
        if not all(place in taken for place in places):
            return "an argument is missing"
        filled.append(tuple(taken[place] for place in places))
        start += len(group)
    return filled
