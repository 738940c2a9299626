"""Typing as a person does: with pauses, errors made and mended, and after each key what an editor asks.

Owns `type_like_a_person`. The keys go in front of a call of `sqrt`, in Potto and in Python alike.
"""

from __future__ import annotations

import time
from queue import Empty
from typing import Any

from lsp_client import PUSHED, Client

PAUSE = 0.1  # seconds between two keys
VISIBLE = 50  # lines
PATIENCE = 20.0  # seconds to wait for diagnostics
# What is typed (or, with nothing, how the last character is deleted), and whether the text has an error then.
KEYS = (("k", True), ("*", False), ("(", True), ("", False), ("", True), ("", False))
# What Visual Studio Code asks after each key, by the capability that announces it.
ASKED = {
    "codeLens": "codeLensProvider", "documentSymbol": "documentSymbolProvider", "foldingRange": "foldingRangeProvider",
    "inlayHint": "inlayHintProvider", "documentLink": "documentLinkProvider",
    "semanticTokens/full": "semanticTokensProvider",
}  # fmt: skip


def place_of(text: str) -> tuple[int, int]:
    """The line and column of a call of `sqrt` in the second half of a text."""
    lines = text.split("\n")
    line = next(n for n in range(len(lines) // 2, len(lines)) if "sqrt(" in lines[n])
    return line, lines[line].index("sqrt(")


class Typist:
    """Somebody who types in one document of a client."""

    def __init__(self, client: Client, module: str, text: str) -> None:
        self.client, self.module = client, module
        self.line, self.column = place_of(text)
        self.start, self.tokens = self.column, ""
        self.methods = [method for method, name in ASKED.items() if client.capabilities.get(name)]
        self.errors = client.errors.get(client.uri(module), 0)

    def key(self, typed: str) -> float:
        """Type or delete one character; when that was sent."""
        start, end = self.column - (not typed), self.column
        places = [{"line": self.line, "character": character} for character in (start, end)]
        self.column = start + len(typed)
        edit = {"range": {"start": places[0], "end": places[1]}, "text": typed}
        return self.client.change(self.module, edit)

    def ask(self) -> dict[int, str]:
        """Ask what an editor asks; the ids of the requests and their methods."""
        lines = {"start": {"line": max(self.line - VISIBLE // 2, 0), "character": 0},
                 "end": {"line": self.line + VISIBLE // 2, "character": 0}}  # fmt: skip
        document = {"textDocument": {"uri": self.client.uri(self.module)}, "range": lines}
        found = {}
        for method in self.methods:
            params: dict[str, Any] = document
            if method == "semanticTokens/full" and self.tokens:
                method, params = "semanticTokens/full/delta", {**document, "previousResultId": self.tokens}
            found[self.client.begin(f"textDocument/{method}", params)] = method
        return found

    def wait(self, waiting: dict[int, str], wrong: bool) -> tuple[float, float]:
        """When the client was told that there is an error, or none any more; when the last question was answered."""
        told = answered = 0.0
        uri = self.client.uri(self.module)
        while waiting or not told:
            arrived, message = self.client.until(lambda message: True, PATIENCE)
            if message.get("method") == PUSHED and message["params"]["uri"] == uri:
                found = len(message["params"]["diagnostics"]) > self.errors
                told = arrived if found == wrong and not told else told
            elif "method" not in message and waiting.pop(message.get("id", 0), None):
                answered = arrived
                result = message.get("result")
                self.tokens = result.get("resultId", self.tokens) if isinstance(result, dict) else self.tokens
        return told, answered


def type_like_a_person(client: Client, module: str, text: str, rounds: int) -> tuple[list[float], list[float]]:
    """Seconds from each key to the diagnostics that it calls for, and to the last answer of what is asked after it."""
    typist = Typist(client, module, text)
    told, answered = list[float](), list[float]()
    waiting = typist.ask()  # as an editor does when a file is opened
    while waiting:
        _, message = client.until(lambda message: "method" not in message)
        waiting.pop(message["id"], None)
    for _ in range(rounds):
        for typed, wrong in KEYS:
            time.sleep(PAUSE)
            sent = typist.key(typed)
            try:
                diagnosed, last = typist.wait(typist.ask(), wrong)
            except Empty:
                continue  # it does not tell: then there is nothing to be measured
            told.append(diagnosed - sent)
            answered.append(max(last, diagnosed) - sent)
    return told, answered
