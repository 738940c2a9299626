"""`:fit`: the parameters that make a value least, found along its derivatives.

A quasi-Newton method (BFGS) with a search along each direction. The functions are small and their derivatives exact,
boundary terms included, so a few lines of it go a long way.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from potto.api import Function, grad
from potto.runtime.printing import format_number
from potto.settings import settings
from potto_repl.expressions import checked, split_items
from potto_repl.registry import command
from potto_repl.reply import Part, Refusal
from potto_repl.session import Conversation, plain_names
from potto_repl.values import seconds

MOST_STEPS = 200
GRADIENT = 1e-8
FIRST = 0.25  # of the size of the parameters: how far the first step goes at most, before the curvature is known
PATIENCE = 0.5  # seconds before progress is shown

Vector = list[float]
Objective = Callable[[Vector], tuple[float, Vector]]


@dataclass(slots=True)
class Fit:
    """How far a minimization has come."""

    x: Vector
    value: float
    gradient: Vector
    steps: int = 0
    evaluations: int = 0

    @property
    def slope(self) -> float:
        return max(map(abs, self.gradient))


@command("fit", "f", argument="f t=0.5, … [with g=…]", completes="expression")
def fit(session: Conversation, text: str) -> Iterator[Part]:
    """Make a value as small as possible: `:fit loss t=0.5, c=1` starts there and follows the derivatives.

    Parameters after `with` keep what they are given: `:fit loss c=-0.5 with shader=lin_shader`.
    """
    name, start, fixed = _read(plain_names(text))
    asked = checked(session, name, ":fit loss t=0.5")
    function = Function(session.world, session.file, asked.expr, asked.type)
    given = {n: _fixed(session, value) for n, value in fixed.items()}
    begun = time.perf_counter()
    names = list(start)
    values = [float(session.evaluate(value, session.settings).estimate.value) for value in start.values()]
    gradient = grad(function, names)

    def objective(x: Vector) -> tuple[float, Vector]:
        found = gradient(**dict(zip(names, x, strict=True)), **given)
        tangent = found.tangent if len(names) > 1 else (found.tangent,)
        return float(found.value), [float(t) for t in tangent]

    state = None
    with settings(method=session.settings.method, rtol=session.settings.rtol):
        for state in minimized(objective, values):
            if session.progress is not None and time.perf_counter() - begun > PATIENCE:
                session.progress(f"step {state.steps}, value {state.value:.6g}, slope {state.slope:.1e}")
    assert state is not None
    error = max(state.slope * 1e-3, 1e-12)
    best = [f"{n} = {format_number(v, max(error, 1e-9 * abs(v)))}" for n, v in zip(names, state.x, strict=True)]
    done = state.slope <= GRADIENT * max(1.0, abs(state.value))
    said = [f"{name} = {state.value:.10g} at {', '.join(best)}"]
    said.append(f"  slope {state.slope:.1e}{'' if done else ': no step from here makes it smaller'}")
    data = {"fit": name, "value": state.value, "parameters": dict(zip(names, state.x, strict=True)),
            "slope": state.slope, "steps": state.steps, "converged": done}  # fmt: skip
    yield Part("answer", "\n".join(said), data)
    yield Part("tail", f"{state.steps} steps, {state.evaluations} evaluations, {seconds(time.perf_counter() - begun)}")


def _read(text: str) -> tuple[str, dict[str, str], dict[str, str]]:
    """The function, where to start, and what stays fixed."""
    what, _, fixed = text.partition(" with ")
    found = re.match(r"(.*?)\s+([^\W\d]\w*\s*=[^=].*)$", what.strip(), re.DOTALL)
    if found is None:
        raise Refusal("a function and where to start are needed", "write `:fit loss t=0.5`")
    return found[1], _assignments(found[2]), _assignments(fixed) if fixed else {}


def _assignments(text: str) -> dict[str, str]:
    spaced = re.sub(r"(?<=[\w)])\s+(?=[^\W\d]\w*\s*=[^=])", ", ", text)
    pairs = [item.partition("=") for item in split_items(spaced)]
    if not all(name.strip().isidentifier() and value.strip() for name, _, value in pairs):
        raise Refusal(f"`{text.strip()}` does not say which parameter is what", "write `t=0.5, c=1`")
    return {name.strip(): value.strip() for name, _, value in pairs}


def _fixed(session: Conversation, text: str) -> object:
    asked = checked(session, text, ":fit loss t=0.5 with g=sin")
    if asked.groups:
        return Function(session.world, session.file, asked.expr, asked.type)
    return session.evaluate(asked.text, session.settings).estimate.value


# Minimizing


def minimized(objective: Objective, start: Vector) -> Iterator[Fit]:
    """Step by step towards a minimum. The last state is the best."""
    value, slope = objective(start)
    state = Fit(list(start), value, slope, evaluations=1)
    size = len(start)
    inverse = [[float(i == j) for j in range(size)] for i in range(size)]
    yield state
    while state.steps < MOST_STEPS and state.slope > GRADIENT * max(1.0, abs(state.value)):
        direction = [-dot(row, state.gradient) for row in inverse]
        if dot(direction, state.gradient) >= 0:
            inverse = [[float(i == j) for j in range(size)] for i in range(size)]
            direction = [-g for g in state.gradient]
        before, old = state.x, state.gradient
        if not _advance(objective, state, direction):
            return
        state.steps += 1
        moved = [a - b for a, b in zip(state.x, before, strict=True)]
        bent = [a - b for a, b in zip(state.gradient, old, strict=True)]
        inverse = _updated(inverse, moved, bent)
        yield state


def _advance(objective: Objective, state: Fit, direction: Vector) -> bool:
    """Go along a direction until the value has fallen enough (Armijo); False if it never does."""
    slope = dot(direction, state.gradient)
    size = max(map(abs, state.x))
    reach = FIRST * max(size, 0.1) if state.steps == 0 else max(size, 1.0)
    step = min(1.0, reach / max(map(abs, direction)))
    for _ in range(40):
        x = [a + step * d for a, d in zip(state.x, direction, strict=True)]
        value, gradient = objective(x)
        state.evaluations += 1
        if value == value and value <= state.value + 1e-4 * step * slope:
            state.x, state.value, state.gradient = x, value, gradient
            return True
        step *= 0.5
    return False


def _updated(inverse: list[Vector], moved: Vector, bent: Vector) -> list[Vector]:
    """The inverse of the curvature after one more step (BFGS)."""
    product = dot(moved, bent)
    if product <= 1e-14:
        return inverse
    turned = [dot(row, bent) for row in inverse]
    factor = (1 + dot(bent, turned) / product) / product
    size = range(len(moved))
    return [
        [inverse[i][j] + factor * moved[i] * moved[j] - (turned[i] * moved[j] + moved[i] * turned[j]) / product
         for j in size] for i in size
    ]  # fmt: skip


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
