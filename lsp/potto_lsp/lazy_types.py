"""lsprotocol's classes, made when they are first looked at. Owns `carry_out` and `define`.

`lsprotocol.types` has 554 classes, for each of which attrs writes and compiles methods when the module is imported:
nine tenths of what importing pygls takes. The server needs a handful of them. While that one module is imported, the
bodies of its classes wait, and so does attrs' `define`, until a class is called or asked for its fields; both are then
carried out as they stand.
"""

from __future__ import annotations

import builtins
from collections.abc import Callable
from threading import RLock
from types import CodeType, FunctionType, ModuleType
from typing import Any

NAME = "lsprotocol.types"
_lock = RLock()
_bodies: dict[type, FunctionType] = {}  # of classes that are still empty


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
                    _fill(cls)
                    define(cls, **{**how, "slots": False})

        def init(self: Any, *given: Any, **named: Any) -> None:
            make(cls)
            cls.__init__(self, *given, **named)

        if "__init__" not in vars(cls):
            cls.__init__ = init
        cls.__attrs_attrs__ = _Fields(make)
        return cls

    return defined


def _empty(body: FunctionType, name: str, *bases: type, **how: Any) -> type:
    """A class whose body waits, if there is nothing but fields in it."""
    if bases or how or any(isinstance(constant, CodeType) for constant in body.__code__.co_consts):
        made: type = builtins.__build_class__(body, name, *bases, **how)
        return made
    made = type(name, (), {"__module__": NAME, "__qualname__": name})
    _bodies[made] = body
    return made


def _fill(cls: type) -> None:
    """Carry out the body of a class, if that is still to be done."""
    body = _bodies.pop(cls, None)
    if body is not None:
        for name, value in vars(builtins.__build_class__(body, cls.__name__)).items():
            if name not in ("__dict__", "__weakref__", "__module__"):
                setattr(cls, name, value)


def _define(cls: type, **how: Any) -> Any:
    from attr import define

    return define(cls, **how)


define = _later(_define)
"""attrs' `define` for classes that are made when they are first used."""


def carry_out(module: ModuleType) -> None:
    """Execute `lsprotocol.types`."""
    import attrs

    spec = module.__spec__
    assert spec is not None and spec.loader is not None
    vars(module)["__builtins__"] = {**vars(builtins), "__build_class__": _empty}
    attrs.has(object)  # if it was waiting, all of it is there now
    own = attrs.define
    attrs.define = define
    try:
        spec.loader.exec_module(module)
    finally:
        attrs.define = own
    for cls in [cls for cls in _bodies if "__attrs_attrs__" not in vars(cls)]:  # that attrs is not told of
        _fill(cls)
