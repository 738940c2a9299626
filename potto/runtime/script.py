"""Scripts: the top-level statements of a file, run in order.

Owns `Script`. What a statement prints comes out one by one as `Shown`; what is wrong, as a diagnostic with its place:
an error ends the run, a warning does not. Names of loops and of local assignments are values in an environment.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct
from msgspec.structs import replace

from potto.checking.spoiled import statement_errors
from potto.diagnostics import Diagnostic, PottoError
from potto.elaborate import elaborate_expression
from potto.kernels.cells import Env, Rows, Value
from potto.kernels.errors import wrong_call
from potto.modules import statements
from potto.modules.misread import moved
from potto.projects.settings import Settings
from potto.query import Database
from potto.reports.render import Located, ProgramError
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.records import named, named_answer
from potto.runtime.answers.remarks import remarks
from potto.runtime.answers.shown import as_dual, format_answer, format_value, gives_dual
from potto.runtime.evaluate import Clock, Program, report
from potto.runtime.evaluation.functions import Closure
from potto.runtime.evaluation.machine import Machine
from potto.source import Span
from potto.syntax import nodes
from potto.types import infer_expression
from potto.types.types import ArrayOf, TupleOf, Type, Unknown

Types = tuple[tuple[str, Type], ...]  # of the names of an environment


class Shown(Struct, frozen=True):
    """What one statement printed: its text, and the numbers behind it. A single value without functions is kept."""

    span: Span
    text: str
    estimates: tuple[Estimate, ...]
    value: Value | None = None


class Script:
    """One run of a file's statements."""

    def __init__(self, db: Database, file: str, program: Program, settings: Settings) -> None:
        self.db = db
        self.file = file
        self.program = program
        self.settings = settings
        self.start = 0
        self.locals: dict[str, Type] = {}

    def run(self) -> Iterator[Shown | Located]:
        """Run all statements but those that an error in the program spoils, which gives that error. One of evaluation
        ends the run: it is the last thing that comes out."""
        for reference in statements(self.db, self.file):
            self.start = reference.start
            wrong = statement_errors(self.db, self.file, reference)
            if wrong:
                yield from wrong
                continue
            self.locals = {}
            try:
                yield from self.statement(reference.statement, {})
            except _Failed as failure:
                yield failure.located
                return

    def statement(self, statement: nodes.Statement, env: Env) -> Iterator[Shown | Located]:
        match statement:
            case nodes.Print(arguments=arguments, span=span):
                yield from self.show(span, arguments, env)
            case nodes.ExpressionStatement(value=value, span=span):
                yield from self.show(span, (value,), env)
            case nodes.For(variable=variable, iterable=iterable, body=body):
                self.locals[variable.name] = _item(self.type(iterable))
                for item in self.items(iterable, env):
                    inner = {**env, variable.name: item}
                    for inside in body:
                        yield from self.statement(inside, inner)
            case nodes.Binding():
                self.bind(statement, env)

    def show(self, span: Span, arguments: tuple[nodes.Expr, ...], env: Env) -> Iterator[Shown | Located]:
        texts: list[str] = []
        estimates: list[Estimate] = []
        kept: Value | None = None
        for argument in arguments:
            value, estimate = self.value(argument, env)
            type = self.type(argument)
            estimate = None if estimate is None else named_answer(estimate, type)
            texts.append(format_value(named(value, type)) if estimate is None else format_answer(estimate))
            if estimate is not None:
                estimates.append(estimate)
                kept = value if len(arguments) == 1 and not _has_functions(value) else None
                place = argument.span.shift(self.start)
                yield from (Located(self.file, d) for d in remarks(estimate, place))
        yield Shown(span.shift(self.start), " ".join(texts), tuple(estimates), kept)

    def items(self, iterable: nodes.Expr, env: Env) -> list[Value]:
        value, _ = self.value(iterable, env)
        if isinstance(value, Rows):
            return value.rows()
        if isinstance(value, list):
            return value
        raise self.failed(wrong_call("a loop goes over an array"), iterable.span)

    def bind(self, binding: nodes.Binding, env: Env) -> None:
        value, _ = self.value(binding.value, env)
        targets = binding.targets
        types = _parts(self.type(binding.value), len(targets))
        self.locals |= {target.name: type for target, type in zip(targets, types, strict=True)}
        if len(targets) == 1:
            env[targets[0].name] = value
            return
        parts = value if isinstance(value, tuple | list) else ()
        if len(parts) != len(targets):
            complaint = wrong_call(f"{len(targets)} names are given to a value of {len(parts) or 1}")
            raise self.failed(complaint, binding.span)
        env.update({target.name: part for target, part in zip(targets, parts, strict=True)})

    def value(self, expr: nodes.Expr, env: Env) -> tuple[Value, Estimate | None]:
        """The value of an expression, with what it cost; None for what is not a number."""
        machine = self.program.machine(self.settings)
        place = expr.span
        try:
            with Clock() as clock:
                value, dual = evaluate_in(self.db, self.file, expr, env, self.program, machine, self.known)
            if isinstance(value, Closure):
                return value, None
            estimate = report(value, machine, clock)
            return value, as_dual(estimate) if dual else estimate
        except PottoError as error:
            raise self.failed(error, place) from None

    def type(self, expr: nodes.Expr) -> Type:
        """The type of an expression where loops and assignments have come to."""
        return infer_expression(self.db, self.file, expr, self.known).type

    @property
    def known(self) -> Types:
        """The types of what loops and assignments have named."""
        return tuple(self.locals.items())

    def failed(self, error: PottoError, place: Span) -> _Failed:
        """An error of evaluation, at the place of what was evaluated."""
        if isinstance(error, ProgramError):  # about a definition, and knows where that is
            return _Failed(error.located[0])
        return _Failed(Located(self.file, placed(error.diagnostics[0], place.shift(self.start), self.start)))


def evaluate_in(
    db: Database, file: str, expr: nodes.Expr, env: Env, program: Program, machine: Machine, types: Types
) -> tuple[Value, bool]:
    """The value of an expression that may use the file's names and those of an environment, which are of `types`, and
    whether it is that of a derivative. Raises PottoError."""
    term = elaborate_expression(db, file, expr, tuple(env), types).term
    value = program.value(machine, term, {n: v for n, v in env.items() if n in term.free})
    return value, gives_dual(term, program.linker, env)


def placed(diagnostic: Diagnostic, place: Span, start: int) -> Diagnostic:
    """A diagnostic of an evaluation with a place: its own, or that of the expression that was evaluated."""
    if len(diagnostic.span):
        return moved(diagnostic, start)
    return replace(diagnostic, span=place)


def _has_functions(value: Value) -> bool:
    if isinstance(value, tuple | list):
        return any(map(_has_functions, value))
    return isinstance(value, Closure)


def _item(type: Type) -> Type:
    """The type of what an array has."""
    return type.item if isinstance(type, ArrayOf) else Unknown()


def _parts(type: Type, count: int) -> tuple[Type, ...]:
    """The types of what so many names are given."""
    if count == 1:
        return (type,)
    return type.items if isinstance(type, TupleOf) and len(type.items) == count else (Unknown(),) * count


class _Failed(Exception):
    """Ends a run: carries the diagnostic that says why."""

    def __init__(self, located: Located) -> None:
        self.located = located
