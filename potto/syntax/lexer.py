"""Text of one chunk to tokens, with its layout.

Owns `lex`. It settles what a context-free grammar can't: which line starts a statement and which continues one, which
`d(` ends an integral, where the body of a `sum` begins, where a `let` goes on to its next binding, where a bracket that
is never closed must have ended. Every later stage works on the tokens alone.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from potto.diagnostics import Diagnostic, Related
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.head import BlockTracker
from potto.syntax.sums import mark_bodies
from potto.syntax.tokens import (
    FIRST_NAME,
    KEYWORDS,
    MASTER,
    NUMBER_PREFIX,
    OPERATORS,
    Comment,
    Token,
    normalized,
)
from potto.syntax.unknown import foreign_operator, no_return, string_literal, unknown_character

_new = tuple.__new__  # a token without the detour over NamedTuple's own `__new__`, which costs as much again
MAX_NESTING = 200
MAX_LENGTH = 1_000_000
_CLOSER = {"LPAR": "RPAR", "LSQB": "RSQB"}
_CHARACTER = {"LPAR": "(", "RPAR": ")", "LSQB": "[", "RSQB": "]"}
_BINDING = re.compile(rf"(?:{FIRST_NAME.pattern}|\([^()\n]*\))[ \t]*=(?!=)")
_D = re.compile(r"[ \t]*\(")
_BOUNDS = re.compile(r"[ \t\n]*[\[(]")
_RETURNED = re.compile(r"[ \t]+[^\s=]")
_CONTINUES = re.compile(r"(?:then|else|in|and|or)\b|[*/^?:,)\].=<>≤≥≠+]|!=|->")
_CLAUSE = re.compile(r"(?:inverse|where)\b")
_LINE = re.compile(r"([ \t\f\v]*)([^\n]?)")


@dataclass(slots=True)
class Lexed:
    """What `lex` found: tokens (the last is `$END`), comments, diagnostics."""

    tokens: list[Token]
    comments: list[Comment]
    diagnostics: list[Diagnostic]
    too_deep: bool = False
    never_closed: frozenset[int] = frozenset()


@dataclass(slots=True)
class _Open:
    """A bracket, `let`, `sum` or `integral` that is still open, at a depth of brackets."""

    kind: str
    start: int
    depth: int


@dataclass(slots=True)
class _Lexer:
    text: str
    diffeo: bool
    unclosed: frozenset[int] = frozenset()
    tokens: list[Token] = field(default_factory=list)
    comments: list[Comment] = field(default_factory=list)
    diagnostics: list[Diagnostic] = field(default_factory=list)
    brackets: list[_Open] = field(default_factory=list)
    openers: list[_Open] = field(default_factory=list)
    blocks: BlockTracker = field(default_factory=BlockTracker)
    line_indents: dict[int, int] = field(default_factory=dict)
    indent: int = 0
    tabs: bool | None = None
    has_sum: bool = False
    clauses: bool = False
    too_deep: bool = False
    never_closed: set[int] = field(default_factory=set)

    def run(self) -> None:
        text, match, position, add = self.text, MASTER.match, 0, self.tokens.append
        position = self._first_line()
        while True:
            found = match(text, position)
            assert found is not None, "the pattern matches every character"
            kind = found.lastgroup
            start, position = found.span(found.lastindex or 0)
            word = text[start:position]
            if kind == "NAME":
                position = self._name(word, start, position)
            elif kind == "OPERATOR":
                self._operator(word, start, position)
                if self.too_deep:
                    return
            elif kind == "NUMBER":
                add(_new(Token, ("NUMBER", word, start, position)))
                if not self.brackets and self.blocks.state != "body":
                    self.blocks.see(self.tokens[-1])
            elif kind == "NEWLINE":
                position = self._newline(start)
            elif kind == "COMMENT":
                self.comments.append(Comment(Span(start, position), word, False))
            elif kind == "END":
                self._end(start)
                return
            else:
                position = self._odd(str(kind), word, start, position)

    # Words

    def _name(self, word: str, start: int, end: int) -> int:
        """A name, a keyword or a member; gives where to go on."""
        tokens = self.tokens
        if "." in word and ((tokens and tokens[-1].kind == "LAMBDA") or word.partition(".")[0] in KEYWORDS):
            # In `\x.x` the dot is the lambda's.
            word = word.partition(".")[0]
            end = start + len(word)
        kind = KEYWORDS.get(word)
        if kind is None:
            kind = "MEMBER" if "." in word else "NAME"
            if word == "return" and self._returns(end):
                self.diagnostics.append(no_return(Span(start, end)))
                return end
            if word == "d" and self.openers and _D.match(self.text, end) and self._close_integral():
                kind = "D"
            elif self.clauses and not self.brackets and word in ("inverse", "where"):
                kind = word.upper()
        elif kind in ("LET", "SUM", "INTEGRAL"):
            self.openers.append(_Open(kind, start, len(self.brackets)))
            self.has_sum = self.has_sum or kind == "SUM"
        elif kind == "IN":
            self._close_in()
        elif kind == "DIFFEO" and not tokens and re.match(rf"[ \t]+{FIRST_NAME.pattern}", self.text[end : end + 200]):
            kind, self.clauses = "DIFFEODEF", True
        token = _new(Token, (kind, word, start, end))
        tokens.append(token)
        if not self.brackets and self.blocks.state != "body":
            self.blocks.see(token)
        if kind == "INTEGRAL":
            self._expect_bounds(word, start, end)
        return end

    def _returns(self, end: int) -> bool:
        """Whether `return` starts a line or a body, as it does in other languages."""
        return not self.brackets and self.blocks.state != "body" and _RETURNED.match(self.text, end) is not None

    def _expect_bounds(self, word: str, start: int, end: int) -> None:
        """Where no bracket follows `integral`, its bounds are missing."""
        if _BOUNDS.match(self.text, end):
            return
        self.diagnostics.append(
            kinds.UNFINISHED(
                Span(start, end), f"expected the bounds after `{word}`", help="write `integral [lo, hi] body d(x)`"
            )
        )
        self.tokens.append(Token("NOBOUNDS", "", end, end))

    def _close_integral(self) -> bool:
        """Close the innermost integral that is open at this depth of brackets, if there is one."""
        depth = len(self.brackets)
        for index in range(len(self.openers) - 1, -1, -1):
            opener = self.openers[index]
            if opener.depth != depth:
                return False
            if opener.kind == "INTEGRAL":
                del self.openers[index:]
                return True
        return False

    def _close_in(self) -> None:
        """`in` belongs to the innermost `let` or `sum` at this depth."""
        if self.openers and self.openers[-1].kind != "INTEGRAL" and self.openers[-1].depth == len(self.brackets):
            self.openers.pop()

    def _operator(self, word: str, start: int, end: int) -> None:
        kind = OPERATORS.get(word)
        if kind is None:
            word, diagnostic = foreign_operator(word, Span(start, end))
            self.diagnostics.append(diagnostic)
            kind = "BINOP"
        if kind in ("LPAR", "LSQB"):
            self._open_bracket(kind, word, start, end)
            return
        if kind in ("RPAR", "RSQB"):
            self._close_bracket(kind, word, start, end)
            return
        if kind == "COMMA":
            self._unfinished_integrals(start, len(self.brackets))
        elif word == "∫":
            self.openers.append(_Open(kind, start, len(self.brackets)))
        token = _new(Token, (kind, word, start, end))
        self.tokens.append(token)
        if not self.brackets and self.blocks.state != "body":
            self.blocks.see(token)
        if kind == "INTEGRAL":
            self._expect_bounds(word, start, end)

    def _odd(self, kind: str, word: str, start: int, end: int) -> int:
        """What is no word of the language; gives where to go on."""
        if kind == "BADNUMBER":
            self._bad_number(word, start, end)
        elif kind == "STRING":
            self.diagnostics.append(string_literal(word, Span(start, end)))
            self.tokens.append(Token("NAME", "", start, end))
        else:
            end, diagnostic = unknown_character(self.text, start)
            if diagnostic is not None and len(self.diagnostics) < 20:
                self.diagnostics.append(diagnostic)
        return end

    def _bad_number(self, word: str, start: int, end: int) -> None:
        prefix = NUMBER_PREFIX.match(word)
        good = prefix.group() if prefix else "0"
        tail = word[len(good) :]
        if FIRST_NAME.fullmatch(tail) and not good.startswith("0x"):
            help = f"to multiply, write `{good}*{tail}`"
        else:
            help = "write numbers like `2`, `0.5` or `1e-3`"
        self.diagnostics.append(kinds.BAD_NUMBER(Span(start, end), f"`{word}` is not a number", help=help))
        self.tokens.append(Token("NUMBER", good, start, end))

    # Brackets

    def _open_bracket(self, kind: str, word: str, start: int, end: int) -> None:
        if len(self.brackets) >= MAX_NESTING:
            self.diagnostics.append(
                kinds.TOO_DEEP(Span(start, end), "this is nested too deeply", help="name the inner parts with `let`")
            )
            self.too_deep = True
            return
        if not self.brackets:
            if kind == "LPAR" and self.blocks.separates(self.tokens, start):
                self.tokens.append(Token("COLON", "", start, start))
            self.blocks.see(Token(kind, word, start, end))
        self.line_indents.setdefault(start, self.indent)
        self.brackets.append(_Open(kind, start, 0))
        self.tokens.append(Token(kind, word, start, end))

    def _close_bracket(self, kind: str, word: str, start: int, end: int) -> None:
        if not self.brackets:
            self.diagnostics.append(
                kinds.BRACKETS(Span(start, end), f"this `{word}` closes nothing", help=f"take the `{word}` out")
            )
            return
        opener = self.brackets[-1]
        if _CLOSER[opener.kind] != kind:
            if any(_CLOSER[bracket.kind] == kind for bracket in self.brackets):
                # Something further out is meant: what is open inside it was never closed.
                while _CLOSER[self.brackets[-1].kind] != kind:
                    self._virtual_closer(start)
                self._close_bracket(kind, word, start, end)
                return
            place = Related(Span(opener.start, opener.start + 1), "opened here")
            wanted = _CHARACTER[_CLOSER[opener.kind]]
            self.diagnostics.append(
                kinds.BRACKETS(
                    Span(start, end),
                    f"this `{word}` does not close the `{_CHARACTER[opener.kind]}`",
                    related=(place,),
                    help=f"write `{wanted}`",
                )
            )
            kind = _CLOSER[opener.kind]
        self._pop_bracket(start)
        self.tokens.append(Token(kind, word, start, end))

    def _pop_bracket(self, at: int) -> None:
        self._unfinished_integrals(at, len(self.brackets))
        self.openers = [opener for opener in self.openers if opener.depth < len(self.brackets)]
        self.brackets.pop()

    def _virtual_closer(self, at: int) -> None:
        """Close the innermost bracket here, since the text never does."""
        opener = self.brackets[-1]
        character = _CHARACTER[opener.kind]
        last = self.tokens[-1].end
        self.never_closed.add(opener.start)
        self._pop_bracket(last)
        self.diagnostics.append(
            kinds.BRACKETS(
                Span(opener.start, opener.start + 1),
                f"this `{character}` is never closed",
                related=(
                    Related(Span(last, max(last, at)), f"a `{_CHARACTER[_CLOSER[opener.kind]]}` is missing here"),
                ),
                help=f"write `{_CHARACTER[_CLOSER[opener.kind]]}`",
            )
        )
        self.tokens.append(Token(_CLOSER[opener.kind], "", last, last))

    def _unfinished_integrals(self, at: int, depth: int) -> None:
        """Where integrals at this depth can't go on: give those that have no `d(...)` an empty one."""
        openers = self.openers
        if not openers:
            return
        last = self.tokens[-1].end
        while openers and openers[-1].depth == depth:
            opener = openers.pop()
            if opener.kind == "INTEGRAL":
                self._missing_differential(opener, last)

    def _missing_differential(self, opener: _Open, last: int) -> None:
        word = "∫" if self.text[opener.start] == "∫" else "integral"
        place = Span(opener.start, opener.start + len(word))
        self.diagnostics.append(
            kinds.NO_DIFFERENTIAL(
                place,
                f"this `{word}` has no `d(...)`",
                label="which variables does it integrate over?",
                related=(Related(Span(last, last), "the integral ends here"),),
                help="end the integral with its variables: `d(x)`",
            )
        )
        self.tokens += [Token("D", "", last, last), Token("LPAR", "", last, last), Token("RPAR", "", last, last)]

    # Lines

    def _first_line(self) -> int:
        """Skip comments and blank lines before the first word, and take the indentation of the first word's line."""
        return self._skip_lines(0, first=True)

    def _skip_lines(self, position: int, first: bool = False) -> int:
        """From the start of a line to the first line that has code, gathering comments; sets `indent`."""
        text = self.text
        while True:
            found = _LINE.match(text, position)
            assert found is not None
            blanks, char = found.group(1), found.group(2)
            at = found.end(1)
            if char == "#":
                end = text.find("\n", at)
                end = len(text) if end < 0 else end
                self.comments.append(Comment(Span(at, end), text[at:end], True))
                at = end
            elif char:
                self._set_indent(blanks, position, at, first)
                return at
            if at >= len(text):
                return at
            position = at + 1

    def _set_indent(self, blanks: str, line: int, at: int, first: bool) -> None:
        blanks = blanks.rpartition("\f")[2]
        self.indent = len(blanks.expandtabs(8))
        if first and self.indent:
            self.diagnostics.append(
                kinds.INDENTATION(
                    Span(line, at),
                    "this line is indented, but nothing above it goes on here",
                    help="start a definition or a statement in the first column",
                )
            )
            self.indent = 0
        if not blanks or self.brackets:
            return
        tabs = "\t" in blanks
        if (self.tabs is not None and tabs != self.tabs) or (tabs and " " in blanks):
            if not any(diagnostic.code == kinds.INDENTATION.code for diagnostic in self.diagnostics):
                self.diagnostics.append(
                    kinds.INDENTATION(Span(line, at), "tabs and blanks are mixed in the indentation", help="use blanks")
                )
        self.tabs = tabs if self.tabs is None else self.tabs

    def _newline(self, at: int) -> int:
        """The end of a line: decides what the next line with code is; gives where that starts."""
        position = self._skip_lines(at + 1)
        if position >= len(self.text):
            return position
        while self.brackets and self._ends_bracket():
            self._virtual_closer(at)
        if self.brackets or not self._layout(position):
            self._next_binding(position)
        return position

    def _ends_bracket(self) -> bool:
        opener = self.brackets[-1].start
        return opener in self.unclosed and self.indent <= self.line_indents[opener]

    def _next_binding(self, position: int) -> None:
        """Within a `let`, a line that starts a binding is set off from the one before."""
        if not self.openers or not self.tokens:
            return
        opener = self.openers[-1]
        if opener.kind == "LET" and opener.depth == len(self.brackets) and _BINDING.match(self.text, position):
            if self.tokens[-1].kind not in ("LET", "SEMI"):
                self.tokens.append(Token("SEMI", "", position, position))

    def _layout(self, position: int) -> bool:
        """Emit INDENT, DEDENT and NEWLINE before the line at `position`; False if it continues the one before."""
        text, blocks, tokens = self.text, self.blocks, self.tokens
        if not tokens:
            return True
        if blocks.opens(self.indent, text.startswith("->", position)):
            tokens.append(Token("INDENT", "", position, position))
            return True
        if not blocks.indents or self.indent > blocks.indents[-1]:
            return False
        if self.indent == blocks.indents[-1] and self._continues(position):
            return False
        self._unfinished_integrals(position, 0)
        last = tokens[-1].end
        while len(blocks.indents) > 1 and self.indent < blocks.indents[-1]:
            blocks.indents.pop()
            tokens.append(Token("DEDENT", "", last, last))
        if self.indent != blocks.indents[-1]:
            line = text.rfind("\n", 0, position) + 1
            self.diagnostics.append(
                kinds.INDENTATION(
                    Span(line, position),
                    "this line is indented like no line above it",
                    help="indent the lines of a block alike; indent what continues a line more",
                )
            )
        tokens.append(Token("NEWLINE", "", position, position))
        blocks.new_line()
        return True

    def _continues(self, position: int) -> bool:
        if _CONTINUES.match(self.text, position):
            return True
        if self.clauses and _CLAUSE.match(self.text, position):
            return True
        if self.text.startswith("d", position) and _D.match(self.text, position + 1):
            return any(opener.kind == "INTEGRAL" for opener in self.openers)
        return False

    def _end(self, at: int) -> None:
        last = self.tokens[-1].end if self.tokens else at
        while self.brackets:
            self._virtual_closer(last)
        self._unfinished_integrals(last, 0)
        self.tokens += [Token("DEDENT", "", last, last) for _ in self.blocks.indents]
        if self.has_sum:
            self.tokens = mark_bodies(self.tokens)
        self.tokens.append(Token("$END", "", last, last))


def lex(text: str, diffeo: bool = False) -> Lexed:
    """The tokens of a chunk; what can't be read is a diagnostic, and left out or mended."""
    text = normalized(text)
    lexer = _Lexer(text, diffeo, clauses=diffeo)
    lexer.run()
    if lexer.never_closed and "\n" in text and not lexer.too_deep:
        # Read again, knowing which brackets have no end: they end where the indentation says that they must have.
        lexer = _Lexer(text, diffeo, frozenset(lexer.never_closed), clauses=diffeo)
        lexer.run()
    never_closed = frozenset(lexer.never_closed)
    return Lexed(lexer.tokens, lexer.comments, lexer.diagnostics, lexer.too_deep, never_closed)
