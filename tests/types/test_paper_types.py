"""The programs of the paper, as printed, with the types that the language's contract gives them."""

from __future__ import annotations

from pathlib import Path

import pytest
from marks import FOLDER, database, diagnostics

from potto.types import derivative_type, format_type, interface

PAPER = r"""
# file: half_plane.diffeo
# a diffeomorphism of (x, y), with the parameter c
cond = \(x, y) . \c . (x + y + c, x - y + c)
# file: color_shaders.po
dconst_shader = deriv(\(x,y) . c. 1)
dlin_shader   = deriv(\(x,y) . c.
    1/(sqrt(2)*(x+y+c)+2))
dquad_shader  = deriv(\(x,y) . c.
    1/(sqrt(2)*(x+y+c)+2)^2)
# file: renderer.po
from half_plane import cond
def renderer(c, shader)
    integral ([0,1], [0,1])
        ((shader (x,y)) c)
        *(((cond (x, y)) c)?1:0) d(x,y)
drenderer = deriv(renderer)
# file: main.po
from color_shaders import dconst_shader,
    dlin_shader, dquad_shader
from renderer import drenderer
for dshader in [dconst_shader,
    dlin_shader, dquad_shader]:
    print(drenderer(dc=(-2,1), dshader))
"""
FILES = ("half_plane.diffeo", "color_shaders.po", "renderer.po", "main.po")
DUAL_SHADER = "(dx: (Real*, Real*), dy: (Real*, Real*)) -> (dc: (Real*, Real*)) -> (Real, Real)"
TYPES = {
    ("half_plane.diffeo", "cond"): "(x: Real*, y: Real*) -> (c: Real*) -> Diffeo[2]",
    ("color_shaders.po", "dconst_shader"): DUAL_SHADER,
    ("color_shaders.po", "dlin_shader"): DUAL_SHADER,
    ("color_shaders.po", "dquad_shader"): DUAL_SHADER,
    ("renderer.po", "renderer"): "(c: Real, shader: (Real*, Real*) -> Real -> Real) -> Real",
    ("renderer.po", "drenderer"): "(dc: (Real, Real), dshader: ((Real*, Real*), (Real*, Real*)) "
    "-> ((Real, Real)) -> (Real, Real)) -> (Real, Real)",
}


@pytest.mark.parametrize("file", FILES)
def test_the_paper_has_no_mistakes(file: str) -> None:
    assert diagnostics(database(PAPER), file) == []


@pytest.mark.parametrize(("file", "name"), TYPES)
def test_the_types_of_the_paper(file: str, name: str) -> None:
    assert format_type(interface(database(PAPER), FOLDER + file, name).type) == TYPES[file, name]


def test_the_type_of_a_derivative_is_the_derivative_of_the_type() -> None:
    db = database(PAPER)
    renderer = interface(db, FOLDER + "renderer.po", "renderer")
    drenderer = interface(db, FOLDER + "renderer.po", "drenderer")
    assert format_type(derivative_type(renderer.type)) == format_type(drenderer.type)


def test_what_an_interface_says() -> None:
    db = database(PAPER)
    renderer = interface(db, FOLDER + "renderer.po", "renderer")
    assert renderer.groups == (("c", "shader"),)
    assert renderer.varies == ("c", "shader")
    assert renderer.plain == ()
    cond = interface(db, FOLDER + "half_plane.diffeo", "cond")
    assert cond.diffeo and cond.groups == (("x", "y"), ("c",))


def test_the_files_in_the_repository() -> None:
    folder = Path(__file__).resolve().parents[2] / "examples" / "paper"
    db = database("x = 1")
    for file in FILES:
        db.set_input(("file", FOLDER + file), (folder / file).read_text(encoding="utf-8"))
    for file in FILES:
        assert [d for _, d in diagnostics(db, file) if d.severity == "error"] == []
    renderer = interface(db, FOLDER + "renderer.po", "renderer")
    assert format_type(renderer.type) == TYPES["renderer.po", "renderer"]
