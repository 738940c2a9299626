"""The catalogue of hard problems: value or derivative to the goal that each case states, with an error that covers.

The expected numbers are given to 30 digits by the catalogue; tolerances are the catalogue's own (`rtol_goal`). A
coverage test allows the error estimate what one rounding of the answer itself adds.
"""

from __future__ import annotations

from typing import Any

import pytest
from hard import CASES, derivative_term, problem, value_term

from potto.core import terms as core
from potto.diagnostics import PottoError
from potto.projects.settings import Settings
from potto.runtime.answers.estimate import Estimate
from potto.runtime.evaluate import evaluate


def nothing(module: str, name: str) -> core.Term:
    raise AssertionError("closed terms refer to nothing")


def case(name: str) -> dict[str, Any]:
    return next(c for c in CASES if c["id"] == name)


def measured(c: dict[str, Any]) -> tuple[float, float, Estimate]:
    p = problem(c)
    if c["quantity"] == "derivative":
        r = evaluate(derivative_term(p, c["wrt"]), nothing, Settings())
        return r.value[1], r.error[1], r
    r = evaluate(value_term(p), nothing, Settings())
    return r.value, r.error, r


NUMBERS = [c for c in CASES if c["quantity"] in ("value", "derivative") and c["exact"] is not None and c["rtol_goal"]]


@pytest.mark.parametrize("c", NUMBERS, ids=lambda c: c["id"])
def test_first_order(c: dict[str, Any]) -> None:
    value, error, answer = measured(c)
    exact = float(c["exact"])
    off = abs(value - exact)
    assert off <= c["rtol_goal"] * abs(exact) if exact else off <= 1e-15, f"{c['note']}: {value!r}, not {exact!r}"
    assert off <= error + 2.0**-52 * abs(exact), f"the error {off:.1e} exceeds the reported {error:.1e}"
    assert answer.evals <= 20_000_000


def test_nine_in_ten_reach_the_stretch() -> None:
    wanted = [c for c in NUMBERS if c["rtol_stretch"]]
    missed = [
        c["id"] for c in wanted
        if not abs(measured(c)[0] - float(c["exact"])) <= c["rtol_stretch"] * abs(float(c["exact"]))
    ]  # fmt: skip
    assert len(missed) <= 0.1 * len(wanted), missed


SECOND = [c for c in CASES if "second" in c["quantity"]]


def second_derivative(c: dict[str, Any]) -> Estimate:
    p = problem(c)
    first, *rest = c["wrt"].split(",")
    other = rest[0] if rest else first

    def unit(name: str, wanted: str) -> core.Term:
        return core.ONE if name == wanted else core.ZERO

    duals = tuple(
        core.tuple_((core.tuple_((core.const(x), unit(n, first))), core.tuple_((unit(n, other), core.ZERO))))
        for n, x in zip(p.parameters, p.point, strict=True)
    )
    return evaluate(core.app(core.deriv(core.deriv(p.function)), duals), nothing, Settings())


@pytest.mark.parametrize("c", [c for c in SECOND if c["exact"]], ids=lambda c: c["id"])
def test_second_order(c: dict[str, Any]) -> None:
    answer = second_derivative(c)
    exact = float(c["exact"])
    off = abs(answer.value[1][1] - exact)
    assert off <= c["rtol_goal"] * abs(exact)
    assert off <= answer.error[1][1] + 2.0**-52 * abs(exact)


def test_product_of_deltas_on_coinciding_surfaces_is_refused() -> None:
    with pytest.raises(PottoError) as caught:
        second_derivative(case("L06_product_same_surface"))
    assert caught.value.diagnostics[0].code == "P0505"


def test_a_jump_on_the_upper_bound_has_one_sided_derivatives() -> None:
    c = case("A03_on_upper_boundary")
    value, _, answer = measured(c)
    assert value == 0.0
    (note,) = answer.notes
    assert float(note.backward) == pytest.approx(float(c["left"]), rel=1e-14, abs=0)
    assert float(note.forward) == float(c["right"])


def test_a_bound_that_meets_a_jump_has_one_sided_derivatives() -> None:
    c = case("J03_bound_meets_jump")
    _, _, answer = measured(c)
    (note,) = answer.notes
    assert float(note.backward) == pytest.approx(float(c["left"]), rel=1e-14, abs=0)
    assert float(note.forward) == pytest.approx(float(c["right"]), rel=1e-14, abs=0)
