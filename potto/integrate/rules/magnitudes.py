"""How large a term is, by its logarithm: also where parts of it are beyond what doubles hold.

Owns `log_magnitude`. exp(-x^2/2)*exp(10*x) is next to nothing at 100, though an enclosure has 0 times infinity there;
exp(-x)*exp(x) is 1. What builtins do with sizes is a rule of theirs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from potto.calculus.algebra.ranges import range_of
from potto.core.terms import Branch, Const, If, Prim, Term
from potto.integrate.rules.intervals import ANYTHING, INTERVALS, Interval, marked
from potto.kernels.support import OPS
from potto.primitives import PRIMITIVES, Primitive
from potto.primitives.registry import Size
from potto.primitives.walking import Domain, Rule

LARGEST, ROUNDED = 700.0, 1e-9  # logarithms up to which exponentials are numbers, and by how much they may be off
UNKNOWN = Size(-np.inf, np.inf, -np.inf, np.inf)
SMALLEST = 2.0**-1000  # from which on doubles have all digits: below, a bound of 0 may be one of what is not nothing


def log_magnitude(term: Term, box: Mapping[str, Interval]) -> Any:
    """A bound of log(abs(term)) over a box; infinite where none is known."""
    with np.errstate(all="ignore"):
        env = {name: _sized(ends, (-np.inf, np.inf), ANYTHING) for name, ends in box.items()}
        return SIZES.walk((term,), env, {})[0].most


def _sized(ends: Interval, logs: tuple[Any, Any], image: Interval) -> Size:
    """What bounds and logarithms say together, of what has values between others. Bounds that overflow are unknown."""
    lo, hi = (np.where(np.isnan(end), far, end) for end, far in zip(ends, image, strict=True))
    least, most = (np.where(np.isnan(log), far, log) for log, far in zip(logs, ANYTHING, strict=True))
    if image[0] >= 0:
        lo = np.maximum(lo, np.exp(np.minimum(least, LARGEST) - ROUNDED))
    farthest, nearest = np.maximum(-lo, hi), np.maximum(np.maximum(lo, -hi), 0.0)
    most = np.where(farthest >= SMALLEST, np.fmin(most, np.log(farthest)), most)
    return Size(lo, hi, np.fmax(least, np.log(nearest)), most)


class _Sizes(Domain[Size]):
    """Bounds of numbers and of their logarithms, by the rules of the entries."""

    def constant(self, node: Const) -> Size:
        log = np.log(np.abs(node.value))
        return Size(np.float64(node.value), np.float64(node.value), log, log)

    def unknown(self) -> Size:
        return UNKNOWN

    def rule(self, entry: Primitive) -> Rule[Size] | None:
        return None

    def builtin(self, node: Prim, known: Mapping[Term, Size]) -> Size:
        args = [known[arg] for arg in node.args]
        ends = INTERVALS.builtin(node, {arg: marked(x.lo, x.hi) for arg, x in zip(node.args, args, strict=True)})
        if not np.all((ends[0] >= 0) | (ends[1] <= 0)):  # 1/exp(x) is positive where exp(x) is 0 in doubles, too
            told = range_of(node)
            ends = np.fmax(ends[0], told.lo), np.fmin(ends[1], told.hi)
        rule = PRIMITIVES[node.op].magnitude
        if rule is not None:
            return _sized(ends, rule(OPS, *args), PRIMITIVES[node.op].image)
        whole = self.apply(node.op, args)
        return _sized(ends, (whole.least, whole.most), PRIMITIVES[node.op].image)

    def other(self, node: Term, known: Mapping[Term, Size]) -> Size:
        if not isinstance(node, Branch | If):
            return UNKNOWN
        a, b = known[node.then], known[node.orelse]
        return Size(*(pick(x, y) for pick, x, y in (
            (np.minimum, a.lo, b.lo), (np.maximum, a.hi, b.hi), (np.minimum, a.least, b.least),
            (np.maximum, a.most, b.most),
        )))  # fmt: skip


SIZES = _Sizes()
