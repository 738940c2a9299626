"""The kinds of syntax errors: one declaration each, beside no check in particular since several checks raise them."""

from __future__ import annotations

from collections.abc import Sequence

from potto.diagnostics import Diagnostic, declare
from potto.source import Span

MISSING_EXPRESSION = declare("P0101", "an expression is missing")
BRACKETS = declare("P0102", "brackets that do not match")
UNEXPECTED = declare("P0103", "something that does not belong here")
UNFINISHED = declare("P0104", "a construct that is not finished")
NO_DIFFERENTIAL = declare("P0105", "an integral without its d(x)")
LAST_LINE = declare("P0106", "a definition's last line must be its result")
RESERVED_WORD = declare("P0107", "a reserved word used as a name")
EQUALS = declare("P0108", "`=` where `==` is meant")
BOUNDS = declare("P0109", "bounds and variables of integration that do not match")
DUPLICATE = declare("P0110", "a name bound twice in one place")
BAD_NUMBER = declare("P0111", "a number that is not well formed")
UNKNOWN_CHARACTER = declare("P0112", "a character that Potto does not know")
INDENTATION = declare("P0113", "indentation that does not say what belongs together")
TOO_DEEP = declare("P0114", "code that is nested too deeply or too long")
NOT_A_NAME = declare("P0115", "a name is needed here")
BAD_TYPE = declare("P0116", "a type that is not known")
OTHER_LANGUAGE = declare("P0117", "something of another language")
BAD_IMPORT = declare("P0118", "an import that is not well formed")
DEFINITION_HEAD = declare("P0119", "the head of a definition is not well formed")
DIFFEO_FORM = declare("P0120", "a diffeomorphism that is not well formed")
NAMED_ARGUMENT = declare("P0121", "a named argument outside of a call")
RECORD_FORM = declare("P0122", "a record that is not well formed")


def several_names(span: Span, names: Sequence[str]) -> Diagnostic:
    """`u, v = pair` where definitions stand, with or without parentheses."""
    head = ", ".join(names)
    each = "; ".join(f"`{name} = let ({head}) = … in {name}`" for name in names[:2])
    if len(names) == 2:
        each = f"`pair = …`, then `{names[0]} = fst pair` and `{names[1]} = snd pair`"
    return NOT_A_NAME(span, "a definition has one name", label="several names", help=f"write {each}")
