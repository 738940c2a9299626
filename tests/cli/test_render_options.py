"""`potto render`: sizes, colours, files of every kind read back by their libraries, animations, watching."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command_runs import Potto

from potto.applications import animations
from potto.applications.colours import DIVERGING, MAPS, TONES, Paint
from potto.applications.images import Grid
from potto.cli import render
from potto.cli.uninterrupted import uninterrupted
from potto.extras import install_command

SCENE = """
record Colour(b: Real, r: Real, g: Real)
def plane(x, y, a, b) a*x + b*y
def edge(px, py, c) integral ([px, px + 1/16], [py, py + 1/16]) 256*[x < c] d(x, y)
def triple(x, y, t) (x, y*t, x*y)
def named(x, y, t) Colour(b = x*y, r = x, g = y*t)
def listed(x, y, t) [x, y*t, x*y]
def pair(x, y) (x, y)
"""


# What is seen


@pytest.mark.parametrize(("words", "size"), [
    (["--size", "6x4"], (4, 6)),
    (["--width", "6", "--height", "4"], (4, 6)),
    (["--width", "8", "--viewport", "0,4,0,1"], (2, 8)),
    (["--height", "2", "--viewport", "-2,2,-1,0"], (2, 8)),
    (["--height", "3"], (3, 3)),
])  # fmt: skip
def test_sizes_keep_pixels_square(potto: Potto, tmp_path: Path, words: list[str], size: tuple[int, int]) -> None:
    assert potto("render", "s.po", "plane", "a=1", "b=0", *words, "-o", "p.npy", s=SCENE).status == 0
    assert np.load(tmp_path / "p.npy").shape == size


@pytest.mark.parametrize("wrt", [["--wrt", "a,b"], ["--wrt", "a", "--wrt", "b"]])
def test_several_derivatives(potto: Potto, tmp_path: Path, wrt: list[str]) -> None:
    """Of a x + b y by a it is x, by b it is y."""
    potto("render", "s.po", "plane", "a=1", "b=3", *wrt, "--size", "2", "-o", "p.npy", s=SCENE)
    assert np.load(tmp_path / "p-da.npy").tolist() == [[0.25, 0.75]] * 2
    assert np.load(tmp_path / "p-db.npy").tolist() == [[0.75] * 2, [0.25] * 2]


@pytest.mark.parametrize("name", ["triple", "named", "listed"])
def test_colours_are_triples_records_and_arrays(potto: Potto, tmp_path: Path, name: str) -> None:
    """(x, y t, x y) as red, green and blue, whatever the order of a record's fields; and its derivatives by t and x."""
    potto("render", "s.po", name, "t=0.5", "--axes", "x,y", "--wrt", "t,x", "--size", "2", "-o", "p.npy", s=SCENE)
    x, y = np.meshgrid([0.25, 0.75], [0.75, 0.25])
    zero = np.zeros_like(x)
    np.testing.assert_allclose(np.load(tmp_path / "p.npy"), np.stack([x, y / 2, x * y], -1), atol=1e-15)
    np.testing.assert_allclose(np.load(tmp_path / "p-dt.npy"), np.stack([zero, y, zero], -1), atol=1e-15)
    np.testing.assert_allclose(np.load(tmp_path / "p-dx.npy"), np.stack([zero + 1, zero, y], -1), atol=1e-15)


def test_two_numbers_are_no_colour_but_can_be_kept(potto: Potto, tmp_path: Path) -> None:
    ran = potto("render", "s.po", "pair", "--size", "2", s=SCENE)
    assert ran.status == 1 and "gives 2" in ran.err and ".npy or .exr" in ran.err
    assert potto("render", "s.po", "pair", "--size", "2", "-o", "p.npy").status == 0
    assert np.load(tmp_path / "p.npy").shape == (2, 2, 2)


# Files


def test_a_jpeg_is_a_jpeg(potto: Potto, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    ran = potto("render", "s.po", "plane", "a=1", "b=0", "--size", "32", "--range", "0,1", "-o", "p.jpg", s=SCENE)
    assert ran.status == 0
    with image.open(tmp_path / "p.jpg") as found:
        assert (found.format, found.size) == ("JPEG", (32, 32))
        row = np.asarray(found.convert("L"), dtype=float)[16]
    np.testing.assert_allclose(row, 255 * (np.arange(32) + 0.5) / 32, atol=3)


def test_exr_holds_the_numbers(potto: Potto, tmp_path: Path) -> None:
    exr = pytest.importorskip("OpenEXR")
    potto("render", "s.po", "triple", "t=0.5", "--size", "2", "--wrt", "t", "-o", "p.exr", s=SCENE)
    x, y = np.meshgrid([0.25, 0.75], [0.75, 0.25])
    with exr.File(str(tmp_path / "p.exr"), separate_channels=True) as found:
        planes = {name: channel.pixels for name, channel in found.channels().items()}
    assert sorted(planes) == ["B", "G", "R"]
    np.testing.assert_allclose([planes[c] for c in "RGB"], [x, y / 2, x * y], rtol=1e-7)
    potto("render", "s.po", "plane", "a=-3", "b=0", "--size", "2", "-o", "q.exr")
    with exr.File(str(tmp_path / "q.exr")) as found:
        np.testing.assert_allclose(found.channels()["Y"].pixels, -3 * x, rtol=1e-7)


@pytest.mark.parametrize(("words", "said"), [
    (["-o", "x.bmp"], "`.bmp` is not a picture: end the name with .png"),
    (["-o", "x"], "`x` does not say which kind"),
    (["-o", "x.gif"], "say what moves, `--over c=-2..0`"),
    (["-o", "x.png", "--over", "a=0..1"], "an animation ends with .gif, .mp4, .npy"),
    (["--over", "a=0"], "write `c=-2..0`"),
    (["--over", "a=0..1", "--frames", "1"], "not a number of frames"),
    (["--frames", "5"], "are for an animation"),
    (["--over", "a=0..1", "--fps", "-1"], "not a number of frames a second"),
    (["--size", "8", "--width", "4"], "--size says what --width and --height say"),
    (["--width", "0"], "not a number of pixels"),
    (["--width", "9000", "--height", "9000"], "more than 67,108,864 pixels"),
    (["--over", "a=0..1", "--frames", "9999"], "9,999 frames of 256 x 256 are more than"),
    (["--wrt", "a,,b"], "does not name parameters"),
    (["--map", "rainbow"], "invalid choice: 'rainbow'"),
])  # fmt: skip
def test_what_cannot_be_is_said_before_anything_is_computed(potto: Potto, words: list[str], said: str) -> None:
    ran = potto("render", "s.po", "plane", "b=1", *words, s=SCENE)
    assert ran.status == 2 and said in ran.err and ran.out == ""


@pytest.mark.parametrize(("over", "said"), [
    ("q=0..1", "no parameter `q`"), ("a=0..nope", "not defined"), ("b=0..1", "`b` is given a value and moves"),
    ("a=0..sin", "from one number to another"),
])  # fmt: skip
def test_what_moves_must_be_there(potto: Potto, over: str, said: str) -> None:
    ran = potto("render", "s.po", "plane", "b=1", "--over", over, "--frames", "2", "--size", "2", s=SCENE)
    assert ran.status == 1 and said in ran.err


def test_a_library_that_is_missing_is_named_with_how_to_get_it(potto: Potto, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("potto.applications.picture_files.find_spec", lambda name: None)
    for path, extra in (("x.jpg", "images"), ("x.exr", "exr")):
        ran = potto("render", "s.po", "plane", "a=1", "b=1", "-o", path, s=SCENE)
        assert ran.status == 2 and install_command(extra) in ran.err
    monkeypatch.setattr(animations, "ffmpeg", lambda: None)
    ran = potto("render", "s.po", "plane", "b=1", "--over", "a=0..1", "-o", "x.mp4")
    assert ran.status == 2 and "needs the program ffmpeg" in ran.err


@pytest.mark.parametrize(("axes", "said"), [
    ("x,q", "no parameter `q` to be an axis"), ("x,x", "both axes are `x`"), ("x", "two axes"), ("x,", "two axes"),
])  # fmt: skip
def test_axes_must_be_two_parameters(potto: Potto, axes: str, said: str) -> None:
    ran = potto("render", "s.po", "plane", "a=1", "b=1", "--axes", axes, "--size", "2", s=SCENE)
    assert ran.status == 1 and said in ran.err and ran.out == ""


def test_a_file_that_cannot_be_written(potto: Potto, tmp_path: Path) -> None:
    (tmp_path / "there.png").mkdir()
    ran = potto("render", "s.po", "plane", "a=1", "b=1", "--size", "2", "-o", "there.png", s=SCENE)
    assert ran.status == 1 and ran.err.startswith("potto render: `there.png` cannot be written: ")


def test_a_derivative_that_vanishes_says_so(potto: Potto) -> None:
    ran = potto("render", "s.po", "\\(x, y, c) . x + 0*c", "c=1", "--wrt", "c", "--size", "2", s=SCENE)
    assert "derivative by c, 0 everywhere" in ran.out


# Colours


def test_the_command_offers_the_maps_that_there_are() -> None:
    assert (tuple(MAPS), tuple(DIVERGING), tuple(TONES)) == (render.MAPS, render.DIVERGING, render.TONES)


@pytest.mark.parametrize("name", ["viridis", "magma"])
def test_maps_are_those_of_matplotlib(name: str) -> None:
    maps = pytest.importorskip("matplotlib").colormaps
    at = np.linspace(0, 1, 10)
    np.testing.assert_allclose(Paint(0.0, 1.0, name).along(at).T, maps[name](at)[:, :3], atol=0.013)


@pytest.mark.parametrize(("name", "theirs"), [("brick-navy", "RdBu_r"), ("purple-orange", "PuOr_r")])
def test_diverging_maps_are_colorbrewers(name: str, theirs: str) -> None:
    maps = pytest.importorskip("matplotlib").colormaps
    at = np.linspace(0, 1, 11)
    np.testing.assert_allclose(Paint(-1.0, 1.0, name, even=True).along(at).T, maps[theirs](at)[:, :3], atol=0.013)


@pytest.mark.parametrize("even", [False, True])
@pytest.mark.parametrize("tone", sorted(TONES))
def test_a_tone_can_be_read_back(tone: str, even: bool) -> None:
    paint = Paint(-2.0, 2.0, "red-blue" if even else "gray", tone, even)
    numbers = np.array([-2.0, -0.7, -0.01, 0.0, 0.3, 2.0])
    np.testing.assert_allclose([paint.number(float(s)) for s in paint.level(numbers)], numbers, atol=1e-12)
    assert np.all(np.diff(paint.level(numbers)) > 0)


def test_a_tone_for_values_and_one_for_derivatives(potto: Potto, tmp_path: Path) -> None:
    """Of a x + b y by b it is y: the value is as without a tone, the derivative as under `log`."""
    Image = pytest.importorskip("PIL.Image")

    def shown(*words: str) -> list[object]:
        assert potto("render", "s.po", "plane", "a=1", "b=1", "--wrt", "b", "--size", "4", *words, s=SCENE).status == 0
        return [np.asarray(Image.open(tmp_path / name)).tolist() for name in ("plane.png", "plane-db.png")]

    plain, log, both = shown(), shown("--tone", "log"), shown("--tone", "linear,log")
    assert both == [plain[0], log[1]] and plain[0] != log[0] and plain[1] != log[1]


def test_tones(potto: Potto, tmp_path: Path) -> None:
    """sRGB has 0.2140 of the light at level 1/2; the log shows a thousandth as log(1.999)/log(1000) of the whole."""
    paint = Paint(0.0, 1.0, tone="srgb")
    assert abs(float(paint.level(np.array(0.21404114048223255))) - 0.5) < 1e-12
    assert abs(float(Paint(0.0, 1.0, tone="log").level(np.array(1e-3))) - np.log(1.999) / np.log(1000)) < 1e-12
    image = pytest.importorskip("PIL.Image")
    potto("render", "s.po", "plane", "a=1", "b=0", "--size", "2x1", "--range", "0,1", "--tone", "srgb", "--map",
          "viridis", s=SCENE)  # fmt: skip
    with image.open(tmp_path / "plane.png") as found:
        seen = np.asarray(found)[0]
    assert np.array_equal(seen, Paint(0.0, 1.0, "viridis", "srgb").colours(np.array([[0.25, 0.75]])))


# What it costs


def test_stats_count_the_pixels_that_an_edge_crosses(potto: Potto) -> None:
    """The edge x = 0.53 lies in one column of the 16 x 16 pixels, whose left ends are k/16 + 1/32."""
    ran = potto("render", "s.po", "edge", "c=0.53", "--size", "16", "--stats", s=SCENE)
    assert "pixels crossed by a surface: 16 of 256 (6.2 %)" in ran.err
    answer = potto("render", "s.po", "edge", "c=0.53", "--size", "16", "--stats", "--json").json
    assert (answer["crossed"], answer["looked_at"]) == (16, 256)


# Animations


def test_frames_go_from_end_to_end(potto: Potto, tmp_path: Path) -> None:
    words = ["--over", "c=1/4..3/4", "--frames", "3", "--size", "4x1", "--wrt", "c", "-o", "e.npy"]
    ran = potto("render", "s.po", "edge", *words, s=SCENE)
    assert ran.status == 0 and "3 frames of 4 x 1 pixels" in ran.out
    left = (np.arange(4) + 0.5) / 4
    wanted = [np.clip((c - left) * 16, 0, 1) for c in (0.25, 0.5, 0.75)]
    np.testing.assert_allclose(np.load(tmp_path / "e.npy")[:, 0], wanted, atol=1e-13)
    assert np.load(tmp_path / "e-dc.npy").shape == (3, 1, 4)


def test_a_gif_has_its_frames_and_one_scale(potto: Potto, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    words = ["--over", "a=0..1", "--frames", "5", "--fps", "10", "--size", "2x1", "-o", "p.gif"]
    assert potto("render", "s.po", "plane", "b=0", *words, s=SCENE).status == 0
    with image.open(tmp_path / "p.gif") as found:
        assert (found.format, found.n_frames, found.info["duration"]) == ("GIF", 5, 100)
        seen = []
        for number in range(5):
            found.seek(number)
            seen.append(int(np.asarray(found.convert("L"))[0, 1]))
    assert seen == [round(255 * i / 4) for i in range(5)]


def test_a_gif_of_many_colours_keeps_its_ground(tmp_path: Path) -> None:
    """Thousands of colours on white: white stays white, and no other is far from what it is."""
    image = pytest.importorskip("PIL.Image")
    grid = Grid(64, 64)
    rgb = np.full((grid.height * grid.width, 3), 255, dtype=np.uint8)
    rgb[:1600] = np.random.default_rng(1).integers(0, 256, (1600, 3))
    animations.save_frames(str(tmp_path / "c.gif"), [np.zeros((1, 1))] * 2, lambda i: np.roll(rgb, i, axis=0), grid, 10)
    with image.open(tmp_path / "c.gif") as found:
        shown = np.asarray(found.convert("RGB"), dtype=int).reshape(-1, 3)
    assert (shown[1600:] == 255).all()
    assert np.abs(shown[:1600] - rgb[:1600]).mean() < 16


@pytest.mark.skipif(animations.ffmpeg() is None, reason="there is no ffmpeg")
def test_a_film(potto: Potto, tmp_path: Path) -> None:
    words = ["--over", "a=0..1", "--frames", "6", "--fps", "12", "--size", "33x17", "-o", "p.mp4"]
    assert potto("render", "s.po", "plane", "b=0", *words, s=SCENE).status == 0
    said = subprocess.run([str(animations.ffmpeg()), "-i", str(tmp_path / "p.mp4")], capture_output=True, text=True)
    assert re.search(r"Video: h264.*34x18.*12 fps", said.stderr) and "00:00:00.50" in said.stderr


# A process of its own


def _started(folder: Path, *words: str) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-m", "potto", "render", *words], cwd=folder, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)  # fmt: skip


def _interrupted(folder: Path, *words: str) -> tuple[int, str, str]:
    """The end of a command that is interrupted once it has something to show: later on a machine that is busy."""
    for seconds in (2.0, 2.8, 4.0, 5.5, 7.5, 10.0, 14.0, 20.0, 40.0):
        process = _started(folder, *words)
        time.sleep(seconds)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=120)
        if (folder / "e.npy").exists():
            break
    return process.returncode, out, err


def _until(condition: object, seconds: float = 60.0) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():  # type: ignore[operator]
            return True
        time.sleep(0.05)
    return False


def test_what_is_done_is_written_before_an_interrupt_counts() -> None:
    """Pictures that took a minute were lost to a Ctrl-C while they were being written."""
    with uninterrupted() as met:
        os.kill(os.getpid(), signal.SIGINT)
        assert _until(lambda: met)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
            _until(lambda: False, 5.0)
    assert met == [signal.SIGINT] and signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_watching_draws_again(tmp_path: Path) -> None:
    source, image = tmp_path / "s.po", tmp_path / "f.npy"
    (tmp_path / "other.po").write_text("k = 1\n")
    (tmp_path / "w.csv").write_text("1\n2\n")
    source.write_text("from other import k\ndef f(x, y, w: [2] Real) k*x*w[0]\n")
    process = _started(tmp_path, "s.po", "f", "w=@w.csv", "--size", "2x1", "-o", "f.npy", "--watch")

    def shows(*numbers: float) -> bool:
        try:
            return np.load(image).tolist() == [list(numbers)]
        except (OSError, ValueError, EOFError):
            return False

    try:
        assert _until(lambda: shows(0.25, 0.75))
        (tmp_path / "other.po").write_text("k = 2\n")
        assert _until(lambda: shows(0.5, 1.5))
        (tmp_path / "w.csv").write_text("3\n2\n")
        assert _until(lambda: shows(1.5, 4.5))
        source.write_text("def f(x, y, w) x +\n")  # a mistake ends nothing
        time.sleep(1.0)
        source.write_text("def f(x, y, w: [2] Real) 4*x\n")
        assert _until(lambda: shows(1.0, 3.0))
    finally:
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=60)
    assert process.returncode == 130 and "Traceback" not in said[1] and "P01" in said[1]


def test_interrupted_frames_are_kept(tmp_path: Path) -> None:
    """An animation that would take minutes: what was done until Ctrl-C is an animation."""
    (tmp_path / "s.po").write_text(SCENE)
    words = ["s.po", "edge", "--over", "c=0..1", "--frames", "2000", "--size", "256", "-o", "e.npy"]
    status, out, err = _interrupted(tmp_path, *words)
    assert status == 130 and "Traceback" not in err
    frames = np.load(tmp_path / "e.npy")
    assert frames.shape[1:] == (256, 256) and 1 <= len(frames) < 2000
    assert f"{len(frames)} frames" in out


def test_an_interrupted_picture_is_gray_where_nothing_was_done(tmp_path: Path) -> None:
    """Ctrl-C while blocks are evaluated: some pixels are there and right, the rest is gray, and how many is said."""
    scene = "def slow(x, y, r) integral ([x, x + 1/64], [y, y + 1/64]) [sin(3*u) + v^2*exp(u) < r^2]*exp(u*v) d(u, v)\n"
    (tmp_path / "s.po").write_text(scene)
    words = ["s.po", "slow", "r=0.9", "--wrt", "r", "--size", "4096", "--workers", "1", "-o", "e.npy"]
    status, _, err = _interrupted(tmp_path, *words)
    gray = re.search(r"interrupted: ([\d,]+) pixels were not reached", err)
    assert status == 130 and "Traceback" not in err and gray is not None, err
    value = np.load(tmp_path / "e.npy")
    assert int(gray[1].replace(",", "")) == np.isnan(value).sum() and 0 < np.isnan(value).mean() < 1


def test_what_is_weak_is_accurate_beside_what_an_image_shows(potto: Potto) -> None:
    """A pixel of 8e-10 with two digits is black beside one of 1; its number is to have the digits asked for."""
    weak = "def f(x, y) if y > 0.5 then 1 else 1e-9 * integral ([0, 1], [0, 1]) [u^2 + v^2 < 1] d(u, v)\n"
    words = ["s.po", "f", "--size", "2", "--method", "mc", "--samples", "1000", "--rtol", "1e-3"]
    for target, told in (("f.png", False), ("f.npy", True)):
        ran = potto("render", *words, "-o", target, s=weak)
        assert ran.status == 0 and ("as accurate as asked" in ran.err) == told


# Figures


def test_a_figure_has_value_and_derivative_beside_each_other(potto: Potto, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    image = pytest.importorskip("PIL.Image")
    words = ["edge", "c=0.53", "--wrt", "c", "--size", "16", "--scale"]
    ran = potto("render", "s.po", *words, "-o", "both.png", s=SCENE)
    assert ran.status == 0 and sorted(p.name for p in tmp_path.glob("*.png")) == ["both.png"]
    assert ran.out.startswith("both.png: value, 0 to 1\nboth.png: derivative by c, -16 to 16\n")
    potto("render", "s.po", "edge", "c=0.53", "--size", "16", "--scale", "-o", "one.png")
    with image.open(tmp_path / "both.png") as both, image.open(tmp_path / "one.png") as one:
        assert both.size[0] == pytest.approx(2 * one.size[0], abs=2)
    potto("render", "s.po", *words, "-o", "both.pdf")
    assert (tmp_path / "both.pdf").read_bytes().startswith(b"%PDF")


def test_a_figure_without_matplotlib(potto: Potto, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An SVG needs nothing: both images, their axes, their scales, what they cost."""
    monkeypatch.setattr("potto.applications.picture_files.find_spec", lambda name: None)
    words = ["triple", "t=1/2", "--axes", "x,y", "--wrt", "x", "--size", "4", "--scale"]
    assert potto("render", "s.po", *words, "-o", "f.svg", s=SCENE).status == 0
    svg = (tmp_path / "f.svg").read_text()
    assert svg.count("<image") == 2 and ">triple<" in svg and ">derivative of triple by x<" in svg
    assert potto("render", "s.po", "edge", "c=0.4", "--wrt", "c", "--size", "4", "--scale", "-o", "e.svg").status == 0
    assert all(f">{number}<" in (tmp_path / "e.svg").read_text() for number in ("-16", "-8", "8", "16", "0.25", "0.75"))
    ran = potto("render", "s.po", *words, "-o", "f.png")
    assert ran.status == 2 and install_command("plots") in ran.err and ".svg does without" in ran.err


def test_animations_have_no_scale(potto: Potto) -> None:
    ran = potto("render", "s.po", "edge", "--over", "c=0..1", "--scale", "-o", "x.gif", s=SCENE)
    assert ran.status == 2 and "stand still" in ran.err
