"""Roots of a condition in one variable, in closed form.

Owns `sections`. The roots of `surface = 0` in a variable come out as terms over the other variables, nan where a root
does not exist. A list of goals `inner = value` is worked off: where one argument of a builtin contains the variable,
the builtin is undone (`undo`); where several do, the goal is split, collected as a polynomial of something, or
given up with the reason. Nothing here looks at numbers.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

from msgspec import Struct
from msgspec.structs import replace

from potto.calculus.algebra.polynomial_in import in_powers
from potto.calculus.algebra.radicals import guarded
from potto.calculus.algebra.ranges import positive
from potto.calculus.algebra.rational_form import settled, shorter
from potto.calculus.solving.isolate import Guard, IsolationStep, Stuck, step
from potto.calculus.solving.reduce_occurrences import split
from potto.calculus.solving.turning import steep, turning
from potto.core.normal_form import as_term, normal_form
from potto.core.polynomials import monomial_term, shared_by, without
from potto.core.printer import format_term
from potto.core.terms import (
    NAN,
    ONE,
    ZERO,
    Const,
    If,
    Prim,
    Term,
    Var,
    add,
    const,
    div,
    fresh,
    if_,
    mul,
    neg,
    postorder,
    prim,
    sub,
    substitute,
    var,
)
from potto.primitives import PRIMITIVES

_LONGEST = 4096  # equations on the way from one surface to its roots
_MOST = 256  # equations that lead to several others, for one surface


class Family(Struct, frozen=True):
    """One root for each integer `index`, because a periodic builtin was undone.

    `inner` is the index as a function of the variable solved for: the roots between lo and hi belong to the integers
    between the least and the greatest value of `inner` at lo, at hi and at those `stops` that lie between them, values
    that are nan left out (`inner` ends at a stop, as x^1.5 does at 0).
    """

    root: Term
    index: str
    inner: Term
    stops: tuple[Term, ...] = ()


class Sections(Struct, frozen=True):
    """Where a surface is 0 along one variable.

    roots: terms over the other variables; nan where that root does not exist.
    complete: these, with `families`, are all the real roots. If not, `reason` says what is missing.
    turning: terms over the other variables; roots appear, merge, disappear or run off only where one of them is 0.
    steep: those of them where roots may move infinitely fast.
    families: periodic roots.
    poles, pole_families: where the surface can change its sign without being 0 (1/(x - t), tan x).

    What does not contain the variable is not looked at: of (x - t)*(y - s) there is one root in y. See `factors`.
    """

    roots: tuple[Term, ...]
    complete: bool
    turning: tuple[Term, ...] = ()
    families: tuple[Family, ...] = ()
    poles: tuple[Term, ...] = ()
    pole_families: tuple[Family, ...] = ()
    reason: str = ""
    steep: tuple[Term, ...] = ()


class Unsolvable(Struct, frozen=True):
    """No root was found; `reason` says why, in the user's words."""

    reason: str


class Goal(Struct, frozen=True):
    """Still to solve: inner = value, where only `inner` contains the variable. before: the goal that led here."""

    inner: Term
    value: Term
    guards: tuple[Guard, ...] = ()
    index: str | None = None
    count: Term | None = None
    counted: Term | None = None
    before: Goal | None = None

    def repeats(self, item: IsolationStep) -> bool:
        """Whether a step leads back to an equation on the way to this one, and so would go on for ever."""
        at: Goal | None = self
        while at is not None and (item.inner is not at.inner or item.value is not at.value):
            at = at.before
        return at is not None


def sections(surface: Term, name: str, plain: bool = False) -> Sections | Unsolvable:
    """The roots of `surface = 0` in the variable `name`, in closed form; `plain`: to be read, not to be evaluated."""
    if name not in surface.free:
        return Unsolvable(f"the condition does not vary with `{name}`")
    search = _Search(name, surface, plain)
    search.run(Goal(settled(surface, frozenset((name,))), ZERO))
    roots, families, reasons = search.roots, search.families, list(search.reasons)
    if reasons and not roots and not families:
        return Unsolvable(reasons[0])
    poles = _Search(name, surface, plain)
    for goal in _singular(surface, name):
        poles.run(goal)
    reasons += poles.reasons
    everything = (*roots, *poles.roots, *(f.root for f in (*families, *poles.families)))
    indices = frozenset(f.index for f in (*families, *poles.families))
    return Sections(
        tuple(dict.fromkeys(roots)),
        not reasons,
        turning(everything, indices),
        tuple(families),
        tuple(r for r in dict.fromkeys(poles.roots) if r not in roots),
        tuple(poles.families),
        reasons[0] if reasons else "",
        steep(everything, indices),
    )


def factors(surface: Term) -> tuple[Term, ...]:
    """Terms where a surface changes its sign: of (x - t)/(y - s) both x - t and y - s, of z*t - z*y both z and t - y.

    Along y the first of them is not a root, so whoever looks for roots in one variable after the other asks for each.
    """
    found: dict[Term, None] = {}
    waiting = [surface]
    while waiting:
        item = waiting.pop()
        match item:
            case Prim(op="mul" | "div", args=args):
                waiting.extend(reversed(args))
            case Prim(op="neg", args=(inner,)):
                waiting.append(inner)
            case Prim(op="pow", args=(base, Const())):
                waiting.append(base)
            case Prim(op="add") if common := shared_factors(item):
                waiting.extend(reversed(common))
            case _ if item.free and not positive(item):
                found[item] = None
            case _:
                pass
    return tuple(found)


@lru_cache(maxsize=8192)
def shared_factors(item: Prim) -> tuple[Term, ...]:
    """The factors that all summands of a sum have in common, and what is left of it; nothing if there are none, or if
    the sum would have to be multiplied out."""
    form = normal_form(item)
    shared = shared_by(list(form)) if len(form) == len(item.args) else {}
    rest = as_term({without(monomial, shared): c for monomial, c in form.items()}) if shared else None
    return () if rest is None else (*(monomial_term(ONE, (pair,)) for pair in shared.items()), rest)


class _Search:
    """The goals for one variable and what has come of them."""

    def __init__(self, name: str, surface: Term, plain: bool = False) -> None:
        self.name = name
        self.plain = plain
        self.taken = set(surface.free) | {name}
        self.roots: list[Term] = []
        self.families: list[Family] = []
        self.reasons: list[str] = []

    def run(self, first: Goal) -> None:
        goals, cases, length = [first], 0, 0
        while goals:
            goal = goals.pop()
            length += 1
            if self.name not in goal.inner.free or _absent(goal.value):
                continue  # constant along the variable (no root is isolated), or no root
            if isinstance(goal.inner, Var):
                self.found(goal)
            else:
                found = self.advance(goal)
                if isinstance(found, Stuck):
                    self.reasons.append(found.reason)
                else:
                    goals.extend(reversed(found))
                    cases += len(found) > 1
                if cases > _MOST or length > _LONGEST:
                    self.reasons.append("there are too many cases")
                    return

    def found(self, goal: Goal) -> None:
        root = goal.value
        for guard in goal.guards:
            # The root stands in the guard as it was found, so that a guard cannot make another one nan.
            surface = shorter(substitute(guard.surface, {self.name: goal.value}))
            root = guarded(surface, root, guard.strict)
        if _absent(root):
            return
        if self.name in root.free:  # met where it was taken for a constant: in a call, or under a condition
            self.reasons.append(f"`{self.name}` occurs in what can't be looked into")
            return
        if goal.index is None or goal.index not in root.free:
            self.roots.append(root)
            return
        assert goal.count is not None and goal.counted is not None
        stops = _stops(goal.counted, self.name)
        if stops is None:
            self.reasons.append(f"where `{self.name}` turns inside a periodic builtin is not known")
        else:
            self.families.append(Family(root, goal.index, goal.count, stops))

    def advance(self, goal: Goal) -> list[Goal] | Stuck:
        term = goal.inner
        if isinstance(term, If):
            return self.conditional(goal, term)
        if not isinstance(term, Prim):
            return Stuck(_opaque(term, self.name))
        where = [i for i, a in enumerate(term.args) if self.name in a.free]
        if len(where) == 1:
            steps = step(term, where[0], goal.value)
        else:
            steps = split(term, goal.value, self.name, self.plain)
        if isinstance(steps, Stuck):
            return steps
        goals: list[Goal] = []
        for item in steps:
            if goal.repeats(item):
                return Stuck(f"`{self.name}` cannot be isolated in {format_term(term)}")
            following = self.follow(goal, item)
            if isinstance(following, Stuck):
                return following
            goals.append(following)
        return goals

    def follow(self, goal: Goal, item: IsolationStep) -> Goal | Stuck:
        following = replace(goal, inner=item.inner, value=item.value, guards=goal.guards + item.guards, before=goal)
        if item.period is None:
            return following
        if goal.index is not None:
            return Stuck(f"`{self.name}` is inside a periodic builtin inside a periodic builtin")
        index = fresh("k", self.taken)
        self.taken.add(index)
        return replace(
            following,
            value=add(item.value, mul(item.period, var(index))),
            index=index,
            count=div(sub(shorter(item.inner), item.value), item.period),
            counted=item.inner,
        )

    def conditional(self, goal: Goal, term: If) -> list[Goal] | Stuck:
        """A plain condition picks the case; each case's roots count where it is taken."""
        if self.name in term.condition.free:
            return Stuck(f"a plain condition depends on `{self.name}`")
        goals: list[Goal] = []
        for case, taken in ((term.then, True), (term.orelse, False)):
            if self.name in case.free:
                value = if_(term.condition, goal.value, NAN) if taken else if_(term.condition, NAN, goal.value)
                goals.append(replace(goal, inner=case, value=value, before=goal))
        return goals


def _absent(value: Term) -> bool:
    return isinstance(value, Const) and value.value != value.value


def _opaque(term: Term, name: str) -> str:
    kind = type(term).__name__
    if kind == "App":
        return f"`{name}` is given to a function that is known only where it is called"
    if kind == "Branch":
        return f"the condition itself jumps as `{name}` varies"
    if kind == "Integral":
        return f"`{name}` is inside an integral"
    return f"there is no way to solve a {kind.lower()} for `{name}`"


# Poles


def _singular(surface: Term, name: str) -> Iterable[Goal]:
    """Where the surface can jump or run off: zeros of divisors, poles of tan, the cut of atan2."""
    for node in postorder(surface):
        if not isinstance(node, Prim) or name not in node.free:
            continue
        match node.op:
            case "div" if name in node.args[1].free and not positive(node.args[1]):
                yield Goal(node.args[1], ZERO)
            case "pow" if name in node.args[0].free and not positive(node.args[0]):
                exponent = node.args[1]
                if isinstance(exponent, Const) and exponent.value < 0:
                    yield Goal(node.args[0], ZERO)
            case "tan":
                yield Goal(prim("cos", node.args[0]), ZERO)
            case "atan2" if name in node.args[0].free and not positive(node.args[1]):
                yield Goal(node.args[0], ZERO, (Guard(neg(node.args[1])),))


# Where inner functions turn


def _stops(term: Term, name: str) -> tuple[Term, ...] | None:
    """Where `term` turns or ends as the variable varies, as roots in the variable; None where that is not known."""
    stops: list[Term] = []
    while not isinstance(term, Var):
        if not isinstance(term, Prim):
            return None
        where = [a for a in term.args if name in a.free]
        if len(where) != 1:
            return _vertex(term, name, stops)
        inner = where[0]
        entry = PRIMITIVES.get(term.op)
        ends = [edge for edge in entry.edges(*term.args) if name in edge.free] if entry else []
        even = term.op == "pow" and isinstance(term.args[1], Const) and term.args[1].value % 2 == 0
        if even or term.op == "hypot":
            ends.append(inner)
        elif entry is not None and entry.turns is not None:
            ends += (sub(inner, const(turn)) for turn in entry.turns)
        elif term.op not in ("add", "neg", "mul", "div", "pow") and not (entry and entry.increasing):
            return None
        for end in ends:
            search = _Search(name, term)
            search.run(Goal(end, ZERO))
            if search.reasons or search.families:
                return None
            stops += search.roots
        term = inner
    return tuple(dict.fromkeys(stops))


def _vertex(term: Term, name: str, stops: list[Term]) -> tuple[Term, ...] | None:
    """The vertex of what is quadratic in the variable; nothing for what is affine in it."""
    square, slope, _ = in_powers(term, name, 2) or (ZERO, ZERO, ZERO)
    if square is ZERO:
        return None if slope is ZERO else tuple(stops)
    return (*stops, neg(div(slope, mul(const(2.0), square))))
