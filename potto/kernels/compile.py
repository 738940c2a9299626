"""Terms to kernels: one definition, compiled alone, for one pattern of what its arguments carry.

Owns the cache of kernels, whose texts are written by `writing`. It is keyed by content: the digest of the term, the
pattern, and what the term's callees say of themselves through their interfaces; editing a function compiles that
function, and editing it back compiles nothing. What one process has written the next one finds on disk.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from functools import lru_cache
from typing import Any

from potto.core.packing import keep, recall
from potto.core.terms import Global, Lam, Term, postorder
from potto.kernels.cells import Pattern
from potto.kernels.kinks import bends
from potto.kernels.making import compiling, counts, making
from potto.kernels.writing import Runtime, Writer
from potto.kernels.written import Kernel, Written

MOST_KERNELS = 4096


_cache: OrderedDict[Any, Kernel] = OrderedDict()
_cache_lock = threading.Lock()


@lru_cache(maxsize=16384)
def references(term: Term) -> tuple[Global, ...]:
    """The definitions that a term names."""
    return tuple(t for t in postorder(term) if isinstance(t, Global))


def kernel(lam: Lam, patterns: tuple[Pattern, ...], directions: int, rounding: bool, rt: Runtime) -> Kernel:
    """The kernel of a function for arguments of these patterns; from the cache where it is known."""
    callees = tuple(rt.inexact(g) for g in references(lam.body))
    place = (rt.side, rt.root) if (directions and bends(lam.body)) or any(callees) else None
    key = (lam.digest, patterns, directions, rounding, rt.taping, callees, place)
    with _cache_lock:
        found = _cache.get(key)
        if found is not None:
            _cache.move_to_end(key)
            counts.reused += 1
            return found
    with making, compiling:
        name = repr(key).encode()
        written: Written | None = recall("kernels", name)
        if written is None:
            written = Writer(lam, patterns, directions, rounding, rt).written()
            keep("kernels", name, written)
            counts.compiled += 1
        else:
            counts.recalled += 1
        made = written.linked(lam)
    with _cache_lock:
        _cache[key] = made
        if len(_cache) > MOST_KERNELS:
            _cache.popitem(last=False)
    return made


def clear() -> None:
    """Forget all kernels (for tests and measurements)."""
    with _cache_lock:
        _cache.clear()
