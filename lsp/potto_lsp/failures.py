"""What a request can be answered with in place of a result."""

from __future__ import annotations

from typing import Any

PARSE_ERROR = -32700
INVALID_REQUEST = -32600
METHOD_NOT_FOUND = -32601
INVALID_PARAMS = -32602
INTERNAL_ERROR = -32603
NOT_INITIALIZED = -32002
REQUEST_FAILED = -32803
CONTENT_MODIFIED = -32801
REQUEST_CANCELLED = -32800


class RequestError(Exception):
    """Answers a request with an error of the protocol."""

    def __init__(self, code: int, message: str, data: Any = None) -> None:
        super().__init__(message)
        self.code, self.message, self.data = code, message, data


class InvalidParams(RequestError):
    """The parameters are not what the method needs."""

    def __init__(self, message: str) -> None:
        super().__init__(INVALID_PARAMS, message)


class RequestRefused(RequestError):
    """A valid request that is not carried out, for a reason that the user should read."""

    def __init__(self, message: str) -> None:
        super().__init__(REQUEST_FAILED, message)
