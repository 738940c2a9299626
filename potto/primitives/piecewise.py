"""Builtins with kinks (abs, min, max, clamp), whose derivatives choose a side, and those that jump (sign, floor, ceil).

A derivative chooses by a `Branch` on the kink itself, so that whoever cuts an integral along surfaces sees one
surface where the builtin bends and where its derivative jumps.
"""

from __future__ import annotations

import math
from itertools import combinations

from potto.core.terms import ONE, ZERO, Term, add, branch, const, div, mul, neg, prim, sub
from potto.primitives.bounds import ends, extreme
from potto.primitives.registry import Elementwise, Ends, Primitive, Quantity, Terms, register
from potto.primitives.sizes import of_one_of, of_same_size


def _absolute_roots(y: Term) -> Terms:
    nowhere = const(math.nan)
    return branch((y,), False, y, nowhere), branch((y,), False, neg(y), nowhere)


def _choose(op: str, args: Terms) -> Terms:
    """The partials of min or max, folded from the left: of what is best so far, and of the next argument."""
    best = args[0]
    chosen: list[Term] = [ONE, *(ZERO,) * (len(args) - 1)]
    for i in range(1, len(args)):
        margin = sub(best, args[i]) if op == "max" else sub(args[i], best)
        for j in range(i):
            chosen[j] = branch((margin,), False, chosen[j], ZERO)
        chosen[i] = branch((margin,), False, ZERO, ONE)
        best = prim(op, best, args[i])
    return tuple(chosen)


def _differences(*args: Term) -> Terms:
    return tuple(sub(a, b) for a, b in combinations(args, 2))


def _joined(op: str, args: Terms) -> Term:
    return args[0] if len(args) == 1 else prim(op, *args)


def _greatest(*args: Term) -> tuple[Term, Term, Term]:
    other = _joined("max", args[1:])
    return sub(args[0], other), args[0], other


def _least(*args: Term) -> tuple[Term, Term, Term]:
    other = _joined("min", args[1:])
    return sub(other, args[0]), args[0], other


def _clamped(x: Term, lo: Term, hi: Term) -> tuple[Term, Term, Term]:
    inner = prim("max", x, lo)
    return sub(hi, inner), inner, hi


def _clamp_partials(x: Term, lo: Term, hi: Term) -> Terms:
    """clamp is min(max(x, lo), hi), also where lo > hi. At lo it moves with x, at hi no more, so that of clamps that
    follow upon each other only one moves where they meet."""

    def choose(of_x: Term, of_lo: Term, of_hi: Term) -> Term:
        def below(limit: Term, inside: Term) -> Term:
            return inside if inside is of_hi else branch((limit,), True, inside, of_hi)

        return branch((sub(x, lo),), False, below(sub(hi, x), of_x), below(sub(hi, lo), of_lo))

    return choose(ONE, ZERO, ZERO), choose(ZERO, ONE, ZERO), choose(ZERO, ZERO, ONE)


absolute = register(
    Primitive(
        "abs",
        arity=1,
        numpy="abs",
        mpmath="builtins.abs",
        scalar="math.fabs",
        ulp=0.0,
        topic="With kinks",
        cases=lambda x: (x, x, neg(x)),
        extremes=lambda x: prim("max", x, neg(x)),
        turns=(0.0,),
        image=(0.0, math.inf),
        roots=(0.0,),
        parity=1,
        doc="The absolute value.",
        magnitude=of_same_size,
        partials=lambda x: (branch((x,), False, ONE, neg(ONE)),),
        domain=((-1e6, 1e6),),
        kinks=lambda x: (x,),
        inverse=_absolute_roots,
        example="abs(-2)",
    )
)

minimum = register(
    Primitive(
        "min",
        arity=None,
        numpy="minimum",
        mpmath="potto.minimum",
        scalar="builtins.min",
        ulp=0.0,
        topic="With kinks",
        cases=_least,
        interval=extreme(least=True),
        doc="The least of two or more numbers.",
        magnitude=of_one_of,
        partials=lambda *args: _choose("min", args),
        domain=((-1e6, 1e6),),
        kinks=_differences,
        example="min(3, 1, 2)",
    )
)

maximum = register(
    Primitive(
        "max",
        arity=None,
        numpy="maximum",
        mpmath="potto.maximum",
        scalar="builtins.max",
        ulp=0.0,
        topic="With kinks",
        cases=_greatest,
        interval=extreme(least=False),
        doc="The greatest of two or more numbers.",
        magnitude=of_one_of,
        partials=lambda *args: _choose("max", args),
        domain=((-1e6, 1e6),),
        kinks=_differences,
        example="max(3, 1, 2)",
    )
)


def _tent_slope(x: Term) -> Terms:
    """The slope to the right: of tents that overlap one falls from where another rises."""
    falling = branch((sub(x, ONE),), False, ZERO, neg(ONE))
    return (branch((x,), False, falling, branch((add(x, ONE),), False, ONE, ZERO)),)


tent = register(
    Primitive(
        "tent",
        arity=1,
        surface=False,
        formula=lambda x: prim("max", ZERO, sub(ONE, prim("abs", x))),
        cases=lambda x: (x, prim("max", ZERO, sub(ONE, x)), prim("max", ZERO, add(x, ONE))),
        extremes=lambda x: prim("max", ZERO, prim("min", sub(ONE, x), add(x, ONE))),
        doc="1 - |x| where that is positive, else 0: how near a place is to one of a lattice.",
        turns=(0.0,),
        image=(0.0, 1.0),
        parity=1,
        partials=_tent_slope,
        kinks=lambda x: (add(x, ONE), x, sub(ONE, x)),
        domain=((-3.0, 3.0),),
        example="image([[0, 1]], 0.5, 0.5)",
    )
)

clamp = register(
    Primitive(
        "clamp",
        arity=3,
        numpy="potto.clamp",
        mpmath="potto.clamp",
        formula=lambda x, lo, hi: prim("min", prim("max", x, lo), hi),
        ulp=0.0,
        topic="With kinks",
        cases=_clamped,
        extremes=lambda x, lo, hi: prim("min", prim("max", x, lo), hi),
        doc="x, but at least lo and at most hi: clamp(x, lo, hi) is min(max(x, lo), hi).",
        partials=_clamp_partials,
        domain=((-1e3, 1e3), (-1e3, 1e3), (-1e3, 1e3)),
        kinks=lambda x, lo, hi: (sub(x, lo), sub(hi, x), sub(hi, lo)),
        example="clamp(1.5, 0, 1)",
    )
)


def _between_partials(x: Term, a: Term, b: Term) -> Terms:
    """As clamp has them: at a it moves, at b no more."""
    way = sub(b, a)

    def inside(slope: Term) -> Term:
        return branch((sub(x, a),), False, branch((sub(b, x),), True, slope, ZERO), ZERO)

    return inside(div(ONE, way)), inside(div(sub(x, b), mul(way, way))), inside(div(sub(a, x), mul(way, way)))


def _between_ends(ops: Elementwise, x: Ends, a: Ends, b: Ends) -> Ends:
    """It rises with x and falls with a and b, where a is before b."""

    def part(x: Quantity, a: Quantity, b: Quantity) -> Quantity:
        return ops.most(ops.least((x - a) / (b - a), 1.0), 0.0)

    apart = a[1] < b[0]
    return ops.where(apart, part(x[0], a[1], b[1]), 0.0), ops.where(apart, part(x[1], a[0], b[0]), 1.0)


between = register(
    Primitive(
        "between",
        arity=3,
        surface=False,
        formula=lambda x, a, b: div(prim("clamp", sub(x, a), ZERO, sub(b, a)), sub(b, a)),
        cases=lambda x, a, b: (sub(x, a), prim("min", div(sub(x, a), sub(b, a)), ONE), ZERO),
        doc="How much of the way from a to b is done at x: 0 before a, 1 from b on.",
        partials=_between_partials,
        interval=_between_ends,
        kinks=lambda x, a, b: (sub(x, a), sub(b, x)),
        domain=((-1e3, 1e3), (-1e3, -1e-3), (1e-3, 1e3)),
        example="interp([0, 2], [0, 1], 0.5)",
    )
)

sign = register(
    Primitive(
        "sign",
        arity=1,
        numpy="sign",
        mpmath="sign",
        scalar="potto.sign",
        topic="With jumps",
        image=(-1.0, 1.0),
        roots=(0.0,),
        parity=-1,
        interval=ends("sign"),
        doc="-1, 0 or 1. It jumps, so it takes plain values only; under an integral use `[x > 0]`.",
        plain=True,
        brackets="`2*[x > 0] - 1`",
        steps=lambda x: (x,),
        domain=((-1e6, 1e6),),
        example="sign(-2.5)",
    )
)

floor = register(
    Primitive(
        "floor",
        arity=1,
        numpy="floor",
        mpmath="floor",
        scalar="math.floor",
        topic="With jumps",
        interval=ends("floor"),
        doc="The greatest whole number that is not above x. It jumps, so it takes plain values only.",
        plain=True,
        brackets="`sum k in 1..n ([x >= k])`, for x from 0 to n",
        steps=lambda x: (sub(x, prim("floor", x)),),
        domain=((-1e6, 1e6),),
        example="floor(2.7)",
    )
)

ceil = register(
    Primitive(
        "ceil",
        arity=1,
        numpy="ceil",
        mpmath="ceil",
        scalar="math.ceil",
        topic="With jumps",
        interval=ends("ceil"),
        doc="The least whole number that is not below x. It jumps, so it takes plain values only.",
        plain=True,
        brackets="`sum k in 0..n ([x > k])`, for x from 0 to n",
        steps=lambda x: (sub(prim("ceil", x), x),),
        domain=((-1e6, 1e6),),
        example="ceil(2.2)",
    )
)
