"""What mypy says of code that uses Potto: strict, against the installed package and against stubs of programs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mypy", reason="mypy is not installed")

PROGRAM = """
# Areas.

# The length of [0, 1] left of t.
def f(t) integral [0, 1] [x < t] d(x)
def curried(a)(b) a*b
record Pair(c: Real, d: Real)
def product(p: Pair, xs: [n] Real) p.c*xs[0]
def under(shader: (Real) -> Real, c) shader(c)
half = 0.5
def broken(t) integral [0, 1] (x < t ? 1 : 0) d(x)
"""
USER = """
from concurrent.futures import ThreadPoolExecutor
import numpy as np
import potto
from potto import Estimate, Function, Module, PottoError

m: Module = potto.compile("def f(t) integral [0, 1] [x < t] d(x)")
f: Function = m.f
r: Estimate = m.f(0.3)
total: float = float(r + 1) + float(r) + float(sum([r, r]))
close: bool = bool(r < 1)
value, slope = potto.value_and_grad(f)(np.linspace(0, 1, 3))
g = potto.grad(f, wrt=["t"])(0.3)
print(g["t"], g.tangent_error, slope.value, f"{r:.3f}", round(r, 2), abs(r), -r, 2 * r, r**2, len(value), value[0])
print(potto.grad(potto.grad(f))(0.3).tangent, potto.jacobian(f)(0.3), potto.hessian(f)(0.3).error)
print(potto.hvp(f, {"t": 1.0})(0.3), potto.jvp(f, {"t": 1.0})(0.3), potto.vjp(f, 1.0)(0.3), potto.deriv(f)((0.3, 1)))
print(np.asarray(r), np.sin(np.asarray(r)), [float(x) for x in value], r.summary(), f.type, f.surfaces)
with ThreadPoolExecutor(1) as pool, potto.settings(method="mc", samples=100, seed=1, executor=pool):
    try:
        m.f("a")
    except PottoError as error:
        print(error.diagnostics[0].code, error)
"""
WITH_STUB = """
from typing import TYPE_CHECKING, cast
import potto
if TYPE_CHECKING:
    from areas import Areas
m = cast("Areas", potto.load("areas.po"))
r: potto.Estimate = m.f(0.3)
again: potto.Estimate = m.f(t=[0.1, 0.2])
product: potto.Estimate = m.product({"c": 1, "d": 2}, [1, 2])
half: potto.Estimate = m.half
rest: potto.Function = m.curried(2)
both: potto.Estimate = m.curried(2, 3)
slope = potto.grad(m.f)(0.3)
under = m.under(m.f, 0.3)
"""


def mypy(folder: Path, text: str) -> str:
    (folder / "user.py").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--strict", "user.py"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


def stub(folder: Path) -> None:
    (folder / "areas.po").write_text(PROGRAM, encoding="utf-8")
    done = subprocess.run([sys.executable, "-m", "potto", "stubs", "areas.po", "-o", "areas.pyi"], cwd=folder,
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 1 and "P0301" in done.stderr, done.stderr  # what is broken is told, the rest written


@pytest.mark.slow
def test_strict_code_that_uses_potto(tmp_path: Path) -> None:
    assert mypy(tmp_path, USER) == "Success: no issues found in 1 source file\n"
    done = subprocess.run([sys.executable, "user.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "P0523" in done.stdout, done.stderr


@pytest.mark.slow
def test_stubs_say_what_programs_define(tmp_path: Path) -> None:
    stub(tmp_path)
    assert mypy(tmp_path, WITH_STUB) == "Success: no issues found in 1 source file\n"
    said = mypy(tmp_path, WITH_STUB + "m.f()\nm.f(s=1)\nm.curried(1).value\n")
    assert 'Missing positional argument "t"' in said and 'Unexpected keyword argument "s"' in said
    assert '"Function" has no attribute "value"' in said and "Found 3 errors" in said


def test_stubs_have_the_comments_of_the_program(tmp_path: Path) -> None:
    stub(tmp_path)
    text = (tmp_path / "areas.pyi").read_text(encoding="utf-8")
    assert "The length of [0, 1] left of t." in text and '"""Areas."""' in text and "broken" not in text
    compile(text, "areas.pyi", "exec")
