"""Modules that pygls imports and that a session has no use for, imported when they are first looked at.

Owns `postpone`. asyncio, which only says here that no handler is a coroutine; cattrs, attrs and lsprotocol, whose
classes messages would be made into; and what of pygls itself serves those: together they are nine tenths of what
importing pygls takes. Each stands as an empty module until an attribute of it is asked for that it does not have yet,
and is then carried out in place, so that whoever has it sees the whole of it. What pygls takes out of one by name
stands for it until it is used.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec
from threading import RLock, get_ident
from types import ModuleType
from typing import Any

from potto_lsp import lazy_types

_lock = RLock()  # one thread carries a module out, others wait for all of it
_carried_out_by: dict[str, int] = {}


class _Later(ModuleType):
    """A module whose body waits. `_stand_ins`: what was taken out of it meanwhile, by name."""

    _stand_ins: dict[str, Any]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or _carried_out_by.get(self.__name__) == get_ident():
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        with _lock:
            if type(self) is _Later:
                _carry_out(self)
        return getattr(self, name)


def _carry_out(module: Any) -> None:
    spec, stand_ins = module.__spec__, module._stand_ins
    assert spec is not None
    _carried_out_by[spec.name] = get_ident()
    try:
        for name in stand_ins:
            delattr(module, name)
        if spec.name == lazy_types.NAME:
            lazy_types.carry_out(module)
        else:
            assert spec.loader is not None
            spec.loader.exec_module(module)
        del module._stand_ins
        module.__class__ = ModuleType
    finally:
        del _carried_out_by[spec.name]
    _replace(module, stand_ins)


def _replace(module: Any, stand_ins: dict[str, Any]) -> None:
    """Give the modules of pygls that have taken something out of this one what it stood for."""
    for name, taker in list(sys.modules.items()):
        if name.partition(".")[0] == "pygls" and type(taker) is ModuleType:
            for taken, stand_in in stand_ins.items():
                if vars(taker).get(taken) is stand_in:
                    setattr(taker, taken, getattr(module, taken))


def _stand_in(module: _Later, name: str) -> Callable[..., Any]:
    """What stands for a class or a function of a module that waits."""

    def stand_in(*given: Any, **named: Any) -> Any:
        with _lock:
            if type(module) is _Later:
                _carry_out(module)
        return getattr(module, name)(*given, **named)

    return stand_in


def postpone() -> None:
    """Let these modules wait, unless they are there already."""
    _wait_with("asyncio", known={"iscoroutinefunction": inspect.iscoroutinefunction})
    _wait_with("attrs", known={"define": lazy_types.define})
    _wait_with("cattrs", "Converter")
    _wait_with("cattrs.errors", "ClassValidationError")
    _wait_with("lsprotocol.converters")
    _wait_with("lsprotocol.types", "ResponseError", "ResponseErrorMessage",
               known={"CANCEL_REQUEST": "$/cancelRequest", "EXIT": "exit"})  # fmt: skip
    _wait_with("pygls.lsp", "get_method_options_type", "is_instance")
    _wait_with("pygls.protocol.language_server", "LanguageServerProtocol", "lsp_method")


def _wait_with(name: str, *taken: str, known: dict[str, object] | None = None) -> None:
    """taken: what pygls takes out of the module; known: what can be said of it without it."""
    if name in sys.modules:
        return
    spec = _spec(name)
    module = sys.modules[name] = _Later(name)
    module._stand_ins = {one: _stand_in(module, one) for one in taken}
    vars(module).update(module._stand_ins, __spec__=spec, __loader__=spec.loader, __file__=spec.origin)
    vars(module).update(known or {}, __package__=spec.parent)
    if spec.submodule_search_locations is not None:
        module.__path__ = spec.submodule_search_locations


def _spec(name: str) -> ModuleSpec:
    """Where a module is, found without importing the packages that it is in."""
    package = name.rpartition(".")[0]
    spec = PathFinder.find_spec(name, _spec(package).submodule_search_locations) if package else find_spec(name)
    assert spec is not None, f"{name} comes with pygls, or with Python"
    return spec
