"""Conditions on abs, min, max and clamp as conditions on what is inside of them.

Owns `cased`, `unnested` and `resolved`. The surface of `[max(x, y) < t]` runs along x and along y, so that no
variable of integration cuts all of it; those of `if [x >= y] then [x < t] else [y < t]` do. The condition that chooses
has no jump of its own.
"""

from __future__ import annotations

from potto.calculus.surfaces.nested_brackets import has_nested
from potto.core.terms import (
    Branch,
    Integral,
    Prim,
    Term,
    bound_names,
    branch,
    children,
    mul,
    neg,
    postorder,
    postorder_by,
    replaced,
    transform,
    with_integrand,
)
from potto.primitives import PRIMITIVES

_FLAT = ("max", "min", "clamp")
MOST = 8  # cases that one condition is taken apart into


def cased(term: Integral) -> Integral:
    """An equal integral, or the same one where there is nothing to take apart."""
    if not any(isinstance(node, Branch) and _changes(node) for node in postorder(term.body)):
        return term

    def change(node: Term, new: Term) -> Term:
        return _apart(new, MOST) if isinstance(node, Branch) and _changes(node) else new

    return with_integrand(term, transform(term.body, change))


def resolved(term: Term) -> Term:
    """A term whose integrals are taken apart like that, with no bracket inside of a condition, and along the factors of
    their conditions, too.

    [x*y > 0] is [y > 0] where x > 0, and [y < 0] where it is not: a formula for its roots in y says nothing of x = 0.
    """
    return transform(term, lambda _, new: _by_factors(cased(unnested(new))) if isinstance(new, Integral) else new)


def unnested(term: Integral) -> Integral:
    """The integral with no bracket inside of a condition, whatever its parameters are; the same one if that takes too
    many cases."""
    if not has_nested(term.body):
        return term
    from potto.calculus.surfaces.lifted import closed_value, lifted

    found = lifted(term, closed_value)
    return term if found is None else found.term


def _by_factors(term: Integral) -> Integral:
    return with_integrand(
        term, transform(term.body, lambda _, new: _split(new, MOST) if isinstance(new, Branch) else new)
    )


def _split(node: Term, most: int) -> Term:
    """A condition on a product as one on a factor that varies with less, and on the rest."""
    assert isinstance(node, Branch)
    whole = node.surface
    if not isinstance(whole, Prim) or whole.op not in ("mul", "div") or most < 2:
        return node
    apart = next((f for f in whole.args if f.free and f.free != whole.free), None)
    if apart is None:
        return node
    at = whole.args.index(apart)
    others = tuple(f for place, f in enumerate(whole.args) if place != at)
    rest = mul(*others)
    if not rest.free:
        return node
    up = _split(branch((rest,), node.strict, node.then, node.orelse), most // 2)
    down = _split(branch((neg(rest),), node.strict, node.then, node.orelse), most // 2)
    none = node.orelse if node.strict else node.then  # a parameter may be 0 over the whole domain
    return branch((apart,), True, up, branch((neg(apart),), True, down, none))


def _changes(node: Branch) -> bool:
    """Whether one of the cases of a condition varies with less than the condition, or not at all."""
    parts = [part for part in _outside(node.surface) if isinstance(part, Prim) and part.op in _FLAT]
    return any(arg.free != part.free for part in parts if part.free for arg in part.args)


def _apart(node: Term, most: int) -> Term:
    assert isinstance(node, Branch)
    bent = next((part for part in _outside(node.surface) if isinstance(part, Prim) and PRIMITIVES[part.op].cases), None)
    if bent is None or most < 2:
        return node
    margin, first, second = PRIMITIVES[bent.op].cases(*bent.args)  # type: ignore[misc]
    cases = []
    for value in (first, second):
        coordinates = tuple(replaced(c, {bent: value}) for c in node.coordinates)
        cases.append(_apart(branch(coordinates, node.strict, node.then, node.orelse), most // 2))
    return branch((margin,), False, cases[0], cases[1])


def _outside(surface: Term) -> list[Term]:
    """The parts of a surface that are not inside an integral or a sum of it, whose variables mean nothing outside."""
    return postorder_by(surface, lambda node: () if bound_names(node) else children(node))
