"""`workspace/executeCommand`: `potto.evaluate`, `potto.differentiate`, `potto.preview`.

Each takes the URI of a document and an expression or a name; `potto.evaluate` with the URI alone runs the script. The
answer is an object with a `text` to show; a picture is a data URI in `image`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from potto.modules import names
from potto_lsp.asking import Ask
from potto_lsp.deferred import Deferred
from potto_lsp.errors import InvalidParams, Refusal, RequestError
from potto_lsp.evaluation import Task
from potto_lsp.uris import to_key


def execute(ask: Ask) -> Any:
    command = ask.string("command")
    arguments = ask.optional("arguments")
    arguments = arguments if isinstance(arguments, list) else []
    if command not in _COMMANDS:
        raise InvalidParams(f"there is no command `{command}`")
    if not arguments or not isinstance(arguments[0], str):
        raise InvalidParams(f"`{command}` takes the URI of a document first")
    return _COMMANDS[command](ask, to_key(arguments[0]), arguments[1:])


def _evaluate(ask: Ask, file: str, arguments: list[Any]) -> Deferred:
    if not arguments:
        return task(ask, "run", file, "")
    return task(ask, "evaluate", file, _text(arguments))


def _differentiate(ask: Ask, file: str, arguments: list[Any]) -> dict[str, Any]:
    """The derivative in symbols: needs no numbers and no other process."""
    from potto.facts import derivative_facts

    name = _text(arguments)
    if name not in names(ask.db, file):
        raise Refusal(f"there is no definition of `{name}` in this file")
    facts = derivative_facts(ask.db, file, name)
    if facts is None:
        raise Refusal(f"`{name}` is no function, so it has no derivative")
    return {"text": facts.text}


def _preview(ask: Ask, file: str, arguments: list[Any]) -> Deferred:
    """A picture over a box: `[[x0, x1], [y0, y1]]`, the unit square if none is given."""
    box = arguments[1] if len(arguments) > 1 else None
    return task(ask, "preview", file, _text(arguments), {"box": box})


def _text(arguments: list[Any]) -> str:
    if not arguments or not isinstance(arguments[0], str):
        raise InvalidParams("the second argument is an expression or a name")
    return arguments[0]


def task(ask: Ask, do: str, file: str, text: str, more: Mapping[str, Any] | None = None) -> Deferred:
    """What the evaluation process answers, when it does."""
    waiting: list[Task] = []

    def start(finish: Callable[[Any | RequestError], None]) -> None:
        def done(answer: Mapping[str, Any]) -> None:
            finish(answer["result"] if "result" in answer else Refusal(str(answer["error"])))

        waiting.append(ask.session.evaluator.put(Task(do, file, text, done, more or {})))

    def stop() -> None:
        for task in waiting:
            task.cancelled.set()

    return Deferred(start, stop)


_COMMANDS: Mapping[str, Callable[[Ask, str, list[Any]], Any]] = {
    "potto.evaluate": _evaluate,
    "potto.differentiate": _differentiate,
    "potto.preview": _preview,
}
