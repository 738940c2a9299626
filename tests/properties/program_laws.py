"""Laws that answers keep whatever the program is: no reference is needed, so that conditions may be anything.

Owns `law`, `Law` and `kept`. A law says that two ways to write a sum of integrals are equal: a condition and its
contrary make the whole, a range is its parts, brackets that are multiplied are both true, variables may change places
or be written in others. Values and derivatives of both must agree within what they report.
"""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable
from dataclasses import dataclass

import potto
from potto.diagnostics import PottoError

BUDGET = 200_000
SLOW = 20.0  # seconds of processor time
OVER = 4.0  # how far beyond their budget both sides together may go: a law has at most six integrals, each of its own
PLACES = (0.0, 1.0, 0.5, -0.5, 0.7, 1e-8, 2.0)
AFFINE = ("{x} + {y} {r} {p}", "{x} - {y} {r} {p}", "{x} {r} {p}", "{x} {r} {p}*{y}", "{p}*{x} {r} {y} + {c}")
CURVED = (
    "{x}^2 + {y}^2 {r} {p}", "{x}*{y} {r} {p}", "{x}^2 + {p}*{x} {r} {p}^2", "{x}*{p} {r} {x}*{y}", "{x}^2 {r} {y}",
    "({x} - {p})^2 {r} {c}*{y}", "{x}^3 - {p}*{x} {r} {y}", "{x}^2 - {y}^2 {r} {p}*{x}", "{x}/(1 + {y}^2) {r} {p}",
)  # fmt: skip
BENT = (
    "abs({x})*{p} {r} {x}*{y}", "abs({x} - {p}) {r} {c}", "abs({x}) + abs({y}) {r} {p}", "max({x}, {y}) {r} {p}",
    "min({x}, {p}) {r} {c}*{y}", "max({x}*{p}, {y}) {r} {c}", "[{x} > {y}] {r} {p}", "{x} + [{y} > {p}] {r} {c}",
    "hypot({x}, {y}) {r} {p}", "sqrt(abs({x} - {p})) {r} {c}",
)  # fmt: skip
SEARCHED = (
    "sin(3*{x}) {r} {p}*{y}", "exp({x}) {r} {p} + {y}", "{x}*exp(-{y}^2) {r} {p}", "{x}^3 + {y}^3 {r} {p}*{x}*{y}",
    "atan2({y} - {p}, {x}) {r} {c}", "cos({x} + {p}) {r} {c}*{x}", "exp({p}*{x}) + {y} {r} 2",
    "log(2 + {x}) {r} {p}*{y}",
)  # fmt: skip
FACTORS = (
    "1",
    "1",
    "{x}",
    "{x} + {p}",
    "{x}*{y} + 1",
    "exp(-{x}*{p})",
    "1 + {x}^2",
    "cos({x} - {y})",
    "{p}",
    "abs({x} - {y})",
)
RANGES = ("[0, 1]", "[0, 1]", "[-1, 1]", "[-1, 2]", "[0, t]", "[-t, 1]", "[t, 1.5]", "[-2, inf]", "[-inf, inf]")
MEASURES = ("uniform(-1, 1)", "normal(0, 1)", "normal(t, 0.5)", "exponential(2)", "triangular(-1, 0, 1)")


@dataclass(frozen=True)
class Law:
    """Two functions of t that are equal, as one program: `f` and `g`."""

    name: str
    text: str
    at: float


class Author:
    """Writes integrals in words that a number draws."""

    def __init__(self, number: int) -> None:
        self.random = random.Random(number)
        self.names = ["x", "y", "z"][: self.random.choice((1, 1, 2, 2, 2, 3))]
        self.ranges = [self.range(k) for k in range(len(self.names))]

    def likely(self, share: float) -> bool:
        return self.random.random() < share

    def range(self, k: int) -> str:
        if self.likely(0.2):
            return "~ " + self.random.choice(MEASURES)
        text = self.random.choice(RANGES if self.likely(0.3) else RANGES[:6])
        # what is infinite gets a density by the factor: see `factor`
        return text if "inf" not in text or k == 0 else "[0, 1]"

    def filled(self, text: str) -> str:
        names = self.random.sample(self.names, len(self.names))
        y = names[1] if len(names) > 1 else self.random.choice(("t", "0.3"))
        place, factor = self.random.choice(("t", "t", "t", "0.4")), self.random.choice(("0.5", "0.25", "1", "0.3*t"))
        return text.format(x=names[0], y=y, p=place, c=factor, r=self.random.choice(("<", ">=", ">", "<=")))

    def condition(self, depth: int = 1) -> str:
        if depth and self.likely(0.25):
            joined = self.random.choice(("and", "or"))
            return f"({self.condition(0)} {joined} {self.condition(0)})"
        return self.filled(self.random.choice(self.random.choice((AFFINE, CURVED, BENT, SEARCHED))))

    def factor(self) -> str:
        text = "(" + self.filled(self.random.choice(FACTORS)) + ")"
        return f"exp(-x^2)*{text}" if "inf" in self.ranges[0] else text

    def integral(self, body: str, ranges: list[str] | None = None) -> str:
        """The integral of a body over all variables, the first one outermost."""
        for name, text in reversed(list(zip(self.names, ranges or self.ranges, strict=True))):
            bounds = f"({name} {text})" if text.startswith("~") else text
            body = f"(integral {bounds} ({body}) d({name}))"
        return body

    def fixed(self) -> bool:
        """Whether each variable has a range, and none of them is infinite."""
        return not any("~" in text or "inf" in text for text in self.ranges)


def case(condition: str, then: str, other: str = "0") -> str:
    return f"(if [{condition}] then {then} else {other})"


def contrary(author: Author) -> tuple[str, str]:
    p, u = author.condition(), author.factor()
    parts = (case(p, u), case(p, "0", u) if author.likely(0.5) else case(f"not ({p})", u))
    return " + ".join(map(author.integral, parts)), author.integral(u)


def parted(author: Author) -> tuple[str, str]:
    p, q, u = author.condition(), author.condition(), author.factor()
    parts = case(f"{p} and {q}", u), case(f"{p} and not ({q})", u)
    return " + ".join(map(author.integral, parts)), author.integral(case(p, u))


def united(author: Author) -> tuple[str, str]:
    p, q, u = author.condition(), author.condition(), author.factor()
    either, both = case(f"{p} or {q}", u), case(f"{p} and {q}", u)
    return (
        f"{author.integral(either)} + {author.integral(both)}",
        f"{author.integral(case(p, u))} + {author.integral(case(q, u))}",
    )


def multiplied(author: Author) -> tuple[str, str]:
    p, q, u = author.condition(), author.condition(0), author.factor()
    return author.integral(f"[{p}]*{u}*[{q}]"), author.integral(case(f"{p} and {q}", u))


def chosen(author: Author) -> tuple[str, str]:
    p, u, v = author.condition(), author.factor(), author.factor()
    return author.integral(case(p, u, v)), author.integral(f"{v} + [{p}]*({u} - {v})")


def apart(author: Author) -> tuple[str, str]:
    p, q, u, v = author.condition(), author.condition(), author.factor(), author.factor()
    one, other = case(p, u), case(q, v)
    return author.integral(f"2*{one} - {other}"), f"2*{author.integral(one)} - {author.integral(other)}"


def divided(author: Author) -> tuple[str, str]:
    """A range is its parts, cut at a place that may move."""
    body = case(author.condition(), author.factor(), author.random.choice(("0", "1")))
    if not author.fixed():
        return chosen(author)
    k = author.random.randrange(len(author.names))
    low, high = author.ranges[k][1:-1].split(", ")
    at = author.random.choice(("0.25", "t", "0.5*t", "0.3"))
    parts = [[*author.ranges[:k], text, *author.ranges[k + 1 :]] for text in (f"[{low}, {at}]", f"[{at}, {high}]")]
    return author.integral(body), " + ".join(author.integral(body, ranges) for ranges in parts)


def exchanged(author: Author) -> tuple[str, str]:
    body = case(author.condition(), author.factor(), author.factor())
    written = author.integral(body)
    order = list(zip(author.names, author.ranges, strict=True))
    author.random.shuffle(order)
    author.names, author.ranges = [name for name, _ in order], [text for _, text in order]
    return written, author.integral(body)


def called(author: Author) -> tuple[str, str]:
    """The condition and the factor behind functions of the same variables."""
    p, u = author.condition(), author.factor()
    names = ", ".join([*author.names, "t"])
    return author.integral(case(p, u)), f"def part({names}) {u}\n" + author.integral(f"[{p}]*part({names})")


LAWS: tuple[Callable[[Author], tuple[str, str]], ...] = (
    contrary, contrary, parted, united, multiplied, chosen, apart, divided, exchanged, called,
)  # fmt: skip


def law(number: int) -> Law:
    author = Author(number)
    rule = author.random.choice(LAWS)
    one, other = rule(author)
    *definitions, other = other.split("\n")
    text = "\n".join([*definitions, f"def f(t) {one}", f"def g(t) {other}"]) + "\n"
    at = author.random.choice(PLACES) if author.likely(0.5) else round(author.random.uniform(-0.5, 1.5), 3)
    return Law(rule.__name__, text, at)


@dataclass(frozen=True)
class Broken(Exception):
    """A law that is not kept. kind: in which way."""

    kind: str
    context: str

    def __str__(self) -> str:
        return f"{self.kind}\n{self.context}"


def kept(number: int) -> str:
    """What came of a law: `kept`, or why it said nothing. Raises Broken."""
    said = law(number)
    context = f"{number}: {said.name} at {said.at}\n{said.text}"
    began = time.process_time()
    try:
        with potto.settings(max_evals=BUDGET):
            module = potto.compile(said.text)
            one, other = (potto.deriv(function)((said.at, 1.0)) for function in (module.f, module.g))
    except PottoError as refused:
        raise Broken(f"refused {refused.diagnostics[0].code}", f"{context}{refused}") from refused
    except Exception as crash:
        raise Broken(f"crash {type(crash).__name__}: {crash}", context) from crash
    took = time.process_time() - began
    for a in (one, other):
        context += (
            f"{a.value} ± {a.error}, {a.tangent} ± {a.tangent_error}, {a.evals} evaluations, {a.reasons} {a.notes}\n"
        )
    size = max(1.0, abs(one.value), abs(one.tangent))
    if abs(one.value - other.value) > one.error + other.error + 1e-13 * size:
        raise Broken("value", context)
    told = one.notes or other.notes
    if not told and abs(one.tangent - other.tangent) > one.tangent_error + other.tangent_error + 1e-12 * size:
        raise Broken("slope", context)
    if took > SLOW:
        raise Broken("slow", f"{took:.0f} s: {context}")
    if one.evals + other.evals > OVER * 6 * BUDGET:
        raise Broken("over its budget", context)
    if not (
        math.isfinite(one.error + other.error) and (told or math.isfinite(one.tangent_error + other.tangent_error))
    ):
        return "without a bar"
    return "told" if told else "kept"
