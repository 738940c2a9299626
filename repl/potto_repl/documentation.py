"""What there is to say about a name: of a program, a builtin, a measure, a word of the language.

Owns `documentation` and `described`. Builtins and measures are read from their tables.
"""

from __future__ import annotations

import re

from potto.core.printer import format_term
from potto.core.simplify import simplify
from potto.core.terms import var
from potto.measures import MEASURES
from potto.modules import DefinitionTarget
from potto.modules.texts import chunk_text
from potto.primitives import PRIMITIVES
from potto.query import Database
from potto.types import format_type, interface

_ARGUMENTS = {"clamp": ("x", "lo", "hi"), "atan2": ("y", "x"), "hypot": ("x", "y"), "pow": ("x", "n")}
WORDS: dict[str, tuple[str, str]] = {
    "integral": ("integral ([0, 1], [lo, hi]) body d(x, y)", "The integral of the body; bounds may depend on what is "
                 "further out. Also `integral (x ~ normal(0, 1)) body d(x)`, an expectation."),
    "deriv": ("deriv(f)", "The derivative of a function: it takes duals `(value, tangent)` and gives a dual. "
              "What jumps under an integral adds its boundary term."),
    "def": ("def f(a, b) body", "Defines a function; lines `name = e` before the last one name values."),
    "diffeo": ("diffeo name(x, y; c) = (u, v)", "Declares a diffeomorphism, a condition that may jump under an "
               "integral: it holds where the first component is >= 0."),
    "sum": ("sum i in 1..n (body)", "The sum over whole numbers, both ends included."),
    "delta": ("delta(x + k)", "Dirac's delta of a diffeomorphism; it has a meaning under an integral."),
    "if": ("if p then a else b", "Plain, if the condition varies with no variable of integration; "
           "`if [p] then a else b` may jump under an integral."),
    "let": ("let x = e in body", "Names a value in an expression."),
    "for": ("for v in list: print(v)", "A loop of a script."),
    "print": ("print(a, b)", "Shows values to the digits that their errors support."),
    "fst": ("fst(pair)", "The first component of a tuple."),
    "snd": ("snd(pair)", "The second component of a tuple."),
    "pi": ("pi", "3.14159..., the half circumference of the unit circle."),
    "inf": ("inf", "Infinity, as a bound of an integral."),
}  # fmt: skip


def documentation(db: Database, name: str, target: DefinitionTarget | None) -> str | None:
    """All there is to say about a name; None if it means nothing."""
    if target is not None:
        return _of_definition(db, name, target)
    if name in PRIMITIVES and PRIMITIVES[name].surface:
        return _of_builtin(name)
    if name in MEASURES:
        return _of_measure(name)
    if name in WORDS:
        usage, text = WORDS[name]
        return f"{usage}\n\n{text}"
    return None


def described(name: str) -> str:
    """A builtin name in a few words, for a menu."""
    if name in PRIMITIVES:
        return PRIMITIVES[name].doc
    if name in MEASURES:
        return MEASURES[name].doc
    return WORDS[name][1] if name in WORDS else ""


def _of_definition(db: Database, name: str, target: DefinitionTarget) -> str:
    found = interface(db, target.file, target.name)
    lines = [f"{name} : {format_type(found.type)}"]
    comment = leading_comment(chunk_text(db, target.file, target.name) or "")
    if comment:
        lines += ["", comment]
    if found.plain:
        lines += ["", f"plain parameters: {', '.join(found.plain)} (they decide a plain condition)"]
    return "\n".join(lines)


def leading_comment(text: str) -> str:
    """The comment lines above a definition, without live expressions."""
    found = re.match(r"(?:[ \t]*#[^\n]*\n)*", text)
    lines = (found[0] if found else "").splitlines()
    return "\n".join(line.strip().lstrip("#").strip() for line in lines if not re.match(r"\s*#[>=]", line))


def _of_builtin(name: str) -> str:
    entry = PRIMITIVES[name]
    arguments = _ARGUMENTS.get(name) or (("a", "b", "...") if entry.arity is None else ("x",) * 1)
    lines = [f"{name}({', '.join(arguments)})", "", entry.doc]
    if entry.partials is not None:
        slopes = entry.partials(*(var(a) for a in arguments if a != "..."))
        lines.append("")
        lines += [f"derivative by {a}: {format_term(simplify(s))}" for a, s in zip(arguments, slopes)]
    elif entry.plain:
        lines += ["", "it jumps, so it takes plain values only: state a jump as a bracket, `[x > 0]`"]
    return "\n".join([*lines, *([f"example: {entry.example}"] if entry.example else [])])


def _of_measure(name: str) -> str:
    entry = MEASURES[name]
    terms = tuple(map(var, entry.parameters))
    lo, hi = entry.support(*terms)
    density = format_term(simplify(entry.density(var("x"), *terms)))
    return "\n".join([
        f"x ~ {name}({', '.join(entry.parameters)})", "", entry.doc, "",
        f"density: {density}", f"support: [{format_term(lo)}, {format_term(hi)}]", f"example: {entry.example}",
    ])  # fmt: skip
