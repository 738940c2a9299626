"""Growing a selection: the word, the expression around it, the definition, the file. Owns `selection_ranges`."""

from __future__ import annotations

from potto.ide.names.places import chunk_at, text_of, word_at
from potto.query import Database
from potto.source import Span
from potto.syntax import extent, node_at


def selection_ranges(db: Database, file: str, offset: int) -> tuple[Span, ...]:
    """What holds an offset, innermost first; each is inside the next."""
    text = text_of(db, file)
    offset = min(max(offset, 0), len(text))
    found = [word_at(text, offset)]
    chunk = chunk_at(db, file, offset)
    if chunk is not None and offset <= chunk.start + len(chunk.text):
        parsed = chunk.parsed(db)
        relative = offset - chunk.start
        found += [chunk.absolute(c.span) for c in parsed.comments if c.span.start <= relative <= c.span.end]
        if parsed.item is not None:
            found += [chunk.absolute(extent(node)) for node in reversed(node_at(parsed.item, relative))]
        found.append(Span(chunk.start, chunk.start + len(chunk.text)))
    found.append(Span(0, len(text)))
    return _nested(found)


def _nested(spans: list[Span]) -> tuple[Span, ...]:
    """Those that grow, each once."""
    out: list[Span] = []
    for span in spans:
        if not out or (span != out[-1] and span.start <= out[-1].start and out[-1].end <= span.end):
            out.append(span)
    if len(out) > 1 and not len(out[0]):
        del out[0]
    return tuple(out)
