"""Answers that travel: taken over where every input is the same, and afterwards as good as found there."""

from __future__ import annotations

import pickle
import random
from typing import Any

import pytest

from potto.query import Cancelled, Database, query
from potto.query.memos import Memo
from potto.query.parcels import Receiver, Sender

NAMES = "abcdefgh"


@query
def text(db: Database, name: str) -> str:
    found: str = db.get_input(("text", name), "")
    return found


@query(travels=True)
def words(db: Database, name: str) -> dict[str, int]:
    return {word: len(word) for word in text(db, name).split()}


@query
def longest(db: Database, name: str) -> int:
    return max(words(db, name).values(), default=0)


@query(travels=True)
def ours(db: Database, name: str) -> int | None:
    return db.entry(words, (name,), "our")


@query(travels=True)
def total(db: Database, *names: str) -> int:
    return sum(longest(db, name) for name in names) + sum(ours(db, name) or 0 for name in names)


def database(**texts: str) -> Database:
    db = Database()
    for name, written in texts.items():
        db.set_input(("text", name), written)
    return db


def sent(sender: Sender, receiver: Receiver, *names: str) -> bool:
    return receiver.take(pickle.loads(pickle.dumps(sender.pack(total, *names))))


def ran(db: Database, *names: str) -> tuple[int, list[str]]:
    with db.recording() as events:
        value = total(db, *names)
    return value, [f"{event.query} {' '.join(map(str, event.args))}" for event in events if event.kind == "executed"]


def test_an_answer_is_taken_over_and_nothing_runs_again() -> None:
    there, here = database(a="one two", b="our three"), database(a="one two", b="our three")
    assert sent(Sender(there), Receiver(here), "a", "b")
    assert ran(here, "a", "b") == (3 + 5 + 3, [])


def test_after_an_edit_only_what_it_reaches_runs() -> None:
    there, here = database(a="one two", b="our three"), database(a="one two", b="our three")
    assert sent(Sender(there), Receiver(here), "a", "b")
    here.set_input(("text", "a"), "one three")
    value, executed = ran(here, "a", "b")
    assert value == 5 + 5 + 3
    # what has not travelled runs at its first asking, and of what has only what the edit changes
    assert sorted(executed) == ["longest a", "longest b", "text a", "total a b", "words a"]


def test_an_answer_that_travelled_cuts_edits_off() -> None:
    there, here = database(a="one two"), database(a="one two")
    assert sent(Sender(there), Receiver(here), "a")
    here.set_input(("text", "a"), "two   one")
    assert ran(here, "a") == (3, ["words a", "text a"])


def test_nothing_is_taken_over_that_rests_on_another_text() -> None:
    there, here = database(a="one two", b="x"), database(a="one two three", b="x")
    sender, receiver = Sender(there), Receiver(here)
    assert not sent(sender, receiver, "a", "b")
    assert sent(sender, receiver, "b")  # also the part of it that came with what was refused
    assert ran(here, "b") == (1, [])
    assert ran(here, "a", "b")[0] == 5 + 1


def test_what_was_refused_is_found_here() -> None:
    there, here = database(a="one two", b="our"), database(a="one two", b="our")
    sender, receiver = Sender(there), Receiver(here)
    assert sent(sender, receiver, "a")
    here.set_input(("text", "b"), "another")
    assert not sent(sender, receiver, "a", "b")
    here.set_input(("text", "b"), "our")
    assert sent(sender, receiver, "a", "b")  # what was refused once is found here, and is the same
    assert ran(here, "a", "b") == (3 + 3 + 3, [])


def test_what_differs_below_is_found_here_and_cuts_the_difference_off() -> None:
    there, here = database(a="one two", b="our three"), database(a="two   one", b="our three")
    with here.recording() as events:
        assert sent(Sender(there), Receiver(here), "a", "b")
    assert [f"{event.query} {' '.join(event.args)}" for event in events if event.kind == "executed"] == [  # type: ignore[arg-type]
        "words a", "text a"
    ]  # fmt: skip
    assert ran(here, "a", "b") == (3 + 5 + 3, [])


def test_an_entry_is_the_same_where_its_table_is_not() -> None:
    there, here = database(a="our two"), database(a="our three")
    assert Receiver(here).take(Sender(there).pack(ours, "a"))
    with here.recording() as events:
        assert ours(here, "a") == 3
    assert not [event for event in events if event.kind == "executed"]


def test_what_lies_between_is_sent_as_it_is_now() -> None:
    """An edit that is taken back: the sum is recalled, and what it was made from is not looked at."""
    there, here = database(a="one two", b="our"), database(a="one two", b="our")
    for text in ("four", "one two"):
        there.set_input(("text", "a"), text)
        total(there, "a", "b")
    assert sent(Sender(there), Receiver(here), "a", "b")
    for name in "ab":
        assert words(here, name) == words(database(a="one two", b="our"), name)
    assert ran(here, "a", "b") == (3 + 3 + 3, [])


def test_what_was_dropped_is_not_sent() -> None:
    there, here = database(a="one two", b="our"), database(a="one two", b="our")
    total(there, "a", "b")
    assert there.forget(lambda name, args: name in ("words", "longest")) == 4
    assert sent(Sender(there), Receiver(here), "a", "b")
    assert total(here, "a", "b") == 3 + 3 + 3
    here.set_input(("text", "b"), "another")
    assert total(here, "a", "b") == 3 + 7


def test_what_is_known_here_stays() -> None:
    there, here = database(a="one two"), database(a="one two")
    before = words(here, "a")
    assert sent(Sender(there), Receiver(here), "a")
    assert words(here, "a") is before


def test_an_input_that_is_not_there_must_not_be_there_here_either() -> None:
    there, here = database(a="one"), database(a="one", b="two")
    assert not sent(Sender(there), Receiver(here), "a", "b")


def test_taking_over_can_be_cancelled_and_goes_on() -> None:
    texts = {name: f"our {name}" for name in NAMES}
    there, here = database(**texts), database(**texts)
    parcel, receiver, cancelled = Sender(there).pack(total, *NAMES), Receiver(here), 0
    adopt, turns = here.adopt, iter(range(10_000))

    def impatient(*args: Any) -> Memo:
        if next(turns) % 2 == 0:
            here.cancel()
        return adopt(*args)

    here.adopt = impatient  # type: ignore[method-assign]
    while True:
        try:
            assert receiver.take(parcel)
            break
        except Cancelled:
            cancelled += 1
    assert cancelled > len(NAMES)
    assert ran(here, *NAMES) == (total(there, *NAMES), [])


def test_taking_over_goes_on_after_each_input_whose_reading_was_cancelled() -> None:
    class Impatient(str):
        def __repr__(self) -> str:  # asked for where the digests of inputs are compared
            here.cancel()
            return str.__repr__(self)

    texts = {name: f"our {name}" for name in NAMES}
    there, here = database(**texts), database(**{name: Impatient(written) for name, written in texts.items()})
    parcel, receiver, cancelled = Sender(there).pack(total, *NAMES), Receiver(here), 0
    while True:
        try:
            assert receiver.take(parcel)
            break
        except Cancelled:
            cancelled += 1
    assert cancelled == len(NAMES)
    assert ran(here, *NAMES) == (total(there, *NAMES), [])


def test_what_cannot_be_found_raises_and_sends_nothing() -> None:
    @query(travels=True)
    def wrong(db: Database) -> int:
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        Sender(database()).pack(wrong)


@pytest.mark.parametrize("seed", range(20))
def test_whatever_is_edited_where_the_answers_are_those_of_a_fresh_database(seed: int) -> None:
    rng = random.Random(seed)
    texts = {name: rng.choice(["one two", "our", "three our", ""]) for name in NAMES}
    there, here = database(**texts), database(**texts)
    sender, receiver = Sender(there), Receiver(here)
    for _ in range(60):
        names = tuple(rng.sample(NAMES, 3))
        match rng.randrange(4):
            case 0:
                sent(sender, receiver, *names)
            case 1:
                texts[names[0]] = rng.choice(["one two", "our", "three our", "two one", "four"])
                here.set_input(("text", names[0]), texts[names[0]])
            case 2:
                for name, written in texts.items():
                    there.set_input(("text", name), written)
                sender, receiver = Sender(there), Receiver(here)
            case _:
                assert total(here, *names) == total(database(**texts), *names)
