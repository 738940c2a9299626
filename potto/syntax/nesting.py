"""What is open while a chunk is read: brackets, and the `let`, `sum`, `for` and `integral` that wait for their ends.

Owns `Nesting`. It closes what the text never closes, so that the tokens it leaves are always balanced and every
integral has its `d(...)`: the parser need not guess at brackets.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from potto.diagnostics import Diagnostic, Related, Suggestion
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.suggesting import insert, take_out, write
from potto.syntax.tokens import FIRST_NAME, Token

MAX_NESTING = 100
MOST_MESSAGES = 50
_CLOSER = {"LPAR": "RPAR", "LSQB": "RSQB"}
_CHARACTER = {"LPAR": "(", "RPAR": ")", "LSQB": "[", "RSQB": "]"}

_DIFFERENTIAL = re.compile(rf"\bd ?({FIRST_NAME.pattern})")
_DIFFERENTIALS = re.compile(rf"(?:{_DIFFERENTIAL.pattern}[ *]*)+\Z")
"""`dx`, `d x` or `dx dy`, as mathematics writes it."""

_BRACKET = re.compile(r"#[^\n]*|[()\[\]]")
_DIFFERENTIATES = re.compile(r"\s*d\s*\(")


@dataclass(eq=False, repr=False, slots=True)
class _Open:
    """A bracket with the indentation of its line, or a `let`, `sum` or `integral` with its depth of brackets."""

    kind: str
    start: int
    depth: int


@dataclass(eq=False, repr=False, slots=True)
class Nesting:
    """`unclosed` are the brackets that are known to have no end, from a first reading."""

    text: str
    unclosed: frozenset[int]
    tokens: list[Token] = field(default_factory=list)
    diagnostics: list[Diagnostic] = field(default_factory=list)
    brackets: list[_Open] = field(default_factory=list)
    words: list[_Open] = field(default_factory=list)
    never_closed: set[int] = field(default_factory=set)
    ranges: set[int] = field(default_factory=set)
    """Within how many brackets a range has begun that another may follow."""

    def report(self, diagnostic: Diagnostic) -> None:
        """Note a message, unless there are so many that one more helps nobody."""
        if len(self.diagnostics) < MOST_MESSAGES:
            self.diagnostics.append(diagnostic)

    # Words

    def open_word(self, kind: str, start: int) -> None:
        """A `let`, `sum` or `integral` begins."""
        self.words.append(_Open(kind, start, len(self.brackets)))

    def close_integral(self, at: int) -> bool:
        """Close the innermost integral that is open at this depth of brackets, if there is one. Brackets around the
        `d` at `at` that the text never closes, and that opened in the integral, must have ended before it."""
        self._close_integrand(at)
        depth = len(self.brackets)
        for index in range(len(self.words) - 1, max(-1, len(self.words) - MAX_NESTING), -1):
            word = self.words[index]
            if word.depth != depth:
                return False
            if word.kind == "INTEGRAL":
                del self.words[index:]
                return True
        return False

    def _close_integrand(self, at: int) -> None:
        depth = -1
        for word in self.words[-MAX_NESTING:]:
            depth = word.depth if word.kind == "INTEGRAL" else depth
        if depth < 0 or any(bracket.start not in self.unclosed for bracket in self.brackets[depth:]):
            return
        while len(self.brackets) > depth:
            self.close_unclosed(at)

    def close_in(self) -> bool:
        """`in` belongs to the innermost `let` or `sum` at this depth; whether it is that of a `let`."""
        if self.words and self.words[-1].kind != "INTEGRAL" and self.words[-1].depth == len(self.brackets):
            let = self.words.pop().kind == "LET"
            if not let:
                self.ranges.add(len(self.brackets))
            return let
        return False

    def in_ranges(self) -> bool:
        """Whether what a sum, a fold or an array goes through was read at this depth last: another range may follow."""
        return len(self.brackets) in self.ranges

    def in_let(self) -> bool:
        """Whether what comes next at this depth could be a further binding of a `let`."""
        return bool(self.words) and self.words[-1].kind == "LET" and self.words[-1].depth == len(self.brackets)

    def in_integral(self) -> bool:
        """Whether an integral waits for its `d(...)`."""
        return any(word.kind == "INTEGRAL" for word in self.words[-MAX_NESTING:])

    def end_words(self) -> None:
        """Nothing at this depth goes on from here: integrals that have no `d(...)` get an empty one."""
        words, depth = self.words, len(self.brackets)
        while words and words[-1].depth >= depth:
            word = words.pop()
            if word.kind == "INTEGRAL":
                self._end_integral(word)

    def _end_integral(self, opener: _Open) -> None:
        last = self.tokens[-1].end
        written = _DIFFERENTIALS.search(self.text, max(opener.start, last - 40), last)
        meant = f"d({', '.join(_DIFFERENTIAL.findall(written[0]))})" if written else ""
        word = "∫" if self.text[opener.start] == "∫" else "integral"
        if any(d.span.start == opener.start for d in self.diagnostics):  # its bounds are missing: it is being typed
            self.tokens += [Token(kind, "", last, last) for kind in ("D", "LPAR", "RPAR")]
            return
        self.report(
            kinds.NO_DIFFERENTIAL(
                Span(opener.start, opener.start + len(word)),
                f"this `{word}` has no `d(...)`",
                label="which variables does it integrate over?",
                related=(Related(Span(last, last), "the integral ends here"),),
                help=f"write `{meant}`" if written else "end the integral with its variables: `d(x)`",
                suggestions=(insert(last, f" {meant}"),) if written else (),
            )
        )
        self.tokens += [Token(kind, "", last, last) for kind in ("D", "LPAR", "RPAR")]

    # Brackets

    def open_bracket(self, kind: str, start: int, indent: int) -> bool:
        """A bracket opens, on a line indented so far; False if there are too many around it."""
        if len(self.brackets) >= MAX_NESTING:
            message = kinds.TOO_DEEP(
                Span(start, start + 1), "this is nested too deeply", help="name the inner parts with `let`"
            )
            self.diagnostics.append(message)
            return False
        self.brackets.append(_Open(kind, start, indent))
        return True

    def close_bracket(self, kind: str, word: str, start: int, end: int) -> None:
        """A closing bracket: adds its token, mended if it is the wrong one, or none if nothing is open."""
        if self.brackets and _CLOSER[self.brackets[-1].kind] == kind:
            self._close(kind, word, start, end)
            return
        if not self.brackets or self._is_stray(kind, end):
            opening = _CHARACTER["LPAR" if kind == "RPAR" else "LSQB"]
            self.report(
                kinds.BRACKETS(Span(start, end), f"this `{word}` closes nothing: no `{opening}` is open here",
                               help=f"take it out, or write the `{opening}` before it",
                               suggestions=take_out(self.text, Span(start, end)))
            )  # fmt: skip
            return
        if any(_CLOSER[bracket.kind] == kind for bracket in self.brackets):
            # What is open inside the bracket that is meant was never closed.
            while _CLOSER[self.brackets[-1].kind] != kind:
                self.close_unclosed(start)
        opener = self.brackets[-1]
        wanted = _CLOSER[opener.kind]
        if wanted != kind:
            self.report(
                kinds.BRACKETS(
                    Span(start, end),
                    f"this `{word}` does not close the `{_CHARACTER[opener.kind]}`",
                    related=(Related(Span(opener.start, opener.start + 1), "opened here"),),
                    help=f"write `{_CHARACTER[wanted]}`",
                    suggestions=write(self.text, Span(start, end), _CHARACTER[wanted]),
                )
            )
        self._close(wanted, word, start, end)

    def _close(self, kind: str, word: str, start: int, end: int) -> None:
        """Close the innermost bracket."""
        self.end_words()
        self.ranges.discard(len(self.brackets))
        self.brackets.pop()
        self.tokens.append(Token(kind, word, start, end))

    def _is_stray(self, kind: str, end: int) -> bool:
        """Whether a closing bracket is of a kind that is not open, and what is open is closed further on without it."""
        if len(self.diagnostics) >= MOST_MESSAGES or any(_CLOSER[bracket.kind] == kind for bracket in self.brackets):
            return False  # after that many messages, looking far ahead for one more is not worth it
        depth, wanted = 0, _CHARACTER[_CLOSER[self.brackets[-1].kind]]
        for found in _BRACKET.finditer(self.text, end):
            if found[0] in "([":
                depth += 1
            elif found[0] in ")]":
                if not depth:
                    return found[0] == wanted
                depth -= 1
        return False

    def close_unclosed(self, before: int) -> None:
        """Close the innermost bracket ahead of `before`, since the text never does."""
        opener = self.brackets[-1]
        self.never_closed.add(opener.start)
        self.end_words()
        self.brackets.pop()
        last = self.tokens[-1].end
        closer = _CLOSER[opener.kind]
        self.report(
            kinds.BRACKETS(
                Span(opener.start, opener.start + 1),
                f"this `{_CHARACTER[opener.kind]}` is never closed",
                related=(Related(Span(last, max(last, before)), f"a `{_CHARACTER[closer]}` is missing here"),),
                help=f"write `{_CHARACTER[closer]}`",
                suggestions=self._closings(opener.start, last, _CHARACTER[closer]),
            )
        )
        self.tokens.append(Token(closer, "", last, last))

    def _closings(self, start: int, last: int, closer: str) -> tuple[Suggestion, ...]:
        """Where a closing bracket may be meant: at the end of the line of the opening one, where it is missed, at the
        very end. Ahead of the `d(x)` of an integral only there."""
        if _DIFFERENTIATES.match(self.text, last):
            return (insert(last, closer),)
        line = self.text.find("\n", start)
        ends = (len(self.text[: line if line >= 0 else None].rstrip()), last, len(self.text.rstrip()))
        return tuple(insert(end, closer) for end in dict.fromkeys(ends))

    def close_by_indentation(self, at: int, indent: int) -> None:
        """Before a line: close the brackets without an end that its indentation shows to be over."""
        while self.brackets and self.brackets[-1].start in self.unclosed and indent <= self.brackets[-1].depth:
            self.close_unclosed(at)

    def close_all(self, at: int) -> None:
        """At the end of the chunk."""
        while self.brackets:
            self.close_unclosed(at)
        self.end_words()
