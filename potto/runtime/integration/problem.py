"""An integral to be solved: its term, what it calls, and its parameters.

Owns `Problem`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from potto.core.terms import Integral
from potto.integrate.events import Events
from potto.integrate.plan import Plan
from potto.kernels.cells import Array, Ints, Value, map_arrays
from potto.runtime.evaluation.machine import Machine
from potto.runtime.integration.plans import Linked, link, plan_for


@dataclass(frozen=True)
class Problem:
    """An integral for a batch of parameters; `outermost` where no other integral asks for it.

    machine: what evaluates, and notes what is met. linked: the parameters, and the functions among them as terms.
    """

    machine: Machine
    term: Integral
    linked: Linked
    batch: int = 1
    outermost: bool = False

    @property
    def env(self) -> dict[str, Value]:
        return self.linked.env

    @property
    def events(self) -> Events:
        return self.machine.events

    def plan(self, order: Integral | None = None) -> Plan:
        """The plan, with the variables in this order."""
        return plan_for(self.machine, self.term if order is None else order, self.linked)

    def apart(self) -> Problem:
        """The problem with events of its own."""
        return replace(self, machine=self.machine.apart())

    @contextmanager
    def among(self, index: Ints, members: Linked | None = None) -> Iterator[Problem]:
        """The problem of some members by themselves, with a budget and events of their own."""
        linked = self.picked(index) if members is None else members
        with self.machine.among(index) as machine:
            yield replace(self, machine=machine, linked=linked, batch=index.size)

    def picked(self, index: Ints) -> Linked:
        """Some members of the batch; one of them by itself as plain numbers."""

        def part(a: Array) -> Any:
            return float(a[index[0]]) if index.size == 1 else a[index]

        return Linked(self.linked.functions, {name: map_arrays(value, part) for name, value in self.env.items()})

    def moved(self, env: dict[str, Value]) -> Problem:
        """One member at other parameters; what is met there is forgotten."""
        return Problem(self.machine.apart(), self.term, link(env))
