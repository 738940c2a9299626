"""The kinds of core terms, and one constructor for each.

Owns the closed union `Term`. Terms are hash-consed: two equal terms are one object, so equality is `is`, hashing is
free and sharing survives every pass. Passes that walk a whole term use `postorder`, which does not recurse and visits
a shared term once. A term knows its free variables (`.free`) and a digest of its content (`.digest`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

from potto.core.consing import Base, made, make


class Const(Base, frozen=True, eq=False):
    """A number. `name` is set for named ones (`pi`), which the oracle evaluates to more digits."""

    value: float
    name: str | None


class Var(Base, frozen=True, eq=False):
    """A parameter, a variable of integration or the index of a sum. Binders in one definition have distinct names."""

    name: str


class Prim(Base, frozen=True, eq=False):
    """A builtin applied to terms. `op` names an entry of `potto.primitives`.

    add and mul take any number of arguments; neg, div, pow as named. lt le eq ne and or not make truth values, which
    stand only in the condition of an `If`.
    """

    op: str
    args: tuple[Term, ...]


class If(Base, frozen=True, eq=False):
    """A plain conditional: the condition varies with no variable of integration."""

    condition: Term
    then: Term
    orelse: Term


class Branch(Base, frozen=True, eq=False):
    """A diffeomorphic conditional: `then` where the first coordinate is >= 0 (> 0 when strict), else `orelse`.

    `coordinates` are the components of the diffeomorphism that the author wrote: only the first decides. Over no
    variable of integration it is an ordinary conditional.
    """

    coordinates: tuple[Term, ...]
    strict: bool
    then: Term
    orelse: Term

    @property
    def surface(self) -> Term:
        return self.coordinates[0]


class Tuple(Base, frozen=True, eq=False):
    items: tuple[Term, ...]


class Proj(Base, frozen=True, eq=False):
    """Component `index` (from 0) of a tuple of `size` components (0 where the size is not known)."""

    term: Term
    index: int


class ListOf(Base, frozen=True, eq=False):
    """An array whose elements are written one by one."""

    items: tuple[Term, ...]


class Array(Base, frozen=True, eq=False):
    """The array of `body` for the places `variable` from 0 to `size - 1`."""

    variable: str
    size: Term
    body: Term


class Index(Base, frozen=True, eq=False):
    """The element of an array at a place, counted from 0."""

    array: Term
    index: Term


class Length(Base, frozen=True, eq=False):
    """How many elements an array has, which are numbers that rise if that is asked. like: an array that must have as
    many. filled: it must have one."""

    array: Term
    rising: bool = False
    like: Term | None = None
    filled: bool = False


class Data(Base, frozen=True, eq=False):
    """What a file holds: a number, an array, or one `column` of it ("" for the whole); `content` is its digest."""

    path: str
    content: str
    column: str


class Lam(Base, frozen=True, eq=False):
    """A function of one group of parameters."""

    params: tuple[str, ...]
    body: Term


class App(Base, frozen=True, eq=False):
    """One group of arguments given to a function. A group of n parameters also takes one tuple of n, and back."""

    function: Term
    args: tuple[Term, ...]


class Global(Base, frozen=True, eq=False):
    """Another definition, by module (the key of its file) and name."""

    module: str
    name: str


class Integral(Base, frozen=True, eq=False):
    """The iterated integral of `body`, `variables[0]` outermost; bounds may use variables further out.

    `hints` are, per variable, points where a density is concentrated: the integrator cuts there, nothing depends on it.
    """

    variables: tuple[str, ...]
    bounds: tuple[tuple[Term, Term], ...]
    body: Term
    hints: tuple[tuple[Term, ...], ...]


class Delta(Base, frozen=True, eq=False):
    """The Dirac delta of a diffeomorphism's first coordinate."""

    coordinates: tuple[Term, ...]


class Sum(Base, frozen=True, eq=False):
    """The sum of `body` for the integers `variable` from `lo` to `hi`, both included; 0 when there are none.

    An `endless` one goes on beyond `hi` for as long as its terms matter: these fall off in the end.
    """

    variable: str
    lo: Term
    hi: Term
    body: Term
    endless: bool


class Fold(Base, frozen=True, eq=False):
    """The last of the states that begin with `start`, each `body` of the one before, for the integers `variable` from
    `lo` to `hi`; `start` when there are none. `body` sees `variable` and `state`."""

    variable: str
    lo: Term
    hi: Term
    state: str
    start: Term
    body: Term


class Deriv(Base, frozen=True, eq=False):
    """The derivative of a function: takes duals `(value, tangent)`, gives a dual."""

    function: Term


class Hole(Base, frozen=True, eq=False):
    """Where the program is wrong: evaluating it raises the diagnostic that said so.

    measure: the program is fine, but these parameters give a measure no density.
    """

    reason: str
    measure: bool = False


Term = (
    Const
    | Var
    | Prim
    | If
    | Branch
    | Tuple
    | Proj
    | ListOf
    | Array
    | Index
    | Length
    | Data
    | Lam
    | App
    | Global
    | Integral
    | Delta
    | Sum
    | Fold
    | Deriv
    | Hole
)

_NOTHING: frozenset[str] = frozenset()


def union_of(terms: Iterable[Term]) -> frozenset[str]:
    result = _NOTHING
    for term in terms:
        if term.free and not term.free <= result:
            result = result | term.free if result else term.free
    return result


# Constructors, one for each kind of term


def const(value: float, name: str | None = None) -> Const:
    value = float(value)
    value = 0.0 if value == 0 else value
    return made(Const, (Const, value.hex(), name), _NOTHING, (value, name))


def var(name: str) -> Var:
    return make(Var, frozenset((name,)), name)


def prim(op: str, *args: Term) -> Prim:
    """A builtin as it stands, nothing folded. See `add`, `mul`, ... and `apply` for the folding ones."""
    return make(Prim, union_of(args), op, args)


def if_(condition: Term, then: Term, orelse: Term) -> Term:
    if then is orelse:
        return then
    return make(If, union_of((condition, then, orelse)), condition, then, orelse)


def branch(coordinates: tuple[Term, ...], strict: bool, then: Term, orelse: Term) -> Term:
    return make(Branch, union_of((*coordinates, then, orelse)), coordinates, strict, then, orelse)


def tuple_(items: Iterable[Term]) -> Tuple:
    items = tuple(items)
    return make(Tuple, union_of(items), items)


def proj(term: Term, index: int) -> Term:
    if isinstance(term, Tuple) and index < len(term.items):
        return term.items[index]
    return make(Proj, term.free, term, index)


def list_of(items: Iterable[Term]) -> ListOf:
    items = tuple(items)
    return make(ListOf, union_of(items), items)


def array(variable: str, size: Term, body: Term) -> Array:
    return make(Array, size.free | body.free.difference((variable,)), variable, size, body)


def index(array: Term, place: Term) -> Term:
    if isinstance(array, ListOf) and isinstance(place, Const) and place.value in range(len(array.items)):
        return array.items[int(place.value)]
    return make(Index, array.free | place.free, array, place)


def length(array: Term, rising: bool = False, like: Term | None = None, filled: bool = False) -> Term:
    if filled and not _surely_filled(own := _sized(array)):
        return make(Length, own.free, own, False, None, True)
    if like is not None and length(array) is length(like):
        like = None
    if like is not None:
        own = array if rising else _sized(array)
        other = _sized(like)
        return make(Length, own.free | other.free, own, rising, other)
    if isinstance(array, ListOf) and not (rising and len(array.items) > 1 and not _rise(array.items)):
        return const(len(array.items))
    return array.size if isinstance(array, Array) and not rising else make(Length, array.free, array, rising)


def _sized(whole: Term) -> Term:
    """An array of which only the size is asked: what it is made of may vary, where the size does not."""
    while isinstance(whole, Array) and isinstance(whole.size, Length) and whole.size.like is None:
        whole = whole.size.array
    return array(whole.variable, whole.size, ZERO) if isinstance(whole, Array) else whole


def _surely_filled(whole: Term) -> bool:
    if isinstance(whole, Array):
        return isinstance(whole.size, Const) and whole.size.value > 0
    return isinstance(whole, ListOf) and len(whole.items) > 0


def _rise(items: tuple[Term, ...]) -> bool:
    numbers = [item.value for item in items if isinstance(item, Const)]
    return len(numbers) == len(items) and all(a < b for a, b in pairwise(numbers))


def data(path: str, content: str, column: str) -> Data:
    return make(Data, _NOTHING, path, content, column)


def lam(params: tuple[str, ...], body: Term) -> Lam:
    return make(Lam, body.free.difference(params), params, body)


def app(function: Term, args: tuple[Term, ...]) -> App:
    return make(App, union_of((function, *args)), function, args)


def global_(module: str, name: str) -> Global:
    return make(Global, _NOTHING, module, name)


def integral(
    variables: tuple[str, ...],
    bounds: tuple[tuple[Term, Term], ...],
    body: Term,
    hints: tuple[tuple[Term, ...], ...] | None = None,
) -> Integral:
    if hints is None:
        hints = ((),) * len(variables)
    free = body.free
    for name, (lo, hi), points in reversed(list(zip(variables, bounds, hints, strict=True))):
        free = free.difference((name,)) | lo.free | hi.free | union_of(points)
    return make(Integral, free, variables, bounds, body, hints)


def reordered(term: Integral, order: Sequence[int]) -> Integral:
    """The integral with its variables in another order, which their bounds have to allow. Hints that depend on what is
    further in now are left out."""
    variables = tuple(term.variables[i] for i in order)
    hints = []
    for number, i in enumerate(order):
        further = frozenset(variables[number + 1 :])
        hints.append(tuple(hint for hint in term.hints[i] if not hint.free & further))
    return integral(variables, tuple(term.bounds[i] for i in order), term.body, tuple(hints))


def with_integrand(term: Integral, body: Term) -> Integral:
    """The integral of something else over the same domain."""
    return integral(term.variables, term.bounds, body, term.hints)


def delta(coordinates: tuple[Term, ...]) -> Delta:
    return make(Delta, union_of(coordinates), coordinates)


def sum_(variable: str, lo: Term, hi: Term, body: Term, endless: bool = False) -> Sum:
    return make(Sum, lo.free | hi.free | body.free.difference((variable,)), variable, lo, hi, body, endless)


def with_summand(term: Sum, body: Term) -> Sum:
    """The sum of something else over the same numbers."""
    return sum_(term.variable, term.lo, term.hi, body, term.endless)


def fold(variable: str, lo: Term, hi: Term, state: str, start: Term, body: Term) -> Fold:
    free = lo.free | hi.free | start.free | body.free.difference((variable, state))
    return make(Fold, free, variable, lo, hi, state, start, body)


def deriv(function: Term) -> Deriv:
    return make(Deriv, function.free, function)


def hole(reason: str, measure: bool = False) -> Hole:
    return make(Hole, _NOTHING, reason, measure)


ZERO = const(0.0)
ONE = const(1.0)
TWO = const(2.0)
HALF = const(0.5)
NAN = const(math.nan)
PI = const(math.pi, "pi")
INF = const(math.inf, "inf")


def function_of(term: Term) -> Lam:
    """A term as a function of its free variables, in sorted order."""
    return lam(tuple(sorted(term.free)), term)
