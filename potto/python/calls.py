"""Calls of functions of Potto from Python: elaborated once per form, then run on values.

Owns `Call` and `Gradient`. A form says how many arguments each group was given by place and which by name; the names of
parameters are resolved by elaboration, as in a program. Conversion of Python values is left to `arguments`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from msgspec import Struct
from msgspec.structs import asdict

from potto.core.terms import Lam, Term
from potto.elaborate import elaborate_expression
from potto.evaluating.world import World
from potto.kernels.cells import Cell, Value, pad
from potto.kernels.errors import wrong_call
from potto.projects.settings import current
from potto.python.arguments import Batch
from potto.reports.render import Located, ProgramError
from potto.runtime.answers.convergence import Shortfalls, converged_members, merged
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.shown import as_dual, gives_dual
from potto.runtime.evaluate import Clock, report
from potto.runtime.evaluation.functions import Closure
from potto.runtime.evaluation.machine import Machine
from potto.source import Span
from potto.syntax import nodes
from potto.types import infer_expression

NOWHERE = Span(0, 0)
Form = tuple[tuple[int, tuple[str, ...]], ...]


class Call(Struct, frozen=True, eq=False):
    """An expression with the file whose names it uses, and the form in which it is called."""

    world: World
    file: str
    expr: nodes.Expr
    form: Form
    _known: dict[int, Term] = {}

    def run(self, values: Sequence[Value], batch: Batch) -> Estimate:
        """The estimate of the call for these arguments. Raises PottoError."""
        machine = self.world.program.machine(current(self.world.settings(self.file)))
        with Clock() as clock:
            value = self.value(values, machine)
        estimate = report(value, machine, clock)
        term = self.elaborated
        body = term.body if values and isinstance(term, Lam) else term
        return batch.shaped(as_dual(estimate) if gives_dual(body, self.world.program.linker) else estimate)

    def value(self, values: Sequence[Value], machine: Machine | None = None) -> Value:
        """The value of the call for these arguments. Raises PottoError."""
        program = self.world.program
        term = self.elaborated
        if machine is None:
            machine = program.machine(current(self.world.settings(self.file)))
        if not values:
            return program.value(machine, term)
        assert isinstance(term, Lam) and len(term.params) == len(values)
        return program.value(machine, term.body, dict(zip(term.params, values, strict=True)))

    @property
    def elaborated(self) -> Term:
        """The call as a function of its arguments; once for the present texts."""
        revision = self.world.db.revision
        term = self._known.get(revision)
        if term is None:
            term = self.world.remember((self.file, self.expr, self.form), self._elaborate)
            self._known.clear()
            self._known[revision] = term
        return term

    def _elaborate(self) -> Term:
        whole = applied(self.expr, self.form)
        self.world.need(self.file, whole)
        inferred = infer_expression(self.world.db, self.file, whole)
        wrong = [d for d in inferred.diagnostics if d.severity == "error"]
        if wrong:
            raise ProgramError([Located(None, d) for d in wrong], self.world.source)
        return elaborate_expression(self.world.db, self.file, whole).term


def applied(expr: nodes.Expr, form: Form) -> nodes.Expr:
    """The call as a lambda over all its arguments. Its names cannot be written in a program."""
    names = [f"argument'{place + 1}" for place in range(sum(count + len(keywords) for count, keywords in form))]
    if not names:
        return expr
    rest, body = iter(names), expr
    for count, keywords in form:
        given = [nodes.Argument(NOWHERE, None, None, nodes.Name(NOWHERE, next(rest))) for _ in range(count)]
        given += [nodes.Argument(NOWHERE, word, NOWHERE, nodes.Name(NOWHERE, next(rest))) for word in keywords]
        body = nodes.Apply(NOWHERE, body, tuple(given), True)
    parameters = tuple(nodes.Parameter(NOWHERE, name) for name in names)
    return nodes.Lambda(NOWHERE, (parameters,), body)


# Gradients


class Gradient(Estimate, frozen=True):
    """An estimate with derivatives by several parameters: `gradient["c"]`, or `tangent` for all of them."""

    wrt: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Any:
        if name not in self.wrt:
            raise KeyError(name)
        return self.tangent if len(self.wrt) == 1 else self.tangent[self.wrt.index(name)]


def gradient(call: Call, arguments: Sequence[tuple[str, Value]], wrt: tuple[str, ...], batch: Batch) -> Gradient:
    """The estimate of a call with its derivatives by the arguments named in `wrt`, all in one run."""
    given = dict(arguments)
    for name in wrt:
        if name not in given:
            raise wrong_call(f"`{name}` is given no value, so there is nothing to differentiate by")
    directions = sum(_size(name, given[name]) for name in wrt)
    machine = call.world.program.machine(current(call.world.settings(call.file))).with_directions(directions)
    numbers = iter(range(directions))
    seeded = {name: _seeded(given[name], numbers, directions) for name in wrt}
    values = [seeded[name] if name in seeded else pad(value, directions) for name, value in arguments]
    with Clock() as clock:
        value = call.value(values, machine)
    if not isinstance(value, Cell | tuple) or isinstance(value, Closure):
        raise wrong_call("only a number or a tuple of numbers has a gradient")
    parts = [report(_pick(value, direction), machine, clock) for direction in range(directions)]
    return _gathered([batch.shaped(part) for part in parts], wrt, given)


def _size(name: str, value: Value) -> int:
    """How many numbers a parameter has."""
    if isinstance(value, Cell):
        return 1
    if isinstance(value, tuple):
        return sum(_size(name, item) for item in value)
    raise wrong_call(f"`{name}` is not a number, so there is no derivative by it")


def _seeded(value: Value, numbers: Any, directions: int) -> Value:
    """The parameter, each of its numbers moving in a direction of its own."""
    if isinstance(value, tuple):
        return tuple(_seeded(item, numbers, directions) for item in value)
    assert isinstance(value, Cell)
    own = next(numbers)
    return Cell(value.v, value.e, (None,) * own + (1.0,) + (None,) * (directions - own - 1))


def _pick(value: Value, direction: int) -> Value:
    """The value with the tangent of one direction."""
    if isinstance(value, tuple):
        return tuple(_pick(item, direction) for item in value)
    assert isinstance(value, Cell)
    tangent = value.t[direction] if value.t else None
    bound = value.et[direction] if value.et else None
    return Cell(value.v, value.e, (tangent,), (bound,))


def _gathered(parts: list[Estimate], wrt: tuple[str, ...], given: dict[str, Value]) -> Gradient:
    tangents = _by_name([part.tangent for part in parts], wrt, given)
    bounds = _by_name([part.tangent_error for part in parts], wrt, given)
    first = parts[0]
    common = asdict(first)
    common["tangent"] = tangents[0] if len(wrt) == 1 else tangents
    common["tangent_error"] = bounds[0] if len(wrt) == 1 else bounds
    missing: Shortfalls = {}
    for part in parts:
        merged(missing, part.shortfalls)
    common["shortfalls"], common["converged"] = missing, all(part.converged for part in parts)
    if first.member_converged is not None:
        common["member_converged"] = converged_members(missing, first.member_converged.shape)
    return Gradient(**common, wrt=wrt)


def _by_name(numbers: list[Any], wrt: tuple[str, ...], given: dict[str, Value]) -> tuple[Any, ...]:
    """The derivatives in the form of the parameters that they belong to."""
    rest = iter(numbers)

    def form(value: Value) -> Any:
        return tuple(form(item) for item in value) if isinstance(value, tuple) else next(rest)

    return tuple(form(given[name]) for name in wrt)
