"""The answer to `initialize`, which waits for nothing that it doesn't need.

Owns `answer` and `greet`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from potto import __version__
from potto_lsp import failures
from potto_lsp.client import Client
from potto_lsp.failures import RequestError
from potto_lsp.features import capabilities
from potto_lsp.wire import Outbox


def answer(params: Any) -> dict[str, Any]:
    """What the server can do, for a client. Raises `RequestError` if `params` are not a greeting."""
    if not isinstance(params, Mapping) or not isinstance(params.get("capabilities", {}), Mapping):
        raise RequestError(failures.INVALID_PARAMS, "the client's capabilities are missing")
    info = {"name": "potto", "version": __version__}
    return {"capabilities": capabilities(Client(params).encoding), "serverInfo": info}


def greet(body: bytes, outbox: Outbox) -> Any:
    """Answer the first message at once if it is a proper greeting. Returns its parameters; None if the server is to
    answer it."""
    try:
        message = json.loads(body)
    except (ValueError, RecursionError):
        return None
    match message:
        case {"id": int() | str() as id, "method": "initialize", "params": params} if not isinstance(id, bool):
            try:
                result = answer(params)
            except RequestError:
                return None
            outbox.put({"jsonrpc": "2.0", "id": id, "result": result})
            return params
    return None
