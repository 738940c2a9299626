"""How the formulas of a program are written: in its own words, which are those that its author reads.

Owns `Notation`, `notation_of`, `written_notation`, `numbers_in` and `numbers_of`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import isfinite

from msgspec import Struct

from potto.calculus.explanation.decimals import in_decimals, over_whole_numbers
from potto.calculus.explanation.fields import fields_of
from potto.calculus.explanation.products import in_order
from potto.core.numerals import Numbers, simple_fraction
from potto.core.printer import format_equation, format_term
from potto.core.simplify import simplify
from potto.core.terms import Const, Deriv, Global, Term, global_, postorder, transform
from potto.elaborate import core_term
from potto.modules import definition
from potto.query import Database
from potto.syntax import nodes
from potto.syntax.walk import walk
from potto.types import interface

Rewrite = Callable[[Term], Term]


class Notation(Struct, frozen=True):
    """fields: gives the parts of records their names. numbers: how those that are not whole are written."""

    fields: Rewrite = lambda term: term
    numbers: Numbers = Numbers.FRACTIONS

    def text(self, term: Term) -> str:
        """A term whose fields have their names."""
        if self.numbers is not Numbers.FRACTIONS or any(map(_is_only_decimal, postorder(term))):
            return format_term(term, numbers=Numbers.DECIMALS)
        return format_term(over_whole_numbers(term), numbers=self.numbers)

    def equation(self, surface: Term, variables: Iterable[str] = ()) -> str:
        """Where a surface is, as people write it: `x = t` for t - x, where x is one of the variables."""
        plain = in_decimals(simplify(in_decimals(surface)))
        ordered = transform(plain, lambda _, new: in_order(new, frozenset()))
        return format_equation(ordered, variables, self.numbers)


def written_notation(db: Database, file: str, name: str) -> Notation:
    """How the conditions of a definition are written, in which fields have no names."""
    return Notation(numbers=numbers_of(db, global_(file, name)))


def notation_of(db: Database, file: str, name: str) -> Notation:
    """That of a definition."""
    return Notation(fields_of(db, interface(db, file, name).type), written_notation(db, file, name).numbers)


def numbers_in(*programs: nodes.Node | None) -> Numbers:
    """Fractions, unless there are decimals in one of the programs."""
    has_decimals = any(_is_decimal(node) for program in programs if program is not None for node in walk(program))
    return Numbers.DECIMALS if has_decimals else Numbers.FRACTIONS


def numbers_of(db: Database, term: Term, *programs: nodes.Node) -> Numbers:
    """The same of programs and of the definitions that a term names, or of which it names the derivative, and of those
    that these name."""
    written: list[nodes.Node | None] = [*programs]
    while isinstance(term, Deriv | Global):
        if isinstance(term, Global):
            written.append(definition(db, term.module, term.name))
        term = term.function if isinstance(term, Deriv) else core_term(db, term.module, term.name)
    named = {node for node in postorder(term) if isinstance(node, Global)}
    return numbers_in(*written, *(definition(db, node.module, node.name) for node in named))


def _is_only_decimal(term: Term) -> bool:
    """Whether it is a number that is no plain fraction: 4.905, from a function that is called."""
    if not isinstance(term, Const) or term.name is not None or not isfinite(term.value) or term.value.is_integer():
        return False
    return simple_fraction(term.value) is None


def _is_decimal(node: nodes.Node) -> bool:
    return isinstance(node, nodes.Number) and not node.text.isdigit()
