"""Pictures as files at the prompt: figures by matplotlib where it is, without it our own; what stands in them."""

from __future__ import annotations

import re
import xml.etree.ElementTree as tree

import pytest

from potto.applications import figures
from potto.applications.framed import Image
from potto.applications.pictures import Curve, Plot, course, ticks
from potto.extras import install_command

HALF = "def g(t) integral [0, 1] [x < t]*t^2 d(x)"


def texts(svg: str) -> list[str]:
    """What can be read in an SVG."""
    return [node.text or "" for node in tree.fromstring(svg).iter() if node.tag.endswith("text")]


def test_a_plot_is_a_figure_with_values_beside_derivatives(talk) -> None:
    """g(t) = t^3 and 3 t^2: a panel each, with axes; the caption says the error and the evaluations."""
    pytest.importorskip("matplotlib")
    image = pytest.importorskip("PIL.Image")
    talk.all(HALF, ":plot g, deriv g 0 0.9", ":save plot.png", ":plot g 0 0.9", ":save one.png")
    with image.open(talk.folder / "plot.png") as both, image.open(talk.folder / "one.png") as one:
        assert both.format == "PNG" and both.size[0] == pytest.approx(2 * one.size[0], abs=2)
    picture = talk.session.last_picture
    assert re.fullmatch(r"error at most \S+, \d+ evaluations", picture.caption)


def test_other_kinds_of_figures(talk) -> None:
    pytest.importorskip("matplotlib")
    talk.all(HALF, ":plot g", ":save plot.pdf", ":save plot.jpg")
    assert (talk.folder / "plot.pdf").read_bytes().startswith(b"%PDF")
    assert (talk.folder / "plot.jpg").read_bytes().startswith(b"\xff\xd8\xff")


def test_without_matplotlib_a_png_is_bare_and_says_so(talk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "has_matplotlib", lambda: False)
    talk.all(HALF, ":plot g")
    said = talk(":save plot.png")
    assert not said.failed and install_command("plots") in said.text
    assert (talk.folder / "plot.png").read_bytes().startswith(b"\x89PNG")
    refused = talk(":save plot.pdf")
    assert refused.failed and install_command("plots") in refused.text and ".svg" in refused.text
    assert "note" not in talk(":save plot.svg").text


def test_an_svg_has_axes_numbers_legend_and_caption(talk) -> None:
    talk.all(HALF, ":plot g, deriv g 0 1", ":save plot.svg")
    read = texts((talk.folder / "plot.svg").read_text())
    assert {"t", "g", "deriv g", "0.2", "0.5", "1"} <= set(read)
    assert any("evaluations" in text for text in read)


def test_an_image_as_svg_has_axes_and_a_scale(talk) -> None:
    """d/dy of x y over [0, 2] x [0, 1] is x: between 0.5 and 1.5 at the middles of two pixels."""
    talk.all(":image (x*y) by y 2 0 2 0 1", ":save i.svg")
    read = texts((talk.folder / "i.svg").read_text())
    assert {"x", "y", "2", "0", "1.5", "-1.5"} <= set(read) and any(text.startswith("d/dy") for text in read)


def test_sampled_values_have_their_bands_in_both(talk) -> None:
    """At t = 0 the error is 0, so that a lower end of the band would lie on the frame."""
    talk.all(":set method mc", ":set samples 500", "def h(t) integral [0, 1] [x^2 < t]*x d(x)",
             ":plot h, h(t)/2 0 0.9", ":save p.svg")  # fmt: skip
    svg = (talk.folder / "p.svg").read_text()
    assert svg.count("<polygon") >= 2


@pytest.mark.parametrize(("low", "high", "wanted"), [
    (0.0, 1.0, [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]),
    (-1.0, 2.0, [-1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0]),
    (0.013, 0.091, [0.02, 0.04, 0.06, 0.08]),
    (1e6, 3e6, [1e6, 1.5e6, 2e6, 2.5e6, 3e6]),
])  # fmt: skip
def test_ticks_are_round(low: float, high: float, wanted: list[float]) -> None:
    assert ticks(low, high) == pytest.approx(wanted, abs=1e-12)


def test_a_course_that_falls_far_is_a_logarithm() -> None:
    assert course("loss", [1.0, 0.1, 1e-4]).labels == ("log10 loss",)
    assert course("loss", [1.0, 0.1, 1e-4]).curves[0].ys == pytest.approx((0, -1, -4))
    assert course("loss", [2.0, 1.0, 0.5]).curves[0].ys == (2.0, 1.0, 0.5)


@pytest.mark.parametrize("dark", [False, True])
def test_figures_by_matplotlib(tmp_path, dark: bool) -> None:
    """Curves with holes, jumps, one point and no height, and images of a number, a colour and nothing but holes."""
    pytest.importorskip("matplotlib")
    nan = float("nan")
    broken = Curve((0.0, 0.5, 0.6, 1.0), (1.0, 2.0, nan, 3.0), (0.1,) * 4, breaks=(0,))
    flat = Curve.even([2.0] * 5, 0, 1)
    numbers = Image(
        (((0, 0, 255), (255, 255, 255)),), -2.0, 2.0, True, "f", map="red-blue", tone="log", ends=(-2.0, 2.0)
    )
    colours = Image((((0, 0, 255), (255, 255, 255)),), 0.0, 1.0)
    holes = Image((((128, 128, 128),),), nan, nan, map="gray")
    path = tmp_path / "figure.png"
    figures.save(str(path), [Plot(("a", "b"), (broken, flat), 0, 1), numbers, colours, holes], caption="c", dark=dark)
    assert path.stat().st_size > 10_000
