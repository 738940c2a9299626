"""How far off slopes are: running errors of the formulas of partial derivatives, written down.

Owns `Loss` and `losses`. A formula is worked out from arguments that count as exact, so that what it is off comes from
its own steps: each rounds as its builtin's entry says, and passes on what its arguments are off by its own slopes
(Higham, Accuracy and Stability of Numerical Algorithms, 3.3). Products, quotients and powers pass relative errors on as
they are: these are known beforehand, and cost a kernel nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from msgspec import Struct

from potto.core.terms import Branch, Const, If, Prim, Term, postorder
from potto.kernels.whole import UNIT_ROUNDOFF
from potto.primitives import PRIMITIVES


class Loss(Struct, frozen=True):
    """What a number may be off: `part` halves of a last place of it, and what the variable `rest` holds."""

    part: float = 0.0
    rest: str | None = None

    @property
    def none(self) -> bool:
        return self.part == 0 and self.rest is None


class Writing(Protocol):
    """What losses are written into, and read values and slopes from."""

    def let(self, expression: str, letter: str = ...) -> str: ...
    def ufunc(self, name: str) -> str: ...
    def product(self, *factors: str) -> str: ...


EXACT = Loss()
Slopes = Callable[[Prim], Sequence[str]]  # the variables that hold a builtin's slopes where a formula has it


def losses(term: Term, values: Mapping[Term, str], slopes: Slopes, at: Writing) -> Loss:
    """What a formula is off. values: the variables that hold it and its parts."""
    known: dict[Term, Loss] = {}
    for node in postorder(term):
        match node:
            case Prim():
                known[node] = _of_builtin(node, [known[arg] for arg in node.args], values, slopes, at)
            case If() | Branch():
                a, b = known[node.then], known[node.orelse]
                known[node] = Loss(max(a.part, b.part), _sum([x for x in (a.rest, b.rest) if x], at))
            case _:
                known[node] = EXACT
    return known[term]


def _sum(parts: Sequence[str], at: Writing) -> str | None:
    return at.let(" + ".join(parts), "e") if parts else None


def _of_builtin(node: Prim, args: Sequence[Loss], values: Mapping[Term, str], slopes: Slopes, at: Writing) -> Loss:
    entry, own = PRIMITIVES[node.op], values[node]
    names = [values[arg] for arg in node.args]
    if entry.truth or (node.op == "add" and all(map(_is_whole, names))):
        return EXACT
    if node.op == "neg":
        return args[0]
    if node.op in ("mul", "div") or (node.op == "pow" and isinstance(node.args[1], Const)):
        return _of_product(node, args, names, own, at)
    rests, rounds = _own(node, names, own, at)
    if all(arg.none for arg in args) and (node.op != "add" or len(args) == 2):
        return Loss(rounds, _sum(rests, at))
    if node.op == "pow" and (moved := _sum(_all_of(args[1], names[1]), at)):
        slope = at.product(own, f"{at.ufunc('log')}({names[0]})", moved)
        rests.append(f"{at.ufunc('support.by_exponent')}({names[0]}, abs({slope}))")
    if node.op == "pow":
        args, names = args[:1], names[:1]
    more = max(len(args) - 2, 0) if node.op == "add" else 0  # sums on the way
    steep = ["1.0"] * len(args) if node.op == "add" else slopes(node)
    for arg, name, slope in zip(args, names, steep[: len(args)], strict=True):
        rests += [f"abs({at.product(slope, x)})" for x in _all_of(Loss(arg.part + more, arg.rest), name)]
    return Loss(rounds, _sum(rests, at))


def _is_whole(name: str) -> bool:
    """Whether a variable is a whole number, written as one."""
    try:
        return float(name).is_integer()
    except ValueError:
        return False


def _all_of(loss: Loss, name: str) -> list[str]:
    """What a number is off in all, as summands."""
    return [*([f"{loss.part * UNIT_ROUNDOFF!r}*abs({name})"] if loss.part else []), *([loss.rest] if loss.rest else [])]


def _own(node: Prim, names: Sequence[str], own: str, at: Writing) -> tuple[list[str], float]:
    """What a builtin rounds off itself."""
    entry, given = PRIMITIVES[node.op], ", ".join(names)
    rests, rounds = [], 0.0
    if callable(entry.ulp):
        rests.append(f"{at.ufunc('places.' + node.op)}({given})*{UNIT_ROUNDOFF!r}*abs({own})")
    else:
        rounds = entry.ulp
    if callable(entry.off):
        rests.append(f"{at.ufunc('strays.' + node.op)}({given})")
    elif entry.off:
        rests.append(repr(entry.off))
    return rests, rounds


def _of_product(node: Prim, args: Sequence[Loss], names: Sequence[str], own: str, at: Writing) -> Loss:
    """Products, quotients, and powers with a constant exponent: relative errors add up."""
    powers = [1.0] * len(args)
    factors, divisors = list(names), []
    rounds = sum(not _scales(arg) for arg in node.args) - 1.0
    if node.op == "div":
        factors, divisors = list(names[:1]), list(names[1:])
        rounds = 0.0 if _scales(node.args[1]) else 1.0
    if node.op == "pow":
        exponent = node.args[1]
        assert isinstance(exponent, Const)
        powers, args, rounds = [abs(exponent.value)], args[:1], 0.0 if exponent.value in (0.0, 1.0) else 2.0
    part = max(rounds, 0.0) + sum(p * arg.part for p, arg in zip(powers, args, strict=True))
    rests = []
    for i, (power, arg) in enumerate(zip(powers, args, strict=True)):
        if not arg.rest:
            continue
        if node.op == "mul":
            rests.append(f"abs({at.product(arg.rest, *factors[:i], *factors[i + 1 :])})")
        elif node.op == "div" and i == 0:
            rests.append(f"abs({at.ufunc('divide')}({arg.rest}, {divisors[0]}))")
        else:
            rests.append(f"abs({at.ufunc('divide')}({at.product(repr(power), own, arg.rest)}, {names[i]}))")
    return Loss(part, _sum(rests, at))


def _scales(term: Term) -> bool:
    """Whether to multiply or to divide by it rounds nothing off: a power of two."""
    return isinstance(term, Const) and math.frexp(abs(term.value))[0] == 0.5
