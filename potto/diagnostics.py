"""Messages to the user as values.

Owns `Diagnostic` and the table of kinds. A kind is declared beside the check that raises it:
`NOT_DEFINED = declare("P0201", "a name that is not defined")`, and raised as
`NOT_DEFINED(span, "...", help="...")`. Rendering for people and for machines is in `render`.
"""

from __future__ import annotations

from typing import Literal, Self

from msgspec import Struct
from msgspec.structs import replace

from potto.source import Span

Severity = Literal["error", "warning", "info", "hint"]


class Related(Struct, frozen=True):
    """Another place that a diagnostic talks about. `file` None means the diagnostic's own file.

    `owner` is the name of the chunk (definition) that `span` is relative to; None means the diagnostic's own chunk,
    and the empty string means that the span is absolute.
    """

    span: Span
    message: str
    file: str | None = None
    owner: str | None = None


class Replacement(Struct, frozen=True):
    """A text for a place. An empty place is one to insert at; an empty text takes out what stands there."""

    span: Span
    text: str


class Suggestion(Struct, frozen=True):
    """A change that would answer a diagnostic: what it is called, and what it writes. Its places are relative like the
    diagnostic's own, in the same text, and don't overlap."""

    title: str
    edits: tuple[Replacement, ...]

    def shift(self, start: int) -> Suggestion:
        """The same change of a text that begins further on."""
        return Suggestion(self.title, tuple(Replacement(e.span.shift(start), e.text) for e in self.edits))


LONGEST = 40  # characters of a text that a title shows


def shortened(text: str) -> str:
    """A text as titles show it."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


def suggest(span: Span, text: str, title: str = "") -> Suggestion:
    """One text for one place; called "Write `text`" if nothing else is said."""
    return Suggestion(title or f"Write `{shortened(text)}`", (Replacement(span, text),))


class Diagnostic(Struct, frozen=True):
    """One message. `span` is relative to its chunk until `shift` has made it absolute.

    `label` stands beside the underlined place ("varies inside the integral"), `notes` explain, `help` says what to do,
    `suggestions` do it: each is another way, the likeliest first.
    """

    code: str
    severity: Severity
    message: str
    span: Span
    label: str = ""
    related: tuple[Related, ...] = ()
    notes: tuple[str, ...] = ()
    help: str = ""
    tags: tuple[Literal["unnecessary", "deprecated"], ...] = ()
    suggestions: tuple[Suggestion, ...] = ()


class Kind(Struct, frozen=True):
    """A kind of diagnostic: its stable code and what it is about."""

    code: str
    title: str
    severity: Severity = "error"

    def __call__(
        self,
        span: Span,
        message: str,
        *,
        label: str = "",
        related: tuple[Related, ...] = (),
        notes: tuple[str, ...] = (),
        help: str = "",
        tags: tuple[Literal["unnecessary", "deprecated"], ...] = (),
        suggestions: tuple[Suggestion, ...] = (),
    ) -> Diagnostic:
        return Diagnostic(self.code, self.severity, message, span, label, related, notes, help, tags, suggestions)


KINDS: dict[str, Kind] = {}


def declare(code: str, title: str, severity: Severity = "error") -> Kind:
    """Declare a kind of diagnostic, once, beside the check that raises it."""
    if code in KINDS:
        raise ValueError(f"diagnostic {code} is declared twice")
    kind = Kind(code, title, severity)
    KINDS[code] = kind
    return kind


class PottoError(Exception):
    """The program, not Potto, is at fault: carries the diagnostics that say how. As text it starts with the message and
    ends with what to do."""

    def __init__(self, diagnostics: tuple[Diagnostic, ...] | list[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        self.met: list[object] = []
        super().__init__("\n".join(map(_said, self.diagnostics)))

    def of(self, met: object) -> Self:
        """The same error on its way out of something that was evaluated, innermost first."""
        self.met.append(met)
        return self

    def beside(self, related: Related) -> Self:
        """The same error with another place that its first message talks about, which had none but its own."""
        first, *rest = self.diagnostics
        return type(self)([replace(first, related=(*first.related, related)), *rest])

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.diagnostics,)


def _said(diagnostic: Diagnostic) -> str:
    more = [f"  = note: {note}" for note in diagnostic.notes] + [f"  = help: {diagnostic.help}"] * bool(diagnostic.help)
    return "\n".join([headline(diagnostic), *more])


def headline(diagnostic: Diagnostic) -> str:
    """`` `f` takes 1 argument, but is given 2 [P0308]``."""
    return f"{diagnostic.message} [{diagnostic.code}]"
