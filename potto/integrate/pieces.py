"""What passes between the parts of the integrator: sums over a batch, pieces under refinement, environments.

Owns `Sums`, `Shaped`, `Uncut`, `Pieces` and `Evaluator`, the integrator's view of the machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol

import numpy as np
from msgspec import Struct, field

from potto.core.terms import Lam
from potto.integrate.columns import Columns, joined
from potto.integrate.costs import Costs
from potto.integrate.decomposition.root_isolation import Isolated
from potto.integrate.events import Event, Events, Members
from potto.integrate.rules import substitution
from potto.integrate.rules.gauss import gauss, leaning
from potto.kernels.cells import Array, Bools, Cell, Ints, Mask, Number, Pattern, Trace, Value, map_arrays, map_cells
from potto.kernels.errors import not_a_number
from potto.kernels.written import Kernel
from potto.projects.settings import Settings

STRAY = 8
TELLING = 4  # nodes, from which on values tell where a singularity is; a polynomial may need fewer


class Evaluator(Protocol):
    """What integration asks of the machine: terms evaluated over batches, and where to note what it meets.

    Members are those of the outermost batch; None: all that there are, or nobody knows which. `apart`: the same machine
    for what is to be known by itself of what it meets.
    """

    @property
    def settings(self) -> Settings: ...
    @property
    def rtol(self) -> float: ...
    @property
    def atol(self) -> float: ...
    @property
    def directions(self) -> int: ...
    @property
    def frozen(self) -> bool: ...
    @property
    def costs(self) -> Costs | None: ...
    def with_directions(self, directions: int) -> Evaluator: ...
    def tracking(self) -> Evaluator: ...
    def taped(self) -> Evaluator: ...
    def standing(self) -> Evaluator: ...
    def looking_aside(self) -> Evaluator: ...
    def changed(self, *, settings: Settings) -> Evaluator: ...
    def among(self, index: Ints) -> AbstractContextManager[Evaluator]: ...
    def evaluate(self, function: Lam, env: Mapping[str, Value], trace: Trace | None) -> Value: ...
    def kernel(self, lam: Lam, patterns: tuple[Pattern, ...]) -> Kernel: ...
    @property
    def backend(self) -> str: ...
    def count(self, evaluations: int) -> None: ...
    def sampled(self, share: float, limit: bool) -> None: ...
    def search(self, boxes: int) -> bool: ...
    def isolates(self, cells: int) -> bool: ...
    @property
    def isolated(self) -> Isolated: ...
    @property
    def spent(self) -> float: ...
    def exhausted(self) -> bool: ...
    def overdrawn(self) -> bool: ...
    @property
    def side(self) -> int: ...
    @property
    def events(self) -> Events: ...
    def apart(self) -> Evaluator: ...
    def note(self, event: Event, members: Members = None) -> None: ...


# The name under which members of a batch that are summands have the number of the sum into which each goes.
INTO = "#into"
# The same with the number of the summand that each is, where tangents are added up by these.
OF = "#of"


class Sums(Columns):
    """Integrals of a batch: value (m, B) and tangents (m, k, B) with their error bounds; m components.

    gross: (2, B) the most that is added up for each without regard to sign, for values and for tangents; None where
    nobody kept track. common: (m, k, B) the part of the tangents' errors that is one factor of all of them: the slope
    of a surface by which the speeds of its roots are divided.
    """

    v: Array
    e: Array
    t: Array
    et: Array
    gross: Array | None = None
    common: Array | None = None

    @staticmethod
    def zeros(m: int, k: int, batch: int) -> Sums:
        """Integrals over nothing."""
        rows = np.zeros((2 * m * (1 + k) + 2, batch))  # in one piece, which a system has ready sooner
        numbers, errors = rows[:-2].reshape(2, m, 1 + k, batch)
        return Sums(numbers[:, 0], errors[:, 0], numbers[:, 1:], errors[:, 1:], gross=rows[-2:])

    def channels(self) -> tuple[Array, Array]:
        """Values, then tangents, (m, 1 + k, B), and their errors."""
        v, e = self.v[:, None], self.e[:, None]
        return np.concatenate((v, self.t), axis=1), np.concatenate((e, self.et), axis=1)

    def widened(self, m: int) -> Sums:
        """The same of m components: sums over nothing at all don't know how many there are."""
        missing = m - self.v.shape[0]
        if missing <= 0:
            return self
        v, e, t, et = (np.concatenate([x] + [x[:1]] * missing) for x in (self.v, self.e, self.t, self.et))
        return Sums(v, e, t, et, gross=self.gross)

    def widen(self, m: int) -> None:
        """Make these sums such of m components."""
        wide = self.widened(m)
        self.v, self.e, self.t, self.et = wide.v, wide.e, wide.t, wide.et

    def with_members(self, members: Any, part: Sums) -> Sums:
        """These sums with others for some members, in place where there are as many components."""
        whole = self.widened(part.v.shape[0])
        whole.put(members, part.widened(whole.v.shape[0]))
        return whole

    def lose(self, members: Any) -> None:
        """Some of the integrals have no value."""
        self.v[:, members] = self.t[:, :, members] = np.nan
        self.unknown(members)

    def undefined(self, batch: int) -> Ints:
        """The members that have come to no number, or to an infinite one."""
        defined = np.isfinite(self.v).all(axis=0) & np.isfinite(self.t).all(axis=(0, 1))
        return np.nonzero(~np.broadcast_to(defined, (batch,)))[0]

    def unknown(self, members: Any) -> None:
        """Nothing is known of how far off some of the integrals are."""
        self.e[:, members] = self.et[:, :, members] = np.inf

    def cells(self, shape: tuple[int, ...]) -> list[Cell]:
        """The components as numbers over a batch of this shape."""

        def part(x: Array) -> Number:
            return x.reshape(shape) if shape else float(x[0])

        parts = zip(self.v, self.e, self.t, self.et, strict=True)
        return [Cell(part(v), part(e), tuple(map(part, t)), tuple(map(part, et))) for v, e, t, et in parts]

    @staticmethod
    def joined(parts: Sequence[Sums]) -> Sums:
        """Batches one after the other; one component may stand for all, where nothing is integrated."""
        m = max(part.v.shape[0] for part in parts)
        return joined([part.widened(m) for part in parts])


class Crossing(Struct, frozen=True):
    """What crosses faces, (m, k, B): the tangents and their errors. counted: what of it ends of segments and nodes that
    move with the cuts tell already, with errors."""

    t: Array
    et: Array
    counted: Array
    uncertain: Array

    def added(self, tangents: tuple[Array, Array], moving: bool) -> tuple[Array, Array]:
        """Tangents and their errors with what crosses, by nodes that move, or not."""
        value, bound = tangents[0] + self.t, tangents[1] + self.et
        return (value - self.counted, bound + self.uncertain) if moving else (value, bound)


class Shaped(Struct, frozen=True):
    """Which members of a batch are done (B,), for which rounding alone leaves less than was asked for (B,), and the
    sums of both, zero for all others."""

    done: Bools
    short: Bools
    sums: Sums


class Uncut(Struct, frozen=True):
    """The sums of a batch, and the members whose boxes are not known to be uncut, or were left for another reason, with
    sums of 0. precise: whether each number of all others is known to half of what is asked, as far as anyone looked."""

    sums: Sums
    rest: Ints
    precise: bool = False


class Pieces(Columns):
    """Pieces of segments under refinement, and what is known of each: integrals and errors per channel (C, P).

    led: (2 * C, P) what the nodes lead to at left, then at right ends. rest: (C, P) how large its last terms are.
    lean: -p or p where a singularity sits at the left or right end, and powers of p would grade it.
    excess: (P,) the worst of a piece's errors, of the size of what it is a part of. stuck: how many times in a row
    that hardly fell when the piece was refined.
    """

    segment: Ints
    u0: Array
    u1: Array
    end: Ints
    integral: Array = field(default_factory=lambda: np.zeros((0, 0)))
    error: Array = field(default_factory=lambda: np.zeros((0, 0)))
    floor: Array = field(default_factory=lambda: np.zeros((0, 0)))
    size: Array = field(default_factory=lambda: np.zeros((0, 0)))
    most: Array = field(default_factory=lambda: np.zeros((0, 0)))
    ends: Array = field(default_factory=lambda: np.zeros((0, 0)))
    tail: Array = field(default_factory=lambda: np.zeros((0, 0)))
    led: Array = field(default_factory=lambda: np.zeros((0, 0)))
    rest: Array = field(default_factory=lambda: np.zeros((0, 0)))
    lean: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    excess: Array = field(default_factory=lambda: np.zeros(0))
    stuck: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    coefficients: Array | None = None
    heights: Array | None = None

    def __post_init__(self) -> None:
        if not self.excess.size:
            self.excess, self.stuck = np.zeros(self.u0.size), np.zeros(self.u0.size, dtype=np.int64)

    def settled(self) -> Pieces:
        """The pieces with what only refinement asks for, which is worked out when it does."""
        if self.coefficients is not None:
            worst, all_of_them = self.error.argmax(axis=0), np.arange(self.u0.size)
            assert self.heights is not None
            if self.coefficients.shape[-1] >= TELLING:
                lean = leaning(self.coefficients[worst, all_of_them])
                self.lean = lean * _power(self.heights[worst, all_of_them], lean, self.end)
            else:
                self.lean = np.zeros(self.u0.size, dtype=np.int64)
            self.coefficients = self.heights = None
        return self

    def places(self, index: Any) -> Pieces:
        """Some of the pieces, not measured yet."""
        return Pieces(self.segment[index], self.u0[index], self.u1[index], self.end[index])

    def unmeasured(self, like: Pieces) -> Pieces:
        """The pieces as ones of which nothing is known, with as many channels as others have."""
        for name in ("integral", "floor", "size", "most", "ends", "tail", "led", "rest"):
            setattr(self, name, np.zeros((getattr(like, name).shape[0], self.u0.size)))
        self.error = np.full(self.integral.shape, np.inf)
        self.lean = np.zeros(self.u0.size, dtype=np.int64)
        return self

    def held_against(self, again: Pieces, at: Any) -> None:
        """The pieces `at`, measured again with more nodes: off by no more than that changed them."""
        self.settled()
        change = np.abs(again.integral - self.integral[:, at])
        again.error = np.maximum(again.error, change)
        for name in ("integral", "error", "floor", "size", "most", "ends", "tail", "led", "rest"):
            getattr(self, name)[:, at] = getattr(again, name)

    def pick(self, index: Any) -> Pieces:
        return Columns.pick(self.settled(), index)

    def join(self, other: Pieces) -> Pieces:
        return all_of([self, other])


def _power(heights: Array, lean: Ints, end: Ints) -> Ints:
    """The power that would grade pieces which lean to an end so that they become smooth there: (P,).

    Near the end values (P, n) go like a power of the distance; it is read off the two nodes next to it.
    """
    t = gauss(heights.shape[1]).nodes[:2]
    near = np.where(lean[:, None] > 0, heights[:, :-3:-1], heights[:, :2])
    with np.errstate(all="ignore"):
        exponent = np.log(near[:, 0] / near[:, 1]) / np.log(t[0] / t[1])
        wanted = substitution.GRADE * np.maximum(np.abs(end), 1) / (exponent + 1)
    steep = (wanted > substitution.GRADE) & (wanted <= substitution.STEEPEST)
    return np.where(steep, np.rint(wanted), substitution.GRADE).astype(np.int64)


def all_of(parts: list[Pieces]) -> Pieces:
    return parts[0] if len(parts) == 1 else joined([part.settled() for part in parts])


class Ends(Struct, frozen=True):
    """The integrand at both ends of every segment, sides as on the segment, and its rounding there: (m, S) each.

    share: which part of the integrand its rounding is, by the place where that is least.
    """

    low: Array
    high: Array
    low_error: Array
    high_error: Array
    share: Array


def mostly(owner: Ints, root: Ints | None, size: int) -> Ints:
    """Those of `owner`, nodes of a batch of `size`, which are not so few that they can only be single nodes of the
    variables further out, of measure zero, for their member of the outermost batch.

    A rule has a node in the middle of its panel, where by symmetry things meet: one of eleven.
    """
    if root is None:
        return owner if STRAY * owner.size >= size else owner[:0]
    counts = np.bincount(root)
    return owner[(STRAY * np.bincount(root[owner], minlength=counts.size) >= counts)[root[owner]]]


def gather(env: dict[str, Value], index: Ints | Bools | slice | int) -> dict[str, Value]:
    """The environment at some members of its batch."""
    if isinstance(index, np.ndarray) and index.dtype != bool:  # a third less time than by brackets
        return {name: map_arrays(value, lambda a: a.take(index, 0)) for name, value in env.items()}
    return {name: map_arrays(value, lambda a: a[index]) for name, value in env.items()}


def together(env: dict[str, Value], rows: Array, name: str = INTO) -> Array:
    """Numbers of members (..., B), those that go into the same sum added up: what rounding is measured by there."""
    into = env.get(name)
    if not isinstance(into, Cell) or not isinstance(into.v, np.ndarray):
        return rows
    place = into.v.astype(np.int64)
    if place.max(initial=0) > STRAY * place.size:  # a few members of a large batch
        place = np.unique(place, return_inverse=True)[1]
    added = np.empty(rows.shape)
    for row, own in zip(rows.reshape(-1, place.size), added.reshape(-1, place.size), strict=True):
        np.bincount(place, row).take(place, out=own, mode="clip")
    return added


def added_up(env: dict[str, Value], tangents: Array, errors: Array, rtol: float) -> Bools:
    """Which tangents of members (..., B) are added up with others to something that is as accurate as was asked for,
    without regard to sign: nobody sees the digits of each."""
    if OF not in env:
        return np.zeros(tangents.shape, dtype=bool)
    return together(env, errors, OF) <= rtol * together(env, np.abs(tangents), OF)


def column(env: dict[str, Value]) -> dict[str, Value]:
    """The environment as columns, to stand beside rows of nodes."""
    return {name: map_arrays(value, lambda a: a[:, None]) for name, value in env.items()}


def components(value: Value) -> list[Cell]:
    """The numbers in the value of an integrand: one, or a tuple's."""
    if isinstance(value, Cell):
        return [value]
    if isinstance(value, tuple):
        return [c for item in value for c in components(item)]
    raise not_a_number(value)


def number_at(function: Lam, machine: Evaluator, env: Mapping[str, Value]) -> Cell:
    """The number that a function gives, whose parameters have the values of `env`."""
    value = machine.evaluate(function, env, None)
    assert isinstance(value, Cell)
    return value


def numbers_at(function: Lam, machine: Evaluator, env: Mapping[str, Value]) -> tuple[Cell, ...]:
    """The same of a function to a tuple of numbers."""
    values = machine.evaluate(function, env, None)
    assert isinstance(values, tuple)
    return values  # type: ignore[return-value]


def box_of_numbers(env: Mapping[str, Value]) -> dict[str, tuple[float, float]]:
    """The numbers of an environment of one member, as ranges of one number each."""
    numbers = {name: float(np.ravel(value.v)[0]) for name, value in env.items() if isinstance(value, Cell)}
    return {name: (number, number) for name, number in numbers.items()}


def still(value: Value) -> Value:
    """The value with its tangents and errors left out."""
    return map_cells(value, lambda cell: Cell(cell.v))


def resting(value: Value) -> Value:
    """The value with its tangents left out."""
    return map_cells(value, lambda cell: Cell(cell.v, cell.e))


def take(sides: Mapping[int, Mask], index: Ints) -> dict[int, Mask]:
    """The sides of some members, or segments."""
    return {group: mask[index] if isinstance(mask, np.ndarray) else mask for group, mask in sides.items()}


def dense(value: Value, k: int, shape: tuple[int, ...]) -> tuple[Array, Array | None]:
    """The value of an integrand and k tangents as one array (m, 1 + k, *shape); how far off they are, None for 0."""
    cells = components(value)
    numbers = np.zeros((len(cells), 1 + k, *shape))
    inexact = any(cell.e is not None or any(et is not None for et in cell.et) for cell in cells)
    errors = np.zeros(numbers.shape) if inexact else None
    for i, cell in enumerate(cells):
        for row, (x, e) in enumerate(zip((cell.v, *cell.t[:k]), (cell.e, *cell.et[:k]), strict=True)):
            if x is not None:
                numbers[i, row] = x
            if e is not None and errors is not None:
                errors[i, row] = e
    return numbers, errors
