"""What the bench asks of a method of integration: the one protocol that ours and the peers' fit into.

Owns `Adapter` and `MethodAnswer`. An adapter turns one dial, from cheap to dear; each setting is a rung of its ladder.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Protocol

from msgspec import Struct

from potto.bench.problems import BenchProblem, Quantity


class MethodAnswer(Struct, frozen=True):
    """One answer: the number, the evaluations of the integrand, and the error that the method itself reports.

    `reported` is None for a method that says nothing about its error.
    """

    value: float
    evaluations: int
    reported: float | None = None


Solve = Callable[[float, int], MethodAnswer]  # a rung of the ladder and a seed to an answer


class Adapter(Protocol):
    """A method of integration as the bench sees it.

    name: as the report shows it. package: what must be installed; None for our own. dial: what a rung is called.
    random: whether answers depend on a seed, so that errors are means over several.
    """

    @property
    def name(self) -> str: ...
    @property
    def package(self) -> str | None: ...
    @property
    def dial(self) -> str: ...
    @property
    def random(self) -> bool: ...

    def missing(self) -> str | None:
        """What is needed and not installed; None if it can run."""

    def ladder(self, problem: BenchProblem) -> Sequence[float]:
        """The settings to try, from cheap to dear; none for a problem that the method does not do."""

    def prepare(self, problem: BenchProblem, quantity: Quantity) -> Solve:
        """The problem made ready (compiled, parsed); this is not timed."""


def installed(package: str) -> str | None:
    """The version of an installed package, else None. Nothing is imported."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None
