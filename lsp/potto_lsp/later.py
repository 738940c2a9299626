"""Modules that pygls imports and that a session has no use for, imported when they are first looked at.

Owns `postpone`. asyncio, which only says here that no handler is a coroutine, and cattrs, whose converters would take
messages apart, are half of what importing pygls takes. Each stands as an empty module until an attribute of it is
asked for, and is then carried out in place, so that whoever has it sees the whole of it.
"""

from __future__ import annotations

import inspect
import sys
from importlib.util import find_spec
from threading import RLock, get_ident
from types import ModuleType
from typing import Any

_lock = RLock()  # one thread carries a module out, others wait for all of it
_carried_out_by: dict[str, int] = {}


class _Later(ModuleType):
    """A module whose body waits."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or _carried_out_by.get(self.__name__) == get_ident():
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        with _lock:
            if type(self) is _Later:
                _carry_out(self)
        return getattr(self, name)


def _carry_out(module: ModuleType) -> None:
    spec = module.__spec__
    assert spec is not None and spec.loader is not None
    _carried_out_by[spec.name] = get_ident()
    try:
        spec.loader.exec_module(module)
        module.__class__ = ModuleType
    finally:
        del _carried_out_by[spec.name]


class _Converter:
    """What pygls names where it says what a parameter is; whoever makes one gets one of cattrs."""

    def __new__(cls, *given: Any, **named: Any) -> Any:
        waiting = sys.modules["cattrs"]
        del waiting.Converter
        return waiting.Converter(*given, **named)


def postpone() -> None:
    """Let these modules wait, unless they are there already."""
    _wait_with("asyncio", iscoroutinefunction=inspect.iscoroutinefunction)
    _wait_with("cattrs", Converter=_Converter)
    _wait_with("lsprotocol.converters")


def _wait_with(name: str, **known: object) -> None:
    """known: what can be said of the module without it."""
    if name in sys.modules:
        return
    spec = find_spec(name)
    assert spec is not None, f"{name} comes with pygls, or with Python"
    module = sys.modules[name] = _Later(name)
    vars(module).update(known, __spec__=spec, __loader__=spec.loader, __file__=spec.origin, __package__=spec.parent)
    if spec.submodule_search_locations is not None:
        module.__path__ = spec.submodule_search_locations
