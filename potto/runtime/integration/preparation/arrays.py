"""Arrays end where an integral begins: what it reads of them is found beside it, and it integrates numbers.

Owns `without_arrays`, `whole`, `found_beside`, `in_numbers`, `in_places` and `as_written`.
"""

from __future__ import annotations

from collections import Counter
from functools import lru_cache, reduce

import numpy as np
from msgspec.structs import replace

from potto.calculus.differentiation.derivative import NotSmooth
from potto.calculus.inlining.arrays import TooMany, each_integral, inlined, loops, summands, unrolled
from potto.calculus.inlining.lattices import by_cells
from potto.calculus.inlining.reads import Access, hoisted
from potto.calculus.inlining.unrolled import MOST_STEPS
from potto.calculus.solving.pivots import NoClosedForm
from potto.core.terms import (
    Branch,
    Holding,
    If,
    Index,
    Integral,
    Sum,
    Term,
    bound_names,
    children,
    fresh,
    function_of,
    postorder,
    proj,
    replaced,
    substitute,
    tuple_,
    var,
)
from potto.diagnostics import PottoError, declare
from potto.kernels import errors
from potto.kernels.cells import Cell, Env, Number, Value
from potto.kernels.making import making
from potto.runtime.evaluation.functions import Closure
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.reach import Reach, kept
from potto.runtime.evaluation.record import Record
from potto.runtime.integration.preparation.uncounted import not_found

TOO_LONG = declare("P0515", "a loop under an integral is too long to be written out")

Read = dict[str, Term]


def met(term: Integral, env: Env, reach: Reach) -> bool:
    """Whether an integral has to do with arrays, itself or by what it is given."""
    return Index in reach.kinds(term) or any(holds(env[name]) for name in term.free)


def holds(value: Value) -> bool:
    """Whether a value is an array, or a tuple with one in it."""
    if isinstance(value, tuple):
        return any(map(holds, value))
    return not isinstance(value, Cell | Closure)


def without_arrays(machine: Machine, term: Integral, env: Env) -> tuple[Term, Env, Read]:
    """An equal term, what it is of, and what its new names stand for: an integral of numbers; or a term in which sums
    are around integrals."""
    reach = machine.linker.reach
    names = frozenset(name for name in term.free if holds(env[name]))
    with making:
        found = _outside(term, names, reach)
    if not isinstance(found, Integral):
        return found, {name: env[name] for name in found.free}, {}
    term = found
    while ends := loops(term):
        known = tuple((end, whole(machine, end, env)) for end in ends)
        try:
            term = unrolled(term, known)
        except TooMany:
            raise PottoError([TOO_LONG(
                errors.NOWHERE, f"a loop under this integral has more than {MOST_STEPS:,} steps",
                notes=("what varies with a variable of integration is written out step by step",),
                help="move what does not vary with it out of the loop, or the loop out of the integral",
            )]) from None  # fmt: skip
    with making:
        term, accesses = hoisted(term)
    return found_beside(machine, term, accesses, env)


@kept
def _outside(term: Integral, arrays: frozenset[str], reach: Reach) -> Term:
    try:
        found = by_cells(inlined(term, lambda name: Index in reach.kinds(name), reach.resolve, arrays))
    except (NoClosedForm, NotSmooth) as problem:
        raise not_found(str(problem)) from None
    if not found.free <= term.free:
        raise not_found("what is differentiated is out of sight")
    if isinstance(found, Integral):  # else its cells are sums around it already
        # Around an integral the index of a sum is plain: what each summand looks up at places of its own has cells.
        found = each_integral(summands(found, look_ups=False), by_cells)
    return each_integral(found, summands)


def whole(machine: Machine, end: Term, env: Env) -> float:
    """The bound of a loop, or a condition that ends a recursion, which is the same for all members. Raises Differ."""
    value = machine.with_directions(0).term(end, {name: env[name] for name in end.free})
    if not isinstance(value, Cell):
        raise errors.not_a_number(value)
    flat = np.unique(np.asarray(value.v))
    if flat.size > 1:
        raise Differ(value.v)
    return float(flat[0])


class Differ(Exception):
    """The members of a batch have loops or recursions of different lengths, which these numbers decide."""

    def __init__(self, ends: Number) -> None:
        self.ends = np.asarray(ends)


def as_written(record: Record, known: tuple[int, frozenset[Term]], read: Read) -> None:
    """In the surfaces that a record has beyond those known, put what names stand for: the program has no others."""
    if not read:
        return
    if record.costs is not None:
        record.costs.rename(known[1], lambda surface: substitute(surface, read))
    edges = record.edges
    for place in range(known[0], len(edges)):
        cause = edges[place].cause
        surface, other = (None if x is None else substitute(x, read) for x in (cause.surface, cause.other))
        edges[place] = replace(edges[place], cause=replace(cause, surface=surface, other=other))


def found_beside(machine: Machine, term: Term, accesses: tuple[Access, ...], env: Env) -> tuple[Term, Env, Read]:
    """The integral, with the values of what it reads; tuples in their parts."""
    read: Read = {}
    here = {name: env[name] for name in term.free if name in env}
    parts: dict[str, Term] = {}
    known = dict(env)
    for name, found in _in_turn(accesses):
        known[name] = machine.evaluate(function_of(found), known, None)
    for access in accesses:
        value = known[access.name]
        if isinstance(value, tuple):
            parts[access.name] = in_names(access.name, value, here)
            read |= _parts_of(access.term, access.name, value)
        else:
            here[access.name] = value
            read[access.name] = access.term
    whole = substitute(term, parts) if parts else term
    return whole, {name: here[name] for name in whole.free}, read


@lru_cache(maxsize=1024)
def _in_turn(accesses: tuple[Access, ...]) -> tuple[tuple[str, Term], ...]:
    """Names and terms to be found one after the other, each by those before: all accesses, and before them places that
    several lead through and that are counted for, as the cell of a table is."""
    sums = Holding(Sum)
    met = Counter(node for access in accesses for node in set(_surely(access.term)) if isinstance(node, Index))
    shared = [node for node, times in met.items() if times > 1 and sums(node.index)]
    taken = {access.name for access in accesses}.union(*(access.term.free for access in accesses))
    names: dict[Term, Term] = {}
    found = []
    for node in sorted(shared, key=lambda node: len(postorder(node))):
        name = fresh("place", taken)
        taken.add(name)
        found.append((name, replaced(node, names)))
        names[node] = var(name)
    return (*found, *((access.name, replaced(access.term, names)) for access in accesses))


def _surely(term: Term) -> list[Term]:
    """The parts of a term that are evaluated whatever its conditions come to."""

    def below(node: Term) -> tuple[Term, ...]:
        return children(node)[:-2] if isinstance(node, If | Branch) else () if bound_names(node) else children(node)

    return postorder(term, below=below)


def _parts_of(term: Term, name: str, value: Value) -> Read:
    """What the names of the parts of a tuple stand for."""
    if not isinstance(value, tuple):
        return {name: term}
    each = (_parts_of(proj(term, place), f"{name}.{place}", item) for place, item in enumerate(value))
    return {part: own for parts in each for part, own in parts.items()}


def in_numbers(term: Integral, env: Env) -> tuple[Integral, Env]:
    """The same integral of the parts of the tuples that it is given, each under a name of its own."""
    given = [name for name in term.free if isinstance(env[name], tuple)]
    if not given:
        return term, env
    here = {name: env[name] for name in term.free}
    found = _by_parts(term, tuple((name, _shape(here.pop(name))) for name in sorted(given)))
    for name in given:
        in_names(name, env[name], here)
    return found, {name: here[name] for name in found.free}


Shape = tuple["Shape", ...] | None  # of a tuple: those of its items; of anything else None


def _shape(value: Value) -> Shape:
    return tuple(map(_shape, value)) if isinstance(value, tuple) else None


@lru_cache(maxsize=4096)
def _by_parts(term: Integral, shapes: tuple[tuple[str, Shape], ...]) -> Integral:
    def parts(name: str, shape: Shape) -> Term:
        if shape is None:
            return var(name)
        return tuple_(parts(f"{name}.{place}", item) for place, item in enumerate(shape))

    found = substitute(term, {name: parts(name, shape) for name, shape in shapes})
    assert isinstance(found, Integral)
    return found


def in_names(name: str, value: Value, env: Env) -> Term:
    """The term of a value under a name: the parts of a tuple have names of their own, and join the environment."""
    if not isinstance(value, tuple):
        env[name] = value
        return var(name)
    return tuple_(in_names(f"{name}.{place}", item, env) for place, item in enumerate(value))


def in_places(term: Term) -> Term:
    """A term with names of parts of tuples, as a program has it: with the tuples and their places."""
    found: Read = {}
    for name in term.free:
        whole, *places = name.split(".")
        if places and all(place.isdecimal() for place in places):
            start: Term = var(whole)
            found[name] = reduce(proj, map(int, places), start)
    return substitute(term, found) if found else term
