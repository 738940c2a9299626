"""Integrals whose variables can be integrated out one by one, each as a function of one number.

Owns `eliminate`, and `eliminable`, which knows of sums. In an integral over x1, ..., xn what is left after some of them
may depend on those further out through one number only: of a function of a sum it is the part of the sum that is known
so far, in a chain f(x1, x2) f(x2, x3)... the variable before. Then

    V_i(s) = integral of w_i(s, x_i) V_{i+1}(p_i(s, x_i)) dx_i,

a function of one number that can be tabulated, so that n variables take n times as long as one, and not a power of it
(variable elimination, as for discrete variables: Bertele and Brioschi, Nonserial Dynamic Programming, 1972).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import lru_cache, partial, reduce

from msgspec import Struct

from potto.calculus.decomposition.distributions import density_at, distributed
from potto.calculus.decomposition.factors import Names, alternatives, factors, summands
from potto.calculus.surfaces.case_split import by_extremes
from potto.core.collecting import split
from potto.core.polynomials import number
from potto.core.terms import (
    ONE,
    App,
    Branch,
    Const,
    Global,
    If,
    Integral,
    Prim,
    Term,
    Var,
    add,
    branch,
    children,
    integral,
    mul,
    neg,
    postorder,
    prim,
    rebuild,
    reordered,
    transform,
    var,
)

MOST_ORDERED = 4  # variables that are tried in every order
MOST_SUMMANDS = 8


class Distribution(Struct, frozen=True):
    """A number of variables that count through it alone: its density is the sum of what these steps of other integrals
    come to, each from the number, `variable`, as its state."""

    variable: str
    number: Term
    over: Integral
    densities: tuple[tuple[Integral, tuple[EliminationStep, ...]], ...]


class EliminationStep(Struct, frozen=True):
    """V(state) = integral over [lo, hi] of weight * V_next(passed) d(variable), times densities at some places.

    state: the name of the number that is handed on from further out; None where there is none. passed: the number that
    is handed on further in; None where what is further in depends on none, and for the last variable, whose weight is
    all that is left.
    """

    variable: str
    lo: Term
    hi: Term
    state: str | None
    weight: Term
    passed: Term | None
    densities: tuple[tuple[Distribution, Term], ...] = ()

    def over(self, distribution: Distribution) -> bool:
        """Whether it integrates over the number of a distribution, from the least that it may be to the greatest."""
        return self.variable == distribution.variable


class _MoreThanOne(Exception):
    """What is further in depends on more than one number."""


@lru_cache(maxsize=1024)
def eliminate(term: Integral) -> tuple[EliminationStep, ...] | None:
    """The steps, outermost first, in the first order of the variables that does, or of fewer of them with a number in
    the place of others; None where in each of them more than one number would have to be handed on."""
    return _eliminated(term, ())


@lru_cache(maxsize=1024)
def _eliminated(term: Integral, known: tuple[Distribution, ...]) -> tuple[EliminationStep, ...] | None:
    """The same where the densities of some variables are known."""
    steps = _chain(term, None, known)
    if steps is not None:
        return steps
    for way in distributed(term):
        chains = [_chain(density, way.variable, known) for density in way.densities]
        each = tuple((own, chain) for own, chain in zip(way.densities, chains, strict=True) if chain is not None)
        if len(each) < len(chains):
            continue
        further = _eliminated(way.term, (*known, Distribution(way.variable, way.number, way.over, each)))
        if further is not None:
            return further
    return None


def _chain(term: Integral, state: str | None, known: tuple[Distribution, ...]) -> tuple[EliminationStep, ...] | None:
    """The steps in the first order of the variables that does. state: a number that is known to begin with. known:
    whose densities are."""
    return next((steps for order in _orders(term) if (steps := _in_order(order, state, known)) is not None), None)


@lru_cache(maxsize=1024)
def eliminable(term: Integral) -> tuple[Integral, ...]:
    """Integrals that have steps and whose sum is this one: itself, else those of the summands of a factor, or of what a
    condition in it chooses from; or none."""
    if eliminate(term) is not None:
        return (term,)
    term = by_extremes(term)
    every, names = list(factors(term.body)), frozenset(term.variables)
    for place, factor in enumerate(every):
        parts = [part for summand in summands(factor, names) for part in alternatives(summand)]
        if 1 < len(parts) <= MOST_SUMMANDS:
            bodies = (mul(*every[:place], part, *every[place + 1 :]) for part in parts)
            split = tuple(integral(term.variables, term.bounds, body, term.hints) for body in bodies)
            if all(eliminate(each) is not None for each in split):
                return split
    return ()


def _orders(term: Integral) -> Iterator[Integral]:
    """The integral as it is written, and in the other orders of a few variables, where the bounds allow that."""
    yield term
    count, names = len(term.variables), frozenset(term.variables)
    if count > MOST_ORDERED or any((lo.free | hi.free) & names for lo, hi in term.bounds):
        return
    for order in list(itertools.permutations(range(count)))[1:]:
        yield reordered(term, list(order))


def _in_order(term: Integral, state: str | None, known: tuple[Distribution, ...]) -> tuple[EliminationStep, ...] | None:
    everything = (term.body, *(bound for pair in term.bounds for bound in pair))
    kinds = (Const, Var, Prim, Branch, If, App, Global)
    if not all(isinstance(node, kinds) for part in everything for node in postorder(part)):
        return None
    rest, bounds = _bare(term.body), list(term.bounds)
    steps: list[EliminationStep] = []
    for i, variable in enumerate(term.variables):
        lo, hi = bounds[i]
        inner = frozenset(term.variables[i + 1 :])
        if not inner:
            weight, densities = _densities(rest, known)
            return (*steps, EliminationStep(variable, lo, hi, state, weight, None, densities))
        here = frozenset((variable,)) if state is None else frozenset((variable, state))
        weight, rest = _split(rest, here, inner)
        handed = _Handed(here, inner, f"{variable}@known")
        try:
            rest = handed.put(rest)
            bounds[i + 1 :] = [(handed.put(a), handed.put(b)) for a, b in bounds[i + 1 :]]
        except _MoreThanOne:
            return None
        weight, densities = _densities(weight, known)
        steps.append(EliminationStep(variable, lo, hi, state, weight, handed.written, densities))
        state = None if handed.written is None else handed.name
    return None


def _densities(term: Term, known: tuple[Distribution, ...]) -> tuple[Term, tuple[tuple[Distribution, Term], ...]]:
    """A term without the factors of it that are densities, and these: whose, and at which places."""
    by_name = {distribution.variable: distribution for distribution in known}
    rest: list[Term] = []
    found: list[tuple[Distribution, Term]] = []
    for factor in factors(term):
        at = density_at(factor)
        if at is None:
            rest.append(factor)
        else:
            found.append((by_name[at[0]], at[1]))
    return (mul(*rest) if rest else ONE, tuple(found)) if found else (term, ())


def _bare(body: Term) -> Term:
    """Conditionals with the coordinate that decides alone."""

    def change(_: Term, new: Term) -> Term:
        return branch(new.coordinates[:1], new.strict, new.then, new.orelse) if isinstance(new, Branch) else new

    return transform(body, change)


def _split(term: Term, here: Names, inner: Names) -> tuple[Term, Term]:
    """A term as a product of what the inner variables don't occur in, and the rest."""
    weight: list[Term] = []
    rest: list[Term] = []
    for factor in factors(term):
        if not factor.free & inner:
            weight.append(factor)
            continue
        match factor:
            case Prim(op="exp", args=(inside,)):
                terms = summands(inside, here | inner)
                known = [t for t in terms if not t.free & inner]
                if known:
                    weight.append(prim("exp", add(*known)))
                    factor = prim("exp", add(*(t for t in terms if t.free & inner)))
        rest.append(factor)
    return mul(*weight) if weight else ONE, mul(*rest) if rest else ONE


def _parts(node: Prim, names: Names) -> tuple[Callable[..., Term], list[Term]]:
    """What a term is made of in any order, and how it is put together."""
    if node.op == "add":
        return add, summands(node, names)
    if node.op == "mul":
        return mul, list(factors(node))
    return lambda *terms: reduce(partial(prim, node.op), terms), _compared(node)


def _same(node: Prim) -> list[Term]:
    """The parts of an extreme that are extremes of the same kind."""
    return [arg for arg in node.args if isinstance(arg, Prim) and arg.op == node.op]


def _compared(term: Prim) -> list[Term]:
    """What a term is the greatest, or the least, of."""
    found: list[Term] = []
    waiting: list[Term] = [term]
    while waiting:
        item = waiting.pop()
        if isinstance(item, Prim) and item.op == term.op:
            waiting.extend(reversed(item.args))
        else:
            found.append(item)
    return found


_EXTREMES = ("max", "min")


class _Handed(Struct):
    """The one number that terms depend on variables `here` through, as far as they have been put.

    written: that number as a sum, as it comes first; core: the same by what it is a sum of; name: what it is called
    then. What is multiplied or raised to powers stays as it was written: multiplied out it might lose digits.
    """

    here: Names
    inner: Names
    name: str
    core: dict[Term, Fraction] | None = None
    written: Term | None = None

    def put(self, term: Term) -> Term:
        """The term with the number in place of what it is made of. Raises _MoreThanOne."""
        memo: dict[Term, Term] = {}
        nodes = list(postorder(term))
        within = {part for node in nodes if isinstance(node, Prim) and node.op in _EXTREMES for part in _same(node)}
        for node in nodes:
            if self._mixed(node) and node not in within:
                memo[node] = self._rebuilt(node, memo)
        return memo[term] if term in memo else self._single(term)

    def _mixed(self, node: Term) -> bool:
        return bool(node.free & self.here) and bool(node.free & self.inner)

    def _rebuilt(self, node: Term, memo: dict[Term, Term]) -> Term:
        if isinstance(node, Prim) and node.op in ("add", "mul", *_EXTREMES):
            together, parts = _parts(node, self.here | self.inner)
            known = [p for p in parts if not p.free & self.inner and p.free & self.here]
            others = [self._again(p, memo) for p in parts if p.free & self.inner or not p.free & self.here]
            return together(*others, self._single(together(*known))) if known else together(*others)
        return rebuild(node, tuple(self._again(c, memo) for c in children(node)))

    def _again(self, part: Term, memo: dict[Term, Term]) -> Term:
        """The same for a part of a term; also one that is not in it but for its sign, or as a divisor."""
        if part in memo:
            return memo[part]
        if not self._mixed(part):
            return self._single(part)
        return rebuild(part, tuple(self._again(c, memo) for c in children(part)))

    def _single(self, term: Term) -> Term:
        """A term without inner variables by the number."""
        if not term.free & self.here:
            return term
        varying: dict[Term, Fraction] = {}
        constant: list[Term] = []
        moving: list[Term] = []
        for summand in summands(term, self.here):
            coefficient, atom = split(summand)
            if atom.free & self.here:
                varying[atom] = varying.get(atom, Fraction(0)) + coefficient
                moving.append(summand)
            else:
                constant.append(summand)
        if not all(varying.values()):
            raise _MoreThanOne
        first = next(iter(varying))
        if self.core is None:  # with the sign that it starts with: a square counts upwards
            positive = varying[first] > 0
            self.core = varying if positive else {atom: -coefficient for atom, coefficient in varying.items()}
            self.written = add(*moving) if positive else add(*map(neg, moving))
        ratio = varying[first] / self.core.get(first, varying[first])
        scale = number(ratio)
        if scale is None or varying != {atom: ratio * coefficient for atom, coefficient in self.core.items()}:
            raise _MoreThanOne
        return add(*constant, mul(scale, var(self.name)))
