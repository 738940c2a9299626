"""A normal form that recognizes zero: quotients of polynomials over atoms, with exact coefficients.

Owns `is_zero` and `shorter`, which decide whether a determinant vanishes, whether a discriminant cancels, and whether
an author's inverse is right. Atoms are variables and what is not a polynomial; sin^2 + cos^2 = 1, cosh^2 - sinh^2 = 1,
sqrt(u)^2 = u, exp(a + b) = exp(a) exp(b) and exp(n log(u)) = u^n are used. Equal normal forms mean equal values
wherever both are defined; unequal ones mean nothing.

Not `core.normal_form`, which puts terms in order and must keep their values everywhere, so that it has no quotients and
uses no identity between atoms. What is decided and solved here may be defined at more points than the term was.
"""

from __future__ import annotations

from functools import lru_cache

from msgspec import Struct

from potto.calculus.algebra.choices import with_unknown_sides
from potto.calculus.algebra.point_values import not_zero
from potto.core import polynomials
from potto.core.normal_form import as_term as ordered
from potto.core.normal_form import normal_form
from potto.core.polynomials import (
    ONE,
    Exact,
    Monomial,
    Polynomial,
    TooLarge,
    divided,
    exact,
    over,
    shared_by,
    size_of,
    sorted_monomial,
    total,
    without,
)
from potto.core.term_kinds import App, Array, Deriv, Fold, Index, Integral, Lam, Length, ListOf, Sum, Tuple, union_of
from potto.core.terms import Const, Prim, Term, Var, add, children, div, mul, neg, postorder, prim, rebuild, unknown
from potto.core.walking import Holding, Kept

_LARGEST = 128  # monomials


class Rational(Struct, frozen=True):
    """top / below."""

    top: Polynomial
    below: Polynomial

    @property
    def whole(self) -> bool:
        return self.below == ONE


# By the variable along which sums are taken apart: what terms share is multiplied out once, and what has grown too
# large is not tried again in every term that contains it.
_FOUND: dict[str | None, Kept[Term, Rational | None]] = {}


def normal(term: Term, name: str | None = None) -> Rational | None:
    """The normal form; None where it would be too large or a value is not a number.

    name: sums that do not vary with this variable are atoms: few monomials, which tell less.
    """
    known = _FOUND.setdefault(name, Kept()).table()
    order = unknown(term, known, lambda node: _summed(node, name))
    if any(known.get(part, term) is None for node in order for part in _summed(node, name)):
        order, known[term] = [], None
    for node in order:
        try:
            known[node] = _node(node, [_small(known[part]) for part in _summed(node, name)])
        except TooLarge:
            known[node] = known[term] = None  # and so is all that it is a part of: the rest needn't be multiplied out
            break
    return known[term]


def _summed(node: Term, name: str | None) -> tuple[Term, ...]:
    """The parts of whose normal forms that of a term is made; none of an atom."""
    if not isinstance(node, Prim) or (name is not None and name not in node.free and node.op == "add"):
        return ()
    match node.op:
        case "add" | "neg" | "mul" | "div" | "exp":
            return node.args
        case "pow" if isinstance(node.args[1], Const) and node.args[1].value.is_integer():
            return node.args[:1]
        case _:
            return ()


def _small(form: Rational | None) -> Rational:
    if form is None:
        raise TooLarge
    return form


@lru_cache(maxsize=8192)
def settled(term: Term, names: frozenset[str]) -> Term:
    """An equal term in which rational parts that vary with a variable by their form alone are without it.

    Of a plane through the point p, dot(n, p) is one number wherever p is written as a fraction of coordinates.
    """
    below = [n.args[1] for n in postorder(term) if isinstance(n, Prim) and n.op == "div"]
    for name in sorted(names.intersection(union_of(below))):
        term = _settled(term, name)
    return term


def _settled(term: Term, name: str) -> Term:
    memo: dict[Term, Term] = {}
    rational: dict[Term, bool] = {}
    for node in postorder(term, below=lambda node: children(node) if name in node.free else ()):
        parts = children(node) if name in node.free else ()
        rational[node] = not parts or (_is_rational(node) and all(rational[part] for part in parts))
        new = rebuild(node, tuple(memo[part] for part in parts)) if parts else node
        if isinstance(node, Prim) and node.op in ("add", "mul") and not rational[node]:
            some = [memo[part] for part in parts if rational[part]]
            others = [memo[part] for part in parts if not rational[part]]
            join = add if node.op == "add" else mul
            new = join(_without_it(join(*some), name), *others) if some else new
        elif parts and not rational[node]:
            fewer = (_without_it(memo[part], name) if rational[part] else memo[part] for part in parts)
            new = rebuild(node, tuple(fewer))
        memo[node] = new
    return _without_it(memo[term], name) if rational[term] else memo[term]


def _is_rational(node: Term) -> bool:
    if not isinstance(node, Prim):
        return False
    power = node.args[-1] if node.op == "pow" else None
    return node.op in ("add", "neg", "mul", "div") or (isinstance(power, Const) and power.value.is_integer())


def _without_it(term: Term, name: str) -> Term:
    for sums in (name, None) if name in term.free else ():
        found = normal(term, sums)
        atoms = {a for part in (found.top, found.below) for m in part for a, _ in m} if found else set[Term]()
        if found is not None and not any(name in atom.free for atom in atoms):
            top, below = as_term(found.top, rounded=True), as_term(found.below, rounded=True)
            return term if top is None or below is None else div(top, below)
    return term


# Equal ones are told by their normal forms.
_holds_opaque = Holding(App, Array, Deriv, Fold, Index, Integral, Lam, Length, ListOf, Sum, Tuple)


@lru_cache(maxsize=8192)
def is_zero(term: Term) -> bool:
    """Whether a term is 0 wherever it is defined. False also where that is not known.

    A value at one point in doubles says no to nearly all that are not; then the normal form says yes, or sample points
    do, to 50 digits, where an identity is needed that it does not know. Points tell of one analytic function alone:
    hardly one lies where 0.3 < y < 0.31, so that what chooses must be 0 on all sides.
    """
    if _holds_opaque(term):
        term = ordered(normal_form(term)) or term
    if isinstance(term, Const):
        return term.value == 0
    if not_zero(term):
        return False
    term = with_unknown_sides(term)
    differs = not_zero(term)
    if differs:
        return False
    found = normal(term)
    if found is not None and all(isinstance(atom, Const | Var) for monomial in found.top for atom, _ in monomial):
        return not found.top  # a polynomial in variables only is 0 only if all of its coefficients are
    if differs is None:
        return False
    from potto.core.reference import zero_at_all  # slow to import, and seldom needed

    reduced = None if found is None else as_term(found.top)
    return zero_at_all(term if reduced is None else reduced)  # what is left of a sum tells more than all that cancels


def equal(first: Term, second: Term) -> bool:
    """Whether two terms are equal wherever both are defined, by symbols alone."""
    found = normal(add(first, neg(second)))
    return first is second or (found is not None and not found.top)


def shorter(term: Term) -> Term:
    """The same value with what cancels taken out, if that is shorter; else the term as it is."""
    if not isinstance(term, Prim):
        return term
    found = normal(term)
    if found is None or not found.whole:
        return term
    expanded = as_term(found.top)
    return expanded if expanded is not None and _size(expanded) < _size(term) else term


def tidy(term: Term) -> Term:
    """The same value for people to read: as one quotient of expanded polynomials, if that is no longer."""
    found = normal(term)
    if found is None:
        return term
    top, below = as_term(found.top), as_term(found.below)
    if top is None or below is None:
        return term
    whole = div(top, below)
    return whole if _size(whole) <= _size(term) else term


def _size(term: Term) -> int:
    sizes: dict[Term, int] = {}
    for node in postorder(term):
        parts = node.args if isinstance(node, Prim) else ()
        sizes[node] = min(1 + sum(sizes[p] for p in parts), 1 << 60)
    return sizes[term]


def as_term(polynomial: Polynomial, rounded: bool = False) -> Term | None:
    """A polynomial as a term, what is taken away last; None if a coefficient is not a float, unless it may be `rounded`
    to one."""
    last = {monomial: c for monomial, c in polynomial.items() if monomial and c < 0}
    first = {monomial: c for monomial, c in polynomial.items() if monomial not in last}
    return polynomials.as_term({**first, **last}, rounded)


# Arithmetic


def _node(node: Term, args: list[Rational]) -> Rational:
    """args: the normal forms of the parts that it is made of. Raises TooLarge."""
    if isinstance(node, Const) and node.name is None:
        if not abs(node.value) < float("inf"):
            raise TooLarge
        return Rational({(): exact(node.value)} if node.value else {}, ONE)
    if not isinstance(node, Prim):
        return _atom(node)
    match node.op if args else "":
        case "add":
            result = args[0]
            for arg in args[1:]:
                result = _plus(result, arg)
            return result
        case "neg":
            return Rational({m: -c for m, c in args[0].top.items()}, args[0].below)
        case "mul":
            result = args[0]
            for arg in args[1:]:
                result = _product(result, arg)
            return result
        case "div":
            return _product(args[0], _flip(args[1]))
        case "pow":
            assert isinstance(node.args[1], Const)
            return _power(args[0], int(node.args[1].value))
        case "exp":
            return _exponential(node, args[0])
        case _:
            half = node.op == "pow" and isinstance(node.args[1], Const) and node.args[1].value == 0.5
            return _atom(prim("sqrt", node.args[0]) if half else node)


def _atom(term: Term) -> Rational:
    return Rational({((term, 1),): 1}, ONE)


def _plus(a: Rational, b: Rational) -> Rational:
    if a.below == b.below:
        return _reduced(total((a.top, b.top), _LARGEST), a.below)
    return _reduced(total((_times(a.top, b.below), _times(b.top, a.below)), _LARGEST), _times(a.below, b.below))


def _product(a: Rational, b: Rational) -> Rational:
    if a.top == b.below:
        return _left(b.top, a.below) if a.top else a
    if a.below == b.top:
        return _left(a.top, b.below)
    return _reduced(_times(a.top, b.top), _times(a.below, b.below))


def _left(top: Polynomial, below: Polynomial) -> Rational:
    """What is left where a factor has cancelled, which may cancel as well; a number below stays there."""
    return Rational(top, below) if below.keys() == {()} else _reduced(top, below)


def _flip(a: Rational) -> Rational:
    if not a.top:
        raise TooLarge
    return Rational(a.below, a.top)


def _power(a: Rational, n: int) -> Rational:
    if abs(n) > 24:
        raise TooLarge
    base = _flip(a) if n < 0 else a
    result = Rational(ONE, ONE)
    for _ in range(abs(n)):
        result = _product(result, base)
    return result


def _reduced(top: Polynomial, below: Polynomial) -> Rational:
    """Common monomials cancelled, and a denominator of one monomial kept monic."""
    if not top:
        return Rational(top, ONE)
    if top == below:
        return Rational(ONE, ONE)
    if len(below) > 1 or len(top) > 1:
        whole = divided(top, below, _LARGEST)
        if whole is not None:
            return Rational(whole, ONE)
        whole = divided(below, top, _LARGEST)
        if whole is not None:
            return _reduced(ONE, whole)
    if below != ONE:
        shared = shared_by([*top, *below])
        if shared:
            top = {without(m, shared): c for m, c in top.items()}
            below = {without(m, shared): c for m, c in below.items()}
        lead = next(iter(below.values()))
        if lead != 1:
            top = {m: over(c, lead) for m, c in top.items()}
            below = {m: over(c, lead) for m, c in below.items()}
    return Rational(top, below)


def _times(a: Polynomial, b: Polynomial) -> Polynomial:
    if a == ONE:
        return b
    if b == ONE:
        return a
    if len(a) * len(b) > 4 * _LARGEST:
        raise TooLarge
    plain: dict[Monomial, Exact] = {}
    others: list[Polynomial] = []
    for m, c in a.items():
        for n, d in b.items():
            monomial, square = _joined(m, n)
            if square is None:
                plain[monomial] = plain.get(monomial, 0) + c * d
            else:
                others.append(_times(square, {monomial: c * d}))
    return total((plain, *others), _LARGEST)


@lru_cache(maxsize=16384)
def _joined(first: Monomial, second: Monomial) -> tuple[Monomial, Polynomial | None]:
    """The product of two monomials, and what it is still to be multiplied with where an identity knows a square."""
    counts = dict(first)
    for atom, n in second:
        counts[atom] = counts.get(atom, 0) + n
    for atom, n in counts.items():
        square = _square(atom) if n >= 2 else None
        if square is not None:
            rest = {a: k for a, k in counts.items() if a is not atom}
            if n > 2:
                rest[atom] = n - 2
            return sorted_monomial(rest), square
    return sorted_monomial(counts), None


@lru_cache(maxsize=1024)
def _square(atom: Term) -> Polynomial | None:
    """What the square of an atom is, where an identity says so."""
    if isinstance(atom, Prim) and len(atom.args) == 1:
        (inner,) = atom.args
        if atom.op in ("cos", "cosh"):
            other = prim("sin" if atom.op == "cos" else "sinh", inner)
            return {(): 1, ((other, 2),): -1 if atom.op == "cos" else 1}
        if atom.op == "sqrt":
            found = normal(inner)
            return found.top if found is not None and found.whole else None
        if atom.op == "abs":
            found = normal(mul(inner, inner))
            return found.top if found is not None and found.whole else None
    if isinstance(atom, Prim) and atom.op == "hypot":
        found = normal(add(*(mul(a, a) for a in atom.args)))
        return found.top if found is not None and found.whole else None
    return None


def _exponential(node: Prim, inner: Rational) -> Rational:
    """exp of a sum as a product of powers of exp(monomial), and of u for log(u)."""
    if not inner.whole:
        return _atom(node)
    top: dict[Term, int] = {}
    below: dict[Term, int] = {}
    powers = Rational(ONE, ONE)
    for monomial, coefficient in inner.top.items():
        match monomial:
            case ((Prim(op="log", args=(base,)), 1),) if coefficient.denominator == 1:
                powers = _product(powers, _power(_small(normal(base)), int(coefficient)))
                continue
        whole = coefficient.denominator == 1 and size_of(coefficient) <= 64
        scale: Exact = 1 if whole else coefficient
        part = as_term({monomial: size_of(scale)})
        if part is None:
            return _atom(node)
        side = top if (coefficient > 0) else below
        atom = prim("exp", part)
        side[atom] = side.get(atom, 0) + (int(size_of(coefficient)) if whole else 1)
    return _product(powers, Rational({sorted_monomial(top): 1}, {sorted_monomial(below): 1}))
