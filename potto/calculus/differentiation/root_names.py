"""Names for the roots of quadratic equations, of which a shown formula then speaks as a person would.

Owns `RootNames`, `NamedRoot` and `names_in`. At a root u of a u^2 + b u + c the surface rises by the root of the
discriminant D or falls by it, so that u moves by (u^2 da + u db + dc)/sqrt(D), up to its sign: both roots share all but
their place. Where u is exp(x), or another function of the variable x, x moves by dx/du times that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from itertools import count
from math import inf, nextafter

from msgspec import Struct

from potto.calculus.algebra.polynomial_in import collect
from potto.calculus.algebra.ranges import Box, range_of
from potto.calculus.algebra.rational_form import is_zero, normal
from potto.calculus.differentiation.derivative import partial
from potto.calculus.solving.pivots import SurfaceRoot
from potto.calculus.surfaces.branch_assignment import Flip, unguarded
from potto.core.simplify import normalized_surface
from potto.core.terms import (
    NAN,
    ZERO,
    Branch,
    Global,
    Prim,
    Term,
    Var,
    add,
    bound_names,
    const,
    div,
    mul,
    postorder,
    pow_,
    prim,
    stem,
    sub,
    substitute,
    transform,
    var,
)
from potto.primitives import PRIMITIVES


class NamedRoot(Struct, frozen=True):
    """at: where the root is, by the names, as what `inner` has there is. exists: what is positive where there are two.
    moves: the root of that times how far it moves as the surface falls by 1. side: the sign of the surface just right
    of it; 0 where not known."""

    surface: Term
    variable: str
    at: Term
    inner: Term
    value: Term
    exists: Term
    moves: Term
    side: int

    def placed(self, term: Term) -> Term:
        """What a term is there."""
        plain = transform(term, lambda _, new: self.value if new is self.inner else new)
        return substitute(plain, {self.variable: self.at})

    def told(self, flip: Flip) -> Flip:
        """A branch that flips there, with the signs that follow from the square root being positive."""
        surface, side = normalized_surface(flip.branch.surface)
        right = self.side * side
        return flip if surface is not self.surface or not right else Flip(flip.branch, const(-right), const(right))


class RootNames(Struct):
    """The names that one derivative gives, what each stands for, by earlier ones, and the names that are `taken`.

    tangents: those of the parameters. A root has a name only where it depends on nothing else.
    """

    tangents: Mapping[str, Term]
    taken: set[str]
    meanings: dict[str, Term] = {}

    def along(self, moving: Mapping[str, Term]) -> Callable[[Term, SurfaceRoot], NamedRoot | None]:
        """What names the roots of an integral, around which `moving` are the tangents."""
        own = frozenset(name for name, tangent in self.tangents.items() if moving.get(name) is tangent)
        return lambda surface, root: self._of(surface, root, own)

    def _of(self, surface: Term, root: SurfaceRoot, own: frozenset[str]) -> NamedRoot | None:
        """A root by its name, where it is one of two that no plain square root tells; `own`: what it may depend on."""
        found = _quadratic(surface, root)
        if found is None or not found.value.free <= own:
            return None
        (inside,) = found.radical.args
        known = self._named("D", inside) if _is_sum(inside) else inside
        shown = transform(found.value, lambda _, new: prim("sqrt", known) if new is found.radical else new)
        base = stem(root.variable) if found.place is _U else "u"
        name = self._named(base, shown, numbered=True)
        named = {_U.name: name}
        pace = partial(unguarded(found.place), _U.name)
        rise = range_of(pace, _domain(found.place))
        side = (rise.lo >= 0) - (rise.hi <= 0)
        return NamedRoot(
            surface,
            root.variable,
            substitute(found.place, named),
            found.inner,
            name,
            known,
            substitute(div(pace, const(found.slope)), named),
            side if found.slope > 0 else -side,
        )

    def used_in(self, term: Term) -> Iterator[tuple[str, Term]]:
        """The names in a term with what they stand for, each before those that it is in."""
        wanted = set(term.free)
        for name in reversed(self.meanings):
            if name in wanted:
                wanted |= self.meanings[name].free
        return ((name, meant) for name, meant in self.meanings.items() if name in wanted)

    def _named(self, base: str, meant: Term, numbered: bool = False) -> Term:
        known = next((name for name, other in self.meanings.items() if other is meant), None)
        if known is None:
            names = (f"{base}{n or ''}" for n in count(int(numbered)))
            known = next(name for name in names if name not in self.taken)
            self.taken.add(known)
            self.meanings[known] = meant
        return var(known)


def names_in(term: Term) -> set[str]:
    """What no root may be called beside a term: its names, also of functions and of what is bound, and tangents."""
    found: set[str] = set()
    for node in postorder(term):
        for name in (node.name,) if isinstance(node, Var | Global) else bound_names(node):
            found |= {name, stem(name), f"d{name}"}
    return found


class _Quadratic(Struct, frozen=True):
    """A root as a `place` that depends on `_U`: there `inner` has a `value` with the square root `radical` of the
    discriminant. slope: by how many times that the surface rises along `_U`."""

    inner: Term
    place: Term
    value: Term
    radical: Prim
    slope: float


_U = var("u'")  # the root of the quadratic equation: no program writes this


def _quadratic(surface: Term, root: SurfaceRoot) -> _Quadratic | None:
    """A root as that of a quadratic equation in a function of the variable, if it is one."""
    found = collect(surface, root.variable)
    whole = unguarded(root.at)
    radical = next((n for n in postorder(whole) if isinstance(n, Prim) and n.op == "sqrt"), None)
    if found is None or len(found.atoms) != 1 or radical is None:
        return None
    (atom,) = found.atoms
    degrees = found.degrees(atom)
    degree = max(degrees) / 2
    if not {degree, 2 * degree} <= set(degrees) <= {Fraction(0), degree, 2 * degree}:
        return None
    value = _outermost_fraction(whole, radical)
    place = transform(root.at, lambda _, new: _U if new is value else new)
    slope = _ratio(add(mul(const(2.0), degrees[2 * degree], value), degrees[degree]), radical)
    inner = prim("sqrt", atom) if degree == Fraction(1, 2) else pow_(atom, const(float(degree)))
    turned = unguarded(place) if root.index is None else substitute(unguarded(place), {root.index: ZERO})
    if slope is None or radical in postorder(place) or not _inverts(inner, root.variable, turned):
        return None
    return _Quadratic(inner, place, value, radical, slope)


def _inverts(inner: Term, variable: str, place: Term) -> bool:
    """Whether a place is one where `inner` is `_U`, wherever it is a number."""
    return is_zero(sub(substitute(inner, {variable: place}), _U))


def _outermost_fraction(term: Term, radical: Term) -> Term:
    """The largest part of a term that is a fraction of sums and products of a square root in it."""
    value = radical
    for node in postorder(term):
        if isinstance(node, Prim) and node.op in ("add", "neg", "mul", "div") and value in node.args:
            value = node
    return value


def _domain(place: Term) -> Box:
    """Between which numbers what a place depends on lies: at an end of its own domain a function may be infinite."""
    low, high = -inf, inf
    for node in postorder(place):
        if isinstance(node, Prim) and node.args[-1] is _U:
            least, most = PRIMITIVES[node.op].within
            low, high = max(low, least), min(high, most)
        elif isinstance(node, Branch) and node.orelse is NAN and node.surface is _U:
            low = max(low, 0.0)
    return {_U.name: (nextafter(low, inf), nextafter(high, -inf))}


def _is_sum(term: Term) -> bool:
    return isinstance(term, Prim) and term.op == "add"


def _ratio(term: Term, of: Term) -> float | None:
    """What number of times it is, if it is one."""
    found = normal(div(term, of))
    if found is None or set(found.top) != {()} or set(found.below) != {()}:
        return None
    return float(found.top[()] / found.below[()])
