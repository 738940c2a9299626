"""A derivative in symbols as text: its parts, and how they are laid out for a person.

Owns `DerivativeText`, `IntegralText` and `SurfaceText`, which `explain` fills. There are no terms here: formulas are
text already.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from msgspec import Struct

from potto.syntax.typesetting import broken, unicode

WIDTH = 100
Show = Callable[[str], str]


class SurfaceText(Struct, frozen=True):
    """One surface of an integral: its equation, the parameters that move it, and where it is in one variable."""

    equation: str
    moved_by: tuple[str, ...]
    roots: tuple[str, ...]


class IntegralText(Struct, frozen=True):
    """The derivative of one integral.

    integrand: what is integrated. interior: its derivative between the surfaces. deltas: its derivative on them.
    bounds: what moving bounds add. boundary: the deltas integrated out; empty where `reason` says why not.
    continuous: the equations of surfaces that move and on which nothing jumps. each: the indices of what it stands in,
    `i in 0..n`.
    """

    head: str
    variables: str
    integrand: str
    interior: str
    deltas: tuple[str, ...]
    bounds: tuple[str, ...]
    boundary: tuple[str, ...]
    surfaces: tuple[SurfaceText, ...]
    reason: str = ""
    continuous: tuple[str, ...] = ()
    each: str = ""

    def over(self, integrand: str) -> str:
        """The integral of a part, with the same bounds."""
        nothing = not re.search(r"[^0(), ]", integrand)
        return integrand if nothing else f"{self.head} {integrand} d({self.variables})"


class DerivativeText(Struct, frozen=True):
    """The derivative of a definition in symbols. `text` is all of it; the fields are for those who lay it out anew.

    tangent: the whole of it, deltas integrated out. alone: the definition is its one integral and nothing else.
    surfaces: where it jumps as a function of its parameters, if there is no integral; deltas: its derivative there,
    which `tangent` ends with; smooth: what it is before; continuous: where nothing jumps at a surface that moves.
    conditions: where it has a value. problems: why there is no whole in symbols.
    by: the name of a definition that is this derivative, if it was asked about that.
    parameters: what it is differentiated by; the tangent of `t` is `dt`. divisors: what `tangent` divides by though the
    definition does not: where one of them is 0 there may be a derivative of which it has no value.
    """

    name: str
    type: str
    tangent: str
    alone: bool
    integrals: tuple[IntegralText, ...]
    conditions: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    surfaces: tuple[SurfaceText, ...] = ()
    by: str = ""
    smooth: str = ""
    deltas: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    continuous: tuple[str, ...] = ()
    divisors: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        where = [f"has a value where {condition}" for condition in self.conditions]
        apart = [f"the formula holds for {divisor} != 0" for divisor in self.divisors]
        return (*where, *apart, *self.problems)

    @property
    def text(self) -> str:
        """As Potto writes it."""
        return "\n".join(_lines(self, _as_it_is))

    @property
    def typeset(self) -> str:
        """The same formulas with the signs of mathematics."""
        return "\n".join(_lines(self, self.unicode))

    @property
    def tangents(self) -> frozenset[str]:
        """The names of tangents in the formulas."""
        return frozenset(f"d{name}" for name in self.parameters)

    def unicode(self, formula: str) -> str:
        """A formula of this derivative on a line of Unicode."""
        return unicode(formula, self.tangents)


def _as_it_is(formula: str) -> str:
    return formula


def meets(equation: str) -> str:
    """What a surface adds on which both sides meet."""
    return f"0: continuous at {equation}"


def _lines(found: DerivativeText, show: Show) -> list[str]:
    lines = [f"{found.by or 'd' + found.name} : {found.type}", ""]
    mark = "D " if show is _as_it_is else "∂"
    if not found.alone and found.tangent:
        lines += [*broken(f"{mark}{found.name} = ", show(found.tangent), WIDTH), ""]
    lines += [f"  + {meets(show(where))}" for where in found.continuous]
    for number, item in enumerate(found.integrals, 1):
        title = found.name if found.alone else f"integral {number}"
        lines += [*_of_integral(f"{mark}{title}", item, show), ""]
    if found.alone and found.tangent:
        lines += ["integrated:", *broken(f"  {mark}{found.name} = ", show(found.tangent), WIDTH), ""]
    lines += [f"note: `{found.by}` is the derivative of `{found.name}`"] if found.by else []
    lines += [f"note: {note}" for note in found.notes]
    while lines and not lines[-1]:
        lines.pop()
    return lines


def _moving(text: str) -> list[str]:
    """What a bound adds or, if it is negative as a whole, takes away."""
    away = text.startswith(("-", "−")) and not any(sign in text for sign in (" + ", " - ", " − "))
    first, *more = broken(f"  {'-' if away else '+'} ", text[away:], WIDTH)
    lines = [first, *more]
    return [*lines[:-1], f"{lines[-1]}   # moving bound"]


def _of_integral(title: str, item: IntegralText, show: Show) -> list[str]:
    lines = [f"for each {show(item.each)}"] if item.each else []
    parts = [(item.interior, "interior")] if item.interior and (item.interior != "0" or not item.deltas) else []
    parts += [(text, "boundary") for text in item.deltas]
    head = f"{title} = "
    for number, (text, kind) in enumerate(parts):
        formula = broken(f"{'+ ':>{len(head)}}" if number else head, show(item.over(text)), WIDTH)
        lines += [*formula[:-1], f"{formula[-1]}   # {kind}"]
    lines += [line for text in item.bounds for line in _moving(show(text))]
    lines += [f"  + {meets(show(where))}" for where in item.continuous]
    if item.surfaces:
        lines += ["", "surfaces:"]
        for surface in item.surfaces:
            moved = f"moved by {', '.join(surface.moved_by)}" if surface.moved_by else "moved by no parameter"
            where = f"; {', '.join(map(show, surface.roots))}" if surface.roots else ""
            lines.append(f"  {show(surface.equation)}   ({moved}{where})")
    if item.boundary:
        lines += ["", "boundary:"]
        lines += [line for text in item.boundary for line in broken("  ", show(text), WIDTH)]
    if item.reason:
        lines += ["", f"boundary: found by numbers, because {item.reason}"]
    return lines
