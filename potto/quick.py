"""Values of the front end, which makes a hundred of them for every line of a program and can be compiled.

Owns `value`, for classes that would be frozen dataclasses with slots. Interpreted they are structs of msgspec, which
are made, compared and hashed in a fifth of the time. The compiler does not know these: where the front end is machine
code it takes values for dataclasses (`hatch_build.py`), and `machine` gives them the rest.
"""

from __future__ import annotations

import copyreg
from collections.abc import Callable
from operator import attrgetter
from typing import Any, TypeVar, dataclass_transform

from msgspec import defstruct

_T = TypeVar("_T")


@dataclass_transform(frozen_default=True)
def value(cls: type[_T]) -> type[_T]:
    """Make a class a frozen value of its annotated fields: compared, hashed and shown by them, with slots for them.

    Methods of its own count. It must have no bases, and its defaults are shared by all values.
    """
    own = {name: member for name, member in vars(cls).items() if name not in ("__dict__", "__weakref__")}
    types: dict[str, Any] = own.pop("__annotations__", {})
    fields = [(name, types[name], own.pop(name)) if name in own else (name, types[name]) for name in types]
    made: Any = defstruct(cls.__name__, fields, namespace=own, frozen=True)
    return made  # type: ignore[no-any-return]


def machine(cls: type) -> None:
    """Give a class whose fields and constructor are machine code the rest of a value."""
    for name, shared in _shared(tuple(vars(cls).get("__annotations__", ()))).items():
        if name not in vars(cls):
            setattr(cls, name, shared)


def replace(value: _T, /, **changes: Any) -> _T:
    """The same value with other fields."""
    names: tuple[str, ...] = type(value).__match_args__  # type: ignore[attr-defined]
    return type(value)(**{name: getattr(value, name) for name in names} | changes)


def quick(*classes: type) -> None:
    """Teach classes how to be pickled if they are machine code: what the compiler gives them for that writes into
    fields, which are frozen. It stands behind the classes: the compiler leaves decorated ones to the interpreter."""
    for cls in classes:
        if is_compiled(cls):
            copyreg.pickle(cls, _parts)


def is_compiled(cls: type) -> bool:
    """Whether a class is machine code."""
    return hasattr(cls, "__mypyc_attrs__")


def _parts(value: Any) -> tuple[Any, ...]:
    """What a value is made from anew."""
    return type(value), tuple([getattr(value, name) for name in type(value).__match_args__])


def _shared(names: tuple[str, ...]) -> dict[str, Any]:
    """What all values of some fields have."""
    get = _getter(names)
    frozen = {"__setattr__": _refuse, "__delattr__": _refuse, "__match_args__": names}
    return {"__eq__": _eq(get), "__hash__": _hash(get), "__repr__": _repr(names), **frozen}


def _getter(names: tuple[str, ...]) -> Callable[[Any], Any]:
    """Gives the fields of a value."""
    return attrgetter(*names) if len(names) > 1 else _single(attrgetter(*names)) if names else lambda _: ()


def _single(get: Callable[[Any], Any]) -> Callable[[Any], tuple[Any, ...]]:
    return lambda value: (get(value),)


def _eq(get: Callable[[Any], Any]) -> Callable[[Any, Any], Any]:
    def __eq__(self: Any, other: object) -> Any:
        return get(self) == get(other) if other.__class__ is self.__class__ else NotImplemented

    return __eq__


def _hash(get: Callable[[Any], Any]) -> Callable[[Any], int]:
    def __hash__(self: Any) -> int:
        return hash(get(self))

    return __hash__


def _repr(names: tuple[str, ...]) -> Callable[[Any], str]:
    def __repr__(self: Any) -> str:
        shown = ", ".join(f"{name}={getattr(self, name)!r}" for name in names)
        return f"{type(self).__qualname__}({shown})"

    return __repr__


def _refuse(self: Any, name: str, *_: Any) -> None:
    raise AttributeError(f"{name} of a {type(self).__name__} is frozen")
