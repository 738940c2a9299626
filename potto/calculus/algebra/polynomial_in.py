"""A term as a polynomial in what contains one variable.

Owns `collect` and `in_powers`: a term as a sum of coefficient * atom^degree * ..., where atoms contain the variable
(the variable itself, exp(x), sin(x), ...) and coefficients do not. Degrees are fractions: sqrt(x) is x^(1/2), exp(-2*x)
is exp(x)^(-2). Coefficients stay terms, so that nothing is rounded here.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import lru_cache

from msgspec import Struct

from potto.core.collecting import sum_of
from potto.core.terms import ONE, ZERO, Const, Prim, Term, Var, add, const, div, mul, neg, postorder, pow_, prim, var

Monomial = tuple[tuple[Term, Fraction], ...]
Parts = dict[Monomial, list[Term]]

_LARGEST = 64  # monomials; a larger expansion helps nobody
_HIGHEST = 12  # powers that are expanded


class Collected(Struct, frozen=True):
    """sum of coefficient * product of atom^degree; the empty monomial is the part without the variable."""

    parts: dict[Monomial, Term]

    @property
    def atoms(self) -> frozenset[Term]:
        return frozenset(atom for monomial in self.parts for atom, _ in monomial)

    def degrees(self, atom: Term) -> dict[Fraction, Term]:
        """As a polynomial in the only atom."""
        return {dict(monomial).get(atom, Fraction(0)): part for monomial, part in self.parts.items()}


@lru_cache(maxsize=256)  # who has failed to solve a term asks again, to say why
def collect(term: Term, name: str) -> Collected | None:
    """The polynomial that a term is in what contains `name`; None if it grows too large."""
    memo: dict[Term, Parts] = {}
    for node in postorder(term):
        if name not in node.free:
            memo[node] = {(): [node]}
            continue
        parts = _expand(node, memo, name)
        if parts is None or len(parts) > _LARGEST:
            return None
        memo[node] = parts
    result = {m: add(*(c for c in cs)) for m, cs in memo[term].items()}
    return Collected({m: c for m, c in result.items() if not _cancels(c)})


def _cancels(term: Term) -> bool:
    return (sum_of(term) if isinstance(term, Prim) and term.op == "add" else term) is ZERO


def in_powers(term: Term, name: str, highest: int) -> tuple[Term, ...] | None:
    """The coefficients of a polynomial of at most this degree in a variable, that of the highest power first; None if a
    term is none."""
    found = collect(term, name)
    if found is None or not found.atoms <= {var(name)}:
        return None
    degrees, powers = found.degrees(var(name)), [Fraction(n) for n in range(highest, -1, -1)]
    return tuple(degrees.get(n, ZERO) for n in powers) if degrees.keys() <= set(powers) else None


def _expand(node: Term, memo: dict[Term, Parts], name: str) -> Parts | None:
    if isinstance(node, Prim):
        match node.op:
            case "add":
                return _total(memo[a] for a in node.args)
            case "neg":
                return _scaled(memo[node.args[0]], None)
            case "mul":
                return _product(memo[a] for a in node.args)
            case "div" if name not in node.args[1].free:
                return _scaled(memo[node.args[0]], node.args[1])
            case "div":
                below = _power(memo[node.args[1]], Fraction(-1))
                return _atom(node) if below is None else _product((memo[node.args[0]], below))
            case "sqrt":
                return _power(memo[node.args[0]], Fraction(1, 2)) or _atom(node)
            case "pow" if isinstance(node.args[1], Const):
                degree = _degree(node.args[1].value)
                raised = None if degree is None else _power(memo[node.args[0]], degree)
                return raised or _atom(node)
            case "exp":
                return _exponential(memo[node.args[0]])
            case _:
                return _atom(node)
    return _atom(node)


def _degree(value: float) -> Fraction | None:
    if value != value or abs(value) > 1e6:
        return None
    exact = Fraction(value).limit_denominator(12)
    return exact if float(exact) == value else None


def _atom(term: Term) -> Parts:
    return {((term, Fraction(1)),): [ONE]}


def _total(items: Iterable[Parts]) -> Parts:
    result: Parts = {}
    for item in items:
        for monomial, parts in item.items():
            result.setdefault(monomial, []).extend(parts)
    return result


def _scaled(item: Parts, divisor: Term | None) -> Parts:
    """Minus `item`, or `item` over a divisor."""
    if divisor is None:
        return {m: [neg(c) for c in cs] for m, cs in item.items()}
    return {m: [div(add(*cs), divisor)] for m, cs in item.items()}


def _product(items: Iterable[Parts]) -> Parts | None:
    result: Parts = {(): [ONE]}
    for item in items:
        if len(result) * len(item) > 4 * _LARGEST:
            return None
        grown: Parts = {}
        factors = [(n, add(*ds)) for n, ds in item.items()]
        for m, cs in result.items():
            left = add(*cs)
            for n, right in factors:
                grown.setdefault(_join(m, n), []).append(mul(left, right))
        result = grown
    return result


@lru_cache(maxsize=16384)
def _join(first: Monomial, second: Monomial) -> Monomial:
    if not first or not second:
        return first or second
    degrees = dict(first)
    for atom, degree in second:
        degrees[atom] = degrees.get(atom, Fraction(0)) + degree
    return _in_order(degrees)


def _in_order(degrees: dict[Term, Fraction]) -> Monomial:
    return tuple(sorted(((a, d) for a, d in degrees.items() if d), key=lambda pair: pair[0].digest))


def _power(item: Parts, degree: Fraction) -> Parts | None:
    if degree == 0:
        return {(): [ONE]}
    if len(item) == 1:
        ((monomial, cs),) = item.items()
        whole = degree.denominator == 1
        # (x^2)^(1/2) is |x|, not x: roots are drawn only from what cannot be negative where it is defined.
        if whole or (len(monomial) == 1 and monomial[0][1] == 1):
            part = add(*cs)
            if whole or part is ONE:
                raised = part if part is ONE else pow_(part, const(float(degree)))
                return {tuple((a, d * degree) for a, d in monomial): [raised]}
        return None
    if degree.denominator == 1 and 0 < degree <= _HIGHEST:
        return _product([item] * int(degree))
    return None


def _exponential(item: Parts) -> Parts:
    """exp of a sum: a factor for the part without the variable, and atoms exp(g) to rational powers."""
    degrees: dict[Term, Fraction] = {}
    factors: list[Term] = []
    for monomial, cs in item.items():
        part = add(*cs)
        if not monomial:
            factors.append(prim("exp", part))
            continue
        scale, rest = _rational(part)
        inner = mul(rest, *(pow_(a, const(float(d))) if d != 1 else a for a, d in monomial))
        atom = prim("exp", inner)
        degrees[atom] = degrees.get(atom, Fraction(0)) + scale
    return {_in_order(degrees): [mul(*factors)]}


def _rational(part: Term) -> tuple[Fraction, Term]:
    """A small rational factor of a coefficient, and what is left of it."""
    if isinstance(part, Prim) and part.op == "neg":
        scale, rest = _rational(part.args[0])
        return -scale, rest
    if isinstance(part, Const) and part.name is None:
        degree = _degree(part.value)
        return (degree, ONE) if degree else (Fraction(1), part)
    if isinstance(part, Prim) and part.op == "mul" and isinstance(part.args[0], Const):
        degree = _degree(part.args[0].value)
        if degree:
            return degree, mul(*part.args[1:])
    return Fraction(1), part


def dominators(term: Term, name: str) -> list[Term]:
    """Subterms that every path from `term` down to the variable goes through, outermost first; the variable last."""
    order = [node for node in postorder(term) if name in node.free]
    target = next((n for n in order if isinstance(n, Var) and n.name == name), None)
    if target is None:
        return []
    below: dict[Term, int] = {}
    for node in order:
        below[node] = 1 if node is target else sum(below.get(c, 0) for c in _children(node))
    above: dict[Term, int] = dict.fromkeys(order, 0)
    above[term] = 1
    for node in reversed(order):
        for child in _children(node):
            if child in above:
                above[child] += above[node]
    total = below[term]
    return [n for n in reversed(order) if above[n] * below[n] == total]


def _children(node: Term) -> tuple[Term, ...]:
    return node.args if isinstance(node, Prim) else ()
