"""Functions as values at run time.

Owns `Closure`, `Derivative`, `Paired` and `Chosen`. A closure is a term with the values of its free variables.
`deriv f` keeps f: where it is called it takes duals; where it is given to a derivative as the dual of f, f itself is
differentiated. A function written by hand for duals (`Paired`) is called with pairs instead.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from potto.core.terms import Lam
from potto.kernels.cells import Bools, Cell, Pattern, Rows, Value, pad


class Closure:
    """A function: its term and the values of the term's free variables. `inexact` if its values carry errors."""

    __slots__ = ("captured", "inexact", "lam", "origin")

    def __init__(
        self, lam: Lam, captured: dict[str, Value], inexact: bool, origin: tuple[str, str] | None = None
    ) -> None:
        self.lam = lam
        self.captured = captured
        self.inexact = inexact
        self.origin = origin

    def pattern(self, directions: int) -> Pattern:
        moves = tuple(any(_moves(v, d) for v in self.captured.values()) for d in range(directions))
        return (self.inexact, *moves)

    def held(self) -> Iterable[Value]:
        """The values that belong to it."""
        return self.captured.values()

    def change(self, how: Callable[[Value], Value]) -> Closure:
        if not self.captured:
            return self
        return Closure(self.lam, {n: how(v) for n, v in self.captured.items()}, self.inexact, self.origin)

    def or_other(self, other: Closure, mask: Bools) -> Closure:
        return Chosen([self, other], Cell(np.where(mask, 0.0, 1.0)))

    def padded(self, directions: int) -> Closure:
        return self.change(lambda v: pad(v, directions))


class Derivative(Closure):
    """`deriv f` as a value; `primal` is f."""

    __slots__ = ("primal",)

    def __init__(self, primal: Closure) -> None:
        super().__init__(primal.lam, primal.captured, primal.inexact, primal.origin)
        self.primal = primal

    def change(self, how: Callable[[Value], Value]) -> Closure:
        return Derivative(self.primal.change(how))


class Paired(Closure):
    """A function on duals, written by hand, standing for the function whose dual it is; `pairs` takes the pairs."""

    __slots__ = ("pairs",)

    def __init__(self, pairs: Closure) -> None:
        super().__init__(pairs.lam, pairs.captured, pairs.inexact, pairs.origin)
        self.pairs = pairs

    def pattern(self, directions: int) -> Pattern:
        return (self.inexact, *(True for _ in range(directions)))

    def change(self, how: Callable[[Value], Value]) -> Closure:
        return Paired(self.pairs.change(how))


class Chosen(Closure):
    """One of several functions for each member of a batch: the one at its place.

    Its own term is that of the first: what asks for terms takes members apart before (`settled`).
    """

    __slots__ = ("options", "places")

    def __init__(self, options: Sequence[Closure], places: Cell) -> None:
        first = options[0]
        super().__init__(first.lam, {}, any(option.inexact for option in options))
        self.options, self.places = tuple(options), places

    def pattern(self, directions: int) -> Pattern:
        patterns = [option.pattern(directions) for option in self.options]
        return (self.inexact, *(any(p[1 + d] for p in patterns) for d in range(directions)))

    def held(self) -> Iterable[Value]:
        return (self.places, *self.options)

    def change(self, how: Callable[[Value], Value]) -> Closure:
        options: list[Any] = [option.change(how) for option in self.options]
        places: Any = how(self.places)
        return Chosen(options, places)


def holds_functions(value: Value) -> bool:
    """Whether there is a function in a tuple or array, however deep."""
    return isinstance(value, Closure) or (isinstance(value, tuple | list) and any(map(holds_functions, value)))


def chosen(options: Sequence[Closure], places: Any, among: Callable[[list[Any], Any], Value]) -> Closure:
    """The functions at places, for a batch: those of one term are one function of what each of them has captured.

    among: from values, one for each of the options, and places, the values there.
    """
    kinds: dict[object, list[int]] = {}
    for number, option in enumerate(options):
        kind = option.lam if type(option) is Closure else id(option)
        kinds.setdefault((kind, option.inexact), []).append(number)
    merged: list[Closure] = []
    group, within = np.empty(len(options), dtype=np.int64), np.zeros(len(options), dtype=np.int64)
    for own, numbers in enumerate(kinds.values()):
        group[numbers], within[numbers] = own, np.arange(len(numbers))
        first = options[numbers[0]]
        if len(numbers) > 1 and first.captured:
            at = np.where(group[places] == own, within[places], 0)
            held = {n: among([options[i].captured[n] for i in numbers], at) for n in first.captured}
            first = Closure(first.lam, held, first.inexact, first.origin)
        merged.append(first)
    return merged[0] if len(merged) == 1 else Chosen(merged, Cell(group[places].astype(float)))


def settled(value: Value) -> Value:
    """The value, of its functions that are chosen those that all members have chosen."""
    if isinstance(value, tuple):
        return tuple([settled(item) for item in value])
    if isinstance(value, list):
        return [settled(item) for item in value]
    if not isinstance(value, Closure):
        return value
    if isinstance(value, Chosen) and np.ptp(places := np.asarray(value.places.v)) == 0:
        return settled(value.options[int(places.flat[0])])
    return value.change(settled) if any(True for _ in choices(value)) else value


def choices(value: Value) -> Iterator[Chosen]:
    """The functions in a value that not all members have chosen alike, outer ones first."""
    if isinstance(value, Chosen):
        yield value
    if isinstance(value, Closure):
        for inner in value.held():
            yield from choices(inner)
    elif isinstance(value, tuple | list):
        for inner in value:
            yield from choices(inner)


def carries_errors(value: Value) -> bool:
    """Whether a number in it is not exact."""
    if isinstance(value, Cell):
        return value.e is not None
    if isinstance(value, tuple | list):
        return any(map(carries_errors, value))
    if isinstance(value, Rows):
        return carries_errors(value.item)
    return isinstance(value, Closure) and value.inexact


def _moves(value: Value, direction: int) -> bool:
    if isinstance(value, Cell):
        return direction < len(value.t) and value.t[direction] is not None
    if isinstance(value, (tuple, list)):
        return any(_moves(v, direction) for v in value)
    if isinstance(value, Rows):
        return _moves(value.item, direction)
    return bool(value.pattern(direction + 1)[1 + direction])
