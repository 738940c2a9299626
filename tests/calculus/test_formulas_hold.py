"""Every formula that is shown parses, checks, and has the values of the derivative.

Of examples it is held against `deriv`, which finds the derivative by numbers; of generated definitions against
difference quotients of their values (Richardson's, of two steps), which know nothing of derivatives.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from _pytest.mark.structures import ParameterSet
from formulas import Given, Shown, has_value, near
from generated_definitions import definition, program
from how_many import examples

import potto
from potto.calculus.solving.solve import _Search
from potto.checking.library import Library
from potto.modules import names
from potto.types import interface
from potto.types.types import Function

EXAMPLES = Path(__file__).parents[2] / "examples"
WITHOUT = {
    "hidden.po:pixel", "plate.po:stepped",  # too long to be read
    "geometry.po:pixel", "main.po:two_tones", "main.po:by_law", "shadows.po:sharp", "sphere.po:pixel",
    "sphere.po:shaded", "stylize.po:pixel", "shadows.po:softly",
}  # fmt: skip
WIDE = {
    "newsvendor.po:cost",
    "options.po:call",
    "options.po:knocked_out",
    # whose arguments are functions of vectors, or numbers of elements, which `given` doesn't make up
    "sphere.po:seen", "stylize.po:loss", "stylize.po:by_constant", "stylize.po:by_linear", "stylize.po:by_quadratic",
    "shadows.po:triangle_softly",  # which is sampled, in four dimensions
}  # fmt: skip
# The first: far out these are 0*inf, which a density that is given as a measure avoids: they are checked, not evaluated


def _definitions() -> Iterator[ParameterSet]:
    for path in sorted(EXAMPLES.glob("*/*.po")):
        library = Library([str(path.parent)])
        file = library.key(str(path))
        for name in names(library.db, file):
            if isinstance(interface(library.db, file, name).type, Function):
                quick = path.parent.name in ("paper", "worked")
                yield pytest.param(str(path.relative_to(EXAMPLES)), name, marks=() if quick else pytest.mark.slow)


@pytest.mark.parametrize(("path", "name"), list(_definitions()))
def test_examples(path: str, name: str) -> None:
    file = EXAMPLES / path
    shown = Shown(file.read_text(), name, str(file))
    if shown.text.by:
        return  # it is that of another one
    where = f"{file.name}:{name}"
    if where in WITHOUT:
        assert not shown.text.tangent and shown.text.problems
        return
    assert shown.text.tangent, shown.text.notes
    assert shown.problems() == [], shown.text.tangent
    if where in WIDE:
        return
    if shown.text.deltas:
        return  # a distribution has no values
    module, rng = shown.module(), random.Random(where)
    for _ in range(examples(1, 2)):
        given, derivative = _given(shown, module, rng)
        formula = module.eval(shown.formula(given))
        assert near(formula.value, derivative.value), (shown.text.tangent, shown.formula(given))


BEYOND = [
    ("integral [0, 3] [x^2 > a] d(x)", 0.49, -0.5 / 0.7),  # 3 - sqrt(a)
    ("integral [0, 1] [x > a^2]*log(1 + a*x) d(x)", 1.5, 0.0),  # at -1.5 neither 1 + a^3 > 0 nor a^2 < 1
    ("sum i in 1..3 (integral [0, 1] [x^i < a] d(x))", 0.64, 1 + 0.5 / 0.8 + 0.64 ** (-2 / 3) / 3),
    ("integral [-1, 1] [x^3 < 1]*[x^2 < a] d(x)", 0.64, 1 / 0.8),  # 2*sqrt(a)
]


@pytest.mark.parametrize(("body", "above", "slope"), BEYOND)
def test_a_formula_is_0_where_a_factor_without_a_value_counts_for_nothing(
    body: str, above: float, slope: float
) -> None:
    """At the negative of a place where the slope is known by hand (to 1e-12, in doubles) nothing moves in the domain,
    and the roots and logarithms of the formula have no value."""
    shown = Shown(f"def f(a) {body}\n", "f")
    assert shown.problems() == []
    module = shown.module()
    assert module.eval(f"shown_1({above}, 1)").value == pytest.approx(slope, rel=1e-12, abs=1e-12)
    assert module.eval(f"shown_1({-above}, 1)").value == 0


NARROW = [
    ("[0.3 < y < 0.31]", 0.01),
    ("[x - 0.01 < y < x]", 0.01),
    ("max(y - 0.99, 0)", 0.01**2 / 2),
    ("([0.3 < y < 0.31] - [0.5 < y < 0.52])", 0.01 - 0.02),
]


@pytest.mark.parametrize(("factor", "slope"), NARROW)
def test_a_fall_in_a_narrow_place_counts(factor: str, slope: float) -> None:
    """The width of the strip at x = t (to 1e-12, in doubles). Points that are tried hardly lie in it, so that nothing
    seemed to fall there."""
    shown = Shown(f"def f(t) integral ([0, 1], [0, 1]) [x < t]*{factor} d(x, y)\n", "f")
    assert shown.problems() == []
    assert shown.module().eval("shown_1(0.5, 1)").value == pytest.approx(slope, rel=1e-12, abs=1e-12)


def test_a_delta_in_a_narrow_place_is_shown() -> None:
    shown = Shown("def f(x, y, t) [x < t]*[x - 0.01 < y < x]\n", "f")
    assert shown.text.continuous == ()
    assert "(dt - dx)*[y < x < y + 0.01]*delta(t - x)" in shown.text.deltas


def test_equations_that_lead_back_to_each_other_are_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """A*B = -C*D, whose one way on is C*D = -A*B: of the deltas over a sum of bumps there were 16,000 such steps."""
    steps = []
    advance = _Search.advance
    monkeypatch.setattr(_Search, "advance", lambda search, goal: steps.append(goal) or advance(search, goal))
    file = EXAMPLES / "fields" / "plate.po"
    assert Shown(file.read_text(), "gain", str(file)).problems() == []
    assert 10 < len(steps) < 100


class NoPlace(AssertionError):
    """What is evaluated has no derivative at any of the places that were tried."""


def _given(shown: Shown, module: potto.Module, rng: random.Random) -> tuple[list[list[Given]], potto.Estimate]:
    """Arguments at which there is a derivative, and that; where the definition counts by a parameter, whole numbers."""
    whole = False
    for _ in range(20):
        given = shown.given(rng, whole)
        try:
            derivative = module.eval(shown.derivative(given))
        except potto.PottoError as error:
            code = error.diagnostics[0].code
            if code != "P0511" and (whole or code not in ("P0507", "P0512")):  # an index that is out of range
                raise
            whole = True
            continue
        if has_value(derivative.value):
            return given, derivative
    raise NoPlace("no arguments were found at which it has a derivative")


STEPS = 1e-3, 1e-4, 1e-5  # a surface that leaves a bound within a step of the first bends the quotient, not the slope


def _slope(module: potto.Module, name: str, t: float, c: float, dt: float, dc: float, step: float) -> float:
    """Along (dt, dc), from values alone: difference quotients of a step and half of it, extrapolated."""

    def quotient(h: float) -> float:
        above, below = (module.eval(f"{name}({t + s * h * dt!r}, {c + s * h * dc!r})").value for s in (1, -1))
        return (above - below) / (2 * h)

    return (4 * quotient(step / 2) - quotient(step)) / 3


def _is_told(shown: Shown, text: str) -> bool:
    """Whether a formula is shown, which then parses and checks; else it is said why not."""
    if not shown.text.tangent:
        assert shown.text.problems or any(item.reason for item in shown.text.integrals), text
        return False
    assert shown.problems() == [], (text, shown.text.tangent)
    return True


def _check_generated(seed: int) -> None:
    rng = random.Random(seed)
    text = definition(rng)
    shown = Shown(text, "f")
    if not _is_told(shown, text):
        return
    module = shown.module()
    for _ in range(2):
        t, c, dt, dc = (round(rng.uniform(0.3, 0.9), 3) for _ in range(4))
        found = module.eval(f"shown_1({t}, {c}, {dt}, {dc})").value
        slopes = (_slope(module, "f", t, c, dt, dc, step) for step in STEPS)
        assert any(near(found, slope, 1e-5) for slope in slopes), (text, shown.text.tangent, (t, c, dt, dc))


@pytest.mark.parametrize("seed", range(40))
def test_generated(seed: int) -> None:
    _check_generated(seed)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(examples(1, 20)))
def test_many_generated(block: int) -> None:
    for seed in range(1000 + 50 * block, 1050 + 50 * block):
        _check_generated(seed)


def _check_any(seed: int) -> bool:
    """Formulas of programs with functions, arrays and sums, against `deriv`, which finds roots and slopes by numbers:
    to 1e-6, between the 1e-8 that integrals are asked for and the least that a wrong term would add. Whether there was
    a place to ask at."""
    rng = random.Random(seed)
    text, _ = program(rng)
    shown = Shown(text, "f")
    if not _is_told(shown, text):
        return True
    module = shown.module()
    for _ in range(2):
        try:
            given, derivative = _given(shown, module, rng)
        except NoPlace:  # of sqrt(x + t) from -1 there is no value at any t below 1
            return False
        found = module.eval(shown.formula(given))
        assert near(found.value, derivative.value), (text, shown.text.tangent, shown.formula(given))
    return True


def test_any_program() -> None:
    assert sum(map(_check_any, range(20))) >= 19


@pytest.mark.slow
@pytest.mark.parametrize("block", range(examples(2, 20)))
def test_many_programs(block: int) -> None:
    assert sum(map(_check_any, range(50 * block, 50 * block + 50))) >= 48
