"""Teg and the paper's prototype at what their pages have, where they are: each in a process of its own.

Owns `asked`. Neither is on a package index: PyPI's `teg` is about reinforcement learning, and the prototype is called
`potto`, too. Clones of github.com/ChezJrk/Teg and github.com/divicomp/potto are asked by their folders.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

# The example of each page, the derivative of a step's integral: compiled, then evaluated. Nodes are what is reachable.
SCRIPTS = {
    "teg": """
import json, time
from teg import IfElse, Teg, TegVar, Var
from teg.derivs import FwdDeriv
from teg.eval.numpy_eval import evaluate
x, t = TegVar("x"), Var("t", 0.5)
start = time.process_time()
made = FwdDeriv(Teg(0, 1, IfElse(x < t, 1, 0), x), [(t, 1)])
middle = time.process_time()
slope = float(evaluate(made))
print(json.dumps({"compile": middle - start, "evaluate": time.process_time() - middle, "slope": slope}))
""",
    "prototype": """
import json, time
from potto import BoundedLebesgue, Const, FlipShift, IfElse, Int, TegVar, Var, VarVal, deriv, evaluate
x, t, dt = TegVar("x"), Var("t"), Var("dt")
start = time.process_time()
made = deriv(Int(IfElse(FlipShift((t,), (x,)), Const(1), Const(0)), BoundedLebesgue(0, 1, x)), {t.name: dt.name})
middle = time.process_time()
slope = float(evaluate(made, VarVal({t.name: 0.5, dt.name: 1})))
print(json.dumps({"compile": middle - start, "evaluate": time.process_time() - middle, "slope": slope}))
""",
}


def asked(peer: str, folder: Path | None) -> dict[str, Any]:
    """Seconds of compiling and of evaluating, and the slope, which is 1; or why there are none, as `missing`."""
    if folder is None:
        return {"missing": "not asked: on no package index, give a clone by its folder"}
    environment = {**os.environ, "PYTHONPATH": str(folder.resolve())}
    done = subprocess.run([sys.executable, "-c", SCRIPTS[peer]], env=environment, capture_output=True, text=True,
                          cwd=folder, timeout=600)  # fmt: skip
    if done.returncode:
        return {"missing": (done.stderr.strip().splitlines() or ["it gave no reason"])[-1]}
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found
