"""A term that chooses, as one formula for all of its sides.

Owns `with_unknown_sides`.
"""

from __future__ import annotations

from potto.core.simplify import normalized_surface
from potto.core.terms import NAN, ONE, Branch, If, Prim, Term, Var, add, branch, mul, postorder, rebuild, sub, var
from potto.primitives import PRIMITIVES


def with_unknown_sides(term: Term) -> Term:
    """The term with each choice as a mean of its sides in an unknown proportion; the same one where nothing chooses.

    What vanishes for all proportions does so on either side of each condition, however narrow the places are where that
    holds. What there is on one side only counts as it is there, and a builtin that jumps is an unknown.
    """
    made: dict[Term, Term] = {}
    for node in postorder(term, below=_parts):
        choice, parts = _choice(node), tuple(made[part] for part in _parts(node))
        match parts:
            case (then, orelse) if choice is not None:
                made[node] = add(orelse, mul(_proportion(choice), sub(then, orelse)))
            case (only,) if choice is not None:
                made[node] = only
            case ():
                made[node] = _unknown(node) if _jumps(node) else node
            case _:
                made[node] = rebuild(node, parts)
    return made[term]


def _parts(node: Term) -> tuple[Term, ...]:
    """What a term is made of; not what decides, nor what is bound further in, which has sides of its own."""
    choice = _choice(node)
    if choice is not None:
        return tuple(side for side in (choice.then, choice.orelse) if side is not NAN)
    return node.args if isinstance(node, Prim) and not _jumps(node) else ()


def _jumps(node: Term) -> bool:
    return isinstance(node, Prim) and PRIMITIVES[node.op].plain


def _choice(node: Term) -> Branch | If | None:
    """The choice that a term is."""
    if isinstance(node, Prim) and (cases := PRIMITIVES[node.op].cases) is not None:
        margin, then, orelse = cases(*node.args)
        node = branch((margin,), False, then, orelse)
    return node if isinstance(node, Branch | If) else None


def _proportion(node: Branch | If) -> Term:
    if isinstance(node, If):
        return _unknown(node.condition)
    surface, side = normalized_surface(node.surface)
    return _unknown(surface) if side > 0 else sub(ONE, _unknown(surface))


def _unknown(node: Term) -> Var:
    return var(f"side {node.digest.hex()}")
