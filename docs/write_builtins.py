"""Writes `builtins.md`, and the builtins in the grammars of editors, from the tables: `python docs/write_builtins.py`.

The values on the page come from the reference evaluator, so that they check the one that people use.
"""

from __future__ import annotations

import re
from pathlib import Path

import mpmath

from potto.calculus.explanation.readable import formula
from potto.core.printer import format_term
from potto.core.reference import evaluate
from potto.core.terms import Term, var
from potto.elaborate import elaborate_expression
from potto.measures import COMPOSITIONS, MEASURES, Measure
from potto.modules.builtins import VECTORS
from potto.primitives import PRIMITIVES, Primitive
from potto.query import Database
from potto.syntax import parse_expression

PAGE = Path(__file__).resolve().parent / "builtins.md"
EDITORS = PAGE.parents[1] / "editors"
FIRST = ("Roots, exponentials, logarithms, powers", "Angles")  # the other topics as the tables have them
LAST = ("With kinks", "With jumps")
NOTES = {
    "With kinks": "They bend where the derivative jumps. The integrator cuts there, so they cost no accuracy.",
    "With jumps": "Their derivative would have deltas that nobody states, so they take plain values only: numbers that "
    "vary with no\nvariable of integration. Under an integral state the jump as a bracket, `[x > 0]`.",
}
NAMES = {"clamp": ("x", "lo", "hi"), "atan2": ("y", "x"), "hypot": ("x", "y"), "pow": ("x", "n")}
INTRODUCTION = """# Builtins

Written by `docs/write_builtins.py` from the tables in `potto/primitives` and `potto/measures`.

The arithmetic `+ - * / ^` is written as usual; `^` binds tightest and to the right. `pi` and `inf` are constants.
Every builtin takes numbers. Derivatives are by each argument in turn. They may name functions that programs cannot:
`hurwitz(s, x)` is the sum of `(x + n)^(-s)` over all n from 0, `besselj(n, x)` the Bessel function of the first kind of
order n and `sphericalj(n, x)` the spherical one.
"""


LOOPS = ("max", "min")  # are words of the language before `x in`, and in Vim a keyword would win


def page() -> str:
    """The text of the page."""
    parts = [INTRODUCTION]
    for title, names in sections().items():
        parts.append(f"## {title}\n\n" + (f"{NOTES[title]}\n\n" if title in NOTES else "") + builtin_table(names))
    parts.append(MEASURE_INTRODUCTION + measure_table())
    parts.append(COMPOSITION_INTRODUCTION + composition_table())
    return "\n".join(parts)


def sections() -> dict[str, tuple[str, ...]]:
    """The names of builtins under their topics."""
    found: dict[str, list[str]] = {title: [] for title in FIRST}
    for entry in PRIMITIVES.values():
        if entry.surface and entry.topic:
            found.setdefault(entry.topic, []).append(entry.name)
    middle = [title for title in found if title not in (*FIRST, *LAST)]
    return {title: tuple(found[title]) for title in (*FIRST, *middle, *LAST)}


def grammars() -> dict[Path, str]:
    """The grammars of editors with the builtins that there are."""
    names = sorted([*(entry.name for entry in PRIMITIVES.values() if entry.surface), *VECTORS, "load"])
    rules = {
        "vim/syntax/potto.vim": (
            r"(?m)(^syntax keyword pottoBuiltin .*\n)+",
            lines([*(n for n in names if n not in LOOPS), "fst", "snd", "print"], "syntax keyword pottoBuiltin ")
            + "\n",
        ),
        "emacs/potto-mode.el": (
            r"(?<=defconst potto--builtins\n)[^)]*\)",
            lines(
                [f'"{name}"' for name in (*names, "fst", "snd", "print", "deriv", "delta", "grad", "D")], "    "
            ).replace("    ", "  '(", 1)
            + ")",
        ),
        "vscode/syntaxes/potto.tmLanguage.json": (r"(?<=\(\?:)fst\|snd\|[\w|]*", "|".join(["fst", "snd", *names])),
    }
    found = {}
    for name, (pattern, written) in rules.items():
        text, count = re.subn(pattern, lambda _, written=written: written, (EDITORS / name).read_text(encoding="utf-8"))
        assert count == 1, name
        found[EDITORS / name] = text
    return found


def lines(words: list[str], start: str) -> str:
    """Words in lines that all start alike."""
    found = [start.rstrip()]
    for word in words:
        if len(found[-1]) + 1 + len(word) > 118:
            found.append(start.rstrip())
        found[-1] = f"{found[-1]} {word}" if found[-1].strip() else start + word
    return "\n".join(found)


def builtin_table(names: tuple[str, ...]) -> str:
    rows = ["| builtin | what | derivative | example | value |", "|---|---|---|---|---|"]
    for name in names:
        entry = PRIMITIVES[name]
        arguments = parameters(entry)
        cells = (
            code(f"{name}({', '.join(arguments)})"),
            entry.doc,
            derivatives(entry, arguments),
            *shown(entry.example),
        )
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


def parameters(entry: Primitive) -> tuple[str, ...]:
    return NAMES.get(entry.name) or (("a", "b", "...") if entry.arity is None else ("x",))


def derivatives(entry: Primitive, arguments: tuple[str, ...]) -> str:
    if entry.partials is None:
        return ""
    slopes = entry.partials(*(var(a) for a in arguments if a != "..."))
    return "<br>".join(code(formula(slope)) for slope in slopes)


MEASURE_INTRODUCTION = """## Measures

`integral (x ~ normal(m, s)) body d(x)` is the expectation of the body where x has that distribution. Of a measure of
whole numbers (bernoulli, binomial, poisson, categorical) it is a sum: the chance of each number times the body there.
A jump in such a variable moves nothing, `[k < t]` is a step in t. Of a Poisson variable the numbers that have a chance
below 1e-20 together are left out; its rate and the number of trials of a binomial one must not vary with another
variable of integration, since they say how far the sum goes.

"""


COMPOSITION_INTRODUCTION = """## Measures made of measures

They take measures where these say so, and numbers elsewhere. Truncating divides by the integral of the density between
the bounds, which keeps its digits also far out; a mixture is worked out as the sum of its components, so that each
keeps its own support.

"""


def composition_table() -> str:
    rows = ["| measure | what | example | value |", "|---|---|---|---|"]
    for entry in COMPOSITIONS.values():
        call = code(f"{entry.name}({', '.join(entry.parameters)})")
        rows.append(f"| {' | '.join((call, entry.doc, *shown(entry.example)))} |")
    return "\n".join(rows) + "\n"


def measure_table() -> str:
    rows = ["| measure | what | density | support | valid where | example | value |", "|---|---|---|---|---|---|---|"]
    for name in sorted(MEASURES):
        entry = MEASURES[name]
        terms = tuple(map(var, entry.parameters))
        lo, hi = entry.support(*terms)
        cells = (
            code(f"{name}({', '.join(entry.parameters)})"),
            entry.doc,
            code(formula(entry.density(var("x"), *terms))),
            code(f"[{format_term(lo)}, {format_term(hi)}]"),
            conditions(entry, terms),
            *shown(entry.example),
        )
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


def conditions(entry: Measure, terms: tuple[Term, ...]) -> str:
    return "<br>".join(code(format_term(condition)) for condition, _ in entry.valid(*terms))


def shown(example: str) -> tuple[str, str]:
    """An example and its value to twelve digits."""
    parsed = parse_expression(example)
    assert parsed.expr is not None and not parsed.diagnostics, example
    value = evaluate(elaborate_expression(Database(), "<builtins>", parsed.expr).term, {}, digits=15)
    return code(example), code(re.sub(r"\.0$", "", mpmath.nstr(value, 12)))


def code(text: str) -> str:
    return f"`{text}`".replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    for path, text in grammars().items():
        path.write_text(text, encoding="utf-8")
