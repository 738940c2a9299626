"""How large values of builtins are, by logarithms: rules that entries share, of what doubles do not hold as well.

What an argument is infinite or nothing at is so here as well: bounds of logarithms are infinite where nothing is known.
"""

from __future__ import annotations

import math
from typing import Any

from potto.primitives.registry import Elementwise, Size

Logs = tuple[Any, Any]
LOG2 = math.log(2.0)


def of_same_size(ops: Elementwise, x: Size) -> Logs:
    """Of what is as large as its argument."""
    return x.least, x.most


def of_one_of(ops: Elementwise, *args: Size) -> Logs:
    """Of what is one of its arguments."""
    least, most = args[0].least, args[0].most
    for x in args[1:]:
        least, most = ops.least(least, x.least), ops.most(most, x.most)
    return least, most


def of_root(ops: Elementwise, x: Size) -> Logs:
    return 0.5 * x.least, 0.5 * x.most


def of_exponential(ops: Elementwise, x: Size) -> Logs:
    return x.lo, x.hi


def of_growth(ops: Elementwise, x: Size) -> Logs:
    """Of exp(x) - 1."""
    return -math.inf, ops.most(x.hi, 0.0)


def of_even_growth(ops: Elementwise, x: Size) -> Logs:
    """Of cosh: half of exp(|x|), and up to as much again."""
    return ops.most(ops.most(x.lo, -x.hi), 0.0) - LOG2, ops.most(-x.lo, x.hi)


def of_odd_growth(ops: Elementwise, x: Size) -> Logs:
    """Of sinh: no more than cosh."""
    return -math.inf, ops.most(-x.lo, x.hi)


def of_bell(ops: Elementwise, x: Size) -> Logs:
    """Of erfc: at most exp(-x^2) for positive x."""
    right = ops.most(x.lo, 0.0)
    return -math.inf, LOG2 - right * right


def of_logarithm(ops: Elementwise, x: Size) -> Logs:
    return _logs_of(ops, x.least, x.most)


def of_logarithm_from_one(ops: Elementwise, x: Size) -> Logs:
    """Of log(1 + x): above 0 it is at most log 2 more than the larger of log x and 0; below, its bounds tell."""
    return -math.inf, ops.where(x.lo >= 0, ops.of("log")(ops.most(x.most, 0.0) + LOG2), math.inf)


def of_gamma(ops: Elementwise, x: Size) -> Logs:
    """The logarithm is convex."""
    log = ops.of("lgamma")
    return -math.inf, ops.where(x.lo > 0, ops.most(log(x.lo), log(x.hi)), math.inf)


def of_sum(ops: Elementwise, *args: Size) -> Logs:
    """No less than one of them where none is below 0, or none above."""
    most, least, positive, negative = args[0].most, args[0].least, args[0].lo >= 0, args[0].hi <= 0
    for x in args[1:]:
        most, least = ops.most(most, x.most), ops.most(least, x.least)
        positive, negative = positive & (x.lo >= 0), negative & (x.hi <= 0)
    return ops.where(positive | negative, least, -math.inf), most + math.log(len(args))


def of_product(ops: Elementwise, *args: Size) -> Logs:
    """What is nothing makes nothing of all else, however large."""
    least, most = args[0].least, args[0].most
    nothing = most == -math.inf
    for x in args[1:]:
        least, most, nothing = least + x.least, most + x.most, nothing | (x.most == -math.inf)
    return ops.where(least == least, least, -math.inf), ops.where(nothing, -math.inf, most)


def of_quotient(ops: Elementwise, a: Size, b: Size) -> Logs:
    return of_product(ops, a, Size(b.lo, b.hi, -b.most, -b.least))


def of_power(ops: Elementwise, base: Size, exponent: Size) -> Logs:
    ends = [e * size for e in (exponent.lo, exponent.hi) for size in (base.least, base.most)]
    ends = [ops.where(end == end, end, 0.0) for end in ends]
    return ops.least(ops.least(*ends[:2]), ops.least(*ends[2:])), ops.most(ops.most(*ends[:2]), ops.most(*ends[2:]))


def _logs_of(ops: Elementwise, lo: Any, hi: Any) -> Logs:
    """Of a number between bounds."""
    log = ops.of("log")
    return log(ops.most(ops.most(lo, -hi), 0.0)), log(ops.most(-lo, hi))
