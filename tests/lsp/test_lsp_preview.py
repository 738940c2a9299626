"""What a preview is made of: which functions can be drawn, and their values, derivatives and errors over grids."""

from __future__ import annotations

import base64
import math
import struct
import time
from collections.abc import Callable
from typing import Any

import pytest
from lsp_client import Client

Server = Callable[..., Client]
Uri = Callable[[str], str]
SCENE = """def pixel(px, py, r, shade)
    integral ([px, px + 1], [py, py + 1]) [x < r] * shade(x) d(x, y)
flat = \\(x) . 2
def wave(t, k)(m) k*t + m
def count(n: Real, at: (Real, Real)) (n, 2*n)
width = 3
cond = deriv(flat)
def texts(l) [l]
#> wave(0.25, -3)(4)
#> deriv(pixel)(dpx=(0, 1), dpy=(0, 0), dr=(0.5, 0), deriv(flat))
"""


def scenes(client: Client, uri: str) -> dict[str, dict[str, Any]]:
    return {scene["name"]: scene for scene in client.ask("potto/scenes", {"textDocument": {"uri": uri}})}


def sampled(client: Client, uri: str, name: str, axes: list[Any], **more: Any) -> dict[str, Any]:
    asked = {"textDocument": {"uri": uri}, "name": name, "axes": axes, **more}
    return client.answer(client.begin("potto/sample", asked), 60)


def axis(name: str, low: float, high: float, count: int) -> dict[str, Any]:
    return {"name": name, "from": low, "to": high, "count": count}


def doubles(packed: str) -> tuple[float, ...]:
    data = base64.b64decode(packed)
    return struct.unpack(f"<{len(data) // 8}d", data)


def singles(packed: str) -> tuple[float, ...]:
    data = base64.b64decode(packed)
    return struct.unpack(f"<{len(data) // 4}f", data)


def test_what_can_be_drawn(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), SCENE)
    found = scenes(client, uri("main"))
    assert list(found) == ["pixel", "flat", "wave", "count"]
    assert found["pixel"]["axes"] == ["px", "py"] and found["pixel"]["components"] == 1
    assert [p["kind"] for p in found["pixel"]["parameters"]] == ["number", "number", "number", "function"]
    assert found["pixel"]["parameters"][3]["fits"] == ["flat"]
    assert [p["value"] for p in found["pixel"]["parameters"]] == [[0], [0], [0.5], []]
    assert [p["value"] for p in found["wave"]["parameters"]] == [[0.25], [-3], []]
    assert found["count"]["axes"] == ["n"] and found["count"]["components"] == 2
    assert found["count"]["parameters"][1]["size"] == 2
    assert found["wave"]["range"]["start"] == {"line": 3, "character": 4}


def test_an_image_and_its_derivative(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), SCENE)
    axes = [axis("px", -1, 1, 4), axis("py", 0, 1, 2)]
    asked = {"values": {"r": 0.5, "shade": "\\(x) . 3 * x^2"}, "wrt": "r"}
    found = sampled(client, uri("main"), "pixel", axes, **asked)["result"]
    assert found["shape"] == [2, 4] and found["converged"] and found["evals"] > 0 and found["seconds"] > 0
    # The pixel is [px, px + 1]: the integral of 3 x^2 up to min(r, px + 1), and 3 r^2 where r lies inside.
    starts = [-0.75, -0.25, 0.25, 0.75]
    value = [max(min(0.5, p + 1) ** 3 - p**3, 0.0) if p < 0.5 else 0.0 for p in starts]
    slope = [0.75 if p < 0.5 < p + 1 else 0.0 for p in starts]
    assert doubles(found["value"][0]) == pytest.approx(value * 2, abs=1e-6)
    assert doubles(found["tangent"][0]) == pytest.approx(slope * 2, abs=1e-6)
    assert all(0 <= error < 1e-5 for error in singles(found["valueError"][0]) + singles(found["tangentError"][0]))


def test_a_curve_goes_from_end_to_end_and_rows_from_the_top(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), SCENE)
    found = sampled(client, uri("main"), "wave", [axis("t", 0, 1, 3)], values={"k": 2, "m": 1}, wrt="t")["result"]
    assert found["shape"] == [3]
    assert doubles(found["value"][0]) == pytest.approx((1, 2, 3)) and doubles(found["tangent"][0]) == (2, 2, 2)
    image = sampled(client, uri("main"), "wave", [axis("t", 0, 2, 2), axis("m", 0, 20, 2)], values={"k": 1})["result"]
    assert doubles(image["value"][0]) == pytest.approx((15.5, 16.5, 5.5, 6.5)) and "tangent" not in image


def test_components_and_holes(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), "def f(x) (x, sqrt(x))\n")
    found = sampled(client, uri("main"), "f", [axis("x", -1, 1, 3)], wrt="x")["result"]
    first, second = map(doubles, found["value"])
    assert first == (-1, 0, 1) and math.isnan(second[0]) and second[1:] == (0, 1)
    assert not found["converged"] and found["reasons"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"name": "width"}, "not a function"),
        ({"name": "nowhere"}, "nowhere"),
        ({"values": {"k": 1}}, "more parameters"),
        ({"values": {"k": 1, "m": "1 +"}}, "expected"),
        ({"values": {"k": 1, "m": ""}}, "needs a value"),
        ({"values": {"k": 1, "m": True}}, "neither"),
        ({"wrt": "z", "values": {"k": 1, "m": 1}}, "`z`"),
        ({"axes": [axis("t", 0, 1, 2)] * 2}, "two"),
    ],
)
def test_what_cannot_be_sampled_says_why(server: Server, uri: Uri, change: dict[str, Any], said: str) -> None:
    client = server()
    client.open(uri("main"), SCENE)
    asked = {"name": "wave", "axes": [axis("t", 0, 1, 2)], **change}
    answer = sampled(client, uri("main"), asked.pop("name"), asked.pop("axes"), **asked)
    assert answer["error"]["code"] == -32803 and said in answer["error"]["message"], answer


@pytest.mark.parametrize(
    "axes", [[], 3, [3], [axis("t", 0, 1, 0)], [axis("t", 0, 1, 513)] * 2, [{"name": "t"}], [axis("t", 0, 1, 2)] * 3]
)
def test_malformed_axes(server: Server, uri: Uri, axes: Any) -> None:
    client = server()
    assert client.error("potto/sample", {"textDocument": {"uri": uri("x")}, "name": "f", "axes": axes}) == -32602


def test_a_pass_is_cancelled_at_once_and_the_next_one_runs(server: Server, uri: Uri) -> None:
    client = server()
    slow = "def f(a) integral ([0,1],[0,1],[0,1],[0,1]) [sin(x*y) + z*w^2*exp(x*a) < a] d(x,y,z,w)\ndef g(x) x\n"
    client.open(uri("main"), slow)
    sampled(client, uri("main"), "g", [axis("x", 0, 1, 2)])
    asked = {"textDocument": {"uri": uri("main")}, "name": "f", "axes": [axis("a", 0, 1, 4096)], "rtol": 1e-9}
    id = client.begin("potto/sample", asked)
    time.sleep(0.5)
    started = time.monotonic()
    client.tell("$/cancelRequest", {"id": id})
    assert client.answer(id)["error"]["code"] == -32800
    assert time.monotonic() - started < 1
    assert doubles(sampled(client, uri("main"), "g", [axis("x", 0, 1, 2)])["result"]["value"][0]) == (0, 1)
    assert time.monotonic() - started < 10


DISCS = """def disc(p, y, r) [r^2 > p^2 + y^2]
"""
PIXEL = """from discs import disc
def shade(x, y, r) [x < 9]*disc(x, y, r)
def pixel(px, py, r, t)
    integral ([px, px + 0.1], [py, py + 0.1])
        (shade(x, y, r) + 2*[x < t]) d(x, y)
"""


SHAPED = """from discs import disc
def hill(x, y) x*(if [y < 0.25] then 1 else 2)
def pixel(px, py, t, shape)
    integral ([px, px + 0.1], [py, py + 0.1]) [shape(x, y) < t] d(x, y)
"""


def test_a_pixel_leads_to_the_conditions_of_the_function_that_it_is_given(server: Server, uri: Uri) -> None:
    """Of y < 0.25 at (0.35, 0.3), the middle of a pixel of 0.1: 0.05 above it, half a pixel. 2*x < t: t - 0.7 = 0.1,
    which is half of 2*0.1. The view begins with `hill`, whose condition is lit by its call."""
    client = server()
    client.open(uri("discs"), DISCS)
    client.open(uri("main"), SHAPED)
    values = {"px": 0.3, "py": 0.25, "t": 0.8, "shape": "hill"}
    asked = {"textDocument": {"uri": uri("main")}, "name": "pixel", "values": values, "cell": {"px": 0.1, "py": 0.1}}
    found = client.answer(client.begin("potto/pixel", asked), 60)["result"]["conditions"]
    where = {tuple(each["range"]["start"].values()): each["pixels"] for each in found}
    assert where == {(1, 22): pytest.approx(0.5), (3, 47): pytest.approx(0.5)}
    asked["values"] = {**values, "shape": r"\(x, y) . x*disc(x, y, 0.4)"}
    found = client.answer(client.begin("potto/pixel", asked), 60)["result"]["conditions"]
    assert (found[0]["uri"], found[0]["range"]["start"]) == (uri("discs"), {"line": 0, "character": 19})
    place = {"textDocument": {"uri": uri("main")}, "position": {"line": 3, "character": 51}}
    seen = client.answer(client.begin("potto/viewed", place), 60)["result"]
    assert seen["lit"] == "y = 0.25"
    assert [each["equation"] for each in seen["conditions"]] == ["y = 0.25", "t = x*(if [y < 0.25] then 1 else 2)"]


def test_a_pixel_leads_to_the_conditions_of_a_function_without_an_integral(server: Server, uri: Uri) -> None:
    """Of x^2 + y^2 < r^2 at (0.6, 0.5): 0.64 - 0.61 = 0.03 inside; over a pixel it changes by 0.1*(2*0.6 + 2*0.5) =
    0.22. Of x < t, t - 0.6 = -0.3, which is 3 pixels; it stands in a function that is called."""
    client = server()
    text = "def side(x, t) [x < t]\ndef f(x, y, r, t) if [x^2 + y^2 < r^2] then 1 else side(x, t)\n"
    client.open(uri("main"), text)
    values = {"x": 0.6, "y": 0.5, "r": 0.8, "t": 0.3}
    asked = {"textDocument": {"uri": uri("main")}, "name": "f", "values": values, "cell": {"x": 0.1, "y": 0.1}}
    circle, side = client.answer(client.begin("potto/pixel", asked), 60)["result"]["conditions"]
    assert (circle["side"], side["side"]) == (1, -1)
    assert math.isclose(circle["pixels"], 0.03 / 0.22, rel_tol=1e-9)
    assert math.isclose(side["pixels"], 3, rel_tol=1e-9)
    assert circle["range"]["start"] == {"line": 1, "character": 22}
    assert side["range"]["start"] == {"line": 0, "character": 16}


def test_a_pixel_leads_to_the_conditions_behind_it(server: Server, uri: Uri) -> None:
    """Of x^2 + y^2 < r^2 at (0.35, 0.4), the middle: 0.25 - 0.1225 - 0.16 = -0.0325 outside; over a pixel it changes by
    0.1*(2*0.35 + 2*0.4) = 0.15, so it is 0.2167 pixels off. Of x < t: t - 0.35 = 0.25, which is 2.5 pixels."""
    client = server()
    client.open(uri("discs"), DISCS)
    client.open(uri("main"), PIXEL)
    values = {"px": 0.3, "py": 0.35, "r": 0.5, "t": 0.6}
    asked = {"textDocument": {"uri": uri("main")}, "name": "pixel", "values": values, "cell": {"px": 0.1, "py": 0.1}}
    found = client.answer(client.begin("potto/pixel", asked), 60)["result"]
    assert found["range"]["start"] == {"line": 2, "character": 0} and found["range"]["end"]["line"] == 4
    circle, line, edge = found["conditions"]
    assert (circle["side"], line["side"]) == (-1, 1)
    assert math.isclose(circle["pixels"], 0.0325 / 0.15, rel_tol=1e-9)
    assert math.isclose(line["pixels"], 2.5, rel_tol=1e-9)
    where = [(found["uri"], *found["range"]["start"].values()) for found in (circle, line, edge)]
    assert where == [(uri("discs"), 0, 19), (uri("main"), 4, 29), (uri("main"), 1, 20)], "each where it is written"
    assert "x = t" in line["equation"]
    assert client.error("potto/pixel", {**asked, "cell": {"qx": 1}}) == -32602
