"""Commands about the session itself: what was entered, taking it back, starting over, leaving."""

from __future__ import annotations

from potto_repl.registry import command
from potto_repl.reply import Part, Refusal, answer
from potto_repl.session import Conversation


@command("history", argument="[N | TEXT]")
def history(session: Conversation, text: str) -> Part:
    """List the entries of this session; the last N, or those that hold TEXT."""
    entries = session.entries
    if text.isdigit():
        entries = entries[-int(text) :] if int(text) else []
    elif text:
        entries = [entry for entry in entries if text in entry.text]
    shown = [f"{entry.number:>4}  " + entry.text.strip("\n").replace("\n", "\n      ") for entry in entries]
    listed = [{"number": entry.number, "text": entry.text} for entry in entries]
    return Part("answer", "\n".join(shown) or "nothing was entered", {"history": listed})


@command("undo", "u", argument="[N]")
def undo(session: Conversation, text: str) -> list[Part]:
    """Take back the last definition, import or load, and the answers since: names mean again what they meant before.

    `:undo 3` takes back the last three.
    """
    if text and not (text.isdecimal() and int(text)):
        raise Refusal(f"`:undo` takes the number of changes to undo, not `{text}`", "write `:undo` or `:undo 3`")
    labels = [label for _ in range(min(int(text or 1), len(session.undoing))) if (label := session.undo()) is not None]
    said = [answer(f"took back {label}", undone=label) for label in labels]
    return said or [answer("there is nothing to undo", undone=None)]


@command("reset")
def reset(session: Conversation, text: str) -> Part:
    """Forget all definitions, answers and loaded files. Settings stay."""
    session.reset()
    return answer("everything is forgotten", reset=True)


@command("quit", "q")
def leave(session: Conversation, text: str) -> list[Part]:
    """Leave the prompt; so does Ctrl-D."""
    session.leaving = True
    return []
