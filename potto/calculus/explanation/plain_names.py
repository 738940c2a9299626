"""Integrals over variables that a program can write.

Owns `plainly_named`, `plainly_indexed` and `apart`.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping

from potto.core.terms import Integral, Term, Var, rename_bound, stem, substitute, var

Each = tuple[str, Term, Term]  # an index, from, to


def plainly_named(node: Integral, params: Iterable[str]) -> Integral:
    """The same integral over variables that a program can write: copies, as `x'1`, are told apart by marks."""
    taken = {*params, *(name for name in node.variables if "'" not in name)}
    new: dict[str, str] = {}
    for name in node.variables:
        if stem(name) != name:
            new[name] = apart(stem(name), taken)
            taken.add(new[name])
    found = rename_bound(node, new)
    assert isinstance(found, Integral), "names alone are others"
    return found


def plainly_indexed(node: Integral, around: Iterable[Each], params: Iterable[str]) -> tuple[Integral, tuple[Each, ...]]:
    """An integral and the indices of what it stands in, by names that a program can write."""
    around = tuple(around)
    taken = {*params, *node.variables, *(name for name in node.free if "'" not in name)}
    new: dict[str, Term] = {}
    for name, _, _ in around:
        if "'" in name:
            plain = apart(stem(name), taken)
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
