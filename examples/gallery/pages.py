"""The pages of the gallery: an index with pictures, times and errors, and all pictures on one sheet."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from pathlib import Path

from made import Made, Shown

Chapters = Sequence[tuple[str, str, Sequence[Made]]]
STYLE = """
:root{color-scheme:light dark;--paper:#fff;--ink:#222;--faint:#666;--line:#ddd}
@media(prefers-color-scheme:dark){:root{--paper:#101216;--ink:#e4e4e4;--faint:#9a9a9a;--line:#333}}
body{background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,sans-serif;
max-width:72rem;margin:2rem auto;padding:0 1rem}
h2{border-top:1px solid var(--line);padding-top:1.5rem;margin-top:2.5rem}p,figcaption,td{color:var(--faint)}
.row{display:flex;flex-wrap:wrap;gap:1rem}figure{margin:0}figcaption{font-size:.8rem}
figure img{height:15rem;max-width:100%;border-radius:6px;border:1px solid var(--line)}
.drawn img{image-rendering:pixelated}
code{font-size:.85em}.measured{font-size:.85rem}
"""
ACROSS, CELL, LABEL = 5, 200, 34


def _measured(entry: Made) -> str:
    """What an entry took and how right it is, as far as that is known."""
    parts = [f"<code>examples/{html.escape(entry.source)}</code>", html.escape(entry.detail)]
    if entry.seconds is not None:
        parts.append(f"{entry.seconds:.3g} s")
    if entry.error is not None:
        parts.append(f"largest estimated error {entry.error:.1e}")
    return " · ".join(part for part in parts if part)


def _figure(shown: Shown) -> str:
    caption = html.escape(shown.caption)
    kind = ' class="drawn"' if shown.file.endswith(".png") else ""
    return f'<figure{kind}><img src="{shown.file}" alt="{caption}"><figcaption>{caption}</figcaption></figure>'


def index(chapters: Chapters, seconds: float) -> str:
    count = sum(len(entry.files) for _, _, entries in chapters for entry in entries)
    parts = [
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Potto: the gallery</title>',
        f'<meta name="viewport" content="width=device-width"><style>{STYLE}</style><h1>Gallery</h1>',
        f"<p>{count} pictures of the programs in <code>examples/</code>, made in {seconds:.0f} s by "
        '<code>make gallery</code>; <a href="contact.svg">all of them on one sheet</a>.</p>',
    ]
    for title, about, entries in chapters:
        parts.append(f"<h2>{html.escape(title)}</h2><p>{html.escape(about)}</p>")
        for entry in entries:
            parts.append(f"<h3>{html.escape(entry.title)}</h3><p>{html.escape(entry.about)}</p>" if entry.about
                         else f"<h3>{html.escape(entry.title)}</h3>")  # fmt: skip
            parts.append(f'<div class="row">{"".join(map(_figure, entry.files))}</div>')
            said = f"not made: {html.escape(entry.failure)}" if entry.failure else _measured(entry)
            parts.append(f'<p class="measured">{said}</p>')
    return "\n".join([*parts, "</html>\n"])


def contact_sheet(chapters: Chapters, folder: Path) -> str:
    """All pictures in one SVG, which holds them: it can be shown by itself."""
    cells = [(entry.title, shown) for _, _, entries in chapters for entry in entries for shown in entry.files]
    rows = -(-len(cells) // ACROSS)
    width, height = ACROSS * (CELL + 12) + 12, rows * (CELL + LABEL + 12) + 12
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}"><style>'
        "text{font:11px system-ui,sans-serif;fill:#333}.paper{fill:#f6f6f4}image{image-rendering:pixelated}"
        "@media(prefers-color-scheme:dark){text{fill:#ddd}.paper{fill:#101216}}</style>"
        f'<rect class="paper" width="{width}" height="{height}"/>'
    ]
    for number, (title, shown) in enumerate(cells):
        x, y = 12 + number % ACROSS * (CELL + 12), 12 + number // ACROSS * (CELL + LABEL + 12)
        kind = "image/svg+xml" if shown.file.endswith(".svg") else f"image/{shown.file.rpartition('.')[2]}"
        data = base64.b64encode((folder / shown.file).read_bytes()).decode()
        parts.append(f'<image x="{x}" y="{y}" width="{CELL}" height="{CELL}" href="data:{kind};base64,{data}"/>')
        for line, text in enumerate((title, shown.caption)):
            short = text if len(text) <= 34 else text[:33] + "…"
            parts.append(f'<text x="{x}" y="{y + CELL + 13 + 14 * line}">{html.escape(short)}</text>')
    return "".join([*parts, "</svg>\n"])
