"""Hover: what a word means, with its type, its derivative's type, and what the calculus knows of it.

Owns `hover_at`. Parts: definitions and modules here, local names in `local_names`, conditions in `conditions`, formulas
in `derivatives`.
"""

from __future__ import annotations

import inspect
import os.path
import re
from functools import cache

from potto.calculus.explanation.readable import formula
from potto.checking.check import definition_diagnostics
from potto.core.printer import format_equation
from potto.core.simplify import simplify
from potto.core.terms import Branch, Term, var
from potto.ide.hover.conditions import RULE, at_condition, condition_after
from potto.ide.hover.data import data_markdown, part_markdown
from potto.ide.hover.derivatives import (
    code,
    condition_infos,
    derivative_parts,
    derivative_text,
    diffeo_markdown,
    fence,
)
from potto.ide.hover.local_names import local_markdown
from potto.ide.model import Hover
from potto.ide.names.descriptions import definition_head, documentation, module_documentation
from potto.ide.names.keywords import KEYWORDS, SPECIALS, TYPES
from potto.ide.names.places import ChunkAt, chunk_at, owner, word_at
from potto.ide.names.symbols import (
    BuiltinSymbol,
    DefinitionSymbol,
    LocalSymbol,
    MeasureSymbol,
    ModuleSymbol,
    PartSymbol,
    Symbol,
    symbol_at,
)
from potto.measures import COMPOSITIONS, MEASURES, Measure
from potto.measures.composed import Composition
from potto.modules import definition, names
from potto.primitives import PRIMITIVES, Primitive
from potto.query import Database, query
from potto.syntax import nodes
from potto.types import check_definition, format_type, interface
from potto.types.types import holds_functions

_CALL = re.compile(r"\w+\([^()]*\)")  # a formula that can be a factor as it stands
MOST_NAMES = 40  # definitions of a module that a hover lists


def hover_at(db: Database, file: str, offset: int) -> Hover | None:
    """What there is to say about the word, the keyword or the condition at an offset."""
    found = symbol_at(db, file, offset)
    if found is not None and found.symbol is not None:
        return Hover(found.span, symbol_markdown(db, file, found.symbol))
    chunk = chunk_at(db, file, offset)
    if chunk is None:
        return None
    return _at_word(db, chunk, offset) or _at_place(db, chunk, offset)


def symbol_markdown(db: Database, file: str, symbol: Symbol) -> str:
    """What there is to say about a symbol, as seen from a file."""
    match symbol:
        case LocalSymbol():
            return local_markdown(db, symbol)
        case DefinitionSymbol(where, name):
            text = definition_markdown(db, where, name)
            return text if where == file else f"{text}\n\n*{os.path.basename(where)}*"
        case ModuleSymbol(where, dotted):
            return module_markdown(db, where, dotted)
        case BuiltinSymbol(name):
            return builtin_markdown(name)
        case MeasureSymbol(name):
            return measure_markdown(name)
        case PartSymbol():
            return part_markdown(symbol)


@query
def definition_markdown(db: Database, file: str, name: str) -> str:
    """A definition: its types, its comment, and its derivative or its inverse."""
    parts = [fence(definition_head(db, file, name))]
    said = documentation(db, file, name)
    if said:
        parts.append(said)
    found = interface(db, file, name)
    wrong = [d for d in check_definition(db, file, name) if d.severity == "error"]
    if found.broken:
        parts.append("*This definition has errors; the type is what can be read of it.*")
    elif wrong:
        parts.append(f"*This definition has an error:* {wrong[0].message}")
    facts: list[str] = []
    if found.plain:
        facts.append("must not vary: " + ", ".join(code(p) for p in found.plain))
    if facts:
        parts.append("\n".join(facts))
    item = definition(db, file, name)
    if isinstance(item, nodes.DiffeoDefinition):
        known = diffeo_markdown(db, file, name)
        parts.append(known if known is not None else _no_diffeo(db, file, name))
    elif item is not None and (held := data_markdown(db, file, item)):
        parts.append(held)
    elif item is not None and holds_functions(found.type):
        derivative = derivative_text(db, file, name)
        parts += [] if derivative is None else derivative_parts(derivative, condition_infos(db, file, name))
    return "\n\n".join(parts)


def _no_diffeo(db: Database, file: str, name: str) -> str:
    """Why a definition is not a diffeomorphism."""
    wrong = next((d for d in definition_diagnostics(db, file, name) if d.severity == "error"), None)
    if wrong is None:
        return "**no diffeomorphism**"
    return "\n\n".join([f"**no diffeomorphism**: {wrong.message}", *wrong.notes])


@query
def module_markdown(db: Database, file: str, dotted: str) -> str:
    """A module's interface: what it defines, with types."""
    lines = [f"# module {dotted}"]
    defined = names(db, file)
    for name in defined[:MOST_NAMES]:
        lines.append(f"{name} : {format_type(interface(db, file, name).type)}")
    if len(defined) > MOST_NAMES:
        lines.append(f"# and {len(defined) - MOST_NAMES} more")
    said = module_documentation(db, file)
    return fence("\n".join(lines)) + (f"\n\n{said}" if said else "") + f"\n\n*{os.path.basename(file)}*"


# Builtins and measures


@cache
def builtin_markdown(name: str) -> str:
    """A builtin: its type, what it gives, and its derivative rule."""
    special = SPECIALS.get(name)
    if special is not None:
        rule = f"\n\n**derivative** {code(special.derivative)}" if special.derivative else ""
        return f"{fence(f'{name} : {special.type}')}\n\n{special.doc}{rule}\n\nexample: {code(special.example)}"
    primitive = PRIMITIVES[name]
    parts = [fence(builtin_signature(primitive)), primitive.doc]
    if primitive.plain:
        parts.append("**derivative** none: it jumps. It takes plain values only.")
    elif primitive.partials is not None:
        parts.append(f"**derivative** {code(_rule(primitive))}")
        bends = [_equation(kink) for kink in primitive.kinks(*_arguments(primitive))]
        if bends:
            parts.append("bends where " + ", ".join(code(bend) for bend in bends))
    if primitive.example:
        parts.append(f"example: {code(primitive.example)}")
    return "\n\n".join(parts)


def builtin_parameters(primitive: Primitive) -> tuple[str, ...]:
    """Names for the parameters of a builtin, as its entry calls them."""
    count = 2 if primitive.arity is None else primitive.arity
    for function in (primitive.partials, primitive.kinks):
        if function is None:
            continue
        known = [p.name for p in inspect.signature(function).parameters.values() if p.kind is p.POSITIONAL_OR_KEYWORD]
        if len(known) == count:
            return tuple(known)
    return ("x", "y", "z", "w")[:count]


def builtin_signature(primitive: Primitive) -> str:
    """`sin : (x: Real*) -> Real`"""
    return f"{primitive.name} : ({', '.join(typed_parameters(primitive))}) -> Real"


def typed_parameters(primitive: Primitive) -> tuple[str, ...]:
    """`x: Real*`, and `…` behind the last of a builtin that takes any number of arguments."""
    kind = "Real" if primitive.plain else "Real*"
    shown = tuple(f"{name}: {kind}" for name in builtin_parameters(primitive))
    return (*shown, "…") if primitive.arity is None else shown


def _arguments(primitive: Primitive) -> tuple[Term, ...]:
    return tuple(var(name) for name in builtin_parameters(primitive))


def _rule(primitive: Primitive) -> str:
    assert primitive.partials is not None
    arguments = _arguments(primitive)
    parts = []
    for name, partial in zip(builtin_parameters(primitive), primitive.partials(*arguments)):
        text = formula(partial)
        bracket = isinstance(partial, Branch) and text.startswith("[")
        whole = text if bracket or text.isidentifier() or _CALL.fullmatch(text) else f"({text})"
        parts.append(f"d{name}" if text == "1" else f"{whole}*d{name}")
    shown = ", ".join(builtin_parameters(primitive))
    return f"d {primitive.name}({shown}) = {' + '.join(parts)}"


def _equation(kink: Term) -> str:
    return format_equation(simplify(kink))


@cache
def measure_markdown(name: str) -> str:
    """A measure: its parameters, density and moments; of one that is made of measures, how."""
    if name in COMPOSITIONS:
        made = COMPOSITIONS[name]
        return "\n\n".join([fence(f"x ~ {measure_signature(made)}"), made.doc, f"example: {code(made.example)}"])
    measure = MEASURES[name]
    parameters = tuple(var(p) for p in measure.parameters)
    lo, hi = measure.support(*parameters)
    facts = [
        f"- density at x: {code(formula(measure.density(var('x'), *parameters)))}",
        f"- support: {code(f'[{formula(lo)}, {formula(hi)}]')}",
        f"- mean: {_moment(measure.mean, parameters)}",
        f"- variance: {_moment(measure.variance, parameters)}",
    ]
    head = fence(f"x ~ {measure_signature(measure)}")
    return "\n\n".join([head, measure.doc, "\n".join(facts), f"example: {code(measure.example)}"])


def measure_signature(measure: Measure | Composition) -> str:
    """`normal(m, s)`"""
    return f"{measure.name}({', '.join(measure.parameters)})"


def _moment(moment: object, parameters: tuple[Term, ...]) -> str:
    return code(formula(moment(*parameters))) if callable(moment) else "does not exist"


# Where there is no name


def _at_word(db: Database, chunk: ChunkAt, offset: int) -> Hover | None:
    relative = offset - chunk.start
    if relative > len(chunk.text) or _in_comment(db, chunk, relative):
        return None
    place = word_at(chunk.text, relative)
    word = chunk.text[place.start : place.end]
    keyword = KEYWORDS.get(word)
    if word in TYPES:
        return Hover(chunk.absolute(place), f"{fence(word)}\n\n{TYPES[word]}")
    if keyword is None:
        return None
    parts = [f"{fence(keyword.form)}\n\n{keyword.doc}"]
    name = owner(db, chunk)
    if word == "integral" and name is not None:
        derivative = derivative_text(db, chunk.file, name)
        if derivative is not None and derivative.integrals:
            parts.insert(0, "\n\n".join(derivative_parts(derivative)))
    elif word in ("if", "then", "else", "diffeo", "and", "or", "not") and name is not None:
        condition = at_condition(db, chunk, name, relative) or condition_after(db, chunk, name, relative)
        if condition is not None:
            parts.insert(0, condition.markdown)
    return Hover(chunk.absolute(place), RULE.join(parts))


def _at_place(db: Database, chunk: ChunkAt, offset: int) -> Hover | None:
    name, relative = owner(db, chunk), offset - chunk.start
    return None if name is None or _in_comment(db, chunk, relative) else at_condition(db, chunk, name, relative)


def _in_comment(db: Database, chunk: ChunkAt, relative: int) -> bool:
    return any(c.span.start < relative <= c.span.end for c in chunk.parsed(db).comments)
