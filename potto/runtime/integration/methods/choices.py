"""What is tried for an integral: variables eliminated, cut along, or sampled, and which of them innermost.

Owns `to_be_seen`, `too_many`, `many`, `orders`, `preferred`, `tried`, `trial` and `worth_trials`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from functools import lru_cache

from potto.calculus.algebra.affine import affine
from potto.calculus.decomposition.elimination import eliminable
from potto.calculus.differentiation.level_sets import placed_along
from potto.calculus.solving.enclosable import slope_of
from potto.core.terms import INF, Const, Integral, Prim, Term, postorder, reordered
from potto.integrate.fixed.at_sight import worth_a_look
from potto.integrate.plan import Plan
from potto.runtime.integration.methods.quadrature import stretches
from potto.runtime.integration.problem import Problem

# Up to how many variables iterated quadrature is never in question; what it takes beyond them, in evaluations, and how
# much of that is acceptable. From LOOSE on, a relative accuracy is reached by fewer samples.
MOST_LEVELS = 3
PER_LEVEL, AFFORDABLE = 12, 1_000_000
LOOSE = 1e-3
# A look takes as long as an answer by a plan of what has one, 10 ms; the plan takes twenty times that.
SEEN, MOST_LOOKS = 2, 16
MET = 4  # one in so many planes that may cut a variable does: half of what it takes to twice that, of polytopes
FEW_NODES = 30_000  # up to which iterated quadrature is no slower
# Evaluations that are spent on one order of two variables before another one is tried; how many times those of one
# variable more.
TRIAL, TRIAL_FACTOR = 50_000, 6
# One in so many of all evaluations that there are may go into a trial, and into all of them together: the nodes that an
# order begins with may be more than was meant for it.
TRIED, ALL_TRIED = 64, 8
# One in so many evaluations of a trial goes into each order that does without searches, in turn, before any gets all: a
# ball takes 1,500, a torus 39,000 in the best order and a million in others, and of `[x*y + z < t]` an order with z
# outermost takes 100,000, others 36. Up to how many cuts orders are compared: of five balls, with 178, the plans for
# all would take five seconds.
GLANCES, COMPARED = (100, 20), 40
AGAIN = 4  # times what an order took is what it gets when it is tried first the next time


def too_many(problem: Problem) -> bool:
    """Whether an integral has too many variables and surfaces for quadrature, or too few digits are asked for."""
    settings, term = problem.machine.settings, problem.term
    if settings.method != "auto" or len(term.variables) <= MOST_LEVELS or placed_along(term) is not None:
        return False
    return settings.rtol >= LOOSE or expected(problem) > AFFORDABLE


def few_planes(problem: Problem) -> bool:
    """Whether so few variables are cut by planes alone that rules may do after all: how many of these cut one another
    inside is not expected, but met."""
    settings, term = problem.machine.settings, problem.term
    if settings.sampled or settings.rtol >= LOOSE or problem.batch > 1 or len(term.variables) > MOST_LEVELS + 1:
        return False
    cuts = {cut.surface for own in problem.plan().levels for cut in own.level.cuts}
    return all(affine(surface, term.variables) is not None for surface in cuts)


def many(problem: Problem) -> bool:
    """Whether it pays to look whether the variables can be eliminated."""
    if len(problem.term.variables) <= MOST_LEVELS or problem.machine.frozen or placed_along(problem.term) is not None:
        return False
    return expected(problem) > FEW_NODES


def expected(problem: Problem) -> int:
    """About how many evaluations iterated quadrature takes."""
    plan, count = problem.plan(), len(problem.term.variables)
    if plan.degrees and None not in plan.degrees[1:]:
        nodes = (PER_LEVEL if degree is None else degree + 1 for degree in plan.degrees)
        return math.prod(n * (1 + len(own.level.cuts) // MET) for n, own in zip(nodes, plan.levels, strict=True))
    return PER_LEVEL**count * 2**plan.doublings  # type: ignore[no-any-return]


def to_be_seen(problem: Problem) -> Term | None:
    """The integrand of one member by itself that is to be looked at before anything is planned for all; else None."""
    machine = problem.machine
    if problem.batch > 1 or not problem.outermost or machine.frozen or machine.side:
        return None
    if machine.settings.sampled or len(problem.term.variables) != SEEN:
        return None
    body = problem.unplanned(MOST_LOOKS)
    return body if body is not None and worth_a_look(body) else None


def orders(term: Integral) -> Iterator[Integral]:
    """The integral as it is written, then with other variables innermost, where the bounds allow it.

    A surface that runs along the innermost variable has no section in it; another variable then takes its place.
    """
    yield term
    count = len(term.variables) if _movable(term) else 0
    for last in range(count - 1):
        yield reordered(term, [*(i for i in range(count) if i != last), last])


def _movable(term: Integral) -> bool:
    """Whether its variables may stand in any order."""
    names = set(term.variables)
    return placed_along(term) is None and not any((lo.free | hi.free) & names for lo, hi in term.bounds)


def trial(problem: Problem) -> int | None:
    """How many evaluations may go into trying one order of the variables before another one is; None: all that there
    are, where there is no other way, or somebody else asks for the integral."""
    count = len(problem.term.variables)
    if not problem.outermost or problem.batch > 1 or count < 2:
        return None
    if len(list(itertools.islice(orders(problem.term), 2))) < 2 and not passes_on(problem):
        return None
    most: int = TRIAL * TRIAL_FACTOR ** (count - 2)
    return min(most, problem.machine.settings.max_evals // TRIED)


def worth_trials(problem: Problem) -> bool:
    """Whether there are evaluations left for more trials."""
    machine = problem.machine
    return machine.record.spent * ALL_TRIED < machine.settings.max_evals


def passes_on(problem: Problem) -> bool:
    """Whether variables may be eliminated where iterated quadrature, which suits so few, turns out to take long."""
    enough = len(problem.term.variables) >= MOST_LEVELS and not many(problem)
    return enough and not problem.machine.frozen and bool(eliminable(problem.term))


def many_variables(problem: Problem) -> bool:
    """Whether iterated quadrature that had to stop is better not tried in another order before variables are
    eliminated: more than three take long in each."""
    return len(problem.term.variables) > MOST_LEVELS


def endless(problem: Problem) -> bool:
    """Whether a range is infinite."""
    ends = (end for pair in problem.term.bounds for end in pair)
    return any(node is INF for node in postorder(*ends))


def preferred(problem: Problem) -> Iterable[Integral]:
    """The orders, those first in which the fewest jumps have to be searched for."""
    if not problem.plan().searches:
        return orders(problem.term)
    return sorted(orders(problem.term), key=lambda order: problem.plan(order).searches)


def tried(problem: Problem, most: int | None) -> Iterator[tuple[Integral, int | None, bool]]:
    """The orders to try, each with the evaluations that it may take, and whether it gets more at once if that promises
    something. most: those of a trial.

    Of three variables those orders come first that cut the outermost one at the fewest places. What the best of them
    takes is not told by that; so where nothing is searched for each gets few evaluations before any gets many, the one
    that is written first. That in which a trial came to an end at other parameters goes before them all.
    """
    term, levels = problem.term, problem.plan().levels
    cuts = sum(len(own.level.cuts) for own in levels)
    second = problem.machine.record.second  # what has no meaning at single places there is met in some orders alone
    written = most is None or second or endless(problem) or cuts > COMPARED  # of infinite ranges tables came first
    if most is None or written or len(term.variables) != MOST_LEVELS or not _movable(term):
        yield from ((order, most, True) for order in preferred(problem))
        return
    if problem.known.ended is not None:
        order, taken = problem.known.ended
        yield order, min(most - 1, AGAIN * taken), False
    if not any(own.searched or own.families or own.level.critical for own in levels):
        for part in GLANCES:
            yield from ((order, most // part, False) for order in _written_first(problem))
    yield from ((order, most, False) for order in _fewest_cuts(problem))


def _written_first(problem: Problem) -> Iterator[Integral]:
    """The order that is written, then those with other variables innermost."""
    yield problem.term  # the others' plans are not made if that one is settled
    yield from (order for order in _fewest_cuts(problem) if order.variables[-1] != problem.term.variables[-1])


def _searched(problem: Problem, order: Integral) -> tuple[int, int]:
    """How much an order has no closed form for: jumps, and places where surfaces fold or meet."""
    plan = problem.plan(order)
    return plan.searches, sum(len(own.level.critical) for own in plan.levels)


def _poles(plan: Plan) -> int:
    """How many sections have poles somewhere: of `z > x*y` those along x have, and z = 0 is a saddle."""
    names = frozenset(level.variable for level in plan.levels)
    roots = (root for level in plan.levels for cut in level.level.cuts if cut.decides for root in cut.roots or ())
    divisors = ([n.args[1] for n in postorder(root) if isinstance(n, Prim) and n.op == "div"] for root in roots)
    return sum(any(not names.isdisjoint(divisor.free) for divisor in own) for own in divisors)


def _saddles(plan: Plan) -> int:
    """How many surfaces of second degree have saddles as sections across the outermost variable: where that turns from
    one pair of branches into the other, what is integrated bends like r log r, not like the area of an ellipse."""
    names = tuple(level.variable for level in plan.levels[1:])
    return sum(_turns_both_ways(surface, names) for surface in dict.fromkeys(g.cut.surface for g in plan.groups))


@lru_cache(maxsize=256)
def _turns_both_ways(surface: Term, names: tuple[str, str]) -> bool:
    """Whether the second derivatives of a surface by two variables are numbers, of no definite sign together."""
    found = []
    for x, y in ((0, 0), (1, 1), (0, 1)):
        slope = slope_of(surface, names[x])
        second = None if slope is None else slope_of(slope, names[y])
        if not isinstance(second, Const):
            return False
        found.append(float(second.value))
    return found[0] * found[1] < found[2] ** 2


def _fewest_cuts(problem: Problem) -> list[Integral]:
    """One order for each variable that may be innermost, those first that search for nothing, and of these those that
    cut the outermost variable at the fewest places.

    What is integrated over the outermost variable is singular where the surfaces have critical points along it, on
    both sides at saddles: the fewer there are, the fewer panels it takes, each with all that is further in. (So do
    those choose who decompose algebraically, by "ndrr": Bradford, Davenport, England and Wilson 2013.) A hyperboloid
    takes 130,000 evaluations along its axis, and six million across it.
    """

    def rank(order: Integral) -> tuple[int, ...]:
        searched = _searched(problem, order)
        if any(searched):
            return searched
        plan = problem.plan(order)
        return *searched, _saddles(plan), stretches(plan, problem.machine, problem.env, problem.batch), _poles(plan)

    places = range(len(problem.term.variables))
    innermost: dict[str, Integral] = {}
    for order in sorted((reordered(problem.term, list(p)) for p in itertools.permutations(places)), key=rank):
        innermost.setdefault(order.variables[-1], order)
    return list(innermost.values())
