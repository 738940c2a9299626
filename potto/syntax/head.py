"""Where the head of a `def`, a `for` or a `diffeo` ends, so that the next line opens its block.

Owns `BlockTracker`: the lexer shows it the tokens outside brackets and asks it at each line's end.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from potto.syntax.tokens import Token

_State = Literal["start", "name", "groups", "type", "sized", "typed", "for", "diffeo", "ready", "body"]
_PENDING = frozenset({"groups", "sized", "typed", "for", "ready"})


@dataclass(eq=False, repr=False, slots=True)
class BlockTracker:
    """`indents` are the columns of the open blocks; `state` says how far the head on this line has come."""

    indents: list[int] = field(default_factory=list)
    state: _State = "start"
    questions: int = 0

    def see(self, token: Token) -> None:
        """Take in a token that stands outside brackets."""
        if self.state != "body":
            self.state = self._after(token)

    def opens(self, indent: int, arrow: bool) -> bool:
        """Whether a line at this indentation opens the block of the head before it; `arrow`: it starts with `->`."""
        if self.state not in _PENDING or (arrow and self.state in ("groups", "typed")):
            return False
        if indent <= (self.indents[-1] if self.indents else 0):
            self.state = "body"
            return False
        self.indents.append(indent)
        self.new_line()
        return True

    def new_line(self) -> None:
        """A statement of a block starts."""
        self.state, self.questions = "start", 0

    def separates(self, tokens: list[Token], start: int) -> bool:
        """Whether a `(` at `start`, set off from the parameters before it by a blank, begins the body of a def."""
        if self.state == "groups" and tokens and tokens[-1].kind == "RPAR" and start > tokens[-1].end:
            self.state = "ready"
            return True
        return False

    def _after(self, token: Token) -> _State:
        kind = token.kind
        match self.state:
            case "start":
                return {"DEF": "name", "FOR": "for", "DIFFEODEF": "diffeo"}.get(kind, "body")  # type: ignore[return-value]
            case "name":
                return "groups"
            case "groups" if kind in ("LPAR", "ARROW", "COLON", "EQ"):
                return {"LPAR": "groups", "ARROW": "type"}.get(kind, "ready")  # type: ignore[return-value]
            case "type":
                return "sized" if kind == "LSQB" else "typed"
            case "sized" if kind in ("NAME", "LPAR", "LSQB", "MEMBER"):  # the elements of an array
                return "sized" if kind == "LSQB" else "typed"
            case "sized" | "typed" if kind in ("STAR", "ADJACENT", "LSQB", "ARROW", "COLON", "EQ"):
                more = {"STAR": "typed", "ADJACENT": "typed", "LSQB": "typed", "ARROW": "type"}
                return more.get(kind, "ready")  # type: ignore[return-value]
            case "for":
                return self._in_for(kind)
            case "diffeo":
                return "ready" if kind == "EQ" else "diffeo"
            case _:
                return "body"

    def _in_for(self, kind: str) -> _State:
        if kind == "QMARK":
            self.questions += 1
        elif kind == "COLON":
            if not self.questions:
                return "ready"
            self.questions -= 1
        return "for"
