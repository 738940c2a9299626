"""The functions that generated kernels call by name.

Owns `function`, which finds them: "sqrt" is numpy's, "special.erf" scipy's (imported at the first use), "potto.clamp"
one of `potto.kernels.ufuncs`, "whole.add" one of `potto.kernels.whole`, "support.select" one of those below.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from potto.kernels.cells import Cell, Mask, Number, Value
from potto.kernels.errors import wrong_call
from potto.kernels.whole import ROUNDING


@lru_cache(maxsize=256)
def function(path: str) -> Callable[..., Any]:
    """The function that an entry of the registry names."""
    where, _, name = path.rpartition(".")
    if where == "special":
        return getattr(importlib.import_module("scipy.special"), name)  # type: ignore[no-any-return]
    if where == "potto":
        return getattr(importlib.import_module("potto.kernels.ufuncs"), name)  # type: ignore[no-any-return]
    if where == "whole":
        return ROUNDING[name]
    if where == "support":
        return globals()[name]  # type: ignore[no-any-return]
    return getattr(np, name)  # type: ignore[no-any-return]


def select(mask: Mask, a: Number, b: Number) -> Number:
    """a where the mask holds, b elsewhere: by selection, so that what is not taken can't spoil the result."""
    if isinstance(mask, np.ndarray):
        return np.where(mask, a, b)
    return a if mask else b


def select_value(mask: Mask, a: Value, b: Value) -> Value:
    """`select` for values of any kind; both must have the same structure."""
    if not isinstance(mask, np.ndarray):
        return a if mask else b
    if isinstance(a, Cell) and isinstance(b, Cell):
        k = max(len(a.t), len(b.t))

        def part(x: Number | None, y: Number | None) -> Number | None:
            if x is None and y is None:
                return None
            return select(mask, 0.0 if x is None else x, 0.0 if y is None else y)

        def parts(x: tuple[Number | None, ...], y: tuple[Number | None, ...]) -> tuple[Number | None, ...]:
            x, y = x or (None,) * k, y or (None,) * k
            return tuple(map(part, x, y))

        return Cell(select(mask, a.v, b.v), part(a.e, b.e), parts(a.t, b.t), parts(a.et, b.et))
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        return tuple(select_value(mask, x, y) for x, y in zip(a, b, strict=True))
    if a is b:
        return a
    raise wrong_call("the two sides of a conditional over a batch of points are not of the same kind")
