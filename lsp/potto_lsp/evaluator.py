"""The evaluation process: it runs programs for the server, so that nothing they do can hold the server up.

Owns `main`: one JSON object a line on standard input, and one a line on standard output. `evaluation` starts it as
`python -m potto_lsp.evaluator`. An interrupt ends the current task, not the process.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from threading import Thread
from typing import TYPE_CHECKING, Any, TextIO

from msgspec.structs import replace

from potto.reports.render import Located, ProgramError, render
from potto.source import Span

if TYPE_CHECKING:
    from potto.evaluating.world import World
    from potto.runtime.answers.estimate import Estimate

MOST_LINES = 1000  # of what a script shows


class Unanswerable(Exception):
    """A task that cannot be done, and why."""


class Interrupts:
    """Interrupts count only while a task runs."""

    def __init__(self) -> None:
        self._running = False
        signal.signal(signal.SIGINT, self._interrupt)

    def _interrupt(self, number: int, frame: object) -> None:
        if self._running:
            self._running = False
            raise KeyboardInterrupt

    @contextmanager
    def allowed(self) -> Iterator[None]:
        self._running = True
        try:
            yield
        finally:
            self._running = False


def main() -> int:
    """Carry out tasks until standard input ends, or until memory runs out: what is left of one task would make the next
    ones fail."""
    from potto_lsp.main import take_streams

    reader, writer = take_streams()
    _end_with(os.getppid())
    interrupts = Interrupts()
    tasks, answers = os.fdopen(os.dup(reader.fileno()), encoding="utf-8"), os.fdopen(writer.fileno(), "w")
    world = _loaded()
    _say(answers, {"ready": True})
    for line in tasks:
        task = json.loads(line)
        try:
            with interrupts.allowed(), _within(task["memory"]):
                answer = _answer(world, task)
        except KeyboardInterrupt:
            answer = {"error": "interrupted"}
        except MemoryError:
            _say(answers, {"id": task["id"], "error": f"stopped at {task['memory']:g} MB of memory"})
            return 0
        _say(answers, {"id": task["id"], **answer})
    return 0


@contextmanager
def _within(megabytes: float) -> Iterator[None]:
    """Limit the memory of a task, where the system can: on Linux, private memory, so that libraries and mapped files
    don't count."""
    try:
        import resource
    except ImportError:  # Windows
        yield
        return
    before, most = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = int(megabytes * 2**20)
    wanted = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
    resource.setrlimit(resource.RLIMIT_DATA, (wanted, most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (before, most))


def _loaded() -> World:
    from potto.evaluating.world import World

    return World()


def _say(stream: TextIO, message: Mapping[str, Any]) -> None:
    try:
        stream.write(json.dumps(message) + "\n")
        stream.flush()
    except BrokenPipeError:  # the server is gone, so nobody would read a message about it
        os._exit(0)


def _end_with(parent: int) -> None:
    """End when the server ends, even in the middle of a task."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    Thread(target=watch, name="potto-parent", daemon=True).start()


def _answer(world: World, task: Mapping[str, Any]) -> dict[str, Any]:
    """The outcome of a task: `result`, or `error` as a text for the user."""
    if world.files.roots != tuple(task["roots"]):  # setting them lists the workspace
        world.files.set_roots(task["roots"])
    for key, text in task["texts"].items():
        if text is None:
            world.files.close(key)
        else:
            world.put(key, text)
    if task["do"] != "view":  # which looks at the disk as often as a drag leaves time for it
        world.refresh()
    try:
        return {"result": TASKS[task["do"]](world, task)}
    except ProgramError as error:
        return {"error": _rendered(error), "brief": "; ".join(d.message for d in error.diagnostics)}
    except Unanswerable as error:
        return {"error": str(error)}
    except MemoryError:
        raise
    except Exception as error:  # a bug of ours: report it and go on
        import traceback

        traceback.print_exc()
        return {"error": f"internal error: {type(error).__name__}: {error}"}


def _evaluate(world: World, task: Mapping[str, Any]) -> dict[str, Any]:
    """The value of an expression."""
    from potto.runtime.answers.shown import estimate_json, format_answer

    answer = world.evaluate(task["file"], task["text"])
    remarks = [located.diagnostic.message for located in answer.remarks]
    estimate = answer.estimate
    return {"text": format_answer(estimate), "remarks": remarks, **estimate_json(estimate, answer.type)}


def _live(world: World, task: Mapping[str, Any]) -> dict[str, Any]:
    """The value of a live expression, whether it is the expected one, and any diagnostics."""
    from potto.evaluating.live import DOES_NOT_HOLD, agrees
    from potto.runtime.answers.printing import largest
    from potto.runtime.answers.shown import bounds, format_estimate, interval, pair

    file, expected = task["file"], task["expected"]
    try:
        answer = world.evaluate(file, task["text"])
    except ProgramError as error:  # the checker reports this already
        whole = Span(0, len(task["text"]))
        said = [
            one if one.file == "<expression>" else Located("<expression>", replace(one.diagnostic, span=whole))
            for one in error.located
            if one.diagnostic.code.startswith("P05") and one.diagnostic.code != "P0504"
        ]
        return {"text": "?", "holds": None, "expected": expected, "tooltip": _rendered(error), "said": _said(said)}
    estimate = answer.estimate
    found = {"text": format_estimate(estimate), "shown": interval(estimate), "holds": None, "expected": expected}
    if estimate.text is None:
        found["error"], found["exact"] = bounds(estimate), largest(pair(estimate)[1]) == 0
    said = [one for one in answer.remarks if one.diagnostic.code.startswith("P05")]
    if expected is not None and (wanted := _wanted(world, file, expected)) is not None:
        found["holds"] = agrees(estimate, wanted, world.parse(expected))
        if not found["holds"]:
            message = f"this is {found['shown']}, not {expected}"
            help = "correct the program, or the expected value"
            whole = Span(0, len(expected))
            failed = DOES_NOT_HOLD(whole, message, help=help)
            said.append(Located("<expected>", failed))
    return {**found, "said": _said(said)}


def _wanted(world: World, file: str, expected: str) -> Estimate | None:
    """What a live expression is expected to give; None if that cannot be evaluated."""
    try:
        return world.evaluate(file, expected).estimate
    except ProgramError:
        return None


def _said(found: list[Located]) -> list[dict[str, Any]]:
    """Diagnostics of an expression, or of what it is expected to give, as plain data."""
    return [
        {
            "where": located.file, "code": said.code, "severity": said.severity, "message": said.message,
            "span": [said.span.start, said.span.end], "notes": list(said.notes), "help": said.help,
        }
        for located in found
        if (said := located.diagnostic) and located.file in ("<expression>", "<expected>")
    ]  # fmt: skip


def _rendered(error: ProgramError) -> str:
    return "\n\n".join(render(located, error.sources) for located in error.located)


def _point(world: World, task: Mapping[str, Any]) -> dict[str, Any]:
    """A value and its slopes by each parameter that is a number, all with error bars."""
    from potto.runtime.answers.shown import bounds, format_estimate, interval, tangent_of

    estimate = world.evaluate(task["file"], task["text"]).estimate
    found: dict[str, Any] = {"text": format_estimate(estimate), "shown": interval(estimate), "slopes": []}
    if estimate.text is None:
        found["error"] = bounds(estimate)
    for parameter, expression in task["slopes"]:
        try:
            dual = world.evaluate(task["file"], expression).estimate
        except ProgramError:  # its derivative is not a number: it jumps with this parameter
            continue
        if dual.tangent is not None:
            slope = tangent_of(dual)
            said = {"text": format_estimate(slope), "error": bounds(slope), "shown": interval(slope)}
            found["slopes"].append({"by": parameter, **said})
    return found


def _run(world: World, task: Mapping[str, Any]) -> dict[str, Any]:
    """What a script prints."""
    from potto.runtime.script import Shown

    lines: list[str] = []
    for step in world.run(task["file"]):
        lines.append(step.text if isinstance(step, Shown) else render(step, world.source))
        if len(lines) == MOST_LINES:
            lines.append("...")
            break
    return {"text": "\n".join(lines)}


def _preview(world: World, task: Mapping[str, Any]) -> dict[str, Any]:
    """A picture of a function."""
    from potto_lsp.preview import NoPicture, preview

    try:
        return preview(world, task["file"], task["text"], task["box"], task["axes"], task["given"])
    except NoPicture as error:
        raise Unanswerable(str(error)) from None


def _sample(world: World, task: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a function over a grid."""
    from potto_lsp.sampling import NoSamples, sample

    try:
        return sample(world, task["file"], task["text"], task["axes"], task["values"], task["wrt"], task["rtol"])
    except NoSamples as error:
        raise Unanswerable(str(error)) from None


def _pixel(world: World, task: Mapping[str, Any]) -> dict[str, Any]:
    """For each surface, which side a pixel is on and how far away it is."""
    from potto_lsp.sampling import sides

    return {"seen": sides(world, task["file"], task["surfaces"], task["values"], task["cell"])}


_VIEWS: dict[str, Any] = {}  # by file: what the views of its integrals have compiled


def _view(world: World, task: Mapping[str, Any]) -> dict[str, Any]:
    """The answer to a question of the integral view's page."""
    from potto.applications.integral_answers import Answers

    file = task["file"]
    found = _VIEWS.setdefault(file, Answers(world, file)).answer(task["text"], task["question"])
    if found is None:
        raise Unanswerable(f"there is no question `{task['text']}`")
    answered: dict[str, Any] = found
    return answered


TASKS: Mapping[str, Callable[[World, Mapping[str, Any]], dict[str, Any]]] = {
    "evaluate": _evaluate,
    "live": _live,
    "point": _point,
    "run": _run,
    "preview": _preview,
    "sample": _sample,
    "pixel": _pixel,
    "view": _view,
}


if __name__ == "__main__":
    sys.exit(main())
