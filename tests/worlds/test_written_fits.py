"""Each `potto fit` that a comment of the examples suggests finds the optimum that is known by mathematics, to 1e-6."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import mpmath as mp
import pytest
from exact_dynamics import stepped, thrown, warmed
from exact_probability import truncated_moments
from worlds_references import EXAMPLES

from potto.__main__ import main as command

WRITTEN = re.compile(r"potto fit (examples/[^`\n]*)")
FOUND = [(file, line) for file in sorted(EXAMPLES.rglob("*.po"))
         for line in WRITTEN.findall(file.read_text(encoding="utf-8"))]  # fmt: skip
Optimum = dict[str, float]


def _root(f: Callable[[Any], Any], near: float) -> float:
    with mp.workdps(40):
        return float(mp.findroot(f, near))


def _room() -> Optimum:
    return {"set": _root(lambda s: mp.diff(lambda t: warmed(t, True), s), 20.2)}


def _throw() -> Optimum:
    with mp.workdps(40):
        u, v = mp.findroot(
            lambda u, v: [a - b for a, b in zip(thrown(u, v, mp.mpf(2.2)), (3, mp.mpf(0.2)), strict=True)], (1.5, 4)
        )
    return {"u": float(u), "v": float(v)}


def _truncated() -> Optimum:
    target = mp.mpf("0.229637179091329"), mp.mpf("0.572495773232557")
    with mp.workdps(40):
        a, b = mp.findroot(
            lambda a, b: [x - y for x, y in zip(truncated_moments(a, b), target, strict=True)], (-0.9, 1.9)
        )
    return {"a": float(a), "b": float(b)}


def _censored() -> Optimum:
    """After Weibull with shape 3/2, by time^(3/2): the rate is how many ended, over how long all were watched."""
    watched = (0.8, 1.1, 1.9, 2.4), (1.2, 2.9, 2.2, 3.5)
    plain, treated = ((3 / sum(t**1.5 for t in times)) ** (1 / 1.5) for times in watched)
    return {"rate": plain, "treatment": float(mp.log(plain / treated))}


def _histogram() -> Optimum:
    """Pearson's measure by error functions: where its gradient is 0."""
    edges, counts = (-3, -1, 0, mp.mpf(0.5), 1, 2, 4), (4, 13, 18, 22, 32, 11)

    def misfit(m: Any, s: Any) -> Any:
        shares = [mp.ncdf((b - m) / s) - mp.ncdf((a - m) / s) for a, b in pairwise(edges)]
        return sum((n - 100 * p) ** 2 / (100 * p) for n, p in zip(counts, shares, strict=True))

    with mp.workdps(40):
        m, s = mp.findroot(
            lambda m, s: [mp.diff(misfit, (m, s), (1, 0)), mp.diff(misfit, (m, s), (0, 1))], (0.83, 0.97)
        )
    return {"m": float(m), "s": float(s)}


KNOWN: dict[tuple[str, str], Callable[[], Optimum]] = {
    ("paper/fit.po", "light"): lambda: {"c": -1.4},
    ("paper/fit.po", "miss"): lambda: {"c": -1.15},
    ("dynamics/ball_and_wall.po", "place"): lambda: {"wall": 7 / 6},
    ("dynamics/parking.po", "miss"): lambda: {"end": 3.0, "switch": 1.5},
    ("dynamics/room.po", "cost"): _room,
    ("dynamics/spring_and_stop.po", "rebound"): lambda: {
        "stop": _root(lambda s: stepped(s, 3000, mp.mpf(0.001)) - mp.mpf(0.25), -0.49)
    },
    ("dynamics/three_impacts.po", "landing"): _throw,
    ("fields/plate.po", "earned"): lambda: {"a": 0.8, "b": 0.8 / 2**0.5},
    ("probability/censored.po", "loss"): _censored,
    ("probability/truncated.po", "moments"): _truncated,
    ("worked/histogram.po", "misfit"): _histogram,
    ("worked/picture.po", "loss"): lambda: {"r": (2 / float(mp.pi)) ** 0.5},
}


@pytest.mark.parametrize(("file", "line"), FOUND, ids=[line for _, line in FOUND])
def test_a_fit_that_is_written_finds_what_is_known(
    file: Path, line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(EXAMPLES.parent)
    words = shlex.split(line.strip())
    words = words[: words.index("finds")] if "finds" in words else words
    assert command(["fit", *words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    exact = KNOWN[file.relative_to(EXAMPLES).as_posix(), words[1]]()
    assert found["converged"] and found["parameters"].keys() == exact.keys()
    for name, number in exact.items():
        assert abs(found["parameters"][name] - number) < 1e-6, (found, exact)
