"""Functions of Potto as scipy's optimizers take them: of one row of numbers, with derivatives of their own.

Owns `to_scipy` and `Objective`. Nothing of scipy is needed for it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from potto.kernels.cells import Array
from potto.kernels.errors import wrong_call
from potto.python.functions import Function, must_be_function
from potto.python.gradients import value_and_jacobian
from potto.python.hessian import hessian, hvp
from potto.python.named_parameters import parameters_to_vary
from potto.runtime.answers.estimate import Estimate


class Objective:
    """A function of one row of numbers, which are the parameters that it starts at, one after the other.

    x0: where it starts. fun(x): the value, or all values in a row where the function gives several. jac(x): the
    derivatives, (numbers,) or (values, numbers). hess(x), hessp(x, p): second derivatives of a function that gives one
    value, and their product with a vector. error(x): a bound of the error of each value. parameters(x): the
    parameters by name, in the form in which they began. What `fun` and `jac` ask at one place is computed once.
    """

    def __init__(self, function: Function, start: Mapping[str, Any], given: Mapping[str, Any]) -> None:
        must_be_function(function)
        if not start:
            raise wrong_call("no parameter is named to start at")
        self.names = parameters_to_vary(function, tuple(start))
        self._function, self._given = function, dict(given)
        self._begun = {name: _numbers(name, value) for name, value in start.items()}
        self.x0 = np.concatenate([value.ravel() for value in self._begun.values()])
        self._pair = value_and_jacobian(function, self.names)
        self._seen: tuple[bytes, Estimate, Estimate] | None = None

    def __call__(self, x: Any) -> Any:
        return self.fun(x)

    def __repr__(self) -> str:
        return f"<{self._function.written} for scipy, of {self.x0.size} numbers>"

    def fun(self, x: Any) -> Any:
        """The value at a place; several as an array."""
        return _rows(self._at(x)[0].value)

    def error(self, x: Any) -> Any:
        """How far off the values may be."""
        return _rows(self._at(x)[0].error)

    def jac(self, x: Any) -> Array:
        """The derivatives by all numbers, for each value."""
        value, slopes = self._at(x)
        found = np.asarray(slopes.value, dtype=float).reshape(-1, self.x0.size)
        return found if np.ndim(_rows(value.value)) else found[0]

    def hess(self, x: Any) -> Array:
        """The second derivatives of a function that gives one value."""
        found = hessian(self._function, self.names)(**self.parameters(x), **self._given)
        return np.asarray(found.value, dtype=float).reshape(self.x0.size, self.x0.size)

    def hessp(self, x: Any, p: Any) -> Array:
        """The second derivatives times a vector, in one run whatever the size."""
        found = hvp(self._function, self.parameters(p))(**self.parameters(x), **self._given)
        parts = found.tangent if len(self.names) > 1 else (found.tangent,)
        return np.concatenate([np.ravel(part) for part in parts])

    def parameters(self, x: Any) -> dict[str, Any]:
        """A row of numbers as parameters."""
        row, at, found = np.asarray(x, dtype=float).ravel(), 0, {}
        if row.size != self.x0.size:
            raise wrong_call(f"{row.size} numbers are given, and the parameters have {self.x0.size}")
        for name, value in self._begun.items():
            part = row[at : at + value.size]
            found[name] = part.reshape(value.shape) if value.ndim else float(part[0])
            at += value.size
        return found

    def _at(self, x: Any) -> tuple[Estimate, Estimate]:
        key = np.asarray(x, dtype=float).tobytes()
        if self._seen is None or self._seen[0] != key:
            self._seen = (key, *self._pair(**self.parameters(x), **self._given))
        return self._seen[1:]


def to_scipy(function: Function, start: Mapping[str, Any], *, given: Mapping[str, Any] | None = None) -> Objective:
    """The function as `scipy.optimize` takes it, over the parameters named in `start`: numbers, tuples or arrays.

        loss = potto.to_scipy(m.loss, {"a": 1.0, "c": 0.5})
        minimize(loss.fun, loss.x0, jac=loss.jac, hess=loss.hess, method="trust-exact")

    given: the other parameters. Arrays among them that broadcast make the function one of several values, as
    `least_squares(r.fun, r.x0, jac=r.jac)` takes it. Raises PottoError if a name is none of the function's parameters.
    """
    return Objective(function, start, given or {})


def _numbers(name: str, value: Any) -> Array:
    try:
        return np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise wrong_call(f"`{name}` starts at a Python {type(value).__name__}, not at numbers") from None


def _rows(value: Any) -> Any:
    """The numbers of an answer in a row, tuples member by member; one number as it is."""
    if isinstance(value, tuple):
        return np.stack(np.broadcast_arrays(*value), axis=-1).ravel()
    return np.ravel(value) if np.ndim(value) else float(value)
