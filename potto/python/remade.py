"""Functions that are made of functions of Potto, and travel by how they were made.

Owns `remade`. What `potto.jacobian(f)` or `potto.to_jax(f)` gives is a closure, and those do not pickle: processes are
sent what it was made from, and make it again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


class Remade:
    """A function that is made again where it is unpickled. It has the name and the text of the one it was made from."""

    def __init__(
        self, maker: Callable[..., Any], args: tuple[Any, ...], kwargs: Mapping[str, Any], made: Callable[..., Any]
    ) -> None:
        self._maker, self._args, self._kwargs, self._made = maker, args, kwargs, made
        self._function = args[0] if args else kwargs["function"]
        self.__name__ = self.__qualname__ = getattr(self._function, "written", maker.__name__)
        self.__doc__ = self._function.__doc__

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self._made(*args, **kwargs)

    def __reduce__(self) -> tuple[Any, ...]:
        return _make, (self._maker, self._args, self._kwargs)

    def __repr__(self) -> str:
        return f"<{self._maker.__name__} of {self._function!r}>"


def remade(maker: Callable[P, Callable[..., R]]) -> Callable[P, Callable[..., R]]:
    """Let what a function makes of its first argument, `function`, pickle as that function with its arguments."""

    @wraps(maker)
    def made(*args: P.args, **kwargs: P.kwargs) -> Callable[..., R]:
        return Remade(made, args, kwargs, maker(*args, **kwargs))

    return made


def _make(maker: Callable[..., Any], args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> Any:
    return maker(*args, **kwargs)
