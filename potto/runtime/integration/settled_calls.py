"""Calls that are one integral, with all that was found out about it: what is left of them for other numbers.

Owns `SettledCall`, `SweptCall`, `Batches` and `unused`. `direct` makes them, and of several what is computed of these.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Integral
from potto.integrate.fixed.moving_sums import MovingTotals
from potto.integrate.fixed.proved_sums.a_priori import proved_gradient
from potto.integrate.fixed.proved_sums.settled import SettledRegion
from potto.integrate.fixed.steps.step_sums import SteppedCall
from potto.integrate.fixed.straight import StraightIntegral
from potto.kernels.cells import Cell, Value
from potto.kernels.whole import TWICE
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.record import Record
from potto.runtime.integration.driver import integrate


class SweptCall(Struct, frozen=True):
    """An integral of step functions with its derivatives by some parameters, whatever these are."""

    rule: StraightIntegral
    machine: Machine
    moving: tuple[str, ...]

    def at(self, env: Mapping[str, Any]) -> MovingTotals | None:
        """The value and the derivatives; None where these are not plain, or not as accurate as was asked for."""
        found = proved_gradient(self.rule, self.machine, env, self.moving)
        if found is None:
            return None
        error = [e + TWICE * abs(x) for x, e in zip(found.number[1:], found.error[1:], strict=True)]  # as by a tape
        return MovingTotals(found.number, [found.error[0], *error], found.gross, found.nodes)


class SettledCall(Struct, frozen=True):
    """An integral all about which is settled near the arguments of a call. fixed, given: its parameters that are
    numbers, and those that are arguments."""

    integral: SettledRegion | SteppedCall | SweptCall
    fixed: Mapping[str, Value]
    given: tuple[tuple[str, str], ...]

    def at(self, env: Mapping[str, Cell]) -> MovingTotals | None:
        """The value and its tangents; None where they take more."""
        here = dict(self.fixed)
        for name, place in self.given:
            here[name] = env[place]
        return self.integral.at(here)


class Batches(Struct, frozen=True):
    """An integral that batches of numbers go to without detours. fixed, given: as of `SettledCall`."""

    term: Integral
    machine: Machine
    fixed: Mapping[str, Value]
    given: tuple[tuple[str, str], ...]

    def at(self, env: Mapping[str, Value]) -> tuple[Value, Machine]:
        """The value with its tangents, and the machine that knows what was met. Raises PottoError."""
        machine = unused(self.machine)
        here = dict(self.fixed)
        for name, place in self.given:
            here[name] = env[place]
        with np.errstate(all="ignore"):
            return integrate(machine, self.term, here), machine


def unused(machine: Machine) -> Machine:
    """The machine without what a call has left in it."""
    return machine.apart().changed(record=Record(most_boxes=machine.record.most_boxes))
