"""Derivatives of functions of Potto for Python: gradients, Jacobians, products with vectors from either side.

Owns `grad`, `value_and_grad`, `jacobian`, `vjp` and `jvp`; their answers are in `slopes`. By many parameters it is
differentiated in reverse, by few forward (`derived_calls`); both give the same. What is differentiated by is named;
without names it is the first parameter. All numbers come with their errors, and arrays broadcast as in a call. Second
derivatives are in `hessian`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, overload

from msgspec.structs import replace

from potto.kernels.cells import Cell, all_cells
from potto.kernels.errors import wrong_call
from potto.python.derivative_forms import as_matrix, bounds_of, in_lists, tangents_of
from potto.python.derived_calls import DerivedCall
from potto.python.functions import Function
from potto.python.gradient_functions import GradientFunction, in_given_form
from potto.python.hessian import second_gradient
from potto.python.moving import moved, size
from potto.python.named_parameters import Names, parameters_to_vary
from potto.python.remade import remade
from potto.python.slopes import Gradient, Slopes
from potto.runtime.answers.estimate import Estimate
from potto.runtime.answers.records import named_answer
from potto.runtime.evaluate import number, report


@overload
def grad(function: Function, wrt: Names = None) -> GradientFunction: ...
@overload
def grad(function: GradientFunction, wrt: Names = None) -> Callable[..., Gradient]: ...
def grad(function: Function | GradientFunction, wrt: Names = None) -> Any:
    """The function with its derivatives by the parameters named in `wrt`, or by the first one.

    It takes plain numbers. In the answer, `tangent` is the derivative by the one parameter, or a tuple of them in the
    order of `wrt`; `answer["c"]` is the one by `c`. The derivative by a tuple is a tuple, that by a record a tuple with
    its fields, or a dict where the record is given as one. Of `grad(f)` it is the second derivative: `value` is what
    `grad(f)` has as `tangent`.
    Raises PottoError if the function has no such parameter, or one of them is not a number.
    """
    if isinstance(function, GradientFunction):
        return second_gradient(function._function, function._wrt, parameters_to_vary(function._function, wrt))
    return GradientFunction(function, parameters_to_vary(function, wrt))


@remade
def value_and_grad(function: Function, wrt: Names = None) -> Callable[..., tuple[Estimate, Estimate]]:
    """The value and the derivatives by the parameters named in `wrt`, or by the first one, as two estimates.

    `value, slope = potto.value_and_grad(f)(0.3)`. The second one is what `grad` has as `tangent`. Raises as that does.
    """
    gradient = grad(function, wrt)

    def pair(*args: Any, **kwargs: Any) -> tuple[Estimate, Estimate]:
        found = gradient(*args, **kwargs)
        return replace(_plain(found), tangent=None, tangent_error=None), Slopes.of(found)

    return pair


@remade
def jacobian(function: Function, wrt: Names = None) -> Callable[..., Estimate]:
    """All derivatives as one array: by the numbers of the function's answer, and by those of the parameters in `wrt`.

    `value` and `error` have the shape (*batch, answers, parameters): batch is what arrays broadcast to, and an axis is
    left out where the answer is one number, and where one parameter is named that is one number. Raises as `grad` does.
    """
    pair = value_and_jacobian(function, wrt)
    return lambda *args, **kwargs: pair(*args, **kwargs)[1]


@remade
def value_and_jacobian(function: Function, wrt: Names = None) -> Callable[..., tuple[Estimate, Estimate]]:
    """The value and what `jacobian` has of it, in one run. Raises as that does."""
    names = parameters_to_vary(function, wrt)

    def pair(*args: Any, **kwargs: Any) -> tuple[Estimate, Estimate]:
        run = DerivedCall(*function.prepared(args, kwargs, {}), {})
        value = run.along_each(names)
        tangents, bounds = (
            tuple(run.one_by_one(list(map(number, side(cell))), names) for cell in all_cells(value))
            for side in (tangents_of, bounds_of)
        )
        found = run.answer(value, tangents, bounds)
        own = run.own(*names)
        single = isinstance(value, Cell), len(names) == 1 and isinstance(own[names[0]], Cell)
        count = sum(size(name, value) for name, value in own.items())
        slopes, errors = (as_matrix(part, count, run.batch, *single) for part in (found.tangent, found.tangent_error))
        plain = replace(found, tangent=None, tangent_error=None)
        return plain, replace(plain, value=slopes, error=errors)

    return pair


@remade
def vjp(function: Function, cotangent: Any, wrt: Names = None) -> Callable[..., Gradient]:
    """The product of a cotangent with the Jacobian: the derivatives of `cotangent` times the function's answer.

    `potto.vjp(f, (1.0, -2.0), wrt=["a"])(0.3)` takes what `f` takes; `value` is that of `f`, and `tangent` the product
    in the form that `grad` has. The cotangent has the form of the answer: a number, or a tuple; arrays broadcast with
    those of the call. Raises as `grad` does, and where the form is another.
    """
    names = parameters_to_vary(function, wrt)

    def product(*args: Any, **kwargs: Any) -> Gradient:
        extra = {"cotangent": function.in_form("cotangent", cotangent, None)}
        run = DerivedCall(*function.prepared(args, kwargs, extra), extra)
        value, total = run.along_each_together(names, in_lists(run.extra["cotangent"]))
        return in_given_form(run.gradient(value, total, names), function, args, kwargs)

    return product


@remade
def jvp(function: Function, along: Mapping[str, Any], *tangents: Any) -> Callable[..., Estimate]:
    """The product of the Jacobian with a vector: the derivative along a direction, over the parameters that it names.

    `potto.jvp(f, {"a": 1.0, "b": 2.0})(0.3, 0.6)` takes what `f` takes; the other parameters stand still. In the answer
    `tangent` is the derivative. Raises PottoError if the function has no such parameter, one of them is not a
    number, a tangent does not have the form of its parameter, or the direction is given as JAX takes it, by places.
    """
    if tangents or not isinstance(along, Mapping):
        name = next(iter(function.parameters), "") if isinstance(function, Function) else ""
        raise wrong_call(
            "`jvp` takes the direction alone, as a dict by the names of parameters",
            f'write `potto.jvp(f, {{"{name or "x"}": 1.0}})(…)`: what it gives is called as `f` is',
        )
    names = parameters_to_vary(function, tuple(along))

    def product(*args: Any, **kwargs: Any) -> Estimate:
        labels = {
            label: function.in_form(label, tangent, name)
            for name, tangent in along.items()
            if (label := f"the tangent of {name}")
        }
        run = DerivedCall(*function.prepared(args, kwargs, labels), labels)
        tangents = dict(zip(names, run.extra.values(), strict=True))
        moving = {name: moved(name, value, tangents[name]) for name, value in run.own(*names).items()}
        value = run.evaluated(moving, run.machine.with_directions(1), lambda value: value)
        return named_answer(run.batch.shaped(report(value, run.machine, run.clock)), run.call.result)

    return product


def _plain(found: Estimate) -> Estimate:
    return Estimate(**{name: getattr(found, name) for name in Estimate.__struct_fields__})


__all__ = ["GradientFunction", "grad", "jacobian", "jvp", "value_and_grad", "vjp"]
