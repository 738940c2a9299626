"""Frozen dataclasses that are made in less time: the front end makes a hundred of them for every line of a program.

The `__init__` that `dataclass` writes for a frozen class goes through `object.__setattr__`, field by field. Writing
through the descriptors of the slots takes half as long, and everything else stays as it is.
"""

from __future__ import annotations

import copyreg
from collections.abc import Callable
from dataclasses import MISSING, fields
from functools import cache
from typing import Any


def quick(*classes: type) -> None:
    """Give classes under `@dataclass(frozen=True, slots=True)` a faster `__init__` with the same signature.

    It stands behind the classes and is no decorator: the compiler leaves decorated classes to the interpreter. Those
    that are machine code are fast already; they learn how to be pickled, for what the compiler gives them for that
    writes into fields, which are frozen.

    A class with more to its signature than fields and defaults keeps its own.
    """
    for cls in classes:
        if is_compiled(cls):
            copyreg.pickle(cls, _parts)
        else:
            _quicken(cls)


def is_compiled(cls: type) -> bool:
    """Whether a class is machine code."""
    return hasattr(cls, "__mypyc_attrs__")


def _parts(value: Any) -> tuple[Any, ...]:
    """What a value is made from anew."""
    return type(value), tuple([getattr(value, f.name) for f in fields(value)])


def _quicken(cls: type) -> None:
    found = fields(cls)
    more = any(f.default_factory is not MISSING or f.kw_only or not f.init for f in found)
    if not found or more or hasattr(cls, "__post_init__"):
        return
    writers = [getattr(cls, f.name).__set__ for f in found]
    init = _template(len(found))(*writers)
    init.__code__ = init.__code__.replace(co_varnames=("self", *(f.name for f in found)))
    init.__defaults__ = tuple(f.default for f in found if f.default is not MISSING)
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    cls.__init__ = init  # type: ignore[misc]


@cache
def _template(count: int) -> Callable[..., Any]:
    """Makes an `__init__` of so many fields from the writers of their slots; the names of its parameters follow."""
    writers, values = [f"w{n}" for n in range(count)], [f"v{n}" for n in range(count)]
    body = "; ".join(f"{w}(self, {v})" for w, v in zip(writers, values))
    text = f"def make({', '.join(writers)}):\n def __init__(self, {', '.join(values)}): {body}\n return __init__"
    made: dict[str, Any] = {}
    exec(text, made)
    return made["make"]  # type: ignore[no-any-return]
