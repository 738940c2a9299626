"""The server of `potto view`: its page in a browser, bound to this machine, behind a token, without a network.

Owns `serve` and `Answering`.
"""

from __future__ import annotations

import contextvars
import secrets
from concurrent.futures import ThreadPoolExecutor
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

import msgspec

from potto.applications.integral_answers import Answers
from potto.applications.integral_page import page

HOST = "127.0.0.1"
MOST = 1 << 16  # bytes of a question


class Answering:
    """The answers of `integral_answers`, one question at a time: a program that is compiled belongs to a thread."""

    def __init__(self, answers: Answers) -> None:
        self._answers = answers
        self._context = contextvars.copy_context()  # with the settings of the command
        self._thread = ThreadPoolExecutor(max_workers=1)

    def answer(self, path: str, asked: dict[str, Any]) -> dict[str, Any] | None:
        """What goes back as JSON; None for a path that there is not."""
        return self._thread.submit(self._context.run, self._answers.answer, path, asked).result()

    def close(self) -> None:
        """Answer nothing more."""
        self._thread.shutdown()


def serve(answers: Answering, port: int = 0) -> tuple[ThreadingHTTPServer, str]:
    """A server that answers on this machine alone, not yet running, and the address of its page, with its token."""
    token = secrets.token_urlsafe(24)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self._allowed() and urlsplit(self.path).path == "/":
                nonce = secrets.token_urlsafe(12)
                rules = f"default-src 'none'; img-src data:; style-src 'nonce-{nonce}'; "
                rules += f"script-src 'nonce-{nonce}'; connect-src 'self'"
                self._send(200, "text/html; charset=utf-8", page(nonce).encode(), rules)
            else:
                self._send(404, "text/plain", b"not found\n")

        def do_POST(self) -> None:
            length = self.headers.get("Content-Length", "")
            if not self._allowed() or not length.isdecimal() or int(length) > MOST:
                return self._send(404, "text/plain", b"not found\n")
            try:
                asked = msgspec.json.decode(self.rfile.read(int(length)), type=dict[str, Any])
            except msgspec.MsgspecError:
                return self._send(400, "text/plain", b"not JSON\n")
            found = answers.answer(urlsplit(self.path).path, asked)
            if found is None:
                return self._send(404, "text/plain", b"not found\n")
            return self._send(200, "application/json", msgspec.json.encode(found))

        def _allowed(self) -> bool:
            """The right token, and asked for by the name of this machine: no other page can have sent it here."""
            given = parse_qs(urlsplit(self.path).query).get("token", [""])[0]
            here = self.headers.get("Host") == f"{HOST}:{self.server.server_port}"  # type: ignore[attr-defined]
            return here and secrets.compare_digest(given.encode(), token.encode())

        def _send(self, status: int, kind: str, body: bytes, rules: str = "default-src 'none'") -> None:
            self.send_response(status)
            heads = {"Content-Type": kind, "Content-Length": str(len(body)), "Cache-Control": "no-store",
                     "Content-Security-Policy": rules, "Referrer-Policy": "no-referrer"}  # fmt: skip
            for name, value in heads.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: Any) -> None:
            """Nothing: the terminal is for people."""

    server = ThreadingHTTPServer((HOST, port), Handler)
    server.daemon_threads = True
    return server, f"http://{HOST}:{server.server_port}/?token={token}"
