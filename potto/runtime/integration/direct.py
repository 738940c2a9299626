"""Calls that are nothing but integrals of numbers: on the shortest way from arguments to the answer.

Owns `Direct`, `Around` and `direct`. A call from outside mostly leads through a few definitions straight to
an integral whose plan holds for all parameters and whose orders are proved (`a_priori`), or to arithmetic with such.
Which argument each parameter of the integral is, is found out once; then nothing is left between the arguments and the
rule. What the rule does not settle, or what the arguments are not made for, takes the general way: that gives the same.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from msgspec import Struct

from potto.calculus.inlining.alike import most_alike
from potto.calculus.inlining.currying import arguments_of, sizes_of, uncurry
from potto.calculus.surfaces.discontinuities import TooDeep
from potto.calculus.surfaces.trace import spine
from potto.core.terms import (
    App,
    Const,
    Deriv,
    Integral,
    Lam,
    Prim,
    Term,
    Var,
    children,
    lam,
    postorder,
    replaced,
    var,
)
from potto.diagnostics import PottoError
from potto.integrate.fixed.moving_sums import MovingTotals
from potto.integrate.fixed.proved_sums.a_priori import proved_gradient, proved_sum, settled
from potto.integrate.fixed.proved_sums.settled import SettledRegion
from potto.integrate.fixed.steps.step_sums import SteppedCall
from potto.integrate.fixed.straight import StraightIntegral
from potto.kernels.cells import Cell, Env, Value, batch_shape, map_arrays, pad
from potto.kernels.making import making
from potto.kernels.tape import Node
from potto.runtime.answers.allowances import Allowance, allowance_of_one
from potto.runtime.evaluation.derivatives.duals import merge, split
from potto.runtime.evaluation.functions import Closure
from potto.runtime.evaluation.linker import Linker
from potto.runtime.evaluation.local import locally, taped
from potto.runtime.evaluation.machine import Machine
from potto.runtime.integration.driver import integrate
from potto.runtime.integration.methods.choices import many, preferred, to_be_seen
from potto.runtime.integration.preparation.arrays import met
from potto.runtime.integration.preparation.found_once import finds_once
from potto.runtime.integration.preparation.prepared import filled, placed, prepared
from potto.runtime.integration.preparation.unions import in_parts
from potto.runtime.integration.problem import MOST_LOOKED_AT, Mixed, Problem, linked
from potto.runtime.integration.settled_calls import Batches, SettledCall, SweptCall, unused
from potto.runtime.integration.solving import solve

DEEPEST = 20  # definitions that a call may lead through
MOST_FUNCTIONS = 256  # that a call is given one after the other
# Summands up to which one after the other costs less than all of one integral as a batch: of triangles under pixels 8
# take 3.1 ms and 4.2, 12 take 5.3 and 3.8.
MOST_ALONE = 10
# The same of summands that are alike but for numbers in them: of integrals in one variable, each between cuts that are
# known, 24 take 0.6 ms and 2.2, 80 take 2.3 and 2.2; where they are made, 3 ms each and 10 for all.
MOST_WRITTEN_OUT = 64


class Direct(Struct, frozen=True):
    """An integral, and what its parameters are: the names of arguments, or numbers. dual: arguments are duals.

    rules: by the functions that it is given, and whether it is differentiated; None where there is no such rule.
    """

    term: Integral
    places: tuple[tuple[str, str | Cell], ...]
    dual: bool
    rules: dict[tuple[tuple[Lam, ...], bool], StraightIntegral | None] = {}
    fresh: ClassVar[bool] = True  # an integral's arrays are made for it

    def value(self, machine: Machine, env: Mapping[str, Value]) -> Value | None:
        """The value of the call; None where only the general way has it."""
        working = self._working(machine)
        here, rule = self._prepared(machine, working, env)
        if rule is None:
            return None
        if machine.taping:
            return self._on_the_tape(machine, rule, here)
        if _batched(here):
            value = integrate(machine.with_directions(working.directions), self.term, here)
            return split(value) if self.dual else value
        cell = self._settled(machine, proved_sum(rule, working, here))
        return split(cell) if self.dual and cell is not None else cell

    def _on_the_tape(self, machine: Machine, rule: StraightIntegral, env: dict[str, Value]) -> Value | None:
        """The value as a node of the tape; None for a batch."""
        if any(isinstance(value, Cell) and isinstance(value.v, np.ndarray) for value in env.values()):
            return None
        cells = {name: value for name, value in env.items() if isinstance(value, Cell)}
        nodes: dict[str, Any] = {name: t for name, cell in cells.items() for t in cell.t if isinstance(t, Node)}
        still = {name: Cell(cell.v, cell.e) for name, cell in cells.items()}
        found = self._settled(machine, proved_gradient(rule, machine.with_directions(0).inside(), still, tuple(nodes)))
        if found is not None:
            return taped(found, tuple(nodes.values()))

        def run(own: Machine, here: Env) -> Value:
            value = self._settled(own, proved_sum(rule, own.inside(), here))
            if value is None:
                raise _Passed
            return value

        try:
            return locally(machine, env, run)
        except _Passed:
            return None

    def _settled(self, machine: Machine, found: MovingTotals | None) -> Cell | None:
        """The number that was found, with what it leaves in the record."""
        if found is None:
            return None
        record = machine.record
        record.integrals += 1
        record.methods.add("quadrature")
        rates = max(*found.gross[1:], *map(abs, found.number[1:]), 0.0, 0.0)
        most = allowance_of_one(self.term, found.gross[0], rates, machine.rtol)
        finite = all(map(math.isfinite, found.number))
        record.allowed = record.allowed.and_of(Allowance(most, max(found.error) <= most, finite))
        return Cell(found.number[0], found.error[0], tuple(found.number[1:]), tuple(found.error[1:]))

    def _working(self, machine: Machine) -> Machine:
        """The machine for the integrand."""
        return (machine.with_directions(1) if self.dual or machine.taping else machine).inside()

    def settled(self, machine: Machine, env: Mapping[str, Value]) -> SettledCall | None:
        """What is known of the call for all numbers near these, if it is the same for all of them."""
        working = self._working(machine)
        here, rule = self._prepared(machine, working, env)
        if rule is None:
            return None
        found: SettledRegion | SteppedCall | SweptCall | None
        found = self._swept(machine, rule, env) if machine.taping else settled(rule, working, here)
        if found is None:
            return None
        fixed = {name: pad(place, working.directions) for name, place in self.places if isinstance(place, Cell)}
        given = tuple((name, place) for name, place in self.places if isinstance(place, str))
        return SettledCall(found, fixed, given)

    def _swept(self, machine: Machine, rule: StraightIntegral, env: Mapping[str, Value]) -> SweptCall | None:
        """The call with its derivatives by the arguments that are on a tape, in its order, if each is one parameter."""
        parts: dict[str, Any] = {place: cell.t[0] for place, cell in env.items() if isinstance(cell, Cell) and cell.t}
        moving = [place for place, node in parts.items() if isinstance(node, Node)]
        order = sorted(moving, key=lambda place: parts[place].number)
        given: dict[str, list[str]] = {}
        for name, place in self.places:
            if isinstance(place, str):
                given.setdefault(place, []).append(name)
        if rule.steps is None or any(len(given.get(place, ())) != 1 for place in order):
            return None
        return SweptCall(rule, machine.with_directions(0).inside(), tuple(given[place][0] for place in order))

    def batches(self, machine: Machine, env: Mapping[str, Value]) -> Batches | None:
        """The call for batches of any size, if it is one of plain numbers."""
        rule = None if self.dual else self._prepared(machine, machine.inside(), env)[1]
        if rule is None:
            return None
        fixed = {name: pad(place, machine.directions) for name, place in self.places if isinstance(place, Cell)}
        given = tuple((name, place) for name, place in self.places if isinstance(place, str))
        return Batches(self.term, machine, fixed, given)

    def _prepared(
        self, machine: Machine, working: Machine, env: Mapping[str, Value]
    ) -> tuple[dict[str, Value], StraightIntegral | None]:
        """The parameters of the integral, and its rule; None where there is no such rule."""
        if machine.settings.sampled or (self.dual and machine.directions):
            return {}, None
        here, functions = self._given(env)
        if here is None:
            return {}, None
        key = functions, working.directions > 0
        if key not in self.rules:
            if len(self.rules) >= MOST_FUNCTIONS:
                self.rules.clear()
            with making:
                try:
                    self.rules[key] = self._rule(working, {n: _off_the_tape(v) for n, v in here.items()})
                except _Passed:
                    return here, None
        return here, self.rules[key]

    def _given(self, env: Mapping[str, Value]) -> tuple[dict[str, Value] | None, tuple[Lam, ...]]:
        """The parameters of the integral, and the functions among them; None where these are not plain."""
        here: dict[str, Value] = {}
        functions: tuple[Lam, ...] = ()
        for name, place in self.places:
            value = env[place] if isinstance(place, str) else place
            value = merge(value) if self.dual else value
            if type(value) is Closure and not value.captured:
                functions += (value.lam,)
            elif not isinstance(value, Cell) or value.e is not None:
                return None, ()
            here[name] = value
        return here, functions

    def _rule(self, machine: Machine, env: dict[str, Value]) -> StraightIntegral | None:
        """The rule that the general way would come to for all numbers, if it is proved. Raises _Passed where at these
        ones it need not be made: of many members nobody asks that, and the general way makes it for them as well."""
        reach, members = machine.linker.reach, _members(env)
        if members <= MOST_LOOKED_AT:
            env, members = {n: map_arrays(v, lambda a: float(a.flat[0])) for n, v in env.items()}, 1
        try:
            term, full = filled(self.term, env, reach)
            if full is not env or met(term, env, reach) or finds_once(machine, term, env):
                return None
            again = machine.directions > 0
            if placed(term, again, reach) is not term or prepared(term, reach) is not term:
                return None
            if in_parts(machine, term, env) is not term:
                raise _Passed
            problem = Problem(machine.apart(), term, *linked(env), solve, members, True)
            if many(problem):
                return None
            # between planes the rule is by far the shortest way
            if (problem.on_known_sides() and not problem.flat) or to_be_seen(problem) is not None:
                raise _Passed
            plan = problem.plan(next(iter(preferred(problem))))
        except (PottoError, Mixed, TooDeep, RecursionError):
            return None
        return None if plan.decisions or plan.premise is not None else plan.straight


def _off_the_tape(value: Value) -> Value:
    """A number that moves, with some tangent in the place of a node."""
    if not isinstance(value, Cell) or not value.t or not isinstance(value.t[0], Node):
        return value
    return Cell(value.v, value.e, (1.0,))


def _batched(env: Mapping[str, Value]) -> bool:
    """Whether some of the parameters are arrays."""
    return any(type(value) is Cell and value.arrays() for value in env.values())


def _members(env: Mapping[str, Value]) -> int:
    """How many members a batch has with these parameters."""
    return math.prod(batch_shape(env.values()))


class _Passed(Exception):
    """Some surfaces pass by all that is integrated over."""


class SettledAround(Struct, frozen=True):
    """The same of what is computed with such integrals."""

    around: Around
    machine: Machine
    integrals: tuple[SettledCall, ...]

    def at(self, env: Mapping[str, Cell]) -> MovingTotals | None:
        """As of `SettledCall`; None also where arithmetic meets something that is to be told."""
        found: list[Value] = []
        nodes = 0
        for integral in self.integrals:
            totals = integral.at(env)
            if totals is None:
                return None
            nodes += totals.nodes
            (value, *tangents), (bound, *bounds) = totals.number, totals.error
            found.append(Cell(value, bound, tuple(tangents), tuple(bounds)))
        machine = unused(self.machine)
        with np.errstate(all="ignore"):
            cell = self.around.put_together(machine, env, found)
        if machine.events or machine.record.edges or machine.record.shortfalls or not isinstance(cell, Cell):
            return None
        number: list[Any] = [cell.v, *cell.t]
        error: list[Any] = [cell.e, *cell.et]
        if None in number or None in error:  # what does not move, or has no error
            return None
        return MovingTotals([float(x) for x in number], [float(e) for e in error], [], nodes)


class Around(Struct, frozen=True):
    """Arithmetic with integrals, as a function of them and of parameters, whose places are as in `Direct`."""

    function: Lam
    places: tuple[tuple[str, str | Cell], ...]
    integrals: tuple[Direct, ...]
    fresh: ClassVar[bool] = False

    def value(self, machine: Machine, env: Mapping[str, Value]) -> Value | None:
        """As of `Direct`."""
        found: list[Value] = []
        for integral in self.integrals:
            value = integral.value(machine, env)
            if value is None:
                return None
            found.append(value)
        return self.put_together(machine, env, found)

    def put_together(self, machine: Machine, env: Mapping[str, Value], found: Sequence[Value]) -> Value:
        """The value where the integrals have these."""
        k = machine.directions
        own = [env[place] if isinstance(place, str) else pad(place, k) for _, place in self.places]
        return machine.run(self.function, [*own, *found], None)

    def settled(self, machine: Machine, env: Mapping[str, Value]) -> SettledAround | None:
        """As of `Direct`."""
        found = [integral.settled(machine, env) for integral in self.integrals]
        parts = tuple(part for part in found if part is not None)
        return SettledAround(self, machine, parts) if len(parts) == len(found) else None


def direct(term: Term, linker: Linker) -> Direct | Around | None:
    """The integral that a term with free variables is, through the calls around it, or what is computed of some."""
    places: dict[str, str | Cell] = {name: name for name in term.free}
    dual = False
    for _ in range(DEEPEST):
        if isinstance(term, Integral):
            return Direct(term, tuple((name, places[name]) for name in sorted(term.free)), dual)
        if not isinstance(term, App):
            return None if dual else _around(term, places, linker)
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


def _many_alike(parts: Sequence[Term], integrals: Mapping[Term, Integral]) -> bool:
    """Whether so many summands are made of one integral, or are alike, that they are better evaluated together."""
    for part in parts:
        if isinstance(part, Prim) and part.op == "add" and len(part.args) > MOST_ALONE:
            each = ({integrals[node] for node in postorder(arg) if node in integrals} for arg in part.args)
            if max(Counter(term for own in each for term in own).values(), default=0) > MOST_ALONE:
                return True
            numbers = dict.fromkeys(part.free)
            if len(part.args) > MOST_WRITTEN_OUT and most_alike(part.args, numbers) > MOST_WRITTEN_OUT:
                return True
    return False


def _around(term: Term, places: Mapping[str, str | Cell], linker: Linker) -> Around | None:
    """A term that computes with integrals, and with nothing else that has to be found out."""
    parts = postorder(term, below=lambda node: () if isinstance(node, Integral | App) else children(node))
    if not all(isinstance(part, Integral | App | Prim | Var | Const) for part in parts):
        return None
    integrals: dict[Term, Direct] = {}
    for part in parts:
        if isinstance(part, Integral | App):
            found = direct(part, linker)
            if not isinstance(found, Direct) or found.dual:
                return None
            given = tuple((name, places[at] if isinstance(at, str) else at) for name, at in found.places)
            integrals[part] = Direct(found.term, given, False)
    if not integrals or _many_alike(parts, {part: integral.term for part, integral in integrals.items()}):
        return None
    names = [f"integral'{number}" for number in range(1, len(integrals) + 1)]
    outer = replaced(term, dict(zip(integrals, map(var, names), strict=True)))
    own = tuple(sorted(outer.free.difference(names)))
    return Around(lam((*own, *names), outer), tuple((name, places[name]) for name in own), tuple(integrals.values()))
