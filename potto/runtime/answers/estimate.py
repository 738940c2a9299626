"""Answers: numbers with the error that they may have, and what they cost.

Owns `Estimate`. A value is a float, an array over the batch that was asked for, a tuple (of such) or, for a function,
None with its text in `text`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec import Struct

from potto.integrate.events import Shortfall
from potto.runtime.answers.printing import concisely, format_number, format_seconds, format_tuple


class OneSided(Struct, frozen=True):
    """A surface lies on an edge of the domain, or on another surface that moves otherwise, or folds just here.

    The derivatives on the two sides of the parameters differ, or are infinite. other: the other surface, if there is
    one. fold: whether sections of the surface along the variable appear or merge here. backward_error,
    forward_error: how far off they may be.
    """

    variable: str
    surface: str | None
    backward: Any
    forward: Any
    other: str | None = None
    fold: bool = False
    backward_error: Any = 0.0
    forward_error: Any = 0.0

    def __str__(self) -> str:
        which = f"the surface {self.surface}"
        place = f"lies on a bound of `{self.variable}`" if self.other is None else f"coincides with {self.other}"
        if self.surface is None:
            which, place = "surfaces", f"run along `{self.variable}`"
        elif self.fold:
            place = f"folds along `{self.variable}`"
        backward, forward = _number(self.backward, self.backward_error), _number(self.forward, self.forward_error)
        if np.array_equal(self.backward, self.forward, equal_nan=True):
            return f"{which} {place}: the derivative does not exist ({forward})"
        return f"{which} {place}: the one-sided derivatives differ ({backward} backward, {forward} forward)"


def _empty(value: Any) -> bool:
    return isinstance(value, tuple | Mapping) and not value


def _number(x: Any, error: Any) -> str:
    flat, off = (a.ravel() for a in np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(error, dtype=float)))
    there = np.nonzero(~np.isnan(flat))[0]  # others are members of a batch that have no such sides
    if not there.size:
        return "not known"
    return f"{format_number(flat[there[0]], off[there[0]])}{', ...' if there.size > 1 else ''}"


# What `summary` shows otherwise, or not at all.
UNSHOWN = ("notes", "stats", "shortfalls")


class Estimate(Struct, frozen=True):
    """The outcome of an evaluation.

    value, error: the number and a bound of its absolute error; arrays for a batch, tuples for tuples.
    tangent, tangent_error: the same of the derivative, where a dual was asked for; else None.
    converged: whether the accuracy asked for was reached, by all members of a batch; `reasons` says why not.
    member_converged: the same of each member, an array of the batch's shape; None for a single answer.
    shortfalls: why not, with what helps, and of which members of a batch, as a mask of its shape; True for all.
    evals: evaluations of integrands. seconds, compile_seconds: time in all, and the part that went into what is
        made once: plans, proofs, kernels.
    notes: what a careful reader should know (one-sided derivatives).
    """

    value: Any
    error: Any
    tangent: Any = None
    tangent_error: Any = None
    converged: bool = True
    evals: int = 0
    seconds: float = 0.0
    compile_seconds: float = 0.0
    method: str = "exact"
    notes: tuple[OneSided, ...] = ()
    stats: dict[str, Any] = {}
    text: str | None = None
    member_converged: Any = None
    shortfalls: Mapping[Shortfall, Any] = {}

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the answer is not as accurate as was asked: none, if it is."""
        return tuple(why.message for why in self.shortfalls)

    @property
    def advice(self) -> str:
        """What helps against the reasons, each advice once."""
        return "; ".join(dict.fromkeys(why.advice for why in self.shortfalls))

    def reasons_of(self, index: Any) -> tuple[str, ...]:
        """Why one member of a batch is not as accurate as was asked: none, if it is."""
        return tuple(why.message for why, where in self.shortfalls.items() if where is True or where[index])

    def summary(self) -> str:
        """All that is known, a line each."""
        shown = {name: getattr(self, name) for name in self.__struct_fields__ if name not in UNSHOWN}
        shown["reasons"] = self.reasons
        lines = [f"{name}: {value}" for name, value in shown.items() if value is not None and not _empty(value)]
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def __float__(self) -> float:
        return float(self.value)

    def __repr__(self) -> str:
        """`0.349858807576(4)  5 evaluations  0.1 ms`."""
        text = self.text
        if text is None:
            text = concisely(self.value, self.error)
            if self.tangent is not None:
                text = format_tuple([text, concisely(self.tangent, self.tangent_error)])
        missed = "" if self.converged or self.text is not None else " (not converged)"
        return f"{text}{missed}  {self.evals:,} evaluations  {format_seconds(self.seconds)}"
