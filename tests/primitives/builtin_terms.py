"""Double-precision values of terms made of builtins, by their numeric forms."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from potto.core.terms import Branch, Const, If, Term, Var, postorder
from potto.kernels.support import ARRAYS
from potto.primitives.registry import Primitive

EPS = 2.0**-52


def double(term: Term, env: Mapping[str, float]) -> float:
    """A plain walk in doubles; what is not taken is evaluated too, but selected away."""
    memo: dict[Term, float] = {}
    with np.errstate(all="ignore"):
        for node in postorder(term):
            match node:
                case Const(value=value):
                    memo[node] = value
                case Var(name=name):
                    memo[node] = env[name]
                case If():
                    memo[node] = memo[node.then if memo[node.condition] else node.orelse]
                case Branch():
                    side = memo[node.surface]
                    memo[node] = memo[node.then if (side > 0 if node.strict else side >= 0) else node.orelse]
                case _:
                    memo[node] = builtin(node.op, *(memo[a] for a in node.args))
    return float(memo[term])


def builtin(op: str, *args: float) -> float:
    """The numeric form of a builtin."""
    with np.errstate(all="ignore"):
        return float(ARRAYS.function(op)(*(np.float64(a) for a in args)))


def nearest_order(primitive: Primitive, x: float) -> float:
    """The nearest order that a builtin takes: whole ones, and halves where there are such."""
    steps = 2 if primitive.name == "hurwitz" else 1
    return round(steps * x) / steps
