"""The catalogue of the bench: its answers by mathematics, and its two spellings of each problem against them."""

from __future__ import annotations

import mpmath as mp
import pytest
from closed_forms import EXACT
from hard import derivative_term, problem

import potto
from potto.bench.problems import catalogue
from potto.runtime.evaluate import evaluate

PROBLEMS = {p.id: p for p in catalogue()}
# What quadrature is allowed: the narrow ones lose the digits that their two edges share.
WITHIN = {"strip": 1e-9, "sliver": 1e-9, "eight": 2e-2}


def test_every_problem_has_a_closed_form() -> None:
    assert set(PROBLEMS) == set(EXACT)


@pytest.mark.parametrize("id", PROBLEMS)
def test_the_answers_are_those_of_mathematics(id: str) -> None:
    with mp.workdps(40):
        value, slope = (float(f(mp.mpf(PROBLEMS[id].at))) for f in EXACT[id]())
    assert PROBLEMS[id].exact == {"value": value, "derivative": slope}


@pytest.mark.parametrize("id", PROBLEMS)
def test_the_closed_forms_of_derivatives_are_derivatives(id: str) -> None:
    with mp.workdps(40):
        value, slope = EXACT[id]()
        at = mp.mpf(PROBLEMS[id].at)
        assert abs(mp.diff(value, at) - slope(at)) < mp.mpf(10) ** -18 * abs(slope(at))


@pytest.mark.parametrize("id", PROBLEMS)
def test_the_program_is_the_problem(id: str) -> None:
    p = PROBLEMS[id]
    answer = potto.deriv(potto.compile(p.program).f)((p.at, 1.0))
    for quantity, number, error in (("value", answer.value, answer.error),
                                    ("derivative", answer.tangent, answer.tangent_error)):  # fmt: skip
        assert p.error(quantity, number) <= WITHIN.get(id, 1e-10)
        assert abs(number - p.exact[quantity]) <= error + 2.0**-51 * abs(number)


@pytest.mark.parametrize("id", [id for id in PROBLEMS if id != "eight"])
def test_the_integrand_for_peers_is_the_problem(id: str) -> None:
    p = PROBLEMS[id]
    spec = {"vars": [[v, repr(lo), repr(hi)] for v, (lo, hi) in zip(p.variables, p.bounds)], "integrand": p.integrand}
    case = problem({"spec": spec, "params_hex": {p.parameter: p.at.hex()}})
    answer = evaluate(derivative_term(case, p.parameter), lambda *name: pytest.fail(str(name)))
    assert p.error("value", answer.value[0]) <= WITHIN.get(id, 1e-10)
    assert p.error("derivative", answer.value[1]) <= WITHIN.get(id, 1e-10)
