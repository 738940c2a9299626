"""The benchmark of throughput: what is written by hand is right, and its lines answer as their tables say."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"
sys.path.append(str(FOLDER))
import throughput_by_hand as hand  # noqa: E402


def test_pictures_by_hand_add_up_to_what_they_show() -> None:
    """262,144 pixels whose areas are differences of numbers around 1/10: off by 2e-17 each, and a few 1e-13 in all."""
    area, rate = hand.disc(0.1).sum(axis=1)
    assert area == pytest.approx(0.1 * math.pi, rel=0, abs=1e-11)
    assert rate == pytest.approx(math.pi, rel=0, abs=1e-11)
    ax, ay, bx, by, cx, cy = hand.TRIANGLE
    area, rate = hand.triangle(0.05).sum(axis=1)
    assert area == pytest.approx(((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) / 2, rel=0, abs=1e-11)
    assert rate == pytest.approx(0, rel=0, abs=1e-11)
    assert hand.picture(-0.7).sum(axis=1) == pytest.approx(hand.half_plane(np.array([-0.7]))[:, 0], rel=1e-11, abs=0)


def test_areas_of_pairs_have_the_derivatives_that_they_say() -> None:
    """Central differences, 1e-6 apart: off by 1e-16/1e-6, and by 1e-12 times curvatures of up to 1/slope."""
    p = np.array(hand.TRIANGLE)[:, None]
    x, y = (np.array([v]) for v in (0.2, 0.25))
    found = hand.pairs(p, x, y, 0.5)[:, 0]
    for i in range(6):
        step = np.zeros_like(p)
        step[i] = 1e-6
        up, down = (hand.pairs(p + sign * step, x, y, 0.5)[0, 0] for sign in (1, -1))
        assert found[1 + i] == pytest.approx((up - down) / 2e-6, rel=0, abs=1e-8)


@pytest.mark.skipif(hand.compiled() is None, reason="needs a C compiler, `cc`")
def test_c_gives_what_numpy_gives() -> None:
    """Equal but for the order of sums and for contracted products: 1e-10 of areas that are differences."""
    for name, numpy, given in (("disc", hand.disc, (0.1,)), ("picture", hand.picture, (-0.7,))):
        run = hand.in_c(name, np.empty((2, hand.SIDE**2)), *given)
        assert run is not None
        expected = numpy(*given)
        assert np.abs(run() - expected).max() <= 1e-10 * np.abs(expected).max()


@pytest.mark.slow
def test_lines_are_right_and_told_to_machines(tmp_path: Path) -> None:
    wanted = ["--only", "one", "--only", "kernel", "--only", "shading", "--seconds", "0.01"]
    command = [sys.executable, str(FOLDER / "throughput.py"), *wanted, "--json", str(tmp_path / "t.json")]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = json.loads((tmp_path / "t.json").read_text())
    assert set(found) == {"one", "kernel", "shading"} and "goals are met" in told
    for rows in found.values():
        for row in rows:
            assert row["off"] < 1e-10 and row["seconds"] > 0, row
