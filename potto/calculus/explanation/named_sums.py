"""Sums that are factors of others by names, while these are multiplied out: (x - m)^2 is not taken apart then.

Owns `with_sums_named` and `put_back`.
"""

from __future__ import annotations

from collections.abc import Callable, Container

from potto.calculus.algebra.rational_form import equal, normal
from potto.calculus.explanation.factors import factored
from potto.calculus.explanation.products import is_negative, written
from potto.core.polynomials import Polynomial
from potto.core.terms import Prim, Term, Var, children, neg, rebuild, substitute, transform, var

_SUM = "sum'"  # the name of a sum while it is not taken apart: one that nobody can write

NamedSums = list[tuple[str, Term]]


def with_sums_named(node: Term, tangents: frozenset[str]) -> tuple[Term, NamedSums]:
    """The node with a name for each sum that is a factor in it, but for those in which something moves."""
    names: NamedSums = []

    def named(part: Term) -> Term:
        if not isinstance(part, Prim) or part.op != "add" or not part.free.isdisjoint(tangents):
            return part
        for name, known in names:
            if equal(part, known):
                return var(name)
            if equal(part, neg(known)):
                return neg(var(name))
        names.append((f"{_SUM}{len(names)}", part))
        return var(names[-1][0])

    def change(old: Term, new: Term) -> Term:
        if not isinstance(old, Prim) or old.op not in ("mul", "div", "pow") or not isinstance(new, Prim):
            return new
        return rebuild(new, tuple(map(named, new.args)))

    return transform(node, change, below=lambda n: children(n) if isinstance(n, Prim) else ()), names


def put_back(term: Term, named: NamedSums, tangents: frozenset[str], summed: Callable[[Polynomial], Term]) -> Term:
    """With the sums for their names, collected where one is added to others: 1 - x^2 for x^2 + 1 - 2*x^2. summed: a
    polynomial as a term."""
    meant: dict[str, Term] = {}
    for name, whole in named:
        meant[name] = substitute(whole, meant)

    def change(old: Term, new: Term) -> Term:
        if isinstance(old, Var) and old.name in meant:
            return meant[old.name]
        if not _adds_one_of(old, meant):
            return new
        found = normal(new)
        fewer = found is not None and found.whole and isinstance(new, Prim) and len(found.top) < _summands(new)
        if found is None or not fewer:
            return new
        collected.append(new)
        return summed(found.top)

    collected: list[Term] = []
    whole = transform(term, change) if named else term
    return written(factored(whole), tangents) if collected else whole


def _summands(term: Prim) -> int:
    """How many summands a sum is read as, those of a sum that is taken off among them."""
    parts = (children(part)[0] if is_negative(part) else part for part in term.args)
    return sum(len(children(part)) if isinstance(part, Prim) and part.op == "add" else 1 for part in parts)


def _adds_one_of(term: Term, names: Container[str]) -> bool:
    """Whether a term is a sum in which one of these names stands."""
    if not isinstance(term, Prim) or term.op != "add":
        return False
    parts = (children(part)[0] if is_negative(part) else part for part in term.args)
    return any(isinstance(part, Var) and part.name in names for part in parts)
