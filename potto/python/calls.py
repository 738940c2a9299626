"""Calls of functions of Potto from Python: elaborated once per form, then run on values.

Owns `Call`. A form says how many arguments each group was given by place and which by name; the names of
parameters are resolved by elaboration, as in a program. Conversion of Python values is left to `arguments`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from msgspec import Struct

from potto.core.terms import Lam, Term
from potto.elaborate import elaborate_expression
from potto.evaluating.world import World
from potto.kernels.cells import Value
from potto.projects.settings import current
from potto.python.arguments import LEAST, Batch
from potto.python.at_once import AtOnce, Together, at_once, together
from potto.python.following import followed
from potto.reports.render import Located, ProgramError
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.records import named_answer
from potto.runtime.answers.shown import as_dual, gives_dual
from potto.runtime.evaluate import Clock, report
from potto.runtime.evaluation.machine import Machine
from potto.source import NOWHERE
from potto.syntax import nodes
from potto.types import infer_expression
from potto.types.types import Function as FunctionType
from potto.types.types import Type

BATCHES = "batches"
Form = tuple[tuple[int, tuple[str, ...]], ...]


class Call(Struct, frozen=True, eq=False):
    """An expression with the file whose names it uses, and the form in which it is called."""

    world: World
    file: str
    expr: nodes.Expr
    form: Form
    _known: dict[int, Term] = {}
    _dual: dict[int, bool] = {}
    _result: dict[int, Type] = {}

    def run(self, values: Sequence[Value], batch: Batch) -> Estimate:
        """The estimate of the call for these arguments. Raises PottoError."""
        machine = self.world.program.machine(current(self.world.settings(self.file)))
        with followed(), Clock() as clock:
            value = self.value(values, machine)
        estimate = report(value, machine, clock)
        whole = as_dual(estimate) if self._gives_dual() else estimate
        found = named_answer(batch.shaped(whole, own=machine.record.fresh), self.result)
        if 1 < batch.size < LEAST:
            self.keep((), values, found, machine=machine)
        return found

    def at_once(self, args: tuple[Any, ...], wrt: tuple[str, ...] = ()) -> Estimate | None:
        """The estimate for plain numbers near those of before, or for a batch, with its derivatives by the parameters
        named; None where it takes more than the rule of one integral."""
        memory = self.world.memory
        known: AtOnce | None = memory.get((self, wrt))
        found = None if known is None else known.answer(args, current(self.world.settings(self.file)))
        many: Together | None = memory.get((self, wrt, BATCHES)) if found is None else None
        return found if many is None else many.answer(args, current(self.world.settings(self.file)))

    def keep(
        self, args: Sequence[Any], values: Sequence[Value], found: Estimate, wrt: tuple[str, ...] = (),
        machine: Machine | None = None,
    ) -> None:  # fmt: skip
        """Keep what answers such calls at once, if anything does. args: as they were given. machine: for tangents, and
        for a batch that which answered."""
        term, program, size = self.elaborated, self.world.program, getattr(found.value, "size", 1)
        if values and size and isinstance(term, Lam):  # an empty batch has nothing to go by
            machine = machine or program.machine(current(self.world.settings(self.file)))
            known = at_once(program, term, tuple(args), values, machine, found, wrt) if size == 1 else None
            if known is not None:
                self.world.memory[self, wrt] = known
                return
            many = together(program, term, values, machine, found, wrt)
            if many is not None:
                self.world.memory[self, wrt, BATCHES] = many

    def _gives_dual(self) -> bool:
        """Whether the answer is a dual; found out once for the present texts."""
        revision = self.world.db.revision
        if revision not in self._dual:
            term = self.elaborated
            body = term.body if self._given and isinstance(term, Lam) else term
            self._dual.clear()
            self._dual[revision] = gives_dual(body, self.world.program.linker)
        return self._dual[revision]

    @property
    def result(self) -> Type:
        """The type of the answer; found out once for the present texts."""
        revision = self.world.db.revision
        if revision not in self._result:
            whole = infer_expression(self.world.db, self.file, applied(self.expr, self.form)).type
            self._result.clear()
            self._result[revision] = whole.result if isinstance(whole, FunctionType) and self._given else whole
        return self._result[revision]

    @property
    def _given(self) -> int:
        """How many arguments the call has."""
        return sum(count + len(words) for count, words in self.form)

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
