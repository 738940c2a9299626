"""Record what an editor says to the server: put this in the place of `potto lsp`, in the editor's settings.

    POTTO_SESSION=vscode.jsonl python record.py lsp --stdio

Writes the client's messages, one a line. The place of the workspace is `${root}` in URIs and `${path}` elsewhere, so
that `test_lsp_sessions.py` can play them again in another one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from typing import IO, Any

messages: list[dict[str, Any]] = []


def read(stream: IO[bytes]) -> bytes | None:
    """The body of the next message."""
    length = 0
    while (line := stream.readline()).strip():
        name, _, value = line.partition(b":")
        if name.lower() == b"content-length":
            length = int(value)
    return stream.read(length) if length else None


def framed(body: bytes) -> bytes:
    return b"Content-Length: %d\r\n\r\n%b" % (len(body), body)


def root_of(params: Any) -> tuple[str, str]:
    """The URI and the path of the first folder of the workspace."""
    folders = params.get("workspaceFolders") or []
    uri = folders[0]["uri"] if folders else params.get("rootUri") or "file:///nowhere"
    return uri, params.get("rootPath") or uri.removeprefix("file://")


def answers(server: IO[bytes]) -> None:
    """Hand on what the server says."""
    while (body := read(server)) is not None:
        sys.stdout.buffer.write(framed(body))
        sys.stdout.buffer.flush()


def save() -> None:
    greeting = next(m["params"] for m in messages if m.get("method") == "initialize")
    uri, path = root_of(greeting)
    greeting["processId"] = None
    text = "".join(json.dumps(message, ensure_ascii=False) + "\n" for message in messages)
    with open(os.environ["POTTO_SESSION"], "w", encoding="utf-8") as file:
        file.write(text.replace(uri, "${root}").replace(path, "${path}"))


def main() -> None:
    pipe = subprocess.PIPE
    server = subprocess.Popen([sys.executable, "-m", "potto", "lsp"], stdin=pipe, stdout=pipe)
    assert server.stdin is not None and server.stdout is not None
    threading.Thread(target=answers, args=(server.stdout,), daemon=True).start()
    while (body := read(sys.stdin.buffer)) is not None:
        messages.append(json.loads(body))
        save()
        server.stdin.write(framed(body))
        server.stdin.flush()
    server.stdin.close()
    server.wait(10)


if __name__ == "__main__":
    main()
