"""Derivatives that are called without a tangent: 0 everywhere, and said wherever a program is read or run."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import potto
from potto.__main__ import main
from potto.evaluating.world import World

PROGRAM = r"""
def f(t) integral [0, 1] [x < t]*x d(x)
def g(t, w) integral [0, 1] [x < t]*x*w d(x)
def h(t)(c) t*c^2
def pair(p) fst(p)*snd(p)
def render(c, s) integral ([0, 1], [0, 1]) s (x, y) c*[x + y < c] d(x, y)
shader = \(x, y) . c . x*y*c
df = deriv(f)
same = df
half = deriv(h)((0.5, 1))
still = deriv(h)(0.5)
"""


def said(text: str) -> list[tuple[str, str]]:
    """What stands at the warnings of a text behind the program, and what they advise."""
    whole = PROGRAM + text + "\n"
    found = [d for d in potto.compile(whole).diagnostics if d.code == "P0615"]
    assert all(d.severity == "warning" for d in found)
    return [(whole[d.span.start : d.span.end], d.help.partition("`")[2].rstrip("`")) for d in found]


@pytest.mark.parametrize(
    ("text", "place", "meant"),
    [
        ("a = deriv(f)(0.3)", "0.3", "deriv(f)((0.3, 1))"),
        ("a = deriv(f) 0.3", "0.3", "deriv(f)((0.3, 1))"),
        ("a = (deriv(f))((0.3))", "0.3", "deriv(f)((0.3, 1))"),
        ("a = df(0.3)", "0.3", "df((0.3, 1))"),
        ("a = df(dt=0.3)", "0.3", "df(dt=(0.3, 1))"),
        ("a = same(dt=0.3)", "0.3", "same(dt=(0.3, 1))"),
        ("a = deriv(g)(0.3, 2)", "0.3", "deriv(g)((0.3, 1), 2)"),
        ("a = deriv(g)(dw=2, dt=0.3)", "2", "deriv(g)(dw=(2, 1), dt=0.3)"),
        ("a = deriv(g)((0.3, 1))", "0.3", "deriv(g)(((0.3, 1), 1))"),  # one tuple for the group: two plain numbers
        ("a = deriv(h)(0.3)(0.4)", "0.3", "deriv(h)((0.3, 1))(0.4)"),
        ("a = deriv(deriv(f))(0.3)", "0.3", "deriv(deriv(f))(((0.3, 1), (1, 0)))"),
        (r"a = deriv(\t . t^2)(3)", "3", r"deriv(\t . t^2)((3, 1))"),
        ("def k(x) x + snd(deriv(f)(x))", "x", "deriv(f)((x, 1))"),
        ("def k(x)\n    d = deriv(f)\n    snd(d(x + 1)) + x", "x + 1", "(d)((x + 1, 1))"),
        ("def k(x) x*(let e = deriv(f) in snd(e(0.3)))", "0.3", "e((0.3, 1))"),
        ("def k(c) integral [0, 1] snd(deriv(f)(x + c)) d(x)", "x + c", "deriv(f)((x + c, 1))"),
        ("def k(c) sum i in 1..3 (snd(deriv(f)(i/4)) + c)", "i/4", "deriv(f)((i / 4, 1))"),
        ("print(deriv(f)(0.3))", "0.3", "deriv(f)((0.3, 1))"),
        ("deriv(f)(0.3)", "0.3", "deriv(f)((0.3, 1))"),
        ("for v in [0.1, 0.2]:\n    print(df(v))", "v", "df((v, 1))"),
    ],
)
def test_a_call_in_which_nothing_moves(text: str, place: str, meant: str) -> None:
    assert said(text) == [(place, meant)]


@pytest.mark.parametrize(
    "text",
    [
        "a = deriv(f)((0.3, 1))",
        "a = deriv(f)(0.3, 1)",  # the two parts of the one dual
        "a = df(dt=(0.3, 0))",  # said with intent
        "a = deriv(g)((0.3, 1), 2)",
        "a = deriv(g)(2, (0.3, 1))",
        "a = deriv(g)(dw=2, dt=(0.3, 1))",
        "a = deriv(h)(0.3)((0.4, 1))",
        "a = deriv(h)((0.3, 1))(0.4)",
        "a = half(0.4)",  # what was given before moves
        "a = still(0.4)",  # nothing moves, but that is not to be seen here
        "a = deriv(render)((0.5, 1), deriv(shader))",
        "a = deriv(render)(0.5, deriv(shader))",  # a shader may move
        "a = deriv(render)(dc=(-2, 1), deriv(shader))",
        "a = deriv(pair)(((0.1, 0.2), (1, 0)))",
        "d = (0.3, 1)\na = deriv(f)(d)",
        "def k(x) deriv(f)(x)",  # x is a dual itself
        "def k(x)\n    y = (x, 1)\n    snd(deriv(f)(y))",
        "def k(d)(t) d(t)\na = k(deriv(f))(0.3)",  # any function
        "for v in [(0.1, 1), (0.2, 1)]:\n    print(df(v))",
    ],
)
def test_what_moves_or_may_move_is_left_alone(text: str) -> None:
    assert said(text) == []


def test_the_paper_is_left_alone() -> None:
    folder = Path(__file__).resolve().parents[2] / "examples"
    world = World([str(folder / "paper")])
    for file in sorted(folder.rglob("*.po")):
        found = world.diagnostics(world.key(str(file)))
        assert not [located for located in found if located.diagnostic.code == "P0615"], file


def test_through_a_module(tmp_path: Path) -> None:
    (tmp_path / "m.po").write_text("def f(t) t^2\ndf = deriv(f)\n")
    (tmp_path / "a.po").write_text("from m import df as slope\nimport m\na = slope(2)\nb = m.df(3)\nc = m.df((3, 1))\n")
    module = potto.load(tmp_path / "a.po")
    helps = [d.help for d in module.diagnostics if d.code == "P0615"]
    assert helps == ["write `slope((2, 1))`", "write `m.df((3, 1))`"]


# At the command line


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    status = main(list(words))
    out, err = capsys.readouterr()
    return status, out, err


def test_at_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "p.po"
    path.write_text("def f(t) t^2\nprint(deriv(f)(3))\n")
    for words in (("run", str(path)), ("eval", str(path), "deriv(f)(3)")):
        status, out, err = run(capsys, *words)
        assert (status, out) == (0, "(9, 0)\n") and err.count("P0615") == 1 and "deriv(f)((3, 1))" in err
    status, out, err = run(capsys, "check", str(path))
    assert status == 0 and (out + err).count("warning[P0615]") == 1
    _, out, _ = run(capsys, "eval", "--json", str(path), "deriv(f)(3)")
    answer = json.loads(out)
    assert answer["tangent"] == 0 and [said["code"] for said in answer["remarks"]] == ["P0615"]
    status, out, err = run(capsys, "eval", str(path), "deriv(f)((3, 1))")
    assert (status, out, err) == (0, "(9, 6)\n", "")


# From Python


@pytest.fixture(scope="module")
def m() -> Any:
    return potto.compile(PROGRAM)


MOTIONLESS: list[Callable[[Any], Any]] = [
    lambda m: potto.deriv(m.f)(0.3),
    lambda m: potto.deriv(m.f)(dt=0.3),
    lambda m: m.df(0.3),
    lambda m: m.same(0.3),
    lambda m: potto.deriv(m.f)(np.linspace(0, 1, 3)),
    lambda m: potto.deriv(m.g)(0.3, np.ones(2)),
    lambda m: potto.deriv(m.g)((0.3, 1)),
    lambda m: potto.deriv(m.h)(0.3)(0.4),
    lambda m: potto.deriv(potto.deriv(m.f))(0.3),
]


@pytest.mark.parametrize("call", MOTIONLESS)
def test_from_python_it_is_an_error(m: Any, call: Callable[[Any], Any]) -> None:
    with pytest.raises(potto.PottoError) as caught:
        call(m)
    (diagnostic,) = caught.value.diagnostics
    assert (diagnostic.code, diagnostic.severity) == ("P0615", "error") and "tangent" in diagnostic.message
    assert "(value, tangent)" in diagnostic.help or "((0.3, 1))" in diagnostic.help or "dt=(0.3, 1)" in diagnostic.help


@pytest.mark.parametrize(
    ("call", "tangent"),
    [
        (lambda m: potto.deriv(m.f)((0.3, 1)), 0.3),
        (lambda m: potto.deriv(m.f)(0.3, 1), 0.3),
        (lambda m: potto.deriv(m.f)((0.3, 0)), 0.0),
        (lambda m: potto.deriv(m.g)((0.3, 1), 2), 0.6),
        (lambda m: potto.deriv(m.g)(0.3, dw=(2, 1)), 0.045),
        (lambda m: m.half(0.4), 0.16),  # by the first of h: c^2
        (lambda m: potto.deriv(m.h)(0.3)((0.4, 1)), 0.24),
        (lambda m: m.still(0.4), 0.0),
        (lambda m: potto.grad(m.f, wrt="t")(0.3), 0.3),
    ],
)
def test_from_python_one_tangent_is_enough(m: Any, call: Callable[[Any], Any], tangent: float) -> None:
    assert call(m).tangent == pytest.approx(tangent, rel=1e-12, abs=1e-15)  # closed forms; rounding
