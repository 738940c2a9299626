"""The engine by example: cut-off, durability, errors, cancellation, threads, eviction, depth."""

from __future__ import annotations

import gc
import sys
import threading
import time

import pytest

from potto.query import Cancelled, CycleError, Database, QueryEvent, query
from potto.query.engine import SEGMENT


@query
def text(db: Database, name: str) -> str:
    found: str = db.get_input(("text", name), "")
    return found


@query
def length(db: Database, name: str) -> int:
    return len(text(db, name))


@query
def total(db: Database, *names: str) -> int:
    return sum(length(db, name) for name in names)


@query
def words(db: Database, name: str) -> dict[str, int]:
    return {word: len(word) for word in text(db, name).split()}


@query
def word(db: Database, name: str, key: str) -> int | None:
    return db.entry(words, (name,), key)


@query
def chain(db: Database, n: int) -> int:
    return length(db, "base") if n == 0 else chain(db, n - 1) + 1


@query
def ratio(db: Database, name: str) -> float:
    return 1 / length(db, name)


@query
def guarded(db: Database, name: str) -> float:
    try:
        return ratio(db, name)
    except ZeroDivisionError:
        return -1.0


def ran(events: list[QueryEvent], kind: str = "executed") -> list[str]:
    return [event.query for event in events if event.kind == kind]


def put(db: Database, name: str, value: str, durability: int = 0) -> None:
    db.set_input(("text", name), value, durability)


def test_a_memo_is_reused_and_an_edit_runs_what_it_concerns() -> None:
    db = Database()
    put(db, "a", "one")
    put(db, "b", "three")
    assert total(db, "a", "b") == 8
    with db.recording() as events:
        assert total(db, "a", "b") == 8
    assert events == []
    put(db, "a", "eleven")
    with db.recording() as events:
        assert total(db, "a", "b") == 11
    assert [event for event in events if event.kind == "executed"] == [
        QueryEvent("executed", "text", ("a",)),
        QueryEvent("executed", "length", ("a",)),
        QueryEvent("executed", "total", ("a", "b")),
    ]


def test_an_equal_value_cuts_the_work_off() -> None:
    db = Database()
    put(db, "a", "one")
    total(db, "a")
    put(db, "a", "two")
    with db.recording() as events:
        assert total(db, "a") == 3
    assert ran(events) == ["text", "length"]
    assert ran(events, "reused") == ["total"]


def test_a_value_set_back_runs_nothing() -> None:
    db = Database()
    put(db, "a", "one")
    total(db, "a")
    put(db, "a", "eleven")
    put(db, "a", "one")
    with db.recording() as events:
        assert total(db, "a") == 3
    assert ran(events) == []


def test_what_comes_back_is_recalled_by_those_who_asked_meanwhile() -> None:
    db = Database()
    put(db, "a", "one")
    assert length(db, "a") == 3
    put(db, "a", "eleven")
    assert length(db, "a") == 6
    for said, long in (("one", 3), ("eleven", 6), ("one", 3)):
        put(db, "a", said)
        with db.recording() as events:
            assert length(db, "a") == long
        assert ran(events) == []


def test_what_was_last_verified_from_far_below_is_recalled() -> None:
    """Edits elsewhere verify `total` by the text that lies below, without a look at `length`."""
    db = Database()
    put(db, "a", "one")
    assert total(db, "a") == 3
    for elsewhere in ("x", "y"):
        put(db, "unread", elsewhere)
        assert total(db, "a") == 3
    put(db, "a", "eleven")
    assert total(db, "a") == 6
    put(db, "a", "one")
    with db.recording() as events:
        assert total(db, "a") == 3
    assert ran(events) == []


@pytest.mark.parametrize("said", [("one", "eleven"), ("one", "eleven", "two", "eleven")])
def test_what_is_kept_to_be_recalled_leaves_no_garbage(said: tuple[str, ...]) -> None:
    """Memory that only the garbage collector frees makes it stop the program for long."""
    db = Database()
    put(db, "a", "one")
    total(db, "a")
    gc.collect()
    gc.disable()
    try:
        for turn in range(50):
            put(db, "a", said[turn % len(said)])
            total(db, "a")
        assert gc.collect() == 0
    finally:
        gc.enable()


def test_what_rests_on_something_else_as_well_is_not_recalled() -> None:
    db = Database()
    for said, other, sum, runs in (
        ("one", "two", 6, True),
        ("eleven", "two", 9, True),
        ("one", "three", 8, True),
        ("eleven", "three", 11, True),
        ("one", "three", 8, False),
        ("one", "two", 6, True),
    ):
        put(db, "a", said)
        put(db, "b", other)
        with db.recording() as events:
            assert total(db, "a", "b") == sum
        assert ("total" in ran(events)) == runs


def test_who_looked_at_another_moment_is_not_taken_in_by_what_came_back() -> None:
    """`total` stands where the text has come back, though what it reads was another one meanwhile; and runs where that
    is as meanwhile again, for another text."""
    db = Database()
    put(db, "a", "eleven")
    assert total(db, "a") == 6
    put(db, "a", "one")
    assert length(db, "a") == 3
    put(db, "a", "eleven")
    with db.recording() as events:
        assert total(db, "a") == 6
    assert "total" not in ran(events)
    put(db, "a", "two")
    assert length(db, "a") == 3
    assert total(db, "a") == 3


def test_an_equal_input_makes_no_revision() -> None:
    db = Database()
    put(db, "a", "one")
    before = db.revision
    assert db.set_input(("text", "a"), "one") is False
    assert db.revision == before
    assert db.set_input(("text", "a"), "two") is True
    assert db.revision > before


def test_an_entry_of_a_table_changes_only_with_its_value() -> None:
    db = Database()
    put(db, "a", "x yy")
    assert [word(db, "a", key) for key in ("x", "yy", "zzz")] == [1, 2, None]
    put(db, "a", "x yy zzz w")
    with db.recording() as events:
        assert [word(db, "a", key) for key in ("x", "yy", "zzz")] == [1, 2, 3]
    assert [event.args for event in events if event.query == "word" and event.kind == "executed"] == [("a", "zzz")]
    put(db, "a", "yy")
    with db.recording() as events:
        assert [word(db, "a", key) for key in ("x", "yy", "zzz")] == [None, 2, None]
    assert ran(events).count("word") == 1  # that of "zzz" is as it was at first


@query
def initial(db: Database, name: str, key: str) -> int:
    return (word(db, name, key) or 0) // 100


@query
def initials(db: Database, name: str, count: int) -> tuple[int, ...]:
    return tuple(initial(db, name, f"w{number}") for number in range(count))


def test_of_hundreds_that_stand_only_the_one_that_may_not_is_looked_at() -> None:
    db = Database()
    for turn, said in enumerate(("", "w7 w8", "w7", "w8 w7", "w7")):
        db.set_input(("text", "a"), said)
        with db.recording() as events:
            assert initials(db, "a", 300) == (0,) * 300
        if turn > 2:  # it has been seen before that `word` and `initial` cut such an edit off
            assert len(events) < 20, events


@query(cuts=True)
def is_there(db: Database, name: str) -> bool:
    return text(db, name) != ""


@query
def is_there_too(db: Database, name: str, number: int) -> bool:
    return is_there(db, name) and number >= 0


@query
def all_there(db: Database, name: str) -> bool:
    return sum(is_there_too(db, name, number) for number in range(100)) == 100


def test_what_is_declared_to_cut_edits_off_does_so_at_the_first_one() -> None:
    db = Database()
    db.set_input(("text", "a"), "x")
    assert all_there(db, "a")
    db.set_input(("text", "a"), "y")
    with db.recording() as events:
        assert all_there(db, "a")
    assert ran(events) == ["text", "is_there"] and len(ran(events, "reused")) < 5
    db.set_input(("text", "a"), "")
    assert not all_there(db, "a")


def test_a_node_that_runs_first_may_read_who_hangs_on_it() -> None:
    db = Database()
    db.set_input(("text", "a"), "b")
    db.set_input(("text", "b"), "")
    assert [followed(db, "a"), followed(db, "b")] == ["ab", "b"]
    for a, b, expected in (("c", "", "ac"), ("", "a", "a"), ("b", "", "ab"), ("", "a", "a"), ("", "c", "a")):
        db.set_input(("text", "a"), a)
        db.set_input(("text", "b"), b)
        fresh = Database()
        for name, said in (("a", a), ("b", b)):
            fresh.set_input(("text", name), said)
        assert followed(db, "a") == followed(fresh, "a") == expected
        assert followed(db, "b") == followed(fresh, "b")


@query
def followed(db: Database, name: str) -> str:
    """A name and those that its text leads to, one after the other: no two may lead to each other."""
    onward = "".join((db.entry(words, (name,), other) and followed(db, other)) or "" for other in "abc")
    return name + onward


@query(cuts=True)
def written(db: Database) -> str:
    return text(db, "base")


@query
def counted(db: Database) -> dict[str, int]:
    return {word: len(word) for word in written(db).split()}


@query(cuts=True)
def halved(db: Database, key: str) -> int:
    return (db.entry(counted, (), key) or 0) // 2


@query
def halves(db: Database) -> int:
    return sum(halved(db, f"w{n:03}") for n in range(200))


def test_a_text_that_changes_at_each_edit_is_no_reason_to_look_at_all_that_read_other_parts_of_it() -> None:
    db = Database()
    rest = " ".join(f"w{n:03}" for n in range(200))
    looked: list[int] = []
    for turn in range(8):
        db.set_input(("text", "base"), f"{rest} {'x' * turn}")
        with db.recording() as events:
            assert halves(db) == 400
        looked.append(len(events))
    assert looked[1] > 200  # each of them, at first
    assert max(looked[3:]) < 8  # then the text and its words alone
    db.set_input(("text", "base"), rest.replace("w007", "w7"))
    assert halves(db) == 398


def test_durable_memos_are_not_looked_at() -> None:
    db = Database()
    put(db, "library", "a b c", durability=2)
    put(db, "open", "x")
    total(db, "library")
    put(db, "open", "xx")
    with db.recording() as events:
        total(db, "library")
    assert events == [QueryEvent("reused", "total", ("library",))], "one step, however much is below"
    put(db, "library", "changed", durability=2)
    assert total(db, "library") == 7


def test_a_change_of_durability_is_seen() -> None:
    db = Database()
    put(db, "a", "one", durability=2)
    assert total(db, "a") == 3
    put(db, "a", "one", durability=0)
    put(db, "a", "eleven", durability=0)
    assert total(db, "a") == 6
    put(db, "a", "three", durability=2)
    assert total(db, "a") == 5
    put(db, "a", "x", durability=2)
    assert total(db, "a") == 1


def test_an_input_that_was_never_set_is_loaded_once_at_its_first_reading() -> None:
    db, asked = Database(), []

    def load(key: object) -> tuple[str, int] | None:
        asked.append(key)
        return ("loaded", 1) if key == ("text", "disk") else None

    db.on_missing_input = load
    assert total(db, "disk", "none") == 6
    assert total(db, "disk") == 6
    assert asked == [("text", "disk"), ("text", "none")]
    put(db, "none", "now")
    assert total(db, "disk", "none") == 9


def test_a_failure_is_no_answer() -> None:
    db = Database()
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            ratio(db, "a")
    assert guarded(db, "a") == -1
    put(db, "a", "four")
    assert guarded(db, "a") == 0.25
    assert ratio(db, "a") == 0.25
    put(db, "a", "")
    assert guarded(db, "a") == -1
    put(db, "a", "four")
    assert guarded(db, "a") == 0.25, "as it was before the failure, which a cut-off must not take for no change"
    put(db, "a", "")
    with pytest.raises(ZeroDivisionError):
        ratio(db, "a")


def test_a_failure_between_is_met_only_by_who_would_meet_it() -> None:
    @query
    def chosen(db: Database) -> float:
        return ratio(db, "a") if length(db, "a") else 0.0

    db = Database()
    put(db, "a", "four")
    assert chosen(db) == 0.25
    put(db, "a", "")
    assert chosen(db) == 0.0


def test_queries_must_not_write() -> None:
    @query
    def writes(db: Database) -> None:
        put(db, "a", "x")

    with pytest.raises(RuntimeError, match="writes"):
        writes(Database())


def test_a_chain_of_thousands_runs_verifies_and_changes() -> None:
    limit, threads = sys.getrecursionlimit(), threading.active_count()
    db = Database()
    put(db, "base", "")
    assert chain(db, 5000) == 5000
    put(db, "other", "x")
    put(db, "other", "y")
    assert chain(db, 5000) == 5000
    put(db, "base", "xxx")
    with db.recording() as events:
        assert chain(db, 5000) == 5003
    assert ran(events).count("chain") == 5001
    assert sys.getrecursionlimit() == limit
    assert threading.active_count() < threads + 20


def test_an_exception_comes_up_through_a_deep_chain() -> None:
    @query
    def deep(db: Database, n: int) -> float:
        return ratio(db, "a") if n == 0 else deep(db, n - 1)

    db = Database()
    with pytest.raises(ZeroDivisionError):
        deep(db, 3 * SEGMENT)
    put(db, "a", "x")
    assert deep(db, 3 * SEGMENT) == 1


def test_values_too_deep_to_compare_count_as_changed() -> None:
    @query
    def nested(db: Database) -> tuple[object, ...]:
        value: tuple[object, ...] = (text(db, "a"),)
        for _ in range(50_000):
            value = (value,)
        return value

    @query
    def reads(db: Database) -> int:
        return len(nested(db))

    db = Database()
    put(db, "a", "x")
    reads(db)
    put(db, "a", "y")
    assert reads(db) == 1


def test_cancelling_stops_at_the_next_query_and_leaves_the_database_usable() -> None:
    started, go = threading.Event(), threading.Event()

    @query
    def slow(db: Database, n: int) -> int:
        if n == 3:
            started.set()
            go.wait(5)
        return length(db, "a") + (slow(db, n - 1) if n else 0)

    db = Database()
    put(db, "a", "x")
    outcome: list[object] = []

    def work() -> None:
        try:
            outcome.append(slow(db, 5))
        except Cancelled as cancelled:
            outcome.append(cancelled)

    thread = threading.Thread(target=work)
    thread.start()
    started.wait(5)
    db.cancel()
    go.set()
    thread.join(5)
    assert isinstance(outcome[0], Cancelled)
    assert slow(db, 5) == 6
    put(db, "a", "xx")
    assert slow(db, 5) == 12


def test_cancelling_nobody_cancels_nobody() -> None:
    db = Database()
    db.cancel()
    assert total(db, "a") == 0
    with db.evaluating():
        db.cancel()
        with pytest.raises(Cancelled):
            total(db, "a")
    assert total(db, "a") == 0


def test_a_query_that_is_cancelled_between_two_answers_gives_the_right_ones() -> None:
    @query
    def cancels(db: Database) -> int:
        found = length(db, "a")
        if found == 2:
            db.cancel()
        return found + length(db, "b")

    db = Database()
    put(db, "a", "x")
    assert cancels(db) == 1
    put(db, "a", "xx")
    with pytest.raises(Cancelled):
        cancels(db)
    put(db, "b", "y")
    with pytest.raises(Cancelled):
        cancels(db)
    put(db, "a", "x")
    assert cancels(db) == 2


def test_other_threads_read_what_is_known_while_one_evaluates() -> None:
    started, go = threading.Event(), threading.Event()

    @query
    def waits(db: Database) -> int:
        started.set()
        go.wait(5)
        return 1

    db = Database()
    put(db, "a", "x")
    assert total(db, "a") == 1
    thread = threading.Thread(target=waits, args=(db,))
    thread.start()
    started.wait(5)
    before = time.perf_counter()
    assert total(db, "a") == 1
    assert time.perf_counter() - before < 1, "did not wait for the other thread"
    go.set()
    thread.join()


def test_many_threads_agree() -> None:
    db, wrong = Database(), []
    put(db, "a", "x" * 10)

    def work(seed: int) -> None:
        for turn in range(200):
            if turn % 10 == seed:
                put(db, "a", "x" * (10 + turn % 7))
            with db.evaluating():
                if total(db, "a", "a") != 2 * len(db.get_input(("text", "a"))):
                    wrong.append(turn)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_memory_is_bounded_over_many_edits() -> None:
    @query(keep=64)
    def parse(db: Database, source: str) -> list[str]:
        return source.split()

    @query
    def first(db: Database, name: str) -> str:
        return (parse(db, text(db, name)) or [""])[0]

    db = Database()
    for turn in range(1000):
        put(db, "a", f"word{turn} x")
        put(db, "still", "stands")
        assert first(db, "a") == f"word{turn}"
        assert first(db, "still") == "stands"
    assert len(db._memos[parse.query]) <= 130  # type: ignore[attr-defined]


def test_what_is_forgotten_runs_again_and_its_readers_stand() -> None:
    db = Database()
    put(db, "a", "one")
    total(db, "a")
    assert db.forget(lambda name, args: name == "length") == 1
    put(db, "other", "x")
    put(db, "other", "y")
    with db.recording() as events:
        assert total(db, "a") == 3
    assert ran(events) == []
    with db.recording() as events:
        assert length(db, "a") == 3
    assert ran(events) == ["length"]
    db.forget(lambda name, args: name == "length")
    put(db, "a", "eleven")
    assert total(db, "a") == 6


def test_the_log_can_be_printed(monkeypatch, capsys) -> None:
    monkeypatch.setenv("POTTO_LOG", "query")
    db = Database()
    put(db, "a", "one")
    length(db, "a")
    assert capsys.readouterr().err.splitlines() == [
        "query: input input(('text', 'a'))",
        "query: executed length('a')",
        "query: executed text('a')",
    ]


def test_a_cycle_without_a_fallback_is_an_error_that_names_it() -> None:
    @query
    def left(db: Database, n: int) -> int:
        return right(db, n) + 1

    @query
    def right(db: Database, n: int) -> int:
        return left(db, n) if length(db, "a") else 0

    db = Database()
    assert left(db, 1) == 1
    put(db, "a", "x")
    for _ in range(2):
        with pytest.raises(CycleError, match=r"left\(1\) -> right\(1\) -> left\(1\)"):
            left(db, 1)
    put(db, "a", "")
    assert left(db, 1) == 1
    assert right(db, 1) == 0


@query(cycle=lambda db, name: -1)
def around(db: Database, name: str) -> int:
    return around(db, "b" if name == "a" else "a") + length(db, "a")


def test_members_of_a_cycle_run_together_where_what_they_read_comes_back() -> None:
    db = Database()
    put(db, "a", "one")
    assert (around(db, "a"), around(db, "b")) == (-1, -1)
    put(db, "unread", "x")
    put(db, "unread", "y")
    assert around(db, "a") == -1
    put(db, "a", "eleven")
    assert length(db, "a") == 6
    put(db, "a", "two")
    assert (around(db, "b"), around(db, "a")) == (-1, -1)
