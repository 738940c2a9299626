"""Answers: numbers with the error that they may have, and what they cost.

Owns `Estimate`. A value is a float, an array over the batch that was asked for, a tuple (of such) or, for a function,
None with its text in `text`. An estimate is a number, and an array, itself: the arithmetic is in `arithmetic`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import reduce
from operator import or_
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.integrate.events import Shortfall
from potto.projects.settings import respelled
from potto.runtime.answers.arithmetic import Operators, Pair, applied, operand, reduced
from potto.runtime.answers.named import WithFields
from potto.runtime.answers.printing import (
    MISSED,
    attainable,
    concisely,
    format_count,
    format_fields,
    format_list,
    format_number,
    format_seconds,
    format_tuple,
    led,
)
from potto.runtime.answers.rich import as_html, as_latex


class OneSided(Struct, frozen=True):
    """A surface lies on an edge of the domain, or on another surface that moves otherwise, or folds just here.

    The derivatives on the two sides of the parameters differ, or are infinite. other: the other surface, if there is
    one. fold: whether sections of the surface along the variable appear or merge here. along: whether it is 0 all along
    the variable. kink: whether it is a builtin that has a kink there; without a variable, in a number outside of
    integrals.
    backward_error, forward_error: how far off they may be.
    """

    variable: str
    surface: str | None
    backward: Any
    forward: Any
    other: str | None = None
    fold: bool = False
    backward_error: Any = 0.0
    forward_error: Any = 0.0
    kink: bool = False
    along: bool = False

    def __str__(self) -> str:
        which = f"the surface {self.surface}"
        place = f"lies on a bound of `{self.variable}`" if self.other is None else f"coincides with {self.other}"
        if self.surface is None:
            which, place = "surfaces", f"run along `{self.variable}`"
        elif self.kink or self.along or not self.variable:
            which = f"the {'kink' if self.kink else 'surface'} {self.surface}"
            place = f"lies all along `{self.variable}`" if self.along else "is just here"
        elif self.fold:
            place = f"folds along `{self.variable}`"
        backward, forward = _number(self.backward, self.backward_error), _number(self.forward, self.forward_error)
        if np.isnan([self.backward, self.forward]).all():
            return f"{which} {place}: the one-sided derivatives are not known"
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
UNSHOWN = ("notes", "stats", "shortfalls", "as_records")


class Estimate(Operators, WithFields, Struct, frozen=True, eq=False):
    """The outcome of an evaluation: a number, or an array of them, that knows its error.

    It computes and compares as its value does, with numbers, arrays and other estimates; errors are carried to first
    order. numpy, `math`, `round` and format specifications take it as a number or an array. The answer of a function
    that gives a tuple is a tuple of estimates. A value with its derivative is a pair of two: arithmetic with it is a
    TypeError, because it cannot tell which one is meant.

    value, error: the number and a bound of its absolute error; arrays for a batch, tuples for tuples.
    tangent, tangent_error: the same of the derivative, where a dual was asked for; else None.
    converged: whether the accuracy asked for was reached, by all members of a batch; `reasons` says why not.
    member_converged: the same of each member, an array of the batch's shape; None for a single answer.
    shortfalls: why not, with what helps, and of which members of a batch, as a mask of its shape; True for all.
    evals: evaluations of integrands. seconds, compile_seconds, plan_seconds: time in all, the part that went into what
        is made once (plans, proofs, kernels), and of that the part for plans: which surfaces cut what, where they meet.
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
    plan_seconds: float = 0.0
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
        """What helps against the reasons, each advice once, as Python says it; with the accuracy that can be had, where
        that is known: `potto.settings(rtol=1e-3)`."""
        return respelled(self.options, _of_python)

    @property
    def options(self) -> str:
        """The same with options of the command line: `--rtol 1e-3`."""
        told = "; ".join(dict.fromkeys(why.advice for why in self.shortfalls))
        reached = attainable(*self._shown) if told and self.value is not None else None
        return told if reached is None else told.replace("(`--rtol`)", f"(`--rtol {reached:.0e}`)").replace("e-0", "e-")

    def reasons_of(self, index: Any) -> tuple[str, ...]:
        """Why one member of a batch is not as accurate as was asked: none, if it is."""
        return tuple(why.message for why, where in self.shortfalls.items() if where is True or where[index])

    def summary(self) -> str:
        """All that is known, a line each."""
        shown = {name: getattr(self, name) for name in self.__struct_fields__ if name not in UNSHOWN}
        shown["reasons"] = self.reasons
        lines = [f"{name}: {value}" for name, value in shown.items() if value is not None and not _empty(value)]
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    # A number

    def __float__(self) -> float:
        if self.value is None:
            raise TypeError(f"this answer is a function, not a number: {self.text}")
        if isinstance(self.value, tuple | list):
            raise TypeError(f"this answer is a {type(self.value).__name__} of {len(self.value)} parts, not one number")
        return float(self.value)

    def __int__(self) -> int:
        return int(float(self))

    def __trunc__(self) -> int:
        return int(self)

    def __bool__(self) -> bool:
        return self.value is None or bool(np.all(self._pair[0]) if self.tangent is None else True)

    def __round__(self, digits: int | None = None) -> Any:
        value = self._pair[0]
        return round(float(value), digits) if np.ndim(value) == 0 else np.round(value, digits or 0)

    def __hash__(self) -> int:
        if isinstance(self.value, float) and self.tangent is None:
            return hash(self.value)
        raise TypeError("only an answer that is one number can be hashed")

    def __eq__(self, other: object) -> Any:
        if self.value is None or isinstance(self._parts, tuple | list):
            theirs = other._parts if isinstance(other, Estimate) else other
            return self is other or (self.value is not None and _same(self._parts, theirs))
        return self._compared(np.equal, other)

    def __ne__(self, other: object) -> Any:
        same = self.__eq__(other)
        return same if same is NotImplemented else ~same if isinstance(same, np.ndarray) else not same

    def _computed(self, ufunc: np.ufunc, *operands: Any, **options: Any) -> Any:
        """What a ufunc makes of operands: an estimate where its error is known."""
        pairs: list[Pair] = []
        for item in operands:
            pair = item._pair if isinstance(item, Estimate) else operand(item)
            if pair is None:
                return NotImplemented
            pairs.append(pair)
        value, error = applied(ufunc, pairs, **options)
        return value if error is None else _combined([e for e in operands if isinstance(e, Estimate)], value, error)

    @property
    def _pair(self) -> Pair:
        """Value and error of what is one number, or one array. Raises TypeError for all others."""
        if self.tangent is not None:
            raise TypeError("this answer is a value with its derivative: write `.value` or `.tangent` for one of them")
        if self.value is None or isinstance(self.value, tuple):
            float(self)
        return (np.asarray(self.value), np.asarray(self.error)) if isinstance(self.value, list) else (
            self.value, self.error)  # fmt: skip

    # An array

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        if self.value is None:
            float(self)
        return np.array(self._parts, dtype=float if dtype is None else dtype)

    def __dlpack__(self, **options: Any) -> Any:
        return np.asarray(self).__dlpack__(**options)

    def __dlpack_device__(self) -> Any:
        return np.asarray(self).__dlpack_device__()

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        if method == "__call__" and ufunc.nout == 1 and not options.keys() & {"out", "where"}:
            return self._computed(ufunc, *inputs, **options)
        if method == "reduce" and inputs[0] is self and options.get("out") is None:
            value, error = reduced(ufunc, self._pair, **options)
            return value if error is None else _combined([self], value, error)
        plain = [np.asarray(item) if isinstance(item, Estimate) else item for item in inputs]
        return getattr(ufunc, method)(*plain, **options)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the value, as of an array; () for one number."""
        return np.shape(self._parts)

    @property
    def ndim(self) -> int:
        """The number of axes of the value."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """How many numbers the value has."""
        return math.prod(self.shape)

    @property
    def _parts(self) -> Any:
        return self.value if self.tangent is None else (self.value, self.tangent)

    def __len__(self) -> int:
        if not isinstance(self._parts, tuple | list) and not np.ndim(self.value):
            raise TypeError("this answer is one number and has no length")
        return len(self._parts)

    def __iter__(self) -> Iterator[Estimate]:
        return (self._part(place) for place in range(len(self)))

    def __getitem__(self, index: Any) -> Any:
        len(self)  # of one number there are no parts
        return self._part(index)

    def _part(self, index: Any) -> Estimate:
        plain = _plain(self, {"tangent": None, "tangent_error": None})
        if isinstance(self._parts, tuple | list):
            errors = self.error if self.tangent is None else (self.error, self.tangent_error)
            return replace(plain, value=_number_or(self._parts[index]), error=_number_or(errors[index]))
        error = np.broadcast_to(self.error, self.shape)[index]
        batch = np.ndim(self.member_converged)
        members, masks = self.member_converged, self.shortfalls
        if batch == self.ndim:
            members = members[index]
            masks = {why: where if where is True else where[index] for why, where in masks.items()}
            masks = {why: where for why, where in masks.items() if np.any(where)}
            if np.ndim(members) == 0:
                return replace(plain, value=float(self.value[index]), error=float(error), converged=bool(members),
                               member_converged=None, shortfalls=dict.fromkeys(masks, True))  # fmt: skip
            return replace(plain, value=self.value[index], error=error, converged=bool(np.all(members)),
                           member_converged=members, shortfalls=masks)  # fmt: skip
        return replace(plain, value=_number_or(self.value[index]), error=_number_or(error))

    # A text

    @property
    def _cost(self) -> str:
        return f"{format_count(self.evals, 'evaluation')}  {format_seconds(self.seconds)}"

    def __str__(self) -> str:
        """The number with its error, and that it missed its tolerance if it did."""
        return repr(self).removesuffix(f"  {self._cost}")

    def __format__(self, spec: str) -> str:
        """The value by the specification of a float, each number of it; without one, with its error."""
        return str(self) if not spec or self.value is None else _formatted(self._parts, spec)

    def __repr__(self) -> str:
        """`0.349858807576(4)  5 evaluations  0.1 ms`."""
        text = concisely(*self._shown) if self.text is None else self.text
        return f"{led(text, self.converged or self.text is not None)}  {self._cost}"

    def _repr_html_(self) -> str:
        return as_html(*self._shown, "" if self.converged else MISSED.strip(), self._cost)

    def _repr_latex_(self) -> str | None:
        return None if self.value is None else as_latex(*self._shown, missed="" if self.converged else MISSED)

    @property
    def _shown(self) -> Pair:
        return self._parts, self.error if self.tangent is None else (self.error, self.tangent_error)


def _of_python(name: str, value: str | None) -> str:
    """A setting as Python's: `potto.settings(rtol=1e-3)`."""
    value = value or "…"
    return f'potto.settings({name}="{value}")' if value[0].isalpha() else f"potto.settings({name}={value})"


def _plain(estimate: Estimate, changes: Mapping[str, Any]) -> Estimate:
    """An estimate of the class itself, whatever it was more."""
    return Estimate(**{name: getattr(estimate, name) for name in Estimate.__struct_fields__} | dict(changes))


def _number_or(part: Any) -> Any:
    """A number of numpy as a float; everything else as it is."""
    return part if isinstance(part, tuple | list | dict) or np.ndim(part) else float(part)


def _same(mine: Any, theirs: Any) -> bool:
    """Whether two values of one form have the same numbers."""
    if isinstance(mine, dict) and isinstance(theirs, dict):
        return mine.keys() == theirs.keys() and all(_same(item, theirs[name]) for name, item in mine.items())
    if isinstance(mine, tuple | list) and isinstance(theirs, tuple | list | np.ndarray):
        return len(mine) == len(theirs) and all(_same(a, b) for a, b in zip(mine, theirs, strict=True))
    if isinstance(mine, tuple | list) or isinstance(theirs, tuple | list | str):
        return False
    return bool(np.array_equal(mine, theirs))


def _formatted(value: Any, spec: str) -> str:
    if isinstance(value, tuple):
        return format_tuple([_formatted(item, spec) for item in value])
    if isinstance(value, dict):
        return format_fields({name: _formatted(item, spec) for name, item in value.items()})
    if isinstance(value, list) or np.ndim(value):
        return format_list([_formatted(item, spec) for item in value], len(value))
    return format(float(value), spec)


def _combined(estimates: Sequence[Estimate], value: Any, error: Any) -> Estimate:
    """The estimate of what was computed from others: it cost what they did, and misses what they missed."""
    first = estimates[0]
    if np.ndim(value) == 0:
        value, error = float(value), float(error)
    changes: dict[str, Any] = {"value": value, "error": np.array(error) if np.ndim(error) else error}
    shape = np.shape(value)
    if len(estimates) > 1 or not shape or np.shape(first.value) != shape:
        wide = _masks(estimates, shape)
        changes |= {"shortfalls": wide, "member_converged": _members(wide, shape)}
    if len(estimates) > 1:
        methods = {word for e in estimates for word in e.method.split("+") if word != "exact"}
        changes |= {
            "converged": all(e.converged for e in estimates), "evals": sum(e.evals for e in estimates),
            "seconds": sum(e.seconds for e in estimates), "method": "+".join(sorted(methods)) or "exact",
            "compile_seconds": sum(e.compile_seconds for e in estimates),
            "plan_seconds": sum(e.plan_seconds for e in estimates),
            "notes": tuple(dict.fromkeys(note for e in estimates for note in e.notes)),
        }  # fmt: skip
    return _plain(first, changes)


def _masks(estimates: Sequence[Estimate], shape: tuple[int, ...]) -> dict[Shortfall, Any]:
    """Of which members of what was computed each shortfall is true."""
    found: dict[Shortfall, list[Any]] = {}
    for estimate in estimates:
        for why, where in estimate.shortfalls.items():
            found.setdefault(why, []).append(_wide(where, shape))
    return {why: reduce(or_, masks) if shape else True for why, masks in found.items()}


def _wide(where: Any, shape: tuple[int, ...]) -> Any:
    try:
        return np.broadcast_to(np.asarray(where), shape)
    except ValueError:  # it was of members that have been added up
        return np.full(shape, bool(np.any(where)))


def _members(masks: Mapping[Shortfall, Any], shape: tuple[int, ...]) -> Any:
    return ~reduce(or_, masks.values(), np.zeros(shape, dtype=bool)) if shape else None
