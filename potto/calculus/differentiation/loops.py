"""Loops, arrays and folds as derivatives see them: what they are made of, zeros like them, a state and how it moves.

Owns `zero_like`, `vanishes`, `element_of`, `of_integrals`, `outside_binders`, `dual_fold` and `stepped`.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.core.terms import (
    ZERO,
    Array,
    Branch,
    Const,
    Fold,
    If,
    Index,
    Integral,
    Lam,
    ListOf,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    add,
    array,
    bound_apart,
    children,
    const,
    fold,
    fresh,
    index,
    list_of,
    postorder,
    proj,
    substitute,
    transform,
    tuple_,
    var,
    with_integrand,
)

MOST_STEPS = 256  # of a fold that is written out


def zero_like(term: Term) -> Term:
    """Zero, or a tuple or an array of zeros where the term is seen to be one."""
    path: list[int | Term] = []  # of a part, where it is in the whole: a component's number, an element's place
    while True:
        match term:
            case Branch(then=inner) | If(then=inner) | Integral(body=inner) | Sum(body=inner):
                term = inner
            case Fold():
                term = shape_of(term)
            case Proj(term=inner, index=number):
                path.append(number)
                term = inner
            case Index(array=inner, index=place):
                path.append(place)
                term = inner
            case Tuple(items=items) if path:
                component = path.pop()
                if not isinstance(component, int) or component >= len(items):
                    return ZERO
                term = items[component]
            case Array() | ListOf() if path:
                at = path.pop()
                if isinstance(at, int) or (isinstance(term, ListOf) and not term.items):
                    return ZERO
                term = substitute(term.body, {term.variable: at}) if isinstance(term, Array) else term.items[0]
            case Tuple(items=items):
                return tuple_(map(zero_like, items))
            case ListOf(items=items):
                return list_of(map(zero_like, items))
            case Array():
                return array(term.variable, term.size, zero_like(term.body))
            case _:
                return ZERO


def shape_of(node: Fold) -> Term:
    """A term of the shape that the state has."""
    return node.body if isinstance(node.body, Tuple | ListOf | Array) else node.start


def vanishes(term: Term) -> bool:
    """Whether a number, or each of a tuple or an array, is 0 on all sides of what it depends on."""
    match term:
        case Tuple(items=parts) | ListOf(items=parts):
            return all(map(vanishes, parts))
        case Branch(then=then, orelse=orelse) | If(then=then, orelse=orelse):
            return vanishes(then) and vanishes(orelse)
        case Array(body=body):
            return vanishes(body)
        case _:
            return term is ZERO


def dual_fold(node: Fold, tangent: str, start: Term, slope: Term) -> Term:
    """The tangent of a fold: that of the state is stepped beside it.

    start: the tangent of the first state. slope: of a step, in which that of the state has the name `tangent`.
    """
    taken = node.body.free | slope.free | {node.variable, node.state, tangent}
    both = fresh(node.state, taken)
    start = zero_like(node) if vanishes(start) else start
    parts = {node.state: proj(var(both), 0), tangent: proj(var(both), 1)}
    step = tuple_((substitute(node.body, parts), substitute(slope, parts)))
    return proj(fold(node.variable, node.lo, node.hi, both, tuple_((node.start, start)), step), 1)


def stepped(root: Term) -> Term:
    """A term with the folds written out whose state decides a condition, the sums of conditions that decide one, and
    those whose index tells what kind of surface a summand has, as far as their bounds are known."""
    nodes = postorder(root)
    sums = {
        part
        for node in nodes
        if isinstance(node, Branch)
        for part in postorder(node.surface)
        if isinstance(part, Sum) and decided_by((part.variable,), part.body)
    }
    sums.update(node for node in nodes if isinstance(node, Sum) and _of_several_kinds(node))
    if not sums and not any(isinstance(node, Fold) for node in nodes):
        return root
    return transform(root, lambda old, new: _written_out(new, old in sums) if isinstance(new, Fold | Sum) else new)


def _written_out(node: Fold | Sum, decides: bool) -> Term:
    lo, hi = node.lo, node.hi
    if not (isinstance(lo, Const) and isinstance(hi, Const) and 0 <= hi.value - lo.value < MOST_STEPS):
        return node
    places = [const(place) for place in range(int(lo.value), int(hi.value) + 1)]
    if isinstance(node, Sum):
        return add(*(substitute(node.body, {node.variable: place}) for place in places)) if decides else node
    if not decided_by((node.state,), node.body):
        return node
    state = node.start
    for place in places:
        state = substitute(node.body, {node.variable: place, node.state: state})
    return state


def decided_by(names: Sequence[str], body: Term) -> bool:
    """Whether a branch in a term is on a surface that varies with some names."""
    return any(isinstance(part, Branch) and not part.surface.free.isdisjoint(names) for part in postorder(body))


def _of_several_kinds(node: Sum) -> bool:
    """Whether surfaces of the summands differ by more than numbers: in an exponent, in the element of an array, or in
    the side of a plain conditional. There is no one way to solve them."""
    own = frozenset((node.variable,))

    def tells(part: Term) -> bool:
        match part:
            case Prim(op="pow", args=(_, chosen)) | Index(index=chosen) | If(condition=chosen):
                return not chosen.free.isdisjoint(own)
            case _:
                return False

    branches = (part for part in postorder(node.body) if isinstance(part, Branch) and part.surface.free & own)
    return any(tells(inner) for part in branches for inner in postorder(part.surface))


def of_integrals(node: Integral) -> Term:
    """An integral of an array as the array of the integrals."""
    whole, inside = node.body, with_integrand(node, ZERO).free.union(node.variables)
    if isinstance(whole, Array):
        apart = bound_apart(whole, inside)
        return array(apart.variable, apart.size, with_integrand(node, apart.body))
    return list_of(with_integrand(node, item) for item in children(whole))


def element_of(whole: Term, place: Term) -> Term:
    """The element of an array of tangents, of which 0 stands for one of zeros."""
    found = index(whole, place)
    return zero_like(found) if vanishes(whole) else found


def outside_binders(root: Term) -> list[Term]:
    """Every subterm under no binder, children first; of a loop its bounds and what it begins with."""
    return postorder(root, below=lambda node: () if isinstance(node, Integral | Lam) else parts_below(node))


def parts_below(node: Term) -> tuple[Term, ...]:
    """The children of a term that see all names that it sees: of a loop, its bounds and what it begins with."""
    match node:
        case Sum():
            return node.lo, node.hi
        case Fold():
            return node.lo, node.hi, node.start
        case Array():
            return (node.size,)
        case _:
            return children(node)
