"""Shown derivatives as programs: what is displayed becomes a definition, is checked, and evaluated at random points."""

from __future__ import annotations

import math
import os
import random
import re
from dataclasses import dataclass

import numpy as np

import potto
from potto.calculus.explanation.explain import explain_derivative
from potto.calculus.explanation.layout import DerivativeText
from potto.checking.library import Library
from potto.types import Type, derivative_type, format_type, groups_of, interface
from potto.types.types import ArrayOf, Count, Function, TupleOf, resolve

SHOWN = "shown_1"


@dataclass(frozen=True)
class Given:
    """What a parameter is given: its value, its tangent, and both as a derivative takes them."""

    value: str
    tangent: str
    dual: str


class Shown:
    """The derivative of a definition as it is shown, beside the definition in its own file."""

    def __init__(self, text: str, name: str, file: str = "<text>") -> None:
        self._library = library = Library([os.path.dirname(file) or "."])
        self.file = library.put(file, text)
        type = interface(library.db, self.file, name).type
        self.name, self.groups = name, groups_of(type)
        self.text: DerivativeText = explain_derivative(library.db, self.file, name)
        shown = [self.text.tangent, *self._parts()]
        self.program = text + "".join(f"\n\n{self._head(n)}\n    {part}\n" for n, part in enumerate(shown, 1))

    def _parts(self) -> list[str]:
        """The integrals around interior and boundary, and the boundary terms, but what is no program: the derivative of
        a delta, and what stands in a sum over an index."""
        found: list[str] = []
        for item in self.text.integrals:
            if not item.each:
                inside = (item.interior, *item.deltas)
                found += [*(item.over(part) for part in inside if part), *item.boundary, *item.bounds]
        return [part for part in found if "delta'" not in part]

    def _head(self, number: int) -> str:
        parameters = [p for group in self.groups for p in group]
        values = [f"{p.name}: {_written(p.type)}" for p in parameters]
        tangents = [f"d{p.name}: {_tangent_type(p.type)}" for p in parameters]
        return f"def {SHOWN[:-1]}{number}({', '.join(values + tangents)})"

    def problems(self) -> list[str]:
        """What the check of the formula says: of the file as it is when that is written below."""
        self._library.put(self.file, self.program)
        return [located.diagnostic.message for located in self._library.errors(self.file)]

    def module(self) -> potto.Module:
        return potto.Workspace(os.path.dirname(self.file) or ".").compile(self.program)

    def given(self, rng: random.Random, whole: bool = False) -> list[list[Given]]:
        """Values and tangents for the parameters; `whole`: numbers are whole and stand still."""
        return [[_given(p.type, rng, whole) for p in group] for group in self.groups]

    def formula(self, given: list[list[Given]]) -> str:
        flat = [item for group in given for item in group]
        return f"{SHOWN}({', '.join([g.value for g in flat] + [g.tangent for g in flat])})"

    def derivative(self, given: list[list[Given]]) -> str:
        calls = "".join(f"({', '.join(item.dual for item in group)})" for group in given)
        return f"snd(deriv({self.name}){calls})"


def _written(type: Type) -> str:
    """As it is given here: by constants, for what may be of any type numbers."""
    text = re.sub(r"\b[abc]\b", "Real", format_type(type))
    return text if "->" in text else text.replace("Real*", "Real")


def _tangent_type(type: Type) -> str:
    return _written(derivative_type(type)) if isinstance(resolve(type), Function) else _written(type)


def _given(type: Type, rng: random.Random, whole: bool) -> Given:
    type = resolve(type)
    if isinstance(type, Function):
        text = _function(type, rng)
        return Given(text, f"deriv({text})", f"deriv({text})")
    value, tangent = _value(type, rng, whole), _value(type, rng, False)
    if whole and not isinstance(type, TupleOf | ArrayOf):
        tangent = "0"
    return Given(value, tangent, f"({value}, {tangent})")


def _value(type: Type, rng: random.Random, whole: bool) -> str:
    match resolve(type):
        case TupleOf(items=items, record=record):
            inner = ", ".join(_value(item, rng, whole) for item in items)
            return f"{record.name}({inner})" if record is not None else f"({inner}{',' if len(items) == 1 else ''})"
        case ArrayOf(size=size, item=item):
            many = size.number if isinstance(size, Count) else 3
            return f"[{', '.join(_value(item, rng, whole) for _ in range(many))}]"
        case _:
            return rng.choice("23") if whole else str(round(rng.uniform(0.2, 0.9), 3))


def _function(type: Function, rng: random.Random) -> str:
    """A smooth function of numbers, written out group by group."""
    groups = groups_of(type)
    names = [[f"a{i}_{j}" for j in range(len(group))] for i, group in enumerate(groups)]
    head = "".join(f"\\({', '.join(group)}) . " if len(group) > 1 else f"\\{group[0]} . " for group in names)
    terms = [f"{round(rng.uniform(0.2, 0.9), 2)}*{name}^2" for group in names for name in group]
    return f"({head}{' + '.join(['0.1', *terms])})"


def numbers(answer: object) -> np.ndarray:
    if isinstance(answer, tuple | list):
        return np.concatenate([numbers(item).ravel() for item in answer] or [np.zeros(0)])
    return np.array(answer, dtype=float)


def near(a: object, b: object, tolerance: float = 1e-6) -> bool:
    first, second = numbers(a).ravel(), numbers(b).ravel()
    return first.shape == second.shape and bool(np.allclose(first, second, rtol=tolerance, atol=tolerance / 10))


def has_value(answer: object) -> bool:
    return all(math.isfinite(x) for x in numbers(answer).ravel())
