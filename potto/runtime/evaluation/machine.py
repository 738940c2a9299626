"""The machine: what kernels ask for while they run.

Owns `Machine`. It knows the program's definitions (through a `Linker`), the settings and the record of one evaluation,
and how many directions of differentiation are carried. Machines with other numbers of directions share everything
else. Calls, lazy sides, sums and integrals of generated code come here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from msgspec import Struct

from potto.calculus.differentiation.deltas import PRODUCT_OF_DELTAS
from potto.calculus.inlining.currying import sizes_of
from potto.core.terms import (
    Array,
    Branch,
    Data,
    Fold,
    Hole,
    If,
    Index,
    Integral,
    Lam,
    Length,
    Prim,
    Sum,
    Term,
    function_of,
)
from potto.core.terms import Delta as DeltaTerm
from potto.diagnostics import PottoError
from potto.integrate.costs import Costs
from potto.integrate.decomposition.root_isolation import Isolated
from potto.integrate.events import NO_SECOND_DERIVATIVE, Event, Events, Members
from potto.kernels import errors
from potto.kernels.cells import Cell, Ints, Number, Pattern, Trace, Value, pad, pattern
from potto.kernels.chunks import at_points, many
from potto.kernels.compile import kernel
from potto.kernels.making import counts
from potto.kernels.native.objects import available
from potto.kernels.written import Kernel
from potto.projects.settings import Settings
from potto.runtime.evaluation.arguments import fit, uncurried
from potto.runtime.evaluation.functions import Chosen, Closure, Derivative, Paired, carries_errors
from potto.runtime.evaluation.linker import Linker
from potto.runtime.evaluation.record import Record

DEEPEST_CALLS = 3000  # inside each other
OVERDRAFT = 3  # times the budget of evaluations, up to which integrals inside of integrals go on
# The same where the roots of a condition are searched for: 2,000 asked are some 100,000 cells, half a second or two.
GIVEN_UP = 64

Groups = tuple[tuple[Value, ...], ...]
WATCHING: ContextVar[Callable[[Lam, list[Value]], None] | None] = ContextVar("WATCHING", default=None)
"""Who is told of each term that is evaluated over a batch, and at what places: pictures show nodes so."""


class Semantics(Struct, frozen=True):
    """What is done by more than kernels: derivatives called, conditionals with one side taken, sums, integrals.

    derivative: of a function, called with duals; paired: a function on duals that was written by hand. added: summands
    that integrate.
    """

    derivative: Callable[[Machine, Derivative, Groups, Trace | None], Value]
    paired: Callable[[Machine, Paired, Groups, Trace | None], Value]
    chosen: Callable[[Machine, Chosen, Groups], Value]
    conditional: Callable[[Machine, Any, If | Branch, dict[str, Value], tuple[Any, Any]], Value]
    added: Callable[[Machine, tuple[Term, ...], dict[str, Value]], Value]
    sum: Callable[[Machine, Sum, Value, Value, dict[str, Value], Trace | None], Value]
    culled: Callable[[Machine, Sum, int, int, dict[str, Value]], Value | None]
    array: Callable[[Machine, Array, Value, dict[str, Value]], Value]
    element: Callable[[Value, Value], Value]
    length: Callable[[Machine, Length, Value, Value | None], Value]
    data: Callable[[Data], Value]
    fold: Callable[[Machine, Fold, Value, Value, Value, dict[str, Value]], Value]
    integral: Callable[[Machine, Integral, dict[str, Value]], Value]
    kink: Callable[[Machine, Prim | Branch, tuple[tuple[Any, Any], ...], tuple[Cell, ...]], None]


@dataclass
class Machine:
    """One evaluation, carrying `directions` tangents; `rounding` where rounding errors are kept track of.

    frozen: surfaces, bounds and deltas stand still, so that tangents are those of the integrands alone.
    aside: it is looked at places beside those that count: surfaces that are met there say nothing.
    side: -1 or 1 where one-sided derivatives are wanted, for parameters that shrink or grow.
    summed: whether the members of batches are summands, so that nobody sees the digits of each.
    into: the number of the sum into which each member of a batch of integrals goes, if they are nothing but summands;
    of: and of the summand that it is, if its tangents are added up by these, as they are on a tape.
    taping: the one tangent is written on a tape (`kernels/tape`).
    """

    linker: Linker
    semantics: Semantics
    settings: Settings
    record: Record
    events: Events = field(default_factory=Events)
    directions: int = 0
    rounding: bool = True
    root: bool = True
    frozen: bool = False
    aside: bool = False
    side: int = 0
    summed: bool = False
    into: Ints | None = None
    of: Ints | None = None
    taping: bool = False

    @property
    def rtol(self) -> float:
        return self.settings.rtol

    @property
    def atol(self) -> float:
        return self.settings.atol

    @property
    def backend(self) -> str:
        """What computes at many points; where it is told how surfaces fall (`falls`), numpy."""
        return "numpy" if self.record.second else self.settings.backend

    def changed(self, **fields: Any) -> Machine:
        """The machine with other values of some fields: each integral asks for several, and `dataclasses.replace` takes
        ten times as long."""
        other = object.__new__(Machine)
        other.__dict__.update(self.__dict__, **fields)
        return other

    def with_directions(self, directions: int) -> Machine:
        if directions == self.directions and not self.taping:
            return self
        return self.changed(directions=directions, taping=False)

    def taped(self) -> Machine:
        """The machine that writes tangents on a tape."""
        return self.changed(directions=1, taping=True)

    def inside(self) -> Machine:
        """The machine for an integrand: rounding is estimated by the integrator, not kept track of."""
        return self.changed(rounding=False, root=False) if self.rounding or self.root else self

    def tracking(self) -> Machine:
        """The machine with rounding errors kept track of."""
        return self if self.rounding else self.changed(rounding=True)

    def standing(self) -> Machine:
        """The machine for which surfaces, bounds and deltas stand still."""
        return self.changed(frozen=True)

    def looking_aside(self) -> Machine:
        """The machine for a check of places beside those that count, for which nothing moves."""
        return self.changed(directions=0, taping=False, aside=True)

    # Record

    @property
    def costs(self) -> Costs | None:
        return self.record.costs

    def count(self, evaluations: int) -> None:
        self.record.count(evaluations, self.settings.max_evals)

    def sampled(self, share: float, limit: bool) -> None:
        """So much of the sampling of an integral is done, with `limit` of the most that it may take; 0 begins it."""
        if self.record.gauge is not None:
            self.record.gauge.sampled(share, limit)

    def search(self, boxes: int) -> bool:
        """Note that places are searched for in so many boxes more. Whether that is within the budget."""
        return self.record.search(boxes)

    def isolates(self, cells: int) -> bool:
        """Note that roots are looked for on so many stretches more. Whether the search may go on: roots that are not
        found leave no error that is known, so that it is given up late."""
        self.record.cells += cells
        return self.record.spent <= GIVEN_UP * self.settings.max_evals

    @property
    def isolated(self) -> Isolated:
        """The roots that were found so far."""
        return self.record.isolated

    @property
    def spent(self) -> float:
        """What counts against the budget so far."""
        return self.record.spent

    def exhausted(self) -> bool:
        return self.record.spent > self.settings.max_evals

    def overdrawn(self) -> bool:
        """Whether integrals inside of integrals have spent far more than the budget: what is left is given up."""
        return self.record.spent > OVERDRAFT * self.settings.max_evals

    def note(self, event: Event, members: Members = None) -> None:
        self.events.note(event, members)

    def apart(self) -> Machine:
        """The same machine for what is to be known by itself of what it meets: it has events of its own."""
        return self.changed(events=Events())

    @contextmanager
    def among(self, index: Ints) -> Iterator[Machine]:
        """The machine apart, for which these members are all that there are, with a budget of their own."""
        with self.record.among(index.size):
            yield self.apart()

    @contextmanager
    def unrecorded(self, **fields: Any) -> Iterator[Machine]:
        """The machine apart, with other values of some fields, of whose record nothing counts but the evaluations."""
        other = self.changed(events=Events(), record=Record(costs=None, gauge=self.record.gauge), **fields)
        try:
            yield other
        finally:
            self.record.evaluations += other.record.evaluations

    # Terms over batches

    def evaluate(self, function: Lam, env: Mapping[str, Value], trace: Trace | None) -> Value:
        """The value of a function of free variables (in sorted order) in an environment."""
        return self.run(function, [env[p] for p in function.params], trace)

    def run(self, function: Lam, args: list[Value], trace: Trace | None) -> Value:
        watching = WATCHING.get()
        if watching is not None:
            watching(function, args)
        k = self.directions
        found = self.kernel(function, tuple([pattern(a, k) for a in args]))
        backend = self.backend
        if many(args, backend) and not self.taping:
            if found.plain:
                return at_points(found, self, trace, args, backend)
            whole = None if trace or watching else self._written_in(function, args)
            if whole is not None:
                return at_points(whole[0], self, trace, whole[1], backend)
        return found.run(self, trace, *args)

    def _written_in(self, function: Lam, args: list[Value]) -> tuple[Kernel, list[Value]] | None:
        """The kernel of a function with all that it calls, and its arguments, where machine code may do that."""
        found = self.linker.written_in.of(function, args) if self.backend != "numpy" and available() else None
        if found is None:
            return None
        whole = self.kernel(found[0], tuple([pattern(a, self.directions) for a in found[1]]))
        return (whole, found[1]) if whole.plain else None

    def kernel(self, function: Lam, patterns: tuple[Pattern, ...]) -> Kernel:
        """The kernel of a function for arguments of these patterns."""
        key = (function, patterns, self.directions, self.rounding, self.taping, self.side, self.root)
        found = self.linker.kernels.get(key)
        if found is None:
            found = self.linker.kernels[key] = kernel(function, patterns, self.directions, self.rounding, self)
        else:
            counts.reused += 1
        return found

    def term(self, term: Term, env: dict[str, Value]) -> Value:
        return self.evaluate(function_of(term), env, None)

    # Definitions and functions

    def inexact(self, term: Term) -> bool:
        return self.linker.inexact(term)

    def global_value(self, module: str, name: str) -> Value:
        term = self.linker.term(module, name)
        if isinstance(term, Lam):
            return Closure(term, {}, self.linker.inexact(term), (module, name))
        known = self.linker.held.get((module, name))
        if known is not None:
            self.record.used[module, name] = known
            return pad(known, self.directions)
        key = (module, name, self.settings)
        if key not in self.linker.constants:
            self.enter()
            still = self.changed(directions=0, taping=False, rounding=True, frozen=False)
            self.linker.constants[key] = still.term(term, {})
            self.record.depth -= 1
        return pad(self.linker.constants[key], self.directions)

    def closure(self, function: Lam, captured: dict[str, Value]) -> Value:
        return Closure(function, captured, self.linker.inexact(function) or any(map(carries_errors, captured.values())))

    def derived(self, function: Value) -> Value:
        if not isinstance(function, Closure):
            raise errors.wrong_call("`deriv` needs a function", "write the integral as a function of its parameters")
        if isinstance(function, Chosen):
            return Chosen([Derivative(option) for option in function.options], function.places)
        return Derivative(function)

    def project(self, value: Value, index: int) -> Value:
        if isinstance(value, (tuple, list)) and index < len(value):
            return value[index]
        raise errors.wrong_call(f"this value has no component {index + 1}")

    def fail(self, term: Hole | DeltaTerm) -> Value:
        if isinstance(term, Hole):
            kind = errors.NO_MEASURE if term.measure else errors.BROKEN
            raise PottoError([kind(errors.NOWHERE, term.reason)])
        message = "a delta has a meaning only under an integral over its variables"
        raise PottoError([errors.NO_MEANING(errors.NOWHERE, message)])

    # Calls

    def enter(self) -> None:
        self.record.depth += 1
        if self.record.depth > DEEPEST_CALLS:
            self.record.depth = 0
            raise PottoError([errors.TOO_DEEP(
                errors.NOWHERE, f"more than {DEEPEST_CALLS:,} calls inside each other",
                help="make sure that the condition that ends the recursion becomes true",
            )])  # fmt: skip

    def call(self, function: Value, groups: Groups, trace: Trace | None) -> Value:
        if not isinstance(function, Closure):
            if not groups:
                return function
            raise errors.wrong_call("this is called, but it is not a function", "to multiply, write `*`")
        if isinstance(function, Derivative):
            return self.semantics.derivative(self, function, groups, trace)
        if isinstance(function, Paired):
            return self.semantics.paired(self, function, groups, trace)
        if isinstance(function, Chosen):
            return self.semantics.chosen(self, function, groups)
        self.enter()
        whole, arities = uncurried(function.lam, sizes_of(groups))
        args = [function.captured[n] for n in sorted(function.captured)]
        for group, arity in zip(groups, arities):
            args.extend(fit(group, arity))
        try:
            value = self.run(whole, args, trace)
        except PottoError as error:
            raise error.of(function.lam) from None
        self.record.depth -= 1
        return value

    # Branches, sums, arrays, integrals

    def falls(self, surface: Number, strict: bool) -> tuple[Any, Any]:
        """Which side a surface falls on, and nan wherever it is nan."""
        mask = surface > 0 if strict else surface >= 0
        if self.root and self.directions and self.record.second and not self.aside and np.any(surface == 0):
            raise errors.Coincidence([PRODUCT_OF_DELTAS(
                errors.NOWHERE, NO_SECOND_DERIVATIVE.message,
                notes=("a bound jumps, too: of two at one place it holds a product of deltas, which does not exist",),
                help="move the parameters apart, or differentiate only once",
            )])  # fmt: skip
        if surface.__class__ is float:
            return mask, (surface if surface != surface else None)
        bad = np.isnan(surface)
        return mask, (np.where(bad, np.nan, 0.0) if bad.any() else None)

    def kink(self, term: Prim | Branch, kinks: tuple[tuple[Any, Any], ...], args: tuple[Cell, ...]) -> None:
        """Note that a term stands at one of its kinks, or jumps, if it does. kinks: what is 0 there, with errors."""
        for u, e in kinks:
            if np.any(np.abs(u) <= e):
                return self.semantics.kink(self, term, kinks, args)

    def lazy(self, mask: Any, term: If | Branch, env: dict[str, Value], traces: tuple[Any, Any]) -> Value:
        return self.semantics.conditional(self, mask, term, env, traces)

    def added(self, terms: tuple[Term, ...], env: dict[str, Value]) -> Value:
        return self.semantics.added(self, terms, env)

    def sum(self, term: Sum, lo: Value, hi: Value, env: dict[str, Value], trace: Trace | None) -> Value:
        return self.semantics.sum(self, term, lo, hi, env, trace)

    def array(self, term: Array, size: Value, env: dict[str, Value]) -> Value:
        return self.semantics.array(self, term, size, env)

    def index(self, term: Index, whole: Value, place: Value) -> Value:
        try:
            return self.semantics.element(whole, place)
        except PottoError as error:
            raise error.of(term) from None

    def length(self, term: Length, whole: Value, like: Value | None) -> Value:
        try:
            return self.semantics.length(self, term, whole, like)
        except PottoError as error:
            raise error.of(term) from None

    def fold(self, term: Fold, lo: Value, hi: Value, start: Value, env: dict[str, Value]) -> Value:
        return self.semantics.fold(self, term, lo, hi, start, env)

    def data(self, term: Data) -> Value:
        found = self.linker.data.get(term)
        if found is None:
            found = self.linker.data[term] = self.semantics.data(term)
        return pad(found, self.directions)

    def integral(self, term: Integral, env: dict[str, Value]) -> Value:
        return self.semantics.integral(self, term, env)
