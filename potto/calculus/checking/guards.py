"""What the parameters of measures must be for a formula to have a value, apart from the formula.

Owns `unguarded`. A measure is elaborated as `if 0 < s then ... else` a hole, so that an evaluation that comes there
says what is wrong; a person reads the formula and beside it, once, where it holds.
"""

from __future__ import annotations

from potto.core.printer import format_term
from potto.core.terms import Hole, If, Term, children, postorder, rebuild


def unguarded(term: Term) -> tuple[Term, tuple[str, ...]]:
    """The term without the guards of its measures, and their conditions as Potto writes them, each once."""
    conditions: dict[str, None] = {}
    memo: dict[Term, Term] = {}
    for node in postorder(term):
        if isinstance(node, If) and isinstance(node.orelse, Hole) and node.orelse.measure:
            conditions[format_term(node.condition)] = None
            memo[node] = memo[node.then]
        else:
            memo[node] = rebuild(node, tuple(memo[c] for c in children(node)))
    return memo[term], tuple(conditions)
