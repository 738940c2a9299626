"""Conditions: which conditional they make.

Owns `bracketed` and `surface_of`. A truth value is a term of comparisons and logic. In a plain conditional it stays
one; in a bracket each comparison becomes a branch across its surface, and logic the nesting of branches.
"""

from __future__ import annotations

from collections.abc import Callable

from potto.core.terms import ONE, ZERO, Prim, Term, branch, if_, sub

TRUTH = frozenset({"lt", "le", "eq", "ne", "and", "or", "not"})
# Told of every branch that is made, with the comparison that it came from.
Note = Callable[[Term, Term], None]


def is_truth(term: Term) -> bool:
    return isinstance(term, Prim) and term.op in TRUTH


def bracketed(truth: Term, then: Term, orelse: Term, note: Note) -> Term:
    """`then` where the truth value holds, else `orelse`, as branches across the surfaces of its comparisons.

    Equality has no surface: it stays a plain conditional, which the checker allows over plain values only.
    """
    if isinstance(truth, Prim):
        match truth.op, truth.args:
            case ("lt" | "le") as op, (a, b):
                made = branch((sub(b, a),), op == "lt", then, orelse)
                note(made, truth)
                return made
            case "and", (p, *rest):
                inner = bracketed(_join("and", rest), then, orelse, note) if rest else then
                return bracketed(p, inner, orelse, note)
            case "or", (p, *rest):
                inner = bracketed(_join("or", rest), then, orelse, note) if rest else orelse
                return bracketed(p, then, inner, note)
            case "not", (p,):
                return bracketed(p, orelse, then, note)
    return if_(truth, then, orelse)


def _join(op: str, rest: list[Term]) -> Term:
    from potto.core.terms import prim

    return rest[0] if len(rest) == 1 else prim(op, *rest)


def iverson(truth: Term, note: Note) -> Term:
    return bracketed(truth, ONE, ZERO, note)
