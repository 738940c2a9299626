"""Blocks of a batch as they travel to who evaluates them.

Owns `Task`, `Tiled` and `whole`, which evaluates one.
"""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any, Protocol

from msgspec import Struct
from msgspec.structs import asdict

from potto.diagnostics import PottoError
from potto.evaluating.world import World
from potto.integrate.costs import counting
from potto.kernels.cells import Value
from potto.projects.settings import Settings, settings
from potto.python.arguments import Batch
from potto.python.calls import Call
from potto.python.derived_calls import gradient
from potto.runtime.answers.estimate import Estimate


class Tiled(Protocol):
    """A function as tiles know it."""

    _world: World
    _file: str

    def bare(self) -> Tiled:
        """Itself without arguments, as it travels."""

    def _arguments(self, given: Any) -> tuple[list[tuple[str, Value]], Batch]: ...

    def _call(self, given: Any) -> Call: ...


class Task(Struct, frozen=True):
    """Blocks of a batch as they travel: the function, its arguments in one row of members for each block, what it is
    differentiated by, how numbers are asked for, and whether books are kept of what they cost."""

    function: Tiled
    blocks: tuple[Any, ...]
    wrt: tuple[str, ...]
    settings: Settings
    counted: bool = False

    def answers(self) -> list[Estimate] | None:
        """The answers, block by block; None if there is an error, which is then met again by who asks."""
        found = []
        with settings(**asdict(self.settings), executor=None), counting() if self.counted else nullcontext():
            try:
                for given in self.blocks:
                    arguments, batch = self.function._arguments(given)
                    found.append(whole(self.function, given, self.wrt, arguments, batch))
            except PottoError:
                return None
        return found


def whole(
    function: Tiled, given: Any, wrt: tuple[str, ...], arguments: list[tuple[str, Value]], batch: Batch
) -> Estimate:
    """The estimate of a call for all members of a batch at once, with its derivatives by `wrt`."""
    call = function._call(given)
    return gradient(call, arguments, wrt, batch) if wrt else call.run([value for _, value in arguments], batch)
