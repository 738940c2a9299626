"""Whether what a surface adds is 0 on whichever sides its conditions are.

Owns `is_zero_on_all_sides`.
"""

from __future__ import annotations

from potto.calculus.algebra.rational_form import is_zero
from potto.calculus.differentiation.derivative import zero_like
from potto.calculus.surfaces.branch_assignment import unguarded
from potto.core.simplify import normalized_surface
from potto.core.terms import ONE, Branch, If, Prim, Term, Tuple, add, mul, postorder, proj, rebuild, sub, var
from potto.primitives import PRIMITIVES


def is_zero_on_all_sides(term: Term) -> bool:
    """Whether a number, or each of a tuple, is 0 wherever it exists. False also where that is not known.

    `is_zero` asks sample points, which tell of analytic functions alone: hardly one lies where 0.3 < y < 0.31. So each
    condition is an unknown number here, and so is each builtin with kinks or jumps.
    """
    zero = zero_like(term)
    if isinstance(zero, Tuple):
        return all(is_zero_on_all_sides(proj(term, i)) for i in range(len(zero.items)))
    return is_zero(_mixed(unguarded(term)))


def _mixed(term: Term) -> Term:
    """With each choice as a mean of its sides, in an unknown proportion."""
    made: dict[Term, Term] = {}
    for node in postorder(term, below=_below):
        parts = tuple(made[part] for part in _below(node))
        match node:
            case Branch() | If():
                then, orelse = parts
                made[node] = add(orelse, mul(_proportion(node), sub(then, orelse)))
            case Prim() if _is_piecewise(node):
                made[node] = _unknown(node)
            case _:
                made[node] = rebuild(node, parts) if parts else node
    return made[term]


def _below(node: Term) -> tuple[Term, ...]:
    match node:
        case Branch(then=then, orelse=orelse) | If(then=then, orelse=orelse):
            return then, orelse
        case Prim(args=args) if not _is_piecewise(node):
            return args
        case _:
            return ()  # what is bound further in has other sides for each value of its variable


def _proportion(node: Branch | If) -> Term:
    if isinstance(node, If):
        return _unknown(node.condition)
    surface, side = normalized_surface(node.surface)
    return _unknown(surface) if side > 0 else sub(ONE, _unknown(surface))


def _unknown(node: Term) -> Term:
    return var(f"side {node.digest.hex()}")


def _is_piecewise(node: Prim) -> bool:
    entry = PRIMITIVES.get(node.op)
    return entry is not None and bool(entry.steps(*node.args) or entry.kinks(*node.args))
