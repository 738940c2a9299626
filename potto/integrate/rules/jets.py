"""Terms with their slopes at places, or over boxes, by no formula but those of the builtins: forward differentiation.

Owns `Jets`. A derivative that is written out as a term, and a kernel, pay where they are asked for often; what is asked
for once is had sooner by going over the term, in whatever arithmetic: floats for Newton's steps, intervals for proofs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Generic, TypeVar

from msgspec import Struct

from potto.core.simplify import simplify
from potto.core.terms import Const, Prim, Term, Var, add, const, mul, postorder, var
from potto.primitives import PRIMITIVES
from potto.primitives.walking import Domain

V = TypeVar("V")
Jet = tuple[V, V | None]  # a value, and a column of slopes; None where nothing moves


class NotAnalytic(Exception):
    """Something that is more than one analytic formula: a choice, a call, a builtin that jumps or bends."""


class Jets(Struct, Generic[V], frozen=True):
    """Forward differentiation in the arithmetic of a domain, in which a column of slopes is a value like any other."""

    domain: Domain[V]

    def of(self, terms: Sequence[Term], env: Mapping[str, Jet[V]]) -> list[Jet[V]]:
        """The values of terms and their slopes. Raises NotAnalytic."""
        values: dict[Term, V] = {}
        slopes: dict[Term, V | None] = {}
        for node in _order(tuple(terms)):
            slopes[node] = None
            if isinstance(node, Const):
                values[node] = self.domain.constant(node)
            elif isinstance(node, Var):
                values[node], slopes[node] = env[node.name]
            elif isinstance(node, Prim):
                values[node] = self.domain.builtin(node, values)
                slopes[node] = self._slope(node, values, slopes)
            else:
                raise NotAnalytic
        return [(values[term], slopes[term]) for term in terms]

    def _slope(self, node: Prim, values: Mapping[Term, V], slopes: Mapping[Term, V | None]) -> V | None:
        moving = tuple(slopes[arg] is not None for arg in node.args)
        if not any(moving):
            return None
        constants = tuple(arg.value if isinstance(arg, Const) else None for arg in node.args)
        term, order = _rule(node.op, constants, moving)
        env = {f"#{i}": values[arg] for i, arg in enumerate(node.args)}
        env |= {f"'{i}": slope for i, arg in enumerate(node.args) if (slope := slopes[arg]) is not None}
        known: dict[Term, V] = {}
        for part in order:
            known[part] = self.domain.node(part, env, known)
        return known[term]


@lru_cache(maxsize=4096)
def _rule(op: str, constants: tuple[float | None, ...], moving: tuple[bool, ...]) -> tuple[Term, tuple[Term, ...]]:
    """The slope of a builtin by its arguments, #0 and on, and by their slopes, '0 and on. Raises NotAnalytic."""
    entry = PRIMITIVES[op]
    if entry.partials is None or not entry.analytic:
        raise NotAnalytic
    args = [var(f"#{i}") if value is None else const(value) for i, value in enumerate(constants)]
    parts = [mul(p, var(f"'{i}")) for i, p in enumerate(entry.partials(*args)) if moving[i]]
    term = simplify(parts[0] if len(parts) == 1 else add(*parts))  # choices by constants are made
    return term, tuple(postorder(term))


@lru_cache(maxsize=1024)
def _order(terms: tuple[Term, ...]) -> tuple[Term, ...]:
    return tuple(postorder(*terms))
