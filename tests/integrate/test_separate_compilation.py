"""A definition is compiled alone: swapping a shader compiles the shader, swapping it back compiles nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import potto
from potto.calculus.algebra import degree
from potto.calculus.inlining import expand
from potto.calculus.surfaces import discontinuities
from potto.calculus.surfaces.domains import ends_of_domain
from potto.core import binders, packing
from potto.core.terms import Term, rebuild
from potto.integrate import plan
from potto.integrate.fixed.steps import step_integral
from potto.integrate.outline import Outline, outlined
from potto.kernels import compile as kernels
from potto.kernels.written import Written
from potto.runtime.integration import settled_calls

RENDERER = """
def renderer(c, shader)
    integral ([0, 1], [0, 1]) shader (x, y) c*[x + y + c >= 0] d(x, y)
"""
FIRST = "def shader(x, y)(c) 1/(x + y + c + 2)\n"
SECOND = "def shader(x, y)(c) exp(-x*y)*(c + 2)\n"


@pytest.fixture(autouse=True)
def nothing_on_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POTTO_CACHE", "off")


def workspace(folder: Path) -> potto.Workspace:
    (folder / "renderer.po").write_text(RENDERER)
    (folder / "shaders.po").write_text(FIRST)
    return potto.Workspace(folder)


def swap(ws: potto.Workspace, folder: Path, text: str) -> potto.Estimate:
    (folder / "shaders.po").write_text(text)
    ws.reload()
    return potto.deriv(ws.module("renderer").renderer)((-0.7, 1.0), potto.deriv(ws.module("shaders").shader))


def compiled(ws: potto.Workspace, folder: Path, text: str) -> int:
    return int(swap(ws, folder, text).stats["kernels compiled"])


def test_swapping_a_shader_compiles_the_shader_alone(tmp_path: Path) -> None:
    kernels.clear()
    ws = workspace(tmp_path)
    assert compiled(ws, tmp_path, FIRST) > 0
    # One kernel, for its values and tangents where the renderer calls it; nothing of the renderer's cuts and bounds.
    assert compiled(ws, tmp_path, SECOND) == 1
    assert compiled(ws, tmp_path, FIRST) == 0
    assert compiled(ws, tmp_path, SECOND) == 0


def swapped_under(conditions: int, looked_at: Callable[[], int]) -> int:
    """How much more was looked at when a second shader took the place of a first one under so many conditions."""
    steps = " + ".join(f"[x < {k}/{conditions + 1}*t]" for k in range(1, conditions + 1))
    m = potto.compile(f"def f(t, shader) integral [0, 1] shader x*({steps}) d(x)\na = \\x . 1 + x\nb = \\x . 2 + x*x")
    with potto.settings(backend="numpy"):
        m.f(0.9, m.a)
        before = looked_at()
        found = m.f(0.9, m.b)
    at = 0.9 * np.arange(1, conditions + 1) / (conditions + 1)
    assert abs(found.value - (2 * at + at**3 / 3).sum()) < 1e-14 * conditions  # sums of numbers up to 2, in doubles
    return looked_at() - before


def test_where_surfaces_are_defined_is_found_once_for_all_shaders() -> None:
    assert swapped_under(23, lambda: len(ends_of_domain.known.found)) == 0


def test_what_holds_no_call_is_not_rebuilt_for_another_shader(monkeypatch: pytest.MonkeyPatch) -> None:
    rebuilt: list[Term] = []

    def counted(node: Term, parts: tuple[Term, ...]) -> Term:
        rebuilt.append(node)
        return rebuild(node, parts)

    monkeypatch.setattr(expand, "rebuild", counted)
    assert 0 < swapped_under(44, lambda: len(rebuilt)) <= 4  # the call and the product that it stands in, at each look


@pytest.mark.parametrize(
    "conditions, room, name, most",  # each a number of its own: plans are known in all of a process
    [
        (46, binders, "bound_names", 0),  # there are none in it
        (47, degree, "_node", 6),  # of the shader's body and the product that it stands in
        (48, packing._Writer, "fields", 0),  # the outline's bytes are those of the first
        (49, discontinuities, "centers", 4),  # of the shader's builtins
        (50, step_integral, "affine", 0),  # where surfaces cut is known
        (51, step_integral, "mul", 0),  # so are the heights of the steps
    ],
)
def test_what_another_shader_leaves_as_it_was_is_not_looked_through(
    conditions: int, room: Any, name: str, most: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    looked_at = []
    known = getattr(room, name)

    def counted(*given: Any) -> Any:
        if not isinstance(given[-1], Written):  # kernels are the shader's own
            looked_at.append(given)
        return known(*given)

    monkeypatch.setenv("POTTO_CACHE", str(tmp_path))
    monkeypatch.setattr(room, name, counted)
    assert swapped_under(conditions, lambda: len(looked_at)) <= most


def test_a_separately_compiled_renderer_gives_the_same_as_one_written_out(tmp_path: Path) -> None:
    ws = workspace(tmp_path)
    apart = swap(ws, tmp_path, SECOND)
    whole = potto.deriv(
        potto.compile("def f(c) integral ([0, 1], [0, 1]) exp(-x*y)*(c + 2)*[x + y + c >= 0] d(x, y)").f
    )((-0.7, 1.0))
    assert abs(apart.value - whole.value) <= 1e-15 and abs(apart.tangent - whole.tangent) <= 1e-14


def test_a_jump_inside_a_callee_is_forced_through_its_trace() -> None:
    # int_0^1 s(t x) dx with s(u) = [u > 1/2]: 1 - 1/(2 t); derivative 1/(2 t^2). Twice in one integrand, once squared.
    m = potto.compile("""
def step(u) [u > 0.5]
def f(t) integral [0, 1] step (t*x) d(x)
def g(t) integral [0, 1] (step (t*x) + step (t*x)^2)*step (x + 1) d(x)
""")
    for f, factor in ((m.f, 1.0), (m.g, 2.0)):
        r = potto.deriv(f)((0.8, 1.0))
        assert abs(r.value - factor * (1 - 0.625)) < 1e-15
        assert abs(r.tangent - factor / (2 * 0.64)) < 1e-14


PIXELS = """
def given(u, v, c, shader) integral ([u, u + 1/16], [v, v + 1/16]) shader (x, y) c*[x + y + c >= 0] d(x, y)
def inlined(u, v, c) integral ([u, u + 1/16], [v, v + 1/16]) 1/(x + y + c + 2)*[x + y + c >= 0] d(x, y)
def first(x, y)(c) 1/(x + y + c + 2)
def second(x, y)(c) exp(-x*y)*(c + 2)
"""


def test_pixels_of_a_shader_given_take_the_short_way_as_those_of_one_written_out() -> None:
    with potto.settings(backend="numpy"):  # machine code takes over by the clock, and is looked at in other ways
        _take_the_short_way()


def _take_the_short_way() -> None:
    kernels.clear()
    m, (u, v) = potto.compile(PIXELS), np.meshgrid(np.arange(16) / 16, np.arange(16) / 16)
    whole = potto.deriv(m.inlined)((u, 0.0), (v, 0.0), (-0.7, 1.0))
    apart = potto.deriv(m.given)((u, 0.0), (v, 0.0), (-0.7, 1.0), potto.deriv(m.first))
    assert apart.evals == whole.evals
    assert np.allclose(apart.value, whole.value, rtol=0, atol=1e-17)
    assert np.allclose(apart.tangent, whole.tangent, rtol=0, atol=1e-16)
    # Swapped: a kernel for uncut pixels and two for those that are cut, whose nodes move, as rounding is followed at
    # some of them (all cut pixels are one group of more than 4,096 nodes), and the name's own.
    for shader, most in ((m.second, 4), (m.first, 0)):
        found = potto.deriv(m.given)((u, 0.0), (v, 0.0), (-0.7, 1.0), potto.deriv(shader))
        assert int(found.stats["kernels compiled"]) <= most


def test_a_smooth_shader_finds_bounds_and_cuts_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    outlines: list[Outline] = []

    def noted(*args: Any) -> Outline:
        outlines.append(outlined(*args))
        return outlines[-1]

    monkeypatch.setattr(plan, "outlined", noted)
    m = potto.compile("""
def f(t, shader) integral [0, 1] shader x*[x < t] d(x)
first = \\x . 2*x
second = \\x . 3*x^2
jumping = \\x . [x < 0.2]
""")
    assert [float(m.f(0.5, shader)) for shader in (m.first, m.second)] == pytest.approx([0.25, 0.125], abs=1e-15)
    assert len(outlines) == 1
    assert float(m.f(0.5, m.jumping)) == pytest.approx(0.2, abs=1e-15)
    assert len(outlines) == 2


def test_an_answer_is_worked_out_twice_at_its_first_call_and_then_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once in the general way, and once as calls near it are answered, which must come to the same."""
    answered: list[float] = []
    at = settled_calls.SteppedCall.at

    def counted(self: settled_calls.SteppedCall, env: Any) -> Any:
        answered.append(env["t"].v)
        return at(self, env)

    monkeypatch.setattr(settled_calls.SteppedCall, "at", counted)
    m = potto.compile(
        "def f(t) integral [0, 1] exp(x)*(" + " + ".join(f"[x < {k}/53*t]" for k in range(1, 53)) + ") d(x)"
    )
    exact = np.expm1(0.9 * np.arange(1, 53) / 53).sum()
    for times in (2, 3, 4):
        found = m.f(0.9)
        assert abs(found.value - exact) <= found.error + 1e-13
        assert len(answered) == times and found.stats["evaluations"] == found.evals > 0
