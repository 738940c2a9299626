"""Functions as values at run time.

Owns `Closure`, `Derivative` and `Paired`. A closure is a term with the values of its free variables. `deriv f` keeps
f: where it is called it takes duals; where it is given to a derivative as the dual of f, f itself is differentiated.
A function written by hand for duals (`Paired`) is called with pairs instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from potto.core.terms import Lam
from potto.kernels.cells import Cell, Pattern, Rows, Value, pad


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

    def change(self, how: Callable[[Value], Value]) -> Closure:
        if not self.captured:
            return self
        return Closure(self.lam, {n: how(v) for n, v in self.captured.items()}, self.inexact, self.origin)

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
    """One of several functions for each member of a batch: the one at its place."""

    __slots__ = ("options", "places")

    def __init__(self, options: Sequence[Closure], places: Cell) -> None:
        first = options[0]
        super().__init__(first.lam, {}, any(option.inexact for option in options))
        self.options, self.places = tuple(options), places

    def pattern(self, directions: int) -> Pattern:
        patterns = [option.pattern(directions) for option in self.options]
        return (self.inexact, *(any(p[1 + d] for p in patterns) for d in range(directions)))

    def change(self, how: Callable[[Value], Value]) -> Closure:
        options: list[Any] = [option.change(how) for option in self.options]
        places: Any = how(self.places)
        return Chosen(options, places)


def _moves(value: Value, direction: int) -> bool:
    if isinstance(value, Cell):
        return direction < len(value.t) and value.t[direction] is not None
    if isinstance(value, (tuple, list)):
        return any(_moves(v, direction) for v in value)
    if isinstance(value, Rows):
        return _moves(value.item, direction)
    return bool(value.pattern(direction + 1)[1 + direction])
