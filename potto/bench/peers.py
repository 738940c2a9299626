"""Other people's methods of integration as adapters: those of scipy, vegas, and JAX; and plain sums.

Owns `PEERS`. These know nothing of jumps that move. A method that gives values only is asked for a derivative by
central differences of two values, which is what its users would do. Sums are differentiated as they stand: that is
automatic differentiation of the discretized integral, and it lacks what moves with the jump.
"""

from __future__ import annotations

import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from potto.bench.adapter import MethodAnswer, Solve, installed
from potto.bench.problems import BenchProblem, Quantity

TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
POINTS = tuple(2.0**k for k in range(7, 21))
SUMS = tuple(10.0**k for k in range(2, 8))
SCALAR = {"exp": math.exp, "cos": math.cos, "sqrt": math.sqrt, "H": lambda u: 1.0 if u >= 0 else 0.0}
BATCH = {"exp": np.exp, "cos": np.cos, "sqrt": np.sqrt, "H": lambda u: (u.real >= 0) * 1.0}


class Values(ABC):
    """A method that gives values: derivatives are central differences, the step being the cube root of the accuracy."""

    package: str | None = "scipy"
    random = False
    name: str
    dial = "tolerance"
    dimensions = range(1, 4)
    rungs: Sequence[float] = TOLERANCES

    def missing(self) -> str | None:
        return None if self.package is None or installed(self.package) else self.package

    def ladder(self, problem: BenchProblem) -> Sequence[float]:
        return self.rungs if problem.dimensions in self.dimensions else ()

    @abstractmethod
    def integrate(self, problem: BenchProblem, at: float, rung: float, seed: int) -> MethodAnswer:
        """The integral at one value of the parameter."""

    def prepare(self, problem: BenchProblem, quantity: Quantity) -> Solve:
        if quantity == "value":
            return lambda rung, seed: self._quietly(problem, problem.at, rung, seed)

        def solve(rung: float, seed: int) -> MethodAnswer:
            step = (1 / math.sqrt(rung) if rung > 1 else rung) ** (1 / 3) * 0.1
            above = self._quietly(problem, problem.at + step, rung, seed)
            below = self._quietly(problem, problem.at - step, rung, seed)
            return MethodAnswer((above.value - below.value) / (2 * step), above.evaluations + below.evaluations)

        return solve

    def _quietly(self, problem: BenchProblem, at: float, rung: float, seed: int) -> MethodAnswer:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that a tolerance was not reached shows in the error
            return self.integrate(problem, at, rung, seed)


class Quad(Values):
    """QUADPACK's adaptive Gauss-Kronrod rule on a line."""

    name = "scipy quad"
    dimensions = range(1, 2)

    def integrate(self, problem: BenchProblem, at: float, rung: float, seed: int) -> MethodAnswer:
        from scipy.integrate import quad

        f = problem.function(SCALAR)
        value, error, info = quad(f, *problem.bounds[0], (at,), epsabs=0, epsrel=rung, limit=200, full_output=1)[:3]
        return MethodAnswer(value, info["neval"], error)


class Nquad(Values):
    """The same rule inside of itself."""

    name = "scipy nquad"
    dimensions = range(2, 4)

    def integrate(self, problem: BenchProblem, at: float, rung: float, seed: int) -> MethodAnswer:
        from scipy.integrate import nquad

        options: Any = {"epsabs": rung * 1e-2, "epsrel": rung, "limit": 50}
        value, error, info = nquad(problem.function(SCALAR), problem.bounds, (at,), opts=options, full_output=True)
        return MethodAnswer(value, info["neval"], error)


class Cubature(Values):
    """Adaptive products of Gauss-Kronrod rules, over arrays of points."""

    name = "scipy cubature"

    def missing(self) -> str | None:
        import scipy.integrate

        return None if hasattr(scipy.integrate, "cubature") else "scipy >= 1.15"

    def integrate(self, problem: BenchProblem, at: float, rung: float, seed: int) -> MethodAnswer:
        from scipy.integrate import cubature

        f, count = problem.function(BATCH), 0

        def batch(x: Any) -> Any:
            nonlocal count
            count += len(x)
            return f(*np.moveaxis(x, -1, 0), at) + np.zeros(len(x))

        lo, hi = zip(*problem.bounds, strict=True)
        found = cubature(batch, lo, hi, rule="gk15", rtol=rung, atol=0, max_subdivisions=3000)
        return MethodAnswer(float(found.estimate), count, float(found.error))


class QmcQuad(Values):
    """Scrambled Halton points, the error from eight scramblings."""

    name = "scipy qmc_quad"
    random = True
    dial = "points"
    dimensions = range(1, 100)
    rungs = POINTS

    def integrate(self, problem: BenchProblem, at: float, rung: float, seed: int) -> MethodAnswer:
        from scipy.integrate import qmc_quad
        from scipy.stats.qmc import Halton

        f = problem.function(BATCH)
        lo, hi = zip(*problem.bounds, strict=True)
        engine, points = Halton(problem.dimensions, seed=seed), max(int(rung) // 8, 2)
        found = qmc_quad(lambda x: f(*np.atleast_2d(x.T).T, at) + np.zeros(np.shape(x)[1:]), lo, hi, n_estimates=8,
                         n_points=points, qrng=engine)  # fmt: skip
        return MethodAnswer(float(found.integral), 8 * points, float(found.standard_error))


class Vegas(Values):
    """Adaptive importance and stratified sampling, half of the points to adapt."""

    name = "vegas"
    package = "vegas"
    random = True
    dial = "points"
    dimensions = range(1, 100)
    rungs = POINTS[3:]

    def integrate(self, problem: BenchProblem, at: float, rung: float, seed: int) -> MethodAnswer:
        import gvar
        import vegas

        f, count = problem.function(BATCH), 0

        def values(x: Any) -> Any:
            nonlocal count
            count += len(x)
            return f(*np.moveaxis(x, -1, 0), at) + np.zeros(len(x))

        batch = vegas.batchintegrand(values)
        gvar.ranseed(seed)
        integrator, share = vegas.Integrator([list(b) for b in problem.bounds], mpi=False), int(rung) // 10
        integrator(batch, nitn=5, neval=share)
        found = integrator(batch, nitn=5, neval=share)
        return MethodAnswer(float(found.mean), count, float(found.sdev))


class MeanOfCells:
    """The mean over the middles of equal cells, differentiated as it stands: the interior, without the boundary.

    Differentiated by a complex step, which is as exact as automatic differentiation and gives the same numbers.
    """

    name = "sum, complex step"
    package: str | None = None
    random = False
    dial = "points"

    def missing(self) -> str | None:
        return None

    def ladder(self, problem: BenchProblem) -> Sequence[float]:
        return SUMS if problem.dimensions <= 3 else ()

    def prepare(self, problem: BenchProblem, quantity: Quantity) -> Solve:
        f = problem.function(BATCH)

        def solve(rung: float, seed: int) -> MethodAnswer:
            places, count = cells(problem, rung)
            if quantity == "value":
                return MethodAnswer(float(np.mean(f(*places, problem.at))) * problem.volume, count)
            moved = f(*places, complex(problem.at, 1e-30)) + np.zeros(1)
            return MethodAnswer(float(np.mean(moved.imag)) / 1e-30 * problem.volume, count)

        return solve


class Jax:
    """JAX's forward derivative of the same mean, compiled before the clock starts."""

    name = "JAX of the sum"
    package: str | None = "jax"
    random = False
    dial = "points"

    def missing(self) -> str | None:
        return None if installed("jax") else "jax"

    def ladder(self, problem: BenchProblem) -> Sequence[float]:
        return SUMS if problem.dimensions <= 3 else ()

    def prepare(self, problem: BenchProblem, quantity: Quantity) -> Solve:
        import jax
        import jax.numpy as jnp

        jax.config.update("jax_enable_x64", True)
        names = {"exp": jnp.exp, "cos": jnp.cos, "sqrt": jnp.sqrt, "H": lambda u: jnp.where(u >= 0, 1.0, 0.0)}
        f = problem.function(names)

        def mean(at: Any, places: Any) -> Any:
            return jnp.mean(f(*places, at)) * problem.volume

        def slope(at: Any, places: Any) -> Any:
            return jax.jvp(lambda p: mean(p, places), (at,), (1.0,))[1]

        compiled = jax.jit(mean if quantity == "value" else slope)
        known: dict[float, tuple[Any, int, Callable[..., Any]]] = {}
        for rung in self.ladder(problem):  # compiled for each shape
            places, count = cells(problem, rung)
            device = tuple(map(jnp.asarray, places))
            known[rung] = device, count, compiled.lower(problem.at, device).compile()

        def solve(rung: float, seed: int) -> MethodAnswer:
            places, count, run = known[rung]
            return MethodAnswer(float(run(problem.at, places)), count)

        return solve


def cells(problem: BenchProblem, points: float) -> tuple[tuple[Any, ...], int]:
    """The middles of about so many equal cells of the box, as arrays that broadcast against each other."""
    n, d = max(round(points ** (1 / problem.dimensions)), 2), problem.dimensions
    axes = [lo + (hi - lo) * (np.arange(n) + 0.5) / n for lo, hi in problem.bounds]
    return tuple(axis.reshape([-1 if i == j else 1 for j in range(d)]) for i, axis in enumerate(axes)), n**d


PEERS = (Quad(), Nquad(), Cubature(), QmcQuad(), Vegas(), MeanOfCells(), Jax())
