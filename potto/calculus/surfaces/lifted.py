"""Brackets taken out of conditions: the outer condition on either side of the inner one.

Owns `lifted`. The surface of `[0.3*[u < s] + 0.5*u < 0.2]` jumps where u = s, so that no formula has its zeros; of
`if [u < s] then [0.3 + 0.5*u < 0.2] else [0.5*u < 0.2]` each side has one. Every controller is such a program: the
state after n steps is one of 2^n, each an affine function of where it started, but few are met within the bounds.

A term becomes a tree of decisions with bracket-free terms as its leaves. Trees are combined from the inside out, equal
ones are one object, and a side that no point of the domain reaches is left out (`regions`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress

from msgspec import Struct

from potto.calculus.algebra.point_values import sample_value
from potto.calculus.algebra.polytopes import (
    AffineForm,
    Coefficient,
    Forms,
    Number,
    Polytope,
    VariableBounds,
    region_of,
    scaled,
)
from potto.calculus.algebra.ranges import ranges
from potto.calculus.surfaces.nested_brackets import BINDERS, coordinates_of, nested
from potto.core.simplify import normalized_surface
from potto.core.terms import (
    Branch,
    Const,
    Delta,
    Integral,
    Prim,
    Proj,
    Term,
    branch,
    children,
    const,
    outside,
    postorder,
    proj,
    rebuild,
    transform,
    tuple_,
    with_integrand,
)

MOST_CASES = 400  # decisions of one tree; what is beyond it is not taken apart
# How many leaves are looked at for each decision that there may be, where no side is left out: with numbers there are
# fewer, so that no time is lost on many of them that come to the same.
LOOKS = 4


class TooManyCases(Exception):
    """More cases than an integrand is worth."""


class Lifted(Struct, frozen=True):
    """An equal integral, and the terms that have to be positive for it to be one."""

    term: Integral
    premises: tuple[Term, ...]


def closed_value(term: Term) -> float:
    """What a term is that nothing decides, else nan: for what is to hold whatever the parameters are."""
    return math.nan if term.free else sample_value(term, {})


def lifted(term: Integral, number: Number) -> Lifted | None:
    """The integral with no bracket inside of a condition; None if that takes too many cases.

    number: what a plain term is now, or nan; only sides that are proved to be empty for all parameters around are left
    out. Where there are no more cases than brackets, none is: then it is equal whatever the parameters are. Calls have
    been carried out.
    """
    for known, few in ((closed_value, True), (number, False)):
        premises: dict[Term, None] = {}
        with suppress(TooManyCases):
            return Lifted(_of_integral(term, Polytope({}), frozenset(), known, few, premises), tuple(premises))
    return None


def _of_integral(
    term: Integral, outer: Polytope, names: frozenset[str], number: Number, few: bool, premises: dict[Term, None]
) -> Integral:
    names = names.union(term.variables)
    forms = Forms(names, number)
    region, ordered = region_of(term, forms, outer)

    def change(node: Term, new: Term) -> Term:
        return _of_integral(node, region, names, number, few, premises) if isinstance(node, Integral) else new

    body = transform(term.body, change, below=lambda node: () if isinstance(node, Integral) else children(node))
    if any(nested(c) for node in outside(body, (Integral,)) for c in coordinates_of(node)):
        brackets = sum(isinstance(node, Branch) for node in outside(body, (Integral,)))
        trees = _Trees(body, forms, region, *((brackets, LOOKS * brackets) if few else (MOST_CASES, math.inf)))
        body = trees.apart(body)
        premises |= dict.fromkeys((*ordered, *trees.premises))
    return with_integrand(term, body)


class BranchLeaf(Struct, frozen=True, eq=False):
    term: Term


class Split(Struct, frozen=True, eq=False):
    """A decision: `then` where the first coordinate is >= 0 (> 0 when strict). Equal surfaces have one key, and `up`
    says whether `then` is where that is true of the key's own form."""

    coordinates: tuple[Term, ...]
    strict: bool
    key: tuple[Term, bool]
    up: bool
    then: Tree
    orelse: Tree


Tree = BranchLeaf | Split
Build = Callable[[tuple[Term, ...], Polytope], "Tree"]


class _Trees:
    """The terms of one integrand as trees of the decisions that matter inside of conditions."""

    def __init__(self, body: Term, forms: Forms, region: Polytope, most: int, looks: float) -> None:
        self.forms = forms
        self.region = region
        self.most, self.looks = most, looks
        self.premises: dict[Term, None] = {}
        self.cases = self.looked = 0  # of the tree that is being made: decisions, and leaves that were looked at
        self.splits: dict[tuple[object, ...], Split] = {}
        self.leaves: dict[Term, BranchLeaf] = {}
        self.memo: dict[Term, Tree] = {}
        self.written: dict[Tree, Term] = {}
        surfaces = [c for node in outside(body, (Integral,)) for c in coordinates_of(node)]
        self.inner = {node for node in outside(tuple_(surfaces), BINDERS) if isinstance(node, Branch)}

    def apart(self, body: Term) -> Term:
        """The body with each part that has nested conditions written as decisions."""
        roots = [node for node in postorder(body, below=self.until_it_nests) if self.nests(node)]
        if any(isinstance(root, Delta) for root in roots) or self.share(roots):
            return self.write(self.tree(body))  # they are decided together
        known = {root: self.write(self.tree(root)) for root in roots}

        def below(node: Term) -> Sequence[Term]:
            return () if node in known or isinstance(node, BINDERS) else children(node)

        return transform(body, lambda node, new: known.get(node, new), below)

    def share(self, roots: Sequence[Term]) -> bool:
        """Whether some inner condition is met in several of these."""
        met = set[Term]()
        for root in roots:
            own = self.inner.intersection(outside(root, BINDERS))
            if not met.isdisjoint(own):
                return True
            met |= own
        return False

    def nests(self, node: Term) -> bool:
        return any(nested(c) for c in coordinates_of(node))

    def until_it_nests(self, node: Term) -> Sequence[Term]:
        return () if isinstance(node, BINDERS) or self.nests(node) else children(node)

    def tree(self, root: Term) -> Tree:
        for node in postorder(root, below=self.below):
            if node not in self.memo:
                self.cases = self.looked = 0
                self.memo[node] = self.of(node)
        return self.memo[root]

    def below(self, node: Term) -> Sequence[Term]:
        return () if node in self.memo or isinstance(node, BINDERS) else children(node)

    def of(self, node: Term) -> Tree:
        if isinstance(node, BINDERS) or not children(node):
            return self.leaf(node)
        if isinstance(node, Branch) and self.is_decision(node):
            then, orelse = self.memo[node.then], self.memo[node.orelse]

            def decided(coordinates: tuple[Term, ...], region: Polytope) -> Tree:
                return self.split(coordinates, node.strict, then, orelse, region)

            return self.walk([self.memo[c] for c in node.coordinates], self.region, decided)

        parts = [self.memo[c] for c in children(node)]
        if all(isinstance(tree, BranchLeaf) and tree.term is c for tree, c in zip(parts, children(node), strict=True)):
            return self.leaf(node)

        def built(parts: tuple[Term, ...], region: Polytope) -> Tree:
            return self.leaf(self.short(proj(parts[0], node.index) if isinstance(node, Proj) else rebuild(node, parts)))

        return self.walk(parts, self.region, built)

    def is_decision(self, node: Branch) -> bool:
        """Whether a conditional is one of the tree; one with decisions on its sides is, since it may guard them."""
        sides = self.memo[node.then], self.memo[node.orelse]
        return node in self.inner or self.nests(node) or any(isinstance(side, Split) for side in sides)

    def walk(self, trees: Sequence[Tree], region: Polytope, build: Build) -> Tree:
        """What `build` makes of the leaves that several trees have in common, in each part of a region."""
        first = next((tree for tree in trees if isinstance(tree, Split)), None)
        if first is None:
            self.looked += 1
            if self.looked > self.looks:
                raise TooManyCases
            return build(tuple(tree.term for tree in trees if isinstance(tree, BranchLeaf)), region)
        sides: list[Tree | None] = []
        for up in (True, False):
            inside = self.part(region, first.key, up)
            within = [_restricted(tree, first.key, up) for tree in trees]
            sides.append(None if inside is None else self.walk(within, inside, build))
        if sides == [None, None]:  # rounding: there is hardly any region
            return self.walk([_restricted(tree, first.key, True) for tree in trees], region, build)
        then, orelse = sides if first.up else reversed(sides)
        return self.joined(first.coordinates, first.strict, first.key, first.up, then, orelse)

    def part(self, region: Polytope, key: tuple[Term, bool], up: bool) -> Polytope | None:
        inside, premises = region.side(key, self.forms.of(key[0]), up)
        self.premises |= dict.fromkeys(premises)
        return inside

    def split(self, coordinates: tuple[Term, ...], strict: bool, then: Tree, orelse: Tree, region: Polytope) -> Tree:
        """The decision by coordinates without brackets, in a region; one of its sides where there is no other."""
        surface = coordinates[0]
        settled = self.settled(surface, strict)
        if settled is not None:
            return self.walk([then if settled else orelse], region, self.as_leaf)
        key, up = self.key(surface, strict)
        sides: list[Tree | None] = []
        for side, tree in ((up, then), (not up, orelse)):
            inside = self.part(region, key, side)
            sides.append(None if inside is None else self.walk([_restricted(tree, key, side)], inside, self.as_leaf))
        if sides == [None, None]:
            return self.walk([then], region, self.as_leaf)
        return self.joined(coordinates, strict, key, up, *sides)

    def key(self, surface: Term, strict: bool) -> tuple[tuple[Term, bool], bool]:
        """What is decided, the same for a surface and its opposite; and whether the surface is on that side."""
        form = self.forms.of(surface)
        if form is None or not form.slopes:
            found, side = normalized_surface(surface)
        else:
            found, side = self.monic(form)
        return ((found, strict), True) if side > 0 else ((found, not strict), False)

    def monic(self, form: AffineForm) -> tuple[Term, int]:
        """A form with the first slope 1, if all is numbers; else with a positive one, if that is a number."""
        first = form.slopes[min(form.slopes)]
        if not isinstance(first.term, Const):
            return form.term(), 1
        numbers = all(isinstance(c.term, Const) for c in (form.rest, *form.slopes.values()))
        size = 1 / first.value if numbers else math.copysign(1, first.value)
        same = scaled(form, Coefficient(const(size), size))
        return self.forms.short(same), 1 if first.value > 0 else -1

    def as_leaf(self, parts: tuple[Term, ...], region: Polytope) -> Tree:
        return self.leaf(parts[0])

    def settled(self, surface: Term, strict: bool) -> bool | None:
        """The side of a surface that no parameter and no variable within its bounds changes."""
        if isinstance(surface, Const):
            return surface.value > 0 if strict else surface.value >= 0
        if self.forms.of(surface) is not None:
            return None  # its region tells more
        box = {name: _numbers(extent) for name, extent in self.region.box.items()}
        bounds = ranges(surface, box)[surface]
        return True if bounds.positive else False if bounds.negative else None

    def joined(
        self, coordinates: tuple[Term, ...], strict: bool, key: tuple[Term, bool], up: bool,
        then: Tree | None, orelse: Tree | None,
    ) -> Tree:  # fmt: skip
        if then is None or orelse is None:
            found = orelse if then is None else then
            assert found is not None
            return found
        if then is orelse:
            return then
        known = (coordinates, strict, then, orelse)
        if known not in self.splits:
            self.cases += 1
            if self.cases > self.most:
                raise TooManyCases
            self.splits[known] = Split(coordinates, strict, key, up, then, orelse)
        return self.splits[known]

    def leaf(self, term: Term) -> BranchLeaf:
        if term not in self.leaves:
            self.leaves[term] = BranchLeaf(term)
        return self.leaves[term]

    def short(self, term: Term) -> Term:
        """An affine state as rest + slopes: after n steps it is no longer than after one."""
        if isinstance(term, Prim) and term.op in ("add", "mul", "neg", "div"):
            form = self.forms.of(term)
            if form is not None and form.slopes:
                return self.forms.short(form)
        return term

    def write(self, tree: Tree) -> Term:
        """The tree as conditionals."""
        stack = [tree]
        while stack:
            top = stack[-1]
            if top in self.written:
                stack.pop()
            elif isinstance(top, BranchLeaf):
                self.written[top] = top.term
            else:
                missing = [side for side in (top.then, top.orelse) if side not in self.written]
                if missing:
                    stack += missing
                else:
                    then, orelse = self.written[top.then], self.written[top.orelse]
                    self.written[top] = branch(top.coordinates, top.strict, then, orelse)
        return self.written[tree]


def _restricted(tree: Tree, key: tuple[Term, bool], up: bool) -> Tree:
    """A tree where a decision is known at its top."""
    while isinstance(tree, Split) and tree.key == key:
        tree = tree.then if tree.up == up else tree.orelse
    return tree


def _numbers(extent: VariableBounds) -> tuple[float, float]:
    known = isinstance(extent.lo.term, Const) and isinstance(extent.hi.term, Const)
    return (extent.lo.value, extent.hi.value) if known else (-float("inf"), float("inf"))
