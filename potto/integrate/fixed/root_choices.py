"""What decides by the parameters alone which formulas the roots of a surface have, as for a quadratic's.

Owns `choices_of`, `chosen` and `smooth`. What the program itself chooses by may have two derivatives at an edge. The
formulas of a root go over into each other.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache

from potto.core.terms import ONE, ZERO, Branch, If, Term, branch, children, if_, postorder, prim, rebuild, tuple_
from potto.integrate.rules.complex_enclosures import enclosable


def choices_of(cuts: Sequence[Term], program: Sequence[Term], variables: Collection[str]) -> tuple[Term, ...]:
    """What decides in cuts, each once: 1 or 0, as a condition of the parameters alone is met or not. Those that are
    parts of the program are none."""
    deciding = dict.fromkeys(node for cut in cuts for node in _deciding(cut))
    if not deciding:
        return ()
    written = set(postorder(*program))
    found = (_met(node) for node in deciding if node not in written)
    return tuple({choice: None for choice in found if choice.free.isdisjoint(variables)})


@lru_cache(maxsize=4096)
def _deciding(cut: Term) -> tuple[Branch | If, ...]:
    """The conditions in a cut: one shader takes another's place, and cuts stay."""
    return tuple(node for node in postorder(cut) if isinstance(node, Branch | If))


def chosen(term: Term, sides: Mapping[Term, bool | None]) -> Term:
    """A term with these choices met or not, or, for None, everything in it that there may be: only to be looked at."""
    memo: dict[Term, Term] = {}
    for node in postorder(term):
        if isinstance(node, Branch | If) and (choice := _met(node)) in sides:
            side, then, orelse = sides[choice], memo[node.then], memo[node.orelse]
            memo[node] = prim("add", then, orelse) if side is None else then if side else orelse
        else:
            memo[node] = rebuild(node, tuple(memo[c] for c in children(node)))
    return memo[term]


def smooth(cuts: Sequence[Term], choices: Collection[Term]) -> bool:
    """Whether cuts are analytic by their form, whatever these choices are."""
    either = children(chosen(tuple_(tuple(cuts)), dict.fromkeys(choices))) if choices else cuts
    return all(map(enclosable, either))


def _met(node: Branch | If) -> Term:
    if isinstance(node, If):
        return if_(node.condition, ONE, ZERO)
    return branch(node.coordinates, node.strict, ONE, ZERO)
