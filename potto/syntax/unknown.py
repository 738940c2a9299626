"""Characters and operators that are not part of the language, and what their author may have meant."""

from __future__ import annotations

import re
import unicodedata

from potto.diagnostics import Diagnostic, shortened, suggest
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.suggesting import take_out, write
from potto.syntax.tokens import FIRST_NAME, PLAIN_OPERATOR

_DATA = re.compile(r"\.(csv|tsv|npy|npz|png|jpe?g|json)$", re.IGNORECASE)
_MEANT = {
    "!": ("write `not`; n! is `gamma(n + 1)`", "not"),
    "%": ("Potto has no remainder; `x - floor(x/n)*n` is one", ""),
    "|": ("write `abs(x)`, or `or` between conditions", "or"),
    "&": ("write `and` between conditions", "and"),
    "{": ("group with `(` and `)`", "("),
    "}": ("group with `(` and `)`", ")"),
    "·": ("write `*`", "*"),
    "×": ("write `*`", "*"),
    "÷": ("write `/`", "/"),
    "√": ("write `sqrt(x)`", "sqrt"),
    "π": ("write `pi`", "pi"),
    "∞": ("write `inf`", "inf"),
    "→": ("write `->`", "->"),
    "∑": ("write `sum i in 1..n (body)`", ""),
    "∧": ("write `and`", "and"),
    "∨": ("write `or`", "or"),
    "¬": ("write `not`", "not"),
    "²": ("write `^2`", "^2"),
    "³": ("write `^3`", "^3"),
    "–": ("write `-`", "-"),
    "—": ("write `-`", "-"),
    "⋅": ("write `*`", "*"),
    "∗": ("write `*`", "*"),
    "'": ("the derivative of `f` is `deriv(f)`; a name has letters, digits and `_`", ""),
    "’": ("the derivative of `f` is `deriv(f)`; a name has letters, digits and `_`", ""),
    "“": ("Potto has no text strings", ""),
    "”": ("Potto has no text strings", ""),
    "`": ("Potto has no backquotes", ""),
}
"""What is said of a character, and what may be written for it."""


def foreign_operator(text: str, word: str, span: Span) -> tuple[str, Diagnostic]:
    """What an operator of another language means here, and the message that says so."""
    plain = PLAIN_OPERATOR[word]
    message = f"`{word}` is written `{plain}` in Potto"
    return plain, kinds.OTHER_LANGUAGE(span, message, help=f"write `{plain}`", suggestions=write(text, span, plain))


def foreign_arithmetic(text: str, word: str, span: Span) -> tuple[str, Diagnostic]:
    """What stands for `//` or `+=` in the tree, and the message that says what to write."""
    if word == "//":
        help = "write `/`, or `floor(x/y)` to round down"
        return "/", kinds.OTHER_LANGUAGE(span, "Potto has no `//`", help=help, suggestions=write(text, span, "/"))
    plain = word[0]
    help = f"give the new value a name of its own: `y = x {plain} …`"
    return plain, kinds.OTHER_LANGUAGE(span, f"Potto has no `{word}`: a name keeps its value", help=help)


def foreign_comment(text: str, span: Span) -> Diagnostic:
    """The message for a line that starts with `//`."""
    message, suggestions = "a comment starts with `#`, not with `//`", write(text, span, "#")
    return kinds.OTHER_LANGUAGE(span, message, help="write `#`", suggestions=suggestions)


def reserved_word(word: str, span: Span) -> Diagnostic:
    """The message for a word of the language where a name is needed."""
    message = f"`{word}` is a reserved word and can't be a name"
    return kinds.RESERVED_WORD(span, message, help=f"choose another name, such as `{word}_`")


def bad_number(word: str, good: str, span: Span) -> Diagnostic:
    """The message for a word that starts like a number; `good` is as much of it as is one."""
    tail = word[len(good) :]
    meant = ""
    if re.fullmatch("[0-9_]+[0-9]", word):
        meant = word.replace("_", "")
    elif re.fullmatch("0[xX][0-9a-fA-F]+|0[bB][01]+|0[oO][0-7]+", word):
        meant = str(int(word, 0))
    elif FIRST_NAME.fullmatch(tail):
        meant = f"{good}*{tail}"
    head = "to multiply, write" if "*" in meant else "write"
    help = f"{head} `{meant}`" if meant else "write `2`, `0.5` or `1e-3`"
    suggestions = (suggest(span, meant),) if meant else ()
    return kinds.BAD_NUMBER(span, f"`{shortened(word)}` is not a number", help=help, suggestions=suggestions)


def string_literal(text: str, word: str, span: Span) -> Diagnostic:
    """The message for a quoted text."""
    inner = word.strip(word[0])
    name = (suggest(span, inner),) if FIRST_NAME.fullmatch(inner) else ()
    help, suggestions = "take the quotes out to use a name", (*name, *take_out(text, span))
    if _DATA.search(inner):
        help, suggestions = f'write `load("{inner}")`, with what it holds as a value of the program', ()
    return kinds.OTHER_LANGUAGE(span, "Potto has no text strings", help=help, suggestions=suggestions)


def no_return(text: str, span: Span) -> Diagnostic:
    """The message for `return`."""
    message = "Potto has no `return`: the last line of a definition is its result"
    return kinds.OTHER_LANGUAGE(span, message, help="take `return` out", suggestions=take_out(text, span))


def unknown_character(text: str, start: int) -> tuple[int, Diagnostic | None]:
    """The end of a run of one unknown character, and the message for it (blanks of other scripts are let pass)."""
    char, end = text[start], start + 1
    while end < len(text) and text[end] == char:
        end += 1
    if char.isspace():
        return end, None
    span, meant = Span(start, end), ""
    if char == "\0":
        message, help = "this is not text: it has NUL bytes", "is it a binary file, or text in UTF-16?"
    else:
        name = unicodedata.name(char, "")
        shown = f"`{char}`" if char.isprintable() else f"U+{ord(char):04X}"
        message = f"Potto does not know the character {shown}" + (
            f" ({name.lower()})" if ord(char) > 126 and name else ""
        )
        help, meant = _MEANT.get(char, ("take it out", ""))
    known = char in _MEANT or char == "\0"
    suggestions = write(text, span, meant) if meant else () if known else take_out(text, span)
    return end, kinds.UNKNOWN_CHARACTER(span, message, help=help, suggestions=suggestions)
