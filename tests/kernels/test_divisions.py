"""How often kernels divide, which takes as long as four products: a node of a rule is little else."""

from __future__ import annotations

import pytest

import potto
from potto.core.terms import Lam, lam
from potto.kernels.compile import kernel
from potto.projects.settings import DEFAULTS

MOVING = (False, (2,))  # a number without an error, with a tangent


@pytest.mark.parametrize(("body", "divisions"), [("1/(x + t)", 1), ("x/(x + t)", 2), ("x*t/(2*x + t)", 2)])
def test_a_quotient_and_its_slope_divide_by_the_divisor_once(body: str, divisions: int) -> None:
    """And the numerator once, unless it is 1."""
    module = potto.compile(f"def f(x, t) {body}")
    program = module._world.program
    term = program.linker.function(program.linker.term(module.f._file, "f"))
    assert isinstance(term, Lam)
    text = kernel(lam(term.params, term.body), (MOVING, MOVING), 1, False, program.machine(DEFAULTS)).text
    assert text.count("f_divide(") == divisions, text


@pytest.mark.parametrize("divisor", [1e-160, 1e160, -3.0])
def test_the_slope_of_a_quotient_is_there_where_the_divisors_square_is_not(divisor: float) -> None:
    found = potto.grad(potto.compile("def f(a, b) a/b").f, "b")(divisor, divisor)
    assert found.tangent == pytest.approx(-1 / divisor, rel=1e-15)
    assert abs(found.tangent + 1 / divisor) <= found.tangent_error + 1e-17 / abs(divisor)
