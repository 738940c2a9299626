"""The rules by which `simplify` shortens a term, applied bottom-up.

Owns `Rewriter`. A rule looks at one node whose parts are already short, and gives the node back when it has nothing
to merge. Sums and products have their own file, `collecting`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from potto.core.collecting import product_of, sum_of
from potto.core.terms import (
    ZERO,
    Array,
    Branch,
    Const,
    Fold,
    If,
    Index,
    Integral,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    bound_names,
    branch,
    children,
    const,
    if_,
    neg,
    postorder,
    prim,
    proj,
    rebuild,
    substitute,
    transform,
    unknown,
)
from potto.primitives import EXACT, PRIMITIVES, UNDOES

Surface = Callable[[Term], tuple[Term, int]]
_NONE: frozenset[Term] = frozenset()
_MANY = 32  # surfaces in one term: looking for one that is decided further out no longer pays


class Rewriter:
    """One pass over a term. `surface` gives the canonical form and the side of a condition's surface."""

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        self.memo: dict[Term, Term] = {}
        self.surfaces: dict[Term, frozenset[Term]] = {}

    def run(self, term: Term) -> Term:
        return transform(term, lambda _, new: self.node(new), made=self.memo)

    def node(self, node: Term) -> Term:
        match node:
            case Prim():
                return _builtin(node)
            case If():
                return _if(node)
            case Branch():
                return self.branch(node)
            case Proj():
                return _component(node.term, node.index)
            case Integral() if node.body is ZERO or any(
                lo is hi and not math.isinf(_value(lo)) for lo, hi in node.bounds
            ):
                return node if isinstance(node.body, Tuple) else ZERO
            case Sum() if node.body is ZERO:
                return ZERO
            case Fold():
                return _fold(node)
            case Index():
                return self.element(node)
            case _:
                return node

    def element(self, node: Index) -> Term:
        """The element at a known place of an array that is made on the spot. What is out of range stays, to be said."""
        whole, place = node.array, _value(node.index)
        if not isinstance(whole, Array) or not (place >= 0 and place.is_integer() and place < _value(whole.size)):
            return node
        return self.run(substitute(whole.body, {whole.variable: node.index}))

    # Conditions that are decided further out

    def branch(self, node: Branch) -> Term:
        side = _value(node.surface)
        if side == side:
            return node.then if (side > 0 if node.strict else side >= 0) else node.orelse
        canonical, sign = self.surface(node.surface)
        then = self.assume(node.then, canonical, sign, node.strict, True)
        orelse = self.assume(node.orelse, canonical, sign, node.strict, False)
        if then is orelse:
            return then
        return branch(node.coordinates, node.strict, then, orelse)

    def found(self, term: Term) -> frozenset[Term]:
        """The canonical surfaces of the branches in a term; none where there are too many."""
        for node in unknown(term, self.surfaces):
            own = (self.surface(node.surface)[0],) if isinstance(node, Branch) else ()
            below = frozenset().union(own, *(self.surfaces[c] for c in children(node)))
            self.surfaces[node] = below if len(below) <= _MANY else _NONE
        return self.surfaces[term]

    def assume(self, arm: Term, canonical: Term, sign: int, strict: bool, holds: bool) -> Term:
        """An arm of a branch, with the branches on the same surface in it decided."""
        if not arm.free & canonical.free or canonical not in self.found(arm):
            return arm

        def below(node: Term) -> Sequence[Term]:
            hidden = canonical not in self.found(node) or not canonical.free.isdisjoint(bound_names(node))
            return () if hidden else children(node)

        def change(node: Term, new: Term) -> Term:
            if not (isinstance(node, Branch) and isinstance(new, Branch)):
                return new
            inner, inner_sign = self.surface(node.surface)
            taken = _decided(strict, holds, node.strict, sign == inner_sign) if inner is canonical else None
            return new if taken is None else new.then if taken else new.orelse

        return transform(arm, change, below)


def _decided(strict: bool, holds: bool, inner_strict: bool, same_side: bool) -> bool | None:
    """Whether `inner` holds given that the outer condition does or not; None where the two differ on the surface."""
    if same_side:
        if strict == inner_strict:
            return holds
        # s > 0 implies s >= 0, and not s >= 0 implies not s > 0.
        return holds if holds == strict else None
    if strict != inner_strict:
        return not holds  # s > 0 is the opposite of -s >= 0
    return not holds if holds == strict else None


def _value(term: Term) -> float:
    """The number that a term is, else nan."""
    if isinstance(term, Prim) and term.op == "neg":
        return -_value(term.args[0])
    return term.value if isinstance(term, Const) else math.nan


def _if(node: If) -> Term:
    condition, then, orelse = node.condition, node.then, node.orelse
    truth = _truth(condition)
    if truth is not None:
        return then if truth else orelse
    while isinstance(condition, Prim) and condition.op == "not":
        condition, then, orelse = condition.args[0], orelse, then
    if isinstance(then, If) and then.condition is condition:
        then = then.then
    if isinstance(orelse, If) and orelse.condition is condition:
        orelse = orelse.orelse
    return if_(condition, then, orelse)


def _truth(condition: Term) -> bool | None:
    """Whether a condition holds, if it is between numbers. Its parts are short, or were decided where they stand."""
    if not isinstance(condition, Prim):
        return None
    match condition.op, condition.args:
        case "not", (inner,):
            known = _truth(inner)
            return None if known is None else not known
        case "lt" | "le" | "eq" | "ne", (a, b):
            x, y = _value(a), _value(b)
            if x != x or y != y:
                return None
            return {"lt": x < y, "le": x <= y, "eq": x == y, "ne": x != y}[condition.op]
        case _:
            return None


def _logic(node: Prim) -> Term:
    """and, or with a part that is decided: the other part, or the part that decides."""
    decides = node.op == "or"
    open_parts = []
    for part in node.args:
        known = _truth(part)
        if known is decides:
            return part
        if known is None:
            open_parts.append(part)
    if not open_parts:
        return node.args[0]
    return open_parts[0] if len(open_parts) == 1 or open_parts[0] is open_parts[1] else node


def _component(term: Term, index: int) -> Term:
    """A component of a tuple, taken inside of what chooses, integrates or adds up tuples."""
    memo: dict[Term, Term] = {}
    for node in postorder(term, below=_spine):
        own = _spine(node)
        kept = children(node)[: -len(own)] if own else ()
        new = rebuild(node, (*kept, *(memo[part] for part in own))) if own else proj(node, index)
        memo[node] = new.then if isinstance(new, Branch) and new.then is new.orelse else new
    return memo[term]


def _spine(node: Term) -> tuple[Term, ...]:
    match node:
        case Branch() | If():
            return node.then, node.orelse
        case Integral() | Sum():
            return (node.body,)
        case _:
            return ()


def _fold(node: Fold) -> Term:
    """A fold with no steps, or none that changes the state. Steps are never written out."""
    idle = isinstance(node.body, Var) and node.body.name == node.state
    return node.start if idle or _value(node.lo) > _value(node.hi) else node


# Builtins


def _builtin(node: Prim) -> Term:
    match node.op:
        case "add":
            return sum_of(node)
        case "mul" | "div" | "pow":
            return product_of(node)
        case "and" | "or":
            return _logic(node)
        case "not" if isinstance(node.args[0], Prim) and node.args[0].op == "not":
            return node.args[0].args[0]
        case _:
            return _function(node)


def _function(node: Prim) -> Term:
    folded = _folded(node)
    if folded is not None:
        return folded
    if len(node.args) == 1:
        (inner,) = node.args
        if isinstance(inner, Prim):
            parity = PRIMITIVES[node.op].parity
            if UNDOES.get(node.op) == inner.op:
                return inner.args[0]
            if inner.op == "neg" and parity < 0:
                return neg(prim(node.op, inner.args[0]))
            if (inner.op == "neg" and parity > 0) or (node.op == inner.op == "abs"):
                return prim(node.op, inner.args[0])
    if node.op in ("min", "max") and all(arg is node.args[0] for arg in node.args):
        return node.args[0]
    return node


def _folded(node: Prim) -> Term | None:
    """The value of a builtin of numbers, where it is exact."""
    values = [_value(arg) for arg in node.args]
    if any(v != v or math.isinf(v) for v in values) or any(isinstance(a, Const) and a.name for a in node.args):
        return None
    if len(values) == 1 and (node.op, values[0]) in EXACT:
        return const(EXACT[node.op, values[0]])
    match node.op:
        case "abs":
            return const(abs(values[0]))
        case "sqrt" if values[0] >= 0 and values[0].is_integer() and values[0] < 2.0**53:
            root = math.isqrt(int(values[0]))
            return const(root) if root * root == values[0] else None
        case "min":
            return const(min(values))
        case "max":
            return const(max(values))
        case "clamp":
            return const(min(max(values[0], values[1]), values[2]))
        case "floor":
            return const(math.floor(values[0]))
        case "ceil":
            return const(math.ceil(values[0]))
        case "sign":
            return const((values[0] > 0) - (values[0] < 0))
        case _:
            return None
