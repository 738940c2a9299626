"""Parameters that are functions: what they are given where nobody says it, in previews, lenses and evaluations."""

from __future__ import annotations

import base64
import math
import shutil
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lsp_client import Client

Server = Callable[..., Client]
Uri = Callable[[str], str]
PAPER = Path(__file__).resolve().parents[2] / "examples" / "paper"
DRAWS = {"experimental": {"commands": {"commands": ["potto.preview"]}}}


def scene(client: Client, uri: str, name: str) -> dict[str, Any]:
    found = {scene["name"]: scene for scene in client.ask("potto/scenes", {"textDocument": {"uri": uri}})}
    return found[name]


def fits(client: Client, uri: str, name: str) -> list[list[str]]:
    return [p["fits"] for p in scene(client, uri, name)["parameters"] if p["kind"] == "function"]


def curve(client: Client, uri: str, name: str, axis: str, *places: float, **more: Any) -> list[tuple[float, ...]]:
    """The components of a function at places as far from each other as a preview shows them at first: its functions are
    the first ones that fit, its numbers those of a slider that was not moved."""
    shown = scene(client, uri, name)
    values: dict[str, Any] = {}
    for parameter in shown["parameters"]:
        if parameter["kind"] == "function":
            assert parameter["fits"], f"nothing fits {parameter['name']}"
            values[parameter["name"]] = parameter["fits"][0]
        elif parameter["kind"] == "number":
            values[parameter["name"]] = (parameter["value"] or [0.5])[0]
        else:
            values[parameter["name"]] = parameter["value"] or [0.5] * parameter["size"]
    axes = [{"name": axis, "from": places[0], "to": places[-1], "count": len(places)}]
    asked = {"textDocument": {"uri": uri}, "name": name, "axes": axes, "values": values, **more}
    answer = client.answer(client.begin("potto/sample", asked), 60)
    assert "result" in answer, answer
    packed = answer["result"]["tangent" if "wrt" in more else "value"]
    return [struct.unpack(f"<{len(places)}d", base64.b64decode(each)) for each in packed]


def command(client: Client, name: str, *arguments: Any) -> dict[str, Any]:
    return client.answer(client.begin("workspace/executeCommand", {"command": name, "arguments": list(arguments)}), 60)


def test_the_papers_renderer_is_drawn(server: Server, uri: Uri, tmp_path: Path) -> None:
    """The shader is a constant: what is drawn is how much of the square its condition lets through."""
    for path in PAPER.iterdir():
        shutil.copy(path, tmp_path)
    client = server(DRAWS)
    where = uri("renderer")
    client.open(where, (PAPER / "renderer.po").read_text())
    # cond is x + y + c > 0 or < 0: the square's part on one side of a line, at c = -1 half of it, at -2 all or nothing.
    (values,) = curve(client, where, "renderer", "c", -2, -1.5, -1, -0.5, 0)
    area = [1, 1 - 0.125, 0.5, 0.125, 0]
    assert values == pytest.approx(area, abs=1e-9) or values == pytest.approx(area[::-1], abs=1e-9)
    (slopes,) = curve(client, where, "renderer", "c", -1.5, -1, -0.5, wrt="c")  # as wide as the square is there
    assert [abs(slope) for slope in slopes] == pytest.approx([0.5, 1, 0.5], abs=1e-9)
    offers = command(client, "potto.more", where, "renderer")["result"]["offers"]
    assert [each["arguments"][1] for each in offers if each["title"] == "preview"] == ["renderer"]


@pytest.mark.parametrize(
    ("program", "function", "expected", "values"),
    [
        # One argument; the only function that fits.
        ("def lin(x) 2*x\ndef f(t, g) g(t) + 1\n", "f", ["lin"], (1, 2, 3)),
        # None fits: a constant one. Its value is 1.
        ("def f(t, g) g(t) + t\n", "f", [r"\(x) . 1"], (1, 1.5, 2)),
        # Several candidates: in the order of the file.
        ("def a(x) x\ndef b(x) x^2\ndef f(t, g) g(t)*2\ndef c(x) 3\n", "f", ["a", "b", "c"], (0, 1, 2)),
        # Curried: those with one group, or with two arguments in one, do not fit.
        ("def a(x) x\ndef b(x, y) x\ndef c(x)(y) x*y\ndef f(t, g) g(t)(2) + 0\n", "f", ["c"], (0, 1, 2)),
        ("def f(t, g) g(t, t)(2) + t\n", "f", [r"\(x, y) . \(z) . 1"], (1, 1.5, 2)),
        ("def f(t, g) g(t)(t)(t)(t) + t\n", "f", [r"\(x1) . \(x2) . \(x3) . \(x4) . 1"], (1, 1.5, 2)),
        # One that gives a tuple; one number does not fit, nor three.
        (
            "def a(x) x\ndef b(x) (x, 2*x)\ndef c(x) (x, x, x)\ndef f(t, g)\n    (u, v) = g(t)\n    u + v\n",
            "f", ["b"], (0, 1.5, 3),
        ),
        ("def f(t, g)\n    (u, v) = g(t)\n    u + v + t\n", "f", [r"\(x) . (1, 1)"], (2, 2.5, 3)),
        # A tuple goes in: a group of two fits as well.
        ("def a(x, y) x + y\ndef f(t, g) g((t, t)) + 0\n", "f", ["a"], (0, 1, 2)),
        # Where a variable of integration goes in, a function that decides by it does not fit.
        (
            "def plain(x) if x < 2 then x else 0\ndef smooth(x) 2*x\n"
            "def f(t, g) integral [0, 1] g(x) d(x) + t\n", "f", ["smooth"], (1, 1.5, 2),
        ),
        ("def plain(x) if x < 2 then x else 0\ndef f(t, g) g(t) + 0\n", "f", ["plain"], (0, 0.5, 1)),
        # A lambda under a name, another name for a function, a function of another one.
        ("flat = \\(x) . 2\nsame = flat\ndef f(t, g) g(t) + t\n", "f", ["flat", "same"], (2, 2.5, 3)),
        ("def two(h) h(1) + h(2)\ndef f(t, g) g(\\(x) . x*t) + 0\n", "f", ["two"], (0, 1.5, 3)),
        # Two functions in one call; itself it is not given.
        ("def a(x) x\ndef f(t, g, h) g(t) + h(t)(t)\n", "f", ["a"], (1, 1.5, 2)),
        ("def f(t, g) g(t, sin) + t\n", "f", [r"\(x, y) . 1"], (1, 1.5, 2)),
        # What a live expression gives goes first, and need not have a name.
        ("def a(x) x\ndef f(t, g) g(t) + 0\n#> f(1, \\(y) . 4*y)\n", "f", [r"\(y) . 4*y", "a"], (0, 2, 4)),
        (
            "def a(x) x\ndef b(x) x/2\ndef f(t, g) g(t) + 0\n#> deriv(f)(dt=(1, 1), deriv(b))\n",
            "f", ["b", "a"], (0, 0.25, 0.5),
        ),
        # A live expression's own names are no use.
        ("def a(x) x\ndef f(t, g) g(t) + 0\n#> let h = \\(y) . y in f(1, h)\n", "f", ["a"], (0, 0.5, 1)),
    ],
)  # fmt: skip
def test_a_function_that_fits(
    server: Server, uri: Uri, program: str, function: str, expected: list[str], values: tuple[float, ...]
) -> None:
    client = server()
    client.open(uri("main"), program)
    assert fits(client, uri("main"), function)[0] == expected
    assert curve(client, uri("main"), function, "t", 0, 0.5, 1)[0] == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        ("from shades import lin\n", ["lin", "shades.sq"]),
        ("from shades import lin as other\n", ["other", "shades.sq"]),
        ("import shades\n", ["shades.lin", "shades.sq"]),
        ("import shades as s\n", ["s.lin", "s.sq"]),
        ("", ["shades.lin", "shades.sq"]),  # of a module that the file does not import
        ("def own(x) x/4\nimport shades\n", ["own", "shades.lin", "shades.sq"]),
        ("from shades import pair\n", ["shades.lin", "shades.sq"]),  # what is imported does not fit
        ("from shades import nowhere\n", ["shades.lin", "shades.sq"]),
    ],
)
def test_functions_of_other_modules(server: Server, uri: Uri, head: str, expected: list[str]) -> None:
    client = server(shades="def lin(x) 4*x\ndef pair(x) (x, x)\ndef sq(x) x^2\n", other="def two(x, y) x\n")
    client.open(uri("main"), head + "def f(t, g) g(t) + 0\n")
    assert fits(client, uri("main"), "f") == [expected]
    factor = 0.25 if expected[0] == "own" else 4
    assert curve(client, uri("main"), "f", "t", 0, 1)[0] == pytest.approx((0, factor), abs=1e-9)


def test_a_diffeomorphism_is_found_and_never_made_up(server: Server, uri: Uri, tmp_path: Path) -> None:
    (tmp_path / "half.diffeo").write_text("cond = \\(x, y) . \\c . (x + y + c, x - y + c)\n")
    client = server()
    program = "def f(t, g) integral ([0, 1], [0, 1]) (((g(x, y))(t)) ? 1 : 0) d(x, y)\n"
    client.open(uri("main"), "from half import cond\n" + program)
    assert fits(client, uri("main"), "f") == [["cond"]]
    (values,) = curve(client, uri("main"), "f", "t", -1, 0)
    assert sorted(values) == pytest.approx([0, 0.5], abs=1e-9) or sorted(values) == pytest.approx([0.5, 1], abs=1e-9)
    (tmp_path / "half.diffeo").unlink()
    client.open(uri("alone"), program)
    client.tell("workspace/didChangeWatchedFiles", {"changes": [{"uri": uri("half.diffeo"), "type": 3}]})
    assert fits(client, uri("alone"), "f") == [[]]
    told = command(client, "potto.preview", uri("alone"), "f")["error"]
    assert told["code"] == -32803 and "needs a function `g`" in told["message"] and "none was found" in told["message"]


def test_without_a_function_the_preview_says_what_it_needs(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), "def f(t, g) g(t) + 0\n")
    axes = [{"name": "t", "from": 0, "to": 1, "count": 2}]
    asked = {"textDocument": {"uri": uri("main")}, "name": "f", "axes": axes, "values": {"g": ""}}
    assert client.answer(client.begin("potto/sample", asked), 60)["error"]["message"] == "`g` needs a value"


@pytest.mark.parametrize(
    ("program", "kind", "said"),
    [
        ("def lin(x) 2*x\ndef f(t, g) g(t) + 1\n", "curve", "f with g = lin, over 0..1: 1 to 3"),
        ("def f(t, g) g(t) + t\n", "curve", r"f with g = \(x) . 1, over 0..1: 1 to 2"),
        ("def lin(x)(y) x*y\ndef f(x, y, g) g(x)(y) + 1\n", "image", "f with g = lin, over 0..1 × 0..1: 1 to 2"),
        ("def lin(x) x\ndef f(g)(t) g(t)\n#> f(lin)(2)\n", "curve", "f with g = lin, over 0..1: 0 to 1"),
        ("def a(x) x\ndef b(x) (x, 1)\ndef f(t, g, h)\n    (u, v) = h(t)\n    g(u) + v\n", "curve",
         "f with g = a, h = b, over 0..1: 1 to 2"),
    ],
)  # fmt: skip
def test_the_picture_of_the_server(server: Server, uri: Uri, program: str, kind: str, said: str) -> None:
    client = server()
    client.open(uri("main"), program)
    found = command(client, "potto.preview", uri("main"), "f")["result"]
    assert found["kind"] == kind and found["text"] == said and found["image"].startswith("data:image/png")
    offers = command(client, "potto.more", uri("main"), "f")["result"]["offers"]
    assert [each["arguments"][1] for each in offers if each["title"] == "preview"] == ["f"]


@pytest.mark.parametrize(
    ("program", "call", "value", "slopes"),
    [
        ("def lin(x) 2*x\ndef f(t, g) g(t) + 1\n", "f(0.5, lin)", 2, {"t": 2}),
        ("def f(t, g) g(t) + t\n", r"f(0.5, \(x) . 1)", 1.5, {"t": 1}),
        ("def s(x, y)(c) x*y*c\ndef f(t, g) g(t, t)(2) + 0\n", "f(0.5, s)", 0.5, {"t": 2}),
        ("def p(x) (x, x^2)\ndef f(t, g)\n    (u, v) = g(t)\n    u + v\n", "f(0.5, p)", 0.75, {"t": 2}),
        (
            "def s(x) x\ndef f(t, g, p: (Real, Real))\n    (u, v) = p\n    g(t)*u + v\n",
            "f(0.5, s, (0.5, 0.5))", 0.75, {"t": 0.5},
        ),
        ("def s(x) x\ndef f(g)(t) integral [0, t] g(x) d(x)\n", "f(s)(0.5)", 0.125, {"t": 0.5}),
    ],
)  # fmt: skip
def test_a_lens_evaluates_and_differentiates(
    server: Server, uri: Uri, program: str, call: str, value: float, slopes: dict[str, float]
) -> None:
    client = server()
    client.open(uri("main"), program)
    lenses = client.ask("textDocument/codeLens", {"textDocument": {"uri": uri("main")}})
    lens = next(each for each in lenses if each.get("data", [""])[0] == "value" and each["data"][2] == "f")
    resolved = client.ask("codeLens/resolve", lens)["command"]
    assert resolved["title"] == f"evaluate {call}" and resolved["arguments"][1] == call
    assert command(client, "potto.evaluate", uri("main"), "f")["result"]["value"] == pytest.approx(value, abs=1e-12)
    found = command(client, "potto.differentiate", uri("main"), call)["result"]
    assert {s["by"]: float(s["text"]) for s in found["slopes"]} == pytest.approx(slopes, abs=1e-9)
    assert math.isfinite(float(found["value"]))
