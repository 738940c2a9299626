"""Errors of integrals further in, and of the two forms of a derivative, are no more than was asked for of the whole."""

import pytest

import potto

# Two noisy numbers under a condition that is searched for: the probability, and its derivative by the threshold. The
# inner probability in closed form at the roots (30 digits, Newton), the outer integral by mpmath (tanh-sinh) with 30.
CONDITIONS = {
    # The derivative's forms are accurate on different pieces.
    "(x ~ normal(1.31, 1), y ~ uniform(-0.96, 0.34)) [0.53*sin(-1.1*x - 0.2*y - 1.9) - 0.94*x < t]": (
        -0.37, 0.930087551805959636542383002335, 0.150964966700394120893567838942,
    ),
    # The derivative is 1/600 of what is added up for it.
    "(x ~ logistic(0.71, 0.1), y ~ laplace(0.66, 0.1)) [0.85*x^2 - 0.93*sin(x)*cos(y) < t]": (
        0.96, 0.998955469025909333328148094667, 0.00467299067154905159820912915084,
    ),
}  # fmt: skip


@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_searched_condition_in_two_noisy_numbers(condition: str) -> None:
    t, value, slope = CONDITIONS[condition]
    found = potto.grad(potto.compile(f"def f(t) integral {condition} d(x, y)").f)(t)
    assert found.converged
    assert max(found.error, found.tangent_error) <= 1e-12  # of 1, or of what cancels, where 1e-10 is asked for
    assert abs(found.value - value) <= found.error
    assert abs(found.tangent - slope) <= found.tangent_error
