"""`textDocument/codeLens`: what can be done with a definition, above it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from potto import ide
from potto.source import Span
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.errors import InvalidParams

COMMANDS = {
    "evaluate": "potto.evaluate", "run": "potto.evaluate", "differentiate": "potto.differentiate",
    "showDerivative": "potto.differentiate", "preview": "potto.preview",
}  # fmt: skip
SETTINGS = {
    "evaluate": "lenses.evaluate", "run": "lenses.run", "differentiate": "lenses.differentiate",
    "showDerivative": "lenses.derivative", "showReferences": "lenses.references",
}  # fmt: skip
REFERENCES = "potto.showReferences"  # of the client; only one that says that it has it is given it


def code_lenses(ask: Ask) -> list[protocol.CodeLens]:
    """The lenses of a file, but for the kinds that are turned off."""
    found: list[protocol.CodeLens] = []
    settings = ask.analysis.settings
    previews = settings.get("lenses.preview") is not False
    scenes = {scene.name: scene for scene in ide.scenes(ask.db, ask.file)} if previews else {}
    off = {kind for kind, setting in SETTINGS.items() if settings.get(setting) is False}
    for lens in ide.code_lenses(ask.db, ask.file):
        if lens.command == "showDerivative":
            found += _previews(ask, lens, scenes.get(lens.arguments[1]))
        if lens.command in off or (_is_live(ask, lens) and settings.get("lenses.live") is False):
            continue
        made: protocol.CodeLens = {"range": ask.range(lens.span)}
        if lens.title:
            made["command"] = _command(ask, lens)
        else:
            made["data"] = [lens.command, *lens.arguments]
        found.append(made)
    return found


def _is_live(ask: Ask, lens: ide.CodeLens) -> bool:
    """Whether it stands above a live expression."""
    return ask.analysis.text(ask.file).text.startswith("#", lens.span.start)


def _previews(ask: Ask, lens: ide.CodeLens, scene: ide.Scene | None) -> list[protocol.CodeLens]:
    """A function of one or two numbers has a picture, also beside functions that are known; a client that draws for
    itself shows what has more, too."""
    if scene is None:
        return []
    numbers = [p for p in scene.parameters if p.kind == "number"]
    known = all(p.kind == "number" or p.fits for p in scene.parameters)
    simple = known and len(numbers) <= 2 and scene.components == 1
    if not simple and not ask.client.lists("experimental.commands.commands", "potto.preview"):
        return []
    arguments = [ask.analysis.uri(lens.arguments[0]), lens.arguments[1]]
    command: protocol.Command = {"title": "preview", "command": "potto.preview", "arguments": arguments}
    return [{"range": ask.range(lens.span), "command": command}]


def resolve(ask: Ask) -> Any:
    data = ask.optional("data")
    if ask.optional("command") is not None:  # nothing is missing
        return ask.params
    if not isinstance(ask.params, Mapping) or not isinstance(data, list) or len(data) < 2:
        raise InvalidParams("`data` is not as it was given")
    command, *arguments = map(str, data)
    whole = len(arguments) == 3 and arguments[2].isdecimal() if command == "showReferences" else command in COMMANDS
    if not whole:
        raise InvalidParams("`data` is not as it was given")
    lens = ide.CodeLens(Span(0, 0), cast(Any, command), tuple(arguments))
    return {**ask.params, "command": _command(ask, ide.resolve_code_lens(ask.db, lens))}


def _command(ask: Ask, lens: ide.CodeLens) -> protocol.Command:
    file, *rest = lens.arguments
    if lens.command == "showReferences":
        return _references(ask, lens, file, int(rest[1]))
    return {"title": lens.title, "command": COMMANDS[lens.command], "arguments": [ask.analysis.uri(file), *rest]}


def _references(ask: Ask, lens: ide.CodeLens, file: str, offset: int) -> protocol.Command:
    """A count to be clicked if the client can show places; else just a count."""
    if not ask.client.lists("experimental.commands.commands", REFERENCES):
        return {"title": lens.title, "command": ""}
    places = [convert.place(ask.analysis, place) for place in ide.references(ask.db, file, offset, False)]
    position = convert.position(ask.analysis.text(file), offset)
    return {"title": lens.title, "command": REFERENCES, "arguments": [ask.analysis.uri(file), position, places]}
