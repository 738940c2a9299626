"""What a formula divides by, where what it is the derivative of does not.

Owns `divided_by`. The roots of a x^2 + b x + c are told by a fraction with a below: where a is 0 the formula has no
value, though the integral over [a x^2 + b x + c < 0] has a derivative there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations

from potto.calculus.algebra.ranges import range_of
from potto.calculus.explanation.brackets import Inequality, conditions, implies
from potto.calculus.explanation.factors import factored
from potto.calculus.explanation.symbols import Formula, Words
from potto.core.simplify import normalized_surface
from potto.core.terms import Branch, Const, If, Prim, Proj, Term, Var, add, children, neg, postorder, prim, sub
from potto.primitives import PRIMITIVES

Known = tuple[Inequality, ...]


def divided_by(
    formula: Formula, original: tuple[Term, ...], conditions: Iterable[Term], words: Words
) -> tuple[str, ...]:
    """What a formula divides by, as text, where `original`, what it is the derivative of, does not; `conditions`: where
    that has a value."""
    less = [c.args for c in conditions if isinstance(c, Prim) and c.op == "lt"]
    known = tuple([Inequality(sub(right, left), True) for left, right in less])
    names = words.names - words.tangents
    found = [divisor for term in formula.terms for divisor in _divisors(term, names, original, known)]
    return tuple(dict.fromkeys(map(words.plain, found)))


def _divisors(formula: Term, names: frozenset[str], original: Iterable[Term], known: Known) -> tuple[Term, ...]:
    """Terms in `names` by which a formula divides at places where nothing keeps them from 0, though the `original`
    ones neither divide by them nor have a root or logarithm of them. known: what holds wherever there is a value."""
    found: dict[Term, Term] = {}
    for term, held in _divided(formula, known):
        for base, n in factored(term).powers.items():
            whole = n > 0 and n.denominator == 1  # where a root is 0 that it divides by, there is no derivative either
            inner = _zero_of(base)
            apart = whole and inner.free and inner.free <= names and _is_plain(inner) and range_of(inner).zero
            if apart and not _keep_apart(held, inner):
                found.setdefault(normalized_surface(inner)[0], inner)
    if not found:
        return ()
    singular = {normalized_surface(base)[0] for term in original for base in _singular(term)}
    return tuple([base for canonical, base in found.items() if canonical not in singular])


def _zero_of(base: Term) -> Term:
    """What is 0 where a size, or a power with a fraction for its exponent, is."""
    match base:
        case Prim(op="abs", args=(inner,)):
            return inner
        case Prim(op="pow", args=(inner, power)) if not power.free:
            return _zero_of(inner)
        case _:
            return base


def _is_plain(term: Term) -> bool:
    """Whether a reader sees where it is 0."""
    return all(isinstance(node, Const | Var | Prim | Proj) for node in postorder(term))


def _divided(term: Term, known: Known) -> Iterator[tuple[Term, Known]]:
    """All divisors in a term, each with the conditions that hold where it is asked for."""
    waiting, done = [(term, known)], set[tuple[Term, Known]]()
    while waiting:
        node, held = waiting.pop()
        if (node, held) in done:
            continue
        done.add((node, held))
        if isinstance(node, Prim) and node.op == "div":
            yield node.args[1], held
        if isinstance(node, Prim) and node.op == "mul":
            held = (*held, *(item for arg in node.args for item in conditions(arg) or ()))
        if isinstance(node, If) and isinstance(node.condition, Prim) and node.condition.op in ("lt", "le"):
            less, more = node.condition.args  # of two slopes the greater: where both are 0 there is no surface
            inside, outside = (*held, Inequality(sub(more, less), True)), (*held, Inequality(sub(less, more), True))
            waiting += [(node.condition, held), (node.then, inside), (node.orelse, outside)]
        elif isinstance(node, Branch) and len(node.coordinates) == 1:
            inside = (*held, Inequality(node.surface, node.strict))
            outside = (*held, Inequality(neg(node.surface), not node.strict))
            others = conditions(node) or ()
            waiting += [(node.then, inside), (node.orelse, outside), (node.surface, (*held, *others))]
        else:
            waiting += [(part, held) for part in children(node)]


def _keep_apart(held: Known, base: Term) -> bool:
    """Whether conditions hold nowhere where a term is 0, one by itself or two together: 0 < t < v."""
    strict = dict.fromkeys(item.surface for item in held if item.strict)
    both = [Inequality(add(first, second), True) for first, second in combinations(strict, 2)]
    return any(_keeps_apart(item, base) for item in (*held, *both))


def _keeps_apart(item: Inequality, base: Term) -> bool:
    """Whether a condition holds nowhere where a term is 0."""
    size = prim("abs", base)
    factor = item.strict and factored(item.surface).powers.get(base, 0) > 0
    return factor or any(implies(item, Inequality(signed, True)) for signed in (base, neg(base), size))


def _singular(term: Term) -> Iterator[Term]:
    """Factors of what a term divides by, or has a root or logarithm of."""
    for node in postorder(term):
        if not isinstance(node, Prim):
            continue
        below = node.args[-1:] if node.op == "div" else node.args if _has_ends(node) else ()
        for part in below:
            yield from factored(part).powers


def _has_ends(node: Prim) -> bool:
    return node.op in ("pow", "abs", "hypot") or PRIMITIVES[node.op].within != (float("-inf"), float("inf"))
