"""Which tokens stand apart: the formatter's rules for blanks within a line.

Owns `Spaced` and `spaced`. The rules need little context (is this `-` a sign, does this `:` belong to a `?`, does this
`=` name an argument), and it is gathered here in one pass over a chunk's tokens.
"""

from __future__ import annotations

from dataclasses import dataclass

from potto.syntax.contextual import ENDS_OPERAND
from potto.syntax.head import BlockTracker
from potto.syntax.tokens import CLOSERS, KEYWORDS, OPENERS, Token

_CONDITIONS = frozenset({"<", "<=", ">", ">=", "==", "!=", "≤", "≥", "≠", "and", "or", "&&", "||"})
_OPEN_ENDED = frozenset({"IF", "QMARK", "LAMBDA", "LET", "COMMA", "FOR", "WITH"})
"""What makes something else of what is in brackets than a condition."""
_TYPES = frozenset({"Real", "Dist", "Diffeo"})
_BREAK_BEFORE = frozenset({"THEN", "ELSE", "QMARK", "D", "INVERSE", "WHERE"})


@dataclass(eq=False, repr=False, slots=True)
class Spaced:
    """A written token, whether a blank stands before it, and what the layout must know of it."""

    token: Token
    blank: bool
    depth: int
    """How far inside it stands: open brackets count 1, integrals and the heads of sums and folds 2."""
    may_break: bool
    """Whether a line that is too long may be broken before it."""
    level: int
    """How many blocks it stands in."""
    starts: bool
    """Whether it starts a line of its block."""
    body: bool = False
    """Whether the body of a `let` begins with it."""
    opens: bool = False
    """Whether the body of a `def` begins with it on the line of the head."""


@dataclass(eq=False, repr=False, slots=True)
class _Bracket:
    kind: str
    bounds: bool
    """Whether it holds the bounds of an integral."""
    variables: bool = False
    """Whether it ends an integral, `d(x, y)`."""
    questions: int = 0
    lets: int = 0
    inner: int = 0
    """How much deeper than the bracket itself what comes next is in it."""
    bound: bool = False
    """Whether the next `=` is that of a `fold` or a `with`."""


class _Pass:
    """One walk over the tokens of a chunk."""

    def __init__(self, tokens: list[Token], text: str) -> None:
        self.tokens, self.text = tokens, text
        self.brackets = [_Bracket("", False)]
        self.depth = 0
        self.level = 0
        self.starts = True
        self.body = False  # whether the `in` of a `let` stands directly before
        self.marked = False  # whether an empty token (the body of a sum or a def) stands directly before
        self.bounds_closed = False
        self.head = tokens[0].kind in ("DEF", "DIFFEODEF") if tokens else False
        self.blocks = BlockTracker()
        self.headed = not self.head  # whether a body has begun
        self.loop = False
        self.conditions = _conditions(tokens)
        self.out: list[Spaced] = []

    def run(self) -> list[Spaced]:
        for token in self.tokens:
            if token.text:
                self._written(token)
            elif token.kind == "INDENT":
                self.level, self.starts = self.level + 1, True
            elif token.kind == "DEDENT":
                self.level -= 1
            elif token.kind == "NEWLINE":
                self.starts = True
            elif token.kind in ("SUMBODY", "COLON"):
                self.marked = True
                if token.kind == "COLON":
                    self.blocks.see(token)
                else:
                    self._deeper(-2)
        return self.out

    def _deeper(self, by: int) -> None:
        self.brackets[-1].inner += by
        self.depth += by

    def _written(self, token: Token) -> None:
        before = self.out[-1].token if self.out else None
        if self.starts:
            self.loop = token.kind == "FOR" and len(self.brackets) == 1
        kind = token.kind
        if kind in CLOSERS:
            closed = self.brackets.pop()
            self.depth -= 1 + closed.inner
        blank = before is not None and not self.starts and self._blank(before, token)
        opens = len(self.brackets) == 1 and kind not in CLOSERS and self._opens(token)
        may_break = before is not None and self._may_break(before, token) and not (self.loop and not self.depth)
        depth = -1 if opens else self.depth - self.bounds_closed
        self.out.append(Spaced(token, blank, depth, opens or may_break, self.level, self.starts, self.body, opens))
        self.body = self.starts = self.marked = self.bounds_closed = False
        if kind in OPENERS:
            self.brackets[-1].bound &= before is not None and before.kind == "FOLD"
            last = "" if before is None else before.kind
            self.brackets.append(_Bracket(kind, last == "INTEGRAL", last == "D"))
            self.depth += 1
        elif kind in CLOSERS:
            self.bounds_closed = closed.bounds
            self._deeper(-2 if closed.variables else 0)
        elif kind == "QMARK":
            self.brackets[-1].questions += 1
        elif kind == "COLON" and self.brackets[-1].questions:
            self.brackets[-1].questions -= 1
        elif kind == "LET":
            self.brackets[-1].lets += 1
        elif kind == "INTEGRAL":
            self._deeper(2)
        elif kind in ("FOLD", "WITH", "SUM"):
            self.brackets[-1].bound |= kind != "SUM"
            self._deeper(0 if kind == "WITH" else 2)
        elif before is not None and before.kind == "EQ":
            self.brackets[-1].bound = False
        elif kind == "IN" and self.brackets[-1].lets:
            self.brackets[-1].lets -= 1
            self.body = True

    def _opens(self, token: Token) -> bool:
        """Whether the body of a `def` begins with a token outside of brackets, on the line of its head."""
        if self.headed or self.level:
            return False
        self.blocks.see(token)
        self.headed = self.blocks.state == "body"
        return self.headed

    def _is_prefix(self) -> bool:
        """Whether the sign that was written last has no operand before it."""
        sign = self.out[-1]
        return len(self.out) == 1 or sign.starts or sign.opens or self.out[-2].token.kind not in ENDS_OPERAND

    def _is_star_of_type(self, before: Token) -> bool:
        return before.kind == "NAME" and before.text in _TYPES

    def _may_break(self, before: Token, token: Token) -> bool:
        kind = token.kind
        if before.kind in ("COMMA", "ALSO") or kind in _BREAK_BEFORE or self.bounds_closed:
            return True
        if kind == "COLON":
            return self.brackets[-1].questions > 0
        if kind == "IN":
            return self.brackets[-1].lets > 0
        if kind in ("SIGN", "STAR", "BINOP"):
            return before.kind in ENDS_OPERAND and token.text != "^" and not self._is_star_of_type(before)
        return before.kind == "DOT"

    def _blank(self, before: Token, token: Token) -> bool:
        """Whether a blank stands between two tokens of a line."""
        kind, last = token.kind, before.kind
        if last in OPENERS or kind in CLOSERS or kind in ("COMMA", "SEMI"):
            return False
        if last in ("COMMA", "SEMI", "ALSO"):
            return True
        if kind in ("ADJACENT", "FIELD", "ALSO"):
            return token.start in self.conditions
        if kind == "DOTDOT" or last == "DOTDOT":
            return kind == "DOTDOT" and before.text.endswith(".")
        if kind == "COLON":
            return self.brackets[-1].questions > 0
        if kind == "EQ" or last == "EQ":
            return not self._names_argument()
        if token.text == "^" or before.text == "^":
            return False
        if last == "LAMBDA":
            return False
        if last == "SIGN" and self._is_prefix():
            return False
        if kind == "STAR" and self._is_star_of_type(before):
            return False
        if kind in OPENERS:
            return self._blank_before_bracket(before, token)
        return True

    def _names_argument(self) -> bool:
        """Whether an `=` here names an argument of a call."""
        inner = self.brackets[-1]
        return inner.kind == "LPAR" and not inner.lets and not inner.bound

    def _blank_before_bracket(self, before: Token, token: Token) -> bool:
        if before.kind in ("D", "DIFFEO"):
            return False
        if before.text in KEYWORDS or before.kind not in ENDS_OPERAND or self.marked or self.bounds_closed:
            return True
        if token.kind == "LSQB":
            return before.text not in _TYPES
        if self.head and len(self.out) == 2:
            return False
        # `f(x)` and `f (x)` are both good style, for calls and for juxtaposition: the author's choice stands.
        return token.start > before.end


def _conditions(tokens: list[Token]) -> frozenset[int]:
    """Where brackets begin that stand directly behind a value and hold a condition: these are arguments."""
    found: list[int] = []
    open_: list[tuple[Token, set[str]]] = []
    for token in tokens:
        if token.kind in OPENERS:
            open_.append((token, set()))
        elif token.kind in CLOSERS and open_:
            opener, kinds = open_.pop()
            if opener.kind == "ADJACENT" and "condition" in kinds and not kinds & _OPEN_ENDED:
                found.append(opener.start)
        elif open_:
            open_[-1][1].add("condition" if token.kind == "NOT" or token.text in _CONDITIONS else token.kind)
    return frozenset(found)


def spaced(tokens: list[Token], text: str) -> list[Spaced]:
    """The written tokens of a chunk, each with what the layout must know of it."""
    return _Pass(tokens, text).run()
