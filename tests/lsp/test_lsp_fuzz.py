"""A client that says anything at any time: every request is answered once, and the server lives."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import pytest
from how_many import examples
from lsp_client import Client, edit
from potto_lsp.features import FEATURES

Server = Callable[..., Client]
Uri = Callable[[str], str]
TEXTS = [
    "def f(t)\n    integral [0, 1] [x < t] * x d(x)\n#> f(0.5)\n",
    "from b import f\ndef g(t) f(t) + f(t = 𝄞)\r\nprint(g(1))\n",
    "import a as k\rdef h(θ)\r    k.f(θ)/(\u2028 3\n",
    "",
    "diffeo c(x, y; t) = (x + y + t, x - y)\ndef f(t) integral ([0,1],[0,1]) [c((x, y), t)] d(x, y)\n",
    '((((((((((\n))))\n    d(x)\n"\x00\ud800',
]
JUNK: list[Any] = [None, 3, -1, 1e300, "x", [], {}, [{}], {"line": 10**12, "character": 0}, True, "\ud800", {"uri": 1}]


def params(rng: random.Random, uris: list[str]) -> Any:
    """Parameters that fit many methods, often with something wrong in them."""

    def point() -> Any:
        return {"line": rng.randrange(5), "character": rng.randrange(30)}

    found: dict[str, Any] = {
        "textDocument": {"uri": rng.choice(uris)}, "position": point(), "range": {"start": point(), "end": point()},
        "positions": [point(), point()], "context": {"diagnostics": [], "includeDeclaration": True}, "newName": "other",
        "query": "f", "ch": "\n", "options": {}, "files": [{"oldUri": uris[0], "newUri": uris[1]}],
        "command": "potto.differentiate", "arguments": [rng.choice(uris), "f"], "previousResultId": "potto-1",
        "item": {"data": [uris[0], "f"]}, "data": ["type", "f"], "previousResultIds": [], "label": "f",
    }  # fmt: skip
    for _ in range(rng.randrange(3)):
        found[rng.choice(list(found))] = rng.choice(JUNK)
    return rng.choice(JUNK) if rng.random() < 0.05 else found


def change(rng: random.Random) -> dict[str, Any]:
    places = sorted((rng.randrange(5), rng.randrange(25)) for _ in range(2))
    whole = {"text": rng.choice(TEXTS)}
    typed = rng.choice(["", "x", "\n", "(", "𝄞", "\r", "def g(t) t\n", "] "])
    return whole if rng.random() < 0.1 else edit(*places, typed)


def storm(client: Client, uris: list[str], rng: random.Random, messages: int) -> None:
    ids: list[int] = []
    version = 1
    for uri in uris:
        client.open(uri, rng.choice(TEXTS))
    for _ in range(messages):
        roll = rng.random()
        version += 1
        if roll < 0.35:
            client.change(rng.choice(uris), version, *(change(rng) for _ in range(rng.randrange(3))))
        elif roll < 0.4:
            client.tell(rng.choice(["textDocument/didOpen", "textDocument/didSave", "workspace/didChangeConfiguration",
                                    "workspace/didChangeWatchedFiles", "$/nonsense"]), rng.choice(JUNK))  # fmt: skip
        elif roll < 0.43:
            client.tell("textDocument/didClose", {"textDocument": {"uri": rng.choice(uris)}})
        elif roll < 0.46:
            client.open(rng.choice(uris), rng.choice(TEXTS), version)
        elif roll < 0.52 and ids:
            client.tell("$/cancelRequest", {"id": rng.choice(ids)})
        else:
            ids.append(client.begin(rng.choice([*FEATURES, "nonsense"]), params(rng, uris)))
    for id in ids:
        answer = client.answer(id, 120)
        assert ("result" in answer) != ("error" in answer)
    assert client.ask("workspace/symbol", {"query": ""}) is not None


def run(server: Server, uri: Uri, seed: int, messages: int) -> None:
    rng = random.Random(seed)
    encoding = rng.choice(["utf-8", "utf-32", "utf-16"])
    client = server({"general": {"positionEncodings": [encoding]}}, a=TEXTS[0], b=TEXTS[4])
    storm(client, [uri("a"), uri("b"), uri("c"), "untitled:d"], rng, messages)
    assert client.stop(30) == 0
    assert all(len(answers) == 1 for answers in client.answers.values())
    internal = [a for answers in client.answers.values() for a in answers if a.get("error", {}).get("code") == -32603]
    assert not internal, internal[:3]


@pytest.mark.parametrize("seed", range(3))
def test_a_short_storm(server: Server, uri: Uri, seed: int) -> None:
    run(server, uri, seed, 150)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 100 + examples(6, 20)))
def test_a_long_storm(server: Server, uri: Uri, seed: int) -> None:
    run(server, uri, seed, 3_000)
