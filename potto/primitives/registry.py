"""The one table of builtins.

Owns `Primitive` and `PRIMITIVES`. An entry says all that there is to say about a builtin; parser, checker, hover,
completion, derivative, kernels, inversion, enclosures, docs and tests read it. numpy and mpmath are named, never
imported, on this floor: a rule gets the arithmetic that it is to work with.
"""

from __future__ import annotations

import builtins
import math
import operator
from collections.abc import Callable
from typing import Any, Protocol

from msgspec import Struct, field

from potto.core.terms import Prim, Term, Var, var

Terms = tuple[Term, ...]
EPS = 2.0**-52


class WhereTrue(Protocol):
    """Where something holds."""

    def __and__(self, other: Any, /) -> WhereTrue: ...
    def __or__(self, other: Any, /) -> WhereTrue: ...


class Quantity(Protocol):
    """What rules compute with: a float, an array, or a number that is written into a text."""

    def __add__(self, other: Any, /) -> Quantity: ...
    def __radd__(self, other: Any, /) -> Quantity: ...
    def __sub__(self, other: Any, /) -> Quantity: ...
    def __rsub__(self, other: Any, /) -> Quantity: ...
    def __mul__(self, other: Any, /) -> Quantity: ...
    def __rmul__(self, other: Any, /) -> Quantity: ...
    def __truediv__(self, other: Any, /) -> Quantity: ...
    def __rtruediv__(self, other: Any, /) -> Quantity: ...
    def __pow__(self, other: Any, /) -> Quantity: ...
    def __neg__(self) -> Quantity: ...
    def __abs__(self) -> Quantity: ...
    def __lt__(self, other: Any, /) -> WhereTrue: ...
    def __le__(self, other: Any, /) -> WhereTrue: ...
    def __gt__(self, other: Any, /) -> WhereTrue: ...
    def __ge__(self, other: Any, /) -> WhereTrue: ...


Ends = tuple[Quantity, Quantity]  # lower and upper bounds


class Size(Struct, frozen=True):
    """Where a number lies, and how large it is: bounds of the number, and of the logarithm of its magnitude, which say
    something also of what is beyond what doubles hold. Infinite where nothing is known."""

    lo: Any
    hi: Any
    least: Any
    most: Any


class Elementwise(Protocol):
    """What a rule may do with numbers beside arithmetic, `abs` and comparisons: the same for floats and for arrays."""

    def of(self, name: str) -> Callable[..., Quantity]:
        """The numeric form of a builtin."""

    def where(self, condition: Any, a: Any, b: Any) -> Any: ...
    def least(self, a: Any, b: Any) -> Quantity: ...
    def most(self, a: Any, b: Any) -> Quantity: ...
    def finite(self, x: Any) -> WhereTrue: ...


def _none(*args: Term) -> Terms:
    return ()


def _never(*args: Term) -> bool:
    return False


def always(*args: Term) -> bool:
    return True


class Primitive(Struct, frozen=True):
    """One builtin. What it does in a domain is a rule of its own, or else read off its `formula` (see `walking`).

    name: as core terms (and, unless `surface` is False, programs) call it.
    arity: number of arguments; None for any number (add, mul, min, max take two or more).
    formula: what it is in terms of other builtins; every rule that an entry leaves out is that of the formula. With no
        numeric form it must be one that keeps its digits in doubles.
    orders: how many of the first arguments are numbers that are written down: nothing is differentiated by them.
    domain: per argument an interval where it is defined and tests may sample: a promise.
    doc: one or two sentences for a person. example: an expression of Potto that a doc page shows, with its value.
    topic: the section of the page of builtins.
    lacks: the domains that it has no rule for: a bare list of debts, which the tests hold against the rules.
    plain: takes plain values only (sign, floor, ceil). truth: a truth value.
    brackets: for those that jump, their jumps as brackets, for messages.

    Values:
    numpy: the name of a ufunc: "sqrt" is numpy's, "special.erf" is scipy.special's, "potto.xyz" is one of
        potto.kernels.ufuncs (for `clamp` and the like).
    mpmath: the name of the function in mpmath; "potto.xyz" is one of potto.core.reference.functions, "operator.xyz" and
        "builtins.xyz" are Python's.
    scalar: the same for numbers one by one, "math.xyz" as a rule; where there is none mpmath is asked.
    ulp: what its numeric form may be off, in units of half a last place, as a number or by the arguments; 0 if its
        values are those of an argument, perhaps with the other sign.
    off: what it may be off beside that, absolutely, as a number or by the arguments: of functions that keep no digits
        where they cross 0.
    guarded: whether the numeric form has values also outside of `within`, which are not the builtin's.

    Derivatives:
    partials: the partial derivatives as terms over the arguments; None for a builtin that jumps.
    kinks: terms over the arguments whose zeros are kinks (abs: x; max: a - b).
    steps: terms over the arguments whose zeros are jumps, of a builtin that jumps (floor: x - floor(x); <: a - b).
    cases: for builtins that choose, a margin, what they are where that is >= 0, and what they are elsewhere.
    extremes: for those of them that are the greatest or the least of terms, what they are by max and min.
    edges: terms over the arguments that are 0 at the edge of the domain and where the builtin or its derivative is
        singular (sqrt: x; log: x; asin: 1 - x, 1 + x).
    exponents: terms over the arguments by whose differences the logarithm of it, or of a part of it, changes (exp: x).
    steep: by the arguments, whether a slope may be infinite, or nan, where the builtin is finite (sqrt: at 0).
    broken: whether it may have a pole, or jump by itself.
    centered: whether it changes mostly where its argument is near 0.

    Shape, of builtins of one argument beside orders:
    within: the interval on which it is defined. image: an interval that holds its values (of any number of arguments).
    increasing: +1 strictly increasing on its domain, -1 decreasing, 0 neither.
    turns: where it turns from rising to falling or back, all of them; None if there are many, or they are not known.
    roots: where it is 0, all of them (of a period); None if there are many, or they are not known. A builtin of more
        arguments with the roots (0.0,) is 0 where all of them are.
    parity: +1 for f(-x) = f(x), -1 for f(-x) = -f(x), 0 for neither.
    values: arguments and what it is there, exactly (exp: 0 and 1).
    inverse: given y, the solutions x of f(x) = y on the principal branch(es), as terms, nan where there is none
        (sqrt: y^2 where y >= 0; abs: y and -y; sin: asin y). None if not invertible so.
    period: for periodic ones, the period of f and further solutions of f(x) = y within one period
        (sin: 2 pi, (pi - asin y,)).

    Enclosures:
    interval: bounds of its values for arguments within bounds, given the arithmetic and the bounds of each argument;
        a third item says where there is no value. What has `turns` needs none. Rounding is the walker's business.
    magnitude: given the arithmetic and the `Size` of each argument: bounds of the logarithm of its magnitude. What has
        finite bounds needs none.
    remainder: given the arithmetic, the orders, m and d: what f(z) has at most beyond f(m) + f'(m) (z - m) in the disc
        |z - m| <= d of the complex plane; nan where it is not analytic there.
    """

    name: str
    arity: int | None
    doc: str
    domain: tuple[tuple[float, float], ...] = ()
    formula: Callable[..., Term] | None = None
    example: str = ""
    topic: str = ""
    orders: int = 0
    lacks: frozenset[str] = frozenset()
    plain: bool = False
    brackets: str = ""
    surface: bool = True
    truth: bool = False

    numpy: str = ""
    mpmath: str = ""
    scalar: str = ""
    ulp: float | Callable[..., Any] = 1.0
    off: float | Callable[..., Any] = 0.0
    guarded: bool = False

    partials: Callable[..., Terms] | None = None
    kinks: Callable[..., Terms] = field(default=_none)
    steps: Callable[..., Terms] = field(default=_none)
    cases: Callable[..., tuple[Term, Term, Term]] | None = None
    extremes: Callable[..., Term] | None = None
    edges: Callable[..., Terms] = field(default=_none)
    exponents: Callable[..., Terms] = field(default=_none)
    steep: Callable[..., bool] = field(default=_never)
    broken: bool = False
    centered: bool = False

    within: tuple[float, float] = (-math.inf, math.inf)
    image: tuple[float, float] = (-math.inf, math.inf)
    increasing: int = 0
    turns: tuple[float, ...] | None = None
    roots: tuple[float, ...] | None = None
    parity: int = 0
    values: tuple[tuple[float, float], ...] = ()
    inverse: Callable[[Term], Terms] | None = None
    period: Callable[[Term], tuple[Term, Terms]] | None = None

    interval: Callable[..., tuple[Any, ...]] | None = None
    magnitude: Callable[..., tuple[Any, Any]] | None = None
    remainder: Callable[..., Any] | None = None

    def places(self, *args: Any) -> Any:
        """What the numeric form may be off at some arguments, in units of half a last place."""
        return self.ulp(*args) if callable(self.ulp) else self.ulp

    def strays(self, *args: Any) -> Any:
        """What it may be off beside that, absolutely."""
        return self.off(*args) if callable(self.off) else self.off

    @property
    def piecewise_monotone(self) -> bool:
        """Whether its ends and its turns are its extremes."""
        return self.arity == 1 and (self.increasing != 0 or self.turns is not None)

    @property
    def analytic(self) -> bool:
        """Whether it is one analytic function wherever it is defined, poles and edges aside."""
        return not (self.truth or self.plain or self.cases is not None)


PRIMITIVES: dict[str, Primitive] = {}
EXPONENT = "pow", 1  # a builtin and its argument by which there may be no derivative where there is one by the other
UNDOES: dict[str, str] = {}
"""f and g with f(g(x)) = x wherever g(x) is defined: read off the inverses."""
EXACT: dict[tuple[str, float], float] = {}
"""Values of builtins of one argument that are known exactly."""


def of_python(name: str) -> Callable[..., Any]:
    """A function of one of Python's own modules, by both names."""
    module, _, name = name.rpartition(".")
    return getattr({"math": math, "operator": operator, "builtins": builtins}[module], name)  # type: ignore[no-any-return]


def register(primitive: Primitive) -> Primitive:
    if primitive.name in PRIMITIVES:
        raise ValueError(f"builtin {primitive.name} is registered twice")
    PRIMITIVES[primitive.name] = primitive
    if primitive.inverse is not None:
        match primitive.inverse(var("y")):
            case (Prim(op=inverse, args=(Var(),)), *_):
                UNDOES[primitive.name] = inverse
    if primitive.arity == 1:
        odd = ((0.0, 0.0),) if primitive.parity < 0 else ()
        EXACT.update(
            ((primitive.name, x), y) for x, y in (*odd, *((r, 0.0) for r in primitive.roots or ()), *primitive.values)
        )
    return primitive
