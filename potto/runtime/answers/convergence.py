"""Whether an answer is as accurate as was asked for; and if not, why, member by member.

Owns `Shortfalls`, `Rough`, `Precise`, `missed`, `missing`, `precise` and `rounded`. Converged means: the error is
within `rtol * |value|`, or within `atol`. An answer that is 0 because its parts cancel has no digits that could be
relative to it: what its error may be then, `allowances` says.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.core.terms import Integral
from potto.integrate.columns import distinct
from potto.integrate.events import (
    CANCELLED,
    INFINITE,
    NO_BOUND,
    NO_DIGITS,
    NO_VALUE,
    NOT_A_NUMBER,
    ROUNDED,
    STEEP,
    TOO_FEW,
    TOO_LARGE,
    UNBOUNDED_SAMPLES,
    Shortfall,
)
from potto.integrate.pieces import Sums, added_up, together
from potto.integrate.precision import imprecise, rough_places
from potto.kernels.cells import Array, Bools, Cell, Ints, Number, Value
from potto.projects.settings import Settings
from potto.runtime.answers.allowances import Allowed, allowance

# What is a speck, beside the largest of a batch.
SPECK = 1e-15
# From which part of a value on an error is more than rounding, and up to which it is nothing else.
LOST, ONLY_ROUNDED = 0.1, 1e-6

# Why answers are not as accurate as asked for, and of which members of a batch: a mask, or True for all of them.
Shortfalls = dict[Shortfall, Any]


def missing(term: Integral, sums: Sums, settings: Settings, env: dict[str, Value]) -> Bools:
    """The members of a batch of integrals for which it pays to look further: values or derivatives are not as accurate
    as was asked for, and what is off is not a speck beside what the others come to. Those that go into one sum are
    measured by it."""
    out: Bools = np.zeros(sums.v.shape[-1], dtype=bool)
    whole, rest = together(env, sums.v), np.arange(out.size)
    if whole is sums.v:  # each by itself: mostly all are precise, whatever else would do
        rest = distinct(np.concatenate([
            imprecise(*pair, settings.rtol) for pair in ((sums.v, sums.e), (sums.t, sums.et))
        ]))  # fmt: skip
        if not rest.size:
            return out
    few, gross = sums.pick(rest), None if sums.gross is None else together(env, sums.gross).take(rest, -1)
    own = whole.take(rest, -1)
    within = np.broadcast_to(allowance(term, replace(few, v=own, gross=gross), settings.rtol), rest.shape)
    for number, error, every in ((own, few.e, whole), (few.t, few.et, sums.t)):
        known = error <= np.maximum(settings.atol, settings.rtol * np.abs(number))
        known |= error <= np.maximum(within, SPECK * _largest(every))
        if number is few.t:
            known |= added_up(env, sums.t, sums.et, settings.rtol).take(rest, -1)
        known &= np.isfinite(error)  # of what may be infinite, and may be anything, nothing is known yet
        out[rest] |= ~known.reshape(-1, rest.size).all(axis=0)
    return out


def _largest(numbers: Array) -> Array:
    """Of numbers (..., B) the largest finite ones without regard to sign, (..., 1)."""
    found = np.maximum(np.abs(numbers.max(axis=-1, initial=0.0)), np.abs(numbers.min(axis=-1, initial=0.0)))
    if not np.isfinite(found).all():
        size = np.abs(numbers)
        found = np.max(size, axis=-1, initial=0.0, where=np.isfinite(size))
    return np.asarray(found[..., None])


def precise(numbers: Number | None, errors: Number | None, rtol: float) -> bool:
    """Whether each number is there, finite and known to this part of it."""
    if numbers is None or errors is None:
        return False
    if numbers.__class__ is float and errors.__class__ is float:
        return errors <= rtol * abs(numbers) < np.inf
    return next(rough_places(numbers, errors, rtol), None) is None


class Rough(Struct, frozen=True):
    """A number, or one of each member of a batch, that is not precise everywhere, with its errors, and the places in
    the batch, as a row, at which it is not."""

    number: Number
    error: Number
    places: Ints

    @property
    def sizes(self) -> tuple[Array, Array]:
        """The numbers there without their signs, and their errors."""
        number, error = np.broadcast_arrays(np.asarray(self.number, dtype=float), np.asarray(self.error, dtype=float))
        return np.abs(number.take(self.places)), error.take(self.places)

    @property
    def unknown(self) -> bool:
        """Whether rules of errors come to no number for one of them."""
        return bool(np.isnan(self.sizes[1]).any())

    def mask(self, some: Any = slice(None)) -> Any:
        """A mask of the batch for some of the places; True where there is no batch."""
        shape = np.broadcast_shapes(np.shape(self.number), np.shape(self.error))
        found = np.zeros(shape, dtype=bool)
        found.reshape(-1)[self.places[some]] = True
        return found


class Precise(Struct, frozen=True):
    """Sums of a batch whose numbers are known to be precise but for those of some members, as who found them has told:
    large arrays take as long to be looked at again as to be made. pairs: these numbers with their errors, as they are
    in an answer."""

    sums: Sums
    rest: Ints
    pairs: tuple[tuple[Number, Number], ...] = ()

    def shown(self, sums: Sums, cells: Iterable[Cell]) -> Precise | None:
        """The same of the numbers that these sums are in an answer; None if they are not those that it is known of."""
        if sums is not self.sums:
            return None
        found = (pair for cell in cells for pair in ((cell.v, cell.e), *zip(cell.t, cell.et, strict=True)))
        return Precise(sums, self.rest, tuple(found))  # type: ignore[arg-type]

    def places(self, number: Number, error: Number, rtol: float) -> list[Ints] | None:
        """Where a number of these is not precise; None if it is another one."""
        if not any(number is own and error is off for own, off in self.pairs):
            return None
        some, off = (np.reshape(part, -1).take(self.rest) for part in (number, error))
        return [self.rest[found] for found in rough_places(some, off, rtol)]


def rough_of(pairs: Iterable[tuple[Number, Number]], rtol: float, known: Precise | None = None) -> list[Rough]:
    """Of numbers with their errors those that are not precise."""
    found = []
    for number, error in pairs:
        if number.__class__ is float and precise(number, error, rtol):  # numpy takes its time over a single number
            continue
        places = None if known is None else known.places(number, error, rtol)
        if places is None:
            places = list(rough_places(number, error, rtol))
        if places:
            found.append(Rough(number, error, np.concatenate(places)))
    return found


def rounded(sums: Sums) -> Bools:
    """The members of a batch whose errors, beside what they come to, are so small that they are made of rounding."""
    out: Bools = np.ones(sums.v.shape[-1], dtype=bool)
    for number, error in ((sums.v, sums.e), (sums.t, sums.et)):
        most = np.abs(number).reshape(-1, out.size).max(axis=0, initial=0.0)
        out &= (error.reshape(-1, out.size) <= ONLY_ROUNDED * most).all(axis=0)
    return out


def missed(rough: Rough, allowed: Allowed, settings: Settings, drawn: bool) -> Shortfalls:
    """Why numbers are not as accurate as was asked for. `drawn`: they are made of samples."""
    (size, off), mask = rough.sizes, rough.mask()
    all_of_it = allowed.over(mask.shape).of(mask)
    within = all_of_it.error(settings.rtol)
    known = (off <= settings.atol) | (off <= settings.asked(drawn) * size) | (off <= within)
    bad = np.where(np.isinf(size), ~np.isfinite(off), ~known | np.isnan(size))  # an infinity may be known to be one
    if not bad.any():
        return {}
    reasons: Shortfalls = {}
    little = ONLY_ROUNDED * all_of_it.added_up(settings.rtol)
    for reason, holds in _told(size, off, little, drawn):
        here = bad & holds
        if here.any():
            reasons[reason] = rough.mask(here) if mask.ndim else True
            bad = bad & ~here
    return reasons


def _told(v: Array, e: Array, little: Array, drawn: bool) -> Sequence[tuple[Shortfall, Any]]:
    """The reasons in the order in which they count, and where each is one. little: what is hardly anything of what was
    added up."""
    nan = np.isnan(v)
    with np.errstate(invalid="ignore"):
        lost, rounded = e > LOST * v, e < ONLY_ROUNDED * v
    return (
        (NO_VALUE, nan & np.isinf(e)),
        (NOT_A_NUMBER, nan),
        (INFINITE, np.isinf(v)),
        (UNBOUNDED_SAMPLES, ~np.isfinite(e) & drawn),
        (NO_BOUND, ~np.isfinite(e)),
        (TOO_FEW, np.full(v.shape, drawn)),
        (CANCELLED, lost & (e <= little)),
        (NO_DIGITS, lost),
        (ROUNDED, rounded),
        (TOO_LARGE, np.full(v.shape, True)),
    )


def steep(slopes: Iterable[Any], known: Mapping[Shortfall, Any]) -> Shortfalls:
    """Where derivatives are infinite: they have converged to nothing. Of an infinite integral more is `known`."""
    found: Shortfalls = {}
    if INFINITE not in known:
        for slope in slopes:
            if slope.__class__ is float and not math.isinf(slope):  # as mostly, of many parameters
                continue
            if np.any(where := np.isinf(slope)):
                merged(found, {STEEP: where})
    return found


def merged(into: Shortfalls, more: Mapping[Shortfall, Any]) -> None:
    """Add reasons, each of the members of either. Masks that do not go together are of all."""
    for reason, where in more.items():
        before = into.get(reason, False)
        if before is True or where is True:
            into[reason] = True
            continue
        try:
            into[reason] = np.logical_or(before, where)
        except ValueError:
            into[reason] = True


def members_of(where: Any, shape: tuple[int, ...]) -> Array:
    """A mask of members, or True, as a mask over a batch of this shape."""
    if np.ndim(where) and np.shape(where) == shape:
        return np.asarray(where)
    return np.full(shape, bool(np.any(where)))


def converged_members(reasons: Shortfalls, shape: tuple[int, ...]) -> Array:
    """Which members of a batch have no reason against them."""
    bad = np.zeros(shape, dtype=bool)
    for where in reasons.values():
        bad |= members_of(where, shape)
    return np.asarray(~bad)
