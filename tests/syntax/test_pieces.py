"""Pieces of a file: split one by one they hold the chunks of the whole, wherever earlier texts have left the cuts."""

from __future__ import annotations

import random

import pytest

from potto.syntax import chunks, pieces, split

WORDS = [
    "(", ")", "[", "]", "\n", "\n\n", "\r\n", "\r", "\f", "\ufeff", " ", "=", "\"", "# c\n", "#> f(1)\n", "def f\n",
    "def g(x)\n    x\n\n", "x = 1\n", "let a = 1 in", "  y\n", "in\n", "let\n", "record A(", "from m import a\n", "b(",
    "print", "diffeo q(x)\n", "# d\ndef h\n",
]  # fmt: skip


def of_pieces(found: tuple[str, ...]) -> list[tuple[int, str]]:
    start, out = 0, []
    for piece in found:
        out += [(start + chunk.start, chunk.text) for chunk in split(piece)]
        start += len(piece)
    return out


@pytest.mark.parametrize("seed", range(4))
def test_pieces_hold_the_chunks_of_the_whole(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunks, "PIECE", 40)
    rng = random.Random(seed)
    for _ in range(150):
        text = "".join(rng.choice(WORDS) for _ in range(rng.randrange(60)))
        found = pieces(text)
        for _ in range(10):
            assert "".join(found) == text
            assert of_pieces(found) == [(chunk.start, chunk.text) for chunk in split(text)], (text, found)
            start = rng.randrange(len(text) + 1)
            end = min(len(text), start + rng.choice([0, 0, 0, 1, 2, 5, 30]))
            text = text[:start] + rng.choice([*WORDS, "", ""]) + text[end:]
            found = pieces(text, found)


def test_an_edit_makes_one_piece_anew() -> None:
    text = "".join(f"def f{n}(x)\n    x + {n}\n\n" for n in range(1000))
    before = pieces(text)
    after = pieces(text.replace("x + 500\n", "x + 501\n", 1), before)
    assert len(before) > 8 and len(after) == len(before)
    assert sum(old is not new for old, new in zip(before, after)) == 1
