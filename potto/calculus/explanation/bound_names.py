"""Names of variables that are bound in a formula: those of the program, and the same in what is the same.

Owns `as_written` and `named_alike`. Where integrals are put together their variables are told apart, as `x` and `x'1`,
though each is seen in its own integral only. People write x in both, and then see that two of them are one.
"""

from __future__ import annotations

from potto.core.terms import (
    Array,
    Integral,
    Sum,
    Term,
    bound_names,
    children,
    rebuild,
    rename_bound,
    stem,
    transform,
)

_Binder = Integral | Sum | Array


def as_written(term: Term, around: frozenset[str] = frozenset()) -> Term:
    """The same term, what is bound in it under the names of the program, as long as these mean nothing else there."""

    def change(_: Term, new: Term) -> Term:
        if not isinstance(new, _Binder):
            return new
        own = bound_names(new)
        taken, names = {*around, *new.free, *own}, dict[str, str]()
        for name in own:
            if stem(name) not in taken:
                names[name] = stem(name)
                taken.add(stem(name))
        named = rename_bound(new, names) if names else new
        inside = around.union(bound_names(named))
        return rebuild(named, tuple(as_written(part, inside) for part in children(named)))

    return transform(term, change, below=lambda node: () if isinstance(node, _Binder) else children(node))


def named_alike(term: Term, around: frozenset[str]) -> Term:
    """The same, and integrals, sums and arrays that differ by the names of their variables are one; `around`: the names
    that none of them may have."""
    known: dict[Term, Term] = {}

    def change(_: Term, new: Term) -> Term:
        if not isinstance(new, _Binder):
            return new
        places = {name: f"bound'{place}" for place, name in enumerate(bound_names(new))}
        return known.setdefault(rename_bound(new, places), new)

    return transform(as_written(term, around), change)
