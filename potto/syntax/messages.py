"""What to tell the user where the grammar has no action.

Owns `describe`: from where the parse stopped, what was open there and how it was repaired, to one diagnostic in the
user's words.
"""

from __future__ import annotations

from potto.diagnostics import Diagnostic, Related
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.habits import arrow_before_body, loop_hint, tuple_without_parentheses
from potto.syntax.repair import RepairStep
from potto.syntax.stops import Stop
from potto.syntax.suggesting import write
from potto.syntax.tokens import RESERVED, Token
from potto.syntax.unknown import reserved_word

_WORDS = {"RPAR": ")", "RSQB": "]", "LPAR": "(", "LSQB": "[", "COMMA": ",", "EQ": "=", "DOT": ".", "DOTDOT": ".."}
_BRACKETS = ("LPAR", "LSQB", "ADJACENT")


_SUM_HELP = "write `sum i in 1..n (body)`"
_FOLD_HELP = "write `fold s = 0 for i in 1..n (step)`"
_LET_HELP = "write `let a = 1 in a + 2`; a name that has a line to itself needs no `let`: `a = 1`"
_LET_BODY = (
    "the result follows `in`, on its line or on the next: `let a = 1 in a + 2`; "
    "a name that has a line to itself needs no `let`: `a = 1`"
)
_PARTS: tuple[tuple[str, tuple[str, ...], str, str], ...] = (
    ("THEN", ("IF",), "expected `then` after the condition of `if`", "write `if p then a else b`"),
    ("ELSE", ("IF",), "expected `else` after the first choice of `if`", "an `if` has a value either way"),
    ("COLON", ("QMARK",), "expected `:` after the first choice of `? :`", "write `p ? a : b`"),
    ("SUMBODY", ("SUM",), "expected the body of `sum` in parentheses", _SUM_HELP),
    ("SUMBODY", ("FOLD",), "expected the step of `fold` in parentheses", _FOLD_HELP),
    ("FOR", ("FOLD",), "expected `for` after the first state of `fold`", _FOLD_HELP),
    ("EQ", ("FOLD",), "expected `=` and the first state of `fold`", _FOLD_HELP),
    ("DOTDOT", ("SUM",), "expected `..` and the last value of the variable of `sum`", _SUM_HELP),
    ("IN", ("SUM",), "expected `in` after the variable of `sum`", _SUM_HELP),
    ("IN", ("FOR",), "expected `in` after the variable of `for`", "write `for v in list:`"),
    ("IN", ("LET",), "expected `in` after the names of `let`", _LET_HELP),
    ("DOT", ("LAMBDA",), "expected `.` after the parameters of a lambda", "write `\\x . e`"),
)
"""What is missing, within which construct, and what to say of it."""


def describe(stop: Stop, edits: list[RepairStep]) -> Diagnostic:
    """The message for a stop that was repaired by `edits` (empty if it could not be)."""
    special = _special(stop)
    if special is not None:
        return special
    edit = edits[0] if edits else RepairStep("delete", stop.at.kind)
    if edit.action == "replace":
        return _replaced(stop)
    if edit.action == "insert":
        return _inserted(stop, edit.kind)
    return _unexpected(stop)


def _goes_through(stop: Stop) -> bool:
    """Whether it stopped in an array, behind its `for x in xs`."""
    inside: list[list[str]] = []  # of each open bracket: itself, and that `for` if it has been
    for token in stop.tokens[: stop.index]:
        if token.text in ("(", "["):
            inside.append([token.text])
        elif token.text in (")", "]") and inside:
            inside.pop()
        elif token.kind == "FOR" and inside:
            inside[-1].append(token.text)
    return bool(inside) and inside[-1][0] == "[" and len(inside[-1]) > 1


def _special(stop: Stop) -> Diagnostic | None:
    """Stops whose cause shows without the repair."""
    opened, at, before = stop.opened, stop.at, stop.before
    if at.kind == "COMMA" and opened is not None and opened.kind == "LET":
        return kinds.UNEXPECTED(at.span, "unexpected `,`", help="separate the names of a `let` by `;`, or by lines")
    found = _in_record(stop) or _of_arrays(stop) or _behind_with(stop)
    if found is not None:
        return found
    unpacked = tuple_without_parentheses(stop)
    if unpacked is not None:
        return unpacked
    if at.kind == "DOT" and stop.after is not None and stop.after.kind == "NUMBER" and stop.after.start == at.end:
        number = at.text + stop.after.text
        place = Span(at.start, stop.after.end)
        return kinds.BAD_NUMBER(
            place, "a number starts with a digit", help=f"write `0{number}`",
            suggestions=write(stop.text, place, f"0{number}"),
        )  # fmt: skip
    if at.kind == "DOT" and before is not None and before.end == at.start and before.kind in ("NAME", "MEMBER"):
        return kinds.NOT_A_NAME(before.span.cover(at.span), f"expected a name after `{_shown(before)}.`")
    if at.kind == "COLON" and opened is not None and opened.kind == "IF":
        return kinds.UNFINISHED(
            at.span, "expected `then` after the condition of `if`", related=_from(opened), help="write `then`, not `:`",
            suggestions=write(stop.text, at.span, "then"),
        )  # fmt: skip
    if at.kind in ("DOT", "DOTDOT") and before is not None and before.kind in ("FROM", "IMPORT"):
        return kinds.BAD_IMPORT(
            at.span, "a module's name does not begin with a dot",
            help="write `from m import a`: it is looked for beside this file, then from the roots",
        )  # fmt: skip
    if at.kind == "STAR" and opened is not None and opened.kind == "IMPORT":
        return kinds.BAD_IMPORT(at.span, "an import says which names it takes", help="list the names instead of `*`")
    if at.kind == "COMMA" and stop.values and isinstance(stop.values[0], Token) and stop.values[0].kind == "IMPORT":
        return kinds.BAD_IMPORT(at.span, "one `import` takes one module", help="write an `import` for each")
    if opened is not None and opened.kind == "LSQB" and _is_interval(stop):
        return kinds.UNFINISHED(opened.span.cover(stop.place), "an interval has two ends", help="write `[lo, hi]`")
    loop = stop.last("FOR")
    if loop is not None and "INDENT" in stop.possible and not at.text:
        return kinds.UNFINISHED(
            loop.span, "this `for` has no statements",
            help="write them on the lines below, indented; or on the same line after a `:`",
        )  # fmt: skip
    return None


def _in_record(stop: Stop) -> Diagnostic | None:
    """Fields without a comma between them, or whose name is taken."""
    at, before, after = stop.at, stop.before, stop.after
    if stop.tokens[0].kind != "RECORDDEF" or not at.text.isidentifier() or after is None or after.kind != "COLON":
        return None
    if before is None or before.kind in ("LPAR", "COMMA"):
        return reserved_word(at.text, at.span)
    return kinds.RECORD_FORM(
        at.span, f"expected `,` before `{at.text}`", help="fields are separated by `,`",
        suggestions=write(stop.text, Span(before.end, before.end), ","),
    )  # fmt: skip


def _of_arrays(stop: Stop) -> Diagnostic | None:
    """Stops in arrays and in what goes through them."""
    opened, at = stop.opened, stop.at
    kind = "" if opened is None else opened.kind
    loop = stop.last("SUM", "FOLD") if "SUMBODY" in stop.possible else None  # its body could follow
    if at.kind == "IF" and (loop is not None or _goes_through(stop)):
        what = "an array has no filter: its size is known before its elements"
        what = what if loop is None else f"`{loop.text}` has no filter"
        help = "to leave some out, let them add 0: `sum x in xs (if x > 0 then x else 0)`"
        return kinds.UNEXPECTED(at.span, what, help=help)
    if at.kind == "COLON" and loop is not None:
        what, help = ("step", _FOLD_HELP) if loop.kind == "FOLD" else ("body", _SUM_HELP)
        message = f"expected the {what} of `{loop.text}` in parentheses, without `:`"
        return kinds.UNFINISHED(at.span, message, related=_from(loop), help=help)
    if at.kind in ("COLON", "DOTDOT") and kind == "ADJACENT":
        help = "write the elements that are meant: `[xs[k] for k in 1..3]`"
        return kinds.UNEXPECTED(at.span, "an index is one place, not a range", help=help)
    if at.kind == "FOR" and (kind in _BRACKETS or _goes_through(stop)):
        help = "an array goes through one range or through several: `[e for i in 1..n, j in 1..m]`"
        return kinds.UNEXPECTED(at.span, "unexpected `for`", help=help)
    return None


def _behind_with(stop: Stop) -> Diagnostic | None:
    """`c with a.b = 1`, also in parentheses, `c with a = 1, b = 2`."""
    at, before = stop.at, stop.before
    inside = before is not None and at.kind == "EQ" and before.kind == "MEMBER" and _among_fields(stop)
    part = before if inside else at
    if part is not None and part.kind == "MEMBER" and (inside or (before is not None and before.kind == "WITH")):
        own, _, inner = part.text.partition(".")
        help = f"write `c with {own} = (c.{own} with {inner} = …)`"
        message = f"`with` changes a field of the record, and `{part.text}` is a part of one"
        return kinds.NOT_A_NAME(part.span, message, help=help)
    follows = [token.kind for token in stop.tokens[stop.index + 1 : stop.index + 3]]
    if at.kind == "COMMA" and stop.last("WITH") is not None and follows == ["NAME", "EQ"]:
        help = "several fields stand in parentheses: `c with (a = 1, b = 2)`"
        return kinds.UNEXPECTED(at.span, "one field follows `with`", help=help)
    return None


def _among_fields(stop: Stop) -> bool:
    """Whether it stopped directly in the parentheses behind a `with`."""
    open_at: list[int] = []
    for place, token in enumerate(stop.tokens[: stop.index]):
        if token.text in ("(", "["):
            open_at.append(place)
        elif token.text in (")", "]") and open_at:
            open_at.pop()
    return bool(open_at) and stop.tokens[open_at[-1] - 1].kind == "WITH"


def _is_interval(stop: Stop) -> bool:
    """Whether the open bracket is a bound of an integral that lacks its other end."""
    return "RSQB" not in stop.possible and "COMMA" in stop.possible and stop.at.kind == "RSQB"


def _from(opened: Token) -> tuple[Related, ...]:
    return (Related(opened.span, f"this `{opened.text}`"),)


def _replaced(stop: Stop) -> Diagnostic:
    at = stop.at
    if at.kind == "EQ" and stop.before is not None and stop.before == stop.continues:
        return kinds.INDENTATION(
            stop.before.span,
            "this line is indented more than the one above, so it goes on with that",
            help="indent the lines of a block alike",
        )
    if at.kind == "EQ":
        help = "to compare, write `==`"
        return kinds.EQUALS(
            at.span, "`=` names a value; it does not compare", help=help, suggestions=write(stop.text, at.span, "==")
        )
    if at.kind == "BINOP":
        return _missing_expression(stop)
    named = stop.after is not None and stop.after.kind in ("EQ", "COMMA", "RPAR", "DOT")
    if "NUMBER" in stop.possible and not named:
        return _unexpected(stop)
    return reserved_word(at.text, at.span)


def _inserted(stop: Stop, kind: str) -> Diagnostic:
    if kind == "NAME":
        return _missing_expression(stop) if "NUMBER" in stop.possible else _missing_name(stop)
    if kind == "IMPORT":
        return kinds.BAD_IMPORT(stop.place, "expected `import` after the module", help="write `from m import a, b`")
    for wanted, openers, message, help in _PARTS:
        opened = stop.last(*openers)
        if kind == wanted and opened is not None:
            return kinds.UNFINISHED(stop.place, message, related=_from(opened), help=help)
    word = _WORDS.get(kind)
    if stop.before is None or word is None:
        return _unexpected(stop)
    return kinds.UNEXPECTED(stop.place, f"expected `{word}` after `{_shown(stop.before)}`", related=_open_bracket(stop))


def _open_bracket(stop: Stop) -> tuple[Related, ...]:
    opened = stop.opened
    return (Related(opened.span, "opened here"),) if opened is not None and opened.kind in _BRACKETS else ()


def _missing_expression(stop: Stop) -> Diagnostic:
    before, at = stop.before, stop.at
    if "INDENT" in stop.possible and not (before is not None and before.kind in ("BINOP", "STAR", "SIGN")):
        return _no_body(stop)
    if at.kind == "D" and at.text:
        return kinds.MISSING_EXPRESSION(
            at.span, "expected what is integrated before `d(...)`", help="write `integral [lo, hi] body d(x)`"
        )
    if before is None:
        what = f"expected an expression before `{_shown(at)}`" if at.text else "there is no expression here"
        return kinds.MISSING_EXPRESSION(stop.place, what)
    if at.text and at.text in RESERVED and at.kind not in ("BINOP", "NOT"):
        return kinds.MISSING_EXPRESSION(
            before.span, f"expected an expression after `{_shown(before)}`, before `{at.text}`"
        )
    help = _LET_BODY if before.kind == "IN" and stop.last("LET") is not None else ""
    return kinds.MISSING_EXPRESSION(before.span, f"expected an expression after `{_shown(before)}`", help=help)


def _no_body(stop: Stop) -> Diagnostic:
    head = next((v for v in stop.values if isinstance(v, Token) and v.kind in ("DEF", "DIFFEODEF")), None)
    name = next((v for v in stop.values if isinstance(v, Token) and v.kind == "NAME"), None)
    arrow = arrow_before_body(stop.tokens)
    if arrow is not None:
        return arrow
    if head is None or name is None or not name.text:
        return kinds.MISSING_EXPRESSION(stop.place, "expected an expression")
    return kinds.MISSING_EXPRESSION(
        name.span,
        f"`{name.text}` has no body",
        help="write what it gives after its head, or on the lines below, indented",
    )


def _missing_name(stop: Stop) -> Diagnostic:
    before, opened = stop.before, stop.opened
    if before is None:
        return _unexpected(stop)
    if before.kind in ("FROM", "IMPORT") or (opened is not None and opened.kind in ("FROM", "IMPORT")):
        what = "a module" if before.kind == "FROM" or (len(stop.values) == 1 and before.kind == "IMPORT") else "a name"
        return kinds.BAD_IMPORT(
            before.span, f"expected {what} after `{before.text}`", help="write `from m import a, b`"
        )
    if stop.at.text:
        help = _SUM_HELP if before.kind == "SUM" else ""
        what = f"expected a name after `{_shown(before)}`, not `{_shown(stop.at)}`"
        return kinds.NOT_A_NAME(stop.at.span, what, help=help)
    return kinds.NOT_A_NAME(before.span, f"expected a name after `{_shown(before)}`")


_GOES_WITH = {
    "THEN": "`then` goes with an `if` before it",
    "ELSE": "`else` goes with an `if` before it",
    "IN": "`in` goes with `let`, `for` or `sum`",
    "DEF": "a `def` starts in the first column",
    "FROM": "an import starts in the first column",
    "IMPORT": "an import starts in the first column",
    "FOR": "a `for` starts a line of its own",
    "SUM": "write `sum i in 1..n (body)`",
    "IF": "an `if` comes first: `if p then a else b`",
    "SEMI": "a line needs no `;` at its end",
    "COMMA": "to make a tuple, write parentheses around it",
    "TILDE": "`x ~ normal(m, s)` goes among the bounds of an integral",
    "DOTDOT": "what goes through a range says so: `[i for i in 1..n]`, `sum i in 1..n (i)`",
    "DOT": "a lambda starts with `\\`",
    "COLON": "a choice is written `p ? a : b`",
    "AS": "`as` goes with an import",
    "ARROW": "`->` goes before the type of a definition's result",
}
"""What is said of a word that stands where it has no meaning."""


def _unexpected(stop: Stop) -> Diagnostic:
    at, opened = stop.at, stop.opened
    if not at.text:
        before = stop.before
        what = f"something is missing after `{_shown(before)}`" if before is not None else "something is missing"
        return kinds.UNFINISHED(stop.place, what)
    hint = loop_hint(stop) or _GOES_WITH.get(at.kind, "")
    if at.kind in ("NAME", "NUMBER", "MEMBER") and stop.before is not None:
        return kinds.UNEXPECTED(at.span, f"`{_shown(at)}` does not belong after `{_shown(stop.before)}`", help=hint)
    related = _from(opened) if opened is not None and at.kind in ("NEWLINE", "RPAR", "RSQB") else ()
    return kinds.UNEXPECTED(at.span, f"unexpected `{_shown(at)}`", help=hint, related=related)


def _shown(token: Token) -> str:
    return token.text if len(token.text) <= 40 else token.text[:39] + "…"
