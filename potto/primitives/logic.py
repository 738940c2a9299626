"""Comparisons and logic: they make truth values, which stand only in plain conditions.

`a > b` is written `b < a` in core terms, `a >= b` is `b <= a`.
"""

from __future__ import annotations

from potto.core.terms import Term, sub
from potto.primitives.registry import Primitive, Terms, register

_ANY = (-1e6, 1e6)


def _difference(*numbers: Term) -> Terms:
    return (sub(*numbers),)


def _none(*conditions: Term) -> Terms:
    return ()


def _truth(name: str, arity: int, numpy: str, doc: str, example: str, python: str = "") -> Primitive:
    return register(
        Primitive(
            name,
            arity=arity,
            numpy=numpy,
            mpmath=python or f"operator.{name}",
            scalar=python or f"operator.{name}",
            doc=doc,
            plain=True,
            surface=False,
            truth=True,
            steps=_none if numpy.startswith("logical") else _difference,
            domain=(_ANY,) * arity,
            example=example,
        )
    )


lt = _truth("lt", 2, "less", "Whether the first number is less than the second.", "if 1 < 2 then 1 else 0")
le = _truth("le", 2, "less_equal", "Whether the first number is at most the second.", "if 2 <= 2 then 1 else 0")
eq = _truth("eq", 2, "equal", "Whether two numbers are equal.", "if 1 == 2 then 1 else 0")
ne = _truth("ne", 2, "not_equal", "Whether two numbers differ.", "if 1 != 2 then 1 else 0")
and_ = _truth("and", 2, "logical_and", "Whether both conditions hold.", "if 1 < 2 and 2 < 3 then 1 else 0",
              "builtins.min")  # fmt: skip
or_ = _truth("or", 2, "logical_or", "Whether at least one condition holds.", "if 1 < 2 or 3 < 2 then 1 else 0",
             "builtins.max")  # fmt: skip
not_ = _truth("not", 1, "logical_not", "Whether the condition does not hold.", "if not 2 < 1 then 1 else 0",
              "operator.not_")  # fmt: skip
