"""From text to a reply: an entry, a command, or a question such as `f?`.

Owns `respond` and `stream`. Nothing that goes wrong in here ends the session: mistakes are replies, a bug of ours is
a short report that names a file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from potto.diagnostics import PottoError
from potto.reports.render import Located, ProgramError, display_name
from potto_repl import commands as _commands  # noqa: F401  (fills the table)
from potto_repl.editing import flush_left
from potto_repl.recordings import prompted
from potto_repl.registry import Result, find
from potto_repl.reply import Part, Refusal, Reply, diagnostic, note
from potto_repl.session import Conversation

_QUESTION = re.compile(r"\s*([^\W\d][\w.']*|:\w+)\s*(\?{1,2})\s*")

# What other prompts are left and asked with; names that are defined go first.
_WORDS = {"?": "help", "help": "help", "help()": "help"} | dict.fromkeys(("quit", "exit", "quit()", "exit()"), "quit")

_READ_AGAIN = (":reload", ":load")  # which say themselves what has changed


def respond(session: Conversation, text: str) -> Reply:
    """The whole answer to an entry or a command."""
    return Reply(tuple(stream(session, text)))


def stream(session: Conversation, text: str) -> Iterator[Part]:
    """The answer part by part, as it comes. An interrupt goes through; what was entered so far stays."""
    text, recording = flush_left(text), session.record
    said: list[Part] = []
    try:
        for part in _guarded(session, text):
            said.append(part)
            yield part
    except BaseException:
        _write_down(session, recording, text, said)
        raise
    yield from _write_down(session, recording, text, said)


def _write_down(session: Conversation, path: str | None, text: str, said: list[Part]) -> tuple[Part, ...]:
    """An entry and its answer at the end of a transcript; what to say where that cannot be written any more."""
    if path is None or path != session.record:
        return ()
    try:
        with open(path, "a", encoding="utf-8") as file:
            file.write("\n".join([prompted(text), *(part.plain() for part in said)]) + "\n\n")
    except OSError as error:
        session.record = None
        why = (error.strerror or str(error)).lower()
        return Refusal(f"`{path}` cannot be written any more: {why}", "recording has ended; all else goes on").parts
    return ()


def _guarded(session: Conversation, text: str) -> Iterator[Part]:
    try:
        if session.watching:
            from potto_repl.following import refreshed

            yield from refreshed(session, quiet=True)
        elif not text.lstrip().startswith(_READ_AGAIN):
            yield from _data_read_again(session)
        yield from _answered(session, text)
    except Refusal as refusal:
        yield from refusal.parts
    except ProgramError as error:
        yield from located_parts(session, error)
    except PottoError as error:
        for found in error.diagnostics:
            session.last_code = found.code
            yield diagnostic(Located(None, found), session.source)
    except OSError as error:  # of the system, not of ours: a folder that is gone, a disc that is full
        where = f": {error.filename}" if error.filename is not None else ""
        yield Part("error", f"the system says: {(error.strerror or str(error)).lower()}{where}")
    except Exception as error:
        yield from _crashed(text, error)


def _data_read_again(session: Conversation) -> Iterator[Part]:
    """Files of data mean what they hold: what a program had read of them is of no use once they have changed."""
    files = session.world.files
    for changed in files.refresh(files.data_files()):
        yield note(f"{display_name(changed)} has changed, and is read again")


def _answered(session: Conversation, text: str) -> Iterator[Part]:
    stripped = text.strip()
    question = _QUESTION.fullmatch(text)
    if question is not None:
        word = question[1]
        named = "help" if word.startswith(":") else "doc" if question[2] == "?" else "source"
        yield from parts(find(named).run(session, word.lstrip(":") if named == "help" else word))
    elif stripped.startswith(":"):
        word, argument = command_words(stripped)
        yield from parts(find(word).run(session, argument))
    elif stripped.startswith("!"):
        help = f"a command of the system is written `:{stripped.split()[0]} …`; a condition is negated by `not …`"
        raise Refusal("nothing begins with `!`", help)
    elif stripped in _WORDS and session.target(stripped.removesuffix("()")) is None:
        yield from parts(find(_WORDS[stripped]).run(session, ""))
    elif stripped:
        from potto_repl.answers import entry_parts

        yield from entry_parts(session, text)


def command_words(text: str) -> tuple[str, str]:
    """The word of a command and its argument: `:type f(x)`, `:t f(x)`, `:?`."""
    found = re.match(r":\s*(\w+|\?|!)?\s*(.*)", text, re.DOTALL)
    assert found is not None
    return ("help" if found[1] in (None, "?") else found[1]), found[2].strip()


def parts(result: Result) -> Iterator[Part]:
    """What a command gave, as parts."""
    if isinstance(result, str):
        if result:
            yield Part("answer", result)
    elif isinstance(result, Part):
        yield result
    else:
        yield from result


def located_parts(session: Conversation, error: ProgramError) -> Iterator[Part]:
    """The diagnostics of an expression or a file."""
    for located in error.located:
        session.last_code = located.diagnostic.code
        yield diagnostic(located, error.sources)


def _crashed(text: str, error: Exception) -> Iterator[Part]:
    from potto.cli.crash import report

    said = report(["repl", "-c", text], error)
    yield Part("error", said.removeprefix("potto: "), {"error": said})
    yield note("the session goes on, and nothing is lost")
