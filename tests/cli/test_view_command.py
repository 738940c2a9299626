"""`potto view`: an integral as a picture, and as numbers."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_runs import Potto

PROGRAM = "def f(t, k) integral [0, 1] k*[x < t] d(x)\n#> f(0.25, 2)\n"


def test_a_picture_is_written(potto: Potto, tmp_path: Path) -> None:
    ran = potto("view", "main.po", "f", "-o", "f.svg", main=PROGRAM)
    assert (ran.status, ran.out) == (0, "f.svg: f by t, 1 surface\n")
    assert "x = t" in (tmp_path / "f.svg").read_text(encoding="utf-8")


def test_a_picture_has_what_is_asked_for(potto: Potto, tmp_path: Path) -> None:
    """The surface a step before and after, places of evaluation, and the difference over that step."""
    assert potto("view", "main.po", "f", "-o", "f.svg", "--step", "0.125", "--nodes",
                 main=PROGRAM.replace("k*", "k*exp(x)*")).status == 0  # fmt: skip
    text = (tmp_path / "f.svg").read_text(encoding="utf-8")
    assert text.count('class="ghost"') == 2 and 'class="node"' in text and "central difference, t ± 0.12 = " in text
    assert potto("view", "main.po", "f", "--step", "-1", "-o", "f.svg", main=PROGRAM).status == 2


def test_values_start_as_a_live_expression_gives_them(potto: Potto) -> None:
    answer = potto("view", "main.po", "f", "--json", main=PROGRAM).json
    assert answer["values"] == {"t": 0.25, "k": 2.0}
    assert answer["numbers"]["boundary"] == pytest.approx(2.0)


def test_a_section_stands_where_it_is_said(potto: Potto, tmp_path: Path) -> None:
    program = "def f(t) integral ([0, 1], [0, 1], [0, 2]) [x + y + z < t] d(x, y, z)\n#> f(1)\n"
    assert potto("view", "main.po", "f", "z=0.25", "-o", "f.svg", main=program).status == 0
    assert "section at z = 0.25" in (tmp_path / "f.svg").read_text(encoding="utf-8")
    told = potto("view", "main.po", "f", "x=0.25", "-o", "f.svg", main=program)
    assert told.status == 1 and "no parameter `x`" in told.err and "t, z" in told.err


def test_what_is_wrong_is_said(potto: Potto) -> None:
    assert potto("view", "main.po", "f", "q=1", "-o", "f.svg", main=PROGRAM).status == 1
    assert "no parameter `q`" in potto("view", "main.po", "f", "q=1", "-o", "f.svg", main=PROGRAM).err
    assert potto("view", "main.po", "f", "-o", "f.gif", main=PROGRAM).status == 2
    assert potto("view", "main.po", "f", "-o", "none/f.svg", main=PROGRAM).status == 1
    told = potto("view", "main.po", "-o", "f.svg", main=PROGRAM + "def g(t) t^2\n")
    assert told.status == 2 and told.err.endswith("FILE NAME`, of f\n")
