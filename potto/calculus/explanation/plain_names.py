"""Integrals over variables that a program can write.

Owns `plainly_named`.
"""

from __future__ import annotations

from collections.abc import Iterable

from potto.core.terms import Integral, integral, substitute, var


def plainly_named(node: Integral, params: Iterable[str]) -> Integral:
    """The same integral over variables that a program can write: copies, as `x'1`, are told apart by marks."""
    taken = {*params, *(name for name in node.variables if "'" not in name)}
    new: dict[str, str] = {}
    for name in node.variables:
        base = name.partition("'")[0]
        if base != name:
            while base in taken:
                base += "_"
            taken.add(base)
        new[name] = base
    terms = {name: var(plain) for name, plain in new.items()}
    bounds = tuple((substitute(low, terms), substitute(high, terms)) for low, high in node.bounds)
    found = integral(tuple(new.values()), bounds, substitute(node.body, terms))
    return found if isinstance(found, Integral) else node
