"""The bench: what it measures on a tiny catalogue, and how the report reads."""

from __future__ import annotations

import csv
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from potto.__main__ import main
from potto.bench.measure import BenchRun, measure, slope
from potto.bench.ours import OURS
from potto.bench.peers import BATCH, PEERS, SCALAR, cells
from potto.bench.problems import QUANTITIES, catalogue
from potto.bench.report import needed, table
from potto.extras import install_command

PROBLEMS = {p.id: p for p in catalogue()}
STEP, QUAD, EIGHT = PROBLEMS["step"], PROBLEMS["eq1-quad"], PROBLEMS["eight"]

METHODS = [pytest.param(a.name, marks=[pytest.mark.slow] if a.package == "jax" else []) for a in (*OURS, *PEERS)]


def peer(name):
    return next(a for a in (*OURS, *PEERS) if a.name == name)


def runs_of(problem, name, quantity, rungs=3):
    if peer(name).missing():
        pytest.skip(f"{name} is not installed")
    if name.startswith("JAX"):  # starts threads, which forks of other tests in this process do not like
        words = ["bench", problem.id, "--methods", name, "--quantity", quantity, "--quick", "--json"]
        said = subprocess.run([sys.executable, "-m", "potto", *words], capture_output=True, text=True, check=True)
        return [BenchRun(**run) for run in json.loads(said.stdout)["runs"]][:rungs]
    return list(measure([problem], [peer(name)], [quantity], 0.5, rungs))


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)
def test_the_integrand_is_one_function_for_numbers_and_arrays(problem):
    inside = np.random.default_rng(1).random((20, problem.dimensions))
    places = [lo + (hi - lo) * column for column, (lo, hi) in zip(inside.T, problem.bounds)]
    together = problem.function(BATCH)(*places, problem.at)
    one_by_one = [problem.function(SCALAR)(*map(float, place), problem.at) for place in zip(*places)]
    np.testing.assert_allclose(together, one_by_one, rtol=1e-12)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("problem", [STEP, QUAD, EIGHT], ids=lambda p: p.id)
def test_a_method_gets_nearer_to_the_value(name, problem):
    """Not for what it says of itself: against the exact answer."""
    if not peer(name).ladder(problem):
        pytest.skip(f"{name} does not do {problem.dimensions} dimensions")
    runs = runs_of(problem, name, "value", 4)
    assert not any(run.failure for run in runs)
    assert runs[-1].error < 0.15 and runs[-1].evaluations > 0 and runs[-1].seconds > 0


@pytest.mark.parametrize("name", METHODS[-2:])
def test_the_derivative_of_a_sum_lacks_the_boundary_however_many_points(name):
    """d/dt of int_0^1 e^x [x < t] is all boundary: the sum's derivative is 0, off by 100 %."""
    assert [run.value for run in runs_of(STEP, name, "derivative")] == [0.0, 0.0, 0.0]
    assert all(run.error > 3 for run in runs_of(QUAD, name, "derivative"))  # of the wrong sign, and larger


def test_our_quadrature_has_the_derivative_at_once():
    (run,) = runs_of(QUAD, "potto quadrature", "derivative", 1)
    assert run.error < 1e-10 and run.reported >= run.error and run.evaluations < 400


def test_differences_of_values_are_derivatives_of_a_kind():
    best = min(run.error for run in runs_of(STEP, "scipy quad", "derivative", 6))
    assert 1e-12 < best < 1e-3


def test_sums_have_equal_cells():
    places, count = cells(EIGHT, 300)
    assert count == 2**8 and [p.size for p in places] == [2] * 8
    (x,), count = cells(STEP, 4)
    assert count == 4 and x.tolist() == [0.125, 0.375, 0.625, 0.875]


def test_monte_carlo_converges_like_the_root_and_quasi_monte_carlo_like_the_number():
    """Six seeds, so that the slopes are themselves uncertain by about a tenth."""
    from potto.bench.measure import climb

    plain = list(climb(QUAD, "value", peer("potto mc"), [2.0**k for k in range(8, 17, 2)], 1.0))
    quasi = list(climb(QUAD, "value", peer("potto qmc"), [2.0**k for k in range(8, 15, 2)], 1.0))
    assert -0.75 < slope(plain) < -0.3
    assert slope(quasi) < -0.9


# The report


def run_of(setting, seconds, error, **more):
    fields = {"problem": "step", "quantity": "value", "method": "m", "dial": "rtol", "setting": setting,
              "seconds": seconds, "evaluations": 10, "value": 1.0, "error": error, "reported": None}  # fmt: skip
    return BenchRun(**{**fields, **more})


def test_one_lucky_rung_does_not_count():
    ladder = [run_of(1, 1e-3, 1e-9), run_of(2, 2e-3, 1e-3), run_of(3, 3e-3, 1e-5), run_of(4, 4e-3, 1e-5)]
    assert needed(ladder, 1e-4) is ladder[2] and needed(ladder, 1e-2) is ladder[0] and needed(ladder, 1e-6) is None


def test_slopes_are_of_powers():
    ladder = [run_of(k, 1.0, 3 * 10.0**-k, evaluations=10 ** (2 * k)) for k in range(1, 6)]
    assert slope(ladder) == pytest.approx(-0.5, abs=1e-12, rel=0)
    assert slope(ladder[:3]) is None and slope([run_of(k, 1.0, 1e-16) for k in range(9)]) is None


def test_a_method_that_fails_says_how():
    failed = run_of(1, math.nan, math.nan, failure="ValueError: no")
    assert "failed: ValueError: no" in table(STEP, "value", [failed])


def test_a_method_that_raises_is_reported_and_ends_nothing():
    class Raises:
        name, package, dial, random = "raises", None, "n", False

        def missing(self):
            return None

        def ladder(self, problem):
            return (1.0, 2.0)

        def prepare(self, problem, quantity):
            def solve(rung, seed):
                raise ZeroDivisionError("oh\nno")

            return solve

    (run,) = measure([STEP], [Raises()], ["value"], 1.0)
    assert run.failure == "ZeroDivisionError: oh" and math.isnan(run.error)


# The command


def test_the_table(capsys):
    assert main(["bench", "step", "--quick", "--methods", "potto quad,complex"]) == 0
    out = capsys.readouterr().out
    assert "step, value: one jump on a line" in out and "step, derivative" in out
    row = next(line for line in out.splitlines() if line.startswith("  sum, complex step") and "1e+00" in line)
    assert row.split()[3:] == ["-", "-", "-", "-", "-", "1e+00", "-"]


def test_json_csv(capsys, tmp_path: Path):
    target = tmp_path / "runs.csv"
    assert main(["bench", "step", "--quick", "--methods", "potto quad", "--json", "--csv", str(target)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {run["quantity"] for run in answer["runs"]} == set(QUANTITIES)
    rows = list(csv.DictReader(target.open()))
    assert [float(r["error"]) for r in rows] == [r["error"] for r in answer["runs"]]


def test_what_is_not_installed_is_listed(capsys, monkeypatch):
    monkeypatch.setattr("potto.bench.peers.installed", lambda package: None if package == "vegas" else "1.0")
    assert main(["bench", "step", "--quick", "--methods", "vegas,potto quad"]) == 0
    out = capsys.readouterr().out
    assert "vegas: not installed (pip install 'vegas')" in out and "  vegas " not in out


def test_the_plot(capsys, tmp_path: Path):
    pytest.importorskip("matplotlib")
    target = tmp_path / "runs.png"
    assert main(["bench", "step", "--quick", "--methods", "potto quad,complex", "--plot", str(target)]) == 0
    assert target.read_bytes().startswith(b"\x89PNG") and target.stat().st_size > 5000
    assert main(["bench", "step", "--quick", "--methods", "complex", "--plot", str(tmp_path / "x.nonsense")]) == 1
    assert "nonsense" in capsys.readouterr().err


def test_the_plot_needs_a_library(capsys, monkeypatch):
    monkeypatch.setattr("potto.bench.plotting.has_matplotlib", lambda: False)
    assert main(["bench", "step", "--plot", "x.png"]) == 2
    assert install_command("bench") in capsys.readouterr().err


@pytest.mark.parametrize(("words", "said"), [
    (["stepp"], "did you mean `step`"), (["--methods", "maple"], "no method is named maple"),
    (["--seconds", "0"], "must be positive"),
])  # fmt: skip
def test_mistakes(capsys, words, said):
    assert main(["bench", *words]) == 2
    assert said in capsys.readouterr().err


def test_the_list(capsys):
    assert main(["bench", "--list"]) == 0
    out = capsys.readouterr().out
    assert all(id in out for id in PROBLEMS) and all(a.name in out for a in (*OURS, *PEERS))
