"""Monte Carlo and randomized quasi-Monte Carlo over the unit cube.

Owns `sample`. A point u of the cube is a point x(u, theta) of the domain (`chart`), so that moving bounds move the
points with them. The derivative is the mean of the integrand's derivative at fixed u, plus what crosses every surface
(`flux`), which samples the surfaces themselves: unbiased, where differentiating the samples alone would miss them.
Quasi-Monte Carlo integrates the innermost variable exactly along its cuts and draws the others; its error is read off
independent scramblings of Sobol points. Samples that fall nowhere count as zero; none is ever left out of a mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property, partial
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.integrate.adaptive.iterated import Iteration
from potto.integrate.degenerate.undefined import guarded_samples
from potto.integrate.events import BUDGET_SPENT, NO_SAMPLE
from potto.integrate.fixed.cells.alike import by_shapes
from potto.integrate.montecarlo.cube_map import Chart, Point
from potto.integrate.montecarlo.rare_events import (
    MISSED,
    Largest,
    Outcomes,
    box_of_values,
    crossings,
    may_vanish,
    peaks,
    unhit,
)
from potto.integrate.montecarlo.replicates import Moments, Replicates, added
from potto.integrate.montecarlo.surface_terms import Surface, factors
from potto.integrate.pieces import Evaluator, Sums, dense, gather, take
from potto.integrate.plan import Plan
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.sobol import MOST, Sobol
from potto.kernels.cells import Array, Cell, Mask, Value, map_arrays
from potto.kernels.memory import kept
from potto.projects.settings import Settings

SIGMAS = 4.0  # a reported error in standard errors: too small once in 16,000 times
REPLICATES = 16
# The same for a standard error that is itself estimated from 16 scramblings: Student's t with 15 degrees of freedom.
STUDENT = 5.48
# Points at once: what is done around kernels, a few hundred calls of numpy a chunk, takes half the time per point
# that it takes with a quarter as many.
CHUNK = 1 << 16
FIRST = 1 << 5  # points of each scrambling before the first look at the error
# Evaluations of a sample of a surface, which has two sides, and of a line that quadrature takes, about; how many
# samples are taken at least, however few evaluations are allowed.
SIDES, NODES, LEAST = 2, 64, 16
EXACT = 1  # variables left to quadrature: two are no better for the time they take
# The quadrature of the innermost variable, below sampling errors that are larger. Six nodes are refined so often that
# lines take 1.3 to 2.4 times as long as with eight, ten take 1.1 times as long (six integrands in 2 to 8 variables).
INNER_ORDER = 8
INNER_RTOL = 1e-7

# The least part of the points of one variable for each stretch between its cuts: of independent ones; of evenly spread
# ones, which each boost is a step for, in up to FLAT variables and in more.
CROWDED = {"mc": 2.0**-4, "flat": 2.0**-6, "deep": 2.0**-8}
FLAT = 2

ROUNDING = 8 * EPS  # of a sample

Told = Callable[[float], None]  # how much of the work is done
# How many variables are drawn, and the function of them that a mean is taken of.
Mean = tuple[int, Callable[[Array], Sums]]


def sample(plan: Plan, machine: Evaluator, env: dict[str, Value], batch: int, method: str) -> Sums:
    """Estimate the integrals of a batch one after the other; each from the same seed.

    "auto" stops where the accuracy asked for is reached; otherwise all `samples` are taken.
    """
    rows: list[Sums] = []
    kept()
    machine.sampled(0.0, method == "auto")

    def told(share: float) -> None:
        machine.sampled((len(rows) + share) / batch, method == "auto")

    for i in range(batch):
        member = {n: map_arrays(v, lambda a, i=i: float(a[i])) for n, v in env.items()}  # type: ignore[misc]
        with machine.among(np.array([i])) as alone:
            rows.append(_plain(plan, alone, member, told) if method == "mc"
                        else _quasi(plan, alone, member, method, told))  # fmt: skip
        machine.events.take(alone.events, np.array([i]))
    return Sums.joined([Sums(*(x[..., None] for x in (r.v, r.e, r.t, r.et))) for r in rows])


def _plain(plan: Plan, machine: Evaluator, env: dict[str, Value], told: Told) -> Sums:
    """Independent points: the means' variances add up, and the errors that integrands come with."""
    generator = np.random.default_rng(machine.settings.seed)
    run = _Run(plan, machine, env, 0)
    found: list[Moments] = []
    rare: list[Sums] = []
    means = list(run.means())
    each = 1 + SIDES * (len(means) - 1)
    afforded = int((machine.settings.max_evals - machine.spent) / each)
    count = min(machine.settings.samples, max(afforded, LEAST))
    fewest = count
    for number, (dims, f) in enumerate(means):
        moments, largest, done = Moments(), Largest(), 0
        for u in _random(generator, count if dims else 1, dims):
            samples = f(u)
            moments.add(samples)
            largest.add(samples)
            done += len(u)
            told((len(found) + (done / count if dims else 1)) / len(means))
            if machine.exhausted():  # points may cost more than one evaluation each
                break
        found.append(moments)
        run.largest.append(largest)
        if dims:
            rare.append(run.unhit(number, done))
            fewest = min(fewest, done)
    mean, variance = added([m.mean for m in found]), added([m.variance for m in found])
    mean.e, mean.et = mean.e + SIGMAS * np.sqrt(variance.v), mean.et + SIGMAS * np.sqrt(variance.t)
    for part in rare:
        mean.e, mean.et = mean.e + part.v, mean.et + part.t
    mean = run.widened(mean, fewest)
    run.look(mean)
    _say_if_cut(mean, machine, fewest < machine.settings.samples)
    return mean


def _say_if_cut(sums: Sums, machine: Evaluator, cut: bool) -> None:
    """Say that more samples were asked for than evaluations allowed, where they would be wanted."""
    if (cut or machine.exhausted()) and not _enough(sums, machine.settings, machine.settings.asked(True)):
        machine.note(BUDGET_SPENT)


def _random(generator: np.random.Generator, count: int, dims: int) -> Iterator[Array]:
    """Points in chunks: an interrupt waits for one of them at most, and so does memory."""
    for start in range(0, count, CHUNK):
        yield generator.random((min(CHUNK, count - start), dims))


def _quasi(plan: Plan, machine: Evaluator, env: dict[str, Value], method: str, told: Told) -> Sums:
    """Scrambled Sobol points, twice as many until there are as many as asked for, or enough of them."""
    settings = machine.settings
    run = _Run(plan, machine, env, min(EXACT, len(plan.levels) - 1))
    means = list(run.means())
    points = [Sobol(dims, REPLICATES, (settings.seed, i)) for i, (dims, _) in enumerate(means)]
    found = Replicates(REPLICATES, STUDENT)
    count = 1 << min(max(4, int(np.log2(max(settings.samples // REPLICATES, 16)))), MOST)
    run.largest = [Largest() for _ in means]
    done, size, before, cut = 0, min(FIRST, count), machine.spent, False
    while size > 1 and size * REPLICATES * NODES * len(means) > settings.max_evals - before:
        size //= 2
    while done < count:
        for number, (sequence, (dims, f), largest) in enumerate(zip(points, means, run.largest, strict=True)):
            if dims:
                seen: list[tuple[Array, Sums]] = []
                now = 0
                for u in sequence.blocks(done, size, CHUNK // REPLICATES):
                    samples = f(u.reshape(-1, dims))
                    found.add(samples)
                    largest.add(samples)
                    if dims == 1:
                        seen.append((u[:, :, 0], samples))
                    now += u.shape[1]
                    told((done + (number * (size - done) + now) / len(means)) / count)
                found.look_for_steps(seen)
            elif not done:
                found.fix(f(np.zeros((1, 0))))
        done, size = size, 2 * size
        sums = run.widened(found.estimate(done), REPLICATES * done)
        for number, (dims, _) in enumerate(means):
            rare = run.unhit(number, REPLICATES * done) if dims else unhit(None, 1)
            sums.e, sums.et = sums.e + rare.v, sums.et + rare.t
        if method == "auto" and _enough(sums, settings, settings.rtol):
            break
        if cut := done < count and 2 * machine.spent - before > settings.max_evals:
            break
    run.look(sums)
    _say_if_cut(sums, machine, cut)
    return sums


def _enough(sums: Sums, settings: Settings, rtol: float) -> bool:
    return all(
        bool((e <= np.maximum(settings.atol, rtol * np.abs(x))).all()) for x, e in ((sums.v, sums.e), (sums.t, sums.et))
    )


class _Run(Struct, dict=True):
    """One integral, for one set of parameters; `exact`: how many of its innermost variables are left to quadrature."""

    plan: Plan
    machine: Evaluator
    env: dict[str, Value]
    exact: int
    largest: list[Largest] = []

    @cached_property
    def chart(self) -> Chart:
        kind = "mc" if not self.exact else "flat" if self.drawn <= FLAT else "deep"
        return Chart(self.plan, self.machine, self.env, CROWDED[kind])

    @cached_property
    def drawn(self) -> int:
        """How many variables are drawn for the interior."""
        return len(self.plan.levels) - self.exact

    @cached_property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surfaces whose boundary terms are means of their own: not those that the inner quadrature cuts at."""
        if not self.machine.directions or self.machine.frozen:
            return ()
        count = len(self.plan.levels)
        still = self.machine.with_directions(0)
        resting, tracked = replace(self, machine=still), replace(self, machine=still.tracking())
        found = []
        for term, number, forces in factors(self.plan, self.drawn):
            inner = number >= self.drawn
            integrand = resting.integrand if self.exact and not inner else tracked.body
            stop = count if inner else self.drawn
            surface = Surface(self.chart, term, number, forces, stop, self.drawn if inner else None, integrand)
            if not inner or min(surface.pivots) < self.drawn:
                found.append(surface)
        return tuple(found)

    @cached_property
    def iteration(self) -> Iteration:
        groups = (g for s in self.surfaces if s.number >= self.drawn for g, _ in s.forces)
        resting = frozenset(self.plan.groups[g].cut.surface for g in groups)
        settings = self.machine.settings
        machine = self.machine.changed(settings=replace(settings, rtol=max(settings.rtol, INNER_RTOL)))
        return Iteration(self.plan, machine, INNER_ORDER, resting)

    def means(self) -> Iterator[Mean]:
        """What the integral and its derivatives are the sum of."""
        yield self.drawn, self.interior
        for surface in self.surfaces:
            for pivot in surface.pivots:
                yield surface.stop - 1, partial(surface.crossing, pivot=pivot)

    @cached_property
    def peaks(self) -> Sums | None:
        """The largest magnitudes of the interior's samples near what is known to be the center of something."""
        return peaks(self.chart, self.drawn, lambda point, n: self.integrand(point, {}, n), self.machine.settings.seed)

    def unhit(self, number: int, points: int) -> Sums:
        """What the points of one of the means may have missed: the interior's, or those of a surface by one pivot."""
        if not number:
            found = unhit(self.rare_outcomes if not self.exact or self.largest[0].hardly("v") else None, points)
            if self.exact and self.machine.directions and self.largest[0].hardly("t"):
                found.t = found.t + unhit(self.rare_crossings, points).t
            return found
        surface, pivot = [(s, pivot) for s in self.surfaces for pivot in s.pivots][number - 1]
        if not self.largest[number].hardly("t") or not may_vanish(surface.term, self.box):
            return unhit(None, points)
        return unhit(crossings(surface, pivot, self.machine.settings.seed), points)

    @cached_property
    def rare_outcomes(self) -> Sums | None:
        return self.outcomes.stakes(self.chart, len(self.plan.levels), self.body, self.machine.settings.seed)

    @cached_property
    def rare_crossings(self) -> Sums | None:
        """What any surface may bring that passes through the domain, for all that is known."""
        found: Sums | None = None
        count = len(self.plan.levels)
        tracked = replace(self, machine=self.machine.with_directions(0).tracking())
        for term, number, forces in () if self.plan.hides else factors(self.plan, count):
            if may_vanish(term, self.box):
                surface = Surface(self.chart, term, number, forces, count, None, tracked.body)
                for pivot in surface.pivots:
                    more = crossings(surface, pivot, self.machine.settings.seed)
                    found = more if found is None else added([found, more])
        return found

    @cached_property
    def box(self) -> dict[str, tuple[float, float]]:
        return box_of_values(self.plan.term, self.env)

    @cached_property
    def outcomes(self) -> Outcomes:
        """Which way conditions came out at the interior's points: those that can be told and may change there."""
        groups = () if self.plan.hides else self.plan.groups
        return Outcomes(self.plan, [g.number for g in groups if may_vanish(g.cut.surface, self.box)])

    def widened(self, mean: Sums, points: int) -> Sums:
        """The mean with what so many points may not have seen added to its errors."""
        for largest in self.largest:
            mean.e = mean.e + largest.tail("v", points)
            mean.et = mean.et + largest.tail("t", points)
        if self.drawn and self.peaks is not None:
            seen = self.largest[0]
            mean.e = mean.e + MISSED / points * np.maximum(self.peaks.v - seen.top("v"), 0.0)
            mean.et = mean.et + MISSED / points * np.maximum(self.peaks.t - seen.top("t"), 0.0)
        return mean

    def look(self, mean: Sums) -> None:
        """Say so where all samples are 0, and give the error that this has in the worst case."""
        if not mean.v.any() and not mean.t.any():
            self.machine.note(NO_SAMPLE)
        if self.plan.groups:
            mean.e = np.where((mean.v == 0) & (mean.e == 0), np.inf, mean.e)

    # The integrand

    def interior(self, u: Array) -> Sums:
        n = u.shape[0]
        start = self.chart.start(n, self.machine.directions)
        point = self.chart.place(start, list(u.T), 0, self.drawn, crowding=range(self.drawn))
        if not self.exact:
            self.outcomes.add(point.env, n, self.machine)
        return self.integrand(point, {}, n)

    def integrand(self, point: Point, sides: dict[int, Mask], n: int) -> Sums:
        """F times the volume element."""
        if not self.exact:
            return self.body(point, sides, n)
        return self.weighted(self.lines(point, sides, n), point.volume, n)

    def lines(self, point: Point, sides: dict[int, Mask], n: int) -> Sums:
        """The integrals over the variable that is left to quadrature: those by one rule that are plain, as most are."""
        plan, machine, env = self.plan, self.iteration.machine, point.env
        line = None if plan.line is None or sides else plan.line.resting(self.iteration.still)
        found = None
        if line is not None:
            found = by_shapes(line, plan.degrees[-1:], machine, line.with_resting(env), n, False)
        done = np.zeros(n, dtype=bool) if found is None else found.done
        rest = np.flatnonzero(~done)
        if found is not None and not rest.size:
            return found.sums
        sides = {**self.turning(point, n), **sides}
        here = env if found is None else gather(env, rest)
        sums = self.iteration.run(self.drawn, here, rest.size, take(sides, rest), machine)
        return sums if found is None else found.sums.with_members(rest, sums)

    def turning(self, point: Point, n: int) -> dict[int, Mask]:
        """The sides, decided by what is drawn, that turn round those decided further in."""
        wanted = {group for level in self.plan.levels[self.drawn :] for turned in level.turned for group in turned}
        sides: dict[int, Mask] = {}
        for level in self.plan.levels[: self.drawn]:
            for group in wanted.intersection(level.decided):
                sides[group] = self.chart.above(self.plan.groups[group].cut.surface, point.env, n)
        return sides

    def body(self, point: Point, sides: dict[int, Mask], n: int) -> Sums:
        """The same with every variable at a point."""
        k, body = self.machine.directions, self.plan.body
        self.machine.count(n)
        value = self.machine.evaluate(body, point.env, self.plan.trace(sides))
        numbers, errors = dense(value, k, (n,))
        errors = np.zeros(numbers.shape) if errors is None else errors
        (f, ft), (e, et) = ((x[:, 0], x[:, 1:]) for x in (numbers, errors))
        if np.isnan(f.sum()):  # of infinite ones too
            bad = np.nonzero(np.isnan(f).any(axis=0))[0]
            zero = guarded_samples(self.plan, point.env, sides, bad, self.machine)
            ft[:, :, bad] = np.nan
            for part in (f, ft, et):
                part[..., bad[zero]] = 0.0
        return self.weighted(Sums(f, e, ft, et), point.volume, n)

    def weighted(self, sums: Sums, volume: Cell, n: int) -> Sums:
        k, size = self.machine.directions, volume.v
        v, t = sums.v * size, sums.t * size
        e, et = np.abs(v), np.abs(t)
        e *= ROUNDING
        et *= ROUNDING
        if sums.e.any() or sums.et.any():
            e, et = e + sums.e * np.abs(size), et + sums.et * np.abs(size)
        if any(x is not None for x in volume.t[:k]):
            rates = np.stack([_full(x, n) for x in volume.t[:k]])
            t, et = t + sums.v[:, None] * rates, et + sums.e[:, None] * np.abs(rates)
        return Sums(v, e, t, et)


def _full(x: Any, n: int) -> Array:
    return np.broadcast_to(np.asarray(0.0 if x is None else x, dtype=float), (n,))
