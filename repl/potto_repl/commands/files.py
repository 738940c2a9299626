"""Commands about files: loading programs, following their changes, editing, and writing the session down."""

from __future__ import annotations

import os

from potto.extras import install_command
from potto.modules.texts import chunk_text
from potto.reports.render import display_name
from potto_repl.following import bring, refreshed
from potto_repl.recordings import prompted
from potto_repl.registry import command
from potto_repl.reply import Part, Refusal, answer, note
from potto_repl.session import Conversation

PICTURES = (".svg", ".png", ".pdf", ".jpg")


@command("load", "l", argument="FILE", completes="file")
def load(session: Conversation, text: str) -> list[Part]:
    """Bring the names of a file into scope; it is followed by `:reload` and `:watch` from then on."""
    path = text.strip().strip("\"'")
    if not path:
        raise Refusal("a file is missing", "write `:load renderer.po`")
    expanded = os.path.expanduser(path)
    if not os.path.exists(expanded):
        for suffix in (".po", ".diffeo"):
            if os.path.exists(expanded + suffix):
                return bring(session, path + suffix)
        from potto.cli.files import missing

        found = missing(path).diagnostic
        raise Refusal(found.message, found.help)
    return bring(session, path)


@command("reload", "r")
def reload(session: Conversation, text: str) -> list[Part]:
    """Read again what changed on disk, recompiling only that. A file that is broken now keeps its old definitions."""
    if not session.loaded:
        return [note("no file is loaded; imported modules are looked at all the same"), *refreshed(session)]
    return refreshed(session)


@command("watch", "w", argument="[on | off]")
def watch(session: Conversation, text: str) -> list[Part]:
    """Reload files as they change, without being asked; `:watch off` ends it."""
    if text not in ("", "on", "off"):
        raise Refusal(f"`:watch` is on or off, not `{text}`")
    session.watching = text != "off"
    names = ", ".join(display_name(file) for file in session.loaded) or "what will be loaded"
    return [answer(f"watching {names}" if session.watching else "no longer watching", watching=session.watching)]


@command("edit", argument="[NAME | FILE | NUMBER]", completes="name")
def edit(session: Conversation, text: str) -> list[Part]:
    """Open an editor ($VISUAL or $EDITOR) on a definition, an entry or a file; what is saved is entered.

    Without an argument it opens the last entry.
    """
    if session.edit is None:
        raise Refusal("there is no terminal to edit in")
    path = os.path.expanduser(text)
    if text and os.path.exists(path):
        return _edited_file(session, path)
    edited = session.edit(_text_to_edit(session, text))
    if edited is None or not edited.strip():
        return [note("nothing was entered")]
    from potto_repl.answers import entry_parts

    return [Part("output", edited.rstrip("\n")), *entry_parts(session, edited)]


def _text_to_edit(session: Conversation, text: str) -> str:
    if not text:
        return session.entries[-1].text if session.entries else ""
    if text.isdigit():
        for entry in session.entries:
            if entry.number == int(text):
                return entry.text
        raise Refusal(f"there is no entry {text}", "`:history` lists them")
    target = session.target(text)
    if target is None:
        raise Refusal(f"`{text}` is not a definition, an entry or a file", "`:browse` lists the definitions")
    return (chunk_text(session.db, target.file, target.name) or "") + "\n"


def _edited_file(session: Conversation, path: str) -> list[Part]:
    import subprocess

    from potto_repl.keyboard import loud_keys

    with loud_keys():
        subprocess.run([*editor(), path], check=False)
    key = session.world.key(path)
    return refreshed(session) if key in session.loaded else bring(session, path)


def editor() -> list[str]:
    """The words of the command that opens an editor."""
    import shlex

    return shlex.split(os.environ.get("VISUAL") or os.environ.get("EDITOR") or "vi")


@command("save", argument="FILE", completes="file")
def save(session: Conversation, text: str) -> list[Part]:
    """Write the session as a program (`:save session.po`), or the last picture (`:save plot.svg`, `.png`, `.pdf`).

    Values become live expressions, `#> e` with `#= v`, which `potto test session.po` runs again.
    """
    path = os.path.expanduser(text.strip().strip("\"'"))
    if not path:
        raise Refusal("a file is missing", "write `:save session.po` or `:save plot.svg`")
    suffix = os.path.splitext(path)[1].lower()
    if suffix in PICTURES:
        return _save_picture(session, path, suffix)
    if suffix != ".po":
        raise Refusal(f"`{path}` is neither a program nor a picture", "end it with .po, .svg or .png")
    from potto_repl.transcript import program

    if session.world.key(path) in session.loaded:
        raise Refusal(f"`{path}` is loaded here: it would be overwritten", "choose another name")
    body, notes = program(session, os.path.dirname(os.path.abspath(path)))
    _write(path, body.encode())
    live = body.count("\n#> ") + body.startswith("#> ")
    said = f"{path}: {len(body.splitlines())} lines, {live} live expression{'' if live == 1 else 's'}"
    return [*map(note, notes), answer(said, saved=path, live=live)]


def _save_picture(session: Conversation, path: str, suffix: str) -> list[Part]:
    from potto.applications.figures import figure, has_matplotlib

    picture = session.last_picture
    if picture is None:
        raise Refusal("there is no picture yet", "`:plot f 0 1` or `:image f` makes one")
    if suffix != ".svg" and has_matplotlib():
        data = figure(picture, suffix)
    elif suffix in (".svg", ".png"):
        data = picture.svg().encode() if suffix == ".svg" else picture.png()
    else:
        help = "a picture that ends with .svg does without"
        raise Refusal(f"`{suffix}` needs matplotlib: {install_command('plots')}", help)
    _write(path, data)
    said = [answer(f"{path}: {len(data):,} bytes", saved=path, bytes=len(data))]
    if suffix == ".png" and not has_matplotlib():
        said.append(note(f"axes and labels need matplotlib, `{install_command('plots')}`; a .svg has them without"))
    return said


def _write(path: str, data: bytes) -> None:
    """Write a file whole or not at all: on a disc that is full the old one stays."""
    import tempfile

    try:
        folder = os.path.dirname(path) or "."
        special = os.path.exists(path) and (os.path.islink(path) or not os.path.isfile(path))
        if special or not os.access(folder, os.W_OK):
            with open(path, "wb") as file:
                file.write(data)
            return
        handle, fresh = tempfile.mkstemp(dir=folder, prefix=f".{os.path.basename(path)}-")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            os.chmod(fresh, os.stat(path).st_mode if os.path.exists(path) else 0o666 & ~_umask())
            os.replace(fresh, path)
        except BaseException:
            os.unlink(fresh)
            raise
    except OSError as error:
        raise Refusal(f"`{path}` cannot be written: {(error.strerror or str(error)).lower()}") from None


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


@command("record", argument="[FILE | off]", completes="file")
def record(session: Conversation, text: str) -> list[Part]:
    """Write entries and answers to a file as they come, until `:record off`; `potto replay FILE` says what changed.

    What was entered before is written first, so that the file can be replayed from its beginning.
    """
    path = os.path.expanduser(text.strip())
    if not path:
        return [answer(f"recording to {session.record}" if session.record else "not recording", record=session.record)]
    if path == "off":
        was, session.record = session.record, None
        return [answer(f"{was} is complete" if was else "nothing was being recorded", record=None)]
    try:
        with open(path, "a", encoding="utf-8") as file:
            if not file.tell():
                file.writelines(f"{prompted(text)}\n\n" for text in _so_far(session))
    except OSError as error:
        raise Refusal(f"`{path}` cannot be written: {(error.strerror or str(error)).lower()}") from None
    session.record = path
    return [answer(f"recording to {path}", record=path)]


def _so_far(session: Conversation) -> list[str]:
    """What brings the session to where it is: files that were loaded, and entries."""
    loaded = [f":load {display_name(file)}" for file in reversed(session.loaded)]
    return loaded + [entry.text for entry in session.entries]
