"""Ways down, checkpoints, and what is said where noise is in the way. Minima are known in closed form."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import potto
from potto.__main__ import main
from potto.applications.minimization import Seen
from potto.applications.minimizing import minimized

SOURCE = r"""
def tail(y, mean, width)
    integral [-inf, inf] [y < u]*exp(-((u - mean)/width)^2/2)/(width*sqrt(2*pi)) d(u)

def valley(x, y)
    (1 - x)^2 + 10*(y - x^2)^2

def cover(r)
    (integral ([0, 1], [0, 1]) [x^2 + y^2 < r^2] d(x, y) - 0.3)^2

def spread(xs: [n] Real)
    sum i in 0..n-1 ((xs[i] - i)^2)
"""
m = potto.compile(SOURCE)


def test_records_and_tuples_are_fitted_in_their_form() -> None:
    program = potto.compile("""
record Lens(at: (Real, Real), width: Real)
def off(lens: Lens, k) (lens.at.0 - 1)^2 + (lens.at.1 - 2*k)^2 + (lens.width - 3)^2 + (k - 1)^2
def pair(p: (Real, Real)) (p.0 - 1)^2 + (p.1 - 2)^2
""")
    start = {"lens": {"at": (0.0, 0.0), "width": 1.0}, "k": 0.5}
    found = potto.fit(program.off, start)
    assert found.converged and list(found["lens"]["at"]) == pytest.approx([1, 2], abs=1e-6)
    assert (found["lens"]["width"], found["k"]) == pytest.approx((3, 1), abs=1e-6)
    assert list(found.numbers) == ["lens.at[0]", "lens.at[1]", "lens.width", "k"]
    assert list(potto.fit(program.pair, {"p": (0.0, 0.0)})["p"]) == pytest.approx([1, 2], abs=1e-6)


def test_gauss_newton_takes_few_steps_to_a_target() -> None:
    y = np.linspace(-2, 3, 15)
    target = np.array([0.5 * math.erfc((v - 0.7) / 1.3 / math.sqrt(2)) for v in y])
    found = potto.fit(m.tail, {"mean": 0.0, "width": 1.0}, given={"y": y}, target=target, method="gauss-newton")
    assert found.converged and len(found.steps) <= 10
    assert (found["mean"], found["width"]) == pytest.approx((0.7, 1.3), abs=1e-6)


def test_gauss_newton_stays_within_bounds() -> None:
    y = np.linspace(-2, 3, 15)
    target = np.array([0.5 * math.erfc((v - 0.7) / 1.3 / math.sqrt(2)) for v in y])
    found = potto.fit(
        m.tail, {"mean": 0.0, "width": 1.3}, given={"y": y}, target=target, bounds={"mean": (-1, 0.5)},
        method="gauss-newton",
    )  # fmt: skip
    assert found["mean"] == 0.5 and "mean" in found.held


def test_adam_comes_near_and_says_that_its_steps_are_done() -> None:
    found = potto.fit(m.valley, {"x": -1.0, "y": 1.0}, steps=400, method="adam")
    assert (found["x"], found["y"]) == pytest.approx((1, 1), abs=0.02)
    assert found.converged or "400 steps" in found.reason
    assert potto.fit(m.spread, {"xs": [1.0, 1.0, 1.0]}, steps=300, method="adam")["xs"] == pytest.approx(
        [0, 1, 2], abs=1e-2
    )


def test_a_checkpoint_is_where_the_next_fit_goes_on(tmp_path: Path) -> None:
    file = str(tmp_path / "fit.json")
    first = potto.fit(m.valley, {"x": -1.0, "y": 1.0}, steps=3, checkpoint=file)
    assert not first.converged and json.loads(Path(file).read_text())["parameters"] == first.parameters
    second = potto.fit(m.valley, {"x": -1.0, "y": 1.0}, checkpoint=file)
    assert second.steps[0].parameters == first.steps[-1].parameters
    assert second.converged and second["x"] == pytest.approx(1, abs=1e-6)
    with pytest.raises(potto.PottoError, match="a fit of x, y"):
        potto.fit(m.cover, {"r": 0.5}, checkpoint=file)
    Path(file).write_text("[")
    with pytest.raises(potto.PottoError, match="not a checkpoint"):
        potto.fit(m.cover, {"r": 0.5}, checkpoint=file)


def test_noise_is_told_where_it_limits() -> None:
    with potto.settings(method="mc", samples=1000, seed=3):
        found = potto.fit(m.cover, {"r": 0.5}, steps=60)
    assert abs(found["r"] - math.sqrt(1.2 / math.pi)) < 0.05
    assert found.reason.startswith("noise limits it: the slope is within the error")
    assert "noise" not in potto.fit(m.cover, {"r": 0.5}).reason


def test_noise_of_values_is_told_too() -> None:
    def rough(x: np.ndarray) -> Seen:
        off = math.sin(1e5 * x[0])
        return Seen(float((x[0] - 1) ** 2 + 0.001 * off), np.array([2 * (x[0] - 1) + 0.002 * off]), 0.0, 0.001)

    found = minimized(rough, {"x": 0.2}, [(-9.0, 9.0)])
    assert not found.converged and found.reason.startswith("noise limits it: the value is known to ± ")
    assert abs(found["x"] - 1) < 0.3


def test_an_answer_is_a_few_lines_and_draws_its_way(tmp_path: Path) -> None:
    found = potto.fit(m.valley, {"x": -1.0, "y": 1.0}, bounds={"x": (None, 0.5)})
    lines = str(found).splitlines()
    assert lines == repr(found).splitlines() and lines[0] == "x = 0.5" and lines[1].startswith("y = 0.25")
    assert lines[2].startswith("value = ") and "; stopped by a bound: x (slope 0" in lines[3] and len(lines) == 4
    many = potto.fit(m.spread, {"xs": [1.0] * 20}, steps=1)
    assert "… 8 more" in str(many) and len(str(many).splitlines()) == 15
    found.plot(str(tmp_path / "way.svg"))
    assert "value" in (tmp_path / "way.svg").read_text()
    with pytest.raises(potto.PottoError, match=r"`\.bmp`|bmp"):
        found.plot(str(tmp_path / "way.bmp"))


def test_samples_in_common_do_not_stop_a_fit_to_a_target() -> None:
    lit = potto.compile("def lit(x, edge) integral [0, 1] [u*x < edge] d(u)").lit
    x = np.linspace(0.5, 2, 16)
    with potto.settings(method="mc", samples=100, seed=1):
        found = potto.fit(lit, {"edge": 0.4}, given={"x": x}, target=np.minimum(1, 0.7 / x))
    assert abs(found["edge"] - 0.7) < 0.05 and "noise limits it: the value is known to ± " in found.reason


@pytest.mark.parametrize("bounds", [(1, 0), (0, math.nan), 1, ("a", "b"), (0, 1, 2)])
def test_bounds_that_hold_no_number_are_refused(bounds: Any) -> None:
    with pytest.raises(potto.PottoError, match="the bounds of `r` are"):
        potto.fit(m.cover, {"r": 0.5}, bounds={"r": bounds})


def test_what_cannot_be_is_told() -> None:
    with pytest.raises(potto.PottoError, match="no method `newton`"):
        potto.fit(m.cover, {"r": 0.5}, method="newton")
    with pytest.raises(potto.PottoError, match="no target is given"):
        potto.fit(m.cover, {"r": 0.5}, method="gauss-newton")


def test_the_command_goes_on_from_a_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("valley.po").write_text(SOURCE)
    command = ["fit", "valley.po", "valley", "x=-1", "y=1", "--checkpoint", "fit.json"]
    assert main([*command, "--steps", "2"]) == 1
    kept = json.loads(Path("fit.json").read_text())["value"]
    assert main(command) == 0
    assert json.loads(Path("fit.json").read_text())["value"] < kept
    assert "x = 1" in capsys.readouterr().out
