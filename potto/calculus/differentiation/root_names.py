"""Names for the roots of quadratic equations, of which a shown formula then speaks as a person would.

Owns `RootNames`, `NamedRoot` and `names_in`. At a root x of a x^2 + b x + c the surface rises by the root of the
discriminant D or falls by it, so that x moves by (x^2 da + x db + dc)/sqrt(D), up to its sign: both roots share all but
their place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import count

from msgspec import Struct

from potto.calculus.algebra.rational_form import normal
from potto.calculus.differentiation.derivative import partial
from potto.calculus.solving.pivots import SurfaceRoot
from potto.calculus.surfaces.branch_assignment import Flip, unguarded
from potto.core.terms import (
    Global,
    Prim,
    Term,
    Var,
    bound_names,
    const,
    div,
    postorder,
    prim,
    stem,
    substitute,
    transform,
    var,
)


class NamedRoot(Struct, frozen=True):
    """at: the name of a root. exists: what is positive where there are two. rise: how many times the root of that the
    surface rises by there; radical: this root, with nothing named."""

    at: Term
    exists: Term
    rise: Term
    radical: Term

    def told(self, flip: Flip) -> Flip:
        """A branch that flips there, with the signs that follow from the radical being positive."""
        left, right = _ratio(flip.left, self.radical), _ratio(flip.right, self.radical)
        return flip if left is None or right is None else Flip(flip.branch, const(left), const(right))


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
        place = unguarded(root.at)
        roots = {node for node in postorder(place) if isinstance(node, Prim) and node.op == "sqrt"}
        if root.index is not None or len(roots) != 1 or not place.free <= own:
            return None
        (radical,) = roots
        (inside,) = radical.args
        rise = _ratio(substitute(partial(surface, root.variable), {root.variable: place}), radical)
        if rise is None or not _has_other_summands(place, radical):
            return None
        known = self._named("D", inside) if _is_sum(inside) else inside
        shown = transform(place, lambda _, new: prim("sqrt", known) if new is radical else new)
        return NamedRoot(self._named(stem(root.variable), shown, numbered=True), known, const(rise), radical)

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


def _is_sum(term: Term) -> bool:
    return isinstance(term, Prim) and term.op == "add"


def _ratio(term: Term, of: Term) -> float | None:
    """What number of times it is, if it is one."""
    found = normal(div(term, of))
    if found is None or set(found.top) != {()} or set(found.below) != {()}:
        return None
    return float(found.top[()] / found.below[()])


def _has_other_summands(place: Term, radical: Term) -> bool:
    """Whether it is not just a multiple of the square root."""
    found = normal(place)
    return found is not None and any(all(atom is not radical for atom, _ in monomial) for monomial in found.top)
