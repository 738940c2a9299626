"""An integral at parameters for which it is known on which side of some surfaces all of it lies: without these.

Owns `sided`. Where surfaces cut the variables, and meet each other, is found out for all parameters at once,
which takes the longest of all that is made of a program. A pixel that most of a scene passes by needs none of that: an
enclosure tells on which side it lies, and what is left is an integral with few surfaces, or with none. There are as
many such integrals as sides that have been met; after some of them the whole is made, which is for all others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice

from msgspec import Struct

from potto.calculus.algebra.degree import plane
from potto.calculus.differentiation.level_sets import placed_along
from potto.calculus.inlining.expand import Expansion, expanded
from potto.calculus.solving.enclosable import enclosable
from potto.calculus.surfaces.domains import ends_of_domain
from potto.calculus.surfaces.finding import Resolve
from potto.calculus.surfaces.nested_brackets import BINDERS
from potto.core.terms import (
    Branch,
    Deriv,
    Global,
    Integral,
    Lam,
    Term,
    Var,
    children,
    integral,
    outside,
    postorder,
    substitute,
    transform,
)
from potto.integrate.rules.intervals import Interval, enclosure
from potto.kernels.cells import Cell, Value

MOST_LEFT = 16  # integrals that are made of one; each takes as long as the whole would with so few surfaces
MOST_SIDES = 4096  # combinations of sides of one integral of which it is kept what is left
MOST_VARIABLES = 3
MOST_PARTS = 2000  # of an integrand with calls carried out
# Surfaces of so few parts are swept as quickly as looked at. So many are not looked at each time: 90 half planes take
# 12 ms, and what follows from them is kept where one smooth integrand takes another's place.
FEW_PARTS, FEW_OF_PLANES, MOST_SURFACES = 11, 100, 32

Side = tuple[Term, bool]
Box = dict[str, Interval]


class Sided(Struct):
    """An integral, its integrand with calls of functions that jump carried out.

    surfaces: those whose sides can be told, by all calls in them carried out; `ends`: where these stop being defined.
    flat: whether all are affine in each variable by itself. met: what is taken for the integral, by the sides on which
    all of it lies. left: each of these, and sides that are enough for it. last: the parameters that were asked for
    last, and what was left: one call asks up to three times, each of its ways for itself.
    """

    term: Integral
    surfaces: dict[Term, Term]
    ends: dict[Term, tuple[Term, ...]]
    flat: bool
    met: dict[tuple[Side, ...], Integral | None] = {}
    left: dict[Integral, frozenset[Side]] = {}
    last: tuple[Box, Integral | None] | None = None

    def at(self, env: dict[str, Value]) -> Integral | None:
        """What is left of it at these parameters; None if that is all, or is not told apart from others."""
        box = _box(env)
        last = self.last
        if last is None or last[0] != box:
            last = self.last = box, self._within(box)
        return last[1]

    def _within(self, box: Box) -> Integral | None:
        sides = tuple(self._sides(box))
        if sides not in self.met:
            if len(self.met) >= MOST_SIDES:
                return self._known(frozenset(sides))
            self.met[sides] = self._without(sides) if sides else None
        return self.met[sides]

    def _without(self, sides: tuple[Side, ...]) -> Integral | None:
        body = _taken(self.term.body, dict(sides))
        found = integral(self.term.variables, self.term.bounds, body, self.term.hints)
        if found in self.left or len(self.left) < MOST_LEFT:
            self.left.setdefault(found, frozenset(sides))
            return found
        return self._known(frozenset(sides))

    def _known(self, sides: frozenset[Side]) -> Integral | None:
        """Of the integrals that are made the one with the fewest surfaces that is right on these sides."""
        right = [found for found, enough in self.left.items() if enough <= sides]
        return max(right, key=lambda found: len(self.left[found]), default=None)

    def _sides(self, parameters: Box) -> Iterator[Side]:
        """The surfaces of which all of the domain lies on one side, and whether that is the upper one."""
        box = dict(parameters)
        for variable, ends in zip(self.term.variables, self.term.bounds, strict=True):
            if not all(end.free <= box.keys() and enclosable(end) for end in ends):
                return
            (a, b), (c, d) = enclosure(ends, box)
            box[variable] = (min(a, c), max(b, d))
        known = {s: form for s, form in self.surfaces.items() if form.free <= box.keys()}
        every = tuple(dict.fromkeys((*known.values(), *(end for form in known.values() for end in self.ends[form]))))
        found = {term: 1 if low > 0 else -1 if high < 0 else 0
                 for term, (low, high) in zip(every, enclosure(every, box), strict=True)}  # fmt: skip
        for surface, form in known.items():
            if found[form] and all(found[end] for end in self.ends[form]):
                yield surface, found[form] > 0


def _box(env: dict[str, Value]) -> Box:
    """The numbers among parameters, with their errors."""
    box: Box = {}
    for name, value in env.items():
        if isinstance(value, Cell):
            off = 0.0 if value.e is None else value.e
            box[name] = (value.v - off, value.v + off)
    return box


def sided(term: Integral, inline: Resolve) -> Sided | None:
    """An integral with the surfaces whose sides can be told; None where these are so few, or so many, that the whole is
    made as quickly.

    inline: the functions that a call of them may be replaced by.
    """
    many = len(tuple(islice(_branches(term.body), MOST_SURFACES + 1))) > MOST_SURFACES
    if many or len(term.variables) > MOST_VARIABLES or placed_along(term) is not None:
        return None
    jumping = _Jumping(inline)
    passed = {n.name: f for n in postorder(term.body) if isinstance(n, Var) and (f := jumping(n)) is not None}
    body = expanded(substitute(term.body, passed), jumping)
    if len(postorder(body)) > MOST_PARTS:
        return None
    written = {n.name: f for n in postorder(body) if isinstance(n, Var) and (f := inline(n)) is not None}
    surfaces = dict.fromkeys(node.surface for node in _branches(body))
    expansion = Expansion(inline)
    forms = {s: expansion.of(substitute(s, written)) for s in surfaces}
    ends = {form: ends_of_domain(form) for form in forms.values() if enclosable(form)}
    told = {s: form for s, form in forms.items() if form in ends and all(map(enclosable, ends[form]))}
    flat = all(plane(form, (name,)) for form in told.values() for name in term.variables)
    few = FEW_OF_PLANES if flat else FEW_PARTS
    if len(surfaces) > MOST_SURFACES or len(postorder(*told.values())) <= few:
        return None
    return Sided(integral(term.variables, term.bounds, body, term.hints), told, ends, flat)


class _Jumping:
    """The functions that have conditions, or call some that do. Others stay calls: any may take another's place."""

    def __init__(self, resolve: Resolve) -> None:
        self.resolve = resolve
        self.known: dict[Lam | Deriv, bool] = {}

    def __call__(self, head: Term) -> Lam | Deriv | None:
        function = self.resolve(head)
        return function if function is not None and self.jumps(function) else None

    def jumps(self, function: Lam | Deriv) -> bool:
        if function not in self.known:
            self.known[function] = False  # a recursion by itself has none
            nodes = postorder(function)
            called = (self.resolve(node) for node in nodes if isinstance(node, Var | Global))
            self.known[function] = any(isinstance(node, Branch) for node in nodes) or any(
                self.jumps(other) for other in called if other is not None
            )
        return self.known[function]


def _branches(body: Term) -> Iterator[Branch]:
    """The conditions in an integrand."""
    return (node for node in outside(body, BINDERS) if isinstance(node, Branch))


def _taken(body: Term, sides: dict[Term, bool]) -> Term:
    """An integrand with the sides taken that are known."""

    def below(node: Term) -> Sequence[Term]:
        return () if isinstance(node, BINDERS) else children(node)

    def change(node: Term, new: Term) -> Term:
        side = sides.get(node.surface) if isinstance(node, Branch) else None
        return new if side is None or not isinstance(new, Branch) else new.then if side else new.orelse

    return transform(body, change, below)
