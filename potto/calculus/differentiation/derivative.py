"""The derivative of a smooth term by one variable.

Owns `partial`. It differentiates what a term says between its jumps: conditionals branch by branch, integrals under
the integral sign and at their bounds. What it cannot see is how a surface inside an integral moves, nor what an
unknown function does: there it raises `NotSmooth`, and `dual` takes over.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from potto.calculus.differentiation.loops import dual_fold, element_of, outside_binders
from potto.calculus.differentiation.loops import vanishes as vanishes
from potto.calculus.differentiation.loops import zero_like as zero_like
from potto.core.terms import (
    ONE,
    ZERO,
    App,
    Array,
    Branch,
    Const,
    Delta,
    Fold,
    If,
    Index,
    Integral,
    Lam,
    Length,
    ListOf,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    add,
    array,
    branch,
    children,
    const,
    div,
    fresh,
    if_,
    integral,
    list_of,
    mul,
    neg,
    postorder,
    pow_,
    prim,
    proj,
    rename_bound,
    sub,
    substitute,
    tuple_,
    var,
    with_integrand,
    with_summand,
)
from potto.primitives import PRIMITIVES

_LONG = 16  # factors; the derivative of a longer product is built by halves, or it would grow as the square


class NotSmooth(Exception):
    """The term has no derivative that can be written without deltas, or calls a function that is not known."""


def partial(term: Term, name: str) -> Term:
    """The partial derivative of a smooth term by the variable `name`, simplified as it is built."""
    if name not in term.free:
        return zero_like(term)
    slopes: dict[Term, Term] = {}
    for node in outside_binders(term):
        if name in node.free:
            slopes[node] = _slope(node, name, slopes)
    return slopes[term]


def _slope(node: Term, name: str, slopes: Mapping[Term, Term]) -> Term:
    def of(part: Term) -> Term:
        return slopes[part] if name in part.free else zero_like(part)

    match node:
        case Var():
            return ONE
        case Prim(op=op, args=args):
            return _builtin(node, op, args, of, name)
        case Branch():
            return _side(node, of(node.then), of(node.orelse))
        case If():
            return if_(node.condition, of(node.then), of(node.orelse))
        case Tuple(items=items):
            return tuple_(map(of, items))
        case ListOf(items=items):
            return list_of(map(of, items))
        case Proj():
            inner = of(node.term)
            return ZERO if inner is ZERO else proj(inner, node.index)
        case Index():
            return element_of(of(node.array), node.index)  # places don't move
        case Length():
            return ZERO
        case Sum() | Array():
            return _loop(node, name)
        case Fold():
            return _fold(node, name, of(node.start))
        case Integral():
            return _integral(node, name)
        case App(function=Lam() as function) if len(function.params) == len(node.args):
            return partial(substitute(function.body, dict(zip(function.params, node.args, strict=True))), name)
        case _:
            raise NotSmooth(f"{type(node).__name__} depends on {name}")


def _side(node: Branch, then: Term, orelse: Term) -> Term:
    return then if then is orelse else branch(node.coordinates, node.strict, then, orelse)


# Builtins


def _builtin(node: Prim, op: str, args: tuple[Term, ...], of: Callable[[Term], Term], name: str) -> Term:
    rule = _RULES.get(op)
    if rule is not None:
        return rule(node, *map(of, args))
    entry = PRIMITIVES[op]
    if entry.truth:
        return node  # stands in a condition only, which is not differentiated
    if entry.partials is None:
        return ZERO  # constant between its jumps
    moving = [i for i, arg in enumerate(args) if name in arg.free]
    slopes = entry.partials(*args)
    return _weighted([slopes[i] for i in moving], [of(args[i]) for i in moving])


def _weighted(slopes: Sequence[Term], tangents: Sequence[Term]) -> Term:
    """The sum of slope * tangent; slopes that choose a side are chosen once for all, and multiply nothing by zero."""
    chooser = next((s for s in slopes if isinstance(s, Branch)), None)
    if chooser is not None and all(_chooses_with(s, chooser) for s in slopes):
        then = _weighted([s.then if isinstance(s, Branch) else s for s in slopes], tangents)
        orelse = _weighted([s.orelse if isinstance(s, Branch) else s for s in slopes], tangents)
        return _side(chooser, then, orelse)
    return add(*(mul(s, t) for s, t in zip(slopes, tangents, strict=True) if s is not ZERO and t is not ZERO))


def _chooses_with(slope: Term, chooser: Branch) -> bool:
    if not isinstance(slope, Branch):
        return isinstance(slope, Const)
    return slope.coordinates == chooser.coordinates and slope.strict == chooser.strict


def _add(node: Prim, *tangents: Term) -> Term:
    return add(*tangents)


def _neg(node: Prim, tangent: Term) -> Term:
    return neg(tangent)


def _mul(node: Prim, *tangents: Term) -> Term:
    return _product(node.args, tangents)


def _product(factors: Sequence[Term], tangents: Sequence[Term]) -> Term:
    if len(factors) <= _LONG:
        moved = (mul(*factors[:i], t, *factors[i + 1 :]) for i, t in enumerate(tangents) if t is not ZERO)
        return add(*moved)
    half = len(factors) // 2
    left, right = prim("mul", *factors[:half]), prim("mul", *factors[half:])
    d_left, d_right = _product(factors[:half], tangents[:half]), _product(factors[half:], tangents[half:])
    parts = [prim("mul", a, b) for a, b in ((d_left, right), (left, d_right)) if a is not ZERO and b is not ZERO]
    return add(*parts)


def _div(node: Prim, above: Term, below: Term) -> Term:
    _, b = node.args
    if below is ZERO:
        return div(above, b) if above is not ZERO else ZERO
    # (a' - (a/b) b')/b, not (a' b - a b')/b^2: b^2 overflows or vanishes long before the derivative does.
    return neg(div(mul(node, below), b)) if above is ZERO else div(sub(above, mul(node, below)), b)


def _pow(node: Prim, base: Term, exponent: Term) -> Term:
    a, b = node.args
    parts: list[Term] = []
    if base is not ZERO:
        parts.append(mul(_power_slope(a, b), base))
    if exponent is not ZERO:
        # Only a moving exponent meets log(a), which is not defined at base 0.
        parts.append(mul(PRIMITIVES["pow"].partials(a, b)[1], exponent))  # type: ignore[misc]
    return add(*parts)


def _power_slope(a: Term, b: Term) -> Term:
    if isinstance(b, Const):
        return ZERO if b.value == 0 else mul(b, pow_(a, _lower(b)))
    return PRIMITIVES["pow"].partials(a, b)[0]  # type: ignore[misc]


def _best(node: Prim, *tangents: Term) -> Term:
    """min and max of any number of arguments, folded from the left: the tangent of the one that is chosen."""
    best, tangent = node.args[0], tangents[0]
    for arg, other in zip(node.args[1:], tangents[1:], strict=True):
        margin = sub(best, arg) if node.op == "max" else sub(arg, best)
        tangent = tangent if tangent is other else branch((margin,), False, tangent, other)
        best = prim(node.op, best, arg)
    return tangent


def _lower(exponent: Const) -> Term:
    less = exponent.value - 1
    return const(less) if exponent.name is None else sub(exponent, ONE)


_RULES: dict[str, Callable[..., Term]] = {
    "add": _add,
    "neg": _neg,
    "mul": _mul,
    "div": _div,
    "pow": _pow,
    "min": _best,
    "max": _best,
}


# Binders


def _apart(node: Term, bound: tuple[str, ...], name: str) -> Term:
    """The same binder, with another name for a bound variable that is called like the free variable `name`."""
    return rename_bound(node, {name: fresh(name, {*node.free, *bound})}) if name in bound else node


def _loop(node: Sum | Array, name: str) -> Term:
    """Term by term: the limits are whole numbers, which don't move."""
    apart = _apart(node, (node.variable,), name)
    if name not in children(apart)[-1].free:
        return zero_like(apart)
    if isinstance(apart, Array):
        return array(apart.variable, apart.size, partial(apart.body, name))
    assert isinstance(apart, Sum)
    return with_summand(apart, partial(apart.body, name))


def _fold(node: Fold, name: str, start: Term) -> Term:
    """The state's own slope is stepped beside it, by the chain rule for each number that the state is made of."""
    apart = _apart(node, (node.variable, node.state), name)
    assert isinstance(apart, Fold)
    taken = {name, *apart.free, *apart.body.free, apart.variable, apart.state}
    numbers, tangents = list[str](), list[Term]()
    tangent = fresh(f"d{apart.state}", taken)
    made = _numbers(zero_like(apart), var(tangent), taken | {tangent}, numbers, tangents)
    opened = substitute(apart.body, {apart.state: made})
    back = dict(zip(numbers, _numbers_of(made, var(apart.state)), strict=True))
    slopes = [partial(opened, name)] if name in opened.free else []
    slopes += [_scaled(partial(opened, z), t, zero_like(opened)) for z, t in zip(numbers, tangents) if z in opened.free]
    slope = substitute(total(slopes, zero_like(opened)), back)
    return ZERO if vanishes(slope) and vanishes(start) else dual_fold(apart, tangent, start, slope)


def _numbers(shape: Term, tangent: Term, taken: set[str], numbers: list[str], tangents: list[Term]) -> Term:
    """A state of variables, one for each number that it is made of, and their tangents."""
    if isinstance(shape, Tuple):
        below = [proj(tangent, place) for place in range(len(shape.items))]
        return tuple_(_numbers(s, t, taken, numbers, tangents) for s, t in zip(shape.items, below, strict=True))
    if shape is not ZERO:
        raise NotSmooth("the state of a fold has arrays in it")
    numbers.append(fresh("z", taken))
    taken.add(numbers[-1])
    tangents.append(tangent)
    return var(numbers[-1])


def _numbers_of(made: Term, state: Term) -> list[Term]:
    if isinstance(made, Tuple):
        return [part for place, item in enumerate(made.items) for part in _numbers_of(item, proj(state, place))]
    return [state]


def _integral(node: Integral, name: str) -> Term:
    """Under the integral sign, and Leibniz's rule at every bound that moves."""
    apart = _apart(node, node.variables, name)
    assert isinstance(apart, Integral)
    _check_still(apart, name)
    parts: list[Term] = []
    if name in apart.body.free:
        inside = partial(apart.body, name)
        if not vanishes(inside):
            parts.append(with_integrand(apart, inside))
    for level, (lo, hi) in enumerate(apart.bounds):
        if name in hi.free:
            parts.append(_at_bound(apart, level, hi, partial(hi, name)))
        if name in lo.free:
            parts.append(_at_bound(apart, level, lo, neg(partial(lo, name))))
    return total(parts, zero_like(apart.body))


def _at_bound(node: Integral, level: int, bound: Term, rate: Term) -> Term:
    """The rate of a bound times the integral over the other variables, with this variable at its bound."""
    pace = fresh("rate", {*node.free, *node.variables, *node.body.free, *rate.free})
    inner = _over(node, level + 1, len(node.variables), _scaled(node.body, var(pace), zero_like(node.body)))
    return _over(node, 0, level, substitute(inner, {node.variables[level]: bound, pace: rate}))


def _over(node: Integral, start: int, stop: int, body: Term) -> Term:
    """The integral over some of the variables only."""
    if start == stop:
        return body
    return integral(node.variables[start:stop], node.bounds[start:stop], body, node.hints[start:stop])


def _check_still(node: Integral, name: str) -> None:
    parts = postorder(node.body)
    inside = set(node.variables).union(*(part.variables for part in parts if isinstance(part, Integral)))
    for part in parts:
        match part:
            case Branch() if name in part.surface.free and not inside.isdisjoint(part.surface.free):
                raise NotSmooth(f"a surface inside an integral moves with {name}")
            case Delta() if name in part.free:
                raise NotSmooth(f"a delta moves with {name}")
            case _:
                pass


# Tuples: an integral or a sum may have a tuple for its body


def total(parts: Sequence[Term], zero: Term) -> Term:
    """The sum of numbers, or of tuples shaped like `zero`."""
    if len(parts) <= 1:
        return parts[0] if parts else zero
    if isinstance(zero, Tuple):
        return tuple_(total([proj(p, i) for p in parts], item) for i, item in enumerate(zero.items))
    return add(*parts)


def _scaled(term: Term, factor: Term, zero: Term) -> Term:
    """A number, or a tuple of numbers shaped like `zero`, times a factor."""
    if isinstance(zero, Tuple):
        return tuple_(_scaled(proj(term, i), factor, item) for i, item in enumerate(zero.items))
    return mul(factor, term)
