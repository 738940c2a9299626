"""Numbers that conditions compare something with and that other integrals give, found once beside the integral.

Owns `compares` and `with_compared`. Of `[sin(x) + x^2 < k]`, where `k` is an integral, the zeros are searched for as
those of any condition with a parameter.
"""

from __future__ import annotations

from potto.calculus.inlining.expand import expanded
from potto.calculus.inlining.reads import Access, compared
from potto.core.terms import Branch, Delta, Global, Integral, Term
from potto.kernels.cells import Env, Value
from potto.kernels.making import making
from potto.runtime.evaluation.functions import Closure, Derivative
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.reach import Reach, kept
from potto.runtime.integration.preparation.arrays import Read, found_beside


def compares(term: Integral, env: Env, reach: Reach) -> bool:
    """Whether an integral has conditions that compare something with what integrals give."""
    return bool(_beside(term, _givers(term, env, reach), reach)[1])


def with_compared(machine: Machine, term: Integral, env: Env) -> tuple[Integral, Env, Read]:
    """An equal integral, what it is of, and what its new names stand for."""
    reach = machine.linker.reach
    with making:
        found, accesses = _beside(term, _givers(term, env, reach), reach)
    ready, env, read = found_beside(machine, found, accesses, env)
    assert isinstance(ready, Integral)
    return ready, env, read


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
def _beside(term: Integral, givers: frozenset[str], reach: Reach) -> tuple[Term, tuple[Access, ...]]:
    def integrals(node: Term) -> bool:
        return Integral in reach.kinds(node) or not givers.isdisjoint(node.free)

    def hides(name: Global) -> Term | None:
        return reach.resolve(name) if reach.kinds(name) & {Branch, Delta} and integrals(name) else None

    if not (integrals(term.body) and reach.kinds(term.body) & {Branch, Delta}):
        return term, ()
    found = compared(term, integrals)
    return found if found[1] else compared(expanded(term, hides), integrals)
