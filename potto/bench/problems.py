"""The problems of the bench: integrals that jump, with answers to 30 digits.

Owns `BenchProblem` and `catalogue`. A problem is given twice, as a Potto program and in Python's notation for peers
that know no Potto; its answers come from closed forms, never from a program of ours.
"""

from __future__ import annotations

import ast
import json
from collections.abc import Mapping
from functools import cached_property
from importlib.resources import files
from types import CodeType
from typing import Any, Literal

from msgspec import Struct

Quantity = Literal["value", "derivative"]
QUANTITIES: tuple[Quantity, ...] = ("value", "derivative")


class BenchProblem(Struct, frozen=True, dict=True):
    """An integral over a box, as a function of one parameter.

    program: defines `f`. integrand: in Python's notation, over the variables and the parameter; `H(u)` is [u >= 0].
    bounds: of the variables, outermost first. at: where the parameter is. exact: the value and the derivative there.
    """

    id: str
    title: str
    why: str
    program: str
    integrand: str
    variables: tuple[str, ...]
    bounds: tuple[tuple[float, float], ...]
    parameter: str
    at: float
    exact: Mapping[Quantity, float]

    @property
    def dimensions(self) -> int:
        return len(self.variables)

    @property
    def volume(self) -> float:
        """Of the box."""
        size = 1.0
        for lo, hi in self.bounds:
            size *= hi - lo
        return size

    def error(self, quantity: Quantity, answer: float) -> float:
        """How far an answer is off, relative to the exact one."""
        exact = self.exact[quantity]
        return abs(answer - exact) / abs(exact)

    @cached_property
    def _code(self) -> CodeType:
        text = f"lambda {', '.join((*self.variables, self.parameter))}: {self.integrand}"
        return compile(ast.parse(text, mode="eval"), f"<{self.id}>", "eval")

    def function(self, names: Mapping[str, Any]) -> Any:
        """The integrand as a function of the variables and the parameter, with `exp`, `H` and so on from `names`."""
        return eval(self._code, {"__builtins__": {}, **names})  # our own file, not a user's text


def catalogue() -> tuple[BenchProblem, ...]:
    """All problems, in the order of the report."""
    text = files("potto.bench").joinpath("catalogue.json").read_text(encoding="utf-8")
    return tuple(_problem(case) for case in json.loads(text)["cases"])


def _problem(case: Mapping[str, Any]) -> BenchProblem:
    spec, wrt = case["spec"], case["wrt"]
    return BenchProblem(
        id=case["id"],
        title=case["math"],
        why=case["why"],
        program="\n".join(case["program"]),
        integrand=spec["integrand"],
        variables=tuple(v[0] for v in spec["vars"]),
        bounds=tuple((float(v[1]), float(v[2])) for v in spec["vars"]),
        parameter=wrt,
        at=float.fromhex(case["params_hex"][wrt]),
        exact={"value": float(case["value_exact"]), "derivative": float(case["exact"])},
    )
