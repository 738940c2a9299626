"""An integral to be solved: its term, what it calls, its parameters, and what is known of it before any number.

Owns `Problem` and `linked`. A plan is found by the content of the integral and of all that it calls, and by the course
that recursions and sums take in it, once; members of a batch that take different ones are told apart.
"""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

from potto import store
from potto.calculus.algebra.point_values import sample_value
from potto.calculus.inlining.deciding import deciding
from potto.core.packing import keep, recall
from potto.core.terms import Deriv, Integral, Lam, Term, Var, deriv, substitute, var
from potto.diagnostics import PottoError
from potto.integrate.columns import run_of
from potto.integrate.events import Events
from potto.integrate.pieces import Sums, number_at, still
from potto.integrate.plan import Plan, inlined, make, numbers_in, unpacked_plan
from potto.kernels.cells import Array, Bools, Cell, Ints, Value, map_arrays
from potto.kernels.making import making
from potto.runtime.evaluation.functions import Closure, Derivative
from potto.runtime.evaluation.machine import Machine
from potto.runtime.integration.preparation.known_sides import Sided, sided

if TYPE_CHECKING:
    from potto.integrate.elimination.step_plans import Eliminated

MOST_INTEGRALS = 1024
MOST_LOOKED_AT = 8  # members that are each asked on which sides they lie

Functions = dict[str, Lam | Deriv]


def linked(env: dict[str, Value]) -> tuple[Functions, dict[str, Value]]:
    """The functions that an integral calls, as terms whose free variables have names of their own, and the environment
    with these."""
    functions: Functions = {}
    extended: dict[str, Value] = dict(env)
    for name, value in env.items():
        if isinstance(value, Closure):
            _link(name, value, functions, extended)
    return functions, extended


def _link(name: str, function: Closure, functions: Functions, env: dict[str, Value]) -> None:
    """Add a function under this name, with what it captured under names of their own. (Within `linked` it would hold
    itself, and so the arrays of a batch, until Python looks for such things.)"""
    derivative = isinstance(function, Derivative)
    while isinstance(function, Derivative):
        function = function.primal
    renamed: dict[str, Term] = {}
    for inner, value in function.captured.items():
        own = f"{name}@{inner}"
        renamed[inner] = var(own)
        env[own] = value
        if isinstance(value, Closure):
            _link(own, value, functions, env)
    term = substitute(function.lam, renamed)
    assert isinstance(term, Lam)
    functions[name] = deriv(term) if derivative else term


class Known(Struct):
    """What was found out about an integral and all that it calls: plans, one for each course that it may take; the
    steps that eliminate its variables; the parameters that decide its course; its sides. Empty where nobody has asked.

    key: what it is kept under on disk. packed: the plans as they are kept. written: its integrand with calls carried
    out, looks: how often it was looked at without a plan. ended: the order of its variables in which a trial came to an
    end last time, and the evaluations that it took.
    """

    key: bytes = b""
    plans: list[Plan] = []
    packed: list[bytes] = []
    steps: list[Eliminated | None] = []
    deciding: list[frozenset[str]] = []
    sided: list[Sided | None] = []
    written: list[Term] = []
    looks: int = 0
    ended: tuple[Integral, int] | None = None


_known: OrderedDict[Any, Known] = OrderedDict()
_lock = threading.Lock()


def _recalled(key: tuple[object, ...], inline: Callable[[Term], Lam | Deriv | None]) -> Known:
    """What an earlier process has found out about an integral; the digests in the key are those of contents. inline:
    gives the functions that it calls."""
    name = repr(key).encode()
    plans = recall("plans", name) or []
    return Known(name, [unpacked_plan(plan, inline) for plan in plans], plans)


def clear() -> None:
    """Forget what is known of integrals in this process (for tests and measurements)."""
    with _lock:
        _known.clear()


class Mixed(Exception):
    """Members of a batch for which the plan of the first one does not hold. `fits`: for which it does."""

    def __init__(self, fits: Bools) -> None:
        self.fits = fits


@dataclass(frozen=True)
class Problem:
    """An integral for a batch of parameters; `outermost` where no other integral asks for it.

    machine: what evaluates, and notes what is met. functions, env: see `linked`. solver: what solves problems like it.
    """

    machine: Machine
    term: Integral
    functions: Functions
    env: dict[str, Value]
    solver: Callable[[Problem], Sums]
    batch: int = 1
    outermost: bool = False

    @property
    def events(self) -> Events:
        return self.machine.events

    # Others like it

    def changed(self, **fields: Any) -> Problem:
        """The problem with other values of some fields; what was found out is kept where it is about the same."""
        other = object.__new__(Problem)
        other.__dict__.update(self.__dict__, **fields)
        if "env" in fields:
            other.__dict__.pop("chosen", None)
        if "term" in fields or "functions" in fields:
            other.__dict__.pop("known", None)
        return other

    def at(self, env: dict[str, Value], **changes: Any) -> Problem:
        """The problem at other parameters."""
        functions, extended = linked(env)
        return self.changed(functions=functions, env=extended, **changes)

    def apart(self) -> Problem:
        """The problem with events of its own."""
        return self.changed(machine=self.machine.apart())

    @contextmanager
    def among(self, index: Ints, env: dict[str, Value] | None = None) -> Iterator[Problem]:
        """The problem of some members by themselves, with a budget and events of their own."""
        with self.machine.among(index) as machine:
            part = self.picked(index) if env is None else self.at(env, batch=index.size)
            yield part.changed(machine=machine)

    def picked(self, index: Ints) -> Problem:
        """The problem of some members; one of them by itself has plain numbers."""
        if 1 < index.size == self.batch and run_of(index) is not None:  # all
            return self.changed()

        def part(a: Array) -> Any:
            return float(a[index[0]]) if index.size == 1 else a[index]

        env = {name: map_arrays(value, part) for name, value in self.env.items()}
        picked = self.changed(env=env, batch=index.size)
        picked.__dict__["chosen"] = dict(self.chosen)  # what holds for a batch holds for its members
        return picked

    def member(self, number: int) -> Problem:
        """The problem of one member by itself, apart."""
        return self.picked(np.array([number])).apart()

    def beside(self, env: dict[str, Value], batch: int | None = None) -> Sums:
        """What members, or a batch in their place, come to at other parameters; what is met there is forgotten."""
        batch = self.batch if batch is None else batch
        return self.solver(self.at(env, machine=self.machine.apart(), outermost=False, batch=batch))

    @property
    def flat(self) -> bool:
        """Whether all surfaces are affine in each variable by itself, as far as anyone has asked."""
        return all(each is None or each.flat for each in self.known.sided)

    def on_known_sides(self) -> list[tuple[Ints, Integral]]:
        """For the members of which some surfaces are known to pass all by: what is left of the integral, and of which
        members it is that. Of many members it is not asked."""
        settings, costs = self.machine.settings, self.machine.costs
        if self.batch > MOST_LOOKED_AT or not self.outermost or settings.sampled or costs is not None:
            return []
        found: dict[Integral, list[int]] = {}
        with making:
            if not self.known.sided:
                self.known.sided.append(sided(self.term, self.plain_function))
            whole = self.known.sided[0]
            for number in range(self.batch if whole is not None else 0):
                own = self if self.batch == 1 else self.picked(np.array([number]))
                left = None if whole is None else whole.at(own.env)
                if left is not None:
                    found.setdefault(left, []).append(number)
        return [(np.array(members), left) for left, members in found.items()]

    # What is known before any number

    def plan(self, order: Integral | None = None) -> Plan:
        """The plan for these functions and plain values, with the variables in this order; made once."""
        order = self.term if order is None else order
        plan = self.chosen.get(order)
        if plan is None:
            plan = self.chosen[order] = (self if order is self.term else self.changed(term=order))._plan()
        return plan

    def width(self) -> int:
        """How many numbers the integrand comes to, at the least."""
        sided = next(iter(self.known.sided), None)
        return self.plan().width if sided is None else numbers_in(sided.term.body)

    @cached_property
    def chosen(self) -> dict[Integral, Plan]:
        """The plans for orders of the variables that hold at these parameters, as far as anyone has asked."""
        return {}

    def _plan(self) -> Plan:
        known, partly = self.known.plans, None
        for plan in tuple(known):
            if all(self.decided(t) == value for t, value in plan.decisions):
                fits = self.fitting(plan)
                if fits.all():
                    return plan
                if partly is None and fits.flat[0]:
                    partly = fits
        if partly is not None:  # another one for the first member would be the same
            raise Mixed(partly)
        with making:
            outlines = self.machine.linker.outlines
            plan = make(self.term, self.function, self.decided, self.plain_function, _Sampled(self), outlines)
        known.append(plan)
        # Each as it was made: evaluation adds to what a plan knows, in forms that are for this process alone.
        if store.is_on():
            with suppress(TypeError):  # what is not data is not kept
                self.known.packed.append(plan.packed())
                keep("plans", self.known.key, self.known.packed)
        fits = self.fitting(plan)
        if self.batch > 1 and not fits.all():  # to rounding it holds for the one that it was made for
            raise Mixed(fits)
        return plan

    def unplanned(self, most: int) -> Term | None:
        """The integrand with calls carried out, for a look at an integral that has no plan; None where there is one,
        or it was looked at so often that it pays to make it."""
        known = self.known
        if known.plans or known.looks >= most:
            return None
        if not known.written:
            with making:
                known.written.append(inlined(self.term, self.plain_function, {}))
        return known.written[0]

    def steps(self) -> Eliminated | None:
        """The steps of an integral over many variables that each depend on one number, if it has such; found once."""
        known = self.known.steps
        if not known:
            from potto.integrate.elimination.step_plans import eliminated

            with making:
                known.append(eliminated(self.term, self.plain_function))
        return known[0]

    def courses(self) -> list[Ints]:
        """The members for which recursions and sums under the integral take the same course, each with the others;
        nothing where that is one for all."""
        known = self.known.deciding
        if not known:
            bounds = (bound for pair in self.term.bounds for bound in pair)
            known.append(deciding((self.term.body, *bounds, *self.functions.values()), self.function))
        cells = (self.env.get(name) for name in sorted(known[0]))
        rows = [c.v for c in cells if isinstance(c, Cell) and isinstance(c.v, np.ndarray) and c.v.size > 1]
        if not rows:
            return []
        _, where = np.unique(np.stack(rows), axis=1, return_inverse=True)
        where = np.asarray(where).reshape(-1)
        return [np.nonzero(where == number)[0] for number in range(int(where.max()) + 1)]

    @cached_property
    def known(self) -> Known:
        functions = tuple((name, f.digest) for name, f in sorted(self.functions.items()))
        key = (self.term.digest, functions, self.machine.linker.reached(self.term, *self.functions.values()))
        with _lock:
            found = _known.get(key)
            if found is None:
                found = _known[key] = _recalled(key, self.plain_function)
            _known.move_to_end(key)
            if len(_known) > MOST_INTEGRALS:
                _known.popitem(last=False)
        return found

    def function(self, head: Term) -> Lam | Deriv | None:
        """The function, or derivative of one, that a term leads to."""
        return self.functions.get(head.name) if isinstance(head, Var) else self.machine.linker.function(head)

    def plain_function(self, head: Term) -> Lam | Deriv | None:
        """The same, but none that stands for a function on duals."""
        if isinstance(head, Var) and type(self.env.get(head.name)) is not Closure:
            return None
        return self.function(head)

    def fitting(self, plan: Plan) -> Bools:
        """The members for which a plan holds."""
        if plan.premise is None:
            return np.ones(1, dtype=bool)
        env = {name: still(self.env[name]) for name in plan.premise.params}
        return np.asarray(number_at(plan.premise, self.machine.with_directions(0), env).v) > 0

    def decided(self, plain: Term) -> float | None:
        """The value of a plain term over parameters, where it is one number for the whole batch."""
        env: dict[str, Value] = {}
        for name in plain.free:
            value = self.env.get(name)
            if value is None:
                return None
            if isinstance(value, Cell):
                flat = np.asarray(value.v)
                if flat.ndim and flat.size and not (flat == flat.flat[0]).all():
                    return None
                value = Cell(float(flat.flat[0]))
            env[name] = still(value) if isinstance(value, Closure) else value
        result = self.number(plain, env)
        return None if result is None else float(np.asarray(result).flat[0])

    def number(self, plain: Term, env: dict[str, Value]) -> Any:
        """What a plain term comes to; None where it is not a number."""
        try:
            value = self.machine.with_directions(0).term(plain, env)
        except PottoError:
            return None
        return value.v if isinstance(value, Cell) else None


class _Sampled:
    """What plain terms are for the first member of a batch, or nan."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.first = {n: map_arrays(still(v), lambda a: float(a.flat[0])) for n, v in problem.env.items()}
        self.point = {n: v.v for n, v in self.first.items() if isinstance(v, Cell) and isinstance(v.v, float)}
        self.known: dict[Term, float] = {}

    def __call__(self, plain: Term) -> float:
        found = sample_value(plain, self.point, self.known)
        if found == found or not plain.free <= self.first.keys():
            return found
        value = self.problem.number(plain, {name: self.first[name] for name in plain.free})
        return value if isinstance(value, float) else math.nan
