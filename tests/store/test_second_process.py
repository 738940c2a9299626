"""A second process finds plans and kernels on disk, and answers as the first one, to the last bit."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

SCRIPT = """
import json, sys
import potto
told = []
for program, call in json.loads(sys.stdin.read()):
    m = potto.compile(program)
    r = eval(call, {"m": m, "potto": potto})
    numbers = [r.value, r.error, r.tangent, r.tangent_error]
    told.append([repr(numbers), r.evals, r.converged, r.stats["kernels compiled"], r.stats["kernels from disk"]])
print(json.dumps(told))
"""
TRIANGLE = """
def pixel(ax, ay, bx, by, cx, cy)
    integral ([0, 1], [0, 1])
        [(x - ax)*(by - ay) > (y - ay)*(bx - ax)]*[(x - bx)*(cy - by) > (y - by)*(cx - bx)]
        *[(x - cx)*(ay - cy) > (y - cy)*(ax - cx)]*(0.2 + 0.5*x + 0.1*x*y) d(x, y)
"""
MANY = "def f(t) integral [0, 1] " + " + ".join(f"{k}*[x < {k}*t/81]*x^{k % 4}" for k in range(1, 81)) + " d(x)\n"
CALLS = """
def shade(x, y)(c) if c > 0 then exp(-x*y)*c else x + y
def f(c, s) integral ([0, 1], [0, 1]) s (x, y) c*[x + y*y < c] d(x, y)
def g(c) f(c, shade) + (sum k in 1..3 (integral [0, 1] sin(k*x*c) d(x)))
def fall(n, x) if n > 0 then fall(n - 1, x/2 + [x < 0.25]) else x
def h(c) integral [0, 1] fall(3, x)*[x^3 - x + c < 0.1] d(x)
"""
PROGRAMS = [
    (TRIANGLE, "potto.deriv(m.pixel)((0.1, 1), (0.1, 0), (0.3, 0), (0.9, 0), (0.8, 0), (0.2, 0))"),
    (MANY, "potto.deriv(m.f)((0.7, 1))"),
    (CALLS, "potto.deriv(m.g)((0.7, 1))"),
    (CALLS, "m.h(0.3)"),
]


def run(folder: str, programs: list[tuple[str, str]] = PROGRAMS) -> list[Any]:
    environment = {**os.environ, "POTTO_CACHE": folder}
    told = subprocess.run(
        [sys.executable, "-c", SCRIPT], input=json.dumps(programs), env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert told.returncode == 0, told.stderr
    found: list[Any] = json.loads(told.stdout)
    return found


def test_a_second_process_compiles_nothing_and_answers_the_same(tmp_path: Path) -> None:
    without, first, second = run("off"), run(str(tmp_path)), run(str(tmp_path))
    assert [answer[:3] for answer in without] == [answer[:3] for answer in first] == [answer[:3] for answer in second]
    assert sum(answer[3] for answer in first) > 10 and sum(answer[4] for answer in second) > 10
    assert sum(answer[3] for answer in second) == 0 == sum(answer[4] for answer in without)


def test_an_edited_definition_is_another_one(tmp_path: Path) -> None:
    """The callers' plans and kernels name it; what was kept of them was found from what it was."""
    edited = [(CALLS.replace("c else x + y", "2*c else x + y").replace("x < 0.25", "x < 0.5"), call)
              for _, call in PROGRAMS[2:]]  # fmt: skip
    run(str(tmp_path))
    assert [answer[:3] for answer in run(str(tmp_path), edited)] == [answer[:3] for answer in run("off", edited)]


def test_what_was_kept_and_is_damaged_is_made_again(tmp_path: Path) -> None:
    first = run(str(tmp_path))
    for path in (tmp_path / "store").glob("*/*"):
        path.write_bytes(path.read_bytes()[:-1])
    again = run(str(tmp_path))
    assert again == first
    assert sum(answer[3] for answer in run(str(tmp_path))) == 0
