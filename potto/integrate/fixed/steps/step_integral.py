"""An integrand of one variable as an analytic function of that variable and of step functions.

Owns `StepIntegral` and `step_integral`. In `exp(x)/(1 + 2*[x < a] + c*[x < b])` the conditions count through one step
function, `2*[x < a] + c*[x < b]`, whose height changes by a known amount at each cut. So its heights on all cells are
sums along the cuts in their order, and on every cell the integrand is the same function of `x` and of the height there:
n conditions cost as much as n cells, where a formula of n terms on each of them costs the square.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from msgspec import Struct

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.degree import degree
from potto.calculus.algebra.ranges import range_of
from potto.calculus.decomposition.conic_regions import polynomial
from potto.calculus.decomposition.surface_cuts import WrittenSurface, all_sections, face_of
from potto.calculus.differentiation.derivative import NotSmooth, partial
from potto.calculus.surfaces.domains import ends_of_domain
from potto.core.terms import (
    INF,
    ONE,
    ZERO,
    Branch,
    Const,
    Integral,
    Lam,
    Prim,
    Term,
    add,
    children,
    const,
    div,
    function_of,
    mul,
    neg,
    postorder,
    rebuild,
    sub,
    substitute,
    tuple_,
    var,
)
from potto.integrate.fixed.root_choices import choices_of, smooth
from potto.integrate.fixed.steps.step_choices import StepChoice, choice_of
from potto.integrate.rules.complex_enclosures import enclosable
from potto.primitives import PRIMITIVES

MOST_TERMS = 600  # of what is left where step functions have names
BOUNDS = 2  # rows of a frame that come before its cuts


class StepSurface(Struct, frozen=True):
    """What a condition compares with 0. rows: of the frame, where it may change its sign. lead: what has the sign that
    it has above its last row, if it has another one below each: of a polynomial with as many roots as there are rows
    the coefficient of the highest power, and 1 or -1 of what rises or falls; None of others, which are asked between
    their rows which sign they have. told: whether that is so, too, where roots are not there, as in pairs."""

    form: Term
    rows: tuple[int, ...]
    lead: Term | None
    told: bool


class StepFunction(Struct, frozen=True, eq=False):
    """What adds up to it. alone: surfaces of conditions that count on their own."""

    alone: tuple[int, ...]
    choices: tuple[StepChoice[int], ...]

    @property
    def heights(self) -> int:
        """How many numbers it is made of: one by itself, one below each surface that counts on its own and by how much
        it changes above it, then the values of choices."""
        return 1 + 2 * len(self.alone) + sum(len(choice.values) for choice in self.choices)


class StepIntegral(Struct, frozen=True, eq=False):
    """The terms of such an integral.

    frame: both bounds, then the cuts, each once. body: the integrand, with `names` for the step functions. dark:
    whether it is 0 where all of these are. degree: of the body in the variable, None where it is not a polynomial.
    surfaces: of all conditions. asked: what tells their sides where all roots are there, and where some are not:
    leading coefficients that are no numbers, then other surfaces, each at as many places as stretches lie between its
    rows, under the names of `probe`. heights: of one step
    function after the other what it is made of, as `StepFunction` says. resting: which have nothing but numbers there.
    proofs: what was proved last (`step_orders`), by the accuracy. arrangements: how cuts lay last (`step_cells`).
    """

    variable: str
    frame: Lam
    body: Lam
    names: tuple[str, ...]
    dark: bool
    degree: int | None
    surfaces: tuple[StepSurface, ...]
    asked: tuple[Lam, Lam]
    steps: tuple[StepFunction, ...]
    heights: Lam
    resting: tuple[bool, ...]
    proofs: dict[float, Any] = {}
    arrangements: dict[int, Any] = {}

    @property
    def rows(self) -> int:
        return len(children(self.frame.body))


def probe(surface: int, stretch: int) -> str:
    """The name of the place at which a surface is asked in a stretch between its rows."""
    return f"#at{surface}'{stretch}"


def asked_between(surface: StepSurface, there: bool) -> bool:
    """Whether a surface is asked between its rows which sign it has. there: all roots are."""
    return surface.lead is None or not (there or surface.told)


def step_integral(term: Integral, body: Term) -> StepIntegral | None:
    """The integral in this form. None where the places of a condition have no closed forms, or it counts in another
    way, and where what is left is not analytic by its form.

    body: the integrand with calls carried out.
    """
    bounds = term.bounds[0]
    plain = not any(term.hints) and bounds[0] is not bounds[1] and INF not in postorder(*bounds)
    if len(term.variables) != 1 or not plain:
        return None
    reading = _Reading(term, body)
    whole = reading.put_together(body)
    names = tuple(reading.names.values())
    if not names or len(postorder(whole)) > MOST_TERMS:
        return None
    steps, heights = zip(*map(reading.heights, reading.names), strict=True)
    frame, levels = tuple(reading.rows), tuple_([height for own in heights for height in own])
    choices = choices_of(frame, (term, body), term.variables)
    if not all(map(enclosable, (whole, *children(levels)))) or not smooth(frame, choices):
        return None
    dark = substitute(whole, dict.fromkeys(names, ZERO)) is ZERO
    resting = tuple([all(isinstance(height, Const) for height in own) for own in heights])
    return StepIntegral(
        term.variables[0], function_of(tuple_(frame)), function_of(whole), names, dark, degree(whole, term.variables),
        tuple(reading.surfaces), (reading.asked(True), reading.asked(False)), steps, function_of(levels), resting,
    )  # fmt: skip


class _Reading:
    """What is read off an integrand. rows: of the frame, by their terms. numbers: of surfaces, by their canonical
    forms; None where they have none. linear: the terms that are linear in conditions, with coefficients that do not
    depend on the variable. chosen: conditions that are values of such, or have such for values. names: of the step
    functions."""

    def __init__(self, term: Integral, body: Term) -> None:
        (self.variable,) = term.variables
        self.rows: dict[Term, int] = {}
        for bound in term.bounds[0]:
            self.rows.setdefault(bound, len(self.rows))
        self.surfaces: list[StepSurface] = []
        self.numbers: dict[Term, int | None] = {}
        self.linear: set[Term] = set()
        self.chosen: set[Term] = set()
        self.names: dict[Term, str] = {}
        for node in postorder(body, below=lambda node: children(node) if self.variable in node.free else ()):
            if self.variable in node.free and self._is_linear(node):
                self.linear.add(node)

    def _still(self, node: Term) -> bool:
        return self.variable not in node.free

    def _is_linear(self, node: Term) -> bool:
        match node:
            case Branch():
                if not all(self._still(case) or case in self.chosen for case in (node.then, node.orelse)):
                    return False
                if self._side(node.surface) is not None:
                    self.chosen.add(node)
                return node in self.chosen
            case Prim(op="add" | "neg"):
                return all(arg in self.linear or self._still(arg) for arg in node.args)
            case Prim(op="mul"):
                moving = [arg for arg in node.args if not self._still(arg)]
                return len(moving) == 1 and moving[0] in self.linear
            case Prim(op="div", args=(over, under)):
                return over in self.linear and self._still(under)
        return False

    def _side(self, surface: Term) -> tuple[int, bool] | None:
        """The number of a surface, and whether it is above 0 where its form is."""
        face, turned = face_of(surface)
        if face.key not in self.numbers:
            self.numbers[face.key] = None
            found = self._found(face)
            if found is not None:
                self.numbers[face.key] = len(self.surfaces)
                self.surfaces.append(found)
        number = self.numbers[face.key]
        return None if number is None else (number, turned > 0)

    def _found(self, face: WrittenSurface) -> StepSurface | None:
        """A surface with its rows; None where these have no closed forms."""
        found = _solved(face, self.variable)
        return None if found is None else StepSurface(face.form, self._placed(found[0]), *found[1:])

    def _placed(self, roots: Sequence[Term]) -> tuple[int, ...]:
        return tuple(dict.fromkeys(self.rows.setdefault(root, len(self.rows)) for root in roots))

    def asked(self, there: bool) -> Lam:
        """What tells the sides of the surfaces, where all roots are there or not."""
        leads = [s.lead for s in self.surfaces if s.lead is not None and not isinstance(s.lead, Const)]
        between = [
            substitute(surface.form, {self.variable: var(probe(number, stretch))})
            for number, surface in enumerate(self.surfaces)
            if asked_between(surface, there)
            for stretch in range(1 + len(surface.rows))
        ]
        return function_of(tuple_((*leads, *between)))

    def put_together(self, body: Term) -> Term:
        """The integrand with names in place of step functions, as few as there may be."""
        known: dict[Term, Term] = {}
        for node in postorder(body, below=lambda node: () if self._ends(node) else children(node)):
            if self._ends(node):
                known[node] = self._named(node) if node in self.linear else node
            elif isinstance(node, Prim) and node.op == "add" and not self.linear.isdisjoint(node.args):
                own = [arg for arg in node.args if self._ends(arg)]
                known[node] = add(self._named(add(*own)), *(known[arg] for arg in node.args if not self._ends(arg)))
            else:
                known[node] = rebuild(node, tuple([known[part] for part in children(node)]))
        return known[body]

    def _ends(self, node: Term) -> bool:
        return node in self.linear or self._still(node)

    def _named(self, line: Term) -> Term:
        return var(self.names.setdefault(line, f"step'{len(self.names) + 1}"))

    def heights(self, line: Term) -> tuple[StepFunction, tuple[Term, ...]]:
        """A step function, and what it is made of."""
        keys, choices, heights = _heights(line, self.variable)
        numbers = {key: number for key, number in self.numbers.items() if number is not None}
        return StepFunction(tuple([numbers[key] for key in keys]), tuple(c.numbered(numbers) for c in choices)), heights


# What follows from a surface or a step function alone is found once: one shader takes another's place.
@lru_cache(maxsize=4096)
def _solved(face: WrittenSurface, variable: str) -> tuple[tuple[Term, ...], Term | None, bool] | None:
    """The rows, `lead` and `told` of a surface; None where the places at which it may change its sign are no closed
    forms."""
    line = affine(face.form, (variable,))
    slope = line.coefficients[0] if line is not None else ZERO
    if line is not None and isinstance(slope, Const) and slope.value != 0:
        return (_root(line.rest, slope),), slope, True
    if variable not in face.form.free or not enclosable(face.form):
        return None
    ends = (end for end in ends_of_domain(face.form) if variable in end.free)
    roots: dict[Term, None] = {}
    for part in (face, *(WrittenSurface(end, end) for end in ends)):
        found = all_sections(part, variable)
        if found is None or found.families or found.pole_families:
            return None
        roots |= dict.fromkeys((*found.roots, *found.poles))
    powers = polynomial(face.form, variable)
    if powers and len(powers) == 1 + len(roots) and enclosable(powers[0]):
        return tuple(roots), powers[0], True
    return tuple(roots), _direction(face.form, variable) if len(roots) == 1 else None, False


def _direction(form: Term, variable: str) -> Const | None:
    """Whether a term rises or falls in the variable all over, as 1 or -1; None where its form shows neither, or may
    have no value or a pole somewhere. Where a slope depends on nothing else, it is 0 at single places at the most."""
    edges = (e for node in postorder(form) if isinstance(node, Prim) for e in PRIMITIVES[node.op].edges(*node.args))
    if any(variable in edge.free and not _of_one_sign(edge) for edge in edges):
        return None
    try:
        slope = partial(form, variable)
    except NotSmooth:
        return None
    found, alone = range_of(slope), slope.free == {variable}
    if found.positive or (alone and found.lo >= 0):
        return ONE
    return const(-1.0) if found.negative or (alone and found.hi <= 0) else None


def _of_one_sign(term: Term) -> bool:
    found = range_of(term)
    return found.positive or found.negative


@lru_cache(maxsize=256)
def _heights(line: Term, variable: str) -> tuple[tuple[Term, ...], tuple[StepChoice[Term], ...], tuple[Term, ...]]:
    """The surfaces that count on their own in a step function, and the choices, by the canonical forms of surfaces; and
    what it is made of: many are added up by numbers alone, with less rounding than that of a term."""
    rest: list[Term] = []
    alone: dict[Term, tuple[list[Term], list[Term]]] = {}
    choices: list[StepChoice[Term]] = []
    values: list[Term] = []
    todo: list[tuple[Term, Term]] = [(line, ONE)]
    while todo:
        node, factor = todo.pop()
        match node:
            case _ if variable not in node.free:
                rest.append(mul(factor, node))
            case Branch() if variable not in node.then.free and variable not in node.orelse.free:
                face, turned = face_of(node.surface)
                above, below = (node.then, node.orelse) if turned > 0 else (node.orelse, node.then)
                level, change = alone.setdefault(face.key, ([], []))
                level.append(mul(factor, below))
                change.append(mul(factor, sub(above, below)))
            case Branch():
                choices.append(choice_of(node, variable))
                values += (mul(factor, value) for value in choices[-1].values)
            case Prim(op="mul"):
                (part,) = [arg for arg in node.args if variable in arg.free]
                todo.append((part, mul(factor, *_others(node.args, part))))
            case Prim(op="div", args=(over, under)):
                todo.append((over, div(factor, under)))
            case Prim(op="neg"):
                todo.append((node.args[0], neg(factor)))
            case _:
                todo += [(arg, factor) for arg in children(node)]
    own = [add(*parts) for each in zip(*alone.values(), strict=True) for parts in each]
    return tuple(alone), tuple(choices), (add(*rest), *own, *values)


def _root(rest: Term, slope: Const) -> Term:
    """Where slope*x + rest is 0, without a division where there need be none."""
    if slope.value == -1:
        return rest
    return neg(rest) if slope is ONE else div(neg(rest), slope)


def _others(args: Sequence[Term], part: Term) -> list[Term]:
    return [arg for arg in args if arg is not part]
