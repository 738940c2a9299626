"""Numbers that other integrals give, found once beside an integral.

Owns `finds_once` and `with_found_once`. Of `[sin(x) + x^2 < k]`, where `k` is an integral, the zeros are searched for
as those of any condition with a parameter; and `[x < t]*(1 + k)` has its value at each node without another look at
`k`, in which there may be further integrals.
"""

from __future__ import annotations

from potto.calculus.inlining.expand import expanded
from potto.calculus.inlining.reads import Access, found_once
from potto.core.terms import Branch, Delta, Global, Integral, Term
from potto.kernels.cells import Env, Value
from potto.kernels.making import making
from potto.runtime.evaluation.functions import Closure, Derivative
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.reach import Reach, kept
from potto.runtime.integration.preparation.arrays import Read, found_beside


def finds_once(machine: Machine, term: Integral, env: Env) -> bool:
    """Whether an integral is made of what other integrals give."""
    return bool(_found(machine, term, env)[1])


def with_found_once(machine: Machine, term: Integral, env: Env) -> tuple[Integral, Env, Read]:
    """An equal integral, what it is of, and what its new names stand for."""
    with making:
        found, accesses = _found(machine, term, env)
    ready, env, read = found_beside(machine, found, accesses, env)
    assert isinstance(ready, Integral)
    return ready, env, read


def _found(machine: Machine, term: Integral, env: Env) -> tuple[Term, tuple[Access, ...]]:
    """Where points are drawn, they are drawn for all integrals together: products of two estimates by the same points
    would not be right on average."""
    reach = machine.linker.reach
    return _beside(term, _givers(term, env, reach), not machine.settings.sampled, reach)


def _givers(term: Integral, env: Env, reach: Reach) -> frozenset[str]:
    """The parameters that are functions and lead to integrals."""
    return frozenset(name for name in term.free if isinstance(value := env[name], Closure) and _leads(value, reach))


def _leads(value: Value, reach: Reach) -> bool:
    while isinstance(value, Derivative):
        value = value.primal
    if not isinstance(value, Closure):
        return False
    return Integral in reach.kinds(value.lam) or any(_leads(each, reach) for each in value.captured.values())


@kept
def _beside(term: Integral, givers: frozenset[str], everywhere: bool, reach: Reach) -> tuple[Term, tuple[Access, ...]]:
    def integrals(node: Term) -> bool:
        return Integral in reach.kinds(node) or not givers.isdisjoint(node.free)

    def hides(name: Global) -> Term | None:
        return reach.resolve(name) if reach.kinds(name) & {Branch, Delta} and integrals(name) else None

    if not integrals(term.body):
        return term, ()
    found = found_once(term, integrals, everywhere)
    if found[1] or not reach.kinds(term.body) & {Branch, Delta}:
        return found
    whole = expanded(term, hides)
    assert isinstance(whole, Integral)
    return found_once(whole, integrals, everywhere)
