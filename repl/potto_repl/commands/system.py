"""`:!`: a command of the system."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator

from potto_repl.registry import command
from potto_repl.reply import Part, Refusal
from potto_repl.session import Conversation


@command("shell", "!", argument="CMD", completes="file")
def shell(session: Conversation, text: str) -> Iterator[Part]:
    """Run a command of the system's shell and show what it prints: `:!ls *.po`.

    It reads nothing from the keyboard. A command that fails is an error, as any other entry's.
    """
    if not text:
        raise Refusal("a command is missing", "write `:!ls`")
    done = subprocess.run(text, shell=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          check=False)  # fmt: skip
    said = done.stdout.decode("utf-8", "replace").rstrip("\n")
    if said:
        yield Part("output", said, {"output": said, "status": done.returncode})
    if done.returncode:
        yield Part("error", f"`{text}` ended with status {done.returncode}")
