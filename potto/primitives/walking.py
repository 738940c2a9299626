"""One walk over a term for every kind of value: floats, digits, intervals, discs.

Owns `Domain`. A domain says what constants are, which rule it reads from a builtin's entry, and what becomes of
choices; whatever an entry has no rule for in a domain is done to its defining formula instead (the domains are
"tagless final": Carette, Kiselyov and Shan 2009).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Generic, TypeVar

from potto.core.terms import Const, Prim, Term, Var, postorder, var
from potto.primitives.registry import PRIMITIVES, Primitive

V = TypeVar("V")
Rule = Callable[..., V]


class Domain(ABC, Generic[V]):
    """Values of one kind. Domains keep nothing of the terms that they walk over, so that one object serves all."""

    @abstractmethod
    def constant(self, node: Const) -> V:
        """A number that is written."""

    @abstractmethod
    def rule(self, entry: Primitive) -> Rule[V] | None:
        """The domain's own rule for a builtin, from its entry; None if it has none."""

    @abstractmethod
    def unknown(self) -> V:
        """What nothing is known of."""

    def other(self, node: Term, known: Mapping[Term, V]) -> V:
        """Choices, and whatever else is not a number, variable or builtin."""
        return self.unknown()

    def builtin(self, node: Prim, known: Mapping[Term, V]) -> V:
        """A builtin whose arguments are known; for domains that look at how these are written."""
        return self.apply(node.op, [known[arg] for arg in node.args])

    def does(self, op: str) -> bool:
        """Whether `builtin` needs no rule for an operator."""
        return False

    def apply(self, op: str, args: Sequence[V]) -> V:
        entry = PRIMITIVES.get(op)
        if entry is None:
            return self.unknown()
        rule = self.rule(entry)
        if rule is not None:
            return rule(*args)
        if entry.formula is None:
            return self.unknown()
        whole, names = formula_of(op, len(args))
        return self.walk((whole,), dict(zip(names, args, strict=True)), {})[0]

    def walk(self, terms: Sequence[Term], env: Mapping[str, V], known: dict[Term, V]) -> list[V]:
        """The values of terms; `known` has what was worked out before, and grows."""
        for node in postorder(*terms):
            if node not in known:
                known[node] = self.node(node, env, known)
        return [known[term] for term in terms]

    def node(self, node: Term, env: Mapping[str, V], known: Mapping[Term, V]) -> V:
        """One node whose parts are known."""
        if isinstance(node, Prim):
            return self.builtin(node, known)
        if isinstance(node, Const):
            return self.constant(node)
        if isinstance(node, Var):
            return env[node.name] if node.name in env else self.unknown()
        return self.other(node, known)

    def knows(self, op: str) -> bool:
        """Whether it has a rule for a builtin, its own or that of the formula."""
        entry = PRIMITIVES.get(op)
        if entry is None:
            return False
        if self.does(op) or self.rule(entry) is not None:
            return True
        return entry.formula is not None and all(
            self.knows(node.op) for node in postorder(formula_of(op, entry.arity or 2)[0]) if isinstance(node, Prim)
        )


@lru_cache(maxsize=256)
def formula_of(op: str, arity: int) -> tuple[Term, tuple[str, ...]]:
    """A builtin's formula over placeholders, and their names."""
    entry = PRIMITIVES[op]
    assert entry.formula is not None
    names = tuple(f"#{i}" for i in range(arity))
    return entry.formula(*map(var, names)), names
