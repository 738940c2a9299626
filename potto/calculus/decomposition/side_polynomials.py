"""Integrands as polynomials in the sides of their surfaces, from which it shows where a crossing of two matters.

Owns `by_sides`, and `settling`, which sides leave nothing to the others. A branch on a surface is
s*then + (1 - s)*orelse with a side s of 0 or 1, so that an integrand is a polynomial in sides, of degree 1 in each,
whose coefficients are smooth. The mixed difference by two sides is 0 where what is integrated has no part that both
bound: their crossing leaves nothing that is not smooth. Of all `or`, `and`, sums and products that is the one rule;
quotients and powers are not polynomials, but it holds of them as well. What is smooth is a number drawn at random here,
as any other side is: a polynomial that is 0 there is 0 everywhere, but by chance (Schwartz 1980, Zippel 1979).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from potto.calculus.algebra.point_values import sample_value
from potto.calculus.inlining.currying import arguments_of, sizes_of, uncurry
from potto.calculus.surfaces.finding import Resolve
from potto.calculus.surfaces.trace import layout, spine
from potto.core.terms import (
    ONE,
    ZERO,
    App,
    Branch,
    Const,
    If,
    Lam,
    ListOf,
    Prim,
    Proj,
    Term,
    Tuple,
    add,
    apply,
    const,
    mul,
    postorder,
    proj,
    sub,
    tuple_,
    var,
)
from potto.core.walking import Holding
from potto.digests import blake2b

Path = tuple[int, ...]
Sides = Mapping[Path, tuple[str, int]]  # the name of a side, and 1 or -1 for a branch taken there or on the other
LEAST, MOST = 1.25, 1.75  # of numbers drawn: neither they nor 1 less than they are near 0, and products keep their size
MOST_DRAWN = 20  # sides: the least of their products is still told from rounding
RATIONAL = frozenset(("add", "mul", "neg", "div"))
_branches = Holding(Branch, App)


def by_sides(body: Term, sides: Sides, resolve: Resolve) -> Term | None:
    """The polynomial, as one number, in the sides that have a name, None if it can't be told. resolve: gives the
    functions that are called."""
    if sum(isinstance(node, Branch | If) for node in postorder(body)) - len(sides) > MOST_DRAWN:
        return None
    found = _parts(body, sides, {}, resolve)[body]
    return None if found is None else _one(found)


def settling(polynomial: Term, names: Sequence[str]) -> dict[str, int]:
    """The sides that leave nothing to the others, as that of a disc in a union: 1 or -1. What is drawn is larger than 1
    here, as 1 less than it is, so that no product of many hides the rest."""
    points = [{name: 1.0 + _number(name.encode() + which) for name in names} for which in (b"one", b"other")]
    found: dict[str, int] = {}
    for name in names:
        for way, value in ((1, 1.0), (-1, 0.0)):
            one, other = (sample_value(polynomial, {**point, name: value}) for point in points)
            if one == other:
                found[name] = way
    return found


def _one(term: Term) -> Term:
    """One number for all that a tuple has, drawn like the rest."""
    if not isinstance(term, Tuple | ListOf):
        return term
    return add(*(mul(_drawn(var(str(at)), "item"), _one(item)) for at, item in enumerate(term.items)))


def _parts(body: Term, sides: Sides, given: Mapping[Term, Term | None], resolve: Resolve) -> dict[Term, Term | None]:
    """The polynomials of all parts of a body. given: those of its parameters, what else is free being smooth."""
    index = layout(body).index
    memo: dict[Term, Term | None] = dict(given)
    for node in postorder(body):
        if node in memo:
            continue
        site = index.get((node, 0)) if isinstance(node, App) else None
        if isinstance(node, Const):
            memo[node] = node
        elif not _branches(node) and not any(var(name) in given for name in node.free):
            memo[node] = node if not node.free and isinstance(node, Prim) else _drawn(node, "smooth")
        elif isinstance(node, App):
            memo[node] = None if site is None else _called(node, memo, site, sides, resolve)
        else:
            memo[node] = _part(node, memo, index, sides)
    return memo


def _part(
    node: Term, memo: Mapping[Term, Term | None], index: Mapping[tuple[Term, int], int], sides: Sides
) -> Term | None:
    match node:
        case Branch() | If():
            then, orelse = memo[node.then], memo[node.orelse]
            if then is None or orelse is None or (isinstance(node, If) and _branches(node.condition)):
                return None
            name, way = sides.get((index.get((node, 2), -1),), (None, 1))
            side = _drawn(node, "side") if name is None else var(name)
            return _between(side if way > 0 else sub(ONE, side), then, orelse)
        case Prim(op=op, args=args) if op in RATIONAL or (op == "pow" and isinstance(args[1], Const)):
            found = [part for arg in args if (part := memo[arg]) is not None]
            return apply(op, *found) if len(found) == len(args) else None
        case Tuple() | ListOf():
            items = tuple(part for item in node.items if (part := memo[item]) is not None)
            return tuple_(items) if len(items) == len(node.items) else None
        case Proj():
            inner = memo[node.term]
            return None if inner is None else proj(inner, node.index)
        case _:
            return None


def _between(side: Term, then: Term, orelse: Term) -> Term | None:
    """side*then + (1 - side)*orelse."""
    if isinstance(then, Tuple) and isinstance(orelse, Tuple) and len(then.items) == len(orelse.items):
        items = tuple(_between(side, a, b) for a, b in zip(then.items, orelse.items, strict=True))
        whole = tuple(item for item in items if item is not None)
        return tuple_(whole) if len(whole) == len(items) else None
    if isinstance(then, Tuple) or isinstance(orelse, Tuple):
        return None
    if orelse is ZERO:
        return mul(side, then)
    return add(mul(side, then), mul(sub(ONE, side), orelse))


def _called(call: App, memo: Mapping[Term, Term | None], site: int, sides: Sides, resolve: Resolve) -> Term | None:
    """What a function gives, of what it is given."""
    inner = {path[1:]: place for path, place in sides.items() if path[:1] == (site,) and path[1:]}
    head, groups = spine(call)
    args = [arg for group in groups for arg in group]
    if not inner and not any(map(_branches, args)):
        return _drawn(call, "smooth")
    function = resolve(head)
    if not isinstance(function, Lam):
        return None
    params, body = uncurry(function, sizes_of(groups))
    given = arguments_of(function, groups)
    if len(given) != len(params):
        return None
    return _parts(body, inner, {var(name): memo.get(arg) for name, arg in zip(params, given, strict=True)}, resolve)[
        body
    ]


def _drawn(term: Term, what: str) -> Term:
    """A number for a term, the same one whenever it is asked for."""
    return const(_number(term.digest + what.encode()))


def _number(content: bytes) -> float:
    return LEAST + (MOST - LEAST) * int.from_bytes(blake2b(content, digest_size=4).digest()) / 2**32
