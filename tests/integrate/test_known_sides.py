"""At a point by itself only those surfaces are swept that may cross what is integrated over."""

import math
from pathlib import Path

import pytest

import potto
from potto.integrate import outline
from potto.runtime.integration.preparation.known_sides import Sided
from potto.runtime.integration.problem import clear

PROGRAM = """
def seen(x, y, r)
    integral ([x, x + 1], [y, y + 1])
        (if [r^2 - u^2 - v^2 > 0] then (if [u^2*v > 0.3] then 2*u else 1) else 0)
        d(u, v)
def roots(x, t)
    integral ([x, x + 1]) (if [sqrt(u) + u^2*t^2 + u^4*t^2 + u^6*t + t > 0] then u else 3) d(u)
def pair(x, y, r)
    integral ([x, x + 1], [y, y + 1])
        (if [u^2 + v^2 + u*v > r and u^3 > r] then (u, 1) else (0, 0))
        d(u, v)
def shader(x, r, s) integral ([x, x + 1]) (s(u)*(if [u^2 + u^4 > r] then 1 else 0)) d(u)
def toned(x, r, t) shader(x, r, \\u . if [u^3 > t] then 2 else 1)
"""


@pytest.fixture
def module(tmp_path: Path):
    file = tmp_path / "sides.po"
    file.write_text(PROGRAM)
    return potto.load(file)


@pytest.fixture
def swept(monkeypatch, tmp_path: Path):
    """How many jumps each sweep was given; nothing is known from before."""
    monkeypatch.setenv("POTTO_CACHE", str(tmp_path / "cache"))
    clear()
    numbers, whole = [], outline.sweep

    def counted(term, found, *rest):
        numbers.append(sum(f.kind == "jump" for f in found))
        return whole(term, found, *rest)

    monkeypatch.setattr(outline, "sweep", counted)
    return numbers


def test_what_nothing_crosses_is_swept_for_nothing(module, swept):
    value, slope = potto.deriv(module.seen)((1.0, 1.0), (1.0, 0.0), (9.0, 1.0))
    # the integral of 2 u over [1, 2]^2, and by x: closed forms, whose terms a double has to a few roundings
    assert float(value) == pytest.approx(3, rel=1e-14)
    assert float(slope) == pytest.approx(2, rel=1e-14)
    assert not any(swept)


def test_what_is_dark_is_swept_for_nothing(module, swept):
    assert float(module.seen(5.0, 5.0, 1.0)) == 0
    assert [float(part) for part in module.pair(1.0, 1.0, 100.0)] == [0, 0]
    assert not any(swept)


def test_only_what_crosses_is_swept(module, swept):
    potto.deriv(module.seen)((1.0, 0.0), (0.0, 0.0), (2.0, 1.0))
    assert set(swept) == {2}  # both cross
    swept.clear()
    value, slope = potto.deriv(module.seen)((0.0, 0.0), (-1.0, 0.0), (0.5, 1.0))
    # a quarter of a disc, in which u^2*v is nowhere positive
    assert float(value) == pytest.approx(math.pi / 16, rel=1e-10)  # what quadrature beside a round edge promises
    assert float(slope) == pytest.approx(math.pi / 4, rel=1e-10)
    assert set(swept) == {1}


def test_a_surface_that_ends_has_no_side(module):
    """sqrt is not defined below 0: what crosses that is left to the ways that tell."""
    assert math.isnan(float(module.roots(-0.5, 1.0)))
    assert float(module.roots(0.5, 1.0)) == pytest.approx(1, rel=1e-14)


def test_shaders_given_are_looked_into(module, swept):
    value, slope = potto.deriv(module.toned)((2.0, 0.0), (1.0, 0.0), (30.0, 1.0))
    assert float(value) == 1
    assert float(slope) == 0
    assert not any(swept)
    value, slope = potto.deriv(module.toned)((2.0, 0.0), (1.0, 0.0), (15.625, 1.0))
    # 1 up to 2.5, then 2; the edge moves by a third of 2.5^-2
    assert float(value) == pytest.approx(1.5, rel=1e-13)
    assert float(slope) == pytest.approx(-1 / (3 * 2.5**2), rel=1e-13)
    assert set(swept) == {0, 1}


def test_after_many_sides_the_whole_is_made(tmp_path: Path, swept):
    file = tmp_path / "many.po"
    surfaces = "*".join(f"(if [u^2 > t - {k}] then 2 else 1)" for k in range(20))
    file.write_text(f"def f(x, t) integral ([x, x + 0.125]) ({surfaces}) d(u)\n")
    function = potto.load(file).f
    for t in range(20):
        assert float(function(0.25, t + 0.5)) == pytest.approx(2.0 ** (19 - t) / 8, rel=1e-14)
    assert max(swept) == 20


def test_of_many_sides_that_come_to_one_integral_it_is_made_once(tmp_path: Path, swept):
    """Six conditions have 64 sets of sides: all but one leave nothing."""
    conditions = " * ".join(f"[u^3 + u^5 + u^7 < t{n}]" for n in range(6))
    names = ", ".join(f"t{n}" for n in range(6))
    file = tmp_path / "one.po"
    file.write_text(f"def f({names}) integral [0, 1] {conditions} * u d(u)\n")
    function = potto.load(file).f
    for n in range(1, 64):
        assert float(function(*(-1.0 if n >> k & 1 else 4.0 for k in range(6)))) == 0
    assert not any(swept)
    assert float(function(*[4.0] * 6)) == pytest.approx(0.5, rel=1e-14)


def test_few_members_are_each_on_their_sides(module):
    """Dark, bright and cut ones in one batch: by the bounds of x the integral of u, and how long it is."""
    low = [0.0, 3.0, 1.5]
    first, second = module.pair(low, [3.0, 3.0, 0.0], 5.2)
    alone = [[float(part) for part in module.pair(x, y, 5.2)] for x, y in zip(low, [3.0, 3.0, 0.0], strict=True)]
    assert list(map(float, first)) == pytest.approx([one for one, _ in alone], rel=1e-10)  # rtol of both ways
    assert list(map(float, second)) == pytest.approx([one for _, one in alone], rel=1e-10)
    assert alone[0] == [0, 0]  # u^3 is at most 1
    assert alone[1] == pytest.approx([3.5, 1], rel=1e-14)
    edge = 5.2 ** (1 / 3)
    assert 0 < alone[2][1] < 2.5 - edge


def test_a_call_looks_once(module, monkeypatch):
    """A rule for it, what is settled near it and the integral itself all ask; a look takes half of an uncut pixel."""
    slope, looks, look = potto.deriv(module.seen), [], Sided._within
    slope((1.0, 1.0), (1.0, 0.0), (9.0, 1.0))
    monkeypatch.setattr(Sided, "_within", lambda sided, box: looks.append(box) or look(sided, box))
    for x in (1.01, 1.02):
        slope((x, 1.0), (1.0, 0.0), (9.0, 1.0))
    assert [box["x"] for box in looks] == [(1.01, 1.01), (1.02, 1.02)]
