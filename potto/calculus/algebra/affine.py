"""Affine maps with symbolic coefficients.

Owns `affine` (coefficients of a term in several variables), `determinant` and `solve_affine`. Whether a determinant
vanishes for particular parameters is a question of run time; here it is a term.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from potto.calculus.algebra.polynomial_in import in_powers
from potto.calculus.algebra.radicals import quotient
from potto.calculus.algebra.rational_form import is_zero, shorter
from potto.core.terms import ONE, ZERO, Term, add, mul, neg, sub

Matrix = tuple[tuple[Term, ...], ...]

LARGEST = 8


class Affine(Struct, frozen=True):
    """sum of coefficient_i * variable_i + rest."""

    coefficients: tuple[Term, ...]
    rest: Term


def affine(term: Term, variables: Sequence[str]) -> Affine | None:
    """The term as an affine function of the variables; None if it is none."""
    names = frozenset(variables)
    coefficients: list[Term] = []
    rest = term
    for name in variables:
        found = in_powers(rest, name, 1)
        if found is None:
            return None
        coefficient, rest = shorter(found[0]), found[1]
        if coefficient.free & names:
            return None
        coefficients.append(ZERO if is_zero(coefficient) else coefficient)
    return Affine(tuple(coefficients), rest)


def determinant(matrix: Matrix) -> Term:
    """The determinant as a term, by minors; each minor once."""
    size = len(matrix)
    minors: dict[int, Term] = {0: ONE}
    for row in reversed(range(size)):
        level: dict[int, Term] = {}
        for mask, minor in minors.items():
            for column in range(size):
                entry = matrix[row][column]
                if mask >> column & 1 or entry is ZERO or minor is ZERO:
                    continue
                before = bin(mask & ((1 << column) - 1)).count("1")
                part = mul(entry, minor)
                part = neg(part) if before % 2 else part
                whole = mask | 1 << column
                level[whole] = add(level[whole], part) if whole in level else part
        minors = level
    return shorter(minors.get((1 << size) - 1, ZERO))


def solve_affine(rows: Sequence[Affine], values: Sequence[Term]) -> tuple[Term, ...] | None:
    """The variables at which the affine functions take the values; None where the matrix is singular."""
    size = len(rows)
    matrix = tuple(r.coefficients for r in rows)
    det = determinant(matrix)
    if size > LARGEST or is_zero(det):
        return None
    right = [sub(v, r.rest) for r, v in zip(rows, values, strict=True)]
    solution: list[Term] = []
    for column in range(size):
        parts: list[Term] = []
        for row in range(size):
            minor = tuple(r[:column] + r[column + 1 :] for i, r in enumerate(matrix) if i != row)
            cofactor = determinant(minor)
            if cofactor is not ZERO and not is_zero(cofactor):
                parts.append(mul(neg(cofactor) if (row + column) % 2 else cofactor, right[row]))
        solution.append(shorter(quotient(add(*parts), det)))
    return tuple(solution)
