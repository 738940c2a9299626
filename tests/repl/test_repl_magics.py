"""Potto in a Python notebook: the magics in IPython's own shell, and sliders."""

from __future__ import annotations

import math

import pytest

import potto

pytest.importorskip("IPython")


@pytest.fixture
def shell(tmp_path, monkeypatch):
    from IPython.core.interactiveshell import InteractiveShell

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    shell = InteractiveShell()
    shell.run_cell("%load_ext potto", store_history=True).raise_error()
    yield shell
    shell.history_manager.end_session()


def run(shell, text):
    done = shell.run_cell(text, store_history=True)
    done.raise_error()
    return done.result


def test_a_cell_defines_functions_for_python_and_returns_the_last(shell):
    f = run(shell, "%%potto\ndef wide(t) 2*t\ndef f(t)\n    integral [0, 1] [x < t] d(x)\n")
    assert isinstance(f, potto.Function) and f.__name__ == "f"
    assert float(run(shell, "f(0.3) + wide(1)")) == pytest.approx(2.3, abs=1e-12)
    assert float(run(shell, "import potto\npotto.grad(f)(0.3).tangent")) == pytest.approx(1, abs=1e-12)


def test_later_cells_see_earlier_ones(shell):
    run(shell, "%%potto\ndef f(t) t^2")
    assert float(run(shell, "%%potto\ndef g(t) f(t) + 1\ng(3)")) == 10
    assert float(run(shell, "g(2)")) == 5


def test_a_line_is_an_answer_or_a_function(shell):
    run(shell, "%%potto\ndef f(t) integral [0, 1] [x < t] d(x)")
    assert float(run(shell, "%potto D(f)(0.3)")) == pytest.approx(1, abs=1e-12)
    run(shell, "square = %potto \\t . f(t)^2")
    assert float(run(shell, "square(0.5)")) == pytest.approx(0.25, abs=1e-12)
    run(shell, "t = 0.2")
    assert float(run(shell, "%potto f({t})")) == pytest.approx(0.2, abs=1e-12)


def test_what_belongs_to_python_or_to_the_prompt_is_told(shell):
    shell.run_cell("t = 0.2", store_history=True)
    with pytest.raises(potto.PottoError, match=r"`t` is a name of Python: `\{t\}` is its value"):
        run(shell, "%potto t + 1")
    with pytest.raises(potto.PottoError, match=r"`:plot` is a command"):
        run(shell, "%potto :plot t")


def test_an_answer_has_the_number_of_its_cell(shell):
    run(shell, "%potto 2 + 3")
    number = shell.execution_count - 1
    assert float(run(shell, f"%potto 2*_{number}")) == 10


def test_errors_name_the_cell_and_show_no_traceback(shell, capsys):
    done = shell.run_cell("%%potto\ndef f(t)\n    t + oops\n", store_history=True)
    assert isinstance(done.error_in_exec, potto.PottoError)
    said = capsys.readouterr()
    text = said.out + said.err
    assert f"<In {shell.execution_count - 1}>:3:9" in text and "P0201" in text and "Traceback" not in text


def test_sliders_show_a_value_and_its_slopes():
    pytest.importorskip("ipywidgets")
    f = potto.compile("def f(t, a) integral [0, 1] a*[x < t] d(x)").f
    box = potto.sliders(f, t=(0, 1), a=(1, 2, 1.5))
    t, a, shown = box.children
    assert (t.value, a.value) == (0.5, 1.5) and "0.7500000" in shown.value and "by a" in shown.value
    t.value = 0.25
    assert "0.375000" in shown.value


def test_sliders_draw_curves_and_images():
    pytest.importorskip("ipywidgets")
    m = potto.compile("def disc(x, y, r) [x^2 + y^2 < r^2]*1\ndef area(r, s) s*r^2")
    *moved, shown = potto.sliders(m.area, axes=["r"], r=(0, 1), s=(1, 2)).children
    before = shown.value
    assert [slider.description for slider in moved] == ["s"] and before.startswith("<svg")
    moved[0].value = 2
    assert shown.value != before
    *moved, shown = potto.sliders(m.disc, axes=["x", "y"], x=(0, 1), y=(0, 1), given={"r": 0.5}).children
    assert moved == [] and "data:image/png" in shown.value
    assert math.isclose(float(m.disc(0.3, 0.3, 0.5)), 1)


@pytest.mark.parametrize(
    ("ranges", "said"),
    [
        ({"t": (0, 1)}, "`a` has no range"),
        ({"t": 3, "a": (0, 1)}, "the range of `t` is a pair"),
        ({"t": (1, 0), "a": (0, 1)}, "the smaller first"),
        ({"t": (0, 1), "a": (0, 1), "q": (0, 1)}, "`q` is not a parameter"),
    ],
)
def test_sliders_say_what_is_missing(ranges, said):
    pytest.importorskip("ipywidgets")
    f = potto.compile("def f(t, a) a*t").f
    with pytest.raises(potto.PottoError, match=said):
        potto.sliders(f, **ranges)
