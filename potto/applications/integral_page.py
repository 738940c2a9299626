"""The page of an integral view: one for a browser and for the webviews of editors.

Owns `parts` and `page`. Its script and style are the files in `view_page`; it loads nothing else.
"""

from __future__ import annotations

from pathlib import Path

_FOLDER = Path(__file__).parent / "view_page"
BODY = """<header>
<select id="name" aria-label="function"></select> by <select id="wrt" aria-label="parameter that moves"></select>
<select id="which" aria-label="integral" hidden></select>
<label title="the surfaces a step to both sides, and the difference of the values there">
<input type="checkbox" id="ghost"> finite differences ±</label>
<input id="step" type="number" min="0" step="0.01" value="0.05" aria-label="step">
<label title="where the integrand was evaluated"><input type="checkbox" id="nodes"> nodes</label>
<button id="pin" title="keep this picture beside the one that moves">Pin</button> <span id="time" role="status"></span>
</header>
<div id="said" role="alert"></div>
<section id="sliders" aria-label="Parameters"></section>
<main id="shots"><figure class="shot" id="now"></figure><figure class="shot" id="pinned"></figure></main>
<section id="formulas"></section>
<pre id="source"></pre>
"""


def parts() -> dict[str, str]:
    """The body, the style and the script, for whoever builds a page of them."""
    texts = {name: (_FOLDER / f"view.{name}").read_text(encoding="utf-8") for name in ("css", "js")}
    return {"body": BODY, "style": texts["css"], "script": texts["js"]}


def page(nonce: str) -> str:
    """The page for a browser; what is not of this page is run by nobody who holds to the nonce."""
    found = parts()
    head = f'<meta charset="utf-8"><title>Potto: integral view</title><style nonce="{nonce}">{found["style"]}</style>'
    return (
        f'<!doctype html><html lang="en">{head}<body>\n{found["body"]}<script nonce="{nonce}">{found["script"]}'
        "</script></body></html>\n"
    )
