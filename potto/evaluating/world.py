"""A world of programs: one database, the files that it reads, and what evaluates them.

Owns `World`, which the command line and the Python interface share. Everything may be called from several threads: the
database lets one thread in at a time, and each thread evaluates with a `Program` of its own.
"""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.explanation.fields import named_fields, parameter_types
from potto.checking.check import absolute, definition_diagnostics, has_errors
from potto.checking.library import Library
from potto.core.terms import Global, Proj, Term, postorder, reached
from potto.diagnostics import Diagnostic, PottoError, Related
from potto.elaborate import core, elaborate_expression
from potto.evaluating.answering import EXPRESSION, Answer, Checked, estimate_of, remarked
from potto.kernels.cells import Value
from potto.modules import chunk_start, find_module, names, resolve_module
from potto.projects.settings import Settings, current
from potto.reports.render import Located, ProgramError
from potto.runtime.answers.records import has_records, named_answer
from potto.runtime.evaluate import Program
from potto.runtime.script import Script, Shown, placed
from potto.source import SourceText, Span
from potto.syntax import parse_expression
from potto.syntax.nodes import Expr, Member
from potto.types import format_type, infer_expression, interface
from potto.types.kinds import NO_TANGENT
from potto.types.types import Type

T = TypeVar("T")
# Texts that were never on disk are found by functions of other worlds as well, under keys that are given once.
_owners: weakref.WeakValueDictionary[str, World] = weakref.WeakValueDictionary()


class World(Library):
    """Programs from disk and from memory, checked and evaluated."""

    def __init__(self, roots: Sequence[str | os.PathLike[str]] = ()) -> None:
        super().__init__(roots)
        self._start()

    def _start(self) -> None:
        self._first = self
        self._local = threading.local()
        self._held: dict[tuple[str, str], Value] = {}

    def again(self) -> World:
        """A world of the same texts, in which nothing was evaluated yet. By their keys this one goes on to own them."""
        other = World.__new__(World)
        other.db, other.files, other.projects = self.db, self.files, self.projects
        other._start()
        other._first = self
        return other

    # Evaluating

    @property
    def program(self) -> Program:
        """What evaluates in this thread, for the present texts of all files."""
        self._forget_old()
        program: Program = self._local.program
        return program

    def remember(self, key: Hashable, make: Callable[[], T]) -> T:
        """What `make` gives, once in each thread for the present texts of all files."""
        memory = self.memory
        if key not in memory:
            memory[key] = make()
        found: T = memory[key]
        return found

    @property
    def memory(self) -> dict[Hashable, Any]:
        """What this thread remembers for the present texts of all files."""
        self._forget_old()
        memory: dict[Hashable, Any] = self._local.memory
        return memory

    def _forget_old(self) -> None:
        revision = self.db.revision
        if getattr(self._local, "revision", None) != revision:
            self._local.revision = revision
            self._local.memory = {}
            self._local.program = Program(self.lookup, self._held, self._place, self.with_fields)

    def _place(self, met: Sequence[object], definitions: Mapping[tuple[str, str], Term]) -> Related | None:
        """Where in a definition that which was met first was written: in the one whose function was met as well, or the
        only one that holds it. None where that is not known: what is under an integral has been rewritten."""
        found = []
        for file, name in definitions:
            if self._owns(file):
                place = self._narrowest(core(self.db, file, name).origins, met[0])
                if place is not None:
                    found.append((file, name, place))
        inner = [each for each in found if definitions[each[:2]] in met]
        if len(chosen := inner[:1] or found) != 1:
            return None
        file, name, span = chosen[0]
        return Related(span.shift(chunk_start(self.db, file, name)), f"in `{name}`", file, "")

    def _narrowest(self, origins: Iterable[tuple[Term, Span]], met: object) -> Span | None:
        """The narrowest place of a text whose term, as it is evaluated, holds what was met."""
        ready = self.program.linker.ready
        return min((span for term, span in origins if met in postorder(ready(term))), key=len, default=None)

    def with_fields(self, term: Term, definitions: Mapping[tuple[str, str], Term]) -> Term:
        """A term that evaluation met with the fields of records as names: as the definition knows them that holds it,
        or all that have parameters of these names, where they agree."""
        wanted = {name for node in postorder(term) if isinstance(node, Proj) for name in node.free}
        if not any(isinstance(node, Proj) for node in postorder(term)):
            return term  # as most are
        found: dict[tuple[str, str], Term] = {}
        with self.db.evaluating():
            for file, name in definitions:
                known = parameter_types(interface(self.db, file, name).type) if self._owns(file) else {}
                if known.keys() & wanted or not wanted:
                    found[file, name] = named_fields(self.db, term, known)
        inner = {named for key, named in found.items() if term in postorder(definitions[key])}
        each = inner or set(found.values())
        return each.pop() if len(each) == 1 else term

    def hold(self, file: str, name: str, value: Value) -> None:
        """Let a definition have this value, with its error, from now on: its term is not evaluated again."""
        self._held[file, name] = value

    def _owns(self, file: str) -> bool:
        """Whether a file is one of these programs, and no text of a world whose functions came as arguments."""
        return _owners.get(file, self).db is self.db

    def own(self, key: str, text: str) -> str:
        """Give a pseudo file its text, for this world and for those that its functions are given to."""
        _owners[key] = self
        return self.put(key, text)

    def lookup(self, file: str, name: str) -> Term:
        """The term of a definition. Raises ProgramError if it has errors."""
        owner = _owners.get(file, self)
        if owner.db is not self.db:
            return owner.lookup(file, name)
        with self.db.evaluating():
            found = definition_diagnostics(self.db, file, name)
            if has_errors(found):
                start = chunk_start(self.db, file, name)
                wrong = [Located(file, absolute(self.db, file, d, start)) for d in found if d.severity == "error"]
                raise ProgramError(wrong, self.source)
            return core(self.db, file, name).term

    def run(self, file: str, settings: Settings | None = None) -> Iterator[Shown | Located]:
        """Run those statements of a script that no error spoils. The errors come out in their places, those that no
        statement met in the end; one of evaluation ends the run. What is said of derivatives that move nothing comes in
        the end as well: their zeros look like answers."""
        said: set[tuple[str | None, Diagnostic]] = set()
        for event in Script(self.db, file, self.program, settings or current(self.settings(file))).run():
            if isinstance(event, Located):
                said.add(_identity(event))
            yield event
        yield from (located for located in self.errors(file) if _identity(located) not in said)
        yield from (located for located in self.diagnostics(file) if located.diagnostic.code == NO_TANGENT.code)

    def evaluate(self, file: str, text: str, settings: Settings | None = None) -> Answer:
        """The value of an expression with a file's names in scope. Raises ProgramError, also for an error in a
        definition that the expression leads to; others of the file are nothing to it."""
        sources = self.sources(text)
        parsed = parse_expression(text)
        self._stop(parsed.diagnostics, sources)
        self.need(file, parsed.expr)
        inferred = infer_expression(self.db, file, parsed.expr)
        self._stop(inferred.diagnostics, sources)
        elaborated = elaborate_expression(self.db, file, parsed.expr)
        try:
            estimate = estimate_of(self.program, elaborated.term, settings or current(self.settings(file)))
            estimate = named_answer(estimate, inferred.type)
        except ProgramError:
            raise
        except PottoError as error:
            own = self._narrowest(elaborated.origins, error.met[0]) if error.met else None
            place = own or Span(0, len(text))
            raise ProgramError([Located(EXPRESSION, placed(d, place, 0)) for d in error.diagnostics], sources) from None
        warned = [absolute(self.db, EXPRESSION, d, 0) for d in inferred.diagnostics if d.code == NO_TANGENT.code]
        said = (*(Located(EXPRESSION, d) for d in warned), *remarked(estimate, len(text)))
        return Answer(estimate, format_type(inferred.type), said)

    def checked(self, file: str, text: str) -> Checked | None:
        """What an expression that was evaluated, and says nothing wrong, is evaluated from; None where it gives records
        or there is something to say about its text."""
        parsed = parse_expression(text)
        inferred = infer_expression(self.db, file, parsed.expr)
        if parsed.diagnostics or inferred.diagnostics or has_records(inferred.type):
            return None
        term = elaborate_expression(self.db, file, parsed.expr).term
        every = {node for parts in reached(term, resolve=self._resolve) for node in parts if isinstance(node, Global)}
        definitions = {(name.module, name.name): self._resolve(name) for name in every}
        return Checked(term, definitions, format_type(inferred.type), len(text))

    def _resolve(self, name: Global) -> Term:
        return self.lookup(name.module, name.name)

    def typed(self, file: str, text: str) -> tuple[Expr, Type]:
        """The tree of an expression with a file's names in scope, and its type. Raises ProgramError."""
        tree = self.parse(text)
        self.need(file, tree)
        inferred = infer_expression(self.db, file, tree)
        self._stop(inferred.diagnostics, self.sources(text))
        return tree, inferred.type

    def home(self, file: str, text: str) -> tuple[str, str]:
        """In which file's names the text of an argument is read, and what is read there: `m.f` is also a function of a
        module that the file does not import, as it is offered. Raises ProgramError."""
        written = self.parse(text)
        if isinstance(written, Member):
            other = find_module(self.db, file, written.path)
            known = resolve_module(self.db, file, written.path) is not None
            if other is not None and not known and written.name in names(self.db, other):
                return other, written.name
        return file, text

    def parse(self, text: str) -> Expr:
        """The tree of an expression. Raises ProgramError."""
        parsed = parse_expression(text)
        self._stop(parsed.diagnostics, self.sources(text))
        return parsed.expr

    def sources(self, expression: str) -> _Sources:
        """The texts of files, and an expression as a file of its own."""
        return _Sources(self, SourceText(EXPRESSION, expression))

    def _stop(self, found: Iterable[Diagnostic], sources: _Sources) -> None:
        wrong = [Located(EXPRESSION, absolute(self.db, EXPRESSION, d, 0)) for d in found if d.severity == "error"]
        if wrong:
            raise ProgramError(wrong, sources)


def _identity(located: Located) -> tuple[str | None, Diagnostic]:
    """An error without the note on how one came to it."""
    return located.file, replace(located.diagnostic, notes=())


class _Sources(Struct, frozen=True):
    world: World
    expression: SourceText

    def __call__(self, file: str) -> SourceText | None:
        return self.expression if file == EXPRESSION else self.world.source(file)
