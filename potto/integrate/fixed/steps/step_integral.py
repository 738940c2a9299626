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
from potto.integrate.rules.complex_enclosures import enclosable

MOST_TERMS = 600  # of what is left where step functions have names
BOUNDS = 2  # rows of a frame that come before its cuts


class StepIntegral(Struct, frozen=True, eq=False):
    """The terms of such an integral.

    frame: both bounds, then the cuts, each once. body: the integrand, with `names` for the step functions. dark:
    whether it is 0 where all of these are. degree: of the body in the variable, None where it is not a polynomial.
    steps: per step function the rows of its cuts. heights: of one step function after the other what adds up to its
    height below all cuts, a number by itself and one for each cut, then by how much it changes at each. resting: which
    have nothing but numbers for heights. proofs: what was proved last (`step_orders`), by the accuracy.
    """

    variable: str
    frame: Lam
    body: Lam
    names: tuple[str, ...]
    dark: bool
    degree: int | None
    steps: tuple[tuple[int, ...], ...]
    heights: Lam
    resting: tuple[bool, ...]
    proofs: dict[float, Any] = {}

    @property
    def rows(self) -> int:
        return len(children(self.frame.body))


def step_integral(term: Integral, body: Term) -> StepIntegral | None:
    """The integral in this form. None where a condition is not affine in the variable with a slope that is a number, or
    counts in another way, and where what is left is not analytic by its form.

    body: the integrand with calls carried out.
    """
    if len(term.variables) != 1 or any(term.hints) or any(node is INF for node in postorder(*term.bounds[0])):
        return None
    reading = _Reading(term.variables[0], body)
    whole = reading.put_together(body)
    names = tuple(reading.names.values())
    if not names or len(postorder(whole)) > MOST_TERMS:
        return None
    steps, heights = zip(*map(reading.heights, reading.names), strict=True)
    frame = tuple_((*term.bounds[0], *reading.rows))
    levels = tuple_([height for own in heights for height in own])
    if not all(map(enclosable, (whole, *children(frame), *children(levels)))):
        return None
    dark = substitute(whole, dict.fromkeys(names, ZERO)) is ZERO
    resting = tuple([all(isinstance(height, Const) for height in own) for own in heights])
    return StepIntegral(
        term.variables[0], function_of(frame), function_of(whole), names, dark, degree(whole, term.variables),
        steps, function_of(levels), resting,
    )  # fmt: skip


class _Reading:
    """What is read off an integrand. rows: of the frame, by the cut. sides: by the surface its row, and whether it
    increases along the variable. linear: the terms that are linear in conditions, with coefficients that do not depend
    on the variable. names: of the step functions."""

    def __init__(self, variable: str, body: Term) -> None:
        self.variable = variable
        self.rows: dict[Term, int] = {}
        self.sides: dict[Term, tuple[int, bool] | None] = {}
        self.linear: set[Term] = set()
        self.names: dict[Term, str] = {}
        for node in postorder(body, below=lambda node: () if self._still(node) else children(node)):
            if not self._still(node) and self._is_linear(node):
                self.linear.add(node)

    def _still(self, node: Term) -> bool:
        return self.variable not in node.free

    def _is_linear(self, node: Term) -> bool:
        match node:
            case Branch():
                still = self._still(node.then) and self._still(node.orelse)
                return still and self._side(node.surface) is not None
            case Prim(op="add" | "neg"):
                return all(arg in self.linear or self._still(arg) for arg in node.args)
            case Prim(op="mul"):
                moving = [arg for arg in node.args if not self._still(arg)]
                return len(moving) == 1 and moving[0] in self.linear
            case Prim(op="div", args=(over, under)):
                return over in self.linear and self._still(under)
        return False

    def _side(self, surface: Term) -> tuple[int, bool] | None:
        if surface not in self.sides:
            found = _cut(surface, self.variable)
            self.sides[surface] = found and (self.rows.setdefault(found[0], BOUNDS + len(self.rows)), found[1])
        return self.sides[surface]

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

    def heights(self, line: Term) -> tuple[tuple[int, ...], tuple[Term, ...]]:
        """The rows of the cuts of a step function, and its heights as `StepIntegral` has them."""
        cuts, heights = _heights(line, self.variable)
        return tuple([self.rows[cut] for cut in cuts]), heights


# What follows from a surface or a step function alone is found once: one shader takes another's place.
@lru_cache(maxsize=4096)
def _cut(surface: Term, variable: str) -> tuple[Term, bool] | None:
    """Where a surface that is affine in the variable cuts it, and whether it increases along it; None where its slope
    is not a number."""
    found = affine(surface, (variable,))
    slope = found.coefficients[0] if found is not None else ZERO
    if found is None or not isinstance(slope, Const) or slope.value == 0:
        return None
    return _root(found.rest, slope), slope.value > 0


@lru_cache(maxsize=256)
def _heights(line: Term, variable: str) -> tuple[tuple[Term, ...], tuple[Term, ...]]:
    """The cuts of a step function, and its heights as `StepIntegral` has them: many are added up by numbers alone, with
    less rounding than that of a term."""
    rest: list[Term] = []
    parts: dict[Term, tuple[list[Term], list[Term]]] = {}
    todo: list[tuple[Term, Term]] = [(line, ONE)]
    while todo:
        node, factor = todo.pop()
        match node:
            case _ if variable not in node.free:
                rest.append(mul(factor, node))
            case Branch():
                side = _cut(node.surface, variable)
                assert side is not None
                cut, rising = side
                below, above = (node.orelse, node.then) if rising else (node.then, node.orelse)
                level, change = parts.setdefault(cut, ([], []))
                level.append(mul(factor, below))
                change.append(mul(factor, sub(above, below)))
            case Prim(op="mul"):
                (part,) = [arg for arg in node.args if variable in arg.free]
                todo.append((part, mul(factor, *_others(node.args, part))))
            case Prim(op="div", args=(over, under)):
                todo.append((over, div(factor, under)))
            case Prim(op="neg"):
                todo.append((node.args[0], neg(factor)))
            case _:
                todo += [(arg, factor) for arg in children(node)]
    levels, changes = zip(*parts.values(), strict=True)
    return tuple(parts), (add(*rest), *(add(*own) for own in (*levels, *changes)))


def _root(rest: Term, slope: Const) -> Term:
    """Where slope*x + rest is 0, without a division where there need be none."""
    if slope.value == -1:
        return rest
    return neg(rest) if slope is ONE else div(neg(rest), slope)


def _others(args: Sequence[Term], part: Term) -> list[Term]:
    return [arg for arg in args if arg is not part]
