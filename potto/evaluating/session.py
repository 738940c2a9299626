"""The growing environment of a prompt: each entry is a pseudo file, and sees what the entries before it define.

Owns `Session` and `Outcome`. An entry that has an error is kept as text, so that messages can show it, and joins
nothing. What an entry defines shadows earlier definitions for later entries only: whoever was defined before goes on
with what it meant then. No terminal and no formatting of messages: `Said` carries a diagnostic for `render`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence

from msgspec import Struct

from potto.checking.check import absolute
from potto.evaluating.answering import Answer
from potto.evaluating.world import World
from potto.modules import DefinitionTarget, chunk_start, definition, imports, names, resolve, statements
from potto.modules.builtins import is_builtin
from potto.modules.kinds import HIDES_BUILTIN
from potto.modules.lookup import bindings, preludes, scope
from potto.modules.texts import import_starts
from potto.projects.settings import Settings
from potto.reports.render import Located, ProgramError, display_name
from potto.runtime.answers.estimate import Estimate
from potto.runtime.script import Shown
from potto.source import SourceText
from potto.syntax import nodes, parse_expression
from potto.types import Inferred, format_type, infer_expression, interface

PROMPT = "<prompt>"
_ANSWER = re.compile("_[0-9]*")


class Defined(Struct, frozen=True):
    """A definition joined the session. `shadows` says what its name meant before, in the middle of a sentence."""

    name: str
    type: str
    file: str
    diffeo: bool = False
    shadows: str | None = None

    @property
    def text(self) -> str:
        return f"{self.name} : {self.type}"


class Imported(Struct, frozen=True):
    """An import joined the session, or a file was loaded: the names that are there now."""

    module: str
    names: tuple[str, ...]


class Valued(Struct, frozen=True):
    """A statement showed something. `type` is set for a bare expression, the names under which it stays at hand too."""

    text: str
    estimates: tuple[Estimate, ...]
    type: str | None = None
    names: tuple[str, ...] = ()


class Said(Struct, frozen=True):
    """A diagnostic about an entry or a file; an error ends the entry."""

    located: Located

    @property
    def is_error(self) -> bool:
        return self.located.diagnostic.severity == "error"


Outcome = Defined | Imported | Valued | Said


class Session:
    """Entries over one world. Not to be used by two threads at once."""

    def __init__(self, roots: Sequence[str | os.PathLike[str]] = (".",), world: World | None = None) -> None:
        self.world = world if world is not None else World(roots)
        self.db = self.world.db
        self.number = 0
        self.cell: int | None = None  # in a notebook: the number of the cell that is run
        self.entry = ""  # the pseudo file of the last entry
        self._pieces: dict[int, int] = {}  # how many entries have a number
        self.loaded: list[str] = []
        self._answers = 0
        self._kept = ""  # the entry that has given the last answer
        self._see(())

    # Entries

    def run(self, text: str, settings: Settings | None = None) -> list[Outcome]:
        """Everything that an entry does, at once."""
        return list(self.steps(text, settings))

    def steps(self, text: str, settings: Settings | None = None) -> Iterator[Outcome]:
        """What an entry does, one by one: definitions and imports join the session, statements are run.

        Interrupted in a statement, what the entry defines has joined all the same.
        """
        first = not self._pieces
        self.number, self.entry = self.coming()
        self._pieces[self.number] = self._pieces.get(self.number, 0) + 1
        entry = self.entry
        self._put(entry, text, self.prelude)
        if first:
            yield from map(Said, self.world.project_problems(entry))
        said = [Said(located) for located in self.world.diagnostics(entry) if not _goes_without_saying(located)]
        yield from said
        if any(item.is_error for item in said):
            return
        joined = list(self._joined(entry))
        if joined:
            self._see((entry,))
        yield from joined
        told = {item.located for item in said}
        for item in self._shown(entry, settings):
            if not (isinstance(item, Said) and item.located in told):
                yield item

    def coming(self) -> tuple[int, str]:
        """The number of the next entry and its pseudo file. The entries of one cell share its number."""
        number = self.number + 1 if self.cell is None else self.cell
        before = self._pieces.get(number, 0)
        return number, f"<In {number}>{f'#{before + 1}' if before else ''}"

    def _joined(self, entry: str) -> Iterator[Outcome]:
        """The imports and definitions of an entry, in the order of the text."""
        found: list[tuple[int, Outcome]] = []
        for start, item in zip(import_starts(self.db, entry), imports(self.db, entry), strict=True):
            found.append((start, Imported(item.module, tuple(name for name, _ in bindings(item)))))
        for name in names(self.db, entry):
            found.append((chunk_start(self.db, entry, name), self._defined(entry, name)))
        yield from (outcome for _, outcome in sorted(found, key=lambda pair: pair[0]))

    def _defined(self, entry: str, name: str) -> Defined:
        before = resolve(self.db, PROMPT, name)
        shadows = None
        if isinstance(before, DefinitionTarget) and _ANSWER.fullmatch(before.name):
            shadows = f"the answer `{name}`" if name != "_" else "the last answer, until there is another"
        elif isinstance(before, DefinitionTarget):
            file = display_name(before.file) if before.file.startswith("<") else os.path.basename(before.file)
            shadows = f"`{name}` of {file}"
        elif before is not None:
            shadows = f"the module `{name}`"
        elif is_builtin(name):
            shadows = f"the builtin `{name}`"
        item = definition(self.db, entry, name)
        type = format_type(interface(self.db, entry, name).type)
        return Defined(name, type, entry, isinstance(item, nodes.DiffeoDefinition), shadows)

    def _shown(self, entry: str, settings: Settings | None) -> Iterator[Outcome]:
        places = {ref.statement.span.shift(ref.start): ref.statement for ref in statements(self.db, entry)}
        try:
            for event in self.world.run(entry, settings):
                if isinstance(event, Located):
                    yield Said(event)
                else:
                    yield self._valued(entry, event, places.get(event.span))
        except ProgramError as error:  # what is wrong in a file that the entry uses
            yield from (Said(located) for located in error.located)

    def _valued(self, entry: str, shown: Shown, statement: nodes.Statement | None) -> Valued:
        if not isinstance(statement, nodes.ExpressionStatement):
            return Valued(shown.text, shown.estimates)
        inferred = infer_expression(self.db, entry, statement.value)
        source = self.world.source(entry)
        assert source is not None
        return Valued(shown.text, shown.estimates, format_type(inferred.type), self._keep(entry, source, shown))

    def _keep(self, entry: str, source: SourceText, shown: Shown) -> tuple[str, ...]:
        """Let `_` and `_3` be the answer to entry 3 in later entries: its value, or the expression of a function. Of
        several values in one entry, as in a paste, each has a number of its own; in a cell the last one keeps it."""
        self._answers += 1
        if self._kept == entry and self.cell is None:
            self.number += 1
        self._kept = entry
        number, text = f"_{self.number}", source.text[shown.span.start : shown.span.end]
        before = self.prelude
        answer, last = f"<Out {self._answers}>", f"<Last {self._answers}>"
        self._put(answer, f"{number} = ({text})\n", tuple(dict.fromkeys((entry, *before))))
        if shown.value is not None:
            self.world.hold(answer, number, shown.value)
        self._put(last, f"_ = {number}\n", (answer, *before))  # apart, for `text` may use the `_` before
        self._see((last,))
        return ("_", number)

    def _put(self, file: str, text: str, prelude: tuple[str, ...]) -> None:
        self.db.set_input(("prelude", file), prelude)
        self.world.put(file, text)

    # What is in scope

    @property
    def prelude(self) -> tuple[str, ...]:
        """The files that the next entry goes on from."""
        found: tuple[str, ...] = self.db.get_input(("prelude", PROMPT), ())
        return found

    @property
    def file(self) -> str:
        """An empty pseudo file in whose scope everything of the session is: for questions about expressions."""
        return PROMPT

    def _see(self, prelude: tuple[str, ...]) -> None:
        self._put(PROMPT, "", prelude)

    def names(self) -> dict[str, DefinitionTarget | None]:
        """The names in scope, the latest first, with what they mean (None: a module)."""
        found: dict[str, DefinitionTarget | None] = {}
        for file in preludes(self.db, PROMPT):
            for name in scope(self.db, file):
                if name not in found and not _ANSWER.fullmatch(name):
                    target = resolve(self.db, file, name)
                    found[name] = target if isinstance(target, DefinitionTarget) else None
        return found

    def target(self, name: str) -> DefinitionTarget | None:
        """The definition that a name means at the prompt."""
        found = resolve(self.db, PROMPT, name)
        return found if isinstance(found, DefinitionTarget) else None

    def source(self, file: str) -> SourceText | None:
        """The text of an entry or file, for `render`."""
        return self.world.source(file)

    # Questions

    def infer(self, text: str) -> Inferred:
        """The type of an expression in the session's scope, and what is wrong with it."""
        parsed = parse_expression(text)
        if any(d.severity == "error" for d in parsed.diagnostics):
            return Inferred(infer_expression(self.db, PROMPT, parsed.expr).type, parsed.diagnostics)
        inferred = infer_expression(self.db, PROMPT, parsed.expr)
        return Inferred(inferred.type, tuple(absolute(self.db, PROMPT, d, 0) for d in inferred.diagnostics))

    def evaluate(self, text: str, settings: Settings | None = None) -> Answer:
        """The value of an expression in the session's scope, without making it an entry. Raises ProgramError."""
        return self.world.evaluate(PROMPT, text, settings)

    # Files

    def load(self, path: str | os.PathLike[str]) -> list[Outcome]:
        """Bring a file's names into scope; imports are looked for in its folder as well from now on."""
        file = self.world.key(path)
        problem = self.world.unreadable(file)
        if problem is not None:
            return [Said(problem)]
        folder = os.path.dirname(file)
        if folder and folder not in self.world.files.roots:
            self.world.files.set_roots((*self.world.files.roots, folder))
        self.world.refresh()
        said: list[Outcome] = [Said(located) for located in self.world.diagnostics(file)]
        if file in self.loaded:
            self.loaded.remove(file)
        self.loaded.append(file)
        self._see((file, *(place for place in self.prelude if place != file)))
        return [*said, Imported(file, tuple(scope(self.db, file)))]

    def reload(self) -> list[Outcome]:
        """Read again what has changed on disk, and say what is wrong now in the files that were loaded."""
        if not self.world.refresh():
            return []
        return [Said(located) for file in self.loaded for located in self.world.diagnostics(file)]

    def reset(self) -> None:
        """Forget all entries and loaded files; numbers go on, so that names of entries stay unique."""
        self.loaded.clear()
        self._see(())


def _goes_without_saying(located: Located) -> bool:
    """Whether a message is about what is unused, for what comes next may use it, or hidden: `Defined` says it."""
    return "unnecessary" in located.diagnostic.tags or located.diagnostic.code == HIDES_BUILTIN.code
