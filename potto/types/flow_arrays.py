"""The walk over arrays and what goes through them: indices, sums and the like, folds, comprehensions, fields.

An array has one value for all of its elements. Which of them is meant, and how many there are, must not vary.
"""

from __future__ import annotations

from collections.abc import Callable

from potto.syntax import nodes
from potto.types.algebra import flat, join, merge, taint, without
from potto.types.flow import Walk, walks
from potto.types.values import HAZY, NONE, AbstractScalar, ListValue, Source, Sources, TupleValue, Value

MOST_ROUNDS = 20


@walks(nodes.Index)
def _index(walk: Walk, node: nodes.Index) -> Value:
    found = walk.value(node.array)
    for index in node.indices:
        place = walk.value(index)
        walk.sink("index", index.span, place)
        found = taint(element(found), flat(place))
    return found


def element(array: Value) -> Value:
    """The value of an array's elements."""
    return array.item if isinstance(array, ListValue) else AbstractScalar(flat(array))


@walks(nodes.Field)
def _field(walk: Walk, node: nodes.Field) -> Value:
    return parts_of(walk, walk.value(node.value), node)


def parts_of(walk: Walk, whole: Value, node: nodes.Field | nodes.Member) -> Value:
    """The value of a part of a tuple or a record, or of a part of that."""
    for place in walk.inference.fields.get(id(node), (None,)):
        whole = _part(whole, place)
    return whole


def _part(whole: Value, place: int | None) -> Value:
    if isinstance(whole, TupleValue) and place is not None and place < len(whole.items):
        return whole.items[place]
    return AbstractScalar(flat(whole))


@walks(nodes.Text)
def _text(walk: Walk, node: nodes.Text) -> Value:
    return HAZY


@walks(nodes.With)
def _with(walk: Walk, node: nodes.With) -> Value:
    whole = walk.value(node.record)
    given = [walk.value(argument.value) for argument in node.arguments]
    if not isinstance(whole, TupleValue):
        return AbstractScalar(flat(TupleValue((whole, *given))))
    items = list(whole.items)
    for place, value in zip(walk.inference.fields.get(id(node), ()), given):
        items[place] = value
    return TupleValue(tuple(items))


def _clauses(walk: Walk, clauses: tuple[nodes.Clause, ...]) -> tuple[Sources, frozenset[Source]]:
    """The variables of clauses; what decides how often they go round, and the indices."""
    decides: Sources = NONE
    indices: list[Source] = []
    for clause in clauses:
        over = clause.over
        value: Value = HAZY
        if isinstance(over, nodes.Range):
            for end in (over.lo, over.hi):
                bound = walk.value(end)
                walk.sink("sum", end.span, bound)
                decides = merge(decides, flat(bound))
            index = Source("other", clause.variable.name, clause.variable.span)
            indices.append(index)
            value = AbstractScalar({index: None})
        else:
            value = element(walk.value(over))
        walk.locals[walk.inference.binders[id(clause.variable)]] = value
        walk.places[id(clause.variable)] = value
    return decides, frozenset(indices)


def _through(walk: Walk, clauses: tuple[nodes.Clause, ...], body: Callable[[], Value]) -> Value:
    decides, indices = _clauses(walk, clauses)
    return taint(without(body(), indices), decides)


@walks(nodes.Reduction)
def _reduction(walk: Walk, node: nodes.Reduction) -> Value:
    return _through(walk, node.clauses, lambda: walk.value(node.body))


@walks(nodes.Comprehension)
def _comprehension(walk: Walk, node: nodes.Comprehension) -> Value:
    found = _through(walk, node.clauses, lambda: walk.value(node.body))
    for _ in node.clauses:
        found = ListValue(found)
    return found


@walks(nodes.Fold)
def _fold(walk: Walk, node: nodes.Fold) -> Value:
    start = walk.value(node.start)
    return _through(walk, node.clauses, lambda: _steps(walk, node, start))


def _steps(walk: Walk, node: nodes.Fold, start: Value) -> Value:
    """The state varies with what it began with and with what any step brings in: until that is all."""
    state = start
    for _ in range(MOST_ROUNDS):
        parts = [state] if len(node.targets) == 1 else _parts(state, len(node.targets))
        for target, value in zip(node.targets, parts):
            walk.locals[walk.inference.binders[id(target)]] = value
            walk.places[id(target)] = value
        after = join(state, walk.value(node.body))
        if _measure(after) == _measure(state):
            break
        state = after
    return state


def _parts(state: Value, count: int) -> list[Value]:
    whole = isinstance(state, TupleValue) and len(state.items) == count
    return list(state.items) if whole else [AbstractScalar(flat(state))] * count  # type: ignore[union-attr]


def _measure(value: Value) -> object:
    """What grows from round to round."""
    if isinstance(value, AbstractScalar):
        return frozenset(value.sources), value.jumps, value.spikes
    if isinstance(value, TupleValue):
        return tuple(map(_measure, value.items))
    return _measure(value.item) if isinstance(value, ListValue) else frozenset(flat(value))
