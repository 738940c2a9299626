"""What the paper's studies measure with: seconds of the processor, sizes of programs, and the lines of their tables.

Owns `Compiled`, `timed`, `shown` and `size`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import potto


class Compiled(NamedTuple):
    """A program: seconds of compiling and of evaluating, how many terms it is made of, and how far its answers are off;
    of figures that others have published the last is nan."""

    name: str
    compiling: float
    evaluating: float
    size: int
    off: float = float("nan")

    @property
    def total(self) -> float:
        return self.compiling + self.evaluating

    def __str__(self) -> str:
        times = " ".join(f"{shown(s):>10}" for s in (self.compiling, self.evaluating, self.total))
        off = "" if self.off != self.off else f"{self.off:8.0e}"
        return f"  {self.name:34} {times} {self.size or '':>6} {off}".rstrip()


HEAD = f"  {'':34} {'compile':>10} {'evaluate':>10} {'total':>10} {'size':>6} {'off by':>8}"


def shown(seconds: float) -> str:
    return (
        f"{seconds:.2f} s"
        if seconds >= 1
        else f"{seconds * 1e3:.2f} ms"
        if seconds >= 1e-4
        else f"{seconds * 1e6:.0f} us"
    )


def timed(run: Callable[[], Any], times: int = 1) -> tuple[float, Any]:
    """The least time of the processor of several runs, and what the last gave."""
    spent, found = [], None
    for _ in range(times):
        start = time.process_time()
        found = run()
        spent.append(time.process_time() - start)
    return min(spent), found


def size(module: potto.Module) -> int:
    """How many different terms the definitions of a program are made of, as they are compiled."""
    from potto.core.terms import postorder
    from potto.elaborate import core
    from potto.modules import names

    db, file = module._world.db, module._file
    return sum(len(list(postorder(core(db, file, name).term))) for name in names(db, file))
