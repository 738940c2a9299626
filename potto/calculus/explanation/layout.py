"""A derivative in symbols as text: its parts, and how they are laid out for a person.

Owns `DerivativeText`, `IntegralText` and `SurfaceText`, which `explain` fills. There are no terms here: formulas are
text already.
"""

from __future__ import annotations

from msgspec import Struct

WIDTH = 100


class SurfaceText(Struct, frozen=True):
    """One surface of an integral: its equation, the parameters that move it, and where it is in one variable."""

    equation: str
    moved_by: tuple[str, ...]
    roots: tuple[str, ...]


class IntegralText(Struct, frozen=True):
    """The derivative of one integral.

    integrand: what is integrated. interior: its derivative between the surfaces. deltas: its derivative on them.
    bounds: what moving bounds add. boundary: the deltas integrated out; empty where `reason` says why not.
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


class DerivativeText(Struct, frozen=True):
    """The derivative of a definition in symbols. `text` is all of it; the fields are for those who lay it out anew.

    tangent: the whole of it, deltas integrated out. alone: the definition is its one integral and nothing else.
    surfaces: where it jumps as a function of its parameters, if there is no integral; deltas: its derivative there,
    which `tangent` ends with; smooth: what it is before.
    conditions: where it has a value. problems: why there is no whole in symbols.
    by: the name of a definition that is this derivative, if it was asked about that.
    parameters: what it is differentiated by; the tangent of `t` is `dt`.
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

    @property
    def notes(self) -> tuple[str, ...]:
        return (*(f"has a value where {condition}" for condition in self.conditions), *self.problems)

    @property
    def text(self) -> str:
        return "\n".join(_lines(self))


def _lines(found: DerivativeText) -> list[str]:
    lines = [f"{found.by or 'd' + found.name} : {found.type}", ""]
    if not found.alone and found.tangent:
        lines += [*_wrapped(f"D {found.name} = ", found.tangent), ""]
    for number, item in enumerate(found.integrals, 1):
        title = found.name if found.alone else f"integral {number}"
        lines += [*_of_integral(title, item), ""]
    if found.alone and found.tangent:
        lines += ["integrated:", *_wrapped(f"  D {found.name} = ", found.tangent), ""]
    lines += [f"note: `{found.by}` is the derivative of `{found.name}`"] if found.by else []
    lines += [f"note: {note}" for note in found.notes]
    while lines and not lines[-1]:
        lines.pop()
    return lines


def _of_integral(title: str, item: IntegralText) -> list[str]:
    lines = [f"D {title} = {item.head}"]
    parts = [(item.interior, "interior")] if item.interior and (item.interior != "0" or not item.deltas) else []
    parts += [(text, "boundary") for text in item.deltas]
    width = min(WIDTH, max((len(text) for text, _ in parts), default=0))
    for number, (text, kind) in enumerate(parts):
        lines.append(f"    {'+ ' if number else '  '}{text.ljust(width)}   # {kind}")
    lines.append(f"    d({item.variables})")
    lines += [f"  + {text}   # moving bound" for text in item.bounds]
    if item.surfaces:
        lines += ["", "surfaces:"]
        for surface in item.surfaces:
            moved = f"moved by {', '.join(surface.moved_by)}" if surface.moved_by else "moved by no parameter"
            where = f"; {', '.join(surface.roots)}" if surface.roots else ""
            lines.append(f"  {surface.equation}   ({moved}{where})")
    if item.boundary:
        lines += ["", "boundary:"]
        lines += [line for text in item.boundary for line in _wrapped("  ", text)]
    if item.reason:
        lines += ["", f"boundary: found by numbers, because {item.reason}"]
    return lines


def _wrapped(head: str, text: str) -> list[str]:
    """A long sum over several lines, cut where it is a sum at the outside."""
    if len(head) + len(text) <= WIDTH:
        return [head + text]
    pieces: list[str] = []
    depth = start = 0
    for i, char in enumerate(text):
        depth += (char in "([{") - (char in ")]}")
        if depth == 0 and text.startswith((" + ", " - "), i) and i > start:
            pieces.append(text[start:i])
            start = i + 1
    pieces.append(text[start:])
    indent = " " * min(len(head), 8)
    return [head + pieces[0], *(indent + piece for piece in pieces[1:])]
