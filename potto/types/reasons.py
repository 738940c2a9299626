"""Why a definition's parameters must not vary, with places: what messages about its callers show.

Not part of the interface, because edits move it.
"""

from __future__ import annotations

from msgspec import Struct

from potto.modules.lookup import DefinitionTarget
from potto.source import Span
from potto.types.values import SinkKind, Step


class Reason(Struct, frozen=True):
    """Why an input must not vary: what it is ("its parameter `y`"), the place in the definition, and the way there.

    `further`: it is passed on to another definition's input, which must not vary.
    """

    kind: SinkKind
    number: int
    parameter: str
    span: Span
    steps: tuple[Step, ...]
    text: str
    further: tuple[DefinitionTarget, int] | None


class GivenVariable(Struct, frozen=True):
    """Which variable of integration a definition gives to a function that is its parameter."""

    number: int
    variable: str
    span: Span
    further: tuple[DefinitionTarget, int] | None


class Reasons(Struct, frozen=True):
    """What a definition demands and why, with places. Not part of the interface: edits move it."""

    plain: tuple[Reason, ...] = ()
    given: tuple[GivenVariable, ...] = ()

    def reason(self, kind: SinkKind, number: int) -> Reason | None:
        return next((r for r in self.plain if r.kind == kind and r.number == number), None)

    def given_at(self, number: int) -> GivenVariable | None:
        return next((g for g in self.given if g.number == number), None)


NO_REASONS = Reasons()
