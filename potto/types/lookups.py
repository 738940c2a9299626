"""The types of what is looked up between the elements of arrays: `interp(xs, ys, x)` and `image(photo, u, v)`."""

from __future__ import annotations

from itertools import pairwise

from potto.diagnostics import Related
from potto.syntax import nodes
from potto.syntax.as_written import number, without_parentheses
from potto.types import kinds
from potto.types.context import Inference
from potto.types.format import format_type
from potto.types.mismatches import describe, mismatch
from potto.types.origins import sides
from potto.types.types import REAL, UNKNOWN, ArrayOf, Count, Function, Meta, Truth, Type, resolve
from potto.types.unify import unify


def interp(inference: Inference, node: nodes.Apply, types: list[Type]) -> Type:
    """Numbers in order, what there is at each of them, and a number."""
    xs, ys, x = types
    places, values = (argument.value for argument in node.arguments[:2])
    size, item = inference.fresh_size("n"), inference.fresh()
    if not unify(xs, ArrayOf(size, REAL)):
        inference.report(mismatch(xs, ArrayOf(size, REAL), places, "the first argument of `interp`"))
    if not unify(ys, ArrayOf(inference.fresh_size("n"), item)):
        inference.report(mismatch(ys, ArrayOf(size, item), values, "the second argument of `interp`"))
        return UNKNOWN
    found = resolve(ys)
    if not isinstance(found, ArrayOf):
        return UNKNOWN
    if not unify(found.size, size):
        a, b = format_type(resolve(xs)), format_type(found)
        inference.report(kinds.SIZES(
            node.span, f"`interp` takes as many values as places, but these are `{a}` and `{b}`",
            label="two sizes", related=sides(inference, (places, xs), (values, found)),
            help="take as many of both",
        ))  # fmt: skip
    _several(inference, resolve(size), places, "interp")
    _rising(inference, places)
    inference.need_number(x, node.arguments[2].value, "where `interp` looks")
    return _looked_up(inference, item, values)


def image(inference: Inference, node: nodes.Apply, types: list[Type]) -> Type:
    """Rows of pixels, and where between them, each from 0 to 1."""
    photo, u, v = types
    item: Type = inference.fresh()
    rows = ArrayOf(inference.fresh_size("h"), ArrayOf(inference.fresh_size("w"), item))
    if not unify(photo, rows):
        expr, shown = node.arguments[0].value, format_type(photo)
        message = f"the first argument of `image` must be rows of pixels, but this is `{shown}`"
        help = "it is an array of rows, `[h, w] Real` or `[h, w] (Real, Real, Real)`"
        inference.report(kinds.MISMATCH(expr.span, message, label=f"this is `{shown}`", help=help))
        item = UNKNOWN
    for type, argument in zip((u, v), node.arguments[1:]):
        inference.need_number(type, argument.value, "where `image` looks")
    return _looked_up(inference, item, node.arguments[0].value)


def _several(inference: Inference, size: Type, expr: nodes.Expr, name: str) -> None:
    if isinstance(size, Count) and size.number < 1:
        inference.report(kinds.SIZES(expr.span, f"`{name}` needs at least one place", label="no elements"))


def _rising(inference: Inference, places: nodes.Expr) -> None:
    """Report the first of the numbers of a list that is not larger than the one before."""
    written = without_parentheses(places)
    if not isinstance(written, nodes.ListLiteral):
        return
    for before, place in pairwise(written.items):
        first, second = number(before), number(place)
        if first is not None and second is not None and not first < second:
            inference.report(kinds.NO_RISE(
                place.span, f"`interp` needs increasing places, but {second:g} follows {first:g}",
                label="not above the one before", related=(Related(before.span, "the place before"),),
                help="sort the places, with the values beside them",
            ))  # fmt: skip
            return


def _looked_up(inference: Inference, item: Type, expr: nodes.Expr) -> Type:
    """What lies between elements is made of numbers as they are; what is not known is one."""
    found = resolve(item)
    if isinstance(found, Meta):
        unify(found, REAL)
    if not isinstance(found, Function | Truth):
        return item
    help = "look up what they give: `interp(xs, [f(t) for f in fs], x)`"
    message = f"between elements there are numbers or vectors, but these are {describe(found)}"
    inference.report(kinds.ESCAPES(expr.span, message, label=f"of {describe(found)}", help=help))
    return UNKNOWN
