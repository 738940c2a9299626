"""Equations in which several arguments contain the variable.

Owns `split`: from such an equation to simpler ones. In this order: factors of a product, both sides under the same
one-to-one builtin, a polynomial in something that contains every occurrence (so that (x - t)^2 + (x - t) is solved
for x - t and keeps its digits), a polynomial in the variable, a sin u + b cos u, squaring a root away, the numerator
of a fraction, and cases for abs, min, max and clamp.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction

from potto.calculus.algebra.fractions import numerator
from potto.calculus.algebra.polynomial_in import Collected, collect, dominators
from potto.calculus.algebra.radicals import minus, quotient, signed, square_root
from potto.calculus.algebra.ranges import range_of
from potto.calculus.algebra.rational_form import is_zero, shorter
from potto.calculus.solving.isolate import Guard, IsolationStep, Steps, Stuck
from potto.core.terms import (
    ONE,
    PI,
    TWO,
    ZERO,
    Const,
    Prim,
    Term,
    Var,
    add,
    branch,
    const,
    div,
    fresh,
    mul,
    neg,
    postorder,
    pow_,
    prim,
    sub,
    substitute,
    transform,
    var,
)
from potto.primitives import PRIMITIVES

Degrees = dict[Fraction, Term]


def split(term: Prim, value: Term, name: str, plain: bool = False) -> Steps:
    """Equations that together have the roots of `term = value`; `plain`: as textbooks write them, whatever cancels."""
    if value is ZERO and term.op == "mul":
        return tuple(IsolationStep(factor, ZERO) for factor in term.args if name in factor.free)
    if term.op == "div":
        top, below = term.args
        return (IsolationStep(top if value is ZERO else sub(top, mul(value, below)), ZERO),)
    if term.op in _SPLIT:
        return _SPLIT[term.op](term, value)
    same = _same_builtin(term, value)
    if same is not None:
        return same
    steps = _polynomial_in_something(term, value, name, plain)
    for method in (_fraction, _cases):
        steps = method(term, value, name) if steps is None else steps
    if steps is not None:
        return steps
    return _why(term, name)


# The same builtin on both sides


def _same_builtin(term: Prim, value: Term) -> Steps | None:
    """f(a) - f(b) = 0 for a one-to-one f: a - b = 0 where both are in f's domain."""
    if term.op != "add" or len(term.args) != 2 or value is not ZERO:
        return None
    first, second = term.args
    other = neg(second)
    if isinstance(first, Prim) and first.op == "neg":
        first, other = first.args[0], second
    if not (isinstance(first, Prim) and isinstance(other, Prim) and first.op == other.op) or len(first.args) != 1:
        return None
    entry = PRIMITIVES.get(first.op)
    if entry is None or not entry.increasing:
        return None
    (a,), (b,) = first.args, other.args
    guards = tuple(Guard(edge) for edge in entry.edges(a))
    return (IsolationStep(sub(a, b), ZERO, guards),)


# Polynomials


def _polynomial_in_something(term: Prim, value: Term, name: str, plain: bool) -> Steps | None:
    whole = sub(term, value)
    for inner in dominators(whole, name):
        if inner is whole or inner is term:
            continue
        hidden = inner.name if isinstance(inner, Var) else fresh("z", whole.free)
        outer = whole if isinstance(inner, Var) else _replaced(whole, inner, var(hidden))
        found = collect(outer, hidden)
        steps = None if found is None else _from_collected(found, hidden, plain)
        if steps is not None:
            back = {} if isinstance(inner, Var) else {hidden: inner}
            return tuple(
                IsolationStep(
                    substitute(s.inner, back),
                    s.value,
                    tuple(Guard(substitute(g.surface, back), g.strict) for g in s.guards),
                    s.period,
                )
                for s in steps
            )
    return None


def _replaced(term: Term, old: Term, new: Term) -> Term:
    """A formula with a part replaced; what is not a builtin in it is not gone into."""

    def below(node: Term) -> tuple[Term, ...]:
        return node.args if isinstance(node, Prim) and node is not old else ()

    return transform(term, lambda node, made: new if node is old else made, below)


def _from_collected(found: Collected, name: str, plain: bool) -> tuple[IsolationStep, ...] | None:
    found = Collected({m: c for m, c in found.parts.items() if not is_zero(c)})
    atoms = found.atoms
    if not atoms:
        return ()  # constant along the variable: no root is isolated
    if len(atoms) == 1:
        (atom,) = atoms
        if name not in atom.free:
            return None
        return _polynomial(found.degrees(atom), atom, plain)
    return _trigonometric(found, plain) or _squared_away(found)


def _polynomial(degrees: Degrees, atom: Term, plain: bool) -> tuple[IsolationStep, ...] | None:
    """Roots of a polynomial in one atom, as atom^d = root for the common step d of its degrees."""
    least = min(degrees)
    unit = _common(d - least for d in degrees)
    if unit is None:
        return None if least == 0 else ((IsolationStep(atom, ZERO),) if least > 0 else ())
    if max(degrees) - least > 2 * unit:
        return None
    coefficients = {int((d - least) / unit): shorter(c) for d, c in degrees.items()}
    steps = [IsolationStep(atom, ZERO)] if least > 0 else []
    inner = atom if unit == 1 else (prim("sqrt", atom) if unit == Fraction(1, 2) else pow_(atom, const(float(unit))))
    highest = max(coefficients)
    if highest == 1:
        root = quotient(minus(coefficients[0]), coefficients[1])  # of two edges of a polygon, their corner
        roots: tuple[Term, ...] = (root if isinstance(coefficients[1], Const) else shorter(root),)
    elif plain:
        roots = quadratic_formula(coefficients[2], coefficients[1], coefficients[0])
    else:
        roots = quadratic(coefficients[2], coefficients[1], coefficients[0], merging=unit == 1)
    return (*steps, *(IsolationStep(inner, r) for r in roots))


def _common(differences: Iterable[Fraction]) -> Fraction | None:
    """The greatest step that all degrees are multiples of."""
    top, scale = 0, 1
    values = [d for d in differences if d]
    if not values:
        return None
    for d in values:
        scale = math.lcm(scale, d.denominator)
    for d in values:
        top = math.gcd(top, int(d * scale))
    return Fraction(top, scale)


def quadratic(a: Term, b: Term, c: Term, merging: bool) -> tuple[Term, Term]:
    """Both roots of a z^2 + b z + c without cancellation; where a is 0, one of them is the root of b z + c. merging:
    whether both are to be told where both are 0."""
    half = halved(b)
    if half is None:
        disc = shorter(sub(pow_(b, TWO), mul(const(4.0), a, c)))
        root = square_root(disc)
        q = signed(b, neg(div(add(b, root), TWO)), div(sub(root, b), TWO))
    else:
        disc = shorter(sub(pow_(half, TWO), mul(a, c)))
        root = square_root(disc)
        q = signed(half, neg(add(half, root)), sub(root, half))
    one, other = quotient(q, a), quotient(c, q)
    if not merging or any(bounds.positive or bounds.negative for bounds in map(range_of, (b, c))):
        return one, other
    return one, branch((neg(prim("abs", q)),), False, one, other)  # where q is 0 both are


def quadratic_formula(a: Term, b: Term, c: Term) -> tuple[Term, Term]:
    """The same by the formula that everybody knows: the lesser first where a is positive, none where it is 0."""
    half = halved(b)
    if half is None:
        root = square_root(shorter(sub(pow_(b, TWO), mul(const(4.0), a, c))))
        return quotient(sub(minus(b), root), mul(TWO, a)), quotient(add(minus(b), root), mul(TWO, a))
    root = square_root(shorter(sub(pow_(half, TWO), mul(a, c))))
    return quotient(sub(minus(half), root), a), quotient(add(minus(half), root), a)


def halved(term: Term) -> Term | None:
    """term / 2 where a factor 2 stands in every summand."""
    if isinstance(term, Prim):
        if term.op == "neg":
            inner = halved(term.args[0])
            return None if inner is None else neg(inner)
        if term.op == "mul" and isinstance(term.args[0], Const) and term.args[0].name is None:
            factor = term.args[0].value / 2
            if factor.is_integer():
                return mul(const(factor), *term.args[1:])
        if term.op == "add":
            parts = [halved(a) for a in term.args]
            whole = [p for p in parts if p is not None]
            return add(*whole) if len(whole) == len(parts) else None
    if isinstance(term, Const) and term.name is None and (term.value / 2).is_integer():
        return const(term.value / 2)
    return None


def _fraction(term: Prim, value: Term, name: str) -> Steps | None:
    """The numerator over a common denominator: where that is 0, a pole is met or nothing at all."""
    top = numerator(sub(term, value), name)
    return None if top is None else (IsolationStep(top, ZERO),)


# Two atoms


def _trigonometric(found: Collected, plain: bool) -> tuple[IsolationStep, ...] | None:
    """Polynomials in sin u and cos u: a sin u + b cos u = c, or one of them after sin^2 + cos^2 = 1."""
    sin = next((a for a in found.atoms if isinstance(a, Prim) and a.op == "sin"), None)
    cos = next((a for a in found.atoms if isinstance(a, Prim) and a.op == "cos"), None)
    if sin is None or cos is None or len(found.atoms) != 2 or sin.args != cos.args:
        return None
    nought, one = Fraction(0), Fraction(1)
    table = {(dict(m).get(sin, nought), dict(m).get(cos, nought)): shorter(c) for m, c in found.parts.items()}
    if set(table) <= {(nought, nought), (one, nought), (nought, one)}:
        a, b, c = table[one, nought], table[nought, one], table.get((nought, nought), ZERO)
        if plain and range_of(a).hi <= 0 and range_of(b).hi <= 0:
            a, b, c = minus(a), minus(b), minus(c)
        turn, size = prim("atan2", a, b), prim("hypot", a, b)
        swing = prim("acos", quotient(minus(c), size))
        period = mul(TWO, PI)
        return tuple(IsolationStep(sin.args[0], add(turn, s), (), period) for s in (swing, neg(swing)))
    for atom, flip in ((cos, False), (sin, True)):
        degrees: dict[Fraction, list[Term]] = {}
        for key, part in table.items():
            square, keep = reversed(key) if flip else key
            if square not in (0, 2):
                break
            degrees.setdefault(keep, []).append(part)
            if square == 2:
                degrees.setdefault(keep + 2, []).append(neg(part))
        else:
            sums = {d: shorter(add(*parts)) for d, parts in degrees.items()}
            return _polynomial({d: c for d, c in sums.items() if not is_zero(c)}, atom, plain)
    return None


def _squared_away(found: Collected) -> tuple[IsolationStep, ...] | None:
    """p + q sqrt(g) = 0 as p^2 - q^2 g = 0, counting only roots where p and q differ in sign."""
    roots = {a for m in found.parts for a, d in m if isinstance(a, Prim) and (a.op == "sqrt" or d.denominator == 2)}
    if len(roots) != 1:
        return None
    (atom,) = roots
    unit = Fraction(1) if isinstance(atom, Prim) and atom.op == "sqrt" else Fraction(1, 2)
    inside = atom.args[0] if isinstance(atom, Prim) and unit == 1 else atom
    rest: list[Term] = []
    factor: list[Term] = []
    for monomial, part in found.parts.items():
        degree = dict(monomial).get(atom, Fraction(0)) / unit
        if degree.denominator != 1:
            return None
        others = [pow_(a, const(float(d))) for a, d in monomial if a is not atom]
        here = mul(part, *others, pow_(inside, const(int(degree) // 2)) if degree // 2 else ONE)
        (factor if degree % 2 else rest).append(here)
    p, q = add(*rest), add(*factor)
    return (IsolationStep(sub(pow_(p, TWO), mul(pow_(q, TWO), inside)), ZERO, (Guard(neg(mul(p, q))),)),)


# Cases


def _max(term: Prim, value: Term) -> Steps:
    return _pieces(term, value, 1, value)


def _min(term: Prim, value: Term) -> Steps:
    return _pieces(term, value, -1, value)


def _pieces(term: Prim, value: Term, sign: int, level: Term | None = None) -> tuple[IsolationStep, ...]:
    """One step for each argument of min or max, where it is the one that counts (and so equal to `level`).

    Where two of them are equal both count: a root at the kink is two roots that meet there.
    """
    steps: list[IsolationStep] = []
    for i, piece in enumerate(term.args):
        here = piece if level is None else level
        guards = tuple(
            Guard(sub(here, other) if sign > 0 else sub(other, here)) for j, other in enumerate(term.args) if j != i
        )
        steps.append(IsolationStep(piece, value, guards))
    return tuple(steps)


def _clamp(term: Prim, value: Term) -> tuple[IsolationStep, ...]:
    x, lo, hi = term.args
    return (
        IsolationStep(x, value, (Guard(sub(x, lo)), Guard(sub(hi, x)))),
        IsolationStep(lo, value, (Guard(sub(lo, x)),)),
        IsolationStep(hi, value, (Guard(sub(x, hi)),)),
    )


def _hypot(term: Prim, value: Term) -> Steps:
    a, b = term.args
    return (IsolationStep(add(pow_(a, TWO), pow_(b, TWO)), pow_(value, TWO), (Guard(value),)),)


def _atan2(term: Prim, value: Term) -> Steps:
    y, x = term.args
    sin, cos = prim("sin", value), prim("cos", value)
    guards = (Guard(add(mul(x, cos), mul(y, sin)), True), Guard(sub(PI, value)), Guard(add(PI, value)))
    return (IsolationStep(sub(mul(y, cos), mul(x, sin)), ZERO, guards),)


_SPLIT: Mapping[str, Callable[[Prim, Term], Steps]] = {
    "max": _max,
    "min": _min,
    "clamp": _clamp,
    "hypot": _hypot,
    "atan2": _atan2,
}


def _cases(term: Prim, value: Term, name: str) -> Steps | None:
    """abs, min, max, clamp or hypot somewhere inside: one equation for each of their cases."""
    for node in postorder(term):
        if not isinstance(node, Prim) or name not in node.free:
            continue
        pieces = _pieces_of(node)
        if pieces is not None:
            return tuple(IsolationStep(_replaced(term, node, piece), value, guards) for piece, guards in pieces)
    return None


def _pieces_of(node: Prim) -> list[tuple[Term, tuple[Guard, ...]]] | None:
    match node.op:
        case "abs":
            (inner,) = node.args
            return [(inner, (Guard(inner),)), (neg(inner), (Guard(neg(inner)),))]
        case "max" | "min":
            steps = _pieces(node, ZERO, 1 if node.op == "max" else -1)
        case "clamp":
            steps = _clamp(node, ZERO)
        case "hypot":
            a, b = node.args
            return [(prim("sqrt", add(pow_(a, TWO), pow_(b, TWO))), ())]
        case _:
            return None
    return [(s.inner, s.guards) for s in steps]


# Reasons


def _why(term: Prim, name: str) -> Stuck:
    found = collect(term, name)
    if found is None:
        return Stuck(f"`{name}` occurs too often to collect")
    atoms = sorted(found.atoms, key=lambda a: (not isinstance(a, Var), a.digest))
    if len(atoms) == 1:
        shown = _show(atoms[0], name)
        highest = max(found.degrees(atoms[0]))
        return Stuck(f"it is a polynomial of degree {highest} in {shown}, and roots are known up to degree 2")
    shown = " and in ".join(_show(a, name) for a in atoms[:3])
    return Stuck(f"`{name}` occurs in {shown}, which no single inverse undoes")


def _show(atom: Term, name: str) -> str:
    if isinstance(atom, Var):
        return f"`{name}` itself"
    return f"`{atom.op}(...)`" if isinstance(atom, Prim) else "a function"
