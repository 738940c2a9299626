"""The Python interface: modules, calls, arrays, derivatives, settings, threads, and what is said of wrong arguments."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import potto

PAPER = Path(__file__).resolve().parents[2] / "examples" / "paper"
LENGTH = "def f(t)\n    integral [0, 1] [x < t] d(x)\n"
QUAD = r"shader = \(x, y) . c . 1/(sqrt(2)*(x+y+c)+2)^2"

# mpmath, 30 digits: the integral over s = x + y with its density s, 2 - s (see examples/demo.py for the closed form)
VALUE, SLOPE = 0.113903865769439, 0.0455890722835269


@pytest.fixture(scope="module")
def renderer() -> Any:
    return potto.Workspace(PAPER).module("renderer").renderer


@pytest.fixture(scope="module")
def shader() -> Any:
    return potto.compile(QUAD).shader


def refused(code: str, action: Callable[[], Any]) -> potto.PottoError:
    with pytest.raises(potto.PottoError) as caught:
        action()
    assert caught.value.diagnostics and all(d.code.startswith(code) for d in caught.value.diagnostics), caught.value
    return caught.value


# Calls


def test_a_call_gives_an_estimate(renderer: Any, shader: Any) -> None:
    r = renderer(-0.7, shader)
    assert isinstance(r, potto.Estimate)
    assert math.isclose(float(r), VALUE, rel_tol=1e-10) and r.value == float(r)  # the accuracy asked for by default
    assert abs(r.value - VALUE) <= r.error + 1e-15 and r.converged and r.evals > 0 and r.tangent is None


def test_keywords_bind_by_name_in_any_place(renderer: Any, shader: Any) -> None:
    value = renderer(-0.7, shader).value
    assert renderer(shader=shader, c=-0.7).value == value
    assert renderer(shader, c=-0.7).value == value


def test_groups_may_be_given_one_by_one_or_together(shader: Any) -> None:
    value = 1 / (math.sqrt(2) * 0.6 + 2) ** 2
    for r in (shader(0.1, 0.2)(0.3), shader((0.1, 0.2))(0.3), shader(0.1, 0.2, 0.3), shader(x=0.1, y=0.2)(c=0.3)):
        assert math.isclose(r.value, value, rel_tol=1e-14)
    assert shader(0.1, 0.2).type == "(c: Real*) -> Real"


def test_a_partial_application_is_an_argument() -> None:
    m = potto.compile("def add(a)(b) a + b\ndef twice(g, x) g(g(x))\n")
    assert m.twice(m.add(3), 1).value == 7.0


def test_functions_of_other_texts_are_arguments_with_what_they_need(renderer: Any) -> None:
    other = potto.compile("def helper(s) 1/(sqrt(2)*s+2)^2\nshader = \\(x, y) . c . helper(x + y + c)\n")
    assert math.isclose(renderer(-0.7, other.shader).value, VALUE, rel_tol=1e-10)


@pytest.mark.parametrize("number", [3, np.float32(3), np.int64(3), np.array(3.0), Fraction(3)])
def test_numbers_of_every_kind(number: Any) -> None:
    assert potto.compile("def g(x) x^2").g(number).value == 9.0


def test_tuples_lists_and_answers_are_arguments() -> None:
    m = potto.compile("def g(p, k) fst(p)*k + snd(p)\ndef f(t)\n    integral [0, 1] [x < t] d(x)\n")
    assert m.g((2, 3), 10).value == 23.0
    assert m.g((2, 3), m.f(0.5)).value == 4.0


def test_tuples_come_out_as_tuples() -> None:
    r = potto.compile("def g(x) (x, x^2, 1/3)").g(3)
    assert r.value == (3.0, 9.0, 1 / 3) and all(type(v) is float for v in r.value)


# Arrays


def test_arrays_broadcast(renderer: Any, shader: Any) -> None:
    cs = np.linspace(-1.5, -0.1, 7)
    r = renderer(cs, shader)
    assert r.value.shape == r.error.shape == (7,)
    for c, value in zip(cs, r.value, strict=True):
        assert math.isclose(renderer(float(c), shader).value, value, rel_tol=1e-10)


def test_shapes_of_several_arrays() -> None:
    two = potto.compile("def two(x, y) x - 2*y").two
    x, y = np.arange(3.0).reshape(3, 1), np.arange(4.0)
    np.testing.assert_array_equal(two(x, y).value, x - 2 * y)
    assert two(np.zeros((0, 2)), 1).value.shape == (0, 2)
    assert two(np.arange(3), 1).value.dtype == np.float64
    refused("P0509", lambda: two(np.zeros(3), np.zeros(4)))


def test_answers_that_do_not_vary_have_the_shape_all_the_same() -> None:
    r = potto.compile("def one(x) 1").one(np.zeros((2, 2)))
    assert r.value.shape == r.error.shape == (2, 2) and (r.value == 1).all()


def test_an_array_may_be_strided_or_of_float32() -> None:
    g = potto.compile("def g(x) x^2").g
    np.testing.assert_array_equal(g(np.arange(10.0)[::-2]).value, np.arange(10.0)[::-2] ** 2)
    np.testing.assert_allclose(g(np.float32([1, 2])).value, [1, 4])


# Derivatives


def test_deriv_takes_duals(renderer: Any, shader: Any) -> None:
    r = potto.deriv(renderer)((-0.7, 1.0), potto.deriv(shader))
    assert math.isclose(r.value, VALUE, rel_tol=1e-10) and math.isclose(r.tangent, SLOPE, rel_tol=1e-10)
    assert abs(r.tangent - SLOPE) <= r.tangent_error + 1e-15
    again = potto.deriv(renderer)(dc=(-0.7, 2.0), dshader=potto.deriv(shader))
    assert math.isclose(again.tangent, 2 * SLOPE, rel_tol=1e-10)


def test_deriv_over_arrays(renderer: Any, shader: Any) -> None:
    cs = np.array([-0.7, -0.7, -1.2])
    r = potto.deriv(renderer)((cs, 1.0), potto.deriv(shader))
    assert r.tangent.shape == (3,)
    np.testing.assert_allclose(r.tangent[:2], SLOPE, rtol=1e-10)


def test_grad_names_its_parameters(renderer: Any, shader: Any) -> None:
    r = potto.grad(renderer, wrt=["c"])(c=-0.7, shader=shader)
    assert math.isclose(r.tangent, SLOPE, rel_tol=1e-10) and r["c"] == r.tangent
    assert math.isclose(r.value, VALUE, rel_tol=1e-10)


def test_grad_by_several_parameters_and_by_tuples() -> None:
    g = potto.compile("def g(p, s) fst(p)*s + snd(p)^2").g
    r = potto.grad(g, wrt=["p", "s"])((1, 2), 3)
    assert r.value == 7.0 and r.tangent == ((3.0, 4.0), 1.0) and r["s"] == 1.0
    with pytest.raises(KeyError):
        r["q"]


def test_grad_over_arrays() -> None:
    f = potto.compile("def f(a, t)\n    integral [0, 1] a*[x < t] d(x)\n").f
    ts = np.array([0.2, 0.5, 2.0])
    r = potto.grad(f, wrt=["a", "t"])(3.0, ts)  # f = 3 min(t, 1)
    np.testing.assert_allclose(r["a"], [0.2, 0.5, 1.0], rtol=1e-12)
    np.testing.assert_allclose(r["t"], [3.0, 3.0, 0.0], rtol=1e-12, atol=1e-15)


# What can be asked


def test_types_surfaces_and_representations(renderer: Any) -> None:
    assert renderer.type == "(c: Real, shader: (Real*, Real*) -> Real -> Real) -> Real"
    assert potto.deriv(renderer).type.startswith("(dc: (Real, Real)")
    assert renderer.surfaces == ("x + y + c = 0",)
    assert repr(renderer) == f"<Potto function renderer : {renderer.type}>"
    assert "deriv(renderer)" in repr(potto.deriv(renderer))


def test_modules(tmp_path: Path) -> None:
    (tmp_path / "pkg").mkdir()
    (tmp_path / "pkg" / "m.po").write_text("k = 0.5\nl = [1, 2]\ndef f(x) x + k\n")
    (tmp_path / "user.po").write_text("from pkg.m import f\nimport pkg.m as inner\ndef g(x) 2*f(x)\n")
    ws = potto.Workspace(tmp_path)
    m = ws.module("pkg.m")
    assert dir(m) == ["f", "k", "l"] and float(m.k) == 0.5 and m.l.value.tolist() == [1.0, 2.0]
    user = ws.module("user")
    assert user.g(1).value == 3.0 and user.f(1).value == 1.5 and user.inner.f(1).value == 1.5
    assert "user.po" in repr(user) and user.eval("g(2)").value == 5.0
    with pytest.raises(AttributeError, match="defines no `gg`; did you mean `g`"):
        _ = user.gg
    assert not hasattr(user, "nothing_like_it")
    refused("P0202", lambda: ws.module("nope"))


def test_reload_sees_new_texts(tmp_path: Path) -> None:
    (tmp_path / "m.po").write_text("def f(x) x\n")
    ws = potto.Workspace(tmp_path)
    f = ws.module("m").f
    assert f(2).value == 2.0 and not ws.reload()
    (tmp_path / "m.po").write_text("def f(x) x + 40\n")
    assert f(2).value == 2.0
    assert ws.reload() and f(2).value == 42.0


def test_load_and_compile(tmp_path: Path) -> None:
    (tmp_path / "m.po").write_text(LENGTH)
    assert math.isclose(potto.load(tmp_path / "m.po").f(0.25).value, 0.25, rel_tol=1e-14)
    g = potto.Workspace(tmp_path).compile("from m import f\ndef g(t) f(t)/2").g
    assert g(0.5).value == pytest.approx(0.25, rel=1e-15, abs=0)


# Settings


def test_a_text_that_was_compiled_before_is_not_checked_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "def half(t) integral [0, 1] [x < t]*0.5 d(x)\ndef twice(f) 2*f(0.5)"
    first = potto.compile(text)
    assert first.half(0.25).value == 0.125
    second = potto.compile(text)
    with second._world.db.recording() as events:
        assert second.half(0.25).value == 0.125
        assert potto.compile(text).twice(first.half).value == 0.5
    assert not [e for e in events if e.kind == "executed" and e.query in ("parsed", "check_definition")]
    assert second._world.program is not first._world.program  # what it evaluates is its own
    del first
    assert second.twice(potto.compile("def g(t) t").g).value == 1.0

    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.po").write_text("a = 1\n")
    importing = "from part import a\ndef f(t) a*t"
    assert potto.compile(importing).f(2.0).value == 2.0
    (tmp_path / "part.po").write_text("a = 30\n")
    assert potto.compile(importing).f(2.0).value == 60.0  # what is on disk may be another text by now

    assert potto.compile(text).half(0.25).converged
    (tmp_path / "potto.toml").write_text('[settings]\nmethod = "mc"\n')
    assert "mc" in potto.compile(text).half(0.25).method  # and the project another one


def test_settings_hold_inside_their_block(renderer: Any, shader: Any) -> None:
    with potto.settings(method="mc", samples=2_000, seed=7):
        first, second = renderer(-0.7, shader), renderer(-0.7, shader)
    with potto.settings(method="mc", samples=2_000, seed=8):
        other = renderer(-0.7, shader)
    assert first.method == "mc" and first.value == second.value != other.value
    assert abs(first.value - VALUE) < 6 * first.error
    assert renderer(-0.7, shader).method == "quadrature"


@pytest.mark.parametrize(
    "wrong", [{"method": "best"}, {"rtol": -1}, {"samples": 0}, {"seed": 1.5}, {"nope": 1}, {"rtol": math.nan}]
)
def test_settings_that_cannot_be(wrong: dict[str, Any]) -> None:
    def enter() -> None:
        with potto.settings(**wrong):
            pass

    refused("P0520", enter)


def test_settings_belong_to_their_thread() -> None:
    f = potto.compile(LENGTH).f
    with ThreadPoolExecutor(1) as pool, potto.settings(method="mc"):
        assert pool.submit(lambda: f(0.3).method).result() == "quadrature"


# What is wrong


@pytest.mark.parametrize("argument", ["0.5", None, True, 1j, object(), {}, np.array(["a"]), np.array([True]), 10**400])
def test_python_values_without_a_meaning(argument: Any) -> None:
    error = refused("P0523", lambda: potto.compile(LENGTH).f(argument))
    assert "`t`" in error.diagnostics[0].message


def test_arguments_that_do_not_fit(renderer: Any, shader: Any) -> None:
    refused("P0509", lambda: renderer(shader, 0.1))
    refused("P0509", lambda: renderer((1, 2), shader))
    refused("P0509", lambda: renderer(0.1))
    refused("P0308", lambda: renderer(0.1, shader, 3))
    assert "did you mean `shader`" in str(refused("P0310", lambda: renderer(0.1, shade=shader)))
    refused("P0509", lambda: potto.deriv(3))  # type: ignore[arg-type]
    refused("P0509", lambda: potto.grad(renderer, wrt=["d"]))
    refused("P0509", lambda: potto.grad(renderer, wrt=["shader"])(0.1, shader))
    refused("P0509", lambda: potto.compile(3))  # type: ignore[arg-type]


def test_calls_that_leave_something_out(renderer: Any, shader: Any) -> None:
    refused("P0509", lambda: shader())
    refused("P0509", lambda: shader(1)(2))
    refused("P0509", lambda: shader((1, 2, 3))(2))
    refused("P0509", lambda: potto.grad(renderer, wrt=[]))
    assert "`shader`" in str(refused("P0509", lambda: renderer(0.1)))


def test_a_derivative_is_given_derivatives(renderer: Any, shader: Any) -> None:
    error = refused("P0509", lambda: potto.deriv(renderer)((-0.7, 1.0), shader))
    assert "potto.deriv" in error.diagnostics[0].message
    # a plain number for a dual has tangent 0
    assert potto.deriv(renderer)(-0.7, potto.deriv(shader)).tangent == 0.0


def test_programs_that_are_wrong() -> None:
    error = refused("P0301", lambda: potto.compile("def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)\n"))
    assert "^^^^^" in str(error) and "P0301" in str(error)
    refused("P02", lambda: potto.load("/no/such/file.po"))
    refused("P0503", lambda: potto.compile("def f(n) if n > 0 then f(n + 1) else 0").f(1))


# Threads


def test_many_threads_at_once(renderer: Any, shader: Any) -> None:
    cs = [-1.6 + 0.05 * n for n in range(24)]
    alone = [renderer(c, shader).value for c in cs]
    fresh = potto.Workspace(PAPER).module("renderer").renderer  # nothing of it is compiled yet

    def work(c: float) -> float:
        return float(potto.deriv(fresh)((c, 1.0), potto.deriv(shader)).value)

    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(work, cs))
    np.testing.assert_allclose(together, alone, rtol=1e-10)


def test_a_module_that_is_broken_in_part_warns_and_can_be_used() -> None:
    with pytest.warns(potto.ProgramWarning, match="P0201"):
        module = potto.compile("def f(x) x + missing\ndef g(x) 2*x\ndef h(x) f(x)\n")
    assert module.g(3.0).value == 6.0
    assert [d.code for d in module.diagnostics] == ["P0201"]
    for use in (lambda: module.f, lambda: module.h, lambda: module.eval("h(1)")):
        with pytest.raises(potto.PottoError) as caught:
            use()
        assert [d.code for d in caught.value.diagnostics] == ["P0201"]


def test_warnings_name_the_place_that_loads(tmp_path: Path) -> None:
    text = "def f(x) x + missing\ndef g(x) 2*x\n"
    (tmp_path / "part.po").write_text(text)
    workspace = potto.Workspace(tmp_path)
    for load in (lambda: potto.compile(text), lambda: potto.load(tmp_path / "part.po"), lambda: workspace.compile(text),
                 lambda: workspace.load("part.po"), lambda: workspace.module("part")):  # fmt: skip
        with pytest.warns(potto.ProgramWarning) as caught:
            load()
        assert [warning.filename for warning in caught] == [__file__]


def test_a_module_of_nothing_but_errors_is_an_error() -> None:
    with pytest.raises(potto.PottoError):
        potto.compile("def f(x) x + missing\n")


def test_a_workspace_needs_its_folder(tmp_path: Path) -> None:
    for root, said in ((tmp_path / "nowhere", "does not exist"), (Path(__file__), "is a file, not a folder")):
        with pytest.raises(potto.PottoError, match=said):
            potto.Workspace(root)
        with pytest.raises(potto.PottoError, match=said):
            potto.Workspace(tmp_path, roots=[root])


def test_a_delta_of_a_declared_diffeomorphism_is_integrated_out() -> None:
    """The length of x + y = -c in the unit square, over the gradient sqrt(2): that is -c for c in [-1, 0]."""
    module = potto.compile(
        "diffeo cond(x, y; c) = (x + y + c, x - y + c)\n"
        "def f(c) integral ([0, 1], [0, 1]) delta(cond (x, y) c) d(x, y)\n"
    )
    assert module.f(-0.7).value == pytest.approx(0.7, rel=1e-12)
    assert potto.grad(module.f, wrt="c")(-0.7).tangent == pytest.approx(-1.0, rel=1e-12)
