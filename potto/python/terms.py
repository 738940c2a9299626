"""Terms as functions of numbers: what is found in symbols and was never written, called as a program's functions are.

Owns `TermFunction`.
"""

from __future__ import annotations

from typing import Any

from potto.core.terms import Lam, Term
from potto.evaluating.world import World
from potto.kernels.cells import Cell, Value
from potto.python.arguments import Batch, batch_of, value_of
from potto.python.calls import Call
from potto.python.derived_calls import gradient
from potto.python.slopes import Gradient
from potto.runtime.answers.estimate import Estimate
from potto.source import Span
from potto.syntax import nodes

_UNWRITTEN = nodes.Number(Span(0, 0), "0", 0.0)  # a call has an expression, and this one is not asked for it


class _TermCall(Call, frozen=True, eq=False, kw_only=True):
    """The call of a term, which is elaborated as it is."""

    term: Term

    @property
    def elaborated(self) -> Term:
        return self.term


class TermFunction:
    """A term as a function of numbers and arrays, which broadcast; the settings of `file` count."""

    def __init__(self, world: World, file: str, term: Lam) -> None:
        self._names = term.params
        self._call = _TermCall(world, file, _UNWRITTEN, ((len(term.params), ()),), term=term)

    def __call__(self, *args: Any) -> Estimate:
        known = self._call.at_once(args)
        if known is not None:
            return known
        given, batch = self._given(args)
        values = [value for _, value in given]
        found = self._call.run(values, batch)
        if batch.size == 1:
            self._call.keep(args, values, found)
        return found

    def values(self, *args: Any) -> Any:
        """The numbers alone, as pictures need them: an array in the shape of the arguments, or a float. Raises
        PottoError."""
        if self._call.world.program.linker.inexact(self._call.term):  # an integral has shorter ways to be called again
            return self(*args).value
        given, batch = self._given(args)
        found = self._call.value([value for _, value in given])
        assert isinstance(found, Cell)
        return batch.restored(found.v, own=True)

    def gradient(self, wrt: str, *args: float) -> Gradient:
        """The value with the derivative by one of the parameters."""
        known = self._call.at_once(args, (wrt,))
        if known is not None:
            assert isinstance(known, Gradient)
            return known
        given, batch = self._given(args)
        return gradient(self._call, given, (wrt,), batch)

    def _given(self, args: tuple[Any, ...]) -> tuple[list[tuple[str, Value]], Batch]:
        named = list(zip(self._names, args, strict=True))
        batch = batch_of(named)
        return [(name, value_of(name, arg, batch, lambda _: None)) for name, arg in named], batch
