"""The types of what goes through arrays: sums and the like, folds, comprehensions; and of fields."""

from __future__ import annotations

from potto.diagnostics import Related
from potto.syntax import nodes
from potto.types import kinds
from potto.types.context import Inference, rule
from potto.types.indices import goes_through, size_of, whole_bounds
from potto.types.infer import value_only
from potto.types.integrals import summed
from potto.types.mismatches import describe, mismatch
from potto.types.types import (
    ANY_SIZE,
    REAL,
    UNKNOWN,
    ArrayOf,
    Count,
    Function,
    TupleOf,
    Type,
    Unknown,
    resolve,
    shifted,
)
from potto.types.unify import unify
from potto.types.vectors import expect_array, field


@rule(nodes.Field)
def _field(inference: Inference, node: nodes.Field) -> Type:
    return field(inference, inference.infer(node.value), node.name, node, node.name_span)


@rule(nodes.Text)
def _text(inference: Inference, node: nodes.Text) -> Type:
    inference.report(kinds.MISMATCH(node.span, "the name of a file stands in `load(…)` alone"))
    return UNKNOWN


# What goes through arrays and ranges


def _clauses(inference: Inference, clauses: tuple[nodes.Clause, ...], what: str) -> list[Type]:
    """The variables of clauses in scope, each seeing those before; how often each goes round. The caller keeps what
    indices reached around the loop."""
    sizes: list[Type] = []
    for clause in clauses:
        over, variable = clause.over, clause.variable
        if isinstance(over, nodes.Range):
            inference.number(over.lo, f"the first value of {what}")
            inference.number(over.hi, f"the last value of {what}")
            whole_bounds(inference, over)
            sizes.append(_count(inference, over))
            goes_through(inference, inference.local(variable, variable.name, variable.span, "index", REAL), over)
            continue
        found = inference.infer(over)
        item = expect_array(inference, found, over, f"{what} goes through an array or a range `lo..hi`")
        array = resolve(found)
        sizes.append(array.size if isinstance(array, ArrayOf) else UNKNOWN)
        if sizes[-1] == Count(0):
            inference.reaches = {}
        inference.local(variable, variable.name, variable.span, "loop", item)
    return sizes


def _count(inference: Inference, over: nodes.Range) -> Type:
    """How many numbers a range has, as far as that is written."""
    lo, hi = size_of(inference, over.lo), size_of(inference, over.hi)
    return shifted(hi, 1 - lo.number) if isinstance(lo, Count) and not isinstance(hi, Unknown) else ANY_SIZE


@rule(nodes.Reduction)
def _reduction(inference: Inference, node: nodes.Reduction) -> Type:
    what = {"sum": "a sum", "product": "a product"}.get(node.op, f"`{node.op}`")
    with inference.scope.inside(), inference.loop():
        sizes = _clauses(inference, node.clauses, what)
        if node.op in ("min", "max"):
            _not_empty(inference, node, sizes)
        if node.op != "sum":
            inference.number(node.body, f"what `{node.op}` is taken of")
            return REAL
        body = inference.infer(node.body)
    return summed(inference, body, node.body, "what is summed")


def _not_empty(inference: Inference, node: nodes.Reduction, sizes: list[Type]) -> None:
    """Report a least or greatest of what is known to have no elements."""
    which = {"min": "least", "max": "greatest"}[node.op]
    for clause, size in zip(node.clauses, sizes):
        count = resolve(size)
        if isinstance(count, Count) and count.number <= 0:
            what = "range" if isinstance(clause.over, nodes.Range) else "array"
            inference.report(kinds.EMPTY(
                clause.over.span, f"`{node.op}` goes through an empty {what}, which has no {which} element",
                label="empty", help=f"give a value that also counts: `{node.op}(a, b)` of two numbers",
            ))  # fmt: skip


@rule(nodes.Fold)
def _fold(inference: Inference, node: nodes.Fold) -> Type:
    state = inference.infer(node.start)
    value_only(inference, state, node.start, "the state of a fold is made of numbers")
    with inference.scope.inside(), inference.loop():
        _clauses(inference, node.clauses, "a fold")
        fits = _bind_state(inference, node, state)
        body = inference.infer(node.body)
    if not fits:
        return UNKNOWN
    if not unify(body, state):
        inference.report(mismatch(
            body, state, node.body, "each step of a fold gives a state like the first one: this",
            (Related(node.start.span, "the state at first"),),
        ))  # fmt: skip
    return state


def _bind_state(inference: Inference, node: nodes.Fold, state: Type) -> bool:
    """The names of the state in scope; False if there are not as many parts."""
    targets = node.targets
    if len(targets) == 1:
        inference.local(targets[0], targets[0].name, targets[0].span, "loop", state)
        return True
    parts: tuple[Type, ...] = tuple(inference.fresh() for _ in targets)
    fits = unify(state, TupleOf(parts))
    if not fits:
        message = f"{len(parts)} names are bound here, but the state is {describe(state)}"
        inference.report(kinds.MISMATCH(node.start.span, message, label=describe(state)))
        parts = (UNKNOWN,) * len(targets)
    for target, part in zip(targets, parts):
        inference.local(target, target.name, target.span, "loop", part)
    return fits


@rule(nodes.Comprehension)
def _comprehension(inference: Inference, node: nodes.Comprehension) -> Type:
    with inference.scope.inside(), inference.loop():
        sizes = _clauses(inference, node.clauses, "an array")
        found = inference.infer(node.body)
    if not isinstance(resolve(found), Function):
        value_only(inference, found, node.body, "an array holds numbers, tuples or functions")
    for size in reversed(sizes):
        found = ArrayOf(size, found)
    return found
