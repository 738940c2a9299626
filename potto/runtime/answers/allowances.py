"""How large an error may be of what is 0, or nearly, because its parts cancel.

Owns `Allowance`, what the integrals of an evaluation leave of it, `LeftBySums`, which is worked out when it is asked
for, and `allowance`, that of integrals by themselves. No error is relative to what has cancelled. It is measured by
what is added up without regard to sign: it has to be within `rtol` of it, and within CANCELS, which is what rounding
leaves. That is no licence to lose a small summand beside large ones (1e16 - 1e16 + 1): where the integrand adds
anything, what is added up counts as UNIT at most, so that CANCELS is an absolute bound.

What stands outside of an integral scales both its error and what is added up for it: `f(t)/h^2` is as accurate as f(t).
So an integral whose errors are within its own allowance counts as a number without one, and what is made of nothing
else is measured as arithmetic is, by UNIT. By the linear propagation of errors it is then within the allowances of its
integrals, scaled as they are.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Branch, Const, Integral, Prim, Proj, Term, Tuple, Var, children, postorder
from potto.integrate.pieces import Sums
from potto.kernels.cells import Array, Bools, Ints

CANCELS = 1e-12
# What is added up counts as so much at most, where something small could be lost in it.
UNIT = 1.0


class Allowance(Struct, frozen=True):
    """What may be off of all members of a batch, or of each, as numbers or arrays.

    most: the largest allowance of an integral. kept: whether each integral's errors are within its own. finite:
    whether their values and derivatives are.
    """

    most: Any = 0.0
    kept: Any = True
    finite: Any = True

    def and_of(self, other: Allowed) -> Allowed:
        """That of what is made of the integrals of both; of batches that do not go together the least."""
        if self is NOTHING:
            return other
        if isinstance(self.most, float) and isinstance(other.most, float):
            return Allowance(max(self.most, other.most), self.kept and other.kept, self.finite and other.finite)
        try:
            return Allowance(np.maximum(self.most, other.most), *map(np.logical_and, self.holds, other.holds))
        except ValueError:
            ends = self.over(()), other.over(())
            return ends[0].and_of(ends[1])

    def over(self, shape: tuple[int, ...]) -> Allowance:
        """The same over a batch of this shape: of one that does not go together with it the least."""
        if not np.ndim(self.most) or np.shape(self.most) == shape:
            return self
        try:
            return Allowance(*(np.broadcast_to(part, shape) for part in (self.most, *self.holds)))
        except ValueError:
            return Allowance(float(np.min(self.most, initial=np.inf)), *(bool(np.all(part)) for part in self.holds))

    def of(self, members: Bools) -> Allowance:
        """That of some members of its batch, a mask."""
        if not np.ndim(self.most):
            return self
        return Allowance(*(part[members] for part in (self.most, *self.holds)))

    def added(self, shape: tuple[int, ...], count: int, those: Bools | None = None) -> Allowance:
        """That of sums of so many summands, the last axis, over a batch of this shape: at least as much is added up as
        for the summand that most is added up for. those: the summands that count."""
        wide = self.over((*shape, count))
        if not np.ndim(wide.most):
            return wide
        here = slice(None) if those is None else those
        most, *holds = wide.most[..., here].max(axis=-1), *(part[..., here].all(axis=-1) for part in wide.holds)
        return Allowance(most, *holds) if shape else Allowance(float(most), *map(bool, holds))

    def put(self, members: Ints, size: int, shape: tuple[int, ...]) -> Allowance:
        """That of a batch of this shape, of so many members, by that of what goes into these."""
        if not np.ndim(self.most):
            return self
        own, most, holds = self.over(members.shape), np.zeros(size), np.ones((2, size), dtype=bool)
        np.maximum.at(most, members, own.most)
        for part, here in zip(holds, own.holds, strict=True):
            np.logical_and.at(part, members, here)
        if not shape:
            return Allowance(float(most[0]), *map(bool, holds[:, 0]))
        return Allowance(most.reshape(shape), *holds.reshape(2, *shape))

    @property
    def holds(self) -> tuple[Any, Any]:
        return self.kept, self.finite

    def added_up(self, rtol: float) -> Any:
        """How much is added up in the integral for which that is most, up to UNIT: at least so much, where something
        small could be lost."""
        share = min(rtol, CANCELS)
        return self.most / share if share else 0.0

    def error(self, rtol: float) -> Any:
        """The error up to which an answer is 0 as accurately as asked for."""
        arithmetic = min(rtol, CANCELS) * UNIT
        if isinstance(self.kept, bool):
            return np.maximum(self.most, arithmetic) if self.kept else self.most
        return np.where(self.kept, np.maximum(self.most, arithmetic), self.most)


NOTHING = Allowance()


class LeftBySums(Struct, frozen=True, dict=True):
    """The allowance that a batch of integrals of this shape leaves. Nobody asks for that of members that are accurate,
    as mostly all are, and of large batches it takes as long as the integrals."""

    term: Integral
    sums: Sums
    rtol: float
    shape: tuple[int, ...]

    @cached_property
    def whole(self) -> Allowance:
        return _left(self.term, self.sums, self.rtol, self.shape)

    @property
    def most(self) -> Any:
        return self.whole.most

    @property
    def kept(self) -> Any:
        return self.whole.kept

    @property
    def finite(self) -> Any:
        return self.whole.finite

    @property
    def holds(self) -> tuple[Any, Any]:
        return self.whole.holds

    def and_of(self, other: Allowed) -> Allowed:
        return self.whole.and_of(other)

    def over(self, shape: tuple[int, ...]) -> Allowed:
        return self if shape == self.shape else self.whole.over(shape)

    def of(self, members: Bools) -> Allowance:
        part = self.sums.pick(members.reshape(-1).nonzero()[0])
        return _left(self.term, part, self.rtol, part.v.shape[-1:])

    def added(self, shape: tuple[int, ...], count: int, those: Bools | None = None) -> Allowance:
        return self.whole.added(shape, count, those)

    def put(self, members: Ints, size: int, shape: tuple[int, ...]) -> Allowance:
        return self.whole.put(members, size, shape)

    def added_up(self, rtol: float) -> Any:
        return self.whole.added_up(rtol)


Allowed = Allowance | LeftBySums


def left_by(term: Integral, sums: Sums, rtol: float, shape: tuple[int, ...]) -> Allowed:
    """What a batch of integrals leaves to what is made of them."""
    if sums.v.size > 1:
        return LeftBySums(term, sums, rtol, shape) if shape else _left(term, sums, rtol, shape)
    most = float(np.max(allowance(term, sums, rtol)))
    exact = bool((sums.e <= most).all() and (sums.et <= most).all())
    return Allowance(most, exact, bool(np.isfinite(sums.v).all() and np.isfinite(sums.t).all()))


def _left(term: Integral, sums: Sums, rtol: float, shape: tuple[int, ...]) -> Allowance:
    within = np.broadcast_to(allowance(term, sums, rtol), sums.v.shape[-1:])
    kept: Bools = _everywhere(sums.e <= within) & _everywhere(sums.et <= within)
    finite: Bools = np.ones(kept.shape, dtype=bool)
    with np.errstate(invalid="ignore"):  # inf - inf
        total = np.add.reduce(sums.v, None) + np.add.reduce(sums.t, None)
    if not math.isfinite(total):  # seldom, in large batches
        finite = _everywhere(np.isfinite(sums.v)) & _everywhere(np.isfinite(sums.t))
    if shape:
        return Allowance(*(part.reshape(shape) for part in (within, kept, finite)))
    return Allowance(float(np.max(within)), bool(kept.all()), bool(finite.all()))


def _everywhere(holds: Bools) -> Bools:
    """Per member of a batch, (B,), whether all of something holds, (..., B)."""
    rows = holds.reshape(-1, holds.shape[-1])
    return rows[0] if len(rows) == 1 else np.logical_and.reduce(rows, axis=0)  # type: ignore[no-any-return]


@lru_cache(maxsize=4096)
def adds_nothing(body: Term) -> bool:
    """Whether no summand can be lost beside a larger one: products and builtins alone, under whatever conditions."""
    return all(
        isinstance(node, Branch | Const | Var | Tuple | Proj)
        or (isinstance(node, Prim) and node.op not in ("add", "sub"))
        for node in postorder(body, below=_values_of)
    )


def _values_of(term: Term) -> tuple[Term, ...]:
    return (term.then, term.orelse) if isinstance(term, Branch) else children(term)


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
