"""`potto fit`: answers on paper, tables, traces, and the exit status of a fit that is none."""

from __future__ import annotations

import csv
import json

import pytest
from command_runs import Potto

PROGRAM = """
def area(t) integral [0, 1] x*[x < t] d(x)
def loss(t) (area(t) - 0.08)^2
def box(x, a, b) integral [0, 1] a*[u < b*x] d(u)
def two(a, b) (area(a), integral [0, 1] [x < a*b] d(x))
def kink(t) abs(t - 0.3)
def shaded(t, s) (integral [0, 1] s(x)*[x < t] d(x) - 0.08)^2
def id(x) x
def root(t) sqrt(t)
"""
TABLE = "x,y\n" + "".join(f"{i / 8},{min(1, 1.6 * i / 8)}\n" for i in range(1, 9))


def test_a_minimum_through_a_boundary_term(potto: Potto) -> None:
    ran = potto("fit", "p.po", "loss", "t=0.9", p=PROGRAM)
    assert ran.status == 0 and ran.out.startswith("t = 0.4\n") and "converged: no slope is left" in ran.out


def test_for_machines(potto: Potto) -> None:
    answer = potto("fit", "p.po", "two", "a=0.5", "b=1/2", "--target", "(0.18, 0.24)", "--json", p=PROGRAM).json
    assert answer["converged"] and answer["parameters"] == pytest.approx({"a": 0.6, "b": 0.4}, abs=1e-7, rel=0)
    assert answer["value"] < 1e-15 and answer["evaluations"] >= answer["steps"] > 0


def test_what_is_not_fitted_is_told_where_it_goes(potto: Potto) -> None:
    ran = potto("fit", "p.po", "shaded", "t=0.5", "s=id", p=PROGRAM)
    assert ran.status == 1 and "`s` starts at something that is not a number" in ran.err and "`--with s=…`" in ran.err
    assert potto("fit", "p.po", "shaded", "t=0.5", "--with", "s=id").status == 0


@pytest.mark.parametrize("start", [["ws=[0, 0]", "l=Line((0, 1), 1)"], ["l=Line((0, 0), 0)", "ws=[1, 1]"]])
def test_arrays_tuples_and_records_are_fitted(potto: Potto, tmp_path, start: list[str]) -> None:
    """A sum of squares that is 0 in one place."""
    program = """
record Line(at: (Real, Real), b: Real)
def miss(ws: [2] Real, l: Line) (ws[0] - 1)^2 + (ws[1] + ws[0])^2 + (l.at.x - 3)^2 + (l.at.y - ws[1])^2 + (l.b - 2)^2
"""
    wanted = {"ws[0]": 1, "ws[1]": -1, "l.at[0]": 3, "l.at[1]": -1, "l.b": 2}
    answer = potto("fit", "q.po", "miss", *start, "--trace", "t.csv", "--json", q=program).json
    assert answer["converged"] and answer["parameters"] == pytest.approx(wanted, abs=1e-7, rel=0)
    assert set(wanted) < set(next(csv.DictReader((tmp_path / "t.csv").open())))


def test_a_table_of_measurements(potto: Potto, tmp_path) -> None:
    (tmp_path / "t.csv").write_text(TABLE)
    ran = potto("fit", "p.po", "box", "b=0.7", "--with", "a=1", "--data", "t.csv", "--target", "y", p=PROGRAM)
    assert ran.status == 0 and ran.out.startswith("b = 1.6\nmean squared distance = ")


def test_the_trace(potto: Potto, tmp_path) -> None:
    for name in ("t.csv", "t.json"):
        potto("fit", "p.po", "loss", "t=0.9", "--trace", name, p=PROGRAM)
    rows = list(csv.DictReader((tmp_path / "t.csv").open()))
    assert rows[0]["t"] == "0.9" and [int(r["step"]) for r in rows] == list(range(len(rows)))
    steps = json.loads((tmp_path / "t.json").read_text())
    assert [s["value"] for s in steps] == [float(r["value"]) for r in rows] and steps[-1]["value"] < 1e-15


def test_bounds_and_functions(potto: Potto) -> None:
    assert potto("fit", "p.po", "area", "t=0.9", "--bound", "t=0.5:", p=PROGRAM).out.startswith("t = 0.5\n")
    assert potto("fit", "p.po", "shaded", "t=0.9", "--with", "s=id").out.startswith("t = 0.4\n")


def test_what_is_no_minimum_is_said_and_fails(potto: Potto) -> None:
    ran = potto("fit", "p.po", "kink", "t=2", p=PROGRAM)
    assert ran.status == 1 and "not converged" in ran.out and "a kink" in ran.out
    assert not potto("fit", "p.po", "loss", "t=0.9", "--steps", "2", "--json").json["converged"]


@pytest.mark.parametrize(("words", "said", "status"), [
    (["loss"], "NAME=EXPR", 2),
    (["loss", "s=1"], "no parameter `s`", 1),
    (["loss", "t=1", "--bound", "t=1:0"], "from less to more", 2),
    (["loss", "t=1", "--bound", "q=0:1"], "which is not fitted", 1),
    (["loss", "t=id"], "not a number", 1),
    (["root", "t=-1"], "at the start", 1),
    (["two", "a=1", "b=1"], "give a target", 1),
    (["box", "b=1", "--with", "a=1", "--data", "none.csv"], "none.csv", 2),
    (["box", "b=1", "--with", "a=1", "--data", "p.po"], "cells under", 2),
    (["loss", "t=1", "--steps", "0"], "at least 1", 2),
])  # fmt: skip
def test_mistakes(potto: Potto, words, said, status) -> None:
    ran = potto("fit", "p.po", *words, p=PROGRAM.strip())
    assert ran.status == status and said in ran.err and ran.out == ""


def test_columns_that_mean_nothing(potto: Potto, tmp_path) -> None:
    (tmp_path / "t.csv").write_text(TABLE)
    ran = potto("fit", "p.po", "box", "b=0.7", "--with", "a=1", "--data", "t.csv", p=PROGRAM)
    assert ran.status == 2 and "--target" in ran.err


def test_the_way_there_is_drawn(potto: Potto, tmp_path) -> None:
    """(a - 2)^2 + 1 from a = 0: an SVG by ourselves, a PNG by matplotlib; what cannot be drawn is said at once."""
    program = "def loss(a) (a - 2)^2 + 1\n"
    assert potto("fit", "s.po", "loss", "a=0", "--plot", "way.svg", s=program).status == 0
    svg = (tmp_path / "way.svg").read_text()
    assert ">step<" in svg and ">loss<" in svg and "evaluations" in svg
    ran = potto("fit", "s.po", "loss", "a=0", "--plot", "way.bmp")
    assert ran.status == 2 and "`.bmp` is not a picture" in ran.err and ran.out == ""
    pytest.importorskip("matplotlib")
    assert potto("fit", "s.po", "loss", "a=0", "--plot", "way.png").status == 0
    assert (tmp_path / "way.png").read_bytes().startswith(b"\x89PNG")
