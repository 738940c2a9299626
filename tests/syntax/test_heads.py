"""What a chunk defines, told without parsing: never otherwise than the parser says it."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from potto.syntax import defined_name, nodes, parse_chunk, split

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CHUNKS = [
    (chunk.text, path.suffix == ".diffeo")
    for path in sorted(EXAMPLES.rglob("*"))
    if path.suffix in (".po", ".diffeo")
    for chunk in split(path.read_text(encoding="utf-8"))
]
TYPED = [*"()[],.;:=?\\~ \"#+-*/^<>01xkdθλ'", "\n    ", " if ", " then ", " integral ", " let ", "def "]
TYPED += ["print", "==", "\f", "\t"]


def agrees(text: str, diffeo: bool) -> None:
    told = defined_name(text)
    if told is None:
        return
    item = parse_chunk(text, diffeo).item
    assert item is not None and not isinstance(item, nodes.FromImport | nodes.Import), text
    assert getattr(item, "name", None) == told[0], text
    if isinstance(item, nodes.Definition | nodes.DiffeoDefinition):
        assert item.name_span == told[1], text
    assert text[told[1].start : told[1].end] == told[0]


def test_examples_are_told_without_parsing() -> None:
    definitions = [c for c in CHUNKS if isinstance(parse_chunk(*c).item, nodes.Definition | nodes.DiffeoDefinition)]
    told = [text for text, _ in definitions if defined_name(text) is not None]
    assert len(told) > 0.95 * len(definitions) > 50
    for chunk in CHUNKS:
        agrees(*chunk)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("def f(x) x", "f"), ("# a\n\n# b\ndef  f (x) x", "f"), ("θ = 3", "θ"), ("f=\\x . x", "f"),
        ("\fdef f(x) x", "f"),
        ("def f", None), ("def if(x) x", None), ("a == b", None), ("print(x)", None), ("if = 3", None),
        ("from a import f", None), ("def a.b(x) x", None), ("# def f(x) x", None), ("f(x)", None), ("λ = 3", None),
    ],
)  # fmt: skip
def test_what_is_told(text: str, name: str | None) -> None:
    told = defined_name(text)
    assert (None if told is None else told[0]) == name


@pytest.mark.parametrize("part", range(4))
def test_broken_chunks(part: int) -> None:
    rng = random.Random(part)
    for _ in range(400):
        text, diffeo = rng.choice(CHUNKS)
        for _ in range(rng.randrange(1, 4)):
            at = rng.randrange(min(len(text), 30) + 1) if rng.random() < 0.6 else rng.randrange(len(text) + 1)
            cut = rng.randrange(1, 6) if rng.random() < 0.5 else 0
            text = text[:at] + ("" if cut else rng.choice(TYPED)) + text[at + cut :]
        for chunk in split(text):
            agrees(chunk.text, diffeo)
