"""Inverses of maps in several variables.

Owns `invert`: coordinates as terms over variables, and out come the variables as terms over the coordinates' values,
one set for each branch, with the determinant. Affine maps of any dimension at once; a family that the registry
recognizes inside the map (polar and the like) by its own inverse; everything else one variable at a time, by
`sections`, triangular maps first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct

from potto.calculus.algebra.affine import affine, determinant, solve_affine
from potto.calculus.algebra.radicals import guarded
from potto.calculus.algebra.rational_form import is_zero, shorter, tidy
from potto.calculus.differentiation.derivative import partial
from potto.calculus.solving.solve import Sections, Unsolvable, sections
from potto.core.terms import (
    NAN,
    ZERO,
    Prim,
    Term,
    apply,
    const,
    fresh,
    mul,
    postorder,
    rebuild,
    sub,
    substitute,
    var,
)
from potto.diffeos import FAMILIES, DiffeoFamily

MOST_BRANCHES = 16
_EFFORT = 200


class InverseMap(Struct, frozen=True):
    """The variables over the coordinates' values `values`; several branches where the map folds.

    determinant: of the derivative of the coordinates by the variables, over the variables.
    """

    variables: tuple[str, ...]
    values: tuple[str, ...]
    branches: tuple[tuple[Term, ...], ...]
    determinant: Term
    method: str


class Failure(Struct, frozen=True):
    """Why there is no inverse. `singular`: there is none at all; else only none was found."""

    reason: str
    singular: bool = False
    determinant: Term | None = None


def jacobian(coordinates: Sequence[Term], variables: Sequence[str]) -> tuple[tuple[Term, ...], ...]:
    """The matrix of partial derivatives: a row for each coordinate."""
    return tuple(tuple(partial(c, v) for v in variables) for c in coordinates)


def invert(coordinates: Sequence[Term], variables: Sequence[str], selected: bool = False) -> InverseMap | Failure:
    """The inverse of a map of as many coordinates as variables.

    `selected`: a declared branch selects one of several solutions, so periodic ones may be tried one by one.
    """
    det = tidy(determinant(jacobian(coordinates, variables)))
    if is_zero(det):
        return Failure("its determinant is 0 everywhere", True, ZERO)
    taken = {n for c in coordinates for n in c.free} | set(variables)
    values: list[str] = []
    for wish in _names(len(coordinates)):
        name = fresh(wish, taken)
        taken.add(name)
        values.append(name)
    search = _Search(taken, selected)
    method, branches = search.solve(tuple(coordinates), tuple(var(v) for v in values), tuple(variables))
    if branches is None:
        return Failure(search.reason or "no inverse was found", False, det)
    return InverseMap(tuple(variables), tuple(values), branches, det, method)


def _names(count: int) -> list[str]:
    return list("uvwpqs"[:count]) if count <= 6 else [f"u{i + 1}" for i in range(count)]


def dependence(coordinates: Sequence[Term], variables: Sequence[str]) -> str:
    """Says which coordinate repeats which, where that is so up to a constant factor."""
    rows = jacobian(coordinates, variables)
    for i, row in enumerate(rows):
        if all(is_zero(entry) for entry in row):
            return f"coordinate {i + 1} does not vary with {listed(variables, 'or')}"
        for j in range(i):
            minors = (sub(mul(rows[j][a], row[b]), mul(rows[j][b], row[a])) for a in range(len(row)) for b in range(a))
            if all(is_zero(m) for m in minors):
                return f"coordinate {i + 1} varies only together with coordinate {j + 1}"
    return "one coordinate is a function of the others"


def listed(names: Sequence[str], last: str = "and") -> str:
    quoted = [f"`{n}`" for n in names]
    return quoted[0] if len(quoted) == 1 else ", ".join(quoted[:-1]) + f" {last} " + quoted[-1]


Branches = tuple[tuple[Term, ...], ...]


class _Search:
    """One search for an inverse, with a bound on its effort."""

    def __init__(self, taken: set[str], selected: bool) -> None:
        self.taken = taken
        self.selected = selected
        self.left = _EFFORT
        self.reason = ""

    def solve(
        self, coordinates: tuple[Term, ...], values: tuple[Term, ...], variables: tuple[str, ...]
    ) -> tuple[str, Branches | None]:
        rows = [affine(c, variables) for c in coordinates]
        known = [r for r in rows if r is not None]
        if len(known) == len(rows):
            solved = solve_affine(known, values)
            return "affine", None if solved is None else (solved,)
        if len(variables) > 1:
            branches = self.family(coordinates, values, variables)
            if branches is not None:
                return "recognized", branches
        return "one variable at a time", self.eliminate(coordinates, values, variables)

    def eliminate(
        self, coordinates: tuple[Term, ...], values: tuple[Term, ...], variables: tuple[str, ...]
    ) -> Branches | None:
        """Solve one coordinate for one variable, put it into the others, go on."""
        if not variables:
            return ((),)
        candidates = [(i, v) for i, c in enumerate(coordinates) for v in variables if v in c.free]
        own = {i: sum(v in c.free for v in variables) for i, c in enumerate(coordinates)}
        candidates.sort(key=lambda pair: (own[pair[0]], sum(pair[1] in c.free for c in coordinates)))
        for row, name in candidates:
            self.left -= 1
            if self.left < 0:
                return None
            found = sections(sub(coordinates[row], values[row]), name)
            roots = self.roots(found)
            if not roots:
                self.reason = self.reason or (found.reason or f"it repeats periodically in `{name}`")
                continue
            branches = self.back(coordinates, values, variables, row, name, roots)
            if branches is not None:
                return branches
        return None

    def roots(self, found: Sections | Unsolvable) -> tuple[Term, ...]:
        """All roots; of periodic ones those around 0, where a branch is declared that selects one."""
        if isinstance(found, Unsolvable) or not found.complete or (found.families and not self.selected):
            return ()
        around = [substitute(f.root, {f.index: const(k)}) for f in found.families for k in (0, 1, -1)]
        return (*found.roots, *around)

    def back(
        self,
        coordinates: tuple[Term, ...],
        values: tuple[Term, ...],
        variables: tuple[str, ...],
        row: int,
        name: str,
        roots: tuple[Term, ...],
    ) -> Branches | None:
        index = variables.index(name)
        rest = variables[:index] + variables[index + 1 :]
        others = coordinates[:row] + coordinates[row + 1 :]
        right = values[:row] + values[row + 1 :]
        branches: list[tuple[Term, ...]] = []
        for root in roots:
            inner = tuple(shorter(substitute(c, {name: root})) for c in others)
            solved = self.solve(inner, right, rest)[1] if rest else ((),)
            if solved is None:
                return None
            for solution in solved:
                found = substitute(root, dict(zip(rest, solution, strict=True)))
                branches.append((*solution[:index], found, *solution[index:]))
            if len(branches) > MOST_BRANCHES:
                return None
        return tuple(branches)

    def family(
        self, coordinates: tuple[Term, ...], values: tuple[Term, ...], variables: tuple[str, ...]
    ) -> Branches | None:
        """Through a family that the registry recognizes: invert outside it, through it, and inside it."""
        for node in postorder(*coordinates):
            if not isinstance(node, Prim) or not node.free & set(variables):
                continue
            for family in FAMILIES.values():
                for inputs in family.recognition.anchor(node) if family.recognition else ():
                    branches = self.through(family, inputs, coordinates, values, variables)
                    if branches is not None:
                        return branches
        return None

    def through(
        self,
        family: DiffeoFamily,
        inputs: tuple[Term, ...],
        coordinates: tuple[Term, ...],
        values: tuple[Term, ...],
        variables: tuple[str, ...],
    ) -> Branches | None:
        assert family.recognition is not None
        names: list[str] = []
        for _ in inputs:
            names.append(fresh("w", self.taken))
            self.taken.add(names[-1])
        images = family.recognition.images(inputs, tuple(var(n) for n in names))
        outer = tuple(_seen_as(c, images) for c in coordinates)
        hidden = frozenset(n for i in inputs for n in i.free) & frozenset(variables)
        if any(c.free & hidden for c in outer):
            return None
        rest = tuple(v for v in variables if v not in hidden)
        if len(hidden) != len(inputs):
            return None
        solved = self.solve(outer, values, (*names, *rest))[1]
        if solved is None:
            return None
        inside = tuple(v for v in variables if v in hidden)
        branches: list[tuple[Term, ...]] = []
        for solution in solved:
            outputs = list(solution[: len(names)])
            for i in family.recognition.nonnegative:
                outputs[i] = guarded(outputs[i], outputs[i])
            if NAN in outputs:
                continue
            back = family.inverse(tuple(outputs), ())
            others = dict(zip(rest, solution[len(names) :], strict=True))
            inner = self.solve(tuple(substitute(i, others) for i in inputs), back, inside)[1]
            if inner is None:
                return None
            for found in inner:
                all_found = {**others, **dict(zip(inside, found, strict=True))}
                branches.append(tuple(all_found[v] for v in variables))
        return tuple(branches) or None


def _seen_as(term: Term, images: Mapping[Term, Term]) -> Term:
    """`term` with every image's left side replaced, also where it is part of a longer sum or product."""
    memo: dict[Term, Term] = dict(images)
    groups = [(old, new) for old, new in images.items() if isinstance(old, Prim) and old.op in ("add", "mul")]
    for node in postorder(term):
        if node in memo:
            continue
        if not isinstance(node, Prim):
            memo[node] = node
            continue
        args = list(node.args)
        found: list[Term] = []
        for old, new in groups:
            assert isinstance(old, Prim)
            if old.op == node.op and all(a in args for a in old.args):
                for a in old.args:
                    args.remove(a)
                found.append(new)
        if found:
            memo[node] = apply(node.op, *found, *(memo[a] for a in args))
        else:
            memo[node] = rebuild(node, tuple(memo[a] for a in node.args))
    return memo[term]
