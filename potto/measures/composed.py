"""Measures made of measures: `truncated(normal(m, s), lo, hi)`, `mixture(1, normal(0, 1), 2, uniform(0, 3))`.

Owns `parts_of`. A measure is a sum of parts, each with a weight, a support and a density: a mixture has one for each of
its components, so that each keeps its own support and its own hints; truncating cuts their supports and divides by what
is left. What a tree of measures looks like is its shape, a text with `_` for every argument:
"truncated(normal(_, _), _, _)".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, partial, reduce

from msgspec import Struct
from msgspec.structs import replace

from potto.core.terms import (
    INF,
    ONE,
    ZERO,
    Const,
    Term,
    add,
    branch,
    const,
    div,
    fresh,
    if_,
    integral,
    mul,
    neg,
    prim,
    proj,
    sub,
    sum_,
    tuple_,
    var,
)
from potto.measures.registry import MEASURES, Condition, Terms

Tree = tuple[str, tuple["Tree | None", ...]]  # a measure and what it is given: None for a number, else a measure


class Component(Struct, frozen=True):
    """A part of a measure over one variable: its weight, and as in `Measure` support, hints, density and reach.

    filled: whether anything of it is left where it was truncated; None where nothing was cut off.
    """

    weight: Term
    support: tuple[Term, Term]
    hints: Terms
    density: Callable[[Term], Term]
    valid: tuple[Condition, ...]
    discrete: bool = False
    reach: Callable[[Term], Term] | None = None
    filled: Term | None = None

    @property
    def counted(self) -> tuple[Term, Term]:
        """Of a discrete part, the first number that a sum goes over, and the one that it goes to at least."""
        first, last = self.support
        return (first, last) if self.reach is None else (first, _end("min", last, self.reach(first), INF))

    def summed(self, name: str, body: Term, dims: int | None = None) -> Term:
        """Of a discrete part, the sum of what the body is for each number, as far as it matters. dims: the size of a
        body that is a tuple."""
        last = self.support[1]
        if self.reach is not None and last is not INF:
            inside = prim("le", var(name), last)
            parts = [if_(inside, body if dims is None else proj(body, at), ZERO) for at in range(dims or 1)]
            body = parts[0] if dims is None else tuple_(parts)
        return sum_(name, *self.counted, body, self.reach is not None)


class Composition(Struct, frozen=True):
    """A way to make measures of measures.

    parameters: as a person writes them. takes: whether it may be given numbers and measures like these. parts: its
    parts, from numbers and the parts of measures.
    """

    name: str
    parameters: tuple[str, ...]
    takes: Callable[[tuple[Tree | None, ...]], bool]
    parts: Callable[[Sequence[Term | tuple[Component, ...]]], tuple[Component, ...]]
    doc: str
    example: str


COMPOSITIONS: dict[str, Composition] = {}


def parts_of(shape: str, arguments: Sequence[Term]) -> tuple[Component, ...]:
    """The parts of a measure whose shape has no `problem`."""
    return _parts(tree_of(shape), iter(arguments))


def _parts(tree: Tree, arguments: Iterator[Term]) -> tuple[Component, ...]:
    name, inside = tree
    given = [next(arguments) if inner is None else _parts(inner, arguments) for inner in inside]
    if name in COMPOSITIONS:
        return COMPOSITIONS[name].parts(given)
    measure, terms = MEASURES[name], [term for term in given if isinstance(term, Term)]
    valid = tuple((condition, f"{name}: {why}") for condition, why in measure.valid(*terms))
    support, hints = measure.support(*terms), measure.hints(*terms)
    far = measure.reach
    reach = None if far is None else lambda first: far(first, *terms)
    return (Component(ONE, support, hints, lambda x: measure.density(x, *terms), valid, measure.discrete, reach),)


def discrete(shape: str) -> bool:
    """Whether a measure is one of whole numbers only."""
    names = [name for name, inside in _trees(tree_of(shape)) if not any(inside)]
    return all(name == "categorical" or (name in MEASURES and MEASURES[name].discrete) for name in names)


@lru_cache(maxsize=1024)
def tree_of(shape: str) -> Tree:
    """A shape as a tree."""
    name, _, rest = shape.partition("(")
    found: list[Tree | None] = []
    depth = start = 0
    for place, char in enumerate(rest):
        if (char == "," and depth == 0) or (char == ")" and depth == 0):
            word = rest[start:place].strip()
            if word:
                found.append(None if word == "_" else tree_of(word))
            start = place + 1
        depth += (char == "(") - (char == ")")
    return name, tuple(found)


class Misuse(Struct, frozen=True):
    """What is wrong with a shape: of which measure in it (counted in the order of the text), and what it takes."""

    place: int
    name: str
    given: int
    wanted: tuple[str, ...] | None  # None if there is no such measure


def problem(shape: str) -> Misuse | None:
    """What is wrong with a shape, if anything is."""
    return next((found for place, tree in enumerate(_trees(tree_of(shape))) if (found := _misuse(place, tree))), None)


def _trees(tree: Tree) -> Iterator[Tree]:
    yield tree
    for inner in tree[1]:
        if inner is not None:
            yield from _trees(inner)


def _misuse(place: int, tree: Tree) -> Misuse | None:
    name, inside = tree
    if name in COMPOSITIONS:
        composition = COMPOSITIONS[name]
        return None if composition.takes(inside) else Misuse(place, name, len(inside), composition.parameters)
    if name not in MEASURES:
        return Misuse(place, name, len(inside), None)
    wanted = MEASURES[name].parameters
    return None if len(wanted) == len(inside) and not any(inside) else Misuse(place, name, len(inside), wanted)


def compose(composition: Composition) -> Composition:
    COMPOSITIONS[composition.name] = composition
    return composition


def bounding(shape: str) -> tuple[bool, ...]:
    """Of every argument, whether it decides where the support of a measure ends."""
    return tuple(_bounding(tree_of(shape)))


def _bounding(tree: Tree) -> Iterator[bool]:
    name, inside = tree
    ends: frozenset[str] = frozenset()
    if name in MEASURES:
        names = MEASURES[name].parameters
        ends = frozenset().union(*(end.free for end in MEASURES[name].counted(*map(var, names))))
    for place, inner in enumerate(inside):
        if inner is not None:
            yield from _bounding(inner)
        else:
            yield MEASURES[name].parameters[place] in ends if name in MEASURES else name == "truncated"


# Truncated


def _cut(part: Component, lo: Term, hi: Term) -> Component:
    low, high = part.support
    if part.discrete:
        lo, hi = _whole("ceil", lo), _whole("floor", hi)
    inside = _end("max", low, lo, neg(INF)), _end("min", high, hi, INF)
    left = prim("le" if part.discrete else "lt", *inside)
    return replace(part, support=inside, filled=left if part.filled is None else prim("and", part.filled, left))


def _clipped(part: Component) -> Component:
    """A continuous part of which nothing may be left: then its range has length zero instead of running backwards."""
    lo, hi = part.support
    return part if part.discrete else replace(part, support=(lo, _end("max", hi, lo, neg(INF))))


def _whole(op: str, end: Term) -> Term:
    """A bound as a whole number."""
    return end if isinstance(end, Const) and (math.isinf(end.value) or end.value.is_integer()) else prim(op, end)


def _end(op: str, own: Term, other: Term, nowhere: Term) -> Term:
    """The inner one of two ends; an infinite one says nothing."""
    if own is nowhere:
        return other
    if other is nowhere:
        return own
    if isinstance(own, Const) and isinstance(other, Const):
        return (max if op == "max" else min)(own, other, key=lambda end: end.value)
    return prim(op, own, other)


def _mass(part: Component) -> Term:
    """By the integral or the sum, not as a difference of the cdf, which has no digits in the upper tail."""
    name = fresh("inside", part.support[0].free | part.support[1].free | part.density(ZERO).free)
    if part.discrete:
        return part.summed(name, part.density(var(name)))
    return integral((name,), (part.support,), part.density(var(name)), (part.hints,))


def _truncated(given: Sequence[Term | tuple[Component, ...]]) -> tuple[Component, ...]:
    inner, lo, hi = given
    assert isinstance(inner, tuple) and isinstance(lo, Term) and isinstance(hi, Term)
    parts = [_cut(part, lo, hi) for part in inner]
    filled = [part.filled for part in parts if part.filled is not None]
    some = reduce(partial(prim, "or"), filled), "truncated: nothing is left"
    if len(parts) > 1:
        parts = [_clipped(part) for part in parts]
    left = add(*(mul(part.weight, _mass(part)) for part in parts))
    return tuple(replace(part, weight=div(part.weight, left), valid=(*part.valid, some)) for part in parts)


truncated = compose(
    Composition(
        "truncated",
        parameters=("measure", "lo", "hi"),
        takes=lambda inside: len(inside) == 3 and inside[0] is not None and inside[1:] == (None, None),
        parts=_truncated,
        doc="A measure between lo and hi only, which may be infinite: divided by what is left of it there.",
        example="integral (x ~ truncated(normal(0, 1), 0, 2)) x d(x)",
    )
)


# Mixtures


def _mixture(given: Sequence[Term | tuple[Component, ...]]) -> tuple[Component, ...]:
    weights = [term for term in given if isinstance(term, Term)]
    whole = add(*weights)
    valid = tuple((prim("le", ZERO, weight), "mixture: a weight must not be negative") for weight in weights)
    valid = (*valid, (prim("lt", ZERO, whole), "mixture: the weights must not all be 0"))
    return tuple(
        replace(part, weight=mul(div(weight, whole), part.weight), valid=(*valid, *part.valid))
        for weight, inner in zip(weights, given[1::2], strict=True)
        if isinstance(inner, tuple)
        for part in inner
    )


mixture = compose(
    Composition(
        "mixture",
        parameters=("w1", "measure1", "w2", "measure2", "..."),
        takes=lambda inside: (
            len(inside) >= 2
            and len(inside) % 2 == 0
            and all((inner is None) == (place % 2 == 0) for place, inner in enumerate(inside))
        ),
        parts=_mixture,
        doc="One of several measures, each as often as the weight before it says; the weights need not add up to 1.",
        example="integral (x ~ mixture(1, normal(0, 1), 2, normal(3, 0.5))) x d(x)",
    )
)


# Of numbers one by one


def _categorical(given: Sequence[Term | tuple[Component, ...]]) -> tuple[Component, ...]:
    weights = [term for term in given if isinstance(term, Term)]
    whole = add(*weights)
    valid = tuple((prim("le", ZERO, weight), "categorical: a weight must not be negative") for weight in weights)
    valid = (*valid, (prim("lt", ZERO, whole), "categorical: the weights must not all be 0"))

    def chance(k: Term) -> Term:
        found = weights[-1]
        for number, weight in reversed(list(enumerate(weights[:-1]))):
            found = branch((sub(k, const(number + 0.5)),), False, found, weight)
        return div(found, whole)

    return (Component(ONE, (ZERO, const(len(weights) - 1.0)), (), chance, valid, True),)


categorical = compose(
    Composition(
        "categorical",
        parameters=("w0", "w1", "..."),
        takes=lambda inside: len(inside) >= 1 and not any(inside),
        parts=_categorical,
        doc="0, 1, 2, ..., each as often as its weight says; the weights need not add up to 1.",
        example="integral (k ~ categorical(1, 2, 3)) k^2 d(k)",
    )
)
