"""Whether an answer is as accurate as was asked for; and if not, why, member by member.

Owns `Shortfalls`, `missed`, `missing`, `precise`, `rounded` and `allowance`. Converged means: the error is within
`rtol * |value|`, or within `atol`. An answer that is 0 because its parts cancel has no digits that could be relative to
it. It is accurate enough if it is relative to what is added up without regard to sign: there its error is within
`rtol`, and within CANCELS, which is what rounding leaves. That is no licence to lose a small summand beside large ones
(1e16 - 1e16 + 1): where the integrand adds anything, what is added up counts as 1 at most, so that CANCELS is an
absolute bound.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec.structs import replace

from potto.core.terms import Branch, Const, Integral, Prim, Proj, Term, Tuple, Var, children
from potto.integrate.events import (
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
from potto.kernels.cells import Array, Bools, Number, Value
from potto.projects.settings import Settings

CANCELS = 1e-12
# What is added up counts as so much at most, where something small could be lost in it.
UNIT = 1.0
# What is a speck, beside the largest of a batch.
SPECK = 1e-15
# From which part of a value on an error is more than rounding, and up to which it is nothing else.
LOST, ONLY_ROUNDED = 0.1, 1e-6

# Why answers are not as accurate as asked for, and of which members of a batch: a mask, or True for all of them.
Shortfalls = dict[Shortfall, Any]


@lru_cache(maxsize=4096)
def adds_nothing(body: Term) -> bool:
    """Whether no summand can be lost beside a larger one: products and builtins alone, under whatever conditions."""
    todo, seen = [body], set()
    while todo:
        term = todo.pop()
        if term in seen:
            continue
        seen.add(term)
        if isinstance(term, Branch):
            todo += (term.then, term.orelse)
        elif isinstance(term, Const | Var | Tuple | Proj) or (isinstance(term, Prim) and term.op not in ("add", "sub")):
            todo += children(term)
        else:
            return False
    return True


def allowance(term: Integral, sums: Sums, rtol: float) -> Any:
    """The error of each of a batch of integrals up to which it, or its derivative, is 0 as accurately as asked for."""
    if sums.v.size == 1 and sums.gross is not None:  # numpy takes its time over a single number
        rates = float(max(sums.gross[1, 0], *map(abs, sums.t.flat), 0.0))
        return allowance_of_one(term, float(sums.gross[0, 0]), rates, rtol)
    most = np.inf if adds_nothing(term.body) else UNIT
    share = min(rtol, CANCELS)
    added = (None, None) if sums.gross is None else sums.gross
    value, rate = _largest(sums.v, added[0], most), _largest(sums.t, added[1], UNIT)
    np.maximum(value, rate, out=value)
    value *= share
    return value


def _largest(numbers: Array, added: Array | None, most: float) -> Array:
    """Per member of a batch, (B,), the largest of its numbers (..., B) without regard to sign and of what was added up
    for them, up to `most`; 0 for what is infinite, or not a number. Over large batches it is memory that takes time, so
    that there is as little of it as can be."""
    rows = numbers.reshape(-1, numbers.shape[-1])
    found = np.zeros(numbers.shape[-1]) if added is None else added.copy()
    size = np.empty_like(found)
    for row in rows:
        np.maximum(found, np.abs(row, out=size), out=found)
    bad = None if found.max(initial=0.0) < math.inf else ~np.isfinite(found)
    np.minimum(found, most, out=found)
    if bad is not None:
        found[bad] = 0.0
    return found


def allowance_of_one(term: Integral, gross: float, rates: float, rtol: float) -> float:
    """The same for a single integral: from what is added up for its value, and the most for one of its derivatives."""
    value = 0.0 if gross == math.inf else gross if adds_nothing(term.body) else min(gross, UNIT)
    return min(rtol, CANCELS) * max(value, min(rates, UNIT) if rates < math.inf else 0.0)


def missing(term: Integral, sums: Sums, settings: Settings, env: dict[str, Value]) -> Bools:
    """The members of a batch of integrals for which it pays to look further: values or derivatives are not as accurate
    as was asked for, and what is off is no speck beside what the others come to. Those that go into one sum are
    measured by it."""
    out: Bools = np.zeros(sums.v.shape[-1], dtype=bool)
    whole = together(env, sums.v)
    if whole is sums.v and precise(sums.v, sums.e, settings.rtol) and precise(sums.t, sums.et, settings.rtol):
        return out  # as mostly, whatever else would do
    within: Array | None = None
    for number, error in ((whole, sums.e), (sums.t, sums.et)):
        size = np.abs(number)
        fine = error <= np.maximum(settings.atol, settings.rtol * size)
        fine &= np.isfinite(error)  # of what may be infinite, and may be anything, nothing is known yet
        rest = np.flatnonzero(~fine.reshape(-1, out.size).all(axis=0))
        if not rest.size:
            continue
        if within is None:
            gross = None if sums.gross is None else together(env, sums.gross)
            all_of_it = allowance(term, replace(sums, v=whole, gross=gross), settings.rtol)
            within = np.broadcast_to(all_of_it, out.shape)
        speck = SPECK * np.max(size, axis=-1, keepdims=True, initial=0.0, where=np.isfinite(size))
        few = error.take(rest, -1)
        known = fine.take(rest, -1) | (few <= np.maximum(within.take(rest), speck))
        if number is sums.t:
            known |= added_up(env, number, error, settings.rtol).take(rest, -1)
        known &= np.isfinite(few)
        out[rest] |= ~known.reshape(-1, rest.size).all(axis=0)
    return out


def precise(numbers: Number | None, errors: Number | None, rtol: float) -> bool:
    """Whether each number is there, finite and known to this part of it."""
    if numbers is None or errors is None:
        return False
    size = np.abs(numbers)
    return bool(np.all(errors <= rtol * size) and np.all(size < np.inf))


def rounded(sums: Sums) -> Bools:
    """The members of a batch whose errors, beside what they come to, are so small that they are made of rounding."""
    out: Bools = np.ones(sums.v.shape[-1], dtype=bool)
    for number, error in ((sums.v, sums.e), (sums.t, sums.et)):
        most = np.abs(number).reshape(-1, out.size).max(axis=0, initial=0.0)
        out &= (error.reshape(-1, out.size) <= ONLY_ROUNDED * most).all(axis=0)
    return out


def widest(before: Any, after: Any) -> Any:
    """Two allowances, numbers or arrays over batches, as one; of batches that do not go together the least."""
    if isinstance(before, float) and isinstance(after, float):
        return max(before, after)
    try:
        return np.maximum(before, after)
    except ValueError:
        return max(float(np.min(before)), float(np.min(after)))


def over(within: Any, shape: tuple[int, ...]) -> Any:
    """An allowance over a batch of this shape: of one that does not go together with it the least."""
    if not np.ndim(within) or np.shape(within) == shape:
        return within
    try:
        return np.broadcast_to(within, shape)
    except ValueError:
        return float(np.min(within, initial=np.inf))


def missed(value: Any, error: Any, within: Any, settings: Settings, drawn: bool) -> Shortfalls:
    """Why numbers are not as accurate as was asked for. `drawn`: they are made of samples; within: see `allowance`."""
    rtol = settings.asked(drawn)
    if isinstance(value, float) and isinstance(error, float) and error <= rtol * abs(value) < np.inf:
        return {}
    v, e = np.abs(np.asarray(value, dtype=float)), np.asarray(error, dtype=float)
    v, e = np.broadcast_arrays(v, e)
    limit = rtol * v
    bad = np.asarray(~(e <= limit))
    if not limit.max(initial=0.0) < np.inf:  # seldom, in large batches
        bad |= ~(limit < np.inf)
    if not bad.any():
        return {}
    within = over(within, v.shape)
    size, off, allowed = v[bad], e[bad], np.broadcast_to(within, v.shape)[bad]  # few of a large batch
    wrong = ~((off <= settings.atol) | (off <= rtol * size) | (off <= allowed)) | np.isnan(size)
    bad[bad] = np.where(np.isinf(size), ~np.isfinite(off), wrong)  # an infinity may be known to be one
    if not bad.any():
        return {}
    reasons: Shortfalls = {}
    for reason, holds in _told(v, e, drawn):
        here = bad & holds
        if here.any():
            reasons[reason] = here if v.ndim else True
            bad = bad & ~here
    return reasons


def _told(v: Array, e: Array, drawn: bool) -> Sequence[tuple[Shortfall, Any]]:
    """The reasons in the order in which they count, and where each is one."""
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
        (NO_DIGITS, lost),
        (ROUNDED, rounded),
        (TOO_LARGE, np.full(v.shape, True)),
    )


def steep(slopes: Iterable[Any], known: Mapping[Shortfall, Any]) -> Shortfalls:
    """Where derivatives are infinite: they have converged to nothing. Of an infinite integral more is `known`."""
    found: Shortfalls = {}
    if INFINITE not in known:
        for slope in slopes:
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
