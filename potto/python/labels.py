"""Which parameters the arguments of a call are for.

Owns `labelled`, and `Given`, what calls were given so far.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from potto.kernels.errors import wrong_call
from potto.types.types import Parameter, Type, without_d

Given = tuple[tuple[tuple[Any, ...], dict[str, Any]], ...]  # per call the arguments by place and by name


def labelled(given: Given, groups: tuple[tuple[Parameter, ...], ...]) -> list[tuple[str, Any, Type | None]]:
    """Every argument with the name of its parameter and the type of it, where these are known.

    Keywords bind by name, those of a derivative also by that of what it derives; the others fill the parameters left,
    in order; a call may run over the end of its group.
    """
    found: list[tuple[str, Any, Type | None]] = []
    at = 0
    for args, kwargs in given:
        count = len(args) + len(kwargs)
        parameters: list[Parameter] = []
        while at < len(groups) and (not parameters or len(parameters) < count):
            parameters += groups[at]
            at += 1
        by_name = _by_name(parameters) if kwargs else {}
        named = {id(by_name[name]) for name in kwargs if name in by_name}
        left = [p for p in parameters if id(p) not in named]
        spread = len(args) == 1 and len(left) > 1 and isinstance(args[0], tuple)  # one tuple for a whole group
        if spread and len(args[0]) != len(left):
            wanted = ", ".join(f"`{p.name}`" for p in left)
            raise wrong_call(f"a tuple of {len(args[0])} is given for {wanted}")
        unknown = len(parameters) - len(left) < len(kwargs)  # elaboration says which name is meant
        if len(args) < len(left) and not spread and not unknown:
            missing = ", ".join(f"`{p.name}`" for p in left[len(args) :])
            raise wrong_call(f"no value is given for {missing}")
        for place, argument in enumerate(args):
            known = left[place] if place < len(left) and not spread else None
            name = known.name if known is not None and known.name else f"argument {place + 1}"
            found.append((name, argument, known.type if known is not None else None))
        types = {name: parameter.type for name, parameter in by_name.items()}
        found += [(name, argument, types.get(name)) for name, argument in kwargs.items()]
    return found


def _by_name(parameters: Sequence[Parameter]) -> dict[str, Parameter]:
    duals = {name: parameters[place] for name, place in without_d(parameters).items()}
    return duals | {p.name: p for p in parameters if p.name is not None}
