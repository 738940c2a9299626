"""lsprotocol's classes, made when they are first looked at. Owns `load`.

`lsprotocol.types` has 554 classes, for each of which attrs writes and compiles methods when the module is imported:
four fifths of what importing pygls takes. The server needs a handful of them. While that one module is imported, attrs'
`define` is one that waits until a class is called or asked for its fields, and is then carried out as it stands.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from threading import RLock
from typing import Any

_lock = RLock()


class _Fields:
    """Stands for the fields of a class that was not made yet."""

    def __init__(self, make: Callable[[type], object]) -> None:
        self._make = make

    def __get__(self, instance: object, owner: type) -> object:
        made = owner if self is vars(owner).get("__attrs_attrs__") else _owner(owner, self)
        self._make(made)
        return getattr(owner, "__attrs_attrs__")  # noqa: B009  # mypy knows no such attribute


def _owner(owner: type, fields: _Fields) -> type:
    """The base class that these fields belong to."""
    return next(base for base in owner.__mro__ if vars(base).get("__attrs_attrs__") is fields)


def _later(define: Callable[..., Any]) -> Callable[..., Any]:
    """A version of attrs' `define` that waits. The class remains the same object, so it gets no slots."""

    def defined(cls: Any = None, **how: Any) -> Any:
        if cls is None:
            return lambda cls: defined(cls, **how)

        def make(cls: Any) -> None:
            with _lock:
                if isinstance(vars(cls).get("__attrs_attrs__"), _Fields):
                    if vars(cls).get("__init__") is init:
                        del cls.__init__
                    del cls.__attrs_attrs__
                    define(cls, **{**how, "slots": False})

        def init(self: Any, *given: Any, **named: Any) -> None:
            make(cls)
            cls.__init__(self, *given, **named)

        if "__init__" not in vars(cls):
            cls.__init__ = init
        cls.__attrs_attrs__ = _Fields(make)
        return cls

    return defined


def load() -> None:
    """Import `lsprotocol.types`, unless that was done already."""
    if "lsprotocol.types" in sys.modules:
        return
    import attrs

    define = attrs.define
    attrs.define = _later(define)
    try:
        import lsprotocol.types  # noqa: F401
    finally:
        attrs.define = define
