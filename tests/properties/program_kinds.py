"""What random programs are made of beside conditions, ranges and measures.

Guards, diffeomorphisms with a name, deltas of functions, infinite ranges, derivatives under integrals, shaders.

Each function takes the program in the making.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from plain_quadrature import Array, Environment, Program, Record, integral
from program_nodes import Binder, Node, call, chosen, compare, minus, name, note, number, plus, power, times, weighted
from program_terms import PARAMETERS, Terms

Curve = Callable[[Array], Array]
REACH = 9.0  # beyond it exp(-x^2) is nothing


@dataclass(frozen=True)
class Monotone:
    """A function that rises: how it is written, its inverse, its derivative; every value of sin is one of its own."""

    text: str
    run: Curve
    inverse: Curve
    rate: Curve


MONOTONE = (
    Monotone("sinh({})", np.sinh, np.arcsinh, np.cosh),
    Monotone("atan({})", np.arctan, np.tan, lambda x: 1 / (1 + x * x)),
    Monotone("(exp({}) - 1.5)", lambda x: np.exp(x) - 1.5, lambda u: np.log(u + 1.5), np.exp),
    Monotone("({} + ({})^3)", lambda x: x + x**3, lambda u: _cubic(u), lambda x: 1 + 3 * x * x),
)


def _cubic(u: Array) -> Array:
    """The root of x + x^3 = u (Cardano)."""
    r = np.sqrt(u * u / 4 + 1 / 27)
    return np.cbrt(u / 2 + r) + np.cbrt(u / 2 - r)


def guarded(source: Terms, names: list[str]) -> Node:
    """A condition, or a value, that is defined on one side of a place alone."""
    u = minus(source.name(source.pick(*names)), source.pick(number(0.1), number(-0.4), source.parameter()))
    shape, function = source.pick(("sqrt(%s)", np.sqrt), ("log(%s)", np.log), ("(%s)^1.5", lambda v: v**1.5))
    some = call(lambda v: function(np.where(v > 0, v, 1.0)), shape, u)
    then = source.bracket(compare(source.pick("<", ">="), some, source.parameter())) if source.likely(0.7) else some
    shape = source.pick("(if [%s] then %s else %s)", "([%s] ? %s : %s)")
    return chosen(shape, compare(">", u, number(0.0)), then, source.smooth(names, 1))


def chosen_plainly(source: Terms, one: Node, other: Node) -> Node:
    """Either, as the parameters say."""
    shape = source.pick("(if %s then %s else %s)", "(%s ? %s : %s)")
    condition = compare(source.pick("<", ">="), name(source.pick(*PARAMETERS)), number(source.pick(0.6, 0.25)))
    return chosen(shape, condition, one, other)


def declared(source: Terms, names: list[str]) -> Node:
    """A diffeomorphism with a name, as a condition: affine in two variables, or of one."""
    f, p = source.define("map"), source.parameter()
    if len(names) > 1 and source.likely(0.6):
        x, y = map(source.name, source.random.sample(names, 2))
        k = number(source.pick(1.0, 0.5, -2.0))
        first, at = minus(plus(x, times(k, y)), p), f"{f} ({x.text}, {y.text})"
        components = f"(u + {k.text}*v - c, u - {k.text}*v)"
        plain = f"{f} = \\(u, v) . \\c . {components}"
        source.definitions.append(f"diffeo {f}(u, v; c) = {components}" if source.likely(0.5) else plain)
    else:
        v, g = source.name(source.pick(*names)), source.pick(*MONOTONE[:3])
        first, at = minus(call(g.run, "%s", v), p), f"{f} ({v.text})"
        source.definitions.append(f"diffeo {f}(u; c) = ({g.text.format('u')} - c)")
    shape = source.pick(f"(if {at} ({p.text}) then %s else %s)", f"(({at} ({p.text})) ? %s : %s)")
    then, other = (source.smooth([*names, *PARAMETERS], 1) for _ in range(2))
    run = chosen("%s%s%s", compare(">=", first, number(0.0)), then, other).run
    return Node(shape % (then.text, other.text), run)


def endless(source: Terms, v: str, outer: list[str]) -> Binder:
    """An infinite range, with what makes the integral finite."""
    wide, m = number(REACH), source.name(source.pick(*outer)) if outer and source.likely(0.5) else source.parameter()
    density = call(lambda x, c: np.exp(-((x - c) ** 2)), "exp(-(%s - %s)^2)", name(v), m)
    factor, low, high = f"*{density.text}", minus(m, wide), plus(m, wide)
    text, lo, hi = source.pick(("[-inf, inf]", low, high), (f"[{m.text}, inf]", m, high), (f"[-inf, {m.text}]", low, m))
    return Binder(v, text, weighted(v, lo, hi, density), False, factor)


def at_roots(shown: str, roots: list[Curve], rate: Curve, level: Node, v: str, lo: Node, hi: Node, body: Node) -> Node:
    """A delta times a body, and what the integral of that over a variable is."""

    def run(env: Environment, record: Record | None, n: int) -> Array:
        a, b, u = lo(env, record, n), hi(env, record, n), level(env, record, n)
        total = np.zeros(n)
        for root in roots:
            x = root(u)
            note(record, x - a, b - x, b - a)
            inside = ((a < x) & (x < b)) * 1.0 - ((b < x) & (x < a)) * 1.0
            total = total + inside * body({**env, v: x}, record, n) / rate(x)
        return total

    return Node(f"({body.text})*delta({shown} - {level.text})", run)


def delta_of_a_function(source: Terms, v: str, lo: Node, hi: Node, place: Node, body: Node) -> Node:
    if source.likely(0.5):
        g = source.pick(*MONOTONE)
        return at_roots(g.text.replace("{}", v), [g.inverse], g.rate, call(np.sin, "sin(%s)", place), v, lo, hi, body)
    level = plus(power(place, 2), number(0.2))
    roots: list[Curve] = [np.sqrt, lambda u: -np.sqrt(u)]
    return at_roots(f"{v}^2", roots, lambda x: 2 * np.abs(x), level, v, lo, hi, body)


# Of a and b: what is differentiated by b, as it is written and evaluated, and its derivative.
DIFFERENTIATED: tuple[tuple[str, Callable[[Array, Array], Array], Callable[[Array, Array], Array]], ...] = (
    ("a^2*b", lambda a, b: a * a * b, lambda a, b: a * a),
    ("sin(2*a*b)", lambda a, b: np.sin(2 * a * b), lambda a, b: 2 * a * np.cos(2 * a * b)),
    ("exp(-a^2)*b^2", lambda a, b: np.exp(-a * a) * b * b, lambda a, b: 2 * b * np.exp(-a * a)),
    ("1/(1 + (a + b)^2)", lambda a, b: 1 / (1 + (a + b) ** 2), lambda a, b: -2 * (a + b) / (1 + (a + b) ** 2) ** 2),
)


def differentiated(source: Terms, v: str, lo: Node, hi: Node, place: Node) -> Node:
    """The integral over v of the derivative of a function that may jump where v passes a place."""
    g, jumps, d = source.define("part"), source.likely(0.6), source.define("d")
    text, function, rate = source.pick(*DIFFERENTIATED)
    source.definitions.append(f"def {g}(a, b) {'[a < b]*(' + text + ')' if jumps else text}")
    source.definitions.append(f"{d} = deriv({g})")
    written = source.pick(f"snd({d}(({v}, 0), ({place.text}, 1)))", f"D({g}, b)({v}, {place.text})",
                          f"grad({g}, b)({v}, {place.text})", f"snd(deriv({g})({v}, ({place.text}, 1)))")  # fmt: skip
    x = name(v)
    inside = call(rate, "%s%s", x, place)
    if jumps:
        inside = chosen("%s%s%s", compare("<", x, place), inside, number(0.0))
    smooth = integral(v, lo, hi, inside.run)
    there = call(function, "%s%s", x, place)
    jump = at_roots(v, [lambda u: u], lambda u: np.ones_like(u), place, v, lo, hi, there)

    def run(env: Environment, record: Record | None, n: int) -> Array:
        return smooth(env, record, n) + (jump(env, record, n) if jumps else 0.0)

    return Node(written, run)


def rendered(source: Terms) -> Node:
    """A function that is given a shader and integrates it over a half plane, as in the paper."""
    f, c = source.define("render"), source.parameter()
    body, p = source.smooth(["x", "y", "c"], 2), source.pick(number(0.5), name("c"))
    edge = plus(minus(name("x"), times(number(source.pick(1.0, -0.5, 2.0)), name("y"))), p)
    lit = chosen("((diffeo(%s))?%s:%s)", compare(">=", edge, number(0.0)), body, number(0.0))
    text = f"((diffeo({edge.text}))?1:0)"
    source.definitions.append(
        f"def {f}(c, shader)\n    integral ([0,1], [0,2])\n        ((shader (x,y)) c)*{text} d(x,y)"
    )
    shader = f"\\(x,y) . c. {body.text}"
    if source.likely(0.5):
        g = source.define("shader")
        source.definitions.append(f"{g} = {shader}")
        shader = g
    inner = integral("y", number(0.0).run, number(2.0).run, lit.run)
    whole: Program = integral("x", number(0.0).run, number(1.0).run, inner)
    return Node(f"{f}({c.text}, {shader})", lambda env, r, n: whole({**env, "c": c(env, r, n)}, r, n))


def around(x: Node, y: Node) -> Node:
    """The angle at which a point is seen, which jumps where y changes its sign, left of the origin."""

    def run(env: Environment, record: Record | None, n: int) -> Array:
        a, b = x(env, record, n), y(env, record, n)
        note(record, b, a)
        return np.arctan2(b, a) / math.pi

    return Node(f"(atan2({y.text}, {x.text})/pi)", run)
