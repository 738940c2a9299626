"""Double-precision values of terms made of builtins, by the functions that the registry names."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from potto.core.terms import Branch, Const, If, Term, Var, postorder
from potto.kernels.support import function
from potto.primitives import PRIMITIVES

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
    """A builtin by its numpy name; those of any number of arguments folded from the left."""
    entry = PRIMITIVES[op]
    f = function(entry.numpy)
    with np.errstate(all="ignore"):
        if entry.arity is None:
            result = args[0]
            for arg in args[1:]:
                result = f(result, arg)
            return float(result)
        return f(*(np.float64(a) for a in args))
