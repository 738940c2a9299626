"""Fields of records have their names in all that is said of derivatives: in gradients, and in notes about kinks.

Expected derivatives are by hand; the numbers are exact, so that no tolerance is needed.
"""

from __future__ import annotations

import json

import pytest
from command_runs import Potto

import potto as python

PROGRAM = """
record Gauss(mean: Real, width: Real, at: (Real, Real))
record Cloth(w: Real, faces: [m] [3] Real)
def total(gs: [2] Gauss) sum i in 0..1 (gs[i].mean^2 + gs[i].width * gs[i].at.1)
def inner(q: [1] [2] Gauss) q[0][1].mean^2
def fold(mesh: Cloth, f) abs(mesh.faces[f, 1]) * 2
def both(mesh: Cloth) fold(mesh, 0) + 1
def area(mesh: Cloth, f) integral [0, 1] [mesh.w + mesh.faces[f, 1]*x > 0] d(x)
def one(g: Gauss) g.mean * g.width
def plain(mesh: (Real, Real)) abs(mesh.0)
"""


TWO = "gs=[Gauss(1, 2, (3, 4)), Gauss(5, 6, (7, 8))]"


def test_gradients_by_arrays_of_records_have_their_fields(potto: Potto) -> None:
    told = potto("deriv", "main.po", "total", TWO, main=PROGRAM).out.splitlines()
    assert told[1] == "  by gs: [(mean=2, width=4, at=(0, 2)), (mean=10, width=8, at=(0, 6))]"
    told = potto("deriv", "main.po", "inner", TWO.replace("gs=[", "q=[[") + "]", main=PROGRAM).out.splitlines()
    assert told[1] == "  by q: [[(mean=0, width=0, at=(0, 0)), (mean=10, width=0, at=(0, 0))]]"


def test_the_hessian_by_arrays_of_records_has_their_fields(potto: Potto) -> None:
    told = potto("deriv", "main.po", "total", TWO, "--along", TWO, main=PROGRAM).out.splitlines()
    assert told[-1] == "  by gs: [(mean=2, width=4, at=(0, 2)), (mean=10, width=8, at=(0, 6))]"  # it is quadratic
    given = [{"mean": 1.0, "width": 2.0, "at": (3.0, 4.0)}, {"mean": 5.0, "width": 6.0, "at": (7.0, 8.0)}]
    product = python.hvp(python.load("main.po").total, {"gs": given})(given)
    assert product["gs"] == [{"mean": 2, "width": 4, "at": (0, 2)}, {"mean": 10, "width": 8, "at": (0, 6)}]


def test_records_are_arrays_in_json(potto: Potto) -> None:
    told = json.loads(potto("deriv", "main.po", "total", TWO, "--json", main=PROGRAM).out)
    assert told["gradient"] == {"gs": [[2, 4, [0, 2]], [10, 8, [0, 6]]]}
    told = json.loads(potto("deriv", "main.po", "one", "g=Gauss(1, 2, (3, 4))", "--json", main=PROGRAM).out)
    assert told["gradient"] == {"g": [2, 1, [0, 0]]}


@pytest.mark.parametrize(
    ("call", "place"),
    [
        (("fold", "mesh=Cloth(1, [[1, 0, 2]])", "f=0"), "the kink mesh.faces[f][1] = 0 is just here"),
        (("both", "mesh=Cloth(1, [[1, 0, 2]])"), "the kink mesh.faces[f][1] = 0 is just here"),
        (("area", "mesh=Cloth(0, [[1, 0, 2]])", "f=0"), "the surface mesh.w + mesh.faces[f][1]*x = 0 lies all along"),
        (("plain", "mesh=(0, 1)"), "the kink mesh.0 = 0 is just here"),
    ],
)
def test_notes_name_fields(potto: Potto, call: tuple[str, ...], place: str) -> None:
    assert f"note: {place}" in potto("deriv", "main.po", *call, main=PROGRAM).err


def test_second_derivatives_by_a_list_of_dicts(potto: Potto) -> None:
    """Of x^2 y, at each of the elements: 2 y dx + 2 x dy by x, 2 x dx by y."""
    text = "record P(x: Real, y: Real)\ndef f(ps: [2] P) sum i in 0..1 (ps[i].x^2 * ps[i].y)"
    assert potto("check", "second.po", second=text).status == 0
    f, given = python.load("second.po").f, [{"x": 1.0, "y": 2.0}, {"x": 5.0, "y": 6.0}]
    assert python.hvp(f, {"ps": given})(given)["ps"] == [{"x": 8, "y": 2}, {"x": 120, "y": 50}]
    assert python.hessian(f, "ps")(given).value.tolist() == [[4, 2, 0, 0], [2, 0, 0, 0], [0, 0, 12, 10], [0, 0, 10, 0]]
