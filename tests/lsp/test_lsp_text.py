"""Texts kept in step with a client's, against a reference that knows no lines but works on encoded units."""

from __future__ import annotations

import random

import pytest
from how_many import examples
from potto_lsp.text import ENCODINGS, DocumentText, Encoding, line_starts

PIECES = ["a", "xyz", " ", "é", "ß", "中", "𝄞", "🙂", "\u2028", "\u2029", "\x0b", "\x0c", "\x1c", "\x85", "\n", "\r",
          "\r\n", "\n\n", "\ufeff", "\t"]  # fmt: skip
CODEC = {"utf-8": ("utf-8", 1), "utf-16": ("utf-16-le", 2), "utf-32": ("utf-32-le", 4)}


def reference_lines(text: str) -> list[str]:
    """The lines of a text with their ends, one character at a time."""
    lines, line, index = [], "", 0
    while index < len(text):
        if text[index] in "\r\n":
            end = 2 if text.startswith("\r\n", index) else 1
            lines.append(line + text[index : index + end])
            line, index = "", index + end
        else:
            line += text[index]
            index += 1
    return [*lines, line]


def reference_offset(text: str, line: int, column: int, encoding: Encoding) -> int:
    """The code points in front of a position, by encoding its line and cutting."""
    lines = reference_lines(text)
    if line >= len(lines):
        return len(text)
    before = sum(map(len, lines[:line]))
    content = lines[line].rstrip("\r\n")
    codec, size = CODEC[encoding]
    cut = content.encode(codec)[: column * size]
    return before + len(cut.decode(codec, "ignore"))


def random_text(rng: random.Random, most: int) -> str:
    return "".join(rng.choice(PIECES) for _ in range(rng.randrange(most)))


def check_edits(seed: int, edits: int) -> None:
    rng = random.Random(seed)
    encoding = rng.choice(ENCODINGS)
    expected = random_text(rng, 40)
    text = DocumentText(expected, encoding)
    for _ in range(edits):
        lines = len(reference_lines(expected))
        places = sorted((rng.randrange(lines + 1), rng.randrange(12)) for _ in range(2))
        start, end = (reference_offset(expected, *place, encoding) for place in places)
        inserted = random_text(rng, 6)
        assert (text.offset(*places[0]), text.offset(*places[1])) == (start, end)
        text = text.replaced(start, end, inserted)
        expected = expected[:start] + inserted + expected[end:]
        assert text.text == expected
        starts = [text.lines.start(number) for number in range(text.lines.count)]
        assert starts == line_starts(expected), (expected, starts)
        offset = rng.randrange(len(expected) + 1)
        line, column = text.position(offset)
        back = reference_offset(expected, line, column, encoding)
        assert back == offset or expected[back : offset + 1] == "\r\n"


@pytest.mark.parametrize("seed", range(40))
def test_edits_agree_with_the_reference(seed: int) -> None:
    check_edits(seed, 100)


@pytest.mark.slow
def test_many_edits_agree_with_the_reference() -> None:
    for seed in range(examples(200, 1_000)):
        check_edits(seed + 1_000, 200)


@pytest.mark.parametrize("seed", range(20))
def test_lines_are_those_of_the_reference(seed: int) -> None:
    text = random_text(random.Random(seed), 200)
    lines = reference_lines(text)
    assert line_starts(text) == [sum(map(len, lines[:n])) for n in range(len(lines))]
    assert [DocumentText(text).line(n) for n in range(len(lines))] == [line.rstrip("\r\n") for line in lines]


@pytest.mark.parametrize(
    ("text", "line", "column", "offset"),
    [
        ("ab", 0, 9, 2),  # past the end of the last line
        ("ab\ncd", 0, 9, 2),  # past the end of a line: before its end
        ("ab\r\ncd", 0, 9, 2),
        ("ab", 7, 0, 2),  # past the last line
        ("a𝄞b", 0, 2, 1),  # inside of a surrogate pair
        ("a𝄞b", 0, 3, 2),
        ("a\u2028b\nc", 1, 1, 5),  # U+2028 ends no line
    ],
)
def test_positions_out_of_the_ordinary(text: str, line: int, column: int, offset: int) -> None:
    assert DocumentText(text).offset(line, column) == offset


def test_half_a_surrogate_pair_is_survived() -> None:
    for encoding in ENCODINGS:
        text = DocumentText("a\ud800b", encoding)
        assert text.position(3)[1] == {"utf-8": 5, "utf-16": 3, "utf-32": 3}[encoding]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_positions_in_a_very_long_line(encoding: Encoding) -> None:
    """Each is found without looking at the line: all of them together take no longer than to read it a few times."""
    text = "é𝄞ab" * 50_000 + "\r\n" + "x𝄞"
    units = {"utf-8": 8, "utf-16": 5, "utf-32": 4}[encoding]
    found = DocumentText(text, encoding)
    for place in range(0, 200_000, 4):
        assert found.position(place) == (0, place // 4 * units)
    assert found.position(200_001) == found.position(200_000) == (0, 50_000 * units)
    assert found.position(200_003) == (1, 1)
