"""Numbers of a formula as a person would write them, where a computer has rounded.

Owns `in_decimals`, `decimal`, `over_whole_numbers` and `root_of_number`.
"""

from __future__ import annotations

from fractions import Fraction
from math import isfinite, isqrt, prod, ulp

from potto.core.numerals import simple_fraction
from potto.core.terms import Const, Prim, Term, add, const, div, mul, transform

_DIGITS = 15  # of a number that may have been rounded


def in_decimals(term: Term) -> Term:
    """The same term with its numbers as a person would write them: 0.1 for 0.3 - 0.2, of which a computer makes
    0.09999999999999998."""

    def change(_: Term, new: Term) -> Term:
        match new:
            case Const(name=None, value=value) if len(repr(value)) > _DIGITS:
                short = float(f"{value:.13g}")
                return const(short) if abs(short - value) <= 4 * ulp(value) else new
            case Prim(op="add" | "mul" as op, args=args) if all(map(_is_number, args)):
                numbers = [Fraction(repr(arg.value)) for arg in args if isinstance(arg, Const)]
                return const(float(sum(numbers) if op == "add" else prod(numbers)))
            case Prim(op="add", args=args) if len(several := [arg for arg in args if _is_number(arg)]) > 1:
                whole = sum(Fraction(repr(arg.value)) for arg in several if isinstance(arg, Const))
                return add(*(arg for arg in args if arg not in several), const(float(whole)))
            case Prim(op="neg", args=(Const(name=None, value=value),)):
                return const(-value)
            case Prim(op="neg", args=(Prim(op="mul", args=(Const(name=None, value=value), *rest)),)) if value < 0:
                return mul(const(-value), *rest)
            case _:
                return new

    return transform(term, change)


def decimal(value: Fraction) -> Fraction:
    """1/10 for what a computer makes of it; a number that no computer's is stays."""
    near = float(value)
    return Fraction(repr(near)) if isfinite(near) and Fraction(near) == value else value


def over_whole_numbers(term: Term) -> Term:
    """The same term without fractions below the line: 5*x/12 for x/(12/5)."""

    def change(_: Term, new: Term) -> Term:
        match new:
            case Prim(op="div", args=(top, Const(name=None, value=value))):
                below = simple_fraction(value)
                if below is not None:
                    return div(mul(const(float(below.denominator)), top), const(float(below.numerator)))
        return new

    return transform(term, change)


def root_of_number(node: Prim) -> Term:
    """0.2 for the root of 0.04, of which a computer makes 0.2 as well, if not of what it has made of 0.2*0.2."""
    (inside,) = node.args
    if not _is_number(inside) or not isinstance(inside, Const) or inside.value < 0:
        return node
    square = Fraction(repr(inside.value))
    root = Fraction(isqrt(square.numerator), isqrt(square.denominator))
    return const(float(root)) if root * root == square else node


def _is_number(term: Term) -> bool:
    return isinstance(term, Const) and term.name is None and isfinite(term.value)
