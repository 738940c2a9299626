"""A term as one fraction: what it is a root of where denominators vary too.

Owns `numerator`. Sums, products and whole powers are put over their common denominator, of which the factors stay
factors: the numerator of `(p/w)^2 + (q/w)^2 - v` is `p^2 + q^2 - v*w^2`, of the degree that it has and of no more.
"""

from __future__ import annotations

from collections import Counter

from msgspec import Struct

from potto.core.terms import ONE, Const, Prim, Term, add, const, mul, neg, postorder, pow_

_HIGHEST = 12  # powers of a fraction that are carried out, as of a polynomial in `polynomial_in`


class _Fraction(Struct, frozen=True):
    """top over a product of powers of factors."""

    top: Term
    below: Counter[Term]

    def over(self, common: Counter[Term]) -> Term:
        """The numerator over a denominator that has all of these factors and more."""
        return mul(self.top, *_powers(common - self.below))


def numerator(term: Term, name: str) -> Term | None:
    """What a term is zero with, where its denominators are not; None where no denominator varies with the variable.

    A factor of the numerator that is one of the denominator too is left out.
    """

    def below(node: Term) -> tuple[Term, ...]:
        return _parts(node) if name in node.free else ()

    order = postorder(term, below=below)
    if not any(below(node) and _divides(node) for node in order):
        return None
    memo: dict[Term, _Fraction] = {}
    for node in order:
        memo[node] = _node(node, memo) if name in node.free else _Fraction(node, Counter())
    found = memo[term]
    return found.top if found.below else None


def _parts(node: Term) -> tuple[Term, ...]:
    """What `_node` makes a fraction of, none of what it leaves as it is."""
    match node:
        case Prim(op="add" | "neg" | "mul" | "div", args=args):
            return args
        case Prim(op="pow", args=(base, Const(value=power))) if power.is_integer() and abs(power) <= _HIGHEST:
            return (base,)
        case _:
            return ()


def _divides(node: Term) -> bool:
    match node:
        case Prim(op="div"):
            return True
        case Prim(op="pow", args=(_, Const(value=power))):
            return power < 0
        case _:
            return False


def _node(node: Term, memo: dict[Term, _Fraction]) -> _Fraction:
    match node:
        case Prim(op="add", args=args):
            parts = [memo[a] for a in args]
            common: Counter[Term] = Counter()
            for part in parts:
                common |= part.below
            return _Fraction(add(*(part.over(common) for part in parts)), common)
        case Prim(op="neg", args=(inner,)):
            return _Fraction(neg(memo[inner].top), memo[inner].below)
        case Prim(op="mul", args=args):
            return _product([memo[a] for a in args])
        case Prim(op="div", args=(top, below)):
            return _product([memo[top], _inverse(memo[below])])
        case Prim(op="pow", args=(base, Const(value=power))) if power.is_integer() and abs(power) <= _HIGHEST:
            whole = memo[base] if power > 0 else _inverse(memo[base])
            n = int(abs(power))
            return _Fraction(pow_(whole.top, const(n)), Counter({f: n * k for f, k in whole.below.items()}))
        case _:
            return _Fraction(node, Counter())


def _product(parts: list[_Fraction]) -> _Fraction:
    top: Counter[Term] = Counter()
    below: Counter[Term] = Counter()
    for part in parts:
        top += _factors(part.top)
        below += part.below
    shared = top & below
    return _Fraction(mul(*_powers(top - shared)), below - shared)


def _inverse(part: _Fraction) -> _Fraction:
    return _Fraction(mul(*_powers(part.below)), _factors(part.top))


def _powers(factors: Counter[Term]) -> list[Term]:
    return [f if n == 1 else pow_(f, const(n)) for f, n in factors.items()] or [ONE]


def _factors(term: Term) -> Counter[Term]:
    """The factors of a product with how often they come, signs and numbers as one of them."""
    found: Counter[Term] = Counter()
    waiting = [term]
    while waiting:
        match waiting.pop():
            case Prim(op="mul", args=args):
                waiting.extend(args)
            case Prim(op="neg", args=(inner,)):
                found[const(-1.0)] += 1
                waiting.append(inner)
            case Prim(op="pow", args=(base, Const(value=power))) if power.is_integer() and power > 0:
                found[base] += int(power)
            case factor:
                found[factor] += 1
    return found
