"""A session with the client that comes with pygls: lsprotocol's classes go out, and come back."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from lsprotocol import types
from pygls.lsp.client import LanguageClient

SERVER = ("-m", "potto", "lsp")
TEXT = "def f(t) integral [0, 1] [x < t]*x d(x)\n\ndef g(t) f(t) + h\n"


@contextmanager
def listening() -> Iterator[int]:
    """The port of a server that waits for a client on a socket."""
    command = [sys.executable, *SERVER, "--tcp", "127.0.0.1:0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        try:
            yield int(process.stderr.readline().rpartition(":")[2])
            assert process.wait(10) == 0
        finally:
            process.kill()


async def session(folder: Path, port: int | None) -> tuple[types.Hover | None, list[types.Diagnostic]]:
    """What a client is told of TEXT: a hover over `f` in `g`, and what is wrong."""
    client, uri = LanguageClient("a test", "1"), (folder / "a.po").as_uri()
    told: asyncio.Future[list[types.Diagnostic]] = asyncio.get_running_loop().create_future()

    @client.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
    def published(params: types.PublishDiagnosticsParams) -> None:
        if params.uri == uri and not told.done():
            told.set_result(list(params.diagnostics))

    await (client.start_io(sys.executable, *SERVER) if port is None else client.start_tcp("127.0.0.1", port))
    root = types.WorkspaceFolder(folder.as_uri(), "test")
    greeting = await client.initialize_async(
        types.InitializeParams(types.ClientCapabilities(), workspace_folders=[root])
    )
    assert greeting.server_info is not None and greeting.server_info.name == "potto"
    client.initialized(types.InitializedParams())
    client.text_document_did_open(types.DidOpenTextDocumentParams(types.TextDocumentItem(uri, "potto", 1, TEXT)))
    place = types.HoverParams(types.TextDocumentIdentifier(uri), types.Position(2, 9))
    hover, said = await asyncio.wait_for(asyncio.gather(client.text_document_hover_async(place), told), 20)
    await client.shutdown_async(None)
    client.exit(None)
    await client.stop()
    return hover, said


@pytest.mark.parametrize("way", ["streams", "socket"])
def test_a_session_with_the_client_of_pygls(tmp_path: Path, way: str) -> None:
    if way == "streams":
        hover, said = asyncio.run(session(tmp_path, None))
    else:
        with listening() as port:
            hover, said = asyncio.run(session(tmp_path, port))
    assert hover is not None and isinstance(hover.contents, types.MarkupContent)
    assert "f : (t: Real) -> Real" in hover.contents.value
    assert [(one.code, one.range.start.line) for one in said] == [("P0201", 2)]
