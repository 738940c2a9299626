"""Files that a session follows: what they bring, what is recompiled when they change, and why.

Owns `bring` and `refreshed`. A file that is broken on disk keeps its former meaning, and the reload says so.
"""

from __future__ import annotations

import os
import time

from msgspec import Struct

from potto.core.terms import Global, postorder
from potto.elaborate import core, core_term
from potto.evaluating.session import Imported, Said
from potto.modules import imported_files, names, references
from potto.modules.texts import chunk_text
from potto.reports.render import Located, ProgramError, display_name
from potto_repl.reply import Part, Refusal, diagnostic, note
from potto_repl.session import Conversation

MOST_REASONS = 12  # that are listed

Definition = tuple[str, str]  # its file and its name
Remark = tuple[str | None, str, str]  # where, its code and its message


def _program(path: str) -> str:
    if not os.path.isdir(os.path.expanduser(path)):
        return path
    from potto.cli.files import main_of

    try:
        return main_of(os.path.expanduser(path))
    except ProgramError as error:
        said = error.located[0].diagnostic
        raise Refusal(said.message, said.help) from None


def bring(session: Conversation, path: str) -> list[Part]:
    """Load a file, or the main program of a folder, and say what it brought. A file that was loaded before is read
    again.

    Raises Refusal for a folder without a main program.
    """
    path = _program(path)
    if session.world.key(os.path.expanduser(path)) in session.loaded:
        return refreshed(session)
    start = time.perf_counter()
    session.remember(f"`:load {path}`")
    try:
        with session.db.recording() as events:
            outcomes = session.load(os.path.expanduser(path))
            total = _elaborated(session)
    except BaseException:  # interrupted: nothing was loaded that could be taken back
        if session.loaded == list(session.undoing[-1].loaded):
            session.undoing.pop()
        raise
    parts = [diagnostic(o.located, session.source) for o in outcomes if isinstance(o, Said)]
    brought = [o for o in outcomes if isinstance(o, Imported)]
    if not brought:
        session.undoing.pop()
    made = len({e.args for e in events if e.kind == "executed" and e.query == "core"})
    for item in brought:
        count = f"{len(item.names)} name{'' if len(item.names) == 1 else 's'}"
        listed = f": {', '.join(item.names[:8])}{', ...' if len(item.names) > 8 else ''}" if item.names else ""
        data = {"loaded": item.module, "names": list(item.names), "compiled": made, "definitions": total}
        parts.append(Part("answer", f"{display_name(item.module)}: {count}{listed}", data))
        parts.append(Part("tail", f"{made} of {total} compiled, {(time.perf_counter() - start) * 1e3:.0f} ms"))
    return parts


def refreshed(session: Conversation, quiet: bool = False) -> list[Part]:
    """Read again what changed on disk, and say what was done. Where the new text is wrong, old definitions stay."""
    start = time.perf_counter()
    before = _State.of(session)
    changed = session.world.refresh()
    if quiet and not changed and all(_stamp(file) == stamp for file, stamp in session.broken.items()):
        return []  # what is broken was said when it broke
    for file in session.broken:
        session.world.files.close(file)
    waiting, session.broken = session.broken, {}
    if not session.world.refresh() and not waiting and not changed:
        return [] if quiet else [Part("answer", "nothing has changed", {"reloaded": []})]
    parts: list[Part] = []
    with session.db.recording() as events:
        total = _check_all(session, before, parts)
    again = {(str(e.args[0]), str(e.args[1])) for e in events if e.kind == "executed" and e.query == "core"}
    why = _reasons(session, again, before.texts)
    milliseconds = (time.perf_counter() - start) * 1e3
    lines = [f"{len(again)} of {total} recompiled, {milliseconds:.0f} ms"]
    lines += [f"  {name}: {reason}" for name, reason in list(why.items())[:MOST_REASONS]]
    if len(why) > MOST_REASONS:
        lines.append(f"  and {len(why) - MOST_REASONS} more")
    return [*parts, Part("answer", "\n".join(lines), {"recompiled": len(again), "definitions": total, "why": why})]


def _stamp(file: str) -> tuple[int, ...] | None:
    """Something that changes whenever a file does; None if there is no file."""
    try:
        found = os.stat(file)
    except OSError:
        return None
    return (found.st_mtime_ns, found.st_size, found.st_ino, found.st_mode)


class _State(Struct, frozen=True):
    """The texts of the files and of their definitions, and the warnings and hints that have been seen."""

    files: dict[str, str]
    texts: dict[Definition, str | None]
    seen: frozenset[Remark]

    @classmethod
    def of(cls, session: Conversation) -> _State:
        files = {file: text.text for file in _files(session) if (text := session.world.source(file)) is not None}
        texts = {(f, n): chunk_text(session.db, f, n) for f in files for n in names(session.db, f)}
        return cls(files, texts, frozenset(_remark(said) for f in files for said in session.world.diagnostics(f)))


def _remark(said: Located) -> Remark:
    return said.file, said.diagnostic.code, said.diagnostic.message


def _reasons(session: Conversation, again: set[Definition], before: dict[Definition, str | None]) -> dict[str, str]:
    """Why each definition was compiled again, and which are gone."""
    why: dict[str, str] = {}
    now = [(file, name) for file in _files(session) for name in names(session.db, file)]
    edited = {item for item in now if chunk_text(session.db, *item) != before.get(item)}
    for item in now:
        if item not in again:
            continue
        used = {(g.module, g.name) for g in postorder(core_term(session.db, *item)) if isinstance(g, Global)}
        changed = sorted(name for file, name in used & (edited | again) if (file, name) != item)
        if item not in before:
            why[item[1]] = "it is new"
        elif item in edited:
            why[item[1]] = "its text changed"
        elif changed:
            why[item[1]] = f"it uses {', '.join(f'`{name}`' for name in changed)}, which changed for its users"
        elif (None, "load") in references(session.db, *item):
            why[item[1]] = "the file that it loads changed"
        else:
            why[item[1]] = "a name in it means something else now"
    return {**why, **{name: "it is gone" for file, name in before.keys() - set(now)}}


def _files(session: Conversation) -> list[str]:
    """The loaded files and all that they import."""
    found: dict[str, None] = {}
    todo = list(session.loaded)
    while todo:
        file = todo.pop(0)
        if file not in found:
            found[file] = None
            todo += imported_files(session.db, file)
    return list(found)


def _check_all(session: Conversation, before: _State, parts: list[Part]) -> int:
    """Check the files, set aside texts that are broken now, elaborate the rest; how many definitions there are."""
    found: dict[str, list[Located]] = {}
    for file in _files(session):
        found[file] = list(session.world.diagnostics(file))
    for file, said in found.items():
        wrong = [located for located in said if located.diagnostic.severity == "error"]
        parts += [diagnostic(d, session.source) for d in said if d in wrong or _remark(d) not in before.seen]
        text = session.world.source(file)
        if wrong and file in before.files and (text is None or before.files[file] != text.text):
            parts.append(note(f"{display_name(file)}: the earlier definitions are kept"))
            session.broken[file] = _stamp(file)
    for file in session.broken:
        session.world.files.set_text(file, before.files[file])
    return _elaborated(session)


def _elaborated(session: Conversation) -> int:
    """Elaborate every definition of the loaded files and of those that they import; how many there are."""
    found = [(file, name) for file in _files(session) for name in names(session.db, file)]
    for file, name in found:
        core(session.db, file, name)
    return len(found)
