"""What the prompt answers: parts, each of a kind, that a face paints or writes as JSON.

Owns `Part`, `Reply` and `Refusal`. No terminal, no numbers: a part is text with the data behind it. A diagnostic goes
with the texts that it is about as they were when it was found, so that it can be shown at any later time.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, Literal

from msgspec import Struct
from msgspec.structs import replace

from potto.projects.settings import respelled
from potto.reports.render import Located, Palette, Sources, broken, render, to_json
from potto.source import SourceText

Kind = Literal["answer", "output", "note", "tail", "error", "help", "diagnostic", "picture"]
_GOES_ON = re.compile(r"(?!\w+ : )[\w`(\"'\[$]")  # how a line begins that may belong to the paragraph above
NARROWEST = 36  # columns, from which on a number and its error go on one line
COMPLAINTS: frozenset[Kind] = frozenset(("error", "help", "diagnostic"))


class Part(Struct, frozen=True):
    """One part of a reply.

    answer: what was asked for. output: what a program printed. note: what is good to know. tail: what it cost; shown
    to people only. error, help: a command that could not be carried out, and what to do. diagnostic: about a program.
    picture: an image, as pixels in `data`. `prose`: its lines may be broken where a screen is narrow; `numbers`:
    between numbers, each with its error.
    """

    kind: Kind
    text: str = ""
    data: Mapping[str, Any] | None = None
    located: Located | None = None
    sources: Mapping[str, SourceText] = {}
    prose: bool = False
    numbers: bool = False

    @property
    def is_error(self) -> bool:
        if self.located is not None:
            return self.located.diagnostic.severity == "error"
        return self.kind == "error"

    @property
    def is_complaint(self) -> bool:
        """Whether this goes to standard error in a pipe."""
        return self.kind in COMPLAINTS or self.kind == "note"

    def plain(self) -> str:
        """The part as text without colours."""
        return self.shown(Palette())

    def shown(self, palette: Palette, columns: int | None = None) -> str:
        """The part as text, a diagnostic in the colours of a palette; prose in lines of so many columns."""
        if self.located is not None:
            return render(self.located, self.sources.get, palette=palette, columns=columns)
        if self.kind == "error":
            said = broken(f": {self.text}", columns, 2, len("error"))
            return palette.paint(palette.error, "error") + palette.paint(palette.bold, said)
        if self.kind == "help":
            said = broken(f"  = help: {self.text}", columns, 4)
            return said.replace("help", palette.paint(palette.bold, "help"), 1)
        if self.numbers and columns is not None:
            return "\n".join(_between_numbers(line, columns) for line in self.text.split("\n"))
        if self.prose or self.kind in ("note", "tail"):
            return self.text if columns is None else _broken_lines(self.text, columns)
        return self.text

    def json(self) -> dict[str, Any] | None:
        """The part for machines; None for what is for people only."""
        if self.located is not None:
            return {"diagnostics": [to_json(self.located, self.sources.get)]}
        if self.data is not None:
            return {key: value for key, value in self.data.items() if not key.startswith("_")}
        if self.kind in ("tail", "note", "help"):
            return None
        return {"error" if self.kind == "error" else "text": self.text}


class Reply(Struct, frozen=True):
    """The answer to one entry or command."""

    parts: tuple[Part, ...] = ()

    @property
    def failed(self) -> bool:
        return any(part.is_error for part in self.parts)

    @property
    def text(self) -> str:
        """Everything, as a person reads it without colours."""
        return "\n".join(part.plain() for part in self.parts)


class Refusal(Exception):
    """A command cannot be carried out: says why, and what to do."""

    def __init__(self, message: str, help: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.help = help

    @property
    def parts(self) -> tuple[Part, ...]:
        said = (Part("error", self.message),)
        return (*said, Part("help", self.help)) if self.help else said


def _broken_lines(text: str, columns: int) -> str:
    """Lines of prose, broken with their own indentation; a line that must be broken takes the next one of its
    paragraph along. Code stays whole: what stands four blanks in, or between fences."""
    lines: list[str] = []
    code = False
    for line in text.split("\n"):
        fence = line.startswith("```")
        code ^= fence
        if not (code or fence) and lines and len(lines[-1]) >= columns and _GOES_ON.match(line):
            lines[-1] += f" {line}"
        else:
            lines.append(line)
    return "\n".join(broken(line, columns, indent) if (indent := len(line) - len(line.lstrip())) < 4 else line
                     for line in lines)  # fmt: skip


def _between_numbers(line: str, columns: int) -> str:
    """A line with numbers, broken only between them: first where three blanks set something off. A number, what it is
    called and its error stay together where there is room."""
    if len(line) < columns:
        return line
    indent = len(line) - len(line.lstrip()) + 4
    lines = [""]
    for part in re.split(r"(?<=\S) {3,}(?=[a-z])", line):
        joined = f"{lines[-1]}   {part}" if lines[-1] else part
        if lines[-1] and len(joined) >= columns:
            lines.append(" " * indent + part)
        else:
            lines[-1] = joined
    if columns > NARROWEST:
        lines = [re.sub(r" (±) |\b(interior|boundary|gives) ", _glued, part) for part in lines]
    return "\n".join(broken(part, columns, indent).replace("\1", " ") for part in lines)


def _glued(found: re.Match[str]) -> str:
    return found[0].replace(" ", "\1")


def answer(text: str, **data: Any) -> Part:
    """An answer; `data` is what machines get instead of the text."""
    return Part("answer", text, data or None)


def note(text: str) -> Part:
    return Part("note", text)


def diagnostic(located: Located, sources: Sources) -> Part:
    """A diagnostic with the texts that it is about."""
    files = [located.file, *(related.file for related in located.diagnostic.related)]
    texts = {file: text for file in files if file is not None and (text := sources(file)) is not None}
    return Part("diagnostic", located=_for_a_prompt(located), sources=texts)


def _for_a_prompt(located: Located) -> Located:
    """With options of the command line as they are set here: `--max-evals` is `:set max_evals`."""
    found = located.diagnostic
    help = respelled(found.help, lambda name, value: " ".join(filter(None, (":set", name, value))))
    return located if help == found.help else replace(located, diagnostic=replace(found, help=help))


def diagnostics(found: Iterable[Located], sources: Sources) -> list[Part]:
    return [diagnostic(located, sources) for located in found]
