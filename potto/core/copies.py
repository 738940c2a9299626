"""Copies of bound variables, which are told apart by marks (`k'1`), under names that a program can write (`k1`).

Owns `plainly_bound`, and `names_of_copies` and `renamed`, by which the printer does the same on the way.
"""

from __future__ import annotations

from collections.abc import Mapping

from potto.core.terms import (
    Array,
    Fold,
    Global,
    Integral,
    Lam,
    Sum,
    Term,
    Var,
    array,
    fold,
    integral,
    lam,
    postorder,
    sum_,
    transform,
    var,
)


def plainly_bound(term: Term) -> Term:
    """The same term with names for its copies of bound variables that a program can write, as `format_term` has them:
    whoever writes a part of it has the names of the whole."""
    nodes = tuple(postorder(term))
    names = names_of_copies(nodes)
    if not names:
        return term
    return transform(term, lambda _, new: renamed(new, names))


def names_of_copies(nodes: tuple[Term, ...]) -> Mapping[str, str]:
    """For each name that nobody can write one that is used for nothing else in these nodes."""
    used = dict.fromkeys(name for node in nodes for name in _names(node))
    copies = [name for name in used if name.partition("'")[2].isdigit()]  # and not `delta'`, which is a derivative
    names: dict[str, str] = {}
    taken = set(used) if copies else set()
    for name in copies:
        stem, _, tail = name.partition("'")
        candidate, number = stem, int(tail)
        while candidate in taken:
            candidate, number = f"{stem}{number}", number + 1
        taken.add(candidate)
        names[name] = candidate
    return names


def _names(node: Term) -> tuple[str, ...]:
    match node:
        case Var(name=name) | Global(name=name):
            return (name,)
        case Lam(params=names) | Integral(variables=names):
            return names
        case Sum(variable=name) | Array(variable=name):
            return (name,)
        case Fold(variable=name, state=state):
            return name, state
        case _:
            return ()


def renamed(node: Term, names: Mapping[str, str]) -> Term:
    """The node itself with other names; its children, by which their texts are found, stay as they are."""
    match node:
        case Var(name=name):
            return var(names.get(name, name))
        case Lam(params=params):
            return lam(tuple(names.get(p, p) for p in params), node.body)
        case Integral(variables=variables, bounds=bounds):
            return integral(tuple(names.get(v, v) for v in variables), bounds, node.body, node.hints)
        case Sum(variable=name):
            return sum_(names.get(name, name), node.lo, node.hi, node.body, node.endless)
        case Array(variable=name):
            return array(names.get(name, name), node.size, node.body)
        case Fold(variable=name, state=state):
            return fold(names.get(name, name), node.lo, node.hi, names.get(state, state), node.start, node.body)
        case _:
            return node
