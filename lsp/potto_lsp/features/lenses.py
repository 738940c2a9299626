"""`textDocument/codeLens`: the value of a definition and what more can be done with it, above it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from potto import ide
from potto.ide.display.code_lenses import piece_lenses
from potto.modules import names
from potto.query import Database, query
from potto.source import Span
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.failures import InvalidParams
from potto_lsp.features.by_piece import PieceItems, lined, part_of
from potto_lsp.text import DocumentText, Encoding
from potto_lsp.wire import Encoded

COMMANDS = {
    "value": "potto.evaluate", "more": "potto.more", "run": "potto.evaluate", "evaluate": "potto.evaluate",
    "differentiate": "potto.differentiate", "showDerivative": "potto.differentiate",
}  # fmt: skip
SETTINGS = {"value": "lenses.value", "more": "lenses.more", "run": "lenses.run"}
REFERENCES = "potto.showReferences"  # a command of the client; used only if the client says that it has it
LONG = 40  # characters; a lens shows no longer value


def code_lenses(ask: Ask) -> Encoded:
    """The lenses of a file, except for kinds that are turned off."""
    off = {kind for kind, setting in SETTINGS.items() if ask.analysis.settings.get(setting) is False}
    found, encoding = list[bytes](), ask.text.encoding
    for at, line in lined(ask):
        part, runs = _part(ask.db, ask.file, at.text, at.hidden, encoding, ask.uri, frozenset(off))
        found.append(part.placed(line))
        if runs:  # a script is run once
            off.add("run")
    return Encoded(found)


@query(keep=1024)
def _part(
    db: Database, file: str, text: str, hidden: tuple[str, ...], encoding: Encoding, uri: str, off: frozenset[str]
) -> tuple[PieceItems, bool]:
    """The lenses of a piece, and whether one of them runs the script. The titles of values are looked up when they are
    shown."""
    place, lenses = DocumentText(text, encoding), piece_lenses(db, file, text, hidden)
    part = part_of(
        {"range": convert.range_of(place, lens.span), "data": [lens.command, *lens.arguments]}
        if lens.command == "value"
        else {"range": convert.range_of(place, lens.span), "command": _command(lens, uri)}
        for lens in lenses
        if lens.command not in off
    )
    return part, any(lens.command == "run" for lens in lenses)


def resolve(ask: Ask) -> Any:
    data = ask.optional("data")
    if ask.optional("command") is not None:  # nothing is missing
        return ask.params
    if not isinstance(ask.params, Mapping) or not isinstance(data, list) or len(data) != 3 or data[0] != "value":
        raise InvalidParams("`data` is not as it was given")
    _, file, name = map(str, data)
    lens = ide.resolve_code_lens(ask.db, ide.CodeLens(Span(0, 0), "value", (file, name)))
    known = next((value.result.get("shown") for _, value in ask.session.live.at_points(file, name)), None)
    command = _command(lens, ask.analysis.uri(file))
    if isinstance(known, str) and len(known) <= LONG:
        command["title"] = f"= {known}"
    return {**ask.params, "command": command}


def _command(lens: ide.CodeLens, uri: str) -> protocol.Command:
    return {"title": lens.title, "command": COMMANDS[lens.command], "arguments": [uri, *lens.arguments[1:]]}


def offers(ask: Ask, file: str, name: str) -> Iterator[protocol.Command]:
    """What can be done with a definition, for a client to choose from."""
    if name not in names(ask.db, file):
        return
    uri = ask.analysis.uri(file)
    for offer in ide.offered(ask.db, file, name):
        if offer.command == "showReferences":
            yield from _references(ask, offer, file)
        else:
            yield {"title": offer.title, "command": COMMANDS[offer.command], "arguments": [uri, *offer.arguments[1:]]}
        if offer.command == "showDerivative" and _has_picture(ask, ide.scene(ask.db, file, name)):
            yield {"title": "preview", "command": "potto.preview", "arguments": [uri, name]}


def _has_picture(ask: Ask, scene: ide.Scene | None) -> bool:
    """Whether a function can be drawn: one of one or two numbers, also with functions that are known. A client that
    draws by itself can show others, too."""
    if scene is None or not scene.axes:
        return False
    numbers = [p for p in scene.parameters if p.kind == "number"]
    known = all(p.kind == "number" or p.fits for p in scene.parameters)
    simple = known and len(numbers) <= 2 and scene.components == 1
    return simple or ask.client.lists("experimental.commands.commands", "potto.preview")


def _references(ask: Ask, offer: ide.Offer, file: str) -> Iterator[protocol.Command]:
    """The places where it is used, if the client can show them."""
    if not ask.client.lists("experimental.commands.commands", REFERENCES):
        return
    _, _, offset = offer.arguments
    places = [convert.place(ask.analysis, place) for place in ide.references(ask.db, file, int(offset), False)]
    position = convert.position(ask.analysis.text(file), int(offset))
    yield {"title": offer.title, "command": REFERENCES, "arguments": [ask.analysis.uri(file), position, places]}
