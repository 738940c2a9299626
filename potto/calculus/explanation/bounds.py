"""How conditions are written together: two bounds of one thing side by side, and squares as they are.

Owns `bracket`, `between`, `with_squares` and `is_shorter`. What two conditions hold between numbers stands between
them: `-1 < c + x < 0` is c < -x and c + x + 1 > 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from math import gcd, lcm

from msgspec import Struct

from potto.calculus.algebra.rational_form import as_term, normal
from potto.calculus.explanation.brackets import Inequality, constant, multiplied_out
from potto.calculus.explanation.decimals import decimal
from potto.calculus.explanation.squares import root_of_square, squares_in
from potto.core.polynomials import Polynomial, number
from potto.core.printer import format_term, sides_of
from potto.core.terms import ONE, ZERO, Prim, Term, Var, add, branch, const, mul, neg, postorder, pow_, sub

_MONOMIALS = 6  # of what is written anew between its bounds
_LONGER = 4  # characters that a square may cost
_COEFFICIENT = 64  # the largest; multiples of decimal fractions are no plainer


def bracket(known: Sequence[Inequality]) -> Term:
    """1 where all conditions hold, else 0."""
    return _bracket(tuple(known))


@lru_cache(maxsize=1 << 12)
def _bracket(known: tuple[Inequality, ...]) -> Term:
    whole: Term = ONE
    for item in reversed(between(known)):  # the first one is asked first
        whole = branch((item.surface,), item.strict, whole, ZERO)
    return whole


class _Bound(Struct, frozen=True):
    """What a condition says of a polynomial without a constant whose coefficients are integers without a common factor:
    that it is above `number`, or if `turned`, below it. scaled: whether the condition said so of a multiple of it."""

    of: Polynomial
    number: Fraction
    turned: bool
    scaled: bool


def between(known: Sequence[Inequality]) -> list[Inequality]:
    """The same conditions in their order: two bounds of one thing alike and beside each other, the lower one first, so
    that it stands between them; and none of a fraction of anything."""
    bounds = [_bound(item.surface) for item in known]
    found: list[Inequality] = []
    done: set[int] = set()
    for i, bound in enumerate(bounds):
        if i in done:
            continue
        if bound is None:
            others = [j for j in range(i + 1, len(known)) if bounds[j] is None and j not in done]
            paired = next(((j, two) for j in others if (two := _paired(known[i], known[j])) is not None), None)
            found += [known[i]] if paired is None else paired[1]
            done.update([i] if paired is None else [i, paired[0]])
            continue
        alike = [(j, b) for j, b in enumerate(bounds) if b and b.of == bound.of]
        surfaces = {j: _surface(b) if len(alike) > 1 or b.scaled or len(b.of) > 2 else None for j, b in alike}
        for j in [j for j, b in alike if not b.turned] + [j for j, b in alike if b.turned]:
            surface = surfaces[j]
            plain = surface is not None and (len(alike) > 1 or is_shorter(surface, known[j].surface))
            chosen = surface if surface is not None and plain else with_squares(known[j].surface)
            found.append(Inequality(chosen, known[j].strict))
            done.add(j)
    return _in_rows(found) if len(found) > 1 else found


def _in_rows(known: Sequence[Inequality]) -> list[Inequality]:
    """The same in their order, but that a condition whose higher side is the lower one of another stands before that:
    t < x < 0 for x < 0 and t < x."""
    sides = [sides_of(item.surface) for item in known]
    rows: list[list[int]] = []
    for i, (low, high) in enumerate(sides):
        before = next((row for row in rows if sides[row[0]][0] == high), None)
        after = next((row for row in rows if sides[row[-1]][1] == low), None)
        if after is not None:
            after.append(i)
        elif before is not None:
            before.insert(0, i)
        else:
            rows.append([i])
    return [known[i] for row in rows for i in row]


def with_squares(surface: Term) -> Term:
    """c - x^2 - t*x for c - x*(x + t): a square is read as one."""
    products = [part for part in postorder(surface) if isinstance(part, Prim) and part.op == "mul"]
    if not any(_hides_square(part.args) for part in products):
        return surface
    flat = multiplied_out(surface)
    return flat if len(format_term(flat)) <= len(format_term(surface)) + _LONGER else surface


def _hides_square(factors: Sequence[Term]) -> bool:
    names = [arg for arg in factors if isinstance(arg, Var)]
    sums = [arg for arg in factors if isinstance(arg, Prim) and arg.op == "add"]
    return any(name in part.args or neg(name) in part.args for name in names for part in sums)


def is_shorter(surface: Term, other: Term) -> bool:
    """Whether it is as text, where each fraction but one counts as longer."""
    return surface is not other and _length(surface) < _length(other)


def _length(surface: Term) -> int:
    text = format_term(surface)
    return len(text) + max(text.count("/") - 1, 0)


def _paired(first: Inequality, second: Inequality) -> list[Inequality] | None:
    """Two bounds of one thing that is no polynomial: u > 0 and u < 1 for u > 0 and -u > -1; None for two others."""
    total = constant(add(first.surface, second.surface))
    if total is None:
        return None
    args = first.surface.args if isinstance(first.surface, Prim) and first.surface.op == "add" else (first.surface,)
    numbers = [arg for arg in args if constant(arg) is not None]
    thing = add(*(arg for arg in args if arg not in numbers))
    offset = constant(add(*numbers)) or Fraction(0)
    turned = isinstance(thing, Prim) and thing.op == "neg"  # u < offset
    thing = neg(thing) if turned else thing
    low, high = (offset - total, offset) if turned else (-offset, total - offset)
    ends = number(low), number(high)
    if ends[0] is None or ends[1] is None:
        return None
    lower, upper = (second, first) if turned else (first, second)
    return [Inequality(sub(thing, ends[0]), lower.strict), Inequality(sub(ends[1], thing), upper.strict)]


def _bound(surface: Term) -> _Bound | None:
    found = normal(surface)
    if found is None or set(found.below) != {()}:
        return None
    top = {m: decimal(Fraction(c)) / found.below[()] for m, c in found.top.items()}
    offset = top.pop((), Fraction(0))
    if not 0 < len(top) <= _MONOMIALS:
        return None
    scale = Fraction(gcd(*(c.numerator for c in top.values())), lcm(*(c.denominator for c in top.values())))
    below = sum(c < 0 for c in top.values())
    first = min(top, key=lambda m: [(format_term(a), n) for a, n in m])
    turned = 2 * below > len(top) or (2 * below == len(top) and top[first] < 0)
    whole = {m: c / (-scale if turned else scale) for m, c in top.items()}
    if any(abs(c) > _COEFFICIENT for c in whole.values()):
        return None
    return _Bound(whole, (offset if turned else -offset) / scale, turned, scale != 1)


def _surface(bound: _Bound) -> Term | None:
    """It, as what is added against what is taken away and the number."""
    root = root_of_square(bound.of)
    square = None if root is None else as_term(root)
    if square is not None and (bare := number(bound.number)) is not None:
        whole = pow_(square, const(2.0))
        return sub(bare, whole) if bound.turned else sub(whole, bare)
    squares, rest = squares_in({**bound.of, (): -bound.number} if bound.number else bound.of)
    added = _with_squares({m: c for m, c in rest.items() if m and c > 0}, [s for s in squares if s[0] > 0])
    taken = _with_squares(
        {m: -c for m, c in rest.items() if not m or c < 0}, [(-c, root) for c, root in squares if c < 0]
    )
    if added is None or taken is None:
        return None
    return sub(taken, added) if bound.turned else sub(added, taken)


def _with_squares(form: Polynomial, squares: Sequence[tuple[Fraction, Polynomial]]) -> Term | None:
    parts = [as_term(form)]
    for scale, root in squares:
        inner, factor = as_term(root), number(scale)
        parts.append(None if inner is None or factor is None else mul(factor, pow_(inner, const(2.0))))
    return None if any(part is None for part in parts) else add(*(part for part in parts if part is not None))
