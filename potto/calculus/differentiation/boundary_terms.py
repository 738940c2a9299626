"""What an integral gains as its surfaces and bounds move, in closed form.

Owns `at_surfaces`, `at_bounds`, `jumps` and `identically_zero`. At a root r of a surface in one variable of integration
the integral gains (F left of r - F right of r) dr: the whole integrand, with every branch that flips at r forced to its
side and every other one as it falls there; no product rule, no value of a bracket on its own edge. A bound gains the
integrand just inside it. The terms are integrals over the variables that remain, with the bounds of the eliminated one
as brackets, so that they can be differentiated again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from msgspec import Struct

from potto.calculus.algebra.ranges import Box
from potto.calculus.algebra.rational_form import is_zero
from potto.calculus.differentiation.between import between, scaled
from potto.calculus.differentiation.derivative import partial, total, vanishes, zero_like
from potto.calculus.differentiation.root_names import NamedRoot
from potto.calculus.solving.pivots import NoClosedForm as NoClosedForm
from potto.calculus.solving.pivots import Roots, SurfaceRoot, chosen, conjunction, pivots
from potto.calculus.solving.solve import factors
from potto.calculus.surfaces.branch_assignment import (
    NOWHERE,
    Flip,
    Flips,
    Loop,
    box_of,
    branches_of,
    flipping,
    forced,
    loops_over,
    side_of,
    unguarded,
)
from potto.core.simplify import normalized_surface
from potto.core.terms import (
    NAN,
    ONE,
    ZERO,
    Branch,
    Const,
    Integral,
    Prim,
    Sum,
    Term,
    Tuple,
    add,
    branch,
    children,
    const,
    delta,
    div,
    fresh,
    if_,
    integral,
    mul,
    neg,
    postorder,
    prim,
    proj,
    sub,
    substitute,
    sum_,
    transform,
    tuple_,
    var,
    with_integrand,
)

Rate = Callable[[Term], Term]
Name = Callable[[Term, SurfaceRoot], NamedRoot | None]  # of a root of a surface, if it has one


def at_surfaces(node: Integral, moving: frozenset[str], rate: Rate, wanted: Roots, name: Name | None) -> list[Term]:
    """The boundary terms of an integral, one for each root of each surface that moves; over a level set, as an integral
    of a delta, where roots have no closed form that is `wanted`. name: what roots are called where not by their place.
    """
    branches = branches_of(node.body, node.variables)
    surfaces: dict[Term, list[Branch]] = {}
    for item in branches:
        for surface, _ in map(normalized_surface, factors(item.surface)):  # without what cancels, as in x*(t - t)
            if surface.free & frozenset(node.variables) and surface.free & moving:
                surfaces.setdefault(surface, []).append(item)
    terms: list[Term] = []
    met: list[SurfaceRoot] = []
    for surface, members in surfaces.items():
        try:
            terms += _at_surface(node, surface, members, branches, met, rate, wanted, name)
        except NoClosedForm:
            terms += _over_level_set(node, surface, members, rate)
    return [term for term in terms if not vanishes(term)]


def _at_surface(
    node: Integral, surface: Term, members: Sequence[Branch], branches: list[Branch], met: list[SurfaceRoot],
    rate: Rate, wanted: Roots, name: Name | None,
) -> list[Term]:  # fmt: skip
    """The boundary terms of a surface at its roots, but those already met; under loops each instance of it has a pivot
    of its own. Raises NoClosedForm."""
    loops, zero = loops_over(node.body, members[0]), zero_like(node.body)
    alternatives: list[tuple[Term | None, Term]] = []
    apart: list[Term] = []
    earlier: list[Term] = []
    for pivot in pivots(node, surface, wanted):
        new = [r for r in pivot.roots if not any(_same(r, other) for other in met)]
        where = earlier if pivot.condition is None else [*earlier, pivot.condition]
        each = where if any(loop.variable in term.free for loop in loops for term in where) else []
        gains: list[Term] = []
        calls = [] if name is None or loops or where or zero is not ZERO else [name(surface, root) for root in new]
        exists = {root.exists for root in calls if root is not None}
        alike = len(exists) == 1 and None not in calls
        for place, root in enumerate(new):
            flips: Flips = flipping(branches, root.variable, root.at, members)
            exactly = wanted is Roots.READ  # where numbers are rounded, that a fall is 0 shows in exact ones alone
            called = calls[place] if alike else None
            speed = rate(root.at)
            if called is not None:
                flips = [called.told(flip) for flip in flips]
                speed = neg(mul(called.placed(rate(surface)), called.moves))
            gains += _at_root(node, flips, root, speed, called, loops, each, exactly)
        if alike and gains:
            (positive,) = exists
            gains = [branch((positive,), True, div(add(*gains), prim("sqrt", positive)), ZERO)]
        met += new
        if each:
            apart += gains
        else:
            alternatives.append((pivot.condition, total(gains, zero)))
        if pivot.condition is not None:
            earlier = [*earlier, prim("not", pivot.condition)]
    return [*apart, chosen(alternatives)] if alternatives else apart


def _over_level_set(node: Integral, surface: Term, members: Sequence[Branch], rate: Rate) -> Iterator[Term]:
    """The jump at a surface, integrated over it."""
    item = _jump_at(node.body, surface, [(b, _side(b.surface, surface, node.variables)) for b in members], rate)
    if item is not None:
        yield with_integrand(node, item.contribution)


def _side(product: Term, factor: Term, variables: Iterable[str]) -> Term:
    """A term with the sign of a product just where one of its factors turns positive: that of how both rise."""
    whole, key = normalized_surface(product), normalized_surface(factor)
    if whole[0] is key[0]:
        return const(whole[1] * key[1])
    return add(*(mul(partial(product, name), partial(factor, name)) for name in variables if name in factor.free))


def _same(root: SurfaceRoot, other: SurfaceRoot) -> bool:
    if root.variable != other.variable or (root.index is None) != (other.index is None):
        return False
    return is_zero(sub(unguarded(root.at), unguarded(other.at))) and not _apart(root.at, other.at)


def _apart(first: Term, second: Term) -> bool:
    """Whether one exists only where the other does not: each solves the equation of a root for one of its signs."""
    known = {normalized_surface(surface) for surface in _guards(first)}
    return any((canonical, -side) in known for canonical, side in map(normalized_surface, _guards(second)))


def _guards(at: Term) -> list[Term]:
    return [n.surface for n in postorder(at) if isinstance(n, Branch) and n.orelse is NAN]


def _at_root(
    node: Integral, flips: Flips, root: SurfaceRoot, speed: Term, called: NamedRoot | None, sums: list[Loop],
    where: Sequence[Term], exactly: bool,
) -> Iterator[Term]:  # fmt: skip
    """What is gained at a root, for those instances of it for which some conditions hold."""
    if speed is ZERO:
        return
    instances = _instances(node.body, sums, root.at.free)
    falling = _fall(node.body, flips, sums, instances, box_of(node))
    fall = substitute(falling, {root.variable: root.at})
    if vanishes(fall) or (exactly and identically_zero(fall)):
        return
    at = root.at if called is None else called.at
    gain = scaled(fall if called is None else called.placed(falling), speed)
    lo, hi = node.bounds[node.variables.index(root.variable)]
    gain = between(at, lo, hi, gain)
    if root.index is not None and root.counts is not None:
        gain = sum_(root.index, *root.counts, gain)
    if where:
        gain = if_(conjunction(where), gain, zero_like(gain))
    gain = substitute(gain, instances)
    for old in sums:
        gain = sum_(_name(instances[old.variable]), *_ends(old, instances), gain)
    yield remaining(node, root.variable, at, gain)


def _ends(loop: Loop, instances: Mapping[str, Term]) -> tuple[Term, Term]:
    """From where to where a loop goes for the instances of those around it."""
    return substitute(loop.lo, instances), substitute(loop.hi, instances)


def _name(term: Term) -> str:
    (name,) = term.free
    return name


def _instances(body: Term, sums: list[Loop], used: Iterable[str] = ()) -> dict[str, Term]:
    """For the index of each loop around a branch a name for the one value at which the branch flips."""
    taken = {n for t in postorder(body) for n in t.free} | {s.variable for s in sums} | set(used) if sums else set()
    names: dict[str, Term] = {}
    for item in sums:
        name = fresh(item.variable, taken)
        taken.add(name)
        names[item.variable] = var(name)
    return names


def _fall(body: Term, flips: Flips, sums: list[Loop], instances: Mapping[str, Term], box: Box) -> Term:
    """The integrand left of where the branches flip, less that right of it: under loops, of one instance of them."""
    if not sums:
        return difference(forced(body, flips, False, box), forced(body, flips, True, box))
    found = _linear_fall(body, flips, [loop.variable for loop in sums], box)
    if found is not None:
        return substitute(found, instances)
    here = conjunction(prim("eq", var(s.variable), instances[s.variable]) for s in sums)

    def side(right: bool) -> Term:
        signs = {f.branch: f.right if right else f.left for f in flips}

        def change(node: Term, new: Term) -> Term:
            if isinstance(node, Branch) and node in signs and isinstance(new, Branch):
                # Asked there it would be 0: so it is another number there, and not another branch beside it.
                sign = side_of(substitute(signs[node], instances), ONE, neg(ONE), box)
                return branch((if_(here, sign, new.surface),), new.strict, new.then, new.orelse)
            return new

        return transform(body, change)

    return difference(side(False), side(True))


def _linear_fall(node: Term, flips: Flips, around: list[str], box: Box) -> Term | None:
    """How much a term falls where one instance flips, if it is linear in the loops around that: the others go out."""
    flipped = {flip.branch for flip in flips}
    if flipped.isdisjoint(postorder(node)):
        return zero_like(node)
    if not around:
        return difference(forced(node, flips, False, box), forced(node, flips, True, box))
    parts = children(node)
    moved = [part for part in parts if not flipped.isdisjoint(postorder(part))]

    def below(part: Term) -> Term | None:
        return _linear_fall(part, flips, around, box)

    match node:
        case Sum() if node.variable in around and moved == [node.body]:
            return _linear_fall(node.body, flips, [name for name in around if name != node.variable], box)
        case Prim(op="add" | "neg"):
            falls = [fall for fall in map(below, moved) if fall is not None]
            whole = add(*falls) if len(falls) == len(moved) else None
            return whole if whole is None or node.op == "add" else neg(whole)
        case Prim(op="mul") if len(moved) == 1:
            fall = below(moved[0])
            return None if fall is None else scaled(fall, mul(*(part for part in parts if part is not moved[0])))
        case _:
            return None


def at_bounds(node: Integral, rate: Rate) -> list[Term]:
    """Leibniz's rule: what enters or leaves at bounds that move, taken just inside them."""
    terms: list[Term] = []
    branches = branches_of(node.body, node.variables)
    for name, (lo, hi) in zip(node.variables, node.bounds, strict=True):
        for bound, other, upper in ((hi, lo, True), (lo, hi, False)):
            speed = rate(bound)
            if speed is ZERO:
                continue
            # Inside is left of an upper bound that is above the lower one, and of a lower bound that is above.
            flips = flipping(branches, name, bound)
            left, right = (forced(node.body, flips, side) for side in (False, True))
            inside = left if left is right else side_of(sub(bound, other), left, right)
            gain = scaled(substitute(inside, {name: bound}), speed if upper else neg(speed))
            terms.append(remaining(node, name, bound, gain))
    return terms


# Building


def remaining(node: Integral, name: str, at: Term, body: Term) -> Term:
    """The integral over the other variables, with this one put at a place."""
    position = node.variables.index(name)
    later = frozenset(node.variables[position + 1 :])
    names, bounds, hints = [], [], []
    for k, (v, (lo, hi), points) in enumerate(zip(node.variables, node.bounds, node.hints, strict=True)):
        if k == position:
            continue
        if k > position and any(name in t.free for t in (lo, hi)) and at.free & later:
            raise NoClosedForm(f"the bounds of `{v}` depend on `{name}`, and where it is depends on `{v}`")
        place = {name: at} if k > position else {}
        names.append(v)
        bounds.append((substitute(lo, place), substitute(hi, place)))
        hints.append(tuple(substitute(p, place) for p in points))
    if isinstance(body, Const) and body.value == 0:
        return ZERO
    return integral(tuple(names), tuple(bounds), body, tuple(hints)) if names else body


def difference(a: Term, b: Term) -> Term:
    """a - b, for numbers and for tuples."""
    zero = zero_like(a)
    if isinstance(zero, Tuple):
        return tuple_(difference(proj(a, i), proj(b, i)) for i in range(len(zero.items)))
    return ZERO if a is b else sub(a, b)


def identically_zero(term: Term) -> bool:
    """Whether a number, or each of a tuple, is 0 wherever it exists. False also where that is not known."""
    zero = zero_like(term)
    if isinstance(zero, Tuple):
        return all(identically_zero(proj(term, i)) for i in range(len(zero.items)))
    return is_zero(term)


# Without an integral


class JumpTerm(Struct, frozen=True):
    """What a surface contributes to the derivative of an integrand: jump * rate * delta(surface), for each value of the
    indices of `sums`."""

    surface: Term
    jump: Term
    rate: Term
    sums: tuple[tuple[str, Term, Term], ...] = ()

    @property
    def contribution(self) -> Term:
        """All of it."""
        found = scaled(self.jump, mul(delta((self.surface,)), self.rate))
        for name, lo, hi in self.sums:
            found = sum_(name, lo, hi, found)
        return found


def jumps(body: Term, variables: Iterable[str], rate: Rate, within: tuple[Term, ...] = ()) -> list[JumpTerm]:
    """The distribution part of the derivative of an integrand, surface by surface; coincident ones as one. within: what
    rates are made of that may jump as well: there it is the jump of the integrand times the rate that counts."""
    groups: dict[Term, list[Branch]] = {}
    for item in branches_of(tuple_((body, *within)), variables):
        groups.setdefault(normalized_surface(item.surface)[0], []).append(item)
    both = frozenset(postorder(*within))
    found: list[JumpTerm] = []
    for members in groups.values():
        surface = members[0].surface
        sides = [(b, _side(b.surface, surface, ())) for b in members]
        if both.isdisjoint(members):
            jump = _jump_at(body, surface, sides, rate)
        else:
            jump = _jump_at(scaled(body, rate(surface)), surface, sides, lambda _: ONE)
        found += [] if jump is None else [jump]
    return found


def _jump_at(body: Term, surface: Term, members: Sequence[tuple[Branch, Term]], rate: Rate) -> JumpTerm | None:
    """What a surface contributes: branches, with the signs of their surfaces where this one turns positive."""
    speed = rate(surface)
    if speed is ZERO:
        return None
    sums = loops_over(body, members[0][0])
    instances = _instances(body, sums)
    jump = _fall(body, [Flip(b, side, neg(side)) for b, side in members], sums, instances, NOWHERE)
    if vanishes(jump):
        return None
    over = tuple((_name(instances[s.variable]), *_ends(s, instances)) for s in sums)
    return JumpTerm(substitute(surface, instances), jump, substitute(speed, instances), over)
