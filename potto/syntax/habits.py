"""What users of other languages and of mathematics write out of habit, and how it is written here.

Owns `habit`, for places where the grammar has no action, and `foreign_statement`, for a chunk that is none of ours. One
message says all; what follows would only be guessed, so that the rest of the chunk is given up.
"""

from __future__ import annotations

import re
from itertools import pairwise

from potto.diagnostics import Diagnostic, suggest
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.stops import Stop
from potto.syntax.tokens import Token

_TYPE = re.compile(r"[A-Z([]")
_STATEMENTS = {
    "while": "there are no loops but `for` over a list in a script; `sum i in 1..n (…)` adds, recursion repeats",
    "function": "write `def f(x) …`",
    "func": "write `def f(x) …`",
    "fn": "write `def f(x) …`",
    "fun": "write `def f(x) …`",
    "var": "write `name = e`",
    "val": "write `name = e`",
    "const": "write `name = e`",
    "elif": "write `else if`",
    "with": "take it out",
    "assert": "write a comment `#> e` and under it `#= value`, which `potto test` checks",
    "raise": "errors cannot be raised",
    "global": "names of the file are known in its definitions",
}

ARRAYS = ("Array", "List", "Vec", "Vector", "array", "list", "vector", "ndarray", "Tensor")
"""What other languages call the type of an array."""
ARRAY_TYPE = "the type of an array starts with its size: `[n] Real`"

_SEVERAL = re.compile(r"\s*\([^()]*\)\s*in\b")
_ARRAY = re.compile(r"(?P<name>(?:[^\W\d][\w.]*)?)(\s*[([].*)?", re.DOTALL)
_GENERATOR = re.compile(r"(.+?)\s+for\s+([^\W\d]\w*)\s+in\s+(.+)", re.DOTALL)
_RANGE = re.compile(r"([^\W\d]\w*)\s+in\s+(.+)", re.DOTALL)


def foreign_statement(tokens: list[Token]) -> Diagnostic | None:
    """What is said of a chunk with errors that starts with a word of another language before a name."""
    first = [token.kind for token in tokens[:3]]
    if first == ["LET", "NAME", "LPAR"] and all(token.kind != "IN" for token in tokens):
        hint, written = f"write `def {tokens[1].text}(…) body`", suggest(tokens[0].span, "def")
        message = "a function is defined with `def`, not with `let`"
        return kinds.OTHER_LANGUAGE(tokens[0].span, message, help=hint, suggestions=(written,))
    if first[:1] != ["NAME"] or first[1:2] not in (["NAME"], ["NUMBER"]):
        return None
    help = _STATEMENTS.get(tokens[0].text)
    if help is None:
        return None
    word, until = tokens[0].text, tokens[1].start
    taken_out = suggest(Span(tokens[0].start, until), "", f"Take out `{word}`")
    return kinds.OTHER_LANGUAGE(tokens[0].span, f"Potto has no `{word}`", help=help, suggestions=(taken_out,))


def habit(stop: Stop) -> Diagnostic | None:
    """The message for a stop that shows where its author comes from; None for any other."""
    for known in (_lambda, _loop, _bounds, _sum, _array, _range):
        found = known(stop)
        if found is not None:
            return found
    return None


def _lambda(stop: Stop) -> Diagnostic | None:
    at, after = stop.at, stop.after
    arrow = _arrow(at, after)
    if arrow is not None and stop.before is not None and stop.before.kind in ("NAME", "RPAR"):
        return kinds.OTHER_LANGUAGE(
            arrow, "a function without a name starts with `\\`, not with an arrow", help="write `\\x . e`"
        )
    if at.kind != "COLON":
        return None
    before = stop.tokens[: stop.index]
    word = next((token for token in reversed(before) if token.text == "lambda" and token.kind == "NAME"), None)
    if word is None:
        return None
    return kinds.OTHER_LANGUAGE(
        word.span, "Potto has no `lambda`: a function without a name starts with `\\`", help="write `\\x . e`"
    )


def _arrow(at: Token, after: Token | None) -> Span | None:
    """The place of an `->` or `=>`."""
    if at.kind == "ARROW":
        return at.span
    double = at.kind == "EQ" and after is not None and after.text == ">" and after.start == at.end
    return at.span.cover(after.span) if double and after is not None else None


def arrow_before_body(tokens: list[Token]) -> Diagnostic | None:
    """`def f(x) -> x^2`, `def f(x) => x^2`."""
    for at, after in pairwise(tokens):
        arrow = _arrow(at, after)
        if arrow is not None and not (at.kind == "ARROW" and (not after.text or _TYPE.match(after.text))):
            message = "the body of a `def` follows its head without an arrow"
            return kinds.DEFINITION_HEAD(arrow, message, help="take the arrow out; `->` is for the type of the result")
    return None


def _loop(stop: Stop) -> Diagnostic | None:
    """A `for` within a definition, over a range, over tuples that it takes apart, or without its colon."""
    at, first = stop.at, stop.tokens[0]
    named = stop.after is None or stop.after.kind != "NAME"  # `for = 3`: a reserved word
    if at.kind == "FOR" and not named and first.kind in ("DEF", "DIFFEODEF"):
        return kinds.UNEXPECTED(
            at.span,
            "a `for` goes through a list in a script, not in a definition",
            help="add with `sum i in 1..n (…)`, or repeat by recursion",
        )
    if first.kind != "FOR":
        return None
    if at.kind == "DOTDOT" and "COLON" not in {token.kind for token in stop.tokens[: stop.index]}:
        return kinds.UNEXPECTED(
            at.span, "a `for` goes over a list, not over a range", help="write the list: `for i in [1, 2, 3]:`"
        )
    if at.kind == "LPAR" and stop.index == 1:
        return kinds.NOT_A_NAME(
            at.span, "a `for` has one variable", help="take it apart inside: `for v in list:`, then `(a, b) = v`"
        )
    shown = next((token for token in stop.tokens if token.text == "print"), None)
    if shown is not None and not at.text and "INDENT" in stop.possible:
        return kinds.UNFINISHED(
            shown.span, "expected `:` before the statement of this `for`", help="write `for v in list: print(v)`"
        )
    return None


def _bounds(stop: Stop) -> Diagnostic | None:
    """`integral (0, 1)`, `integral(0, 1, f, x)`, `integral (x in [0, 1])`, `integral (normal(0, 1))`."""
    opened = stop.opened
    if opened is None or opened.kind not in ("LPAR", "INTEGRAL"):
        return None
    outer = [token for token in stop.tokens[: stop.index] if token.kind == "INTEGRAL"]
    if not outer or stop.tokens[stop.tokens.index(outer[-1]) + 1].kind != "LPAR":
        return None
    if stop.at.kind == "IN":
        return kinds.UNEXPECTED(
            stop.at.span, "the bounds of an integral stand alone", help="write `integral [lo, hi] body d(x)`"
        )
    if stop.before is None:
        return None
    if stop.before.kind == "NAME" and stop.at.text == "(":
        return _without_variable(stop.before)
    if stop.before.kind != "LPAR" or stop.at.kind not in ("NUMBER", "SIGN"):
        return None
    return kinds.UNFINISHED(
        Span(outer[-1].start, stop.at.end),
        "the bounds of an integral stand in brackets",
        help="write `integral [lo, hi] body d(x)`",
    )


def _without_variable(measure: Token) -> Diagnostic:
    help = f"write `integral (x ~ {measure.text}(…)) body d(x)`"
    return kinds.UNFINISHED(measure.span, f"expected a variable and `~` before `{measure.text}`", help=help)


def _sum(stop: Stop) -> Diagnostic | None:
    """`sum(i in 1..3) …`, `sum(i^2 for i in 1..3)`, `sum(i, 1, 3, i^2)`, `sum([1, 2])`, `sum [1, 2]`."""
    opening = stop.after if stop.at.kind == "SUM" else stop.at
    word = stop.at if stop.at.kind == "SUM" else stop.before
    if opening is None or opening.kind not in ("LPAR", "LSQB") or word is None or word.kind != "SUM":
        return None
    if hint := loop_hint(stop):
        several = stop.at.kind == "SUM"
        return kinds.UNEXPECTED(opening.span, "what goes through an array has one name", help=hint) if several else None
    message = "the variable of a `sum` stands without parentheses, its terms stand in them"
    if opening.kind == "LSQB":
        message = "the elements of an array have a name in a `sum`"
    help = _instead_of(stop.text[opening.start :]) or "write `sum i in 1..n (body)`"
    return kinds.UNEXPECTED(opening.span, message, help=help)


def _instead_of(written: str) -> str:
    """The sum that is meant by what stands behind its word, in parentheses or as a list; empty if that is not known."""
    whole = _in_brackets(written)
    inside = whole[1:-1].strip() if whole[:1] == "(" else whole
    if found := _GENERATOR.fullmatch(inside):
        return f"write `sum {found[2]} in {found[3]} ({found[1]})`"
    if found := _RANGE.fullmatch(inside):
        return f"write `sum {found[1]} in {found[2]} (body)`"
    found = _ARRAY.fullmatch(inside)
    if not inside or found is None or found["name"] == "sum":
        return ""
    brackets = inside[found.end("name") :].strip()
    return f"write `sum x in {inside} (x)`" if _in_brackets(brackets) == brackets else ""


def _in_brackets(text: str) -> str:
    """A text up to where the brackets that are open in it are closed; empty if they are not."""
    depth = 0
    for place, sign in enumerate(text):
        depth += (sign in "([") - (sign in ")]")
        if depth == 0 and sign in ")]":
            return text[: place + 1]
    return ""


def _array(stop: Stop) -> Diagnostic | None:
    """The types `Real[]`, `Array(Real)`, `Vec<Real>` and `[n][m] Real`."""
    at, before = stop.at, stop.before
    if before is None:
        return None
    if before.text == "]" and at.text == "[":
        help = "between the sizes of an array of arrays is a blank: `[n] [m] Real`"
        return kinds.UNEXPECTED(at.span, "a type has no index", help=help)
    empty = before.text == "[" and at.text == "]"
    name = stop.tokens[stop.index - 2] if empty and stop.index > 1 else before
    if name.text == "Real" if empty else name.text in ARRAYS and at.text in ("(", "<"):
        return kinds.BAD_TYPE(name.span.cover(at.span), "this is not a type", help=ARRAY_TYPE)
    return None


def _range(stop: Stop) -> Diagnostic | None:
    """`xs = 1:10`, `sum i in 1:10`."""
    at, before, after = stop.at, stop.before, stop.after
    if at.kind != "COLON" or stop.index < 2 or stop.tokens[stop.index - 2].kind not in ("EQ", "IN"):
        return None
    if before is None or before.kind != "NUMBER" or after is None or after.kind not in ("NUMBER", "NAME"):
        return None
    help = f"write `{before.text}..{after.text}` where a `sum`, a `for` or an array goes through it"
    return kinds.UNEXPECTED(at.span, "a range has two dots", help=help)


SEVERAL = "give its parts one name together: `sum p in ps (p.0*p.1)`"


def loop_hint(stop: Stop) -> str:
    """What to write for a loop over tuples by the names of their parts."""
    at, rest = stop.at, stop.text[stop.at.end :]
    if (at.kind in ("SUM", "FOR") and _SEVERAL.match(rest)) or (
        at.kind == "IN" and stop.before is not None and stop.before.kind == "RPAR"
    ):
        return SEVERAL
    return ""


def tuple_without_parentheses(stop: Stop) -> Diagnostic | None:
    """`a, b = pair`: the repair leaves `a = pair`, so that the block goes on."""
    if stop.at.kind != "COMMA" or (stop.opened is not None and stop.opened.kind not in ("DEF", "DIFFEODEF", "FOR")):
        return None
    names = [stop.tokens[stop.index - 1]]
    rest = stop.tokens[stop.index :]
    while len(rest) > 2 and rest[0].kind == "COMMA" and rest[1].kind == "NAME":
        names.append(rest[1])
        rest = rest[2:]
    if len(names) < 2 or rest[0].kind != "EQ" or names[0].kind != "NAME":
        return None
    span = names[0].span.cover(names[-1].span)
    if names[0] is stop.tokens[0]:
        return kinds.several_names(span, [name.text for name in names])
    shown = ", ".join(name.text for name in names)
    return kinds.NOT_A_NAME(
        span,
        "names that take a tuple apart stand in parentheses",
        help=f"write `({shown}) = …`",
    )
