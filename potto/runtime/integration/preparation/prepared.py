"""Integrals made ready to be integrated.

Owns `prepared`: deltas are integrated out, a sum under an integral becomes a sum of integrals, and an integrand that
is a sum with many surfaces is taken apart, so that each part is cut along its own surfaces only. That keeps n
conditions added up at a cost proportional to n. Owns `held` too: deltas that stand still.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

from potto.calculus.decomposition.guards import guarded_outside
from potto.calculus.decomposition.joined import in_joined_summands, joined
from potto.calculus.differentiation.deltas import without_deltas
from potto.calculus.differentiation.derivative import NotSmooth, total, zero_like
from potto.calculus.differentiation.dual import Differentiator
from potto.calculus.differentiation.level_sets import level_set, placed_along, spread
from potto.calculus.inlining.expand import expanded, named
from potto.calculus.solving.pivots import NoClosedForm
from potto.calculus.surfaces.lifted import closed_value, lifted
from potto.calculus.surfaces.nested_brackets import nested
from potto.calculus.surfaces.trace import spine
from potto.core.terms import (
    ZERO,
    App,
    Array,
    Branch,
    Delta,
    Deriv,
    Global,
    Index,
    Integral,
    Lam,
    ListOf,
    Prim,
    Sum,
    Term,
    Var,
    add,
    app,
    array,
    children,
    deriv,
    fresh,
    length,
    postorder,
    rebuild,
    substitute,
    transform,
    tuple_,
    var,
    with_integrand,
    with_summand,
)
from potto.diagnostics import PottoError
from potto.kernels import errors
from potto.kernels.cells import Cell, Rows, Value
from potto.runtime.evaluation.functions import Closure, Derivative
from potto.runtime.evaluation.reach import Reach, kept
from potto.runtime.integration.preparation.arrays import holds
from potto.runtime.integration.preparation.uncounted import NOT_COUNTED, not_found

_FUNCTIONS = (Lam, Deriv, Global)
# Branches that one integrand may have before its summands are integrated apart, of one, two, and three or more
# variables. Four lines take 2.1 ms together and 1.4 apart, three 0.2 and 1.4, four discs 14 and 9; two planes in space
# 6 and 0.8, four 100 and 2, two balls 230 and 50.
FEW = 4, 3, 1


@kept
def prepared(term: Integral, reach: Reach) -> Term:
    """An equal term, or the same one where there is nothing to be done. Raises PottoError (a product of deltas)."""
    deltas = [node for node in postorder(term.body) if isinstance(node, Delta)]
    if deltas and placed_along(term) is None:
        apart = lifted(term, closed_value) if any(map(nested, (d.coordinates[0] for d in deltas))) else None
        try:
            return _spread(without_deltas(term if apart is None else apart.term))
        except (NoClosedForm, NotSmooth) as problem:
            raise PottoError([NOT_COUNTED(
                errors.NOWHERE, f"a delta under this integral was not integrated out: {problem}",
                help="let its argument be smooth, and solvable for one of the variables of integration",
            )]) from None  # fmt: skip
    if deltas:
        return term
    if (outside := guarded_outside(term)) is not term:
        return outside
    if summands := in_joined_summands(term, reach.resolve):
        return add(*summands)
    body = term.body
    if isinstance(body, Sum) and not (body.lo.free | body.hi.free) & set(term.variables):
        return with_summand(body, with_integrand(term, body.body))
    if isinstance(body, Prim) and body.op in ("neg", "mul", "div"):
        varying = [arg for arg in body.args if arg.free.intersection(term.variables)]
        if len(varying) > 1 and (parts := _multiplied_out(term, body, reach)):
            return add(*parts)
        if len(varying) != 1 or (body.op == "div" and varying[0] is not body.args[0]):
            return term
        inner = with_integrand(term, varying[0])
        ready = prepared(inner, reach)
        return term if ready is inner else rebuild(body, tuple(ready if a in varying else a for a in body.args))
    if isinstance(body, Prim) and body.op == "add":
        return _apart(term, body, reach)
    return term


def _spread(term: Term) -> Term:
    """An integral over a level set as what numbers integrate."""
    known = level_set(term) if isinstance(term, Integral) else None
    if known is None or known.shares:
        return term
    assert isinstance(term, Integral)
    return total(spread(term, known), zero_like(term.body))


@kept
def placed(term: Integral, again: bool, reach: Reach) -> Integral:
    """The integral with the calls of definitions that place its deltas carried out: `delta(cond (x, y) c)`. Of a
    derivative under it, of a function that jumps, the deltas count (`_counted`).

    again: whether it is to be differentiated.
    Integrals inside that can be joined with it are. Raises PottoError.
    """
    term = _opened(joined(term, reach.resolve), reach)
    term = _counted(term, reach, again)
    if not any(isinstance(n, Delta) and any(isinstance(g, Global | App) for g in postorder(*n.coordinates))
               for n in postorder(term)):  # fmt: skip
        return term
    term = _with_deltas(term, lambda delta: expanded(delta, reach.resolve))
    if any(reach.recursions(node) for node in postorder(term) if isinstance(node, Delta)):
        raise not_found("a recursion places them, and goes deeper than is written out")
    return term


def _with_deltas(term: Integral, change: Callable[[Delta], Term]) -> Integral:
    """The integral with its deltas changed, those further in first."""
    found = transform(term, lambda _, new: change(new) if isinstance(new, Delta) else new)
    assert isinstance(found, Integral)
    return found


def _opened(term: Integral, reach: Reach) -> Integral:
    """With the calls carried out of functions that give deltas, `def peak(t, x) delta(x - t)`."""
    calls = [node for node in postorder(term.body) if isinstance(node, App)]
    if not any(reach.spikes(call.function) for call in calls):
        return term
    return with_integrand(term, expanded(term.body, lambda g: reach.resolve(g) if reach.spikes(g) else None))


def filled(term: Integral, env: dict[str, Value], reach: Reach) -> tuple[Integral, dict[str, Value]]:
    """With the functions in the place of those parameters whose derivatives are taken in the integrand, that place its
    deltas, or that lead to derivatives themselves; what they have captured joins the environment, renamed."""
    given = {name: value for name in term.free if isinstance(value := env[name], Closure)}
    derived = _derived_parameters(term) if given else ()
    while given:
        name, function = given.popitem()
        order, primal = _underived(function)
        if type(primal) is not Closure or not (name in derived or _matters(function, reach)):
            continue
        names = {captured: f"{captured}@{name}" for captured in primal.captured}
        own: Term = substitute(primal.lam, {captured: var(new) for captured, new in names.items()})
        for _ in range(order):
            own = deriv(own)
        found = substitute(term, {name: own})
        assert isinstance(found, Integral)
        term = found
        joined = {new: primal.captured[captured] for captured, new in names.items()}
        env = {**env, **joined}
        given |= {new: value for new, value in joined.items() if isinstance(value, Closure)}
        derived = _derived_parameters(term)
    if Deriv in reach.kinds(term):
        numbers = frozenset(name for name in term.free if isinstance(env[name], Cell))
        rows = frozenset(n for n in term.free if isinstance(row := env[n], Rows) and isinstance(row.item, Cell))
        term = _with_tangents(term, numbers, rows, reach)
    return term, env


@kept
def _with_tangents(term: Integral, numbers: frozenset[str], rows: frozenset[str], reach: Reach) -> Integral:
    """The integral, with tangents that are 0 where a number or an array that it is given stands for a dual."""

    def alone(arg: Term) -> Term:
        """An argument of a derivative, with its tangent if it has none."""
        if isinstance(arg, Var):
            still = ZERO if arg.name in numbers else array(fresh("k", term.free), length(arg), ZERO)
            return tuple_((arg, still)) if arg.name in numbers | rows else arg
        known = named(arg, reach.resolve) if isinstance(arg, Global) else arg
        plain = isinstance(known, Array | ListOf) and not any(isinstance(n, _FUNCTIONS) for n in postorder(known))
        return tuple_((arg, zero_like(known))) if plain and known is not None else arg

    def change(_: Term, new: Term) -> Term:
        head = spine(new)[0] if isinstance(new, App) else None
        if not isinstance(new, App) or not isinstance(head, Deriv) or isinstance(head.function, Deriv):
            return new
        return app(new.function, tuple(map(alone, new.args)))

    found = transform(term, change)
    assert isinstance(found, Integral)
    return found


@lru_cache(maxsize=4096)
def _derived_parameters(term: Integral) -> tuple[str, ...]:
    """The functions among the parameters whose derivatives are taken in an integrand, or that place its deltas."""
    nodes = postorder(term.body)
    derived = {node.function for node in nodes if isinstance(node, Deriv)}
    for node in nodes:
        if isinstance(node, Delta):
            derived |= {spine(part)[0] for part in postorder(*node.coordinates) if isinstance(part, App)}
    return tuple(sorted({inner.name for inner in derived if isinstance(inner, Var)} & term.free))


def _underived(function: Closure) -> tuple[int, Closure]:
    order = 0
    while isinstance(function, Derivative):
        order, function = order + 1, function.primal
    return order, function


def _matters(function: Closure, reach: Reach) -> bool:
    """Whether a function is a derivative of something that may jump, leads to one, or has to do with arrays."""
    order, primal = _underived(function)
    if reach.deltas(primal.lam) or reach.spikes(primal.lam) or (order and reach.kinds(primal.lam) & {Branch, Prim}):
        return True
    if Index in reach.kinds(primal.lam):
        return True
    return any(
        _matters(value, reach) if isinstance(value, Closure) else holds(value) for value in primal.captured.values()
    )


def _counted(term: Integral, reach: Reach, again: bool) -> Integral:
    """An equal term in which no tangent has a delta that points don't see: with derivatives carried out.

    Kernels carry the tangents of derivatives from point to point, where a delta is nowhere: `D Real[x]` is
    `(Real[x], Dist[x])` for what jumps. If that brings no deltas over variables of integration, the term is as it was,
    unless it is to be differentiated `again`: it shows where the tangents jump. Raises PottoError.
    """
    if not reach.deltas(term.body):
        return term
    try:
        body = Differentiator(reach.resolve).carried_out(term.body)
    except (NoClosedForm, NotSmooth) as problem:
        raise not_found(str(problem)) from None
    variables = frozenset(term.variables)
    calls = [node for node in postorder(body) if isinstance(node, App) and node.free & variables]
    if not body.free <= term.body.free or any(
        reach.deltas(call.function) or _is_unknown(call.function) for call in calls
    ):
        raise not_found("what is differentiated is not known here, or a recursion of too many calls")
    before = {node for node in postorder(term.body) if isinstance(node, Delta)}
    found = any(isinstance(n, Delta) and n not in before and n.coordinates[0].free & variables for n in postorder(body))
    return with_integrand(term, body) if found or again else term


def _is_unknown(function: Term) -> bool:
    """Whether the derivative of something is called that is not a function as it stands."""
    head = spine(function)[0] if isinstance(function, App) else function
    while isinstance(head, Deriv):
        head = head.function
        if not isinstance(head, Deriv | Global | Lam | Var):
            return True
    return False


@lru_cache(maxsize=1024)
def held(term: Integral) -> tuple[Integral, tuple[tuple[str, str], ...]]:
    """The integral with what places its deltas under names of its own, to be given values without tangents.

    The names are those of the parameters, with the new ones.
    """
    deltas = [node for node in postorder(term.body) if isinstance(node, Delta)]
    bound = {name for node in postorder(term) if isinstance(node, Integral) for name in node.variables}
    names = sorted({name for node in deltas for name in node.coordinates[0].free} - bound)
    renamed = {name: var(f"{name}@still") for name in names}
    result = _with_deltas(term, lambda delta: substitute(delta, renamed))
    return result, tuple((name, f"{name}@still") for name in names)


def _apart(term: Integral, body: Prim, reach: Reach) -> Term:
    """Summands with surfaces of their own integrated by themselves, the others together."""
    names = frozenset(term.variables)
    each = _parted(body.args, names, reach)
    summed = any(isinstance(arg, Sum) for arg in body.args)
    if len(each) < 2 or not (summed or _worth(names, [n for _, n in each], _branches(body, names, reach))):
        return term
    return add(*(with_integrand(term, part) for part, _ in each))


def _multiplied_out(term: Integral, body: Prim, reach: Reach) -> list[Term]:
    """The integrals of the summands of one factor times the others; none where that is not worth it. Between the cuts
    of one variable nothing meets."""
    names = frozenset(term.variables)
    sums = [arg for arg in body.args if isinstance(arg, Prim) and arg.op == "add"]
    if len(names) < 2 or not sums or (body.op == "div" and body.args[0] not in sums):
        return []
    counts = {arg: _branches(arg, names, reach) for arg in sums}
    most = body.args[0] if body.op == "div" else max(sums, key=lambda arg: counts[arg])
    parts = [
        rebuild(body, tuple(part if arg is most else arg for arg in body.args))
        for part, _ in _parted(children(most), names, reach)
    ]
    if not _worth(names, [_branches(part, names, reach) for part in parts], _branches(body, names, reach)):
        return []
    return [with_integrand(term, part) for part in parts]


def _parted(args: Sequence[Term], names: frozenset[str], reach: Reach) -> list[tuple[Term, int]]:
    """Summands with surfaces of their own, and the others added up, with how many branches each has."""
    each = [(arg, _branches(arg, names, reach)) for arg in args]
    smooth = [arg for arg, count in each if not count and not isinstance(arg, Sum)]
    rest = [(arg, count) for arg, count in each if count or isinstance(arg, Sum)]
    return [(add(*smooth), 0), *rest] if smooth else rest


def _worth(names: frozenset[str], counts: Sequence[int], whole: int) -> bool:
    """Whether a body of so many branches is better integrated in parts with these, which may share some: it has more
    than a few, and more pairs of them that may meet than the parts have."""
    return whole > FEW[min(len(names), len(FEW)) - 1] and sum(n * n for n in counts) < whole * whole


def _branches(term: Term, variables: frozenset[str], reach: Reach) -> int:
    """The conditions that vary with some variables: written here, or in definitions that are called with them."""
    count = 0
    for node in postorder(term):
        if isinstance(node, Branch):
            count += bool(node.surface.free & variables)
        elif isinstance(node, App) and isinstance(head := spine(node)[0], Global) and node.free & variables:
            count += reach.branches(head)
    return count
