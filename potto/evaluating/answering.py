"""The value of an expression, from the terms that its check has led to.

Owns `Answer`, and `Checked`, which holds those terms: where a text was evaluated before, it is all that is needed, and
neither syntax nor types are loaded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from msgspec import Struct

from potto.core.terms import Proj, Term, postorder
from potto.projects.settings import Settings
from potto.reports.render import Located
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.remarks import remarks
from potto.runtime.answers.shown import as_dual, gives_dual
from potto.runtime.evaluate import Program
from potto.source import SourceText, Span

EXPRESSION = "<expression>"
Definitions = Mapping[tuple[str, str], Term]
WithFields = Callable[[Term, Definitions], Term]


class Answer(Struct, frozen=True):
    """What an expression evaluates to, its type, and what a reader should know about the number."""

    estimate: Estimate
    type: str
    remarks: tuple[Located, ...] = ()


class Checked(Struct, frozen=True):
    """An expression without errors: its term, the definitions that this leads to, its type as text, and how many
    characters it has. Records, whose parts have names, and what was said about the text, are not in it."""

    term: Term
    definitions: Definitions
    type: str
    length: int

    def evaluate(self, settings: Settings, with_fields: WithFields) -> Answer:
        """Its value. with_fields: gives a term the names of the program's records, for people; asked where there are
        any. Raises PottoError."""

        def named(term: Term, definitions: Definitions) -> Term:
            has_parts = any(isinstance(node, Proj) for node in postorder(term))
            return with_fields(term, definitions) if has_parts else term

        program = Program(lambda file, name: self.definitions[file, name], named=named)
        estimate = estimate_of(program, self.term, settings)
        return Answer(estimate, self.type, remarked(estimate, self.length))


def estimate_of(program: Program, term: Term, settings: Settings) -> Estimate:
    """The estimate of a term, with the tangent in its place where it is a derivative's. Raises PottoError."""
    estimate = program.evaluate(term, settings)
    return as_dual(estimate) if gives_dual(term, program.linker) else estimate


def remarked(estimate: Estimate, length: int) -> tuple[Located, ...]:
    """What a reader should know about the value of an expression of so many characters."""
    return tuple(Located(EXPRESSION, said) for said in remarks(estimate, Span(0, length)))


def only(expression: str) -> Callable[[str], SourceText | None]:
    """The text of an expression, as the source of what is said about it alone."""
    return lambda file: SourceText(EXPRESSION, expression) if file == EXPRESSION else None
