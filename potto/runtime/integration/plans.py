"""The plans of integrals for the functions and plain values at hand, made once.

Owns `Linked`, `link` and `plan_for`. A plan is found by the content of the integral and of all that it calls, and by
the course that recursions and sums take in it; members of a batch that take different ones are told apart.
"""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any

import numpy as np

from potto.calculus.algebra.point_values import sample_value
from potto.calculus.inlining.deciding import deciding
from potto.core.terms import Deriv, Integral, Lam, Term, Var, deriv, substitute, var
from potto.diagnostics import PottoError
from potto.integrate.elimination.recursion import Eliminated, eliminated
from potto.integrate.pieces import still
from potto.integrate.plan import Plan, make
from potto.kernels.cells import Array, Bools, Cell, Value, map_arrays
from potto.kernels.making import making
from potto.runtime.evaluation.functions import Closure, Derivative
from potto.runtime.evaluation.machine import Machine

MOST_PLANS = 1024


@dataclass
class Linked:
    """The functions that an integral calls, as terms whose free variables have names of their own."""

    functions: dict[str, Lam | Deriv]
    env: dict[str, Value]


# Functions that an integral calls


def link(env: dict[str, Value]) -> Linked:
    functions: dict[str, Lam | Deriv] = {}
    extended: dict[str, Value] = dict(env)

    def add(name: str, function: Closure) -> None:
        derivative = isinstance(function, Derivative)
        while isinstance(function, Derivative):
            function = function.primal
        renamed: dict[str, Term] = {}
        for inner, value in function.captured.items():
            own = f"{name}@{inner}"
            renamed[inner] = var(own)
            extended[own] = value
            if isinstance(value, Closure):
                add(own, value)
        linked = substitute(function.lam, renamed)
        assert isinstance(linked, Lam)
        functions[name] = deriv(linked) if derivative else linked

    for name, value in env.items():
        if isinstance(value, Closure):
            add(name, value)
    return Linked(functions, extended)


# Plans

_plans: OrderedDict[Any, list[Plan]] = OrderedDict()
_eliminated: OrderedDict[Any, Eliminated | None] = OrderedDict()
_lock = threading.Lock()


def plan_for(machine: Machine, term: Integral, linked: Linked) -> Plan:
    """The plan for these functions and plain values; made once."""
    functions = tuple((name, f.digest) for name, f in sorted(linked.functions.items()))
    key = (term.digest, functions, machine.linker.reached(term, *linked.functions.values()))
    with _lock:
        candidates = list(_plans.get(key, ()))
    for plan in candidates:
        if all(decide(machine, t, linked) == value for t, value in plan.decisions) and _holds(plan, machine, linked):
            return plan
    with making:
        plan = make(
            term,
            lambda head: linked.functions.get(head.name) if isinstance(head, Var) else machine.linker.function(head),
            lambda plain: decide(machine, plain, linked),
            lambda head: _plainly(head, linked) if isinstance(head, Var) else machine.linker.function(head),
            _Numbers(machine, linked),
        )
    with _lock:
        _plans.setdefault(key, []).append(plan)
        _plans.move_to_end(key)
        if len(_plans) > MOST_PLANS:
            _plans.popitem(last=False)
    if not _holds(plan, machine, linked):
        raise Mixed(_fitting(plan, machine, linked))
    return plan


class Mixed(Exception):
    """Members of a batch for which the plan of the first one does not hold. `fits`: for which it does."""

    def __init__(self, fits: Bools) -> None:
        self.fits = fits


def _holds(plan: Plan, machine: Machine, linked: Linked) -> bool:
    return plan.premise is None or bool(np.all(_fitting(plan, machine, linked)))


def _fitting(plan: Plan, machine: Machine, linked: Linked) -> Bools:
    """The members of a batch for which a plan holds."""
    assert plan.premise is not None
    env = {name: still(linked.env[name]) for name in plan.premise.params}
    found = machine.with_directions(0).evaluate(plan.premise, env, None)
    assert isinstance(found, Cell)
    holds: Bools = np.asarray(found.v) > 0
    return holds


class _Numbers:
    """What plain terms are for the first member of a batch, or nan."""

    def __init__(self, machine: Machine, linked: Linked) -> None:
        self.machine = machine
        self.first = {n: map_arrays(still(v), _first) for n, v in linked.env.items()}
        self.point = {n: v.v for n, v in self.first.items() if isinstance(v, Cell) and isinstance(v.v, float)}
        self.known: dict[Term, float] = {}

    def __call__(self, plain: Term) -> float:
        found = sample_value(plain, self.point, self.known)
        if found == found or not plain.free <= self.first.keys():
            return found
        try:
            value = self.machine.with_directions(0).term(plain, {name: self.first[name] for name in plain.free})
        except PottoError:
            return math.nan
        return value.v if isinstance(value, Cell) and isinstance(value.v, float) else math.nan


def _first(numbers: Array) -> Any:
    return float(numbers.reshape(-1)[0])


def eliminated_for(machine: Machine, term: Integral, linked: Linked) -> Eliminated | None:
    """The steps of an integral over many variables that each depend on one number, if it has such; found once."""
    functions = tuple((name, f.digest) for name, f in sorted(linked.functions.items()))
    key = (term.digest, functions, machine.linker.reached(term, *linked.functions.values()))
    with _lock:
        if key in _eliminated:
            return _eliminated[key]
    with making:
        found = eliminated(
            term, lambda head: _plainly(head, linked) if isinstance(head, Var) else machine.linker.function(head)
        )
    with _lock:
        _eliminated[key] = found
        if len(_eliminated) > MOST_PLANS:
            _eliminated.popitem(last=False)
    return found


def _plainly(head: Var, linked: Linked) -> Lam | Deriv | None:
    """The function that a name stands for, unless it stands for one on duals."""
    return linked.functions.get(head.name) if type(linked.env.get(head.name)) is Closure else None


def decide(machine: Machine, plain: Term, linked: Linked) -> float | None:
    """The value of a plain term over parameters, where it is one number for the whole batch."""
    env: dict[str, Value] = {}
    for name in plain.free:
        value = linked.env.get(name)
        if value is None:
            return None
        if isinstance(value, Cell):
            flat = np.asarray(value.v)
            if flat.ndim and flat.size and not (flat == flat.flat[0]).all():
                return None
            env[name] = Cell(float(flat.flat[0]))
        else:
            env[name] = still(value) if isinstance(value, Closure) else value
    try:
        result = machine.with_directions(0).term(plain, env)
    except PottoError:
        return None
    if isinstance(result, Cell):
        number = np.asarray(result.v)
        return float(number.flat[0])
    return None


def split_by_decisions(machine: Machine, term: Integral, linked: Linked, batch: int) -> list[Any] | None:
    """Members of the batch for which recursions and sums under the integral take the same course, if not all do."""
    if batch == 1:
        return None
    deciding = deciding_names(machine, term, linked)
    rows = []
    for name in sorted(deciding):
        value = linked.env.get(name)
        if isinstance(value, Cell) and isinstance(value.v, np.ndarray) and value.v.size > 1:
            rows.append(value.v)
    if not rows:
        return None
    _, where = np.unique(np.stack(rows), axis=1, return_inverse=True)
    where = np.asarray(where).reshape(-1)
    count = int(where.max()) + 1
    return [np.nonzero(where == g)[0] for g in range(count)] if count > 1 else None


def deciding_names(machine: Machine, term: Integral, linked: Linked) -> frozenset[str]:
    """Parameters that reach the condition of a recursion or the bounds of a sum under the integral."""
    functions = tuple(f.digest for _, f in sorted(linked.functions.items()))
    key = (term.digest, functions, machine.linker.reached(term, *linked.functions.values()))
    found = _deciding.get(key)
    if found is None:
        found = deciding(
            (term.body, *(bound for pair in term.bounds for bound in pair), *linked.functions.values()),
            lambda head: linked.functions.get(head.name) if isinstance(head, Var) else machine.linker.function(head),
        )
        if len(_deciding) > MOST_PLANS:
            _deciding.clear()
        _deciding[key] = found
    return found


_deciding: dict[Any, frozenset[str]] = {}
