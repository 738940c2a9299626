"""The functions that generated kernels call by name.

Owns `function`, which finds them: "sqrt" is numpy's, "special.erf" scipy's (imported at the first use), "potto.clamp"
one of `potto.kernels.ufuncs`, "whole.add" one of `potto.kernels.whole`, "tape.linear" of `potto.kernels.tape`,
"support.select" one of those below, "builtin.gamma" the numeric form of a builtin, "places.erfc" and "strays.besselj0"
what these may be off.
`OPS` is the arithmetic of arrays for the rules of entries.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from functools import lru_cache, partial, reduce
from typing import Any

import numpy as np

from potto.core.terms import Branch, Const, If, Term
from potto.kernels import tape
from potto.kernels.cells import Cell, Mask, Number, Rows, Value, combined
from potto.kernels.whole import FUNCTIONS
from potto.primitives import PRIMITIVES, Primitive
from potto.primitives.registry import Elementwise
from potto.primitives.walking import Domain


@lru_cache(maxsize=256)
def function(path: str) -> Callable[..., Any]:
    """The function that an entry of the registry names."""
    where, _, name = path.rpartition(".")
    if where == "special":
        return getattr(importlib.import_module("scipy.special"), name)  # type: ignore[no-any-return]
    if where == "potto":
        return getattr(importlib.import_module("potto.kernels.ufuncs"), name)  # type: ignore[no-any-return]
    if where == "whole":
        return FUNCTIONS[name]
    if where == "builtin":
        return ARRAYS.function(name)
    if where == "tape":
        return getattr(tape, name)  # type: ignore[no-any-return]
    if where == "places":
        return PRIMITIVES[name].places
    if where == "strays":
        return PRIMITIVES[name].strays
    if where == "support":
        return globals()[name]  # type: ignore[no-any-return]
    return getattr(np, name)  # type: ignore[no-any-return]


class Arrays(Domain[Any]):
    """Values of terms over batches, without errors and tangents."""

    def constant(self, node: Const) -> Any:
        return node.value

    def rule(self, entry: Primitive) -> Callable[..., Any] | None:
        return _numeric(entry.name)

    def unknown(self) -> Any:
        return np.nan

    def other(self, node: Term, known: Mapping[Term, Any]) -> Any:
        if isinstance(node, Branch):
            side = known[node.surface]
            return np.where(side > 0 if node.strict else side >= 0, known[node.then], known[node.orelse])
        if isinstance(node, If):
            return np.where(known[node.condition], known[node.then], known[node.orelse])
        return np.nan

    def function(self, op: str) -> Callable[..., Any]:
        """The numeric form of a builtin."""
        return _numeric(op) or _guarded(PRIMITIVES[op], lambda *args: self.apply(op, args))


ARRAYS = Arrays()


@lru_cache(maxsize=256)
def _numeric(op: str) -> Callable[..., Any] | None:
    """What an entry names; nan outside of where the builtin is defined."""
    entry = PRIMITIVES[op]
    if not entry.numpy:
        return None
    own = function(entry.numpy)
    if entry.arity is None:
        return lambda *args: reduce(own, args)
    return _guarded(entry, own)


def _guarded(entry: Primitive, own: Callable[..., Any]) -> Callable[..., Any]:
    if not entry.guarded:
        return own
    least, most = entry.within
    return lambda *args: own(*args[:-1], select((args[-1] >= least) & (args[-1] <= most), args[-1], np.nan))


class _Ops:
    """`Elementwise` of arrays."""

    where = staticmethod(np.where)
    least = staticmethod(np.minimum)
    most = staticmethod(np.maximum)
    finite = staticmethod(np.isfinite)
    of = staticmethod(ARRAYS.function)


OPS: Elementwise = _Ops()


def select(mask: Mask, a: Number, b: Number) -> Number:
    """a where the mask holds, b elsewhere: by selection, so that what is not taken can't spoil the result."""
    if isinstance(mask, np.ndarray):
        return np.where(mask, a, b)
    return a if mask else b


def beside(surface: Number, tangent: Number, side: float) -> Mask:
    """On which side of 0 a number is; where it is 0, on which it comes to be, or from which it comes (side = -1)."""
    return (surface > 0) | ((surface == 0) & (side * tangent > 0))


def by_error(off: Number, error: Number) -> Number:
    """What a builtin is off by what an argument is: nothing where that is exact, also if infinity times 0 is nan."""
    if not isinstance(off, np.ndarray):
        return 0.0 if off != off and error == 0 else off
    return np.where(np.equal(error, 0), 0.0, off) if np.isnan(off.sum()) else off


def by_exponent(base: Number, off: Number) -> Number:
    """What a power, or its slope, is off by what its exponent is, worked out for a positive base: at one that is not
    positive exponents are whole, and so exact."""
    return np.where(np.asarray(base) > 0, off, 0.0)


def select_value(mask: Mask, a: Value, b: Value) -> Value:
    """`select` for values of any kind; both must have the same structure, but for functions, of which it is either."""
    if not isinstance(mask, np.ndarray):
        return a if mask else b
    if isinstance(a, tuple | list) and isinstance(b, type(a)) and len(a) == len(b):
        return type(a)([select_value(mask, *items) for items in zip(a, b, strict=True)])
    if a is b or isinstance(a, Cell | Rows | list | tuple):
        return combined(partial(select, mask), a, b)
    return a.or_other(b, mask)
