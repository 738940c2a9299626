"""What `grad` makes of a function, and the form of its answers.

Owns `GradientFunction` and `in_given_form`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from msgspec.structs import replace

from potto.python.accepting import as_given
from potto.python.described import typeset_derivative
from potto.python.functions import Function, bound
from potto.python.slopes import Gradient
from potto.runtime.answers.records import named


class GradientFunction:
    """A function that also answers with its derivatives by some of its parameters."""

    def __init__(self, function: Function, wrt: tuple[str, ...]) -> None:
        self._function = function
        self._wrt = wrt

    def __call__(self, *args: Any, **kwargs: Any) -> Gradient:
        args, kwargs = self._function.by_place(args, kwargs)
        known = None if kwargs else self._function.at_once(args, self._wrt)
        if known is not None:
            assert isinstance(known, Gradient)
            return known
        found = self._function.in_tiles(args, kwargs, self._wrt)
        assert isinstance(found, Gradient)
        return in_given_form(found, self._function, args, kwargs)

    def _repr_latex_(self) -> str | None:
        """For notebooks: the derivative as a formula, with its interior and its boundary."""
        return typeset_derivative(self._function._world, self._function._file, self._function._expr)

    def __repr__(self) -> str:
        return f"<gradient of {self._function!r} by {', '.join(self._wrt)}>"


def in_given_form(found: Gradient, function: Function, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Gradient:
    """The gradient in the form of what was given: by a record a record, or a dict where that is one, by a tuple that is
    an array an array."""
    given = dict(bound(function, args, kwargs))
    if all(isinstance(argument, float | int) for argument in given.values()):
        return found
    types = {name: function.type_of(name) for name in found.wrt}

    def form(parts: Any, own: Callable[[str, Any], Any]) -> Any:
        each = [own(name, part)
                for name, part in zip(found.wrt, parts if len(found.wrt) > 1 else (parts,), strict=True)]  # fmt: skip
        return tuple(each) if len(each) > 1 else each[0]

    def as_it_was(name: str, part: Any) -> Any:
        return as_given(given.get(name), named(part, types[name]), types[name])

    sides = [form(side, as_it_was) for side in (found.tangent, found.tangent_error)]
    dicts = any(isinstance(given.get(name), Mapping | list) for name in found.wrt)
    records = [form(side, lambda name, part: named(part, types[name])) for side in sides] if dicts else None
    return replace(found, tangent=sides[0], tangent_error=sides[1], as_records=records)
