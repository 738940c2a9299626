"""Terms as polynomials with exact rational coefficients, over atoms with whole exponents.

Owns `normal_form` and `as_term`. Atoms are variables, named constants and whatever is not a polynomial (with its own
parts brought to normal form first). Monomials are sorted by degree, then by name, so that terms which differ in the
order of sums and products only have one normal form. Coefficients are fractions: nothing is rounded and nothing
overflows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache

from potto.core import polynomials
from potto.core.polynomials import ONE, Exact, Monomial, Polynomial, TooLarge, bounded, exact, over, size_of, total
from potto.core.terms import (
    Const,
    Prim,
    Term,
    Var,
    children,
    prim,
    rebuild,
    unknown,
)
from potto.core.walking import Kept
from potto.primitives import PRIMITIVES

_LARGEST = 64  # monomials; an expansion larger than that becomes an atom
_HIGHEST = 16  # powers of sums that are expanded


_FOUND: Kept[Term, Polynomial] = Kept()


def normal_form(term: Term) -> Polynomial:
    """The polynomial that a term is; empty where it is 0."""
    forms = _FOUND.table()
    for node in unknown(term, forms):
        forms[node] = _node(node, forms)
    return forms[term]


def as_term(polynomial: Polynomial) -> Term | None:
    """A polynomial as a term, monomials in order; None if a coefficient cannot be written exactly."""
    return polynomials.as_term({monomial: polynomial[monomial] for monomial in sorted(polynomial, key=_monomial_order)})


def leading(polynomial: Polynomial) -> Monomial:
    """The first monomial in order."""
    return min(polynomial, key=_monomial_order)


def _atom_order(atom: Term) -> tuple[int, str]:
    match atom:
        case Var(name=name):
            return 0, name
        case Const(name=str(name)):
            return 1, name
        case _:
            return 2, atom.digest.hex()


def _monomial_order(monomial: Monomial) -> tuple[int, list[tuple[tuple[int, str], int]]]:
    return -sum(n for _, n in monomial), [(_atom_order(atom), -n) for atom, n in monomial]


# From terms


def _node(node: Term, forms: Mapping[Term, Polynomial]) -> Polynomial:
    match node:
        case Const(name=None, value=value) if math.isfinite(value):
            return {(): exact(value)} if value else {}
        case Prim(op=op, args=args) if op in _RULES:
            try:
                return _RULES[op](*(forms[a] for a in args))
            except TooLarge:
                return _opaque(node, forms)
        case Prim(op=op, args=(inner,)) if PRIMITIVES[op].parity:
            return _symmetric(op, inner, forms)
        case _:
            return _opaque(node, forms)


def _opaque(node: Term, forms: Mapping[Term, Polynomial]) -> Polynomial:
    return _atom(rebuild(node, tuple(_tidy(part, forms) for part in children(node))))


def _tidy(part: Term, forms: Mapping[Term, Polynomial]) -> Term:
    written = as_term(forms[part])
    return part if written is None else written


def _atom(term: Term) -> Polynomial:
    """A term that is not taken apart (or whose constructor has folded it to a number)."""
    if isinstance(term, Const) and term.name is None and math.isfinite(term.value):
        return {(): exact(term.value)} if term.value else {}
    return {((term, 1),): 1}


def _symmetric(op: str, inner: Term, forms: Mapping[Term, Polynomial]) -> Polynomial:
    """f(-x) is -f(x) or f(x): the sign of the leading coefficient of the argument is taken out."""
    form = forms[inner]
    flipped = bool(form) and form[leading(form)] < 0
    written = as_term(_scaled(form, -1) if flipped else form)
    if written is None:
        return _atom(prim(op, inner))
    return _scaled(_atom(prim(op, written)), -1 if flipped and PRIMITIVES[op].parity < 0 else 1)


# Arithmetic


def _bounded(result: Polynomial) -> Polynomial:
    return bounded(result, _LARGEST)


def _sum(*parts: Polynomial) -> Polynomial:
    return total(parts, _LARGEST)


def _scaled(a: Polynomial, factor: Exact) -> Polynomial:
    return _bounded({m: c * factor for m, c in a.items()})


def _product(*parts: Polynomial) -> Polynomial:
    result = ONE
    for part in parts:
        if len(result) * len(part) > 4 * _LARGEST:
            raise TooLarge
        grown: dict[Monomial, Exact] = {}
        for m, c in result.items():
            for n, d in part.items():
                key = _join(m, n)
                grown[key] = grown.get(key, 0) + c * d
        result = _bounded({m: c for m, c in grown.items() if c})
    return result


@lru_cache(maxsize=16384)
def _join(first: Monomial, second: Monomial) -> Monomial:
    if not first or not second:
        return first or second
    exponents = dict(first)
    for atom, n in second:
        exponents[atom] = exponents.get(atom, 0) + n
    return tuple(sorted(((a, n) for a, n in exponents.items() if n), key=lambda pair: _atom_order(pair[0])))


def _negative(a: Polynomial) -> Polynomial:
    return {m: -c for m, c in a.items()}


def _quotient(a: Polynomial, b: Polynomial) -> Polynomial:
    return _product(a, _inverse(b))


def _inverse(a: Polynomial) -> Polynomial:
    """1/a: exact for a monomial, else an atom (the sum with leading coefficient 1) to the power -1."""
    if not a:
        raise TooLarge
    first = leading(a)
    scale = over(1, a[first])
    if len(a) == 1:
        return {tuple((atom, -n) for atom, n in first): scale}
    monic = as_term(_scaled(a, scale))
    if monic is None:
        raise TooLarge
    return {((monic, -1),): scale}


def _power(base: Polynomial, exponent: Polynomial) -> Polynomial:
    n = exponent.get((), 0)
    if (exponent and list(exponent) != [()]) or n.denominator != 1 or size_of(n) > _HIGHEST:
        raise TooLarge
    if len(base) == 1:
        ((monomial, coefficient),) = base.items()
        return _bounded({tuple((a, k * int(n)) for a, k in monomial if n): _raised(coefficient, int(n))})
    if n < 0:
        return _power(_inverse(base), {(): -n})
    return _product(*(base,) * int(n))


def _raised(value: Exact, n: int) -> Exact:
    return value**n if n >= 0 else over(1, value**-n)


def _root(a: Polynomial) -> Polynomial:
    """The square root of the square of a number; others are atoms."""
    value = a.get((), 0)
    if len(a) > 1 or (a and list(a) != [()]) or value < 0:
        raise TooLarge
    root = over(math.isqrt(value.numerator), math.isqrt(value.denominator))
    if root * root != value:
        raise TooLarge
    return {(): root} if root else {}


_RULES: dict[str, Callable[..., Polynomial]] = {
    "add": _sum,
    "mul": _product,
    "neg": _negative,
    "div": _quotient,
    "pow": _power,
    "sqrt": _root,
}
