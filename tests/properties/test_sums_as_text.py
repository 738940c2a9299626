"""What numpy adds up by one straight function is what it adds up step by step, to the last bit, errors included.

That step by step is held against closed forms and mpmath elsewhere: here nothing may be left to be said but "the same".
"""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from how_many import examples

import potto
from potto.integrate.fixed.proved_sums import sum_text
from potto.integrate.fixed.proved_sums.settled import SettledRegion
from potto.integrate.fixed.proved_sums.sum_text import RepeatedSum, SumText
from potto.kernels.cells import Cell
from potto.kernels.native.operations import NotStraight

WAYS: dict[str, Callable[[Any], Callable[..., potto.Estimate]]] = {
    "value": lambda f: f,
    "by one": lambda f: potto.grad(f, "a"),
    "by both": lambda f: potto.grad(f, ("a", "b")),
    "along a line": lambda f: lambda a, b: potto.deriv(f)((a, 0.7), (b, -3.0)),
    "one at rest": lambda f: lambda a, b: potto.deriv(f)((a, 1.0), (b, 0.0)),
}
PROGRAMS = {
    "one variable": "def f(a, b) integral [0, 2] exp(-b*x)*[x < a] d(x)",
    "nothing moves": "def f(a, b) integral [0, 1] sqrt(3 + x) d(x)",
    "a constant": "def f(a, b) integral ([0, 1], [-a, 1 + a]) 3*[x < a] d(x, y)",
    "two formulas": "def f(a, b) integral ([0, 1], [0, 1]) (exp(b*x)*[x + y < a] + sin(x*y)/3*[x + y > a]) d(x, y)",
    "many cuts": "def f(a, b) integral [0, 2] exp(-x)*([x < a] + [x < b/2]*x + [x < a/4]*cos(x)) d(x)",
    "cuts of cuts": "def f(a, b) integral ([0, 1], [0, 1]) (x*y + b)*([x + y < a] - [2*x + y < 3*a]) d(x, y)",
    "moving bounds": "def f(a, b) integral ([-a, 1], [0, 1 + b]) log(3 + x + y)^3*[x < y] d(x, y)",
    "three variables": "def f(a, b) integral ([0, 1], [0, a], [0, 1]) exp(x*y*z)/(2 + b)*[x + y + z < 1.2] d(x, y, z)",
    "a function of scipy": "def f(a, b) integral [0, 1] besselj0(b*x)*[x < a] d(x)",
    "minus of minus": "def f(a, b) integral ([0, 1], [0, 1]) -(-x/(-(y + 2)) - (-b)*(-3) + 2)*[-x < -a*y] d(x, y)",
}  # fmt: skip


@pytest.fixture
def by_text(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[SumText]]:
    """The texts that are used, from the first call on."""
    used: list[SumText] = []
    at_region = SumText.at_region

    def noted(self: SumText, *given: Any) -> Any:
        used.append(self)
        return at_region(self, *given)

    monkeypatch.setattr(SumText, "at_region", noted)
    with potto.settings(backend="numpy"):
        yield used


def told(found: potto.Estimate) -> str:
    parts = found.value, found.error, found.tangent, found.tangent_error, found.evals, found.converged, found.notes
    return repr(parts)


def answers(text: str, way: str, places: Sequence[tuple[float, float]], by_text: bool) -> list[str]:
    """What calls tell, by texts that are written once a call was answered, or step by step: what is not the same in
    that call is not used at all."""
    call = WAYS[way](potto.compile(text).f)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sum_text, "TERM", math.inf)
        call(*places[0])
        if by_text:
            patch.setattr(sum_text, "TERM", 0.0)
        return [told(call(*place)) for place in places]


def same(text: str, way: str, places: Sequence[tuple[float, float]]) -> None:
    assert answers(text, way, places, False) == answers(f"{text}\n", way, places, True)


@pytest.mark.parametrize("way", list(WAYS))
@pytest.mark.parametrize("program", list(PROGRAMS))
def test_all_bits_are_the_same(program: str, way: str, by_text: list[SumText]) -> None:
    same(PROGRAMS[program], way, [(0.3 + d, 0.7 - d) for d in (0.0, 1e-3, -1e-3, 1e-9)])
    assert by_text


@pytest.mark.parametrize("names", [("x0", "x7"), ("x2", "x3"), ("k0", "at0"), ("width", "block")])
def test_parameters_may_be_called_as_numbers_of_the_text_are(
    names: tuple[str, str], by_text: list[SumText], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mesh has corners x0, y0, x1, ... No name tells the numbers apart."""

    def gradient(a: str, b: str) -> list[str]:
        text = f"def f({a}, {b}) integral ([0, 1], [0, 1]) exp({b}*x)*[x + y < {a}] d(x, y)"
        call = potto.grad(potto.compile(text).f, (a, b))
        return [told(call(0.4 + d, 0.7)) for d in (0.0, 1e-3, 2e-3)]

    monkeypatch.setattr(sum_text, "TERM", 0.0)
    assert gradient(*names) == gradient("a", "b")
    assert by_text


@pytest.mark.parametrize("number", range(examples(30, 400)))
def test_random_programs_come_to_the_same(number: int, by_text: list[SumText]) -> None:
    pick = random.Random(number)
    text, way = program(pick), pick.choice(list(WAYS))
    a, b = pick.uniform(0.1, 0.9), pick.uniform(0.1, 0.9)
    places = [(a + d, b + d) for d in (0.0, pick.uniform(-1e-3, 1e-3), pick.uniform(-1e-3, 1e-3))]
    try:
        same(text, way, places)
    except potto.PottoError:
        pytest.skip("no number at all")


def test_most_random_programs_have_a_text(by_text: list[SumText]) -> None:
    """Else the law above would say nothing."""
    having = 0
    for number in range(10):
        before = len(by_text)
        answers(program(random.Random(number)), "by one", [(0.3, 0.6), (0.3, 0.6)], True)
        having += len(by_text) > before
    assert having >= 4


def program(pick: random.Random) -> str:
    """An integral with edges, over one to three variables."""
    variables = ["x", "y", "z"][: pick.choice([1, 1, 2, 2, 2, 3])]
    names = [*variables, "a", "b"]
    bounds = ", ".join(pick.choice(["[0, 1]", "[a, 2]", "[0, 2]", "[-a, 1 + a]"]) for _ in variables)
    body = formula(pick, names, 3)
    for _ in range(pick.choice([0, 1, 1, 2])):
        some = pick.sample(variables, pick.randint(1, len(variables)))
        side = " + ".join(f"{pick.choice([1, 2, 0.5, -1])}*{name}" for name in some)
        edge = f"{side} {pick.choice('<>')} {pick.choice(['a', 'b', 'a/2', '0.5 + a'])}"
        other = formula(pick, names, 2)
        choices = f"({body})*[{edge}]", f"({body}*[{edge}] + {other}*(1 - [{edge}]))", f"({body} + {other}*[{edge}])"
        body = pick.choice(choices)
    return f"def f(a, b) integral ({bounds}) {body} d({', '.join(variables)})".replace(
        f"({bounds})", f"({bounds})" if len(variables) > 1 else bounds, 1)  # fmt: skip


def formula(pick: random.Random, names: list[str], depth: int) -> str:
    if not depth or pick.random() < 0.15:
        return pick.choice([*names, *names, f"{pick.uniform(-2, 2):.2f}", "1", "2"])
    u, v, w = (formula(pick, names, depth - 1) for _ in range(3))
    return pick.choice([
        f"({u} + {v})", f"({u} - {v})", f"({u}*{v})", f"({u} + {v} + {w})", f"-({u})", f"({u})/3", f"({u})^3",
        f"exp(-({u})/2)", f"sin({u})", f"cos({u})", f"sqrt(3 + ({u})^2)", f"1/(2 + ({u})^2)", f"log(2 + ({u})^2)",
        f"atan({u})", f"tanh({u})", f"erf({u})", f"max({u}, -9)", f"abs({u})",
    ])  # fmt: skip


@pytest.mark.filterwarnings("error")
def test_beyond_the_region_the_general_way_answers(by_text: list[SumText], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sum_text, "TERM", 0.0)
    f = potto.compile(PROGRAMS["one variable"]).f
    for a, b in ((0.3, 1.0), (0.3, 1.0), (1.9, 1.0), (0.0, 1.0), (-1.0, 1.0), (5.0, 1.0), (0.3, -700.0)):
        exact = -math.expm1(-b * min(max(a, 0.0), 2.0)) / b
        assert f(a, b).value == pytest.approx(exact, rel=1e-13, abs=0)  # closed form, to rounding
    assert f(0.3, math.inf).value == 0 or not f(0.3, math.inf).converged
    assert by_text


@pytest.mark.parametrize("program", ["cuts of cuts", "moving bounds", "three variables"])
def test_where_cuts_cross_both_say_nothing(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Far outside of the region, where cells are others, or bounds the wrong way round."""
    found: list[SettledRegion] = []
    monkeypatch.setattr(SettledRegion, "at", lambda self, env: found.append(self))
    with potto.settings(backend="numpy"):
        slope = potto.grad(potto.compile(PROGRAMS[program]).f, ("a", "b"))
        slope(0.3, 0.7), slope(0.3, 0.7)
    monkeypatch.undo()
    region = found[0]
    box = tuple((name, -math.inf, math.inf) for name, _, _ in region.box)

    def wide(terms: int) -> SettledRegion:
        given = region.plan, region.region, region.machine, box, region.truncation
        return SettledRegion(*given, RepeatedSum(terms), None, None)

    step_by_step, by_text, nothing = wide(10**18), wide(0), 0
    for a, b in itertools.product(np.linspace(-1, 2, 13).tolist(), (-0.5, 0.3, 0.7, 1.5)):
        env = {"a": Cell(a, None, (1.0, None)), "b": Cell(b, None, (None, 1.0))}
        answer = step_by_step.at(env)
        assert repr(answer) == repr(by_text.at(env))
        nothing += answer is None
    assert by_text.straight is not None and step_by_step.straight is None and 0 < nothing < 52


def test_what_has_no_text_is_added_up_step_by_step(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def none(*given: Any) -> SumText:
        asked.append(given)
        raise NotStraight

    monkeypatch.setattr(sum_text, "TERM", 0.0)
    monkeypatch.setattr(SumText, "of", none)
    with potto.settings(backend="numpy"):
        f = potto.grad(potto.compile("def f(a, b) integral [0, 3] exp(-b*x)*[x < a] d(x)").f, "a")
        for a in (0.3, 0.31, 0.3, 0.3):
            found = f(a, 0.7)
            exact = -math.expm1(-0.7 * a) / 0.7, math.exp(-0.7 * a)  # closed forms, to rounding
            assert np.allclose((found.value, found.tangent), exact, rtol=1e-14, atol=0)
    assert len(asked) == 1


def test_the_text_is_written_when_that_pays() -> None:
    sums, asked = RepeatedSum(100), []
    cost = 100 * sum_text.TERM

    def write() -> SumText:
        asked.append(sums.spent)
        raise NotStraight

    for spent in (0.0, cost, 1.9 * cost, 2.1 * cost, 3 * cost):
        sums.spent = spent
        assert sums.text(write) is None
    assert asked == [2.1 * cost]


def test_calls_are_answered_by_text_before_long(by_text: list[SumText]) -> None:
    f = potto.compile("def f(a, b) integral ([0, 1], [0, 3]) exp(-b*x*y)*[x + y < a] d(x, y)").f
    first = told(potto.grad(f, "a")(0.3, 0.7))
    for _ in range(400):  # some 40 would do
        assert told(potto.grad(f, "a")(0.3, 0.7)) == first
        if by_text:
            break
    assert len(by_text) == 1
