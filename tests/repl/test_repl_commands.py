"""The commands of the prompt: what each says, and what it says when it is used wrongly."""

from __future__ import annotations

import math
import re
import subprocess
import sys

import pytest
from potto_repl.registry import COMMANDS
from potto_repl.replay import replayed, same

JUMP = "def f(t) integral [0, 1] [x < t] d(x)"
WEIGHTED = "def g(t) integral [0, 1] [x < t]*t^2 d(x)"
PROMISED = [
    "help", "type", "deriv", "eval", "surfaces", "load", "reload", "watch", "edit", "browse", "doc", "explain",
    "source", "set", "method", "time", "error", "check", "plot", "image", "grad", "fit", "save", "record",
    "history", "undo", "reset", "quit",
]  # fmt: skip


def test_every_promised_command_is_there():
    assert set(PROMISED) <= set(COMMANDS)


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_explains_itself(talk, name):
    text = talk(f":help {name}").text
    assert text.startswith(f":{name}") and len(text.splitlines()) >= 3
    assert COMMANDS[name].summary.endswith((".", "`."))


@pytest.mark.parametrize("name", sorted(set(COMMANDS) - {"quit"}))
def test_no_command_breaks_on_nonsense(talk, name):
    for text in ("", "(", "nothing at all", "1 2 3 4 5 6 7", "\\", "f(", ":", "é ∫ \U0001f600"):
        reply = talk(f":{name} {text}".rstrip())
        assert "bug in Potto" not in reply.text, reply.text


def test_abbreviations(talk):
    assert talk(":ty 1").text == talk(":t 1").text == talk(":type 1").text == "1 : Real"
    ambiguous = talk(":so 1")
    assert "could be" not in ambiguous.text  # only :source begins so
    assert "could be" in talk(":re").text and "`:reload`" in talk(":re").text
    assert "did you mean `:type`?" in talk(":tpye 1").text


def test_questions(talk):
    talk("# the length left of t\n" + JUMP)
    assert "the length left of t" in talk("f?").text
    assert "# <In 1>:1" in talk("f??").text and "integral" in talk("f??").text
    assert "square root" in talk("sqrt?").text.lower()
    assert "`:type EXPR`" not in talk(":type?").text and ":type EXPR" in talk(":type?").text
    assert "did you mean `sqrt`?" in talk("sqrtt?").text


def test_type_and_browse(talk):
    talk.all(JUMP, "half = 0.5")
    assert talk(":type deriv(f)").text == "deriv(f) : (dt: (Real, Real)) -> (Real, Real)"
    assert talk(":browse").text.splitlines() == ["f : (t: Real) -> Real", "half : Real"]
    reply = talk(":type f(")
    assert reply.failed and "^" in reply.text


def test_deriv_in_symbols(talk):
    talk(WEIGHTED)
    text = talk(":deriv g").text
    assert "interior" in text and "boundary" in text and "surfaces" in text and "moved by t" in text
    assert ":grad g(0.3)" in talk(":deriv g(0.3)").text
    assert talk(":deriv 3").failed


def test_unicode_is_an_option(talk):
    talk(WEIGHTED)
    assert "∫" in talk(":deriv g").text
    talk(":set unicode off")
    assert talk(":deriv g").text.isascii()


def test_surfaces(talk):
    talk.all(JUMP, "def s(x) x^2")
    assert "x = t" in talk(":surfaces f").text and "moved by t" in talk(":surfaces f").text
    assert "none" in talk(":surfaces s").text


def test_eval_makes_no_entry(talk):
    talk.all(JUMP, "f(0.25)")
    assert talk.data(":eval f(0.5)")["value"] == pytest.approx(0.5, rel=1e-12)
    assert talk.session.number == 2 and talk.data("_")["value"] == pytest.approx(0.25, rel=1e-12)


def test_grad_by_every_number(talk):
    talk("def h(a, b) integral [0, b] a*[x < a] d(x)")  # a^2 for a < b
    data = talk.data(":grad h(0.5, 2)")["gradient"]
    assert data["value"] == pytest.approx(0.25, rel=1e-12)
    assert data["a"] == pytest.approx(1.0, rel=1e-12) and data["b"] == pytest.approx(0.0, abs=1e-12)
    text = talk(":grad h(0.5, 2)").text
    assert "interior 0.5, boundary 0.5" in text
    assert talk(":grad h(b=2, a=0.5)").text.splitlines()[1:-1] == text.splitlines()[1:-1]  # but for the time
    assert talk(":grad h").failed and talk(":grad 3").failed


def test_grad_and_fit_of_what_is_made_of_numbers(talk):
    talk.all(
        "record P(at: (Real, Real), w: Real)", "def h(xs: [n] Real, k, p: P) p.w^2 + (sum x in xs ((x - k)^2))",
        "def least(p: P, u: (Real, Real)) (p.w - 1)^2 + (p.at.x - 2)^2 + p.at.y^2 + u.x^2 + u.y^2",
    )  # fmt: skip
    found = talk.data(":grad h([1, 2, 4], 2, P((0, 0), 3))")["gradient"]
    assert list(found) == ["value", "xs", "k", "p"] and found["value"] == 9 + 5
    assert list(found["xs"]) == [-2, 0, 4] and found["k"] == -2 and tuple(found["p"]) == ((0, 0), 6)
    assert "d/dp = P(at=(0, 0), w=6)" in talk(":grad h([1, 2, 4], 2, P((0, 0), 3))").text.replace("∂/∂", "d/d")
    assert talk(":check h([1, 2, 4], 2, P((0, 0), 3))").text.count("they agree") == 1  # by `k`, the one number
    found = talk(":fit least p=P((0, 0), 3) u=(1, 1)").parts[0].data["parameters"]
    assert found["p"]["w"] == pytest.approx(1, rel=1e-6) and found["p"]["at"][0] == pytest.approx(2, rel=1e-6)
    assert talk(":fit least p=sin u=(1, 1)").failed


def test_grad_of_a_function_that_takes_a_function(talk):
    talk.all("def h(c, s) integral [0, 1] s(x)*[x < c] d(x)", "w = \\x . x")
    assert talk.data(":grad h(0.6, w)")["gradient"]["c"] == pytest.approx(0.6, rel=1e-12)


def test_check_names_the_missed_boundary_term(talk):
    talk(JUMP)
    data = talk.data(":check f(0.3)")["check"]
    assert data["agree"] and data["derivative"] == pytest.approx(1, rel=1e-12)
    assert data["differences"] == pytest.approx(1, rel=1e-9) and data["discretized"] == 0
    text = talk(":check f(0.3)").text
    assert "differentiating the discretized sum gives 0; Potto gives 1" in text
    assert "misses the boundary term" in text


def test_check_of_a_smooth_integral_blames_nobody(talk):
    talk("def h(t) integral [0, 1] sin(t*x) d(x)")
    text = talk(":check h(1)").text
    assert "agree" in text and "misses" not in text


def test_check_in_two_dimensions_and_without_bounds(talk):
    talk("def h(r) integral ([0, 2], [0, 2]) [x^2 + y^2 < r^2] d(x, y)")
    data = talk.data(":check h(1)")["check"]
    assert data["agree"] and data["discretized"] == 0
    assert data["differences"] == pytest.approx(math.pi / 2, rel=1e-6)
    talk("def n(m) integral (x ~ normal(m, 1)) x^2 d(x)")  # m^2 + 1
    data = talk.data(":check n(0.5)")["check"]
    assert data["agree"] and data["derivative"] == pytest.approx(1, rel=1e-9)
    assert data["discretized"] == pytest.approx(1, rel=1e-3)


def test_check_where_numbers_are_small(talk):
    """A step that suits 1 would move 0.02 beyond 0. One variable is the reference evaluator's, two are extrapolated."""
    talk("def touch(a, d) integral [0, pi] [a*sin(t) > d] d(t)")  # pi - 2 asin(d/a)
    talk("def cap(r, h) integral ([0, r], [0, r]) [x^2 + y^2 < r^2]*[x < h] d(x, y)")
    for call, exact in {
        "touch(0.02, 0.01)": 100 / math.sqrt(3),
        "touch(2e-5, 1e-5)": 1e5 / math.sqrt(3),
        "cap(0.002, 0.001)": 0.002 * math.asin(0.5),
    }.items():
        data = talk(f":check {call}").parts[0].data["check"]
        assert data["agree"], call
        assert data["derivative"] == pytest.approx(exact, rel=1e-9)
        assert data["differences"] == pytest.approx(exact, rel=1e-8)


def test_time_has_the_phases(talk):
    talk("def f(t) integral [0, 1] [1.0173*x < t]*exp(0.0131*x) d(x)")  # no other test has left its kernels in memory
    data = talk.data(":time f(0.3)")
    assert list(data["seconds"]) == ["parse", "check", "compile", "link", "plan", "evaluate"]
    assert all(spent >= 0 for spent in data["seconds"].values())
    assert data["stats"]["kernels compiled"] + data["stats"]["kernels from disk"] >= 1
    *_, linked, kernels, computed = talk(":time f(0.3)").text.splitlines()
    assert linked == "0 definitions linked" and kernels.startswith("0 kernels made, 0 from the cache, ")
    assert computed.endswith(" evaluations, by numpy")


def test_error_is_a_work_precision_table(talk):
    talk("def h(t) integral [0, 1] exp(-t*x^2) d(x)")
    table = talk.data(":error h(3)")["table"]
    assert {row["method"] for row in table} == {"quadrature", "mc", "qmc"}
    assert all(row["actual"] <= row["error"] + 1e-15 for row in table if row["method"] == "quadrature")
    talk(WEIGHTED)
    assert "tangent" in talk(":error deriv(g)((0.3, 1))").text


def test_error_in_one_dimension_shows_samples_that_are_better_than_random_ones(talk):
    talk.all("def h(t) integral [0, 1] exp(-t*x^2) d(x)", WEIGHTED)
    for text, steepest in (("h(3)", -1.0), ("g(0.3)", -0.9), ("deriv(g)((0.3, 1))", -0.9)):
        table = talk.data(f":error {text}")["table"]
        rows = {m: [row for row in table if row["method"] == m] for m in ("mc", "qmc")}
        slopes = {
            m: math.log(r[-1]["error"] / r[0]["error"]) / math.log(r[-1]["evals"] / r[0]["evals"])
            for m, r in rows.items()
        }
        assert slopes["qmc"] < steepest < -0.6 < slopes["mc"] < -0.4, (text, slopes)
        assert all(row["actual"] <= row["error"] for row in table if row["method"] == "qmc")
        assert rows["qmc"][-1]["error"] < rows["mc"][-1]["error"] / 20


def test_settings(talk):
    assert "rtol       1e-10" in talk(":set").text
    talk(":set rtol=1e-4")
    assert talk.session.settings.rtol == 1e-4
    talk(":set max-evals 1e6")
    assert talk.session.settings.max_evals == 1_000_000
    assert talk(":method mc").text == "method mc" and talk.session.settings.method == "mc"
    assert "must be" in talk(":set seed -1").text
    assert "did you mean `seed`?" in talk(":set sed 1").text
    assert "one of emacs, vi" not in talk(":set keys vi").text
    assert "is one of" in talk(":set keys nano").text


def test_explain(talk):
    talk("nothing")
    assert talk(":explain").text.startswith("# P0201")
    assert talk(":explain p0301").text.startswith("# P0301")
    assert talk(":explain P9999").failed


def test_undo_and_reset(talk):
    talk.all("a = 1", "a = 2")
    assert "entry 2" in talk(":undo").text
    assert talk.data("a")["value"] == 1
    talk(":reset")
    assert talk("a").failed
    assert talk(":undo").text == "there is nothing to undo"


def test_undo_takes_back_as_many_as_are_asked_for(talk):
    talk.all("a = 1", "b = 2", "c = 3", "a + b")
    lines = talk(":undo 2").text.splitlines()
    assert [line.partition(":")[0] for line in lines] == ["took back entry 3", "took back entry 2"]
    assert talk.data("a")["value"] == 1 and talk("b").failed and talk("_4").failed
    assert talk(":undo x").failed and talk(":undo 0").failed and talk.data("a")["value"] == 1
    assert len(talk(":undo 9").text.splitlines()) == 1 and talk("a").failed


def test_an_entry_with_an_error_is_not_undone(talk):
    talk.all("a = 1")
    talk("b = nothing")
    assert "entry 1" in talk(":undo").text


def test_history(talk):
    talk.all("a = 1", "a + 1", ":type a")
    assert [entry["text"] for entry in talk.data(":history")["history"]] == ["a = 1", "a + 1"]
    assert talk(":history 1").text.split() == ["2", "a", "+", "1"]
    assert "nothing" in talk(":history zzz").text


def test_quit(talk):
    talk(":quit")
    assert talk.session.leaving


# Files


def test_load_and_reload_recompile_what_changed(talk):
    talk.write("a.po", "from b import h\ndef f(t) h(t) + 1\ndef g(t) 5*t")
    talk.write("b.po", "def h(t) 2*t\ndef k(t) 7*t")
    assert "3 names" in talk(":load a.po").text
    assert talk.data("f(3)")["value"] == 7
    assert talk(":reload").text == "nothing has changed"
    talk.write("b.po", "def h(t) 3*t\ndef k(t) 7*t")
    reply = talk(":reload")
    assert re.fullmatch(r"1 of 4 recompiled, \d+ ms\n  h: its text changed", reply.text)
    assert talk.data("f(3)")["value"] == 10


def test_reload_says_why_something_is_recompiled(talk):
    talk.write("a.po", "from b import h\ndef f(t) h(t) + 1\ndef old(t) t")
    talk.write("b.po", "def h(t) 2*t")
    talk(":load a.po")
    talk.write("a.po", "from b import h\ndef f(t) h(t) + 1\ndef fresh(t) t")
    talk.write("b.po", "def h(t) [t > 1]*2*t")  # its users must know of the jump
    data = talk.data(":reload")
    assert data["why"]["h"] == "its text changed" and data["why"]["fresh"] == "it is new"
    assert data["why"]["old"] == "it is gone" and "uses `h`" in data["why"].get("f", "it uses `h`")


def test_loading_again_keeps_the_old_on_an_error(talk):
    talk.write("a.po", "def f(t) 2*t")
    assert "1 of 1 compiled" in talk(":load a.po").text
    talk.write("a.po", "def f(t) 2*")
    reply = talk(":load a.po")
    assert reply.failed and "the earlier definitions are kept" in reply.text
    assert talk.data("f(3)")["value"] == 6


def test_a_broken_file_keeps_its_old_definitions_and_says_so(talk):
    talk.write("a.po", "def f(t) 2*t")
    talk.all(":load a.po")
    talk.write("a.po", "def f(t) 2*")
    reply = talk(":reload")
    assert reply.failed and "a.po: the earlier definitions are kept" in reply.text and "def f(t) 2*" in reply.text
    assert talk.data("f(3)")["value"] == 6
    talk.write("a.po", "def f(t) 4*t")
    assert not talk(":reload").failed
    assert talk.data("f(3)")["value"] == 12


def test_watch_reloads_by_itself(talk):
    talk.write("a.po", "def f(t) 2*t")
    talk.all(":load a.po", ":watch")
    talk.write("a.po", "def f(t) 50*t")
    reply = talk("f(1)")
    assert "1 of 1 recompiled" in reply.text and "50" in reply.text
    talk(":watch off")
    talk.write("a.po", "def f(t) 6*t + 0")
    assert "recompiled" not in talk("f(1)").text


def test_a_file_of_data_that_is_edited(talk):
    talk.write("people.csv", "height\n1\n3\n")
    talk.write("a.po", 'people = load("people.csv")\ndef f(t) integral [0, 2] [x^3 - x < t] d(x)\n')
    assert "P0616" in talk(":load a.po").text
    talk.write("people.csv", "height\n1\n3\n8\n")
    reply = talk(":reload")
    assert re.fullmatch(r"1 of 2 recompiled, \d+ ms\n  people: the file that it loads changed", reply.text)  # no hint
    assert talk.data("sum h in people.height (h)")["value"] == 12
    talk.write("people.csv", "height\n1\n3\nx8\n")
    reply = talk(":reload")
    assert reply.failed and "line 4, column `height`" in reply.text and "of before" not in reply.text
    talk.write("people.csv", "height\n1\n2\n")
    assert not talk(":reload").failed
    assert talk.data("sum h in people.height (h)")["value"] == 3


def test_data_of_an_entry_are_read_again_without_being_asked(talk):
    talk.write("people.csv", "height\n1\n3\n")
    talk.all(f'people = load("{talk.folder / "people.csv"}")', "total = sum h in people.height (h)", "total")
    assert "its columns are named here" in talk("people.hight").text  # of which the text of the file is shown
    talk.write("people.csv", "height\n1\n3\n8\n")
    reply = talk("total")
    assert reply.text.count("people.csv has changed, and is read again") == 1 and "= 12 " in reply.text
    assert "again" not in talk("total").text
    talk.write("people.csv", "height\n1\nx\n")
    assert "line 3, column `height`" in talk("total").text
    talk.write("people.csv", "height\n5\n6\n")
    assert talk.data("total")["value"] == 11


def test_load_says_what_is_wrong(talk):
    talk.write("renderer.po", "def f(t) t")
    assert "did you mean `renderer.po`?" in talk(":load rendrer.po").text
    assert "1 name" in talk(":load renderer").text
    assert talk(":load").failed
    talk.write("wrong.po", "def f(t) nothing")
    assert "P0201" in talk(":load wrong.po").text


def test_edit_needs_a_terminal_and_enters_what_is_saved(talk):
    assert "no terminal" in talk(":edit").text
    talk(JUMP)
    seen = []
    talk.session.edit = lambda text: seen.append(text) or "def f(t) 3*t"
    talk(":edit f")
    assert seen == [JUMP + "\n"] and talk.data("f(2)")["value"] == 6
    talk.session.edit = lambda text: None
    assert "nothing was entered" in talk(":edit").text


def test_record(talk):
    talk.all(":record log.txt", "1 + 1")
    talk("nothing")
    talk(":record off")
    talk("2 + 2")
    text = (talk.folder / "log.txt").read_text()
    assert "po> 1 + 1\n_1 = 2 : Real\n" in text and "P0201" in text and "2 + 2" not in text


def test_a_record_is_replayed(talk):
    talk.all(JUMP, ":record log.txt", "f(0.3)", "def g(t)\n    2*f(t)", "g(0.25)", ":grad g(0.25)", ":time g(0.1)")
    talk.all(":plot g")
    talk("nothing")
    talk(":record off")
    path = talk.folder / "log.txt"
    text = path.read_text()
    assert text.startswith(f"po> {JUMP}\n")  # what was entered before comes first
    found = list(replayed(text))
    assert len(found) == 8 and [difference for _, difference in found if difference is not None] == []
    changed = text.replace("po> def g(t)\n...     2*f(t)", "po> def g(t)\n...     3*f(t)")
    different = [entry.text for entry, difference in replayed(changed) if difference is not None]
    assert different == ["g(0.25)", ":grad g(0.25)", ":plot g"]


@pytest.mark.parametrize(("before", "now", "alike"), [
    ("_1 = 0.3 ± 4e-16 : Real", "_1 = 0.30000000000000004 ± 4e-16 : Real", True),
    ("_1 = 0.31 ± 1.0e-3 : Real", "_1 = 0.3 ± 4e-16 : Real", False),
    ("_1 = 0.30 ± 5.0e-3 : Real", "_1 = 0.304 ± 1.0e-4 : Real", True),
    ("_1 = 3 : Real", "_1 = 4 : Real", False),
    ("quadrature, 12 evaluations, 3 ms", "quadrature, 14 evaluations, 9 ms", True),
    ("f : (t: Real) -> Real", "f : (t: a) -> a", False),
])  # fmt: skip
def test_what_counts_as_the_same_answer(before, now, alike):
    assert same(before, now) is alike


SESSION = [
    JUMP, "f(0.3)", "deriv(f)((0.3, 1))", "_2 * 2", "def f(t) t^2", "f(0.3)", "a = f(2)", "a", "_ + 1",
    "print(a, f(3))", "for v in [1, 2]:\n    print(v)", "\\x . x", "(a, f(0.5))", "def g(t) f(t) + a", "def a(x) x",
    "g(1)",
]  # fmt: skip


def potto(folder, *arguments):
    command = [sys.executable, "-m", "potto", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, check=False)


def test_a_saved_session_is_a_program_whose_live_expressions_hold(talk):
    talk.all(*SESSION)
    saved = talk(":save session.po")
    assert not saved.failed, saved.text
    done = potto(talk.folder, "test", "session.po")
    assert done.returncode == 0, done.stderr + (talk.folder / "session.po").read_text()
    assert "9 live expressions" in done.stdout, (talk.folder / "session.po").read_text()
    text = (talk.folder / "session.po").read_text()
    assert "#> deriv(f_1)((0.3, 1))\n#= (0.3, 1)" in text and "answer_2 = f_1(0.3)" in text
    assert potto(talk.folder, "run", "session.po").stdout.splitlines() == ["4 9", "1", "2"]


def test_a_session_over_a_loaded_file_imports_it(talk):
    talk.write("m.po", "def h(x) 2*x")
    talk.all(":load m.po", "h(2)", ":save session.po")
    assert (talk.folder / "session.po").read_text() == "from m import h\n\n#> h(2)\n#= 4\n"


def test_save_says_what_it_cannot_write(talk):
    assert talk(":save").failed and talk(":save session.txt").failed and talk(":save plot.svg").failed
    talk("1")
    assert "cannot be written" in talk(":save nowhere/session.po").text


# Pictures


def test_plot_draws_the_curve_and_its_derivative(talk):
    talk(WEIGHTED)
    reply = talk(":plot g, deriv g 0 0.9")
    plot = reply.parts[0].data["_picture"]
    assert plot.labels == ("g", "deriv g")
    value, slope = plot.curves
    for t, y, error in zip(value.xs, value.ys, value.errors, strict=True):
        assert abs(y - t**3) <= error + 1e-15 and error < 1e-4
    assert list(slope.ys) == pytest.approx([3 * t**2 for t in slope.xs], abs=1e-4)
    assert not value.breaks and "error at most" in reply.text
    assert any("⠀" <= char <= "⣿" for char in reply.text)
    assert max(map(len, reply.text.splitlines())) <= 80


def test_plot_of_an_expression_over_its_free_name(talk):
    plot = talk(":plot sin(u)/u 1 6").parts[0].data["_picture"]
    assert plot.curves[0].ys[-1] == pytest.approx(math.sin(6) / 6, rel=1e-4) and plot.axis == "u"


def test_plot_is_ascii_where_symbols_are_off(talk):
    talk(":set unicode off")
    assert talk(":plot x^2").text.isascii()


def test_plot_has_holes_where_there_is_no_value(talk):
    plot = talk(":plot sqrt(x) -1 1").parts[0].data["_picture"]
    (curve,) = plot.curves
    assert math.isnan(curve.ys[0]) and curve.ys[-1] == pytest.approx(1, rel=1e-4)
    (piece,) = curve.pieces()
    assert curve.xs[piece[0]] == pytest.approx(0, abs=1e-4)  # it begins where the root has values


def test_plot_shows_a_jump_as_a_jump(talk):
    # t below 0.3, half of it above
    talk("def h(t) (integral [0, 1] [x < t] d(x)) * (if t < 0.3 then 1 else 0.5)")
    reply = talk(":plot h")
    assert not reply.failed, reply.text
    plot = reply.parts[0].data["_picture"]
    ((at, before, after),) = plot.curves[0].jumps
    assert (at, before, after) == pytest.approx((0.3, 0.3, 0.15), abs=1e-3)
    assert "jumps at t = 0.3 (0.3 to 0.15)" in reply.text
    assert "stroke-dasharray" in plot.svg() and len(plot.runs(plot.curves[0])) == 2


def test_plot_shows_a_pole_without_a_line_through_it(talk):
    reply = talk(":plot 1/(x - 0.37)")
    plot = reply.parts[0].data["_picture"]
    assert len(plot.runs(plot.curves[0])) == 2 and "cut off" in reply.text
    low, high = plot.span
    assert -1000 < low < -10 and 10 < high < 1000
    for run in plot.runs(plot.curves[0]):
        assert all(0 <= y <= 1 for _, y in run)


def test_plot_asks_for_more_points_where_the_curve_bends(talk):
    (curve,) = talk(":plot tanh(200*(x - 0.6))").parts[0].data["_picture"].curves
    near = sum(abs(x - 0.6) < 0.02 for x in curve.xs)
    assert near > len(curve.xs) / 3 and len(curve.xs) < 300 and not curve.breaks
    (narrow,) = talk(":plot exp(-((x - 0.5)/0.003)^2)").parts[0].data["_picture"].curves
    assert max(narrow.ys) == 1 and len(narrow.xs) < 400


def test_plot_shows_how_far_samples_may_be_off(talk):
    talk.all(WEIGHTED, ":method mc", ":set samples 400")
    reply = talk(":plot g")
    (curve,) = reply.parts[0].data["_picture"].curves
    assert curve.error > 0.01 and all(abs(y - t**3) <= e for t, y, e in zip(curve.xs, curve.ys, curve.errors))
    assert "<polygon" in reply.parts[0].data["_picture"].svg()


def test_derivative_images(talk):
    talk.all("def h(x, y, c) integral [0, 1] [u < c*x]*y d(u)", "c = 0.5")  # c*x*y: by c it is x*y, by x it is c*y
    for by, slope in (("c", lambda x, y: x * y), ("x", lambda x, y: 0.5 * y), ("y", lambda x, y: 0.5 * x)):
        data = talk(f":image h(x, y, c) by {by} 4").parts[0].data
        assert data["high"] == pytest.approx(slope(0.875, 0.875), rel=1e-4), by
        assert data["low"] == pytest.approx(slope(0.125, 0.125), rel=1e-4), by
    assert "neither an axis" in talk(":image h(x, y, c) by z").text


def test_plot_says_what_it_cannot_draw(talk):
    talk("def h(a, b) a + b")
    for wrong in (":plot", ":plot h", ":plot a*b", ":plot x 1 0"):
        assert talk(wrong).failed, wrong


def test_image_says_what_it_cannot_draw(talk):
    for wrong in ("0", "-5", "2.5", "257", "1 2 3"):
        assert talk(f":image x*y {wrong}").failed, wrong
    assert "`shade` is not defined" in talk(":image shade(x, y)").text
    assert "`curve` is not defined" in talk(":plot curve(x)").text


def test_pictures_are_saved(talk):
    talk.all(":plot x^2 -1 1", ":save plot.svg", ":save plot.png")
    import xml.etree.ElementTree as tree

    root = tree.parse(talk.folder / "plot.svg").getroot()
    assert root.tag.endswith("svg") and any(node.tag.endswith("polyline") for node in root)
    data = (talk.folder / "plot.png").read_bytes()
    assert data.startswith(b"\x89PNG") and data.endswith(b"IEND\xaeB`\x82")


def test_image(talk):
    talk("def h(x, y) [x + y > 1]")
    image = talk(":image h 8").parts[0].data["_picture"]
    light = [[pixel[0] == 255 for pixel in row] for row in image.pixels]  # the first row is the top, y near 1
    assert light == [[(c + 0.5) / 8 + (7.5 - r) / 8 > 1 for c in range(8)] for r in range(8)]
    assert talk(":image x*y 8 -1 1 -1 1").parts[0].data["low"] == pytest.approx(-((7 / 8) ** 2), rel=1e-6)
    colour = talk(":image (x, y, 0.5) 4").parts[0].data["_picture"]
    assert colour.pixels[0][3] == (round(255 * 7 / 8), round(255 * 7 / 8), 128)


# Fitting


def test_fit_finds_the_minimum_through_a_boundary_term(talk):
    talk.all(JUMP, "def loss(t) (f(t) - 0.25)^2")
    data = talk(":fit loss t=0.9").parts[0].data
    assert data["parameters"]["t"] == pytest.approx(0.25, abs=1e-6) and data["converged"]


def test_fit_of_an_expression_over_its_free_names(talk):
    data = talk(":fit (x - 2)^2 + exp(y) + y^2 x=1, y=3").parts[0].data
    assert data["parameters"] == pytest.approx({"x": 2, "y": -0.35173371124919584}, abs=1e-6)  # exp(y) = -2y


def test_fit_of_two_numbers_with_one_fixed(talk):
    talk("def rosenbrock(a, b, k) (1 - a)^2 + k*(b - a^2)^2")
    reply = talk(":fit rosenbrock a=-1.2, b=1 with k=100")
    data = reply.parts[0].data
    assert "log10 rosenbrock from step to step" in reply.text and talk(":save loss.svg").text.startswith("loss.svg")
    assert data["parameters"] == pytest.approx({"a": 1, "b": 1}, abs=1e-5)
    assert talk(":fit rosenbrock").failed and talk(":fit rosenbrock z=1").failed
