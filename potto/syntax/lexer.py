"""Text of one chunk to tokens, with its layout.

Owns `lex`. It settles what a context-free grammar can't: which line starts a statement and which continues one, which
`d(` ends an integral, where the body of a `sum` begins, where a `let` goes on to its next binding, where a bracket that
is never closed must have ended. Every later stage works on the tokens alone.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from msgspec import Struct

from potto.diagnostics import Diagnostic
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.contextual import BEHIND, ENDS_OPERAND, MAY_BE_WORDS, SIMPLE_OPERATORS, contextual, uses_parameters
from potto.syntax.head import BlockTracker
from potto.syntax.nesting import Nesting
from potto.syntax.sum_bodies import mark_bodies
from potto.syntax.tokens import FIRST_NAME, KEYWORDS, MASTER, NUMBER_PREFIX, OPERATORS, Comment, Token, normalized
from potto.syntax.unknown import (
    bad_number,
    foreign_arithmetic,
    foreign_comment,
    foreign_operator,
    no_return,
    reserved_word,
    string_literal,
    unknown_character,
)

MAX_LENGTH = 250_000
_new = tuple.__new__  # a token without the detour over NamedTuple's own `__new__`, which costs as much again
_BINDING = re.compile(rf"(?:{FIRST_NAME.pattern}|\([^()\n]*\))[ \t]*=(?!=)")
_D = re.compile(r"[ \t]*\(")
_BOUNDS = re.compile(r"[ \t\n]*[\[(]")
_RETURNED = re.compile(r"[ \t]+[^\s=]")
_DEFINES = re.compile(rf"[ \t]+{FIRST_NAME.pattern}")
_CONTINUES = re.compile(r"(?:then|else|in|and|or)\b|[*/^?:,)\].=<>≤≥≠+]|!=|->")
_UNFINISHED = frozenset({"BINOP", "SIGN", "STAR", "QMARK", "NOT"})  # behind them an operand is still to come
_CLAUSE = re.compile(r"(?:inverse|where)\b(?![ \t]*=(?!=))")
_LINE = re.compile(r"([ \t\f\v]*)([^\n]?)")
_FIELD = re.compile(rf"\.(?:{FIRST_NAME.pattern}|[0-9]+)")
_ALSO = re.compile(rf"[ \t\n]*{FIRST_NAME.pattern}[ \t\n]+in\b")


class Lexed(Struct, frozen=True):
    """What `lex` found: tokens (the last is `$END`), comments, diagnostics; which brackets are never closed."""

    tokens: list[Token]
    comments: list[Comment]
    diagnostics: list[Diagnostic]
    too_deep: bool
    never_closed: frozenset[int]


@dataclass(eq=False, repr=False, slots=True)
class _Lexer:
    text: str
    clauses: bool
    """Whether `inverse` and `where` are words here."""
    alone: bool
    """Whether this is an expression by itself, which may be indented."""
    nesting: Nesting
    tokens: list[Token]
    comments: list[Comment] = field(default_factory=list)
    blocks: BlockTracker = field(default_factory=BlockTracker)
    indent: int = 0
    tabs: bool | None = None
    has_sum: bool = False
    let_in: int = -1
    """Where the last `in` of a `let` stands."""
    head_start: int = -1
    head_end: int = -1
    """Where the parameters of a lambda stand that were read last: the dot behind them is the lambda's."""
    head_dot: int = -1
    """Where that dot stands."""
    heads: set[int] = field(default_factory=set)
    """Where parentheses begin that may be parameters of a lambda."""
    too_deep: bool = False

    def run(self) -> None:
        text, match, tokens = self.text, MASTER.match, self.tokens
        brackets, blocks = self.nesting.brackets, self.blocks
        position = self._skip_lines(0, first=not self.alone)
        while not self.too_deep:
            found = match(text, position)
            assert found is not None, "the pattern matches every character"
            kind = found.lastgroup
            start, position = found.span(found.lastindex or 0)
            word = text[start:position]
            if kind == "NAME" and (word in MAY_BE_WORDS or "." in word or self.clauses):
                position = self._name(word, start, position)
            elif kind == "OPERATOR" and word not in SIMPLE_OPERATORS:
                position = self._operator(word, start, position)
            elif kind == "NAME" or kind == "OPERATOR":
                self._add(SIMPLE_OPERATORS.get(word, "NAME"), word, start, position)
            elif kind == "NUMBER":
                tokens.append(_new(Token, ("NUMBER", word, start, position)))
                if not brackets and blocks.state != "body":
                    blocks.see(tokens[-1])
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
        tokens, nesting = self.tokens, self.nesting
        if "." in word and ((tokens and tokens[-1].kind == "LAMBDA") or word.partition(".")[0] in KEYWORDS):
            # In `\x.x` the dot is the lambda's.
            word = word.partition(".")[0]
            end = start + len(word)
        kind = KEYWORDS.get(word) or contextual(tokens, word, self.text, end)
        if kind is not None and len(tokens) == 1 and tokens[0].kind == "DEF":
            nesting.report(reserved_word(word, Span(start, end)))
            kind = "NAME"
        elif kind is None:
            kind = "MEMBER" if "." in word else "NAME"
            if word == "return" and self._returns(end):
                nesting.report(no_return(self.text, Span(start, end)))
                return end
            if word == "d" and nesting.words and _D.match(self.text, end) and nesting.close_integral(start):
                kind = "D"
            elif self.clauses and self._starts_clause(start):
                kind = word.upper()
        elif kind in ("LET", "SUM", "FOR", "INTEGRAL"):
            nesting.open_word(kind, start)
            self.has_sum = self.has_sum or kind == "SUM"
        elif kind == "FOLD":
            self.has_sum = True
        elif kind == "IN":
            if nesting.close_in():
                self.let_in = start
        elif kind == "DIFFEO" and not tokens and _DEFINES.match(self.text, end):
            kind, self.clauses = "DIFFEODEF", True
        self._add(kind, word, start, end)
        return end

    def _starts_clause(self, start: int) -> bool:
        """Whether `inverse` or `where` stands after the components of a diffeomorphism; elsewhere they are names."""
        tokens = self.tokens
        return (
            not self.nesting.brackets
            and _CLAUSE.match(self.text, start) is not None
            and len(tokens) > 2
            and tokens[-1].kind in ENDS_OPERAND
            and (tokens[1].kind == "EQ" or self.blocks.state not in ("diffeo", "start"))
        )

    def _add(self, kind: str, word: str, start: int, end: int) -> None:
        token = _new(Token, (kind, word, start, end))
        self.tokens.append(token)
        if self.blocks.state != "body" and not self.nesting.brackets:
            self.blocks.see(token)
        if kind == "INTEGRAL":
            self._expect_bounds(word, start, end)
        elif kind == "NAME" and len(self.tokens) > 1 and self._in_head(self.tokens[-2]):
            self.head_start, self.head_end = start, end

    def _returns(self, end: int) -> bool:
        """Whether `return` starts a line or a body, as it does in other languages."""
        return not self.nesting.brackets and self.blocks.state != "body" and _RETURNED.match(self.text, end) is not None

    def _expect_bounds(self, word: str, start: int, end: int) -> None:
        """Where no bracket follows `integral`, its bounds are missing."""
        if _BOUNDS.match(self.text, end):
            return
        message = f"expected the bounds after `{word}`"
        help = "write `integral [lo, hi] body d(x)`, or `integral (x ~ normal(m, s)) body d(x)` for an expectation"
        self.nesting.report(kinds.UNFINISHED(Span(start, end), message, help=help))
        self.tokens.append(Token("NOBOUNDS", "", end, end))

    def _in_head(self, before: Token) -> bool:
        """Whether what follows a token may be parameters of a lambda, or of an inverse."""
        return before.kind in ("LAMBDA", "INVERSE") or (before.kind == "DOT" and before.start == self.head_dot)

    def _is_behind(self, start: int) -> bool:
        """Whether what starts here stands directly behind a value."""
        tokens = self.tokens
        return bool(tokens) and tokens[-1].end == start and tokens[-1].kind in BEHIND and bool(tokens[-1].text)

    def _operator(self, word: str, start: int, end: int) -> int:
        """An operator or a bracket; gives where to go on."""
        kind = OPERATORS.get(word)
        if kind == "DOT":
            found = _FIELD.match(self.text, start) if self._is_behind(start) else None
            in_head = bool(self.tokens) and self.tokens[-1].end == self.head_end
            if found is not None and not (in_head and not uses_parameters(self.tokens, self.head_start)):
                self._add("FIELD", found.group(), start, found.end())
                return found.end()
            if in_head:
                self.head_dot = start
        if kind is None:
            word, diagnostic = foreign_operator(self.text, word, Span(start, end))
            self.nesting.report(diagnostic)
            kind = "BINOP"
        if kind == "LPAR" or kind == "LSQB":
            if not self.nesting.brackets and kind == "LPAR" and self.blocks.separates(self.tokens, start):
                self.tokens.append(Token("COLON", "", start, start))
            if kind == "LPAR" and self.tokens and self._in_head(self.tokens[-1]):
                self.heads.add(start)
            self._add("ADJACENT" if kind == "LSQB" and self._is_behind(start) else kind, word, start, end)
            self.too_deep = not self.nesting.open_bracket(kind, start, self.indent)
            return end
        if kind == "RPAR" or kind == "RSQB":
            if self.nesting.brackets and self.nesting.brackets[-1].start in self.heads:
                self.head_start, self.head_end = self.nesting.brackets[-1].start, end
            self.nesting.close_bracket(kind, word, start, end)
            return end
        if kind == "COMMA" and self.nesting.in_ranges() and _ALSO.match(self.text, end):
            kind = "ALSO"
            self.nesting.open_word("SUM", start)
        elif kind == "COMMA":
            self.nesting.end_words()
        elif word == "∫":
            self.nesting.open_word(kind, start)
        self._add(kind, word, start, end)
        return end

    def _odd(self, kind: str, word: str, start: int, end: int) -> int:
        """What is not a word of the language; gives where to go on."""
        if kind == "BADNUMBER":
            self._bad_number(word, start, end)
        elif kind == "STRING" and self._is_loaded(word):
            self._add("STRING", word, start, end)
        elif kind == "STRING":
            self.nesting.report(string_literal(self.text, word, Span(start, end)))
            self._add("NAME", "", start, end)
        elif kind == "FOREIGN":
            plain, said = foreign_arithmetic(self.text, word, Span(start, end))
            self.nesting.report(said)
            self._add("BINOP", plain, start, end)
        else:
            end, diagnostic = unknown_character(self.text, start)
            if diagnostic is not None:
                self.nesting.report(diagnostic)
        return end

    def _is_loaded(self, word: str) -> bool:
        """Whether a text stands where the name of a file belongs: `load("heights.csv")`."""
        tokens = self.tokens
        loads = len(tokens) > 1 and tokens[-1].kind == "LPAR" and tokens[-2].text == "load"
        return loads and len(word) > 1 and word[-1] == word[0]

    def _bad_number(self, word: str, start: int, end: int) -> None:
        prefix = NUMBER_PREFIX.match(word)
        assert prefix is not None, "a bad number starts with a digit"
        good = prefix.group()
        self.nesting.report(bad_number(word, good, Span(start, end)))
        self._add("NUMBER", good, start, end)

    # Lines

    def _skip_lines(self, position: int, first: bool = False) -> int:
        """From the start of a line to the first line that has code, gathering comments; sets `indent`."""
        text = self.text
        while True:
            found = _LINE.match(text, position)
            assert found is not None, "the pattern matches an empty line"
            blanks, char = found.group(1), found.group(2)
            at = found.end(1)
            if char == "#" or (char == "/" and text.startswith("//", at)):
                end = text.find("\n", at)
                end = len(text) if end < 0 else end
                if char == "#":
                    self.comments.append(Comment(Span(at, end), text[at:end], True))
                else:
                    self.nesting.report(foreign_comment(self.text, Span(at, at + 2)))
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
            message = "this line is indented, but nothing above it goes on here"
            help = "start a definition or a statement in the first column"
            self.nesting.report(kinds.INDENTATION(Span(line, at), message, help=help))
            self.indent = 0
        if not blanks or self.nesting.brackets:
            return
        tabs = "\t" in blanks
        mixed = (self.tabs is not None and tabs != self.tabs) or (tabs and " " in blanks)
        if mixed and not any(d.code == kinds.INDENTATION.code for d in self.nesting.diagnostics):
            message = "tabs and blanks are mixed in the indentation"
            self.nesting.report(kinds.INDENTATION(Span(line, at), message, help="use blanks"))
        self.tabs = tabs if self.tabs is None else self.tabs

    def _newline(self, at: int) -> int:
        """The end of a line: decides what the next line with code is; gives where that starts."""
        position = self._skip_lines(at + 1)
        if position >= len(self.text) or not self.tokens:
            return position
        self.nesting.close_by_indentation(at, self.indent)
        if self.nesting.brackets or not self._layout(position):
            self._next_binding(position)
        return position

    def _next_binding(self, position: int) -> None:
        """Within a `let`, a line that starts a binding is set off from the one before."""
        started = self.tokens[-1].kind not in ("LET", "SEMI")
        if started and self.nesting.in_let() and _BINDING.match(self.text, position):
            self.tokens.append(Token("SEMI", "", position, position))

    def _layout(self, position: int) -> bool:
        """Emit INDENT, DEDENT and NEWLINE before the line at `position`; False if it continues the one before."""
        blocks, tokens = self.blocks, self.tokens
        if blocks.opens(self.indent, self.text.startswith("->", position)):
            tokens.append(Token("INDENT", "", position, position))
            return True
        if not blocks.indents or self.indent > blocks.indents[-1]:
            return False
        if self.indent == blocks.indents[-1] and self._continues(position):
            return False
        self.nesting.end_words()
        last = tokens[-1].end
        while len(blocks.indents) > 1 and self.indent < blocks.indents[-1]:
            blocks.indents.pop()
            tokens.append(Token("DEDENT", "", last, last))
        if self.indent != blocks.indents[-1]:
            line = self.text.rfind("\n", 0, position) + 1
            message = "this line is indented like no line above it"
            help = "indent the lines of a block alike; indent what continues a line more"
            self.nesting.report(kinds.INDENTATION(Span(line, position), message, help=help))
        tokens.append(Token("NEWLINE", "", position, position))
        blocks.new_line()
        return True

    def _ends_with_operator(self) -> bool:
        """Whether the line above does; the `:` of `p ? a : b` is one, that of a loop or a type is not."""
        last = self.tokens[-1].kind
        if last != "COLON":
            return last in _UNFINISHED
        for token in reversed(self.tokens):
            if token.kind in ("QMARK", "NEWLINE", "INDENT", "FOR"):
                return token.kind == "QMARK"
        return False

    def _continues(self, position: int) -> bool:
        """Whether a line that stands where a statement could start can only continue the one before."""
        if _CONTINUES.match(self.text, position):
            return True
        if self._ends_with_operator():  # its operand is still to come, and a binding is none
            return _BINDING.match(self.text, position) is None and _CLAUSE.match(self.text, position) is None
        if self.tokens[-1].start == self.let_in:  # its body is still to come, and a binding is none
            return _BINDING.match(self.text, position) is None
        if self.clauses and _CLAUSE.match(self.text, position):
            return True
        return (
            self.text.startswith("d", position)
            and _D.match(self.text, position + 1) is not None
            and self.nesting.in_integral()
        )

    def _end(self, at: int) -> None:
        last = self.tokens[-1].end if self.tokens else at
        self.nesting.close_all(last)
        self.tokens += [Token("DEDENT", "", last, last) for _ in self.blocks.indents]
        if self.has_sum:
            self.tokens = mark_bodies(self.tokens)
        self.tokens.append(Token("$END", "", last, last))


def lex(text: str, diffeo: bool = False, alone: bool = False) -> Lexed:
    """The tokens of a chunk, or of an expression `alone`; what can't be read is reported, and left out or mended."""
    text = normalized(text)
    lexer = _read(text, diffeo, alone, frozenset())
    never_closed = frozenset(lexer.nesting.never_closed)
    if never_closed and not lexer.too_deep:
        # Read again, knowing which brackets have no end: they end where the indentation, or the `d(x)` of an integral
        # that they opened in, says that they must have.
        lexer = _read(text, diffeo, alone, never_closed)
    return Lexed(lexer.tokens, lexer.comments, lexer.nesting.diagnostics, lexer.too_deep, never_closed)


def _read(text: str, diffeo: bool, alone: bool, unclosed: frozenset[int]) -> _Lexer:
    nesting = Nesting(text, unclosed)
    lexer = _Lexer(text, diffeo, alone, nesting, nesting.tokens)
    lexer.run()
    return lexer
