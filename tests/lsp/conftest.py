"""Servers for tests: one for many tests that only ask, and one for each test that breaks something."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from lsp_client import Client


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Callable[..., Client]]:
    """`server(main="…")`: a client of a started server on a folder with these modules; `capabilities` are its own."""
    started: list[Client] = []

    def make(capabilities: dict[str, Any] | None = None, greet: bool = True, **files: str) -> Client:
        for name, text in files.items():
            (tmp_path / f"{name}.po").write_bytes(text.encode())
        client = Client(tmp_path, capabilities)
        started.append(client)
        if greet:
            client.start()
        return client

    yield make
    for client in started:
        if client.process.poll() is None:
            client.process.kill()
        assert all(len(answers) == 1 for answers in client.answers.values()), "a request was answered twice"


@pytest.fixture
def uri(tmp_path: Path) -> Callable[[str], str]:
    """The URI of a module of the test's folder."""
    return lambda name: (tmp_path / (name if "." in name else f"{name}.po")).as_uri()
