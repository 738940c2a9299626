"""Pictures in terminals: which protocol a terminal speaks, and that what is sent is an image."""

from __future__ import annotations

import base64
import math
import re
import struct
import zlib

import pytest
from potto_repl.drawing import braille, half_blocks, inline, protocol, sixel
from potto_repl.paint import Screen, painted

from potto.applications.framed import Image, image_of
from potto.applications.pictures import Curve, Plot

CHECKERS = Image((((0, 0, 0), (255, 255, 255)), ((255, 0, 0), (0, 0, 255))), 0.0, 1.0)


@pytest.mark.parametrize(("environment", "how"), [
    ({"TERM": "xterm-kitty"}, "kitty"), ({"TERM": "xterm-ghostty"}, "kitty"), ({"KITTY_WINDOW_ID": "1"}, "kitty"),
    ({"TERM_PROGRAM": "iTerm.app"}, "iterm"), ({"TERM_PROGRAM": "WezTerm"}, "iterm"), ({"TERM": "foot"}, "sixel"),
    ({"TERM": "xterm-256color"}, "blocks"), ({"TERM": "xterm-kitty", "TMUX": "x"}, "blocks"), ({}, "blocks"),
])  # fmt: skip
def test_terminals_are_known_by_name(environment, how):
    assert protocol(environment) == how


def pixels(data):
    """The pixels of a PNG without filters, read back."""
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", data[16:24])
    size = struct.unpack(">I", data[33:37])[0]
    raw = zlib.decompress(data[41 : 41 + size])
    rows = [raw[r * (1 + 3 * width) + 1 : (r + 1) * (1 + 3 * width)] for r in range(height)]
    return tuple(tuple(tuple(row[3 * c : 3 * c + 3]) for c in range(width)) for row in rows)


def test_kitty_and_iterm_get_a_png():
    kitty = inline(CHECKERS, "kitty", 10)
    assert kitty.startswith("\x1b_Ga=T,f=100,c=10,m=0;") and kitty.endswith("\x1b\\")
    assert pixels(base64.b64decode(re.search(r";([^;]*)\x1b", kitty)[1])) == CHECKERS.pixels
    iterm = inline(CHECKERS, "iterm", 10)
    assert pixels(base64.b64decode(iterm.rpartition(":")[2].rstrip("\x07"))) == CHECKERS.pixels


def test_long_images_come_in_pieces():
    noise = Image(tuple(tuple(((x * x * 7 + y * 13) % 256, x * y % 256, (x ^ y) % 256) for x in range(90))
                        for y in range(90)), 0, 1)  # fmt: skip
    pieces = re.findall(r"\x1b_G([^;]*);([^\x1b]*)\x1b\\", inline(noise, "kitty", 80))
    assert len(pieces) > 1 and all(len(data) <= 4096 for _, data in pieces)
    assert [head[-3:] for head, _ in pieces] == ["m=1"] * (len(pieces) - 1) + ["m=0"]
    assert pixels(base64.b64decode("".join(data for _, data in pieces))) == noise.pixels


def test_sixels_paint_every_pixel_once():
    text = sixel(CHECKERS)
    assert text.startswith('\x1bPq"1;1;2;2') and text.endswith("\x1b\\")
    painted_pixels = {}
    band = text.split("-")[0]
    for index, data in re.findall(r"#(\d+)([?-~]+)\$", band):
        for x, char in enumerate(data):
            for k in range(6):
                if (ord(char) - 63) >> k & 1:
                    assert (x, k) not in painted_pixels
                    painted_pixels[x, k] = int(index)
    assert painted_pixels == {(0, 0): 0, (1, 0): 215, (0, 1): 180, (1, 1): 5}


def test_half_blocks_hold_two_pixels():
    assert half_blocks(CHECKERS).count("▀") == 2
    assert "38;2;0;0;0;48;2;255;0;0m▀" in half_blocks(CHECKERS)
    assert "\x1b" not in half_blocks(CHECKERS, color=False)


def test_braille_dots_stand_where_the_curve_is():
    line = Curve.even([i / 100 for i in range(101)], 0, 1)
    rows = braille(Plot(("x",), (line,), 0, 1), 20, 5).splitlines()
    places = [(r, row.index("│") + 1 + c) for r, row in enumerate(rows[:5])
              for c, char in enumerate(row.partition("│")[2]) if char > "⠀"]  # fmt: skip
    assert places == sorted(places, key=lambda p: (p[0], p[1]))
    assert [max(c for r, c in places if r == row) for row in range(5)] == sorted(
        (max(c for r, c in places if r == row) for row in range(5)), reverse=True
    )
    assert braille(Plot(("x",), (line,), 0, 1), 20, 5, unicode=False).isascii()


def test_holes_and_constants_are_drawn():
    curves = Curve.even([math.nan] * 9, 0, 1), Curve.even([2.0] * 9, 0, 1)
    assert braille(Plot(("a", "b"), curves, 0, 1), 20, 5).count("──") >= 2
    assert image_of([[math.nan, 1.0, 1.0, 0.0]], 2).pixels[0][0] == (128, 128, 128)
    assert Plot(("n",), (Curve.even([math.nan, math.inf], 0, 1),), 0, 1).span == (0.0, 1.0)


def test_pictures_follow_the_screen(talk):
    part = talk(":image x*y 4").parts[0]
    assert "\x1b" not in painted(part, Screen()) and "\x1b[38;2;" in painted(part, Screen(color=True))
    assert painted(part, Screen(color=True, images="kitty")).startswith("\x1b_G")
    plot = talk(":plot u^2").parts[0]
    assert max(map(len, painted(plot, Screen(width=40)).splitlines())) <= 40


def test_what_to_set_is_said_as_the_prompt_takes_it(talk):
    talk(":set max_evals 10")
    reply = talk("integral ([0,1],[0,1]) sin(300*x*y)*[x*y + x < y] d(x,y)")
    assert "P0501" in reply.text and "`:set max_evals`" in reply.text and "--max-evals" not in reply.text
