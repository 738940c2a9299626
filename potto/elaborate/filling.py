"""Which arguments fill which parameters.

Owns `fill`. Keywords bind by name in any group, the others fill the parameters that are left, in order. A group of n
takes one tuple of n, and one parameter that is a tuple takes its n parts. A group that gets nothing stays open. The
checker of types has the same rules and reports what does not fit; here that gives a reason, for a `Hole`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from potto.elaborate.values import Groups

V = TypeVar("V")


@dataclass(frozen=True, slots=True)
class Given(Generic[V]):
    """One argument of a call."""

    name: str | None
    value: V


@dataclass(frozen=True, slots=True)
class Spread(Generic[V]):
    """One argument that fills a whole group."""

    value: V


@dataclass(frozen=True, slots=True)
class Packed(Generic[V]):
    """Several arguments that fill one parameter, a tuple."""

    values: tuple[V, ...]


Filled = tuple["tuple[V, ...] | Spread[V] | Packed[V] | None", ...]


def fill(groups: Groups, given: Sequence[Given[V]], tuples: bool) -> Filled[V] | str:
    """What each group gets (None: nothing), or why the arguments do not fit.

    `tuples`: whether an only argument may be a tuple for a group of several.
    """
    if not given:
        return ((),) + (None,) * (len(groups) - 1) if not groups[0] else "an argument is missing"
    total = sum(map(len, groups))
    first = groups[0]
    if all(argument.name is None for argument in given):
        if len(given) == 1 and len(first) > 1 and tuples:
            return (Spread(given[0].value), *(None,) * (len(groups) - 1))
        if len(first) == 1 and len(given) > total and first[0].dims in (None, len(given)):
            return (Packed(tuple(argument.value for argument in given)), *(None,) * (len(groups) - 1))
    return _placed(groups, given)


def _placed(groups: Groups, given: Sequence[Given[V]]) -> Filled[V] | str:
    parameters = [slot.name for group in groups for slot in group]
    taken: dict[int, V] = {}
    for argument in given:
        if argument.name is None:
            continue
        places = [place for place, name in enumerate(parameters) if name == argument.name]
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


def _grouped(groups: Groups, taken: dict[int, V]) -> Filled[V] | str:
    filled: list[tuple[V, ...] | Spread[V] | Packed[V] | None] = []
    start = 0
    for group in groups:
        places = range(start, start + len(group))
        values = tuple(taken[place] for place in places if place in taken)
        if values and len(values) < len(group):
            return "an argument is missing"
        filled.append(values if values else None)
        start += len(group)
    return tuple(filled)
