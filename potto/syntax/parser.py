"""Text to syntax trees.

Owns `parse_chunk`, `parse_expression` and `completeness`. Every text gives a tree: mistakes are diagnostics beside it,
and holes or `ErrorExpr`s in it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Literal

from msgspec import Struct

from potto.diagnostics import Diagnostic
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.automaton import Automaton
from potto.syntax.chunks import split
from potto.syntax.consequences import Reported, only, without_consequences
from potto.syntax.foreign_integrals import foreign_integral
from potto.syntax.foreign_records import declared_elsewhere, in_braces
from potto.syntax.groups import Context
from potto.syntax.habits import foreign_statement, habit
from potto.syntax.lexer import MAX_LENGTH, Lexed, lex
from potto.syntax.nesting import MAX_NESTING
from potto.syntax.nodes import BrokenItem, Definition, ErrorExpr, Expr, Item
from potto.syntax.repair import RepairStep, find_repair
from potto.syntax.stops import Stop
from potto.syntax.tokens import FIRST_NAME, RESERVED, Comment, Token
from potto.syntax.walk import deeper_than, extent

MOST_ERRORS = 16
"""Errors of one chunk that are repaired one by one; beyond them its body is given up."""

LONG = 20_000
"""Tokens beyond which a chunk is not read again to find a better repair."""


class ParsedChunk(Struct, frozen=True):
    """The item of a chunk (None if it has only comments), with spans and diagnostics relative to the chunk."""

    item: Item | None
    diagnostics: tuple[Diagnostic, ...]
    comments: tuple[Comment, ...]


class ParsedExpression(Struct, frozen=True):
    """An expression by itself."""

    expr: Expr
    diagnostics: tuple[Diagnostic, ...]


@dataclass(eq=False, repr=False, slots=True)
class _Parse:
    """What came of a chunk's tokens, with the repairs made in them. `value` is None where it had to be given up."""

    value: Any
    tokens: list[Token]
    diagnostics: list[Diagnostic]
    first_stop: Stop | None
    stops: list[Diagnostic]


def parse_chunk(text: str, diffeo: bool = False) -> ParsedChunk:
    """Parse one chunk of a file; `diffeo`: of a `.diffeo` file."""
    if len(text) > MAX_LENGTH:
        return ParsedChunk(BrokenItem(Span(0, len(text)), guess_name(text)), (_too_long(text),), ())
    lexed = lex(text, diffeo)
    comments = tuple(lexed.comments)
    if len(lexed.tokens) <= 1 and not lexed.too_deep:
        return ParsedChunk(None, tuple(lexed.diagnostics), comments)
    item, diagnostics = None, lexed.diagnostics
    if not lexed.too_deep:
        item, diagnostics = _bounded(_parse(lexed, text, "chunk", diffeo))
    foreign = _foreign(text, lexed.tokens) if diagnostics else None
    if foreign is not None:
        item, diagnostics = BrokenItem(Span(0, len(text)), foreign[0]), [foreign[1]]
    elsewhere = _elsewhere(text, lexed.tokens, diagnostics) if foreign is None else None
    if elsewhere is not None:
        item, diagnostics = None, only(elsewhere, diagnostics)
    diagnostics = without_consequences(diagnostics)
    if item is None:
        item = _salvage(text, lexed.tokens, diffeo)
    return ParsedChunk(item, _sorted(diagnostics), comments)


def _foreign(text: str, tokens: list[Token]) -> tuple[str | None, Diagnostic] | None:
    """What is said of a chunk that is one of another language as a whole, and the name that it defines."""
    said = foreign_statement(tokens)
    return declared_elsewhere(text, tokens) if said is None else (None, said)


def _elsewhere(text: str, tokens: list[Token], found: list[Diagnostic]) -> Diagnostic | None:
    """What is said of text with errors that is right in another language."""
    return (foreign_integral(text, tokens, found) or in_braces(text, found)) if found else None


def parse_expression(text: str) -> ParsedExpression:
    """Parse a single expression."""
    broken = ErrorExpr(Span(0, len(text)), text[:200])
    if len(text) > MAX_LENGTH:
        return ParsedExpression(broken, (_too_long(text),))
    lexed = lex(text, alone=True)
    expr, diagnostics = None, lexed.diagnostics
    if not lexed.too_deep:
        expr, diagnostics = _bounded(_parse(lexed, text, "expression"))
    elsewhere = _elsewhere(text, lexed.tokens, diagnostics)
    if elsewhere is not None:
        expr, diagnostics = None, only(elsewhere, diagnostics)
    return ParsedExpression(expr if expr is not None else broken, _sorted(without_consequences(diagnostics)))


def completeness(text: str, diffeo: bool = False) -> Literal["complete", "incomplete", "wrong"]:
    """Whether a prompt can take the text: `incomplete` if only more lines could make it right."""
    chunks = split(text)
    for chunk in chunks[:-1]:
        if any(diagnostic.severity == "error" for diagnostic in parse_chunk(chunk.text, diffeo).diagnostics):
            return "wrong"
    return _completeness(chunks[-1].text, diffeo) if chunks else "complete"


def _completeness(text: str, diffeo: bool) -> Literal["complete", "incomplete", "wrong"]:
    if len(text) > MAX_LENGTH:
        return "wrong"
    lexed = lex(text, diffeo)
    if len(lexed.tokens) <= 1:
        return "wrong" if lexed.diagnostics else "complete"
    parse = _parse(lexed, text, "chunk", diffeo)
    if parse.first_stop is not None and not parse.first_stop.ended:
        return "wrong"
    end = lexed.tokens[-1].end
    unfinished = [diagnostic in parse.stops or _goes_on(diagnostic, end) for diagnostic in parse.diagnostics]
    if not all(unfinished):
        return "wrong"
    return "incomplete" if unfinished else "complete"


def _goes_on(diagnostic: Diagnostic, end: int) -> bool:
    """Whether more lines could do away with a message: what it misses is missing at the very end."""
    if diagnostic.code in (kinds.LAST_LINE.code, kinds.UNFINISHED.code):
        return diagnostic.span.end == end
    return bool(diagnostic.related) and diagnostic.related[0].span.start == end


def _too_long(text: str) -> Diagnostic:
    shown = text.find("\n")
    place = Span(0, min(shown if shown >= 0 else len(text), 80))
    message = f"this definition is too long: {len(text):,} characters, and the most is {MAX_LENGTH:,}"
    return kinds.TOO_DEEP(place, message, help="is this a Potto program? If so, cut it into several definitions")


def _sorted(diagnostics: list[Diagnostic]) -> tuple[Diagnostic, ...]:
    return tuple(sorted(diagnostics, key=lambda diagnostic: diagnostic.span.start))


def _parse(lexed: Lexed, text: str, start: str, diffeo: bool = False) -> _Parse:
    """Run the automaton to the end, repairing as it goes; None as value if it had to give up."""
    tokens, told = lexed.tokens, Reported(lexed.diagnostics, len(text))
    automaton = Automaton(Context(text, diffeo), start)
    index = automaton.run(tokens, 0)
    first_stop: Stop | None = None
    for _ in range(MOST_ERRORS):
        if index >= len(tokens):
            return _Parse(
                automaton.result, tokens, told.and_of_trees(automaton.context.diagnostics), first_stop, told.stops
            )
        stop, automaton, edits = _stopped(automaton, tokens, index, Context(text, diffeo))
        first_stop = first_stop or stop
        foreign = habit(stop)
        if foreign is not None:
            return _Parse(None, tokens, told.and_foreign(foreign, stop), first_stop, told.stops)
        told.stopped(stop, edits or [])
        if edits is None:
            break
        tokens = _patched(tokens, stop.index, edits)
        index = automaton.run(tokens, stop.index)
    return _Parse(None, tokens, told.all, first_stop, told.stops)


def _stopped(
    automaton: Automaton, tokens: list[Token], index: int, context: Context
) -> tuple[Stop, Automaton, list[RepairStep] | None]:
    """A stop at `index`, with an automaton that stands where its repair begins."""
    text = context.text
    if len(tokens) > LONG or index == 0:
        edits = find_repair(automaton.tables, automaton.end, tokens, index, automaton.states, None)
        return Stop(automaton.values[:], automaton.possible(), tokens, index, text), automaton, edits
    # The token without an action has already led to reductions, after which less can follow than before. Read again, up
    # to where it had not been seen; and note the state before the word ahead of it, which may be what is wrong.
    again = Automaton(context, automaton.start)
    again.run(tokens[: index - 1], 0)
    behind = Stop(again.values[:], again.possible(), tokens, index - 1, text)
    states = again.states[:]
    again.run(tokens[:index], index - 1)
    edits = find_repair(again.tables, again.end, tokens, index, again.states, states)
    if not edits or not edits[0].back:
        return Stop(again.values[:], again.possible(), tokens, index, text), again, edits
    before = Automaton(context, automaton.start)
    context.diagnostics.clear()
    before.run(tokens[: index - 1], 0)
    return behind, before, edits


def _patched(tokens: list[Token], index: int, edits: list[RepairStep]) -> list[Token]:
    """The tokens with a repair at `index` made in them."""
    out = tokens[:index]
    for edit in edits:
        token = tokens[index]
        if edit.action == "insert":
            at = out[-1].end if out else token.start
            out.append(Token(edit.kind, "+" if edit.kind == "BINOP" else "", at, at))
            if edit.kind == "LPAR":
                out.append(Token("RPAR", "", at, at))
            continue
        index += 1
        if edit.action == "replace":
            out.append(token._replace(kind=edit.kind, text="==" if edit.kind == "BINOP" else token.text))
        elif edit.action == "shift":
            out.append(token)
    return out + tokens[index:]


def _bounded(parse: _Parse) -> tuple[Any, list[Diagnostic]]:
    """The value of a parse, unless it is nested more deeply than those who read trees can bear."""
    value, found = parse.value, parse.diagnostics
    if value is None or len(parse.tokens) <= MAX_NESTING:
        return value, found
    deep = deeper_than(value, MAX_NESTING)
    if deep is None:
        return value, found
    message = kinds.TOO_DEEP(extent(deep), "this is nested too deeply", help="name the inner parts with `let`")
    return None, [*found, message]


def _salvage(text: str, tokens: list[Token], diffeo: bool) -> Item:
    """What can be kept of a chunk that could not be parsed: a definition's head and name, with a hole for its body."""
    end = len(text)
    hole = ErrorExpr(Span(end, end), "")
    name = guess_name(text)
    if name is None:
        return BrokenItem(Span(0, end), None)
    if len(tokens) > 1 and tokens[0].kind == "NAME" and tokens[1].kind == "EQ" and not diffeo:
        return Definition(Span(tokens[0].start, end), name, tokens[0].span, (), None, (), hole, False)
    head = _head(tokens)
    if head:
        automaton = Automaton(Context(text, diffeo), "chunk")
        tail = [Token("NAME", "", end, end), Token("$END", "", end, end)]
        if automaton.run(head + tail, 0) == len(head) + 2 and isinstance(automaton.result, Definition):
            return automaton.result
    return BrokenItem(Span(0, end), name)


def _head(tokens: list[Token]) -> list[Token]:
    """`def name` and its groups of parameters."""
    if len(tokens) < 3 or tokens[0].kind != "DEF":
        return []
    depth, end = 0, 2
    for index in range(2, len(tokens)):
        kind = tokens[index].kind
        if depth == 0 and kind != "LPAR":
            break
        depth += {"LPAR": 1, "RPAR": -1}.get(kind, 0)
        if depth == 0:
            end = index + 1
    return tokens[:end]


_HEAD = re.compile(
    rf"(?:[ \t\f]*(?:\#[^\n]*)?\n)*+\f*(?:def[ \t]+({FIRST_NAME.pattern})[ \t]*\(|({FIRST_NAME.pattern})[ \t]*=(?!=))"
)


def defined_name(text: str) -> tuple[str, Span] | None:
    """The name that a chunk defines and its place, if its first line says so beyond doubt: without parsing it."""
    found = None if "\r" in text else _HEAD.match(text)
    if found is None or found.lastindex is None:
        return None
    name = found[found.lastindex]
    return None if name in RESERVED else (name, Span(*found.span(found.lastindex)))


def guess_name(text: str) -> str | None:
    """What a chunk was to define, if its start says so."""
    found = re.match(
        rf"(?:\s|#[^\n]*\n)*(?:(?:def|diffeo)[ \t]+({FIRST_NAME.pattern})|({FIRST_NAME.pattern})\s*[=:(])", text
    )
    if found is None:
        return None
    name = found.group(1) or found.group(2)
    return name if name not in RESERVED else None
