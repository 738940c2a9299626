"""Numbers of a term as text: as they are stored, or as the program around them would have them.

Owns `Numbers`, `numeral`, `decimal` and `simple_fraction`. A term has a number alone, 0.5, whichever way it was written
or came about.
"""

from __future__ import annotations

from enum import Enum
from fractions import Fraction
from math import isfinite

_LARGEST = 64  # of what a person divides by
_FEW = 8  # digits of a decimal that a person writes


class Numbers(Enum):
    """How numbers that are not whole are written: 0.5 as it is stored, 1/2 where a program has whole numbers alone, and
    where it has decimals 0.1 for a tenth too."""

    STORED = "stored"
    FRACTIONS = "fractions"
    DECIMALS = "decimals"


def numeral(value: float, numbers: Numbers) -> str:
    """A number as Potto source; as a fraction only if that is the same double."""
    simple = simple_fraction(value) if numbers is Numbers.FRACTIONS else None
    return repr(value).removesuffix(".0").replace("e-0", "e-") if simple is None else str(simple)


def simple_fraction(value: float) -> Fraction | None:
    """The fraction that a person would write for a number that is not whole; None if it has none."""
    if not isfinite(value) or value.is_integer():
        return None
    simple = Fraction(value).limit_denominator(_LARGEST)
    return simple if float(simple) == value else None


def decimal(top: float, below: float) -> float | None:
    """The value of a quotient of whole numbers if it is a decimal of few digits, 0.64 for 16/25; None for others."""
    if not (top.is_integer() and below.is_integer() and below):
        return None
    text = repr(top / below)
    return float(text) if len(text) <= _FEW and Fraction(text) == Fraction(top) / Fraction(below) else None
