"""Who computes at many points: numpy first, machine code when it pays, from the cache what was compiled before."""

from __future__ import annotations

import importlib.util
import json
import multiprocessing
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import potto
from potto.kernels.making import counts
from potto.kernels.native import objects, points, promotion
from potto.runtime.integration import direct

needs_llvm = pytest.mark.skipif(importlib.util.find_spec("llvmlite") is None, reason="llvmlite is not installed")
TEXT = "def f(c) integral ([0, 1], [0, 1]) 1/(x + y + c + 2)^2*[x + y + c >= 0] d(x, y)"
WHERE = np.linspace(-1.9, -0.1, 2_000)


def closed(c: np.ndarray, d: float = 2.0) -> np.ndarray:
    """The integral of 1/(s + c + d)^2 with s = x + y, where s >= -c: over s of its density, s and 2 - s."""

    def of_s(s: np.ndarray) -> np.ndarray:  # of s/(s + c + d)^2
        return np.log(s + c + d) + (c + d) / (s + c + d)

    def of_rest(s: np.ndarray) -> np.ndarray:  # of (2 - s)/(s + c + d)^2
        return -(c + d + 2) / (s + c + d) - np.log(s + c + d)

    low, one, two = -c, np.ones_like(c), np.full_like(c, 2.0)
    first = np.where(low < 1, of_s(one) - of_s(np.minimum(low, 1.0)), 0.0)
    return first + of_rest(two) - of_rest(np.maximum(low, 1.0))


def held(answer: potto.Estimate, d: float = 2.0) -> None:
    """Right, within its own error and what rounding does to the closed form."""
    assert (np.abs(answer.value - closed(WHERE, d)) <= answer.error + 2e-15).all()
    assert answer.converged


@needs_llvm
def test_numpy_answers_first_and_machine_code_takes_over() -> None:
    d = 2.0625  # a program that no other test has met
    function, before = potto.compile(TEXT.replace("2)", f"{d})")).f, counts.native_points
    with potto.settings(backend="auto"):
        held(function(WHERE), d)
        assert counts.native_points == before
        for _ in range(400):
            held(function(WHERE), d)
            if counts.native_points > before:
                return
    raise AssertionError("machine code never took over")


@needs_llvm
def test_the_text_of_a_long_function_waits_until_it_would_pay(monkeypatch: pytest.MonkeyPatch) -> None:
    """How long it is at the least its kernel tells: 500 roots are thousands of lines, 0.1 s for LLVM and who writes
    them, and 2,000 places take numpy 10 ms."""
    written: list[int] = []
    text_of = points.Pointwise.text
    monkeypatch.setattr(points.Pointwise, "text", lambda self: written.append(1) or text_of(self))
    objects.compiler()  # so that nothing waits for it
    function = potto.compile("def f(c) " + " + ".join(f"sqrt(c + {k}.0625)" for k in range(3, 503))).f
    exact = np.sqrt(WHERE[:, None] + np.arange(3, 503) + 0.0625).sum(axis=1)
    with potto.settings(backend="auto"):
        assert function(WHERE).value == pytest.approx(exact, rel=1e-13)
        assert function(WHERE).value == pytest.approx(exact, rel=1e-13)
    assert not written


@needs_llvm
def test_numpy_goes_on_where_llvm_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(text: str, name: str) -> objects.Loaded:
        raise RuntimeError("LLVM knows no such processor")

    monkeypatch.setattr(objects, "made", failing)
    for cost in ("LLVM", "LEAST", "LINE", "WRITTEN"):
        monkeypatch.setattr(promotion, cost, 0.0)
    d, before = 2.03125, counts.native_points
    text = TEXT.replace("2)", f"{d})").replace("x + y + c", "x + y + c + 0.25")  # nor has any met where this is cut
    function = potto.compile(text).f
    with potto.settings(backend="auto"):
        for _ in range(20):
            held(function(WHERE - 0.25), d)
    assert counts.native_points == before


@needs_llvm
def test_calls_go_on_as_they_were_while_machine_code_is_on_its_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """Near what is settled numpy adds up at once: one call after the other is not worked out from the beginning."""
    ready, made, whole = threading.Event(), objects.made, []

    def waiting(*of: Any) -> Any:
        ready.wait(60)
        return made(*of)

    def noted(*of: Any) -> Any:
        whole.append(of)
        return proved_sum(*of)

    proved_sum = direct.proved_sum
    monkeypatch.setattr(objects, "made", waiting)
    monkeypatch.setattr(direct, "proved_sum", noted)
    for cost in ("LLVM", "LEAST", "LINE", "WRITTEN"):
        monkeypatch.setattr(promotion, cost, 0.0)
    function = potto.deriv(potto.compile(TEXT.replace("2)", "2.015625)")).f)
    with potto.settings(backend="auto"):
        for n in range(200):
            function((-0.7 + 1e-6 * n, 1.0))
    ready.set()
    assert 0 < len(whole) < 20


@needs_llvm
def test_numpy_alone_where_it_is_asked_for() -> None:
    before = counts.native_points
    with potto.settings(backend="numpy"):
        held(potto.compile(TEXT).f(WHERE))
    assert counts.native_points == before


@needs_llvm
def test_statistics_tell_what_machine_code_did() -> None:
    with potto.settings(backend="native"):
        stats = potto.compile(TEXT.replace("2)^2", "3)^2")).f(WHERE).stats
    assert stats["points by machine code"] > WHERE.size
    assert stats["machine code compiled"] + stats["machine code from the cache"] > 0


CALLING = """
def tone(v) if v > 0.3 then v/(1 + v) else v*v
def mixed(x, y, shader) tone(shader(x, y))*x + shader(y, 2*x)
def smooth(x, y) exp(x - y)
def sharp(x, y) [x > y]*x + y
def still(x, y) 0.25
def deeper(x, n) if n < 1 then x else deeper(x*x, n - 1)
"""


@needs_llvm
@pytest.mark.parametrize("name", ["smooth", "sharp"])
def test_calls_are_part_of_the_machine_code(name: str) -> None:
    m = potto.compile(CALLING)
    x, y = np.random.default_rng(5).random((2, 3_000))
    own = {"smooth": lambda x, y: np.exp(x - y), "sharp": lambda x, y: (x > y) * x + y}[name]
    v, before = own(x, y), counts.native_points
    with potto.settings(backend="native"):
        found = m.mixed(x, y, getattr(m, name))
    assert counts.native_points - before == x.size  # by one function
    exact = np.where(v > 0.3, v / (1 + v), v * v) * x + own(y, 2 * x)
    np.testing.assert_allclose(found.value, exact, rtol=2e-15)
    with potto.settings(backend="numpy"):
        np.testing.assert_array_max_ulp(found.value, m.mixed(x, y, getattr(m, name)).value, 2)


@needs_llvm
def test_what_is_the_same_at_all_points_is_numpys() -> None:
    m, x = potto.compile(CALLING + "def flat(x, shader) shader(x, x)*2"), np.linspace(0, 1, 3_000)
    with potto.settings(backend="native"):
        assert np.all(m.flat(x, m.still).value == 0.5)


@needs_llvm
def test_a_call_that_goes_deeper_as_values_tell_stays_one() -> None:
    x = np.linspace(0.5, 1.0, 3_000)
    with potto.settings(backend="native"):
        np.testing.assert_allclose(potto.compile(CALLING).deeper(x, 3).value, x**8, rtol=1e-14)


@needs_llvm
def test_a_second_process_finds_it_compiled(tmp_path: Path) -> None:
    program = (
        f"import json, numpy, potto\nwith potto.settings(backend='native'):\n"
        f"    r = potto.compile({TEXT!r}).f(numpy.linspace(-1.9, -0.1, 2000))\n"
        "counted = [r.stats['machine code ' + where] for where in ('compiled', 'from the cache')]\n"
        "print(json.dumps([float(r.value.sum()), *counted]))"
    )
    environment = {**os.environ, "POTTO_CACHE": str(tmp_path)}

    def run() -> tuple[float, int, int]:
        done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, check=True)
        value, compiled, kept = json.loads(done.stdout)
        return value, compiled, kept

    first, second = run(), run()
    assert first[1] > 0 and first[2] == 0
    assert second[1] == 0 and second[2] == first[1]
    assert first[0] == second[0] == pytest.approx(closed(WHERE).sum(), rel=1e-14)
    for entry in (tmp_path / "store" / "machine-code").iterdir():
        entry.write_bytes(entry.read_bytes()[:-1])  # damaged: compiled again
    assert run() == first


def _in_a_fork() -> None:
    with potto.settings(backend="native"):
        held(potto.compile(TEXT.replace("def f", "def g")).g(WHERE))


@needs_llvm
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there are no forks here")
def test_forks_compile_for_themselves() -> None:
    with potto.settings(backend="native"):
        held(potto.compile(TEXT).f(WHERE))
    child = multiprocessing.get_context("fork").Process(target=_in_a_fork)
    child.start()
    child.join(60)
    assert child.exitcode == 0


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    wanted = "machine code needs llvmlite: pip install 'llvmlite>="
    with pytest.raises(potto.PottoError, match=wanted), potto.settings(backend="native"):
        pass
