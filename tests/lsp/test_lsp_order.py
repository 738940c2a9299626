"""For what a question waits: diagnostics of open files come before answers about whole files, and quick ones before
both."""

from __future__ import annotations

import os
import select
import time
from collections.abc import Callable, Iterator
from threading import Event, Timer
from typing import Any

import pytest
from lsp_client import Client
from potto_lsp import work
from potto_lsp.features import FEATURES
from potto_lsp.wire import arrivals
from potto_lsp.work import PATIENCE, Job, Worker

from potto.query import Database, query


@query
def tick(db: Database, number: int) -> int:
    """Where an evaluation may be cancelled."""
    return number


class World:
    """A worker, and what it did in which order. Steps of idle time are told as `open` and `closed`."""

    def __init__(self, opened: int = 2, closed: int = 2) -> None:
        self.db, self.done, self.rested = Database(), list[str](), Event()
        self.opened, self.closed = opened, closed
        self.worker = Worker(lambda: self.db, self.steps)
        self.begun, self.go_on = Event(), Event()

    def steps(self) -> Iterator[Callable[[], None] | None]:
        for number in range(self.opened):
            yield lambda number=number: self.done.append(f"open {number}")  # type: ignore[misc]
        yield None
        for number in range(self.closed):
            yield lambda number=number: self.done.append(f"closed {number}")  # type: ignore[misc]
        yield self.rested.set

    def put(self, kind: Any, name: str) -> None:
        self.worker.put(Job(kind, lambda job: self.done.append(name)))

    def finished(self) -> list[str]:
        assert self.rested.wait(10)
        return self.done

    def long(self, name: str) -> Callable[[Job], None]:
        """A job that notes when it begins, and goes on to query until it is cancelled or told to end."""

        def run(job: Job) -> None:
            self.done.append(f"{name} begins")
            self.begun.set()
            number = 0
            while not self.go_on.is_set():
                number = tick(self.db, number % 10) + 1
                self.go_on.wait(0.001)
            self.done.append(f"{name} ends")

        return run


def test_open_files_then_whole_files_then_the_rest() -> None:
    world = World()
    world.put("edit", "edit")
    world.put("slow", "lenses")
    world.put("diagnosis", "pull")
    world.put("slow", "tokens")
    world.put("quick", "hover")
    world.worker.start()
    assert world.finished() == ["edit", "hover", "pull", "open 0", "open 1", "lenses", "tokens", "closed 0", "closed 1"]


def test_rest_comes_when_there_has_been_nothing_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work, "REST", 0.02)
    world, rests = World(), list[int]()

    def rest() -> bool:
        rests.append(len(world.done))
        return len(rests) in (1, 2)

    world.worker = Worker(lambda: world.db, world.steps, rest=rest)
    world.put("edit", "edit")
    world.worker.start()
    world.finished()
    time.sleep(0.4)
    assert rests == [5, 5, 5]  # after the edit and its four steps, as often as it asks for more
    world.put("quick", "hover")
    time.sleep(0.4)
    assert rests == [5, 5, 5, 6]


def test_every_edit_is_told_of_before_a_question_about_the_file() -> None:
    world = World(closed=0)
    for number in range(3):
        world.put("edit", f"edit {number}")
        world.put("slow", f"lenses {number}")
    world.worker.start()
    done = world.finished()
    assert done[:5] == ["edit 0", "edit 1", "edit 2", "open 0", "open 1"]
    assert done[5:] == ["lenses 0", "lenses 1", "lenses 2"]


def test_a_question_about_a_whole_file_does_not_stop_the_diagnostics_of_an_open_one() -> None:
    world = World(opened=0, closed=0)
    run = world.long("open")

    def steps() -> Iterator[Callable[[], None] | None]:
        yield lambda: run(Job("idle", lambda job: None))
        yield None
        yield world.rested.set

    world.worker = Worker(lambda: world.db, steps)
    world.put("edit", "edit")
    world.worker.start()
    assert world.begun.wait(10)
    world.put("slow", "lenses")
    world.put("diagnosis", "pull")
    world.go_on.wait(0.05)
    world.go_on.set()
    assert world.finished() == ["edit", "open begins", "open ends", "pull", "lenses"]


def test_a_question_that_comes_between_two_steps_waits_for_neither() -> None:
    world = World()

    def steps() -> Iterator[Callable[[], None] | None]:
        yield lambda: world.done.append("step")
        world.put("quick", "hover")  # no job runs that could give way to it, and the next one is chosen already
        yield lambda: world.done.append("next step")
        yield world.rested.set

    world.worker = Worker(lambda: world.db, steps)
    world.put("edit", "edit")
    world.worker.start()
    assert world.finished() == ["edit", "step", "hover", "next step"]


def test_who_works_lets_a_question_in_that_has_arrived_and_was_not_read() -> None:
    world = World()

    def arrived() -> bool:
        """As on one processor: nobody else runs until the thread that works lets them."""
        if not world.begun.is_set():
            world.begun.set()
            Timer(0.001, world.put, ("quick", "hover")).start()
            return True
        return False

    def step() -> None:
        world.done.append("step")
        for number in range(64):
            tick(world.db, len(world.done) * 64 + number)
        world.done.append("end")

    def steps() -> Iterator[Callable[[], None] | None]:
        yield step
        yield world.rested.set

    world.worker = Worker(lambda: world.db, steps, arrived=arrived)
    world.put("edit", "edit")
    world.worker.start()
    assert world.finished() == ["edit", "step", "hover", "step", "end"]


def test_bytes_that_nobody_has_read_are_seen() -> None:
    end, other = os.pipe()
    with os.fdopen(end, "rb", buffering=0) as stream, os.fdopen(other, "wb", buffering=0) as client:
        arrived = arrivals(stream)
        assert not arrived()
        client.write(b"Content-Length")
        assert arrived() == hasattr(select, "poll")
        stream.read(14)
        assert not arrived()


def test_idle_work_that_fails_leaves_questions_answered() -> None:
    world = World()

    def steps() -> Iterator[Callable[[], None] | None]:
        raise ZeroDivisionError("a bug")
        yield None

    world.worker = Worker(lambda: world.db, steps)
    world.put("edit", "edit")
    world.worker.start()
    answered = Event()
    world.worker.put(Job("quick", lambda job: answered.set()))
    assert answered.wait(10) and world.done == ["edit"]


def test_a_question_about_a_whole_file_gives_way_to_quick_ones_and_comes_back() -> None:
    world = World(opened=0, closed=0)
    world.worker.put(Job("slow", world.long("lenses")))
    world.worker.start()
    assert world.begun.wait(10)
    answered = Event()
    world.worker.put(Job("quick", lambda job: (world.done.append("hover"), answered.set())))  # type: ignore[func-returns-value]
    assert answered.wait(10)
    world.go_on.set()
    world.worker.check_again()
    assert world.finished() == ["lenses begins", "hover", "lenses begins", "lenses ends"]


def test_a_question_about_a_whole_file_gives_way_to_diagnostics() -> None:
    world = World(opened=1, closed=0)
    world.worker.put(Job("slow", world.long("lenses")))
    world.worker.start()
    assert world.begun.wait(10)
    world.put("edit", "edit")
    assert not world.go_on.wait(0.1)
    world.go_on.set()
    assert world.finished() == ["lenses begins", "edit", "open 0", "lenses begins", "lenses ends"]


def test_a_question_about_a_whole_file_is_answered_in_the_end() -> None:
    """However many quick ones come."""
    world = World(opened=0, closed=0)
    run = world.long("lenses")
    world.worker.put(Job("slow", run))
    world.worker.start()
    for _ in range(PATIENCE):
        assert world.begun.wait(10)
        world.begun.clear()
        world.put("quick", "hover")
    assert world.begun.wait(10)
    world.put("quick", "late hover")
    world.go_on.wait(0.05)
    world.go_on.set()
    world.worker.check_again()
    done = world.finished()
    assert done.count("hover") == PATIENCE and done.index("lenses ends") < done.index("late hover")


def test_questions_about_whole_files_are_known_as_such() -> None:
    """Editors ask them after each key, unasked by anyone."""
    document = ("codeLens", "documentSymbol", "inlayHint", "semanticTokens/full", "semanticTokens/full/delta",
                "semanticTokens/range", "foldingRange", "documentLink", "formatting")  # fmt: skip
    assert {FEATURES[f"textDocument/{name}"].pace for name in document} == {"slow"}
    assert FEATURES["textDocument/diagnostic"].pace == "diagnosis"
    quick = ("hover", "completion", "signatureHelp", "definition", "documentHighlight", "codeAction")
    assert {FEATURES[f"textDocument/{name}"].pace for name in quick} == {"quick"}


def test_diagnostics_come_before_the_lenses_that_were_asked_for_first(server: Any, uri: Any) -> None:
    """Of a real server: the answers to what an editor asks at once after a key."""
    client: Client = server()
    text = "".join(f"def f{i}(t) t + {i}\n" for i in range(300))
    client.open(uri("main"), text)
    client.note("textDocument/publishDiagnostics", uri=uri("main"), version=1)
    order: list[Any] = []
    receive = client._received

    def received(message: dict[str, Any]) -> None:
        order.append(message["params"].get("version") if "method" in message else "answer")
        receive(message)

    client._received = received  # type: ignore[method-assign]
    client.change(uri("main"), 2, {"text": text + "def g(t) nowhere\n"})
    asked = client.begin("textDocument/codeLens", {"textDocument": {"uri": uri("main")}})
    assert len(client.answer(asked)["result"]) >= 300
    told = client.note("textDocument/publishDiagnostics", uri=uri("main"), version=2)
    assert told["diagnostics"] and order.index(2) < order.index("answer")
