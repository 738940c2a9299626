"""Terms that are the same but for their numbers: one term over parameters, and what these are in each.

Owns `alike`, `most_alike` and `SameShape`. Numbers and names stand for each other where they are what differs. What is
the same in all stays as it is, since a closed form may rest on it; so does what decides exponents, recursions, how long
a sum is. What bound variables are called makes no difference.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from msgspec import Struct

from potto.calculus.inlining.deciding import deciding
from potto.calculus.surfaces.finding import Resolve
from potto.core.terms import (
    Array,
    Branch,
    Const,
    Fold,
    Integral,
    Lam,
    Prim,
    Proj,
    Sum,
    Term,
    Var,
    bound_names,
    children,
    lam,
    postorder,
    rebuild,
    var,
)

# Up to how many parts of a term are looked at: all that it shares counts as often as it stands there.
MOST_PARTS = 4096

Leaf = Const | Var


class SameShape(Struct, frozen=True):
    """Terms of one shape. function: what they have in common, over parameters. columns: per parameter what it is in
    each of them, or the one name that it is in all. places: which terms they are."""

    function: Lam
    columns: tuple[tuple[Leaf, ...] | str, ...]
    places: tuple[int, ...]


def alike(terms: Sequence[Term], kinds: Mapping[str, object], resolve: Resolve) -> tuple[list[SameShape], list[int]]:
    """The groups of two and more terms that are alike, and the places of those that are like no other.

    kinds: of the free names those that are made of numbers, with how; only they can differ.
    """
    shapes: dict[object, list[tuple[int, list[Leaf]]]] = {}
    alone: list[int] = []
    for place, term in enumerate(terms):
        found = _shape(term, kinds)
        if found is None:
            alone.append(place)
        else:
            shapes.setdefault(found[0], []).append((place, found[1]))
    groups: list[SameShape] = []
    for members in shapes.values():
        parts = [members]
        if len(members) > 1:
            whole = _common(terms[members[0][0]], kinds, members)
            parts = _as_they_decide(whole, members, resolve)
        for part in parts:
            if len(part) > 1:
                groups.append(_common(terms[part[0][0]], kinds, part))
            else:
                alone.append(part[0][0])
    return groups, sorted(alone)


def most_alike(terms: Sequence[Term], kinds: Mapping[str, object]) -> int:
    """How many of the terms are alike at most."""
    shapes = Counter(found[0] for term in terms if (found := _shape(term, kinds)) is not None)
    return max(shapes.values(), default=0)


def _shape(term: Term, kinds: Mapping[str, object]) -> tuple[object, list[Leaf]] | None:
    """What a term is but for its numbers, as a key, and these; None if it is too large."""
    parts = _parts(term, kinds)
    if parts is None:
        return None
    key: list[object] = []
    leaves: list[Leaf] = []
    bound: dict[str, object] = {}
    for node, differs in parts:
        for name in bound_names(node):
            bound.setdefault(name, name if name in term.free else len(bound))
        if differs:
            assert isinstance(node, Leaf)
            key.append(kinds.get(node.name) if isinstance(node, Var) else None)
            leaves.append(node)
        else:
            key.append(_head(node, bound))
    return tuple(key), leaves


def _parts(term: Term, kinds: Mapping[str, object]) -> list[tuple[Term, bool]] | None:
    """The parts of a term in the order in which they stand there, and which are numbers."""
    bound = {name for node in postorder(term) for name in bound_names(node)}
    parts: list[tuple[Term, bool]] = []
    waiting = [term]
    while waiting:
        node = waiting.pop()
        named = isinstance(node, Var) and node.name in kinds and node.name not in bound
        parts.append((node, named or (isinstance(node, Const) and math.isfinite(node.value))))
        if len(parts) > MOST_PARTS:
            return None
        waiting.extend(reversed(children(node)))
    return parts


def _head(node: Term, bound: Mapping[str, object]) -> object:
    """What a part is by itself, with what stands for each bound name."""
    below, names = len(children(node)), tuple(bound[name] for name in bound_names(node))
    match node:
        case Prim():
            return node.op, below
        case Branch():
            return Branch, node.strict, below
        case Integral():
            return Integral, names, tuple(map(len, node.hints))
        case Sum():
            return Sum, names, node.endless
        case Lam() | Fold() | Array():
            return type(node), names
        case Var():
            return Var, bound.get(node.name, node.name)
        case Proj():
            return Proj, node.index
        case _:
            return (type(node), below) if below else node


def _common(term: Term, kinds: Mapping[str, object], members: Sequence[tuple[int, Sequence[Leaf]]]) -> SameShape:
    """What members of one shape have in common: the shape of `term`, one of them."""
    names: dict[tuple[Leaf, ...], str] = {}
    leaves: list[Term] = []
    for column in zip(*(leaves for _, leaves in members), strict=True):
        if all(leaf is column[0] for leaf in column):
            leaves.append(column[0])
        else:
            leaves.append(var(names.setdefault(column, f"${len(names)}")))
    whole = _filled(term, kinds, leaves)
    given = {name: column for column, name in names.items()}
    params = tuple(sorted(whole.free))
    return SameShape(lam(params, whole), tuple(given.get(p, p) for p in params), tuple(place for place, _ in members))


def _filled(term: Term, kinds: Mapping[str, object], leaves: Sequence[Term]) -> Term:
    """The term with other leaves in the places of its numbers."""
    parts = _parts(term, kinds)
    assert parts is not None
    rest, done = list(leaves), list[Term]()
    for node, differs in reversed(parts):
        done.append(rest.pop() if differs else rebuild(node, tuple(done.pop() for _ in children(node))))
    return done[0]


def _as_they_decide(
    whole: SameShape, members: Sequence[tuple[int, list[Leaf]]], resolve: Resolve
) -> list[list[tuple[int, list[Leaf]]]]:
    """Members apart that differ in what decides which formulas they are."""
    decide = deciding([whole.function.body], resolve, exponents=True)
    columns = [column for name, column in zip(whole.function.params, whole.columns) if name in decide]
    parts: dict[tuple[Leaf, ...], list[tuple[int, list[Leaf]]]] = {}
    for number, member in enumerate(members):
        parts.setdefault(tuple(c[number] for c in columns if not isinstance(c, str)), []).append(member)
    return list(parts.values())
