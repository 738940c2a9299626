"""Values of terms at sample points, to 50 digits.

Owns `zero_at_all`, which tests on points whether a term is 0 everywhere. What is not a builtin and no choice
(integrals, calls, ...) counts as an unknown with a value of its own, so that a term which vanishes for all its values
is found.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from mpmath import mp

from potto.core.reference.functions import function
from potto.core.terms import Branch, Const, If, Prim, Term, Var, postorder

_DIGITS = 50
_POINTS = 5  # where the term is defined
_TRIES = 24
_SMALL = mp.mpf(10) ** -35  # relative to the largest part: cancellation at 50 digits leaves far less

Number = tuple[Any, Any]  # a value, or a truth value, and the size of the largest part that went into it


def zero_at_all(term: Term) -> bool:
    """Whether a term is 0 at every sample point at which it has a value; False if it has one at too few."""
    order = postorder(term)
    seen = 0
    with mp.workdps(_DIGITS):
        for attempt in range(_TRIES):
            memo: dict[Term, Number] = {}
            for node in order:
                memo[node] = _node(node, memo, attempt)
            value, size = memo[term]
            if not mp.isfinite(value):
                continue
            if abs(value) > _SMALL * max(size, abs(value)):
                return False
            seen += 1
            if seen == _POINTS:
                return True
    return False


def _node(node: Term, memo: Mapping[Term, Number], attempt: int) -> Number:
    match node:
        case Const(name=name, value=value):
            return _exact(+mp.pi if name == "pi" else mp.mpf(value))
        case Branch():
            side = memo[node.surface][0]
            taken = node.then if (side > 0 if node.strict else side >= 0) else node.orelse
            return _exact(mp.nan) if mp.isnan(side) else memo[taken]
        case If():
            holds = memo[node.condition][0]
            return _exact(mp.nan) if mp.isnan(holds) else memo[node.then if holds else node.orelse]
        case Prim():
            return _builtin(node, [memo[arg] for arg in node.args])
        case _:
            return _exact(_sample(node.name.encode() if isinstance(node, Var) else node.digest, attempt))


def _builtin(node: Prim, args: list[Number]) -> Number:
    if any(mp.isnan(value) for value, _ in args):
        return _exact(mp.nan)
    try:
        value = function(node.op)(*(value for value, _ in args))
    except ArithmeticError:
        return _exact(mp.nan)
    match node.op:
        case "add":
            return value, max(size for _, size in args)
        case "mul":
            return value, mp.fprod(size for _, size in args)
        case "div" if args[1][0]:
            return value, args[0][1] / abs(args[1][0])
        case "neg":
            return value, args[0][1]
        case _:
            return _exact(value)


def _exact(value: Any) -> Number:
    return value, abs(value)


def _sample(key: bytes, attempt: int) -> Any:
    """A number that looks random but is the same each time; near 1, of either sign on half of the attempts."""
    digest = hashlib.blake2b(key + b"%d" % attempt, digest_size=16).digest()
    size = mp.mpf(int.from_bytes(digest[1:], "big")) / (1 << 120) + mp.mpf("0.1")
    return -size if attempt % 2 and digest[0] % 2 else size
