"""The laws of the engine over random graphs of queries and random scripts of edits.

A graph is an input too: node n reads inputs and other nodes in the order in which it lists them, stops early if it
meets a value that is divisible by 5, and coarsens what it has summed, so that there is something to cut off.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from potto.query import Cancelled, Database, query

NODES, INPUTS = 7, 4


@query
def acyclic(db: Database, node: int) -> int:
    sum_ = node
    for kind, index in db.get_input(("reads", node), ()):
        value = db.get_input(("value", index), 0) if kind == "input" else acyclic(db, index)
        sum_ += value
        if value % 5 == 0:
            break
    return sum_ // 2


WATCHING: list[Callable[[Database], None]] = []  # called whenever `cyclic` is about to read an input


def watched(db: Database, key: tuple[str, int], default: Any) -> Any:
    for watch in WATCHING:
        watch(db)
    return db.get_input(key, default)


@query(cycle=lambda db, node: -node - 1)
def cyclic(db: Database, node: int) -> int:
    sum_ = node
    for kind, index in watched(db, ("reads", node), ()):
        sum_ += watched(db, ("value", index), 0) if kind == "input" else cyclic(db, index)
    return int(sum_ // 2)


@query(cycle=lambda db, node: -node - 1, cuts=True)
def cyclic_and_cutting(db: Database, node: int) -> int:
    sum_ = node
    for kind, index in db.get_input(("reads", node), ()):
        value = db.get_input(("value", index), 0) if kind == "input" else between(db, index)
        sum_ += value
    return sum_ // 2


@query(cycle=lambda db, node: -node - 1)
def between(db: Database, node: int) -> int:
    return cyclic_and_cutting(db, node)


@query
def table(db: Database) -> dict[int, int]:
    return {index: db.get_input(("value", index), 0) // 2 for index in range(INPUTS)}


@query
def fails(db: Database, node: int) -> int:
    """Reads a table by entry, fails at multiples of 3, and recovers from the failures below."""
    value = db.entry(table, (), node % INPUTS) or 0
    if node:
        try:
            value += fails(db, node - 1)
        except ArithmeticError:
            value += 100
    if value % 3 == 0:
        raise ArithmeticError(str(value))
    return value


def reads(below: int) -> st.SearchStrategy[tuple[tuple[str, int], ...]]:
    inputs = st.tuples(st.just("input"), st.integers(0, INPUTS - 1))
    nodes = st.tuples(st.just("node"), st.integers(0, below - 1)) if below else inputs
    return st.lists(inputs | nodes, max_size=4).map(tuple)


@dataclass
class State:
    """What the inputs should be: a database made from it knows nothing of the past."""

    inputs: dict[object, tuple[object, int]] = field(default_factory=dict)

    def set(self, db: Database, key: object, value: object, durability: int) -> None:
        self.inputs[key] = (value, durability)
        db.set_input(key, value, durability)

    def fresh(self) -> Database:
        db = Database()
        for key, (value, durability) in self.inputs.items():
            db.set_input(key, value, durability)
        return db


VALUE = st.tuples(st.just("value"), st.integers(0, INPUTS - 1), st.integers(0, 6), st.integers(0, 2))
ASK = st.tuples(st.just("ask"), st.integers(0, NODES - 1))
FORGET = st.tuples(st.just("forget"), st.integers(0, NODES - 1))


def script(cycles: bool) -> st.SearchStrategy[list[tuple[object, ...]]]:
    edit = st.integers(0, NODES - 1).flatmap(
        lambda node: st.tuples(st.just("reads"), st.just(node), reads(NODES if cycles else node), st.integers(0, 2))
    )
    return st.lists(VALUE | edit | ASK | ASK | FORGET, min_size=1, max_size=40)


def outcome(ask: object, db: Database, *args: object) -> object:
    try:
        return ask(db, *args)  # type: ignore[operator]
    except ArithmeticError as error:
        return f"failed {error}"


def run(steps: list[tuple[object, ...]], asked: object) -> None:
    for few in (0, Database().few):  # whether what changed is looked up, as it is where there are many leaves
        run_with(few, steps, asked)


def run_with(few: int, steps: list[tuple[object, ...]], asked: object) -> None:
    db, state = Database(), State()
    db.few = few
    for step in steps:
        match step:
            case ("ask", node):
                assert outcome(asked, db, node) == outcome(asked, state.fresh(), node)
            case ("forget", node):
                db.forget(lambda name, args, node=node: args == (node,))
            case (what, index, value, durability):
                state.set(db, (what, index), value, int(str(durability)))
    for node in range(NODES):
        assert outcome(asked, db, node) == outcome(asked, state.fresh(), node)


@given(script(cycles=False))
@settings(max_examples=150, deadline=None)
def test_incremental_is_from_scratch(steps: list[tuple[object, ...]]) -> None:
    run(steps, acyclic)


@given(script(cycles=True))
@settings(max_examples=150, deadline=None)
def test_incremental_is_from_scratch_with_cycles(steps: list[tuple[object, ...]]) -> None:
    run(steps, cyclic)


@given(script(cycles=False))
@settings(max_examples=100, deadline=None)
def test_incremental_is_from_scratch_with_failures_and_tables(steps: list[tuple[object, ...]]) -> None:
    run(steps, fails)


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 2)), min_size=20, max_size=30), st.booleans())
@settings(max_examples=120, deadline=None)
def test_incremental_is_from_scratch_where_values_come_back(steps: list[tuple[int, int]], two: bool) -> None:
    """A chain of three over an input with few values, asked for at different places of it."""
    script: list[tuple[object, ...]] = [("reads", 0, (("input", 0), ("input", 1)), 0)]
    script += [("reads", node, (("node", node - 1),), 0) for node in (1, 2)]
    for number, (value, node) in enumerate(steps):
        script += [("value", number % 2 if two else 0, value, 0), ("ask", node)]
    run(script, acyclic)


def short_script(rng: random.Random, nodes: int) -> list[tuple[object, ...]]:
    """Few values over a chain that edits bend into cycles: the same values come back with other members."""
    steps: list[tuple[object, ...]] = [
        ("reads", node, (("node", node - 1),) if node else (("input", 0), ("node", 0)), 0) for node in range(nodes)
    ]
    for _ in range(rng.randint(3, 12)):
        node, kind = rng.randrange(nodes), rng.random()
        if kind < 0.1:
            steps.append(("value", 0, rng.randrange(2), 0))
        elif kind < 0.4:
            edges = [("node", rng.randrange(nodes)) if rng.random() < 0.7 else ("input", 0) for _ in range(2)]
            steps.append(("reads", node, tuple(edges[: rng.randint(0, 2)]), 0))
        else:
            steps.append(("forget" if kind < 0.5 else "ask", node))
    return steps


@pytest.mark.parametrize("nodes", [2, 3, 4])
def test_incremental_is_from_scratch_where_a_chain_bends_into_cycles(nodes: int) -> None:
    rng = random.Random(nodes)
    for _ in range(250):
        run(short_script(rng, nodes), cyclic)


def test_a_reader_sees_that_a_cycle_has_got_another_member_where_the_first_keeps_its_value() -> None:
    """Node 0 reads itself and then 1: it takes its fallback both times, but 1, between it and the reader, does not."""
    chain: list[tuple[object, ...]] = [("reads", 1, (("node", 0),), 0), ("reads", 2, (("node", 1),), 0)]
    itself = ("reads", 0, (("input", 0), ("node", 0)), 0)
    run(
        [*chain, itself, ("ask", 2), ("value", 0, 0, 0), ("ask", 2), ("reads", 0, (("node", 1),), 0), ("ask", 2)],
        cyclic,
    )
    run([*chain, itself, ("ask", 2), ("reads", 0, (("node", 1),), 0), ("ask", 2)], cyclic_and_cutting)


def test_what_is_run_ahead_of_its_turn_makes_no_cycle_with_what_runs() -> None:
    """Node 0, far below 3 before the edits, reads 3 now; but 2, in between, does not lead there any more."""
    steps: list[tuple[object, ...]] = [("reads", node, (("node", node - 1),), 0) for node in (1, 2, 3)]
    edits = [("reads", 3, (("node", 2), ("input", 0)), 0), ("reads", 2, (), 0), ("reads", 0, (("node", 3),), 0)]
    run([*steps, ("ask", 3), *edits, ("ask", 3)], cyclic_and_cutting)


@pytest.mark.parametrize("forgotten", [0, 1])
@pytest.mark.parametrize("asked", [0, 1])
def test_members_of_a_cycle_are_forgotten_together(forgotten: int, asked: int) -> None:
    steps: list[tuple[object, ...]] = [("reads", 0, (("node", 1),), 0), ("reads", 1, (("node", 0), ("node", 0)), 0)]
    run([*steps, ("ask", 0), ("forget", forgotten), ("ask", asked), ("ask", 1 - asked)], cyclic)


def test_a_cancelled_member_of_a_cycle_does_not_keep_its_fallback() -> None:
    """It is cancelled after it has met itself; then the edit that made it a cycle is taken back."""
    db, state = Database(), State()
    plain, itself = (("input", 0),), (("node", 0), ("input", 0), ("node", 0))
    for edges in (plain, itself, plain):
        state.set(db, ("reads", 0), edges, 0)
        if edges is itself:
            reading = iter(range(3))
            WATCHING.append(lambda db, reading=reading: db.cancel() if next(reading) else None)
            with pytest.raises(Cancelled):
                cyclic(db, 0)
            WATCHING.clear()
        assert edges is itself or cyclic(db, 0) == cyclic(state.fresh(), 0) == 0


@given(st.lists(reads(NODES), min_size=NODES, max_size=NODES), st.permutations(range(NODES)))
@settings(max_examples=150, deadline=None)
def test_a_cycle_has_the_same_values_wherever_it_is_entered(
    graph: list[tuple[tuple[str, int], ...]], order: list[int]
) -> None:
    def asked(order: list[int]) -> dict[int, int]:
        db = Database()
        for node, edges in enumerate(graph):
            db.set_input(("reads", node), edges)
        return {node: cyclic(db, node) for node in order}

    assert asked(order) == asked(list(range(NODES)))


@given(st.lists(reads(NODES), min_size=NODES, max_size=NODES))
@settings(max_examples=150, deadline=None)
def test_exactly_the_members_of_cycles_take_their_fallbacks(graph: list[tuple[tuple[str, int], ...]]) -> None:
    db = Database()
    edges = {node: {index for kind, index in found if kind == "node"} for node, found in enumerate(graph)}
    for node, found in enumerate(graph):
        db.set_input(("reads", node), found)
        db.set_input(("value", node), 10 * node + 50)  # every sum is positive, every fallback negative
    reached = dict(edges)
    for _ in range(NODES):
        reached = {node: set(to).union(*(reached[other] for other in to)) for node, to in reached.items()}
    found = {node for node in range(NODES) if cyclic(db, node) == -node - 1}
    assert found >= {node for node in range(NODES) if node in reached[node]}
    assert all(node in reached[node] or reached[node] & found for node in found)


@given(script(cycles=True), st.integers(1, 12))
@settings(max_examples=150, deadline=None)
def test_a_cancelled_evaluation_leaves_the_answers_right(steps: list[tuple[object, ...]], when: int) -> None:
    """It cancels itself at every `when`-th reading of an input."""
    count = 0

    def interrupt(db: Database) -> None:
        nonlocal count
        count += 1
        if count % when == 0:
            db.cancel()

    db, state = Database(), State()
    for step in steps:
        match step:
            case ("ask", int(node)):
                WATCHING.append(interrupt)
                try:
                    found = cyclic(db, node)
                except Cancelled:
                    WATCHING.clear()
                    found = cyclic(db, node)
                WATCHING.clear()
                assert found == cyclic(state.fresh(), node)
            case ("reads" | "value" as what, index, value, durability):
                state.set(db, (what, index), value, int(str(durability)))


@given(script(cycles=False))
@settings(max_examples=100, deadline=None)
def test_asking_twice_runs_nothing(steps: list[tuple[object, ...]]) -> None:
    db, state = Database(), State()
    for step in steps:
        match step:
            case ("ask", int(node)):
                acyclic(db, node)
                with db.recording() as events:
                    acyclic(db, node)
                assert events == []
            case ("reads" | "value" as what, index, value, durability):
                state.set(db, (what, index), value, int(str(durability)))


@given(script(cycles=False), st.integers(0, INPUTS - 1))
@settings(max_examples=100, deadline=None)
def test_a_value_set_back_changes_no_answer_and_runs_nothing(steps: list[tuple[object, ...]], index: int) -> None:
    db, state = Database(), State()
    for step in steps:
        match step:
            case ("reads" | "value" as what, number, value, durability):
                state.set(db, (what, number), value, int(str(durability)))
    value = db.get_input(("value", index), 0)
    db.set_input(("value", index), value)
    before = [acyclic(db, n) for n in range(NODES)]
    db.set_input(("value", index), value + 1)
    db.set_input(("value", index), value)
    with db.recording() as events:
        assert [acyclic(db, n) for n in range(NODES)] == before
    assert [event for event in events if event.kind == "executed"] == []
