"""How large a term is at most, by its logarithm: also where parts of it are beyond what doubles hold.

Owns `log_magnitude`. exp(-x^2/2)*exp(10*x) is next to nothing at 100, though an enclosure has 0 times infinity there;
exp(-x)*exp(x) is 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from potto.core.terms import Const, Prim, Term, children, postorder, prim
from potto.integrate.rules.intervals import Interval, enclosure
from potto.primitives import PRIMITIVES


def log_magnitude(term: Term, box: Mapping[str, Interval]) -> Any:
    """A bound of log(abs(term)) over a box; infinite where none is known."""
    found: dict[Term, Any] = {}
    with np.errstate(all="ignore"):
        for node in postorder(term, below=_parts):
            own = _of(node, found, box)
            found[node] = np.where(np.isnan(own), np.inf, own)
    return found[term]


def _parts(node: Term) -> Sequence[Term]:
    return children(node) if isinstance(node, Prim) and node.op in _KNOWN else ()


def _of(node: Term, found: Mapping[Term, Any], box: Mapping[str, Interval]) -> Any:
    if isinstance(node, Prim) and node.op in _KNOWN:
        below = [found[arg] for arg in node.args]
        match node.op:
            case "exp":
                return enclosure(node.args, box)[0][1]
            case "add":
                return np.max(np.broadcast_arrays(*below), axis=0) + np.log(len(below))
            case "neg" | "abs":
                return below[0]
            case "sqrt":
                return 0.5 * below[0]
            case "mul":
                nothing = np.any(np.broadcast_arrays(*(part == -np.inf for part in below)), axis=0)
                return np.where(nothing, -np.inf, sum(below[1:], below[0]))
            case "gamma":
                return enclosure((prim("lgamma", *node.args),), box)[0][1]
            case "log" | "log1p":
                least, _ = enclosure((node,), box)[0]
                return np.log(np.maximum(np.abs(np.where(np.isnan(least), below[0], least)), np.abs(below[0]) + 1.0))
            case _:
                exponent = node.args[1]
                if isinstance(exponent, Const) and exponent.value > 0:
                    return exponent.value * below[0]
    least, most = enclosure((node,), box)[0]
    if isinstance(node, Prim) and (exponents := PRIMITIVES[node.op].exponents(*node.args)) and np.any(np.isnan(least)):
        return np.max(np.broadcast_arrays(*map(np.abs, enclosure(exponents, box)[0])), axis=0)
    return np.log(np.maximum(np.abs(least), np.abs(most)))


_KNOWN = frozenset(("exp", "add", "neg", "abs", "sqrt", "mul", "log", "log1p", "pow", "gamma"))
