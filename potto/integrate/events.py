"""What integrals meet that whoever asked for them must know: events, as values beside the sums that they are about.

Owns every kind of event, and `Events`, which says which members of a batch met what. An event that leaves an answer
less accurate than was asked for is a `Shortfall`, with its message and with what helps against it. The others are
looked into before an answer leaves (`runtime/integration/solving`): a fold, a surface along an axis, two sides.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.core.printer import format_term
from potto.core.terms import Term
from potto.kernels.cells import Array, Bools, Ints

E = TypeVar("E", bound="Event")
# Of which members of a batch something is true; None: nobody knows which, so it may be any.
Members = Ints | None
INNER = -1


class Event(Struct, frozen=True):
    """Something that integration met. Events with one key are one; the first stands for all."""

    @property
    def key(self) -> object:
        return self

    def outside(self) -> Event:
        """The event as an integral further out meets it."""
        return self

    def at(self, places: Ints) -> Event:
        """The event of some of the members that met it, by their places among these."""
        return self

    def joined(self, members: Members, other: Event, more: Members, both: Members) -> Event:
        """The event as all of these met it, in this order: some members this one, others another one with its key."""
        return self


class TwoSided(Event, frozen=True):
    """Why derivatives on the two sides differ: a surface lies on a bound of a variable, or on another surface.

    fold: or its sections along the variable appear or merge just here. Without a surface: some run along the variable.
    along: or it is there all along the variable. kink: it is a kink of the integrand's; without a variable, a number's,
    which jumps there if it is not a kink.
    hidden: rounding hides whether the surface lies there, and what that changes is part of the errors.
    """

    variable: str
    surface: Term | None = None
    other: Term | None = None
    fold: bool = False
    kink: bool = False
    hidden: bool = False
    along: bool = False

    @property
    def jump(self) -> bool:
        """Whether a number jumps there, outside of integrals."""
        return not (self.variable or self.kink)


class Along(Event, frozen=True):
    """A surface is 0 all along a stretch of a variable, and moves there: a little beside the parameters all of the
    stretch is on one of its sides, or it has sections there. bound: it is so all along a bound of the variable."""

    variable: str
    surface: Term
    bound: bool = False


class Spot(Struct, frozen=True):
    """Where sections of a surface appear or merge: at which variable, of which of its cuts, where along it, and where
    that is in the variables further out. Of an integral inside of another one that means nothing outside: the number is
    INNER."""

    number: int = INNER
    cut: int = 0
    place: float = 0.0
    outer: tuple[float, ...] = ()


class SurfaceFold(Event, frozen=True):
    """Sections of a surface appear or merge. spots: where, for each of the members that met it; one for all where there
    is but one, or where it is inside."""

    cause: TwoSided
    spots: tuple[Spot, ...] = (Spot(),)

    @property
    def key(self) -> object:
        return SurfaceFold, self.cause

    def outside(self) -> Event:
        return SurfaceFold(self.cause)

    def spot(self, number: int) -> Spot:
        """Where the member is that has this place among those that met it."""
        return self.spots[number if len(self.spots) > 1 else 0]

    def at(self, places: Ints) -> Event:
        return self if len(self.spots) == 1 else SurfaceFold(self.cause, tuple(self.spots[i] for i in places.tolist()))

    def joined(self, members: Members, other: Event, more: Members, both: Members) -> Event:
        if both is None or members is None or more is None or not isinstance(other, SurfaceFold):
            return self
        known = {m: other.spot(i) for i, m in enumerate(more.tolist())}
        known |= {m: self.spot(i) for i, m in enumerate(members.tolist())}
        return SurfaceFold(self.cause, tuple(known[m] for m in both.tolist()))


class Degenerate(Event, frozen=True):
    """Surfaces run along a variable and have no section in it: another order of the variables may do."""

    variable: str


class Unsearched(Event, frozen=True):
    """The search for the places at which a variable is to be cut was given up."""

    variable: str


class OneSidedDerivatives(Event, frozen=True):
    """The derivatives backward and forward, and how far off each may be: (..., members) each."""

    cause: TwoSided
    backward: Array
    forward: Array
    backward_error: Array
    forward_error: Array

    @property
    def key(self) -> object:
        return id(self)  # each stands by itself

    @property
    def sides(self) -> tuple[Array, Array, Array, Array]:
        return self.backward, self.forward, self.backward_error, self.forward_error

    @property
    def endless(self) -> bool:
        """Whether one is infinite: what it is of jumps there, or leaves it with an infinite slope."""
        return bool(np.isinf(self.backward).any() or np.isinf(self.forward).any())

    def at(self, places: Ints) -> Event:
        return OneSidedDerivatives(self.cause, *(side[..., places] for side in self.sides))


LESS = "ask for less accuracy (`--rtol`)"
MORE = "allow more evaluations (`--max-evals`) or " + LESS
POLE = (
    "more evaluations are of no use to an integral that diverges: look for a pole in the domain or at its ends, or a "
    "tail that falls too slowly, and leave it out by the bounds or a condition"
)
BESIDE = "more evaluations change nothing: ask at parameters beside these"
JOIN = "write both integrals as one: `integral ([..], [..]) .. d(x, y)`"


class Shortfall(Event, frozen=True):
    """Why an answer is not as accurate as was asked for, and what helps.

    blind: where integration did not look nothing is known of the answer, whatever the rules on its panels say. alike:
    what all of a kind have in common, of which the first one says enough.
    """

    message: str
    advice: str = MORE
    blind: bool = False
    alike: str = ""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Shortfall) and self.message == other.message

    def __hash__(self) -> int:
        return hash(self.message)

    @property
    def key(self) -> object:
        return self.alike or self

    def __str__(self) -> str:
        return self.message


BUDGET_SPENT = Shortfall(
    "the budget of evaluations is spent", f"{MORE}; if no number of them is enough, the integral may diverge"
)
TOO_MANY_ROOTS = Shortfall(
    "a condition has too many roots to cut at", "shorten the domain, or sample (`--method mc`)", blind=True
)
ROOTS_NOT_SEPARATED = replace(
    TOO_MANY_ROOTS, message="a condition without a closed form has too many roots, or roots too close together"
)
AT_A_SADDLE = Shortfall(
    "the derivative is infinite: a condition's level set has a saddle, or another critical point, just here", BESIDE
)
LATE = Shortfall("it takes longer than others that are evaluated with it")
UNSEEN_MEETING = Shortfall("surfaces meet, or lie on a bound, that an inner integral jumps at", JOIN)
UNCOUNTED_JUMP = Shortfall("a condition jumps inside an inner integral where its boundary term is not counted", JOIN)
UNKNOWN_JUMP = Shortfall("a condition jumps by itself where it is not known how that place moves")
EMPTY_UNSEEN = Shortfall("an inner integral jumps where a range has length zero", JOIN)
EMPTY_UNDEFINED = Shortfall("the integrand is not defined where a range has length zero", BESIDE)
TOO_MANY_CASES = Shortfall(
    "conditions inside of conditions make more cases than can be told apart",
    "write fewer brackets inside of one condition",
)
ALONG_AXES = Shortfall(
    "surfaces run along the axes of several variables of integration at once: their boundary terms are not all counted",
    "turn the variables of integration, so that no surface runs along several of their axes",
)
NO_SAMPLE = Shortfall(
    "no sample fell where it counts: the error estimate says nothing",
    "sample more (`--samples`), or integrate by `--method quadrature`",
)
NO_SECOND_DERIVATIVE = Shortfall(
    "no second derivative is known here: a surface lies on a bound or on another one, or passes through a corner",
    BESIDE,
)
DISAGREE = Shortfall("the second derivative is not known: its formula and numbers disagree about the first one")

# What numbers say by themselves.
NO_VALUE = Shortfall("the integral has no value, or none within reach", POLE)
NOT_A_NUMBER = Shortfall(
    "the value is not a number",
    "look for a builtin that is used where it is not defined, and guard it with a condition",
)
INFINITE = Shortfall("the integral is infinite, or beyond what numbers can hold", POLE)
BOUNDLESS = Shortfall(
    "the value is infinite here, or beyond what numbers can hold",
    "move a parameter a little: beside a pole it is finite; or ask for its logarithm",
)
STEEP = Shortfall("the derivative is infinite here", "move a parameter a little: beside this place it is finite")
NO_BOUND = Shortfall("the error is not known")
UNBOUNDED_SAMPLES = Shortfall(
    "samples give no bound of the error",
    "use quadrature (`--method quadrature`), or sample more (`--samples`); samples do not settle what has a pole, or a "
    "tail that falls slowly",
)
TOO_FEW = Shortfall("so many samples give fewer digits than were asked for", f"sample more (`--samples`) or {LESS}")
NO_DIGITS = Shortfall(
    "no accuracy was reached: the integral diverges, its integrand is too rough, or rounding hides it",
    f"{POLE}; if the integrand is only rough, sampling gives a few digits (`--method mc`)",
)
CANCELLED = Shortfall(
    "its parts cancel: what is left of them is no larger than its error",
    "beside its parts it is 0; `--atol` says which error of it is small enough",
)
ROUNDED = Shortfall(
    "rounding limits the accuracy", f"more evaluations cannot help: double precision has no more digits: {LESS}"
)
TOO_LARGE = Shortfall("the error estimate is too large")
# Of this a reader need not be warned: that answer came with its error.
ROUGH = Shortfall("an answer that it is made of is no more accurate")
DIVERGENT = frozenset((INFINITE, NO_VALUE))


def sides_hidden(variable: str) -> Shortfall:
    message = f"rounding hides on which side of a surface stretches of `{variable}` lie"
    return Shortfall(message, ROUNDED.advice)


def on_a_bound(cause: TwoSided) -> Shortfall:
    """What lies beyond a bound on which a surface lies, or between surfaces that coincide, is not finite."""
    assert cause.surface is not None
    surface = format_term(cause.surface)
    if cause.other is None:
        message = f"{surface} = 0 lies on a bound of `{cause.variable}`, and beyond it the integrand is not finite"
        return Shortfall(message, f"{BESIDE}, where the surface lies inside or outside")
    both = f"{surface} = 0 and {format_term(cause.other)} = 0 coincide"
    return Shortfall(f"{both}, and what lies between them is not known", BESIDE)


def at_a_fold(surface: Term, variable: str) -> Shortfall:
    """Roots merge over which is summed."""
    return Shortfall(
        f"{format_term(surface)} = 0 folds just here: roots in `{variable}` merge, and their sum is infinite",
        BESIDE,
    )


def root_on_a_bound(surface: Term, variable: str) -> Shortfall:
    """A root counts on one side of the parameters, and on the other it does not."""
    return Shortfall(
        f"{format_term(surface)} = 0 meets a bound of `{variable}` just here: on one side of the parameters it counts",
        BESIDE,
    )


UNDEFINED = "a condition has no value"


def undefined(where: str, surface: Term) -> Shortfall:
    """A condition asks for the sign of what is not defined."""
    return Shortfall(
        f"{UNDEFINED}{where}: it asks for the sign of {format_term(surface)}",
        "leave such places out by the bounds, or guard the condition: `if [x > -1] then [sqrt(1 + x) < t] else 0`",
        alike=UNDEFINED,
    )


def mask_of(members: Members, size: int) -> Bools:
    """Members of a batch of this size as a mask; nobody knows which: all of them."""
    mask = np.full(size, members is None)
    mask[[] if members is None else members] = True
    return mask


class Events:
    """What was met, and by which members of the batch."""

    def __init__(self) -> None:
        self._met: dict[object, tuple[Event, Members]] = {}

    def __bool__(self) -> bool:
        return bool(self._met)

    def __iter__(self) -> Iterator[tuple[Event, Members]]:
        return iter(self._met.values())

    def note(self, event: Event, members: Members = None) -> None:
        """Add an event, or the members that met it as well. What no member has met says nothing."""
        if members is not None and not np.size(members):
            return
        if members is not None:
            members, places = np.unique(members, return_index=True)
            event = event.at(places)
        if event.key not in self._met:
            self._met[event.key] = event, members
            return
        first, known = self._met[event.key]
        both = None if members is None or known is None else np.union1d(known, members)
        self._met[event.key] = first.joined(known, event, members, both), both

    def take(self, other: Events, index: Members) -> None:
        """Add what a part of the batch has met, whose members are those of `index` here; None: nobody knows which."""
        for event, members in other:
            self.note(event, index if members is None or index is None else index[members])

    def every(self, kind: type[E]) -> list[tuple[E, Members]]:
        """The events of a kind, with who met them."""
        return [(event, members) for event, members in self if isinstance(event, kind)]

    def forget(self, *kinds: type[Event]) -> None:
        if self._met:
            self._met = {key: (event, who) for key, (event, who) in self._met.items() if not isinstance(event, kinds)}

    def touched(self, size: int, *kinds: type[Event]) -> Bools:
        """The members of a batch that met something of these kinds; all of them where nobody knows who did."""
        mask = np.zeros(size, dtype=bool)
        for event, members in self:
            if isinstance(event, kinds or Event):
                mask |= mask_of(members, size)
        return mask

    def uncounted(self, size: int) -> Bools:
        """The members of a batch that met something that their errors do not count."""
        rest = Events()
        for event, members in self:
            if not (isinstance(event, TwoSided) and event.hidden):
                rest.note(event, members)
        return rest.touched(size)

    def known(self, *kinds: type[Event]) -> bool:
        """Whether it is known of each of these kinds who met it."""
        return all(members is not None for event, members in self if isinstance(event, kinds))

    def of(self, index: Ints, *kinds: type[Event]) -> Events:
        """What some members have met, who are numbered anew; what is known of nobody is true of all."""
        found = Events()
        for event, members in self:
            if not isinstance(event, kinds or Event):
                continue
            if members is None:
                found.note(event)
            elif (kept := np.flatnonzero(np.isin(members, index))).size:
                found.note(event.at(kept), np.searchsorted(index, members[kept]))
        return found
