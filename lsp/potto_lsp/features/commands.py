"""`workspace/executeCommand`: `potto.evaluate`, `potto.differentiate`, `potto.preview`, `potto.more`.

Each takes the URI of a document and an expression or a name; `potto.evaluate` with the URI alone runs the script. The
answer is an object with a `text` to show; a picture is a data URI in `image`.
"""

from __future__ import annotations

import os.path
from collections.abc import Callable, Mapping
from typing import Any

from potto import ide
from potto.modules import names
from potto_lsp import protocol
from potto_lsp.asking import Ask
from potto_lsp.deferred import Deferred
from potto_lsp.evaluation import EvaluationTask
from potto_lsp.failures import InvalidParams, RequestError, RequestRefused
from potto_lsp.features.lenses import offers
from potto_lsp.presenting import INFO
from potto_lsp.progress import Working
from potto_lsp.uris import to_key

Result = Mapping[str, Any]


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
    """Evaluate an expression. A function's name alone stands for a call at its first point."""
    if not arguments:
        return _shown(ask, os.path.basename(file), task(ask, "run", file, ""))
    text = _text(arguments)
    point = _point_of_name(ask, file, text)
    return _shown(ask, text, task(ask, "evaluate", file, text if point is None else point.text))


def _point_of_name(ask: Ask, file: str, text: str) -> ide.CallPoint | None:
    """The point at which a function is looked at, if the text is its name."""
    if text not in names(ask.db, file) or ide.kind_of(ask.db, file, text) != "function":
        return None
    for point in ide.points(ask.db, file, text):
        return point
    raise RequestRefused(
        f"`{text}` is a function: evaluate a call of it, or write one as a live expression, `#> {text}(…)`"
    )


def _differentiate(ask: Ask, file: str, arguments: list[Any]) -> Any:
    """For a name the derivative in symbols, which needs neither numbers nor another process; for a call the slopes."""
    from potto.checking.facts import derivative_facts

    text = _text(arguments)
    if text not in names(ask.db, file):
        point = ide.point_of(ask.db, file, text)
        if point is None:
            raise RequestRefused(f"there is no definition of `{text}` in this file, and it is not a call of one")
        if not point.slopes:
            raise RequestRefused(f"`{text}` does not give numbers for numbers, so it has no slopes")
        deferred = task(ask, "point", file, point.text, {"slopes": point.slopes}, _slopes(point))
        return _shown(ask, point.text, deferred)
    facts = derivative_facts(ask.db, file, text)
    if facts is None:
        raise RequestRefused(f"`{text}` is not a function, so it has no derivative")
    inverse = ide.diffeo_markdown(ask.db, file, text)
    lines = [] if inverse is None else ["", *(f"  {line[2:]}" for line in inverse.replace("`", "").splitlines())]
    result = {"text": "\n".join([facts.text, *lines])}
    ask.session.presenter.present(f"derivative of {text}", result)
    return result


def _slopes(point: ide.CallPoint) -> Callable[[Result], Result]:
    """The value at a point and the slopes there, as lines to read."""

    def with_text(found: Result) -> Result:
        lines = [f"{point.text} = {found['shown']}"]
        lines += [f"  by {s['by']}: {s['shown']}" for s in found["slopes"]]
        missing = [name for name, _ in point.slopes if all(name != s["by"] for s in found["slopes"])]
        lines += [f"  by {name}: not a number, it jumps there" for name in missing]
        return {**found, "value": found["text"], "text": "\n".join(lines)}

    return with_text


def _preview(ask: Ask, file: str, arguments: list[Any]) -> Deferred:
    """A picture over a box: `[[x0, x1], [y0, y1]]`, the unit square if none is given."""
    box = arguments[1] if len(arguments) > 1 else None
    text = _text(arguments)
    scene = ide.scene(ask.db, file, text) if text in names(ask.db, file) else None
    functions = [p for p in scene.parameters if p.kind == "function"] if scene is not None else []
    for parameter in functions:
        if not parameter.fits:
            needs = f"`{text}` needs a function `{parameter.name}` of the type {parameter.type}"
            raise RequestRefused(f"{needs}: none was found in this file, in what it imports, or beside it")
    axes = [p.name for p in scene.parameters if p.kind != "function"] if scene is not None else []
    more = {"box": box, "axes": axes, "given": {p.name: p.fits[0] for p in functions}}
    return _shown(ask, text, task(ask, "preview", file, text, more))


def _more(ask: Ask, file: str, arguments: list[Any]) -> Any:
    """What can be done with a definition. A client without such a command of its own is shown a choice."""
    name = _text(arguments)
    found = list(offers(ask, file, name))
    if not found:
        raise RequestRefused(f"there is no definition of `{name}` in this file")
    if not ask.client.lists("experimental.commands.commands", "potto.more"):
        _choose(ask, name, [offer for offer in found if offer["command"] in _COMMANDS])
    return {"offers": found}


def _choose(ask: Ask, name: str, offers: list[protocol.Command]) -> None:
    """Let the user choose one of some commands, and carry it out."""

    def chosen(answer: Any, error: Any) -> None:
        title = answer.get("title") if isinstance(answer, Mapping) else None
        for offer in offers:
            if offer["title"] == title:
                ask.session.later(lambda offer=offer: _do(offer))  # type: ignore[misc]

    def _do(offer: protocol.Command) -> None:
        try:
            result = execute(Ask(ask.session, offer))
        except RequestError as refused:
            ask.session.notify("window/showMessage", {"type": INFO, "message": refused.message})
            return
        if isinstance(result, Deferred):
            result.start(lambda _: None)

    actions = [{"title": offer["title"]} for offer in offers]
    ask.session.request("window/showMessageRequest", {"type": INFO, "message": name, "actions": actions}, chosen)


def _text(arguments: list[Any]) -> str:
    if not arguments or not isinstance(arguments[0], str):
        raise InvalidParams("the second argument is an expression or a name")
    return arguments[0]


def task(
    ask: Ask,
    do: str,
    file: str,
    text: str,
    more: Mapping[str, Any] | None = None,
    shape: Callable[[Result], Result] = lambda result: result,
    quiet: bool = False,
) -> Deferred:
    """What the evaluation process answers, once it does. `shape` turns that into the answer of the request. `quiet`:
    without progress."""
    waiting: list[tuple[EvaluationTask, Working | None]] = []

    def start(finish: Callable[[Any | RequestError], None]) -> None:
        def done(answer: Result) -> None:
            if working is not None:
                working.end()
            finish(shape(answer["result"]) if "result" in answer else RequestRefused(str(answer["error"])))

        title = f"Potto: {text or os.path.basename(file)}"
        token = ask.optional("workDoneToken")
        token = token if isinstance(token, int | str) else None
        working = None if quiet else Working(ask.session, title, token, stop)
        waiting.append((ask.session.evaluator.put(EvaluationTask(do, file, text, done, more or {})), working))

    def stop() -> None:
        for each, working in waiting:
            each.cancelled.set()
            if working is not None:
                working.end()

    return Deferred(start, stop)


def _shown(ask: Ask, title: str, deferred: Deferred) -> Deferred:
    """The same, shown by us if the client does not."""

    def start(finish: Callable[[Any | RequestError], None]) -> None:
        def present(result: Any | RequestError) -> None:
            finish(result)
            if isinstance(result, Mapping):
                ask.session.presenter.present(title, result)

        deferred.start(present)

    return Deferred(start, deferred.stop)


_COMMANDS: Mapping[str, Callable[[Ask, str, list[Any]], Any]] = {
    "potto.evaluate": _evaluate,
    "potto.differentiate": _differentiate,
    "potto.preview": _preview,
    "potto.more": _more,
}
