"""Second derivatives along a direction: the Hessian times a vector, all its components in one run.

Owns `hvp`. The derivative of a function along a direction is a function of duals; its gradient, with one tangent for
each parameter, is the product. No matrix is made, and the derivative is taken through the boundary terms of the first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from msgspec.structs import asdict, replace

from potto.kernels.errors import wrong_call
from potto.python.api import Function, bound, deriv, grad
from potto.python.calls import Gradient
from potto.runtime.answers.estimate import Estimate


def hvp(function: Function, along: Mapping[str, Any]) -> Callable[..., Gradient]:
    """The Hessian of a function times the vector `along`, over the parameters that it names; the others stand still.

    `potto.hvp(f, {"a": 1.0, "b": 2.0})(0.3, 0.6)` takes what `f` takes. In the answer `tangent` is the product by the
    parameters of `along`, in their order (one number if there is one), and `answer["a"]` its component by `a`.
    Raises PottoError where the function has no second derivative, or the names are none of its parameters.
    """
    once = deriv(function)
    named = dict(zip(function.parameters, once.parameters, strict=True))
    grad(function, list(along))  # checks the names
    twice = grad(once, [named[name] for name in along])

    def product(*args: Any, **kwargs: Any) -> Gradient:
        duals: dict[str, Any] = {}
        for name, argument in bound(function, args, kwargs):
            if name not in named:
                raise wrong_call(f"the parameter for {argument!r} has no name, and a product is taken by names")
            duals[named[name]] = _dual(argument, along.get(name))
        return _product(twice(**duals), tuple(along))

    return product


def _dual(argument: Any, direction: Any) -> Any:
    """An argument with its tangent: that of the vector, or none."""
    if isinstance(argument, Function):
        return deriv(argument)
    if isinstance(argument, Estimate):
        argument = argument.value
    return argument, _still(argument) if direction is None else direction


def _still(argument: Any) -> Any:
    return tuple(map(_still, argument)) if isinstance(argument, tuple) else 0.0


def _product(found: Gradient, names: tuple[str, ...]) -> Gradient:
    """Of the derivatives of (f, f' v) by each parameter and its tangent, those of f' v by the parameter."""
    several = len(names) > 1
    tangents = found.tangent if several else (found.tangent,)
    errors = found.tangent_error if several else (found.tangent_error,)
    parts = [tuple(item[0][1] for item in side) for side in (tangents, errors)]
    tangent, error = parts if several else (part[0] for part in parts)
    common = asdict(found)
    made = replace(Gradient(**common), tangent=tangent, tangent_error=error, wrt=names)
    return replace(made, value=found.value[0], error=found.error[0])
