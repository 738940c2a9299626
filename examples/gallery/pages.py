"""The pages of the gallery: an index with pictures, times and errors, and all pictures on one sheet."""

from __future__ import annotations

import base64
import html
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from besides import Beside, sampled_by
from made import Made, Shown

STYLE = """
:root{color-scheme:light dark;--paper:#fff;--ink:#222;--faint:#666;--line:#ddd}
@media(prefers-color-scheme:dark){:root{--paper:#101216;--ink:#e4e4e4;--faint:#9a9a9a;--line:#333}}
body{background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,sans-serif;
max-width:72rem;margin:2rem auto;padding:0 1rem}
h2{border-top:1px solid var(--line);padding-top:1.5rem;margin-top:2.5rem}p,figcaption,td{color:var(--faint)}
.row{display:flex;flex-wrap:wrap;gap:1rem}figure{margin:0}figcaption{font-size:.8rem}
figure img{height:15rem;max-width:100%;border-radius:6px;border:1px solid var(--line)}
.row figcaption{width:0;min-width:100%}.drawn img{image-rendering:pixelated}
.entries{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(22.5rem,100%),1fr));gap:0 1rem}
.entry{min-width:0}.several{grid-column:1/-1}.number{white-space:nowrap}
code{font-size:.85em}th,td{text-align:left;vertical-align:top;padding:.1rem .8rem .1rem 0}.measured{font-size:.85rem}
"""
# Of the sheet: its width, what is between cells, above a chapter and below a picture for how many lines, and how wide a
# letter is
SHEET, GAP, HEADING, LABEL, LINES, LETTER = 1072, 12, 40, 76, 4, 6.2
DRAWN, ENLARGED = ' class="drawn"', 240  # the index shows pictures 15 rem high


@dataclass(frozen=True)
class Section:
    """A chapter: its entries as they were made, and its programs beside samples."""

    title: str
    about: str
    entries: Sequence[Made]
    besides: Sequence[Beside]


def _measured(entry: Made) -> str:
    """What an entry took and how right it is, as far as that is known."""
    parts = [f"<code>examples/{html.escape(entry.source)}</code>", html.escape(entry.detail)]
    if entry.seconds is not None:
        parts.append(f"{entry.seconds:.3g} s")
    if entry.error is not None:
        parts.append(f"largest estimated error {entry.error:.1e}")
    return " · ".join(part for part in parts if part)


def _figure(shown: Shown, folder: Path) -> str:
    caption, kind = html.escape(shown.caption), _kind(folder / shown.file)
    return f'<figure{kind}><img src="{shown.file}" alt="{caption}"><figcaption>{caption}</figcaption></figure>'


def _kind(file: Path) -> str:
    """The class of pictures whose pixels are enlarged, and are to be seen; of larger ones thin lines would be lost."""
    if file.suffix != ".png":
        return ""
    width = int.from_bytes(file.read_bytes()[16:20], "big")  # the first number of a PNG's header
    return DRAWN if width < ENLARGED else ""


def index(chapters: Sequence[Section], folder: Path, seconds: float) -> str:
    count = sum(len(entry.files) for section in chapters for entry in section.entries)
    parts = [
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Potto: the gallery</title>',
        f'<meta name="viewport" content="width=device-width"><style>{STYLE}</style><h1>Gallery</h1>',
        f"<p>{count} pictures of the programs in <code>examples/</code>, made in {seconds:.0f} s by "
        '<code>make gallery</code>; <a href="contact.svg">all of them on one sheet</a>. Values go from black to white, '
        "and derivatives from blue through white, which is 0, to red; captions name the numbers at both ends.</p>",
    ]
    for section in chapters:
        parts.append(f"<h2>{html.escape(section.title)}</h2><p>{html.escape(section.about)}</p>")
        parts.append(f'<div class="entries">{"".join(_entry(entry, folder) for entry in section.entries)}</div>')
        parts.append(_compared(section.besides))
    return "\n".join([*parts, "</html>\n"])


def _entry(entry: Made, folder: Path) -> str:
    """Its pictures with what is said of them. Entries of one picture stand side by side."""
    about = f"<p>{html.escape(entry.about)}</p>" if entry.about else ""
    pictures = "".join(_figure(shown, folder) for shown in entry.files)
    said = f"not made: {html.escape(entry.failure)}" if entry.failure else _measured(entry)
    return (
        f'<section class="entry{" several" if len(entry.files) > 1 else ""}"><h3>{html.escape(entry.title)}</h3>{about}'
        f'<div class="row">{pictures}</div><p class="measured">{said}</p></section>'
    )


def _compared(besides: Sequence[Beside]) -> str:
    """Programs beside those that sum up samples and differentiate the sum."""
    if not besides:
        return ""
    rows = []
    for beside in besides:
        of = beside.numbers
        numbers = [
            f"{of.value:.8g}",
            f"{of.sampled:.8g}",
            f"{of.slope:.8g} ± {of.error:.0e}",
            f"{of.sampled_slope:.8g}",
        ]
        times = [f"{1e3 * seconds:.1f} ms" for seconds in (of.seconds, of.sampled_seconds)]
        source = f'<a href="{html.escape(beside.address)}">{html.escape(beside.source)}</a>' if beside.address else ""
        cells = [f"<code>{html.escape(beside.program)}</code>", *numbers, *times]
        row = "".join(f'<td class="number">{cell}</td>' for cell in cells)
        rows.append(f"{row}<td>{html.escape(beside.said)} {source}</td>")
    heads = ("program", "value", "of samples", "derivative", "of their sum", "time", "of samples", "elsewhere")
    head = "".join(f"<th>{name}</th>" for name in heads)
    body = "".join(f"<tr>{row}</tr>" for row in rows)
    about = f"<p>A program that sums up samples, and the derivative of its sum, by {sampled_by()}.</p>"
    return f'<h3>Beside samples</h3>{about}<table class="measured"><tr>{head}</tr>{body}</table>'


def contact_sheet(chapters: Sequence[Section], folder: Path) -> str:
    """All pictures in one SVG, which holds them: it can be shown by itself. Chapters and their curves begin rows."""
    parts: list[str] = []
    y = GAP
    for section in chapters:
        y += HEADING
        parts.append(f'<text class="heading" x="{GAP}" y="{y - 12}">{html.escape(section.title)}</text>')
        shown = [(entry.title, _on_sheet(entry, picture)) for entry in section.entries for picture in entry.files]
        curves = [cell for cell in shown if cell[1].file.endswith(".svg")]
        for cells, across, shape in (([c for c in shown if c not in curves], 6, 1.0), (curves, 4, 2 / 3)):
            width = (SHEET - GAP) / across - GAP
            for row in range(0, len(cells), across):
                for number, (name, picture) in enumerate(cells[row : row + across]):
                    x = GAP + number * (width + GAP)
                    parts.append(_cell(name, picture, folder, (x, y, width, shape * width)))
                y += round(shape * width) + LABEL
    return "".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SHEET} {y}" width="{SHEET}"><style>'
        "text{font:11px system-ui,sans-serif;fill:#666}.heading{font-size:17px;fill:#222}.name{fill:#222}"
        ".paper{fill:#f6f6f4}.frame{fill:none;stroke:#8883}.drawn{image-rendering:pixelated}"
        "@media(prefers-color-scheme:dark){text{fill:#9a9a9a}.heading,.name{fill:#e4e4e4}.paper{fill:#101216}}</style>"
        f'<rect class="paper" width="{SHEET}" height="{y}"/>',
        *parts,
        "</svg>\n",
    ])  # fmt: skip


def _on_sheet(entry: Made, shown: Shown) -> Shown:
    """A picture as the sheet tells of it: of a curve, whose axis says what it is over, what its entry is about."""
    return Shown(shown.file, entry.about) if entry.about and shown.file.endswith(".svg") else shown


def _cell(name: str, shown: Shown, folder: Path, box: tuple[float, float, float, float]) -> str:
    """A picture with its frame, its name and what it shows. box: x, y, width, height."""
    x, y, width, height = box
    vector = shown.file.endswith(".svg")
    kind = "image/svg+xml" if vector else f"image/{shown.file.rpartition('.')[2]}"
    data = base64.b64encode((folder / shown.file).read_bytes()).decode()
    place = f'x="{x:.1f}" y="{y}" width="{width:.1f}" height="{height:.1f}"'
    parts = [f'<image{_kind(folder / shown.file)} {place} href="data:{kind};base64,{data}"/>']
    parts.append(f'<rect class="frame" {place}/>')
    letters = int(width / LETTER)
    names = textwrap.wrap(name, letters, max_lines=2, placeholder="…")
    lines = textwrap.wrap(shown.caption, letters, max_lines=LINES - len(names), placeholder="…")
    for line, text in enumerate([*names, *lines]):
        style = ' class="name"' if line < len(names) else ""
        parts.append(f'<text{style} x="{x:.1f}" y="{y + height + 15 + 14 * line:.1f}">{html.escape(text)}</text>')
    return "".join(parts)
