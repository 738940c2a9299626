"""The page of `potto view`: what it answers, and to whom; and in a browser, where there is one."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import threading
import urllib.error
import urllib.request
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from potto.applications import integral_answers, integral_scenes
from potto.applications.integral_answers import Answers
from potto.cli.view_page import Answering, serve
from potto.evaluating.world import World

PROGRAM = """\
def f(t)
    integral [0, 1] [x < t]*exp(x) d(x)
#> f(0.25)
def disc(r) integral ([-1, 1], [-1, 1]) [x^2 + y^2 < r^2] d(x, y)
#> disc(0.7)
def ball(r) integral ([-1, 1], [-1, 1], [-1, 1]) [x^2 + y^2 + z^2 < r^2] d(x, y, z)
#> ball(0.7)
def waves(t) integral [0, 1] exp(t*x) + sin(2*pi*400*x)/2 d(x)
def nested(t) sum i in 2..3 (sum j in i..5 (integral [0, 1] [x < t/(i*j)] d(x)))
def plain(t) t
def seen(c, shade) integral [0, 1] [x < c]*shade(x) d(x)
#> seen(0.5, ramp)
def ramp(x: Real*) -> Real x
"""
MESH = """
def edge(a: (Real*, Real*), b: (Real*, Real*), x, y) (b.x - a.x)*(y - a.y) - (b.y - a.y)*(x - a.x)
def inside(t: ((Real*, Real*), (Real*, Real*), (Real*, Real*)), x, y)
    [edge(t.0, t.1, x, y) >= 0 and edge(t.1, t.2, x, y) >= 0 and edge(t.2, t.0, x, y) >= 0]
def pixel(mesh: [n] ((Real, Real), (Real, Real), (Real, Real)), grey: [n] Real)
    integral ([0, 1], [0, 1]) sum i in 0..n - 1 (grey[i]*inside(mesh[i], x, y)) d(x, y)
def light(c) pixel([((0, 0), (c, 0), (c, c)), ((0, 0), (c, c), (0, c))], [1, 0.5])
"""
DRIVER = Path(__file__).with_name("browser.mjs")
PLAYWRIGHT = Path(__file__).parents[2] / "editors/vscode/e2e/node_modules/playwright-core"


@pytest.fixture
def address() -> Iterator[str]:
    world = World()
    answers = Answering(Answers(world, world.put("program.po", PROGRAM)))
    server, address = serve(answers)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield address
    server.shutdown()
    server.server_close()
    thread.join()
    answers.close()


def asked(address: str, path: str, body: Any, host: str = "") -> Any:
    url = address.replace("/?", f"{path}?")
    request = urllib.request.Request(url, json.dumps(body).encode(), {"Host": host} if host else {})
    with urllib.request.urlopen(request, timeout=30) as answer:
        return json.load(answer)


def test_a_slider_moves_the_numbers(address: str) -> None:
    names = ["f", "disc", "ball", "waves", "nested", "plain", "seen", "ramp"]
    assert asked(address, "/names", {}) == {"names": names, "chosen": "f"}
    found = asked(address, "/open", {"name": "f"})
    assert (found["values"], found["wrt"], found["integrals"]) == ({"t": 0.25}, "t", 1)
    for t, e_to_t in ((0.25, 1.2840254166877414), (0.75, 2.117000016612675)):
        found = asked(address, "/look", {"name": "f", "values": {"t": t}, "wrt": "t", "which": 0})
        assert found["numbers"]["value"] == pytest.approx(e_to_t - 1)
        assert found["numbers"]["boundary"] == pytest.approx(e_to_t)
        assert "<svg" in found["svg"]


def test_an_array_that_is_handed_on_is_looked_at() -> None:
    """A square of side c, half of it half as bright: 3/4 of c^2."""
    world = World()
    answers = Answers(world, world.put("mesh.po", MESH))
    found = answers.answer("/look", {"name": "light", "values": {"c": 0.8}, "wrt": "c", "which": 0})
    assert found is not None
    assert found["numbers"]["value"] == pytest.approx(0.48) and found["numbers"]["boundary"] == pytest.approx(1.2)


def test_while_a_slider_is_dragged_four_digits_are_asked_for(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of x^2 + y^2 < 1 the area is pi; the error bar holds what is missing."""
    monkeypatch.setattr(integral_scenes, "PATIENCE", 60.0)  # whatever else runs
    question = {"name": "disc", "values": {"r": 1.0}, "wrt": "r", "which": 0}
    quick, fine = (asked(address, "/look", {**question, "quick": quick})["numbers"] for quick in (True, False))
    assert quick["error"] >= fine["error"]
    for found in (quick, fine):
        assert abs(found["value"] - math.pi) <= found["error"] <= 1e-3


def test_numbers_that_take_long_are_given_up_while_a_slider_is_dragged(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The picture goes on without them. When it rests they are there, and the next time they are tried again."""
    question = {"name": "waves", "values": {"t": 1.0}, "wrt": "t", "which": 0}
    monkeypatch.setattr(integral_scenes, "PATIENCE", 0.0)
    found = asked(address, "/look", {**question, "quick": True})
    assert found["numbers"] is None and "<svg" in found["svg"]
    monkeypatch.setattr(integral_scenes, "PATIENCE", 60.0)
    for quick, values in ((False, {"t": 1.0}), (True, {"t": 1.5})):
        numbers = asked(address, "/look", {**question, "values": values, "quick": quick})["numbers"]
        assert numbers["value"] == pytest.approx(math.expm1(values["t"]) / values["t"], rel=1e-4)


def test_text_and_picture_call_a_surface_the_same(address: str) -> None:
    found = asked(address, "/open", {"name": "f"})
    (mark,) = found["conditions"]
    assert found["source"][mark["from"] : mark["to"]] == "x < t"
    seen = asked(address, "/look", {"name": "f", "values": {"t": 0.25}, "wrt": "t", "which": 0})
    assert [surface["equation"] for surface in seen["surfaces"]] == [mark["equation"]] == ["x = t"]
    assert 'data-equation="x = t"' in seen["svg"]


def test_also_where_a_part_or_a_variable_has_another_name_in_the_picture() -> None:
    world = World()
    text = "def slant(w: (Real, Real), x) x*integral [0, 1] [w.1*x < w.0] d(x)\n"
    answers = Answers(world, world.put("program.po", text))
    (mark,) = answers.answer("/open", {"name": "slant"})["conditions"]  # type: ignore[index]
    values = {"w_1": 0.2, "w_2": 0.5, "x": 1.0}
    seen = answers.answer("/look", {"name": "slant", "values": values, "wrt": "w_1", "which": 0}) or {}
    (surface,) = seen["surfaces"]
    assert surface["equation"] != mark["equation"] == surface["condition"]


def test_a_function_is_chosen_from_the_whole_workspace_or_written(tmp_path: Path) -> None:
    """Shaders over [0, c]: x, of a module that is not imported, leads to c^2/2, and 3 to 3*c."""
    (tmp_path / "scene.po").write_text("def seen(c, shade) integral [0, 1] [x < c]*shade(x) d(x)\n")
    (tmp_path / "shades.po").write_text("def ramp(x: Real*) -> Real x\n")
    world = World([tmp_path])
    answers = Answers(world, world.key(tmp_path / "scene.po"))
    found = answers.answer("/open", {"name": "seen"}) or {}
    assert found["functions"] == {"shade": "shades.ramp"} and "shades.ramp" in found["fits"]["shade"]
    question = {"name": "seen", "values": {"c": 0.5}, "wrt": "c", "which": 0}
    for functions, value in (({}, 0.125), ({"shade": "shades.ramp"}, 0.125), ({"shade": r"\(x) . 3"}, 1.5)):
        seen = answers.answer("/look", {**question, "functions": functions}) or {}
        assert seen["numbers"]["value"] == pytest.approx(value, abs=1e-14), functions
    wrong = answers.answer("/open", {"name": "seen", "functions": {"shade": "shades.none"}}) or {}
    assert "shades.none" in wrong["error"]


def test_ghosts_are_a_step_away_and_nodes_are_where_it_was_evaluated(address: str) -> None:
    question = {"name": "f", "values": {"t": 0.5}, "wrt": "t", "which": 0, "ghost": 0.1, "nodes": True}
    found = asked(address, "/look", question)
    between_the_ghosts = (math.exp(0.6) - math.exp(0.4)) / 0.2
    assert found["numbers"]["difference"] == pytest.approx(between_the_ghosts, abs=1e-12)
    assert found["svg"].count('class="ghost"') == 2
    assert found["svg"].count('class="node"') >= 4


def test_formulas_come_as_mathml(address: str) -> None:
    found = asked(address, "/formulas", {"name": "f"})
    assert [each["part"] for each in found["formulas"]] == ["integral", "interior", "boundary"]
    assert all(each["math"].startswith("<math") for each in found["formulas"])


def test_what_is_wrong_comes_as_words(address: str) -> None:
    assert "no integral" in asked(address, "/open", {"name": "plain"})["error"]
    assert "not one of this page" in asked(address, "/look", {"name": "f"})["error"]


def test_only_who_has_the_token_is_answered(address: str) -> None:
    for url, host in ((address[:-1], ""), (address.partition("?")[0], ""), (address, "evil.example")):
        with pytest.raises(urllib.error.HTTPError) as refused:
            asked(url if "?" in url else url + "?", "/names", {}, host)
        assert refused.value.code == 404


def test_it_is_bound_to_this_machine(address: str) -> None:
    assert address.startswith("http://127.0.0.1:")


def _browser() -> str | None:
    names = ("chromium", "chromium-browser", "google-chrome")
    return next((found for name in names if (found := shutil.which(name))), None)


@pytest.mark.slow
def test_a_person_with_a_browser(address: str, tmp_path: Path) -> None:
    browser = _browser()
    missing = [what for what, there in (("node", shutil.which("node")), ("chromium", browser),
               ("playwright-core, which `make e2e INSTALL=1` gets", PLAYWRIGHT.exists())) if not there]  # fmt: skip
    if missing or browser is None:
        why = f"there is no {' and no '.join(missing)}"
        warnings.warn(f"THE INTEGRAL VIEW IS NOT TRIED IN A BROWSER: {why}", stacklevel=1)
        pytest.skip(why)
    pictures = os.environ.get("POTTO_PICTURES", str(tmp_path))
    command = ["node", str(DRIVER), str(PLAYWRIGHT), browser, address, pictures]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout.splitlines()[-1])
    assert seen["errors"] == [] and seen["beyond"] == []
    t = seen["slider"]
    assert t > 0.3 and seen["moved"] and seen["after"][:4] != seen["before"][:4]
    assert seen["asked"][-1] == t and len(seen["asked"]) <= 41
    assert float(seen["after"][0].split()[0]) == pytest.approx(math.exp(t) - 1, rel=1e-9)
    assert float(seen["after"][3].split()[0]) == pytest.approx(math.exp(t), rel=1e-9)
    assert seen["litByText"] == "x = t" and seen["litByPicture"] == "x < t"
    assert seen["ghosts"] == 2 and seen["withGhost"][4] != seen["after"][4]
    assert seen["nodes"] >= 4 and seen["formulas"] == 3
    assert seen["pinned"][0] == seen["withGhost"][0]
    assert seen["compared"][0].startswith("Δ −") and len(seen["compared"]) == 5
    assert seen["ground"] == "rgb(30, 30, 30)"
    assert seen["section"] == ["z", "0", "-1", "1"]  # where nobody has moved it, in the middle
    z = seen["sectionThen"]
    assert 0.2 < z < 0.6 and f"section at z = {z:.4g}" in seen["sectioned"]
    assert seen["sectionNumbers"][0] == seen["sectionNumbers"][1]
    assert seen["unsectioned"] == 0
    assert seen["inner"] == ["2", "2"] and seen["innerThen"] == ["3", "3"]
    assert float(seen["summand"][1].split()[0]) == pytest.approx(1 / 9, rel=1e-9)  # of t/(i*j) by t, with i = j = 3
    assert seen["shade"] == "ramp" and float(seen["shaded"][0].split()[0]) == pytest.approx(0.125, rel=1e-9)
    assert float(seen["reshaded"][0].split()[0]) == pytest.approx(1.5, rel=1e-9)  # of 3 from 0 to 0.5
    assert "shade = \\(x) . 3" in seen["caption"]


def test_a_drag_looks_at_the_disk_now_and_then_and_its_end_shows_what_was_saved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Over [0, t]: 1 leads to t, and 2 to 2*t."""
    program = "def f(t) integral [0, 1] [x < t]*{} d(x)\n"
    (tmp_path / "f.po").write_text(program.format(1))
    world = World([tmp_path])
    looks: list[int] = []
    refresh = world.refresh
    monkeypatch.setattr(world, "refresh", lambda: looks.append(1) or refresh())
    monkeypatch.setattr(integral_scenes, "FRAME", 1e9)  # numbers come at each place, whatever else runs
    monkeypatch.setattr(integral_scenes, "PATIENCE", 60.0)
    monkeypatch.setattr(integral_answers, "UNSEEN", 1e9)
    answers = Answers(world, world.key(tmp_path / "f.po"))

    def value(t: float, quick: bool) -> float:
        found = answers.answer("/look", {"name": "f", "values": {"t": t}, "wrt": "t", "which": 0, "quick": quick}) or {}
        return float(found["numbers"]["value"])

    assert value(0.5, False) == pytest.approx(0.5)
    (tmp_path / "f.po").write_text(program.format("2.0"))  # of another length, whatever the clock of the disk says
    for place in range(10):
        assert value(0.5 + place / 100, True) == pytest.approx(0.5 + place / 100, abs=1e-3)
    assert len(looks) == 1
    assert value(0.5, False) == pytest.approx(1.0)
    monkeypatch.setattr(integral_answers, "UNSEEN", 0.0)
    (tmp_path / "f.po").write_text(program.format("3.00"))
    assert value(0.5, True) == pytest.approx(1.5, abs=1e-3)
