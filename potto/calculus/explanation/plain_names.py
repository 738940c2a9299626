"""Integrals over variables that a program can write.

Owns `plainly_named` and `apart`.
"""

from __future__ import annotations

from collections.abc import Container, Iterable

from potto.core.terms import Integral, integral, substitute, var


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


def apart(name: str, taken: Container[str]) -> str:
    """A name like this one that is not taken."""
    while name in taken:
        name += "_"
    return name
