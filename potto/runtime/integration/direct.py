"""Calls that are nothing but an integral of numbers: on the shortest way from arguments to the answer.

Owns `Direct` and `direct`. A call from outside mostly leads through a few definitions straight to an integral whose
plan holds for all parameters and whose orders are proved (`a_priori`). Which parameter of the integral has which
argument is found out once; then nothing is left between the arguments and the rule. What the rule does not settle, or
what the arguments are not made for, takes the general way, which gives the same.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from msgspec import Struct

from potto.calculus.inlining.currying import arguments_of, sizes_of, uncurry
from potto.calculus.surfaces.discontinuities import TooDeep
from potto.calculus.surfaces.trace import spine
from potto.core.terms import App, Const, Deriv, Integral, Lam, Term, Var
from potto.diagnostics import PottoError
from potto.integrate.fixed.a_priori import Settled, proved_sum, settled
from potto.integrate.fixed.straight import Straight
from potto.kernels.cells import Cell, Value
from potto.kernels.making import making
from potto.runtime.answers.convergence import allowance_of_one, widest
from potto.runtime.evaluation.duals import merge, split
from potto.runtime.evaluation.functions import Closure
from potto.runtime.evaluation.machine import Linker, Machine
from potto.runtime.integration.arrays import met
from potto.runtime.integration.choices import many, preferred
from potto.runtime.integration.preparation import filled, placed, prepared
from potto.runtime.integration.problem import Mixed, Problem, linked
from potto.runtime.integration.solving import solve

DEEPEST = 20  # definitions that a call may lead through
MOST_FUNCTIONS = 256  # that a call is given one after the other


class Direct(Struct, frozen=True):
    """An integral, and what its parameters are: the names of arguments, or numbers. dual: arguments are duals.

    rules: by the functions that it is given, and whether it is differentiated; None where there is no such rule.
    """

    term: Integral
    places: tuple[tuple[str, str | Cell], ...]
    dual: bool
    rules: dict[tuple[tuple[Lam, ...], bool], Straight | None] = {}

    def value(self, machine: Machine, env: Mapping[str, Value]) -> Value | None:
        """The value of the call; None where only the general way has it."""
        working = (machine.with_directions(1) if self.dual else machine).inside()
        here, rule = self._prepared(machine, working, env)
        found = None if rule is None else proved_sum(rule, working, here)
        if found is None:
            return None
        record = machine.record
        record.integrals += 1
        record.methods.add("quadrature")
        rates = max(*found.gross[1:], *map(abs, found.number[1:]), 0.0, 0.0)
        record.within = widest(record.within, allowance_of_one(self.term, found.gross[0], rates, machine.rtol))
        cell = Cell(found.number[0], found.error[0], tuple(found.number[1:]), tuple(found.error[1:]))
        return split(cell) if self.dual else cell

    def settled(self, machine: Machine, env: Mapping[str, Value]) -> Settled | None:
        """What is known of the call for all numbers near these, if it is the same for all of them."""
        working = machine.inside()
        here, rule = ({}, None) if self.dual else self._prepared(machine, working, env)
        return None if rule is None else settled(rule, working, here)

    def _prepared(
        self, machine: Machine, working: Machine, env: Mapping[str, Value]
    ) -> tuple[dict[str, Value], Straight | None]:
        """The parameters of the integral, and its rule; None where there is no such rule."""
        if machine.settings.method in ("mc", "qmc") or machine.taping or (self.dual and machine.directions):
            return {}, None
        here, functions = self._given(machine, env)
        if here is None:
            return {}, None
        key = functions, working.directions > 0
        if key not in self.rules:
            if len(self.rules) >= MOST_FUNCTIONS:
                self.rules.clear()
            with making:
                self.rules[key] = self._rule(working, here)
        return here, self.rules[key]

    def _given(self, machine: Machine, env: Mapping[str, Value]) -> tuple[dict[str, Value] | None, tuple[Lam, ...]]:
        """The parameters of the integral, and the functions among them; None where these are not plain."""
        here: dict[str, Value] = {}
        functions: tuple[Lam, ...] = ()
        for name, place in self.places:
            value = env[place] if isinstance(place, str) else place
            value = merge(value) if self.dual else value
            if type(value) is Closure and not value.captured:
                functions += (value.lam,)
            elif not isinstance(value, Cell) or value.e is not None or isinstance(value.v, np.ndarray):
                return None, ()
            here[name] = value
        return here, functions

    def _rule(self, machine: Machine, env: dict[str, Value]) -> Straight | None:
        """The rule that the general way would come to for all numbers, if it is proved."""
        reach = machine.linker.reach
        try:
            term, full = filled(self.term, env, reach)
            if full is not env or met(term, env, reach):
                return None
            again = machine.directions > 0
            if placed(term, reach, again) is not term or prepared(term, reach) is not term:
                return None
            problem = Problem(machine.apart(), term, *linked(env), solve, 1, True)
            if many(problem):
                return None
            plan = problem.plan(next(iter(preferred(problem))))
        except (PottoError, Mixed, TooDeep, RecursionError):
            return None
        return None if plan.decisions or plan.premise is not None else plan.straight


def direct(term: Term, linker: Linker) -> Direct | None:
    """The integral that a term with free variables is, through the calls around it."""
    places: dict[str, str | Cell] = {name: name for name in term.free}
    dual = False
    for _ in range(DEEPEST):
        if isinstance(term, Integral):
            return Direct(term, tuple((name, places[name]) for name in sorted(term.free)), dual)
        if not isinstance(term, App):
            return None
        head, groups = spine(term)
        function = linker.function(head)
        if isinstance(function, Deriv) and not dual:
            dual, function = True, linker.function(function.function)
        if not isinstance(function, Lam) or function.free:
            return None
        params, body = uncurry(function, sizes_of(groups))
        args = arguments_of(function, groups)
        if len(args) != len(params):
            return None
        found: dict[str, str | Cell] = {}
        for name, arg in zip(params, args, strict=True):
            if isinstance(arg, Var):
                found[name] = places[arg.name]
            elif isinstance(arg, Const) and not dual:
                found[name] = Cell(float(arg.value))
            else:
                return None
        places, term = found, body
    return None
