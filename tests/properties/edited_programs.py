"""Programs to edit, and edits as people and accidents make them. Deterministic: everything hangs on a seed."""

from __future__ import annotations

import random

from potto.checking.library import Library
from potto.syntax import split

WORKSPACE = {
    "shapes.po": """# Shapes and what they cover.
def step(u) [u > 0]

def disc(x, y)(r)
    [x^2 + y^2 < r^2]

def smooth(u)
    s = exp(-u)
    1/(1 + s)

diffused = \\(x, y) . \\w . smooth((x - y)/w)
""",
    "middle.po": """from shapes import step, disc as d0
import shapes

# The area that a disc covers.
def area(r, k)
    s = k*2
    integral ([0, 1], [0, s]) d0(x, y)(r) d(x, y)

def left(t)
    integral [0, 1] step(x - t)*x d(x) + shapes.smooth(t)

def twice(h, x) h(h(x))
""",
    "half.diffeo": """half = \\(x, y) . \\c . (x + y + c, x - y)
""",
    "main.po": """from middle import area, left, twice
from half import half

def shader(x, y)(c) ((half (x, y) c) ? x : y)

def render(c)
    integral ([0, 1], [0, 1]) shader(x, y)(c) d(x, y) + left(c)

def both(a)
    u = let v = a*2 in v + 1
    twice(left, u) + (if a > 0 then area(a, 1) else render(a))

drender = deriv(render)
print(drender(dc=(0.5, 1)), both(0.25))
#> render(0.5)
""",
}
TYPED = [
    *"()[],.;:=?\\~ \"#+-*/^<>0123xtkuθ𝄞'",
    "\n    ",
    "\n",
    "\r\n",
    " if ",
    " then ",
    " integral ",
    " let ",
    "deriv(",
    "sum ",
]
LINES = [
    "def new(x) x\n",
    "x = 3\n",
    "# a comment\n",
    "\n",
    "from shapes import smooth\n",
    "print(1)\n",
    "    1 + 2\n",
    ")\n",
]


def edited(text: str, rng: random.Random) -> str:
    """One edit: something typed, deleted, doubled or moved; a line or a whole definition."""
    at = rng.randrange(len(text) + 1)
    roll = rng.random()
    if roll < 0.35:
        return text[:at] + rng.choice(TYPED) + text[at:]
    if roll < 0.65:
        return text[:at] + text[at + rng.randrange(1, 8) :]
    if roll < 0.75:
        other = rng.randrange(len(text) + 1)
        return text[:at] + text[other : other + rng.randrange(1, 20)] + text[at:]
    lines = text.splitlines(keepends=True)
    line = rng.randrange(len(lines) + 1)
    if roll < 0.88:
        return "".join([*lines[:line], rng.choice(LINES), *lines[line:]])
    if roll < 0.94:
        return "".join([*lines[:line], *lines[line + rng.randrange(1, 4) :]])
    chunks = [text[a.start : b] for a, b in _spans(text)]
    rng.shuffle(chunks)
    return "".join(chunks)


def _spans(text: str) -> list[tuple[object, int]]:
    chunks = split(text)
    return list(zip(chunks, [*(chunk.start for chunk in chunks[1:]), len(text)]))


def broken(text: str, rng: random.Random) -> str:
    """A definition with one to three mistakes in it; what is typed never starts a line, so it stays one definition."""
    for _ in range(rng.randrange(1, 4)):
        at = rng.randrange(len(text) + 1)
        roll = rng.random()
        if roll < 0.5:
            text = text[:at] + text[at + rng.randrange(1, 6) :]
        elif roll < 0.9:
            text = (
                text[:at] + rng.choice([typed for typed in TYPED if "\n" not in typed or typed == "\n    "]) + text[at:]
            )
        else:
            text = text[: max(at, 4)]
    return text


def library(root: str, texts: dict[str, str]) -> Library:
    """A library of these texts, none of them on disk."""
    made = Library([root])
    for name, text in texts.items():
        made.put(f"{root}/{name}", text)
    return made
