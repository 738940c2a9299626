"""Derivatives by several parameters as answers.

Owns `Gradient`, a value with its derivatives, and `Slopes`, these alone. Where a record was given as a dict both have
dicts, and are shown by the record's name all the same.
"""

from __future__ import annotations

from typing import Any

from potto.runtime.answers.arithmetic import Pair
from potto.runtime.answers.estimate import Estimate


class Gradient(Estimate, frozen=True, eq=False):
    """An estimate with derivatives by several parameters: `gradient["c"]`, or `tangent` for all of them.

    as_records: the derivatives and their errors as they are shown, where records were given as dicts.
    """

    wrt: tuple[str, ...] = ()
    as_records: Any = None

    @property
    def _shown(self) -> Pair:
        if self.as_records is None:
            return super()._shown
        return (self.value, self.as_records[0]), (self.error, self.as_records[1])

    def __getitem__(self, name: Any) -> Any:
        """The derivative by a parameter; at a place, the value (0) or the derivatives (1) as an estimate."""
        if not isinstance(name, str):
            return super().__getitem__(name)
        place = _place(name, self.wrt)
        return self.tangent if len(self.wrt) == 1 else self.tangent[place]


class Slopes(Estimate, frozen=True, eq=False):
    """The derivatives of a gradient as what is asked for. wrt, as_records: as in `Gradient`."""

    wrt: tuple[str, ...] = ()
    as_records: Any = None

    @classmethod
    def of(cls, found: Gradient) -> Slopes:
        parts = {name: getattr(found, name) for name in Estimate.__struct_fields__}
        alone = {"value": found.tangent, "error": found.tangent_error, "tangent": None, "tangent_error": None}
        return cls(**parts | alone, wrt=found.wrt, as_records=found.as_records)

    def __getitem__(self, index: Any) -> Any:
        """The derivative by a parameter, or at a place, as an estimate."""
        if not isinstance(index, str):
            return super().__getitem__(index)
        place = _place(index, self.wrt)
        return self if len(self.wrt) == 1 else super().__getitem__(place)

    @property
    def _shown(self) -> Pair:
        return super()._shown if self.as_records is None else self.as_records


def _place(name: str, wrt: tuple[str, ...]) -> int:
    """Where a parameter is. Raises KeyError, which says what there is."""
    if name not in wrt:
        raise KeyError(f"there is no derivative by {name!r} here, but by {', '.join(wrt)}")
    return wrt.index(name)
