"""`potto render`: the numbers behind the pixels against closed forms, files, holes, mistakes."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest
from command_runs import Potto

SCENE = """
def pixel(px, py, c) integral ([px, px + 1/8], [py, py + 1/8]) 64*[x + c >= 0] d(x, y)
def color(x, y, t) (x, y*t, x*y)
def curried(x, y)(c) x*c + y
def hole(x, y) if x > 0.5 then sum k in 1..x (k) else y
def nowhere(x, y) sum k in 1..x/2 (k)
def through(x, y, f) f(x)*y
def id(x) x
"""


def pixels(path):
    """A PNG of ours read back: (height, width, 3)."""
    data = path.read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", data[16:24])
    size = struct.unpack(">I", data[33:37])[0]
    raw = np.frombuffer(zlib.decompress(data[41 : 41 + size]), np.uint8).reshape(height, 1 + 3 * width)
    assert not raw[:, 0].any()
    return raw[:, 1:].reshape(height, width, 3)


def test_value_and_derivative_as_arrays(potto: Potto, tmp_path) -> None:
    """A pixel of width 1/8 at px has the share of x >= 1/4 + 0.05 that lies in it; the edge moves by -1, 8 a pixel."""
    ran = potto("render", "s.po", "pixel", "c=-0.3", "--wrt", "c", "--size", "8", "-o", "p.npy", s=SCENE)
    assert ran.status == 0 and "derivative by c" in ran.out
    value, slope = np.load(tmp_path / "p.npy"), np.load(tmp_path / "p-dc.npy")
    px = (np.arange(8) + 0.5) / 8
    np.testing.assert_allclose(value, np.tile(np.clip((px + 1 / 8 - 0.3) * 8, 0, 1), (8, 1)), atol=1e-13)
    cut = (px < 0.3) & (px + 1 / 8 > 0.3)
    np.testing.assert_allclose(slope, np.tile(np.where(cut, 8.0, 0.0), (8, 1)), atol=1e-12)


def test_rows_go_down_and_the_box_is_the_box(potto: Potto, tmp_path) -> None:
    potto("render", "s.po", "curried", "c=0", "--size", "2x3", "--box", "-1,1,0,6", "-o", "c.npy", s=SCENE)
    assert np.load(tmp_path / "c.npy").tolist() == [[5, 5], [3, 3], [1, 1]]
    potto("render", "s.po", "curried", "c=1", "--size", "2x1", "--box", "-1,1,-1,1", "-o", "c.npy")
    assert np.load(tmp_path / "c.npy").tolist() == [[-0.5, 0.5]]
    potto("render", "s.po", "curried", "c=0", "--width", "2", "--box", "-2,2,6,0", "-o", "c.npy")  # upside down
    assert np.load(tmp_path / "c.npy").tolist() == [[1, 1], [3, 3], [5, 5]]


def test_axes_by_name(potto: Potto, tmp_path) -> None:
    potto("render", "s.po", "curried", "--axes", "c,x", "y=0", "--size", "2x1", "-o", "c.npy", s=SCENE)
    assert np.load(tmp_path / "c.npy").tolist() == [[0.125, 0.375]]


def test_colours_are_meant_as_they_are(potto: Potto, tmp_path) -> None:
    ran = potto("render", "s.po", "color", "t=0.5", "--size", "2", "--wrt", "t", s=SCENE)
    assert ran.out.startswith("color.png: value, 0 to 1\ncolor-dt.png: derivative by t")
    levels = [[(0.25, 0.375, 0.1875), (0.75, 0.375, 0.5625)], [(0.25, 0.125, 0.0625), (0.75, 0.125, 0.1875)]]
    assert np.array_equal(pixels(tmp_path / "color.png"), np.round(255 * np.array(levels)).astype(int))


def test_greys_and_signs(potto: Potto, tmp_path) -> None:
    potto("render", "s.po", "\\(x, y) . x", "--size", "2x1", "--range", "0,1", "-o", "g.png", s=SCENE)
    assert pixels(tmp_path / "g.png").tolist() == [[[64] * 3, [191] * 3]]
    potto("render", "s.po", "curried", "c=1", "--wrt", "c", "--box", "-1,1,0,1", "--size", "2x1", "-o", "g.png")
    ((below, above),) = pixels(tmp_path / "g-dc.png").tolist()
    assert below[2] > 200 > below[0] and above[0] > 200 > above[2]  # blue, red


def test_errors_as_decades(potto: Potto, tmp_path) -> None:
    ran = potto("render", "s.po", "pixel", "c=-0.3", "--error", "--size", "8", "-o", "p.png", s=SCENE)
    shown = pixels(tmp_path / "p-error.png")
    assert ran.status == 0 and shown.max() < 128  # below 1e-8 everywhere


def test_where_there_is_no_value_is_a_hole(potto: Potto, tmp_path) -> None:
    ran = potto("render", "s.po", "hole", "--size", "4x1", "-o", "h.png", s=SCENE)
    assert ran.status == 0 and "2 pixels have no value and are gray" in ran.err and "whole number" in ran.err
    assert pixels(tmp_path / "h.png")[0, 2:].tolist() == [[128] * 3] * 2
    ran = potto("render", "s.po", "nowhere", "--size", "4", "-o", "n.png")
    assert ran.status == 1 and "whole number" in ran.err and not (tmp_path / "n.png").exists()


def test_a_function_among_the_parameters(potto: Potto, tmp_path) -> None:
    potto("render", "s.po", "through", "f=id", "--size", "1", "-o", "t.npy", s=SCENE)
    assert np.load(tmp_path / "t.npy").tolist() == [[0.25]]


def test_for_machines(potto: Potto) -> None:
    answer = potto("render", "s.po", "pixel", "c=-0.3", "--size", "8", "--json", s=SCENE).json
    assert answer["converged"] and answer["evals"] > 0 and answer["holes"] == 0 and answer["largest_error"] < 1e-9
    (file,) = answer["files"]
    assert (file["file"], file["shows"], file["low"]) == ("pixel.png", "value", 0) and abs(file["high"] - 1) < 1e-12


@pytest.mark.parametrize(("words", "said", "status"), [
    (["pixel"], "`px`, `py`, `c`", 1),
    (["pixel", "c=1", "--wrt", "d"], "no parameter `d`", 1),
    (["pixle"], "not defined", 1),
    (["pixel", "c=1", "--size", "0x3"], "not a size", 2),
    (["pixel", "c=1", "--box", "1,0,0,1"], "not X0,X1,Y0,Y1", 2),
    (["pixel", "c=1", "--box", "0,1,1,1"], "not X0,X1,Y0,Y1", 2),
    (["pixel", "c=1", "--range", "1,0"], "not LO,HI", 2),
    (["pixel", "c=1", "--tone", "linear,loud"], "none of linear, srgb, log", 2),
    (["pixel", "c=1", "--axes", "px"], "two axes", 1),
    (["pixel", "c"], "which parameter it is for", 2),
    (["pixel", "c=1", "-o", "no/such/folder.png"], "there is no folder `no/such`", 2),
    (["3"], "is not a function", 1),
])  # fmt: skip
def test_mistakes(potto: Potto, words, said, status) -> None:
    ran = potto("render", "s.po", *words, s=SCENE)
    assert ran.status == status and said in ran.err and ran.out == ""
