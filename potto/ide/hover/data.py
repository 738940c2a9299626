"""Hover of loaded data: what a file holds, in a line with a sparkline, and a picture small."""

from __future__ import annotations

import base64
from pathlib import Path

from potto.data.mistakes import DataMistake
from potto.data.values import Table
from potto.ide.names.symbols import PartSymbol
from potto.modules.data import data_file
from potto.query import Database
from potto.syntax import nodes
from potto.types import format_type


def data_markdown(db: Database, file: str, item: nodes.Definition | nodes.DiffeoDefinition) -> str:
    """What is in the file that a definition loads; nothing for other definitions."""
    written = loaded_by(item)
    found = None if written is None else data_file(db, file, written)
    if found is None or isinstance(found, DataMistake):
        return ""
    from potto.data.display import summary, thumbnail
    from potto.data.files import read, values_of

    content = read(Path(found.path))
    value = content if isinstance(content, DataMistake) else values_of(Path(found.path), content)
    if isinstance(value, DataMistake):
        return value.message
    picture = thumbnail(value)
    shown = "" if picture is None else f"\n\n![picture](data:image/png;base64,{base64.b64encode(picture).decode()})"
    return f"```\n{summary(value)}\n```{shown}"


def part_markdown(part: PartSymbol) -> str:
    """A part of a tuple, or a column of a file with what it holds."""
    shown = f"```potto\n{part.name} : {format_type(part.type)}\n```\n\n"
    if part.data is None:
        return f"{shown}part of `{format_type(part.whole)}`"
    from potto.data.display import summary
    from potto.data.files import read, values_of

    path = Path(part.data)
    content = read(path)
    value = content if isinstance(content, DataMistake) else values_of(path, content)
    column = value[part.path] if isinstance(value, Table) else None
    held = "" if column is None else f"\n\n```\n{summary(column)}\n```"
    return f"{shown}column of `{path.name}`{held}"


def loaded_by(item: nodes.Definition | nodes.DiffeoDefinition) -> str | None:
    """The file that a definition is the content of."""
    body = item.body if isinstance(item, nodes.Definition) else None
    if not isinstance(body, nodes.Apply) or body.function != nodes.Name(body.function.span, "load"):
        return None
    only = body.arguments[0].value if len(body.arguments) == 1 else None
    return only.text if isinstance(only, nodes.Text) else None
