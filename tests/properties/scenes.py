"""Programs about scenes in every spelling: numbers, tuples, records, arrays and functions that hold the same steps.

A scene is the function

    F = outer(sum of c * integral over [lo, hi] of x^p [x > u] dx)     or, over the unit square,
    F = outer(sum of c * area where x + y < u)

of a few numbers, on which the factors c and the places u depend. Owns `scene`, which makes one from a seed with all the
texts that say it, and `Jet`, in which its value, gradient and second derivatives are worked out by closed forms: it
knows nothing of Potto.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import product
from operator import add

import numpy as np

Numbers = np.ndarray


@dataclass(frozen=True)
class Jet:
    """A number with its gradient and its matrix of second derivatives."""

    value: float
    slopes: Numbers
    bends: Numbers

    @staticmethod
    def of(value: float, count: int, place: int | None = None) -> Jet:
        slopes = np.zeros(count)
        if place is not None:
            slopes[place] = 1.0
        return Jet(value, slopes, np.zeros((count, count)))

    def __add__(self, other: Jet) -> Jet:
        return Jet(self.value + other.value, self.slopes + other.slopes, self.bends + other.bends)

    def __mul__(self, other: Jet) -> Jet:
        cross = np.outer(self.slopes, other.slopes)
        bends = self.value * other.bends + other.value * self.bends + cross + cross.T
        return Jet(self.value * other.value, self.value * other.slopes + other.value * self.slopes, bends)

    def through(self, value: float, slope: float, bend: float) -> Jet:
        """A function of one number, of which value, slope and second derivative here are told."""
        return Jet(value, slope * self.slopes, slope * self.bends + bend * np.outer(self.slopes, self.slopes))

    def times(self, factor: float) -> Jet:
        return self.through(factor * self.value, factor, 0.0)

    def power(self, n: int) -> Jet:
        return self.through(
            self.value**n,
            n * self.value ** (n - 1) if n else 0.0,
            n * (n - 1) * self.value ** (n - 2) if n > 1 else 0.0,
        )

    def above(self) -> Jet:
        """max(self, 0)."""
        return self if self.value > 0 else self.times(0.0)


@dataclass(frozen=True)
class Step:
    """c * x^p [x > u] or [x < u]; over the square c * [x + y < u]. Places and factors: a text of slots, and its jet."""

    factor: tuple[str, Jet]
    place: tuple[str, Jet]
    power: int
    up: bool

    def integral(self, lo: float, hi: float) -> Jet:
        u, n = self.place[1], self.power + 1
        inside = u if lo < u.value < hi else u.times(0.0) + Jet.of(min(max(u.value, lo), hi), len(u.slopes))
        end = Jet.of(hi if self.up else lo, len(u.slopes))
        found = (end.power(n) + inside.power(n).times(-1.0)).times(1 / n)
        return self.factor[1] * (found if self.up else found.times(-1.0))

    def area(self) -> Jet:
        u = self.place[1]
        corners = [(u + Jet.of(-float(i + j), len(u.slopes))).above().power(2).times((-1.0) ** (i + j) / 2)
                   for i, j in product((0, 1), repeat=2)]  # fmt: skip
        return self.factor[1] * reduce(add, corners)


@dataclass(frozen=True)
class Scene:
    """A program, how its function is called, and what it and its derivatives are.

    program: the definitions, of which `f` is asked. arguments: what f is called with, as Python values. text: the same,
    as Potto writes it. slots: for each number which argument it is in and how to get there, as fields and indices.
    names: of the parameters. answer: in all numbers.
    """

    program: str
    arguments: tuple[object, ...]
    text: str
    slots: tuple[tuple[int, tuple[int, ...]], ...]
    names: tuple[str, ...]
    answer: Jet


@dataclass
class _Parameters:
    """The parameters of f while they are made up."""

    records: list[str]
    written: list[str]
    names: list[str]
    values: list[object]
    texts: list[str]
    slots: list[tuple[int, tuple[int, ...]]]
    reads: list[str]
    numbers: list[float]


def _number(pick: random.Random) -> float:
    return round(pick.uniform(0.15, 0.9), 4)


def _parameter(pick: random.Random, into: _Parameters) -> None:
    kind = pick.choice(["number", "number", "tuple", "array", "record", "records", "matrix", "nested"])
    name = "abcdeg"[len(into.names)] + pick.choice(["", "1", "_"])
    place = len(into.names)
    into.names.append(name)
    record = f"R{place}"

    def slot(read: str, *path: int) -> float:
        into.slots.append((place, path))
        into.reads.append(read)
        into.numbers.append(_number(pick))
        return into.numbers[-1]

    value: object
    match kind:
        case "number":
            value = slot(name)
            type, text = None, str(value)
        case "tuple":
            value = (slot(f"{name}.0", 0), slot(f"{name}.1", 1))
            type, text = "(Real, Real)", str(value)
        case "array":
            value = [slot(f"{name}[{i}]", i) for i in range(pick.randint(1, 3))]
            type, text = f"[n{place}] Real", str(value)
        case "matrix":
            value = [[slot(f"{name}[{i}, {j}]", i, j) for j in range(2)] for i in range(2)]
            type, text = f"[n{place}, 2] Real", str(value)
        case "record":
            into.records.append(f"record {record}(p: Real, q: (Real, Real))")
            p, q, r = slot(f"{name}.p", 0), slot(f"{name}.q.0", 1, 0), slot(f"{name}.q.1", 1, 1)
            value, type, text = (p, (q, r)), record, f"{record}({p}, ({q}, {r}))"
        case "records":
            into.records.append(f"record {record}(p: Real, q: Real)")
            rows = [(slot(f"{name}[{i}].p", i, 0), slot(f"{name}[{i}].q", i, 1)) for i in range(pick.randint(1, 2))]
            value, type = rows, f"[n{place}] {record}"
            text = f"[{', '.join(f'{record}({p}, {q})' for p, q in rows)}]"
        case _:
            into.records.append(f"record {record}(p: [2] Real, q: Real)")
            p0, p1, q = slot(f"{name}.p[0]", 0, 0), slot(f"{name}.p[1]", 0, 1), slot(f"{name}.q", 1)
            value, type, text = ([p0, p1], q), record, f"{record}([{p0}, {p1}], {q})"
    into.written.append(name if type is None else f"{name}: {type}")
    into.values.append(value)
    into.texts.append(text)


def scene(seed: int) -> Scene:
    """The scene of a seed."""
    pick = random.Random(seed)
    into = _Parameters([], [], [], [], [], [], [], [])
    for _ in range(pick.randint(1, 3)):
        _parameter(pick, into)
    count = len(into.numbers)
    jets = [Jet.of(value, count, place) for place, value in enumerate(into.numbers)]

    def mixed(low: float, high: float) -> tuple[str, Jet]:
        """A sum of some of the numbers with factors, within bounds, so that no step is at an end."""
        while True:
            text, found = "", Jet.of(0.0, count)
            for place in pick.sample(range(count), min(count, pick.randint(1, 2))):
                factor = pick.choice([1.0, 1.0, -1.0, 0.5, 2.0])
                text += f" + {factor:g}*{into.reads[place]}" if factor != 1 else f" + {into.reads[place]}"
                found = found + jets[place].times(factor)
            if pick.random() < 0.3:
                other = pick.randrange(count)
                text, found = f" + ({text[3:]})*{into.reads[other]}", found * jets[other]
            shift = round(pick.uniform(low, high) - found.value, 3)
            return f"({text[3:]} + {shift})".replace("+ -", "- "), found + Jet.of(shift, count)

    plane = pick.random() < 0.3
    low, high = (0.1, 1.9) if plane else (-0.1, 1.1)
    power = pick.randint(0, 2)
    up, n = pick.random() < 0.5, pick.randint(1, 3)
    steps = [Step(mixed(0.5, 2.0), mixed(low, high), power, up) for _ in range(n)]
    lo, hi = (0.0, 1.0) if plane else (0.0, round(pick.uniform(0.8, 1.0), 2))
    answer = reduce(add, (step.area() if plane else step.integral(lo, hi) for step in steps))
    definitions, body = _spelled(pick, steps, plane, lo, hi)
    body, answer = _outside(pick, body, answer, into.reads[0], jets[0])
    program = "\n".join([*into.records, *definitions, f"def f({', '.join(into.written)}) {body}"])
    return Scene(program, tuple(into.values), ", ".join(into.texts), tuple(into.slots), tuple(into.names), answer)


def _outside(pick: random.Random, body: str, answer: Jet, read: str, jet: Jet) -> tuple[str, Jet]:
    """A function of the integral."""
    a = answer.value
    match pick.randrange(6):
        case 0:
            return f"({body})^2", answer.power(2)
        case 1:
            return f"sin({body})", answer.through(math.sin(a), math.cos(a), -math.sin(a))
        case 2:
            return f"{read}*({body}) + {read}^2", jet * answer + jet.power(2)
        case 3:
            return f"let v = {body} in v*v + v", answer.power(2) + answer
        case 4:
            return f"fold s = 1 for i in 0..1 (s*({body}))", answer.power(2)
        case _:
            return body, answer


def _spelled(pick: random.Random, steps: Sequence[Step], plane: bool, lo: float, hi: float) -> tuple[list[str], str]:
    """Definitions, and the sum of the integrals as one of many texts."""
    binder, domain = ("d(x, y)", "([0, 1], [0, 1])") if plane else ("d(x)", f"[{lo:g}, {hi:g}]")
    weight = "1" if plane else f"x^{steps[0].power}"
    variables, stars = ("x, y", "x: Real*, y: Real*") if plane else ("x", "x: Real*")
    both = "Real*, Real*" if plane else "Real*"

    def where(u: str) -> str:
        if plane:
            return pick.choice([f"[x + y < {u}]", f"[{u} > y + x]", f"[2*x - {u} < -2*y + x + y]"])
        return f"[x > {u}]" if steps[0].up else pick.choice([f"[x < {u}]", f"(1 - [x >= {u}])"])

    def term(c: str, u: str) -> str:
        return f"{c}*{weight}*{where(u)}"

    def whole(integrand: str) -> str:
        return f"(integral {domain} {integrand} {binder})"

    cs, us = [step.factor[0] for step in steps], [step.place[0] for step in steps]
    pairs = ", ".join(f"({c}, {u})" for c, u in zip(cs, us, strict=True))
    last, summand = len(steps) - 1, term("s.c", "s.u")
    ck, uk = f"[{', '.join(cs)}][k]", f"[{', '.join(us)}][k]"
    spellings: list[Callable[[], tuple[list[str], str]]] = [
        lambda: ([], whole(f"({' + '.join(map(term, cs, us))})")),
        lambda: ([], "(" + " + ".join(whole(term(c, u)) for c, u in zip(cs, us, strict=True)) + ")"),
        lambda: ([], whole(f"(sum k in 0..{last} ({term(ck, uk)}))")),
        lambda: ([], f"(sum k in 0..{last} {whole(term(ck, uk))})"),
        lambda: ([], whole(f"(sum t in [{pairs}] ({term('t.0', 't.1')}))")),
        lambda: ([], f"(sum t in [{pairs}] {whole(term('t.0', 't.1'))})"),
        lambda: ([], "(sum h in [" + ", ".join(f"\\({variables}) . {term(c, u)}" for c, u in zip(cs, us, strict=True))
                 + f"] {whole(f'h({variables})')})"),
        lambda: ([f"def h({stars}, c, u) {term('c', 'u')}"],
                 whole("(" + " + ".join(f"h({variables}, {c}, {u})" for c, u in zip(cs, us, strict=True)) + ")")),
        lambda: ([f"def h(c, u)({stars}) {term('c', 'u')}"],
                 whole(f"(sum t in [{pairs}] (h(t.0, t.1)({variables})))")),
        lambda: ([f"def over(h: ({both}) -> Real*) {whole(f'h({variables})')}"],
                 "(" + " + ".join(f"over(\\({variables}) . {term(c, u)})" for c, u in zip(cs, us, strict=True)) + ")"),
        lambda: (["record S(c: Real, u: Real)", f"def one(s: S) {whole(term('s.c', 's.u'))}"],
                 f"(sum s in [S(t.0, t.1) for t in [{pairs}]] (one(s)))"),
        lambda: (["record S(c: Real, u: Real)", f"def all(ss: [n] S) {whole(f'(sum s in ss ({summand}))')}"],
                 f"all([{', '.join(f'S({c}, {u})' for c, u in zip(cs, us, strict=True))}])"),
        lambda: ([], f"(fold s = 0 for k in 0..{last} (s + {whole(term(ck, uk))}))"),
        lambda: ([], f"(let cs = [{', '.join(cs)}]; us = [{', '.join(us)}]; "
                 f"g = \\(k, {variables}) . {term('cs[k]', 'us[k]')} in "
                 f"sum k in 0..{last} {whole(f'g(k, {variables})')})"),
        lambda: ([f"def g(cs: [n] Real, us: [n] Real) [{whole(term('cs[i]', 'us[i]'))} for i in 0..n-1]"],
                 f"(sum v in g([{', '.join(cs)}], [{', '.join(us)}]) (v))"),
    ]  # fmt: skip
    return pick.choice(spellings)()
