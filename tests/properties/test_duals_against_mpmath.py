"""Duals of random programs against the oracle: differences of values that mpmath computes to 20 digits and more.

No allowance is made: the reported error alone must cover what is wrong. Programs over one variable of integration, with
surfaces, calls, functions that are passed, and bounds that move; of two the oracle takes minutes (brute force in
doubles does for those, see program_checks).
"""

from __future__ import annotations

from typing import Any

import pytest
from how_many import examples
from mpmath import mp
from program_checks import where
from program_source import random_program

import potto
from potto.core.reference import NotAccurate, evaluate
from potto.core.terms import app, const, deriv, global_, tuple_
from potto.diagnostics import PottoError

pytestmark = pytest.mark.filterwarnings("ignore::potto.ProgramWarning")  # of a refused `f` beside what is right
DIGITS, MORE = 20, 36
# What 20 digits of values leave of a difference of order 8.
OWN = mp.mpf("1e-15")


def oracle(module: Any, number: int, digits: int) -> tuple[Any, Any]:
    """(value, tangent) of `f` in the module. Raises NotAccurate."""
    point, linker = where(number), module._world.program.linker
    name = next(name for name in linker.terms if name[1] == "f")
    duals = tuple(tuple_((const(x), const(dx))) for x, dx in ((point.t, point.dt), (point.s, point.ds)))
    value, tangent = evaluate(app(deriv(global_(*name)), duals), {}, linker.lookup, digits=digits)
    return value, tangent


def check(number: int) -> str:
    text, _ = random_program(number, True)
    point = where(number)
    try:
        module = potto.compile(text)
        f = module.f
    except PottoError as refused:
        assert all(d.code.startswith("P04") for d in refused.diagnostics), f"{text}\n{refused}"
        return "refused"
    answer = potto.deriv(f)((point.t, point.dt), (point.s, point.ds))
    try:
        value, tangent = oracle(module, number, DIGITS)
    except NotAccurate:
        return "too hard"
    context = f"program {number} at {point}:\n{text}{answer} {value} {tangent}"
    assert abs(answer.value - value) <= answer.error, context
    if abs(answer.tangent - tangent) > answer.tangent_error + OWN * max(1, abs(tangent)):
        finer = oracle(module, number, MORE)[1]
        if abs(finer - tangent) > mp.mpf("1e-12") * max(1, abs(tangent)):
            return "not differentiable"  # or too close to where it is not
        raise AssertionError(context)
    return "compared"


def check_all(numbers: range) -> None:
    outcomes = [check(number) for number in numbers]
    assert outcomes.count("compared") >= 0.9 * len(numbers), outcomes


def test_duals() -> None:
    check_all(range(14, 19))


@pytest.mark.slow
@pytest.mark.parametrize("start", range(100, 100 + examples(5, 400), 5))
def test_many_duals(start: int) -> None:
    check_all(range(start, start + 5))
