"""Arrays taken out of integrands, so that what integrates sees numbers alone.

Owns `inlined`, `summands`, `loops`, `unrolled` and `bound`. What reads an array at a plain place is found
once, beside the integral, under a name of its own. A sum under an integral becomes a sum of integrals wherever the
integrand is linear in it; other sums, folds and arrays that vary with a variable of integration are written out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache

from potto.calculus.differentiation.dual import Differentiator
from potto.calculus.inlining.choices import at_place, calls_of_items
from potto.calculus.inlining.expand import Resolve, expanded
from potto.calculus.inlining.lattices import looks_up
from potto.calculus.inlining.unrolled import MOST_STEPS
from potto.core.binders import apart
from potto.core.terms import (
    ZERO,
    App,
    Array,
    Branch,
    Const,
    Data,
    Fold,
    Holding,
    If,
    Index,
    Integral,
    Length,
    ListOf,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    add,
    apply,
    array,
    bound_names,
    branch,
    children,
    const,
    fresh,
    if_,
    index,
    list_of,
    postorder,
    proj,
    rebuild,
    substitute,
    sum_,
    transform,
    tuple_,
    var,
    with_integrand,
    with_summand,
)

ARRAYS: tuple[type[Term], ...] = (Array, Index, Length, ListOf, Fold, Data)
READS = (Index, Length, Proj)

Loop = tuple[str, Term, Term, bool]  # the index of a sum, from, to, and whether it is endless
Summand = tuple[tuple[Loop, ...], Term]


# Calls


def inlined(term: Integral, touches: Callable[[Term], bool], resolve: Resolve, arrays: frozenset[str]) -> Integral:
    """The integral with the calls carried out that have to do with arrays, and reads pushed to where arrays are made.

    touches: whether a definition leads to arrays. arrays: the free names that stand for some.
    """
    derive = Differentiator(resolve, singular=True).function
    found = expanded(term, lambda name: resolve(name) if touches(name) else None, derive)
    if any(isinstance(node, App) and any(_is_array(arg, arrays) for arg in node.args) for node in postorder(found)):
        found = expanded(found, resolve, derive)
    found = apart(_pushed(calls_of_items(found, resolve), frozenset(bound(found))))
    assert isinstance(found, Integral)
    return found


def _is_array(term: Term, arrays: frozenset[str]) -> bool:
    return isinstance(term, Array | ListOf | Data) or (isinstance(term, Var) and term.name in arrays)


def bound(term: Term) -> Iterable[str]:
    return (name for node in postorder(term) for name in bound_names(node))


def _pushed(term: Term, varying: frozenset[str]) -> Term:
    """Reads of what varies done on the elements: of arrays that are made on the spot, chosen or added up."""

    def change(_: Term, new: Term) -> Term:
        read = isinstance(new, READS)
        return _read(new) if read and not varying.isdisjoint(new.free) else new

    return transform(term, change)


def _read(node: Term) -> Term:
    """A read of something that varies, as far inside as it goes."""
    whole = children(node)[0]
    match whole:
        case If(condition=condition, then=then, orelse=orelse):
            return if_(condition, _read_of(node, then), _read_of(node, orelse))
        case Branch():
            return branch(whole.coordinates, whole.strict, _read_of(node, whole.then), _read_of(node, whole.orelse))
        case Sum() if not isinstance(node, Length):
            return with_summand(whole, _read_of(node, whole.body))
        case Integral() if not isinstance(node, Length):
            return with_integrand(whole, _read_of(node, whole.body))
        case Array() if isinstance(node, Index):
            place = fresh(whole.variable, node.free | whole.body.free)
            checked = index(array(place, whole.size, var(place)), node.index)  # that it is one of the places
            return substitute(whole.body, {whole.variable: checked})
        case ListOf(items=items) if isinstance(node, Index) and items:
            return at_place(items, node.index)
        case _:
            return node


def _read_of(node: Term, whole: Term) -> Term:
    """The same read of another array or tuple; of one that is written out that is the item itself."""
    found = rebuild(node, (whole, *children(node)[1:]))
    return _read(found) if isinstance(found, READS) else found


# Sums


def each_integral(term: Term, change: Callable[[Integral], Term]) -> Term:
    """A term with something done to its outermost integrals."""
    found = transform(
        term,
        lambda _, new: change(new) if isinstance(new, Integral) else new,
        lambda node: () if isinstance(node, Integral) else children(node),
    )
    return found if found is term else apart(found)


def summands(term: Integral, look_ups: bool = True) -> Term:
    """An equal term with the sums that read arrays outside of the integral, where the integrand is linear in them.

    An integral of an array is an array of integrals. look_ups: whether the sums of look-ups are taken outside as well.
    """
    varying = frozenset(bound(term))
    body = term.body
    if isinstance(body, Array):
        body = substitute(body.body, {body.variable: var(place := fresh(body.variable, term.free | varying))})
        return array(place, term.body.size, with_integrand(term, body))  # type: ignore[union-attr]
    if isinstance(body, ListOf):
        return list_of(with_integrand(term, item) for item in body.items)
    parts = _Linear(varying, Holding(*ARRAYS), look_ups).parts(body)
    if parts is None:
        assert isinstance(body, Tuple)
        return tuple_(with_integrand(term, item) for item in body.items)
    if all(not loops for loops, _ in parts):
        return term
    rest = [part for loops, part in parts if not loops]
    found = [_looped(loops, with_integrand(term, part)) for loops, part in parts if loops]
    if rest:
        found.append(with_integrand(term, _added(rest)))
    return _added(found)


def _looped(loops: tuple[Loop, ...], term: Term) -> Term:
    for name, lo, hi, endless in reversed(loops):
        term = sum_(name, lo, hi, term, endless)
    return term


def _added(terms: list[Term]) -> Term:
    """The sum, component by component where one of them is a tuple."""
    if len(terms) == 1:
        return terms[0]
    size = max(_size(term) for term in terms)
    if not size:
        return add(*terms)
    return tuple_(add(*(proj(term, place) for term in terms)) for place in range(size))


def _size(term: Term) -> int:
    while isinstance(term, Sum | Integral):
        term = term.body
    return len(term.items) if isinstance(term, Tuple) else 0


class _Linear:
    """An integrand as a sum of terms, each inside of the sums over arrays that it is linear in."""

    def __init__(self, varying: frozenset[str], arrays: Holding, look_ups: bool) -> None:
        self.varying, self.arrays, self.look_ups = varying, arrays, look_ups

    def parts(self, term: Term) -> list[Summand] | None:
        """None: the items of a tuple are inside of different sums."""
        if not self.arrays(term):
            return [((), term)]
        match term:
            case Sum() if not self.varying.isdisjoint(term.body.free - {term.variable}) and self.goes_out(term):
                own = (term.variable, term.lo, term.hi, term.endless)
                return [((own, *loops), part) for loops, part in self.parts(term.body) or [((), term.body)]]
            case Prim(op="add", args=args):
                return [part for arg in args for part in self.parts(arg) or [((), arg)]]
            case Prim(op="neg" | "mul" | "div", args=args):
                return self._scaled(term, args)
            case Integral():
                return self._integrated(term)
            case Tuple(items=items):
                return self._items(items)
            case _:
                return [((), term)]

    def goes_out(self, term: Sum) -> bool:
        return self.look_ups or not looks_up(term)

    def _scaled(self, term: Prim, args: tuple[Term, ...]) -> list[Summand]:
        found = [self.parts(arg) or [((), arg)] for arg in args]
        wide = [place for place, parts in enumerate(found) if any(loops for loops, _ in parts)]
        if len(wide) != 1 or (term.op == "div" and wide[0] != 0):
            return [((), term)]
        before, after = args[: wide[0]], args[wide[0] + 1 :]
        return [(loops, apply(term.op, *before, part, *after)) for loops, part in found[wide[0]]]

    def _integrated(self, term: Integral) -> list[Summand]:
        parts = self.parts(term.body)
        own = frozenset(term.variables)
        if parts is None or any(own & (lo.free | hi.free) for loops, _ in parts for _, lo, hi, _ in loops):
            return [((), term)]
        return [(loops, with_integrand(term, part)) for loops, part in parts]

    def _items(self, items: tuple[Term, ...]) -> list[Summand] | None:
        rows = [self.parts(item) or [((), item)] for item in items]
        loops = [tuple(part[0] for part in row) for row in rows]
        if any(row != loops[0] for row in loops):
            return None if any(any(row) for row in loops) else [((), tuple_(items))]
        return [(own, tuple_(row[place][1] for row in rows)) for place, own in enumerate(loops[0])]


# Loops


def loops(term: Integral) -> tuple[Term, ...]:
    """The plain bounds of loops over arrays that vary with variables of integration: what `unrolled` has to know."""
    varying, arrays = frozenset(bound(term)), Holding(*ARRAYS)
    found: dict[Term, None] = {}
    for node in postorder(term):
        if _is_loop(node, varying, arrays):
            found.update(dict.fromkeys(part for part in _ends(node) if varying.isdisjoint(part.free)))
    return tuple(found)


def _is_loop(node: Term, varying: frozenset[str], arrays: Holding) -> bool:
    if not isinstance(node, Sum | Fold | Array) or varying.isdisjoint(node.free):
        return False
    return not isinstance(node, Sum) or arrays(node.body)


def _ends(node: Term) -> tuple[Term, ...]:
    match node:
        case Sum(lo=lo, hi=hi) | Fold(lo=lo, hi=hi):
            return lo, hi
        case Array(size=size):
            return (size,)
        case _:
            return ()


class TooMany(Exception):
    """A loop has more steps than are written out."""


@lru_cache(maxsize=1024)
def unrolled(term: Integral, known: tuple[tuple[Term, float], ...]) -> Integral:
    """The integral with the loops written out whose bounds are known. Raises TooMany."""
    varying, arrays, ends = frozenset(bound(term)), Holding(*ARRAYS), dict(known)

    def change(node: Term, new: Term) -> Term:
        known = all(part in ends or isinstance(part, Const) for part in _ends(node))
        if not (known and _is_loop(node, varying, arrays)):
            return _read(new) if isinstance(new, Index | Length | Proj) else new
        first, *last = [part.value if isinstance(part, Const) else ends[part] for part in _ends(node)]
        return _steps(new, *([first, *last] if last else [0.0, first - 1]))

    found = apart(transform(term, change))
    assert isinstance(found, Integral)
    return found


def _steps(node: Term, first: float, last: float) -> Term:
    if last - first >= MOST_STEPS:
        raise TooMany
    places = [const(float(place)) for place in range(int(first), int(last) + 1)]
    match node:
        case Sum():
            return _added([substitute(node.body, {node.variable: place}) for place in places]) if places else ZERO
        case Array():
            return list_of(substitute(node.body, {node.variable: place}) for place in places)
        case Fold():
            state = node.start
            for place in places:
                state = substitute(node.body, {node.variable: place, node.state: state})
            return state
        case _:
            return node
