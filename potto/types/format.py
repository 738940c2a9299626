"""Types as text, the same everywhere: hover, prompt, messages.

`(c: Real, shader: (Real*, Real*) -> Real -> Real) -> Real`. A group of one unnamed parameter that is neither a tuple
nor a function needs no parentheses. Type variables are printed `a`, `b`, … in the order of their appearance.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import assert_never

from potto.types.types import (
    AnySize,
    ArrayOf,
    Count,
    Diffeo,
    Dist,
    Function,
    Meta,
    Parameter,
    Real,
    Shifted,
    SizeVar,
    Truth,
    TupleOf,
    Type,
    TypeVariable,
    Unknown,
    resolve,
    shifted,
)
from potto.types.unify import size_name


def format_type(type: Type) -> str:
    """A type as it is printed everywhere."""
    return _Printer().text(type)


def format_types(types: Sequence[Type]) -> tuple[str, ...]:
    """Several types of one message: the same variable has the same name in all of them."""
    printer = _Printer()
    return tuple(printer.text(type) for type in types)


class _Printer:
    def __init__(self) -> None:
        self._names: dict[object, str] = {}
        self._sizes: set[str] = set()

    def text(self, type: Type) -> str:
        type = resolve(type)
        if isinstance(type, Shifted):
            type = shifted(type, 0)
        match type:
            case Real(star, variables):
                return "Real" + ("*" if star else "") + _over(variables)
            case Dist(variables):
                return "Dist" + _over(variables)
            case TupleOf(record=record) if record is not None:
                return record.shown
            case TupleOf(items):
                return f"({', '.join(map(self.text, items))})"
            case ArrayOf():
                return self._array(type)
            case Count(number):
                return str(number)
            case SizeVar(name):
                return name
            case Shifted(base, offset):
                return f"{self.text(base)} {'-' if offset < 0 else '+'} {abs(offset)}"
            case AnySize():
                return "_"
            case Function(parameters, result):
                return f"{self._group(parameters)} -> {self.text(result)}"
            case Diffeo(dims):
                return f"Diffeo[{'n' if dims is None else dims}]"
            case Truth():
                return "a comparison"
            case TypeVariable(name):
                return self._variable(name)
            case Meta(size=size) if size is not None:
                return self._size(type, size)
            case Meta():
                return self._variable(type)
            case Unknown():
                return "?"
            case _:
                assert_never(type)

    def _array(self, type: ArrayOf) -> str:
        """`[n, m] T`, the sizes of arrays of arrays in one bracket."""
        sizes, item = [self.text(type.size)], resolve(type.item)
        while isinstance(item, ArrayOf):
            sizes.append(self.text(item.size))
            item = resolve(item.item)
        text = self.text(item)
        return f"[{', '.join(sizes)}] {f'({text})' if isinstance(item, Function) else text}"

    def _size(self, key: object, wanted: str) -> str:
        if key not in self._names:
            self._names[key] = size_name(wanted, self._sizes)
        return self._names[key]

    def _group(self, parameters: tuple[Parameter, ...]) -> str:
        if len(parameters) == 1 and parameters[0].name is None:
            only = resolve(parameters[0].type)
            text = self.text(only)
            tuple_ = isinstance(only, TupleOf) and only.record is None
            return f"({text})" if tuple_ or isinstance(only, Function) else text
        return f"({', '.join(map(self._parameter, parameters))})"

    def _parameter(self, parameter: Parameter) -> str:
        text = self.text(parameter.type)
        return text if parameter.name is None else f"{parameter.name}: {text}"

    def _variable(self, key: object) -> str:
        if key not in self._names:
            number = len(self._names) - len(self._sizes)
            self._names[key] = chr(ord("a") + number % 26) + (str(number // 26) if number >= 26 else "")
        return self._names[key]


def _over(variables: tuple[str, ...]) -> str:
    return f"[{', '.join(variables)}]" if variables else ""
