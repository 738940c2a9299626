"""`potto/scenes`, `potto/sample` and `potto/pixel`: what a preview may show, its numbers, and the code behind a pixel.

Beyond the protocol: clients that draw by themselves ask for numbers, others for the picture of `potto.preview`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from potto import ide
from potto.ide.display.pixels import PixelCondition, pixel_conditions
from potto.ide.display.scenes import piece_scenes
from potto.modules import chunk_start, chunk_text
from potto.query import Database, query
from potto.source import Span
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.deferred import Deferred
from potto_lsp.failures import InvalidParams
from potto_lsp.features.by_piece import PieceItems, part_of, whole
from potto_lsp.features.commands import task
from potto_lsp.text import DocumentText, Encoding
from potto_lsp.wire import Encoded

MOST = 512 * 512  # places in one answer


def scenes(ask: Ask) -> Encoded:
    """The functions of a file that can be drawn."""
    file, encoding = ask.file, ask.text.encoding
    return whole(ask, lambda at: _part(ask.db, file, at.text, at.hidden, encoding))


@query(keep=1024)
def _part(db: Database, file: str, text: str, hidden: tuple[str, ...], encoding: Encoding) -> PieceItems:
    """Those of a piece."""
    place, found = DocumentText(text, encoding), piece_scenes(db, file, text, hidden)
    return part_of(
        {
            "name": scene.name, "range": convert.range_of(place, scene.span), "components": scene.components,
            "axes": list(scene.axes), "parameters": [_parameter(parameter) for parameter in scene.parameters],
        }
        for scene in found
        if scene.axes
    )  # fmt: skip


def _parameter(parameter: ide.SceneParameter) -> dict[str, Any]:
    return {
        "name": parameter.name, "kind": parameter.kind, "type": parameter.type, "size": parameter.size,
        "value": list(parameter.value), "fits": list(parameter.fits),
        "reach": None if parameter.reach is None else list(parameter.reach),
    }  # fmt: skip


def sample(ask: Ask) -> Deferred:
    """The values of a function over a grid, computed by the evaluation process."""
    name = ask.string("name")
    axes = ask.items("axes")
    if not axes or len(axes) > 2 or not all(map(_is_axis, axes)):
        raise InvalidParams("`axes` are one or two objects with a name, `from`, `to` and a count")
    places = 1
    for axis in axes:
        places *= axis["count"]
    if places > MOST:
        raise InvalidParams(f"at most {MOST} places are sampled at once")
    values, wrt, rtol = ask.optional("values"), ask.optional("wrt"), ask.optional("rtol")
    if not isinstance(values, Mapping | None) or not isinstance(wrt, str | None):
        raise InvalidParams("`values` is an object, and `wrt` the name of a parameter")
    if not isinstance(rtol, int | float | None) or (rtol is not None and not 0 < rtol < 1):
        raise InvalidParams("`rtol` is between 0 and 1")
    more = {"axes": axes, "values": values or {}, "wrt": wrt, "rtol": rtol}
    return task(ask, "sample", ask.file, name, more, quiet=True)  # the picture itself shows the progress


def pixel(ask: Ask) -> Deferred:
    """The code behind a pixel: the conditions of the function that is drawn, the nearest first."""
    name, values, cell = ask.string("name"), ask.get("values"), ask.get("cell")
    if not isinstance(values, Mapping) or not isinstance(cell, Mapping) or not all(map(_is_number, cell.values())):
        raise InvalidParams("`values` is an object, and `cell` the sides of a pixel by the names of its axes")
    if not cell or not all(_is_number(values.get(axis)) for axis in cell):
        raise InvalidParams("`values` has a number for each axis of `cell`")
    given = tuple((str(parameter), text) for parameter, text in values.items() if isinstance(text, str))
    found = pixel_conditions(ask.db, ask.file, name, given)
    start = chunk_start(ask.db, ask.file, name)
    chunk = chunk_text(ask.db, ask.file, name) or ""
    defined = ask.range(Span(start, start + len(chunk.rstrip())))
    written = [{"equation": each.equation, **_written(ask, each)} for each in found]
    surfaces = [{"text": each.text, "parameters": list(each.parameters)} for each in found]

    def placed(result: Mapping[str, Any]) -> dict[str, Any]:
        there = sorted(({**where, **one} for where, one in zip(written, result["seen"])), key=lambda c: c["pixels"])
        return {"range": defined, "conditions": there}

    more = {"surfaces": surfaces, "values": values, "cell": cell}
    return task(ask, "pixel", ask.file, name, more, placed, quiet=True)


def _written(ask: Ask, found: PixelCondition) -> protocol.Location:
    """Where a condition is written."""
    return convert.location(ask.analysis, found.file, found.span.shift(chunk_start(ask.db, found.file, found.name)))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_axis(axis: Any) -> bool:
    if not isinstance(axis, Mapping) or not isinstance(axis.get("name"), str):
        return False
    ends, count = (axis.get("from"), axis.get("to")), axis.get("count")
    return all(isinstance(end, int | float) for end in ends) and isinstance(count, int) and 0 < count <= MOST
