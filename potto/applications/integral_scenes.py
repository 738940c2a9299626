"""A function of a program as something whose integrals are looked at: parameters with values, and what is compiled.

Owns `IntegralScene`, which the command, the page in a browser and editors share.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from contextlib import suppress

import numpy as np
from msgspec import Struct

from potto.applications.integral_numbers import IntegralNumbers, numbers
from potto.applications.integral_pictures import integral_svg, words
from potto.applications.integral_views import FRAME, SEEN, IntegralView, Viewer
from potto.calculus.explanation.notation import written_notation
from potto.checking.regions import DrawnIntegral, indices, regions
from potto.core.terms import ZERO, Lam, Term, app, lam, tuple_, var
from potto.diagnostics import PottoError
from potto.elaborate import core, elaborate_expression
from potto.evaluating.world import World
from potto.ide.display.scenes import Scene, SceneParameter, scene
from potto.kernels.errors import wrong_call
from potto.modules import DefinitionTarget, resolve
from potto.python.terms import TermFunction
from potto.runtime.evaluation.gauge import Overtime, patient
from potto.source import Span
from potto.syntax import nodes
from potto.types import groups_of, interface

UNSAID = 0.5  # what a number is that nobody gives
PATIENCE = 0.1  # seconds: numbers that take longer are given up until nothing is dragged any more; the picture goes on
AGAIN = 0.25  # seconds between numbers that do not fit into a frame


Standing = tuple[float, float, float]  # of an index: the number that it stands on, the first and the last
Counted = tuple[str, int, float | None, tuple[tuple[str, float], ...]]  # what numbers are of: all but what is seen


class Shot(Struct, frozen=True):
    """One look: what is seen, and the numbers, if there was time for them. indices: where each stands, with its first
    and its last number at these values."""

    view: IntegralView
    numbers: IntegralNumbers | None
    title: str
    wrt: str
    indices: dict[str, Standing]

    @property
    def svg(self) -> str:
        """The picture that stands alone, with its words."""
        return integral_svg(self.view, words(self.view, self.numbers, self.title, self.wrt))


class IntegralScene:
    """The integrals of one function. Raises PottoError if there is no such function, or it has no integral.

    given: texts for parameters; the others start as a live expression gives them. `values` has the numbers by name, a
    tuple's as `p_1`, `p_2`, a record's as `p.field`, and those of indices of sums and arrays around integrals: what is
    seen is one summand, the first if nobody says which. `sections`: where variables that are not seen are said to
    stand. `parameters`: the names of those that can move.
    `functions`: the texts that stand for parameters that are functions; `fits`: what else is offered for each.
    """

    def __init__(self, world: World, file: str, name: str, given: Mapping[str, str]) -> None:
        self.world, self.file, self.name = world, file, name
        target = resolve(world.db, file, name)
        if not isinstance(target, DefinitionTarget):
            raise wrong_call(f"`{name}` is not defined here", "name a function of the program")
        world.need(file, nodes.Name(Span(0, 0), name))
        found = scene(world.db, target.file, target.name)
        if found is None:
            raise wrong_call(f"`{name}` is not a function of numbers", "name a function whose parameters are numbers, "
                             "tuples of them, or functions of them")  # fmt: skip
        self.values: dict[str, float] = {}
        self.functions: dict[str, str] = {}
        self.fits = {p.name: p.fits for p in found.parameters if p.kind == "function"}
        self._parts: dict[str, str] = {}  # what the program calls the numbers of a tuple or a record
        arguments = iter(self._arguments(found, given))
        self._notation = written_notation(world.db, target.file, target.name)
        call = core(world.db, target.file, target.name).term
        for group in groups_of(interface(world.db, target.file, target.name).type):
            call = app(call, tuple(next(arguments) for _ in group))
        self.term = lam(tuple(self.values), call)
        self.parameters = tuple(self.values)
        self._indices = indices(world.db, self.term)
        self._regions: dict[str, tuple[DrawnIntegral, ...]] = {}
        self.sections = self._sections(found, given)
        self._viewers: dict[tuple[str, int], Viewer] = {}
        self._took: dict[tuple[str, int], float] = {}  # seconds that numbers took last
        self._told: dict[tuple[str, int], float] = {}  # when that was
        self._functions: dict[Lam, TermFunction] = {}
        self._fine: tuple[Counted, IntegralNumbers] | None = None  # the newest numbers of a look that was not quick
        for index in self._indices:
            said = given.get(index.name)
            self.values[index.name] = self._given(said, 1)[0] if said else -math.inf  # that is the first
        self.indices = self.standing(self.values)
        self.values |= {index: at for index, (at, _, _) in self.indices.items()}

    def _sections(self, found: Scene, given: Mapping[str, str]) -> dict[str, float]:
        """Where variables that are not seen are said to stand: what is given beside parameters and indices."""
        names = [*(p.name for p in found.parameters), *(index.name for index in self._indices)]
        beside = sorted(given.keys() - set(names))
        if beside:
            hidden = dict.fromkeys(n for r in self.regions(self.parameters[0]) for n in r.variables[SEEN:])
            unknown = [each for each in beside if each not in hidden]
            if unknown:
                raise wrong_call(f"`{self.name}` has no parameter `{unknown[0]}`",
                                 f"its parameters are {', '.join((*names, *hidden))}")  # fmt: skip
        return {name: self._given(given[name], 1)[0] for name in beside}

    def _arguments(self, found: Scene, given: Mapping[str, str]) -> list[Term]:
        """What each parameter is given; `values` is filled on the way."""
        terms: list[Term] = []
        for parameter in found.parameters:
            said = given.get(parameter.name)
            if parameter.kind == "function":
                text = said or next((text for text in parameter.fits if self._stands(text)), "")
                if not text:
                    raise wrong_call(f"`{parameter.name}` is a function, {parameter.type}",
                                     "nothing here fits it, so give it one")  # fmt: skip
                self.functions[parameter.name] = text
                home, there = self.world.home(self.file, text)
                tree, _ = self.world.typed(home, there)
                terms.append(elaborate_expression(self.world.db, home, tree).term)
                continue
            numbers = self._given(said, parameter.size) if said else self._usual(parameter)
            names = [parameter.name, *(f"{parameter.name}.{field}" for field in parameter.fields)]
            if parameter.kind != "number":
                names = names[1:] or [f"{parameter.name}_{n + 1}" for n in range(parameter.size)]
                self._parts |= {name: f"{parameter.name}.{n}" for n, name in enumerate(names)}
            self.values.update(zip(names, numbers, strict=True))
            terms.append(var(names[0]) if parameter.kind == "number" else tuple_(map(var, names)))
        return terms

    def _usual(self, parameter: SceneParameter) -> tuple[float, ...]:
        """What a live expression gives to a parameter, be it written as numbers or not."""
        if parameter.text and not parameter.value:
            try:
                return self._given(parameter.text, parameter.size)
            except PottoError:
                pass
        return parameter.value or (UNSAID,) * parameter.size

    def _stands(self, text: str) -> bool:
        """Whether an expression means something: what is offered may have errors."""
        try:
            self.world.typed(*self.world.home(self.file, text))
        except PottoError:
            return False
        return True

    def _given(self, text: str, size: int) -> tuple[float, ...]:
        value = self.world.evaluate(self.file, text).estimate.value
        found = tuple(map(float, value)) if isinstance(value, tuple) else (float(value),)
        if len(found) != size:
            raise wrong_call(f"`{text}` is {len(found)} numbers", f"{size} are needed here")
        return found

    def regions(self, wrt: str) -> tuple[DrawnIntegral, ...]:
        """The integrals of the function, with what moves as `wrt` does."""
        if wrt not in self.parameters:
            raise wrong_call(f"`{self.name}` has no number `{wrt}` to differentiate by",
                             f"its numbers are {', '.join(self.parameters)}")  # fmt: skip
        if wrt not in self._regions:
            found = regions(self.world.db, self.term, wrt, self._notation)
            if not found:
                raise wrong_call(f"`{self.name}` has no integral to look at", "name a function with an integral that "
                                 "depends on nothing but its parameters and indices")  # fmt: skip
            self._regions[wrt] = found
        return self._regions[wrt]

    @property
    def moving(self) -> str:
        """The first number by which a surface or a bound moves, else the first one."""
        for name in self.parameters:
            for region in self.regions(name):
                rates = [*(surface.rate for surface in region.surfaces), *(r for pair in region.rates for r in pair)]
                if any(rate.body is not ZERO for rate in rates):
                    return name
        return self.parameters[0]

    def standing(self, values: Mapping[str, float]) -> dict[str, Standing]:
        """Where indices stand with these values: on one of their numbers; on the first where there is none."""
        known, found = dict(values), dict[str, Standing]()
        for index in self._indices:  # outer ones first, on which the ends of others may depend
            low, high = (float(self._compiled(end)(*(known[name] for name in end.params)).value)
                         for end in (index.first, index.last))  # fmt: skip
            at = known[index.name] = max(low, min(float(np.rint(max(known[index.name], low))), high))
            found[index.name] = at, low, high
        return found

    def look(
        self, values: Mapping[str, float], wrt: str, which: int = 0, ghost: float | None = None, nodes: bool = False,
        quick: bool = False, sections: Mapping[str, float] | None = None,
    ) -> Shot:  # fmt: skip
        """The integral number `which`, from 0, with these values; `ghost`: the step of what is seen of differences,
        `nodes`: also where it was evaluated, `sections`: where variables that are not seen stand. A `quick`
        one is coarser, and mostly without numbers where these do not fit into a frame. Raises PottoError where it has
        no value."""
        known, standing = self.regions(wrt), self.standing(values)
        values = {**values, **{index: at for index, (at, _, _) in standing.items()}}
        if not 0 <= which < len(known):
            raise wrong_call(f"`{self.name}` has {len(known)} integrals", f"choose one from 1 to {len(known)}")
        key = wrt, which
        viewer = self._viewers.setdefault(key, Viewer(known[which], self._compiled, self._parts))
        begun = time.perf_counter()
        seen = viewer.look(values, wrt, ghost or 0.0, nodes, quick, sections)
        found = self._numbers(key, values, ghost, quick, time.perf_counter() - begun)
        given = {name: f"{value:.4g}" for name, value in values.items()} | self.functions
        title = f"{self.name}({', '.join(f'{name} = {text}' for name, text in given.items())})"
        return Shot(seen, found, title, wrt, standing)

    def _numbers(
        self, key: tuple[str, int], values: Mapping[str, float], ghost: float | None, quick: bool, seconds: float
    ) -> IntegralNumbers | None:
        """The numbers of a look whose picture took some seconds, if there is time for them. Where only a section has
        moved they are known."""
        wrt, which = key
        counted = wrt, which, ghost, tuple(values.items())
        if self._fine is not None and self._fine[0] == counted:
            return self._fine[1]
        start = time.perf_counter()
        took, since = self._took.get(key, 0.0), start - self._told.get(key, -math.inf)
        if quick and took > FRAME - seconds and (took > PATIENCE or since <= AGAIN):
            return None
        found = None
        with suppress(Overtime), patient(lambda: quick and time.perf_counter() - start > PATIENCE):
            found = numbers(self.regions(wrt)[which], self._compiled, values, wrt, ghost, quick)
        self._told[key] = time.perf_counter()
        if quick:
            self._took[key] = self._told[key] - start
        elif found is not None:
            self._fine = counted, found
            self._took.pop(key, None)  # when it is dragged again they are tried again
        return found

    def _compiled(self, term: Lam) -> TermFunction:
        if term not in self._functions:
            self._functions[term] = TermFunction(self.world, self.file, term)
        return self._functions[term]
