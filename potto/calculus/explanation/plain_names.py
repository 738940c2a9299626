"""Integrals over variables that a program can write.

Owns `plainly_named`, `plainly_indexed` and `apart`.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping

from potto.core.terms import Integral, Term, Var, integral, substitute, var

Each = tuple[str, Term, Term]  # an index, from, to


def plainly_named(node: Integral, params: Iterable[str]) -> Integral:
    """The same integral over variables that a program can write: copies, as `x'1`, are told apart by marks."""
    taken = {*params, *(name for name in node.variables if "'" not in name)}
    new: dict[str, str] = {}
    for name in node.variables:
        base = name.partition("'")[0]
        if base != name:
            base = apart(base, taken)
            taken.add(base)
        new[name] = base
    terms = {name: var(plain) for name, plain in new.items()}
    bounds = tuple((substitute(low, terms), substitute(high, terms)) for low, high in node.bounds)
    found = integral(tuple(new.values()), bounds, substitute(node.body, terms))
    return found if isinstance(found, Integral) else node


def plainly_indexed(node: Integral, around: Iterable[Each], params: Iterable[str]) -> tuple[Integral, tuple[Each, ...]]:
    """An integral and the indices of what it stands in, by names that a program can write."""
    around = tuple(around)
    taken = {*params, *node.variables, *(name for name in node.free if "'" not in name)}
    new: dict[str, Term] = {}
    for name, _, _ in around:
        if "'" in name:
            plain = apart(name.partition("'")[0], taken)
            taken.add(plain)
            new[name] = var(plain)
    found = substitute(node, new)
    assert isinstance(found, Integral), "names alone are others"
    return found, tuple([(_name(new, name), substitute(lo, new), substitute(hi, new)) for name, lo, hi in around])


def _name(new: Mapping[str, Term], name: str) -> str:
    found = new.get(name)
    return found.name if isinstance(found, Var) else name


def apart(name: str, taken: Container[str]) -> str:
    """A name like this one that is not taken."""
    while name in taken:
        name += "_"
    return name
