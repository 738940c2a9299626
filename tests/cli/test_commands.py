"""What each command answers, where, and with which status."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from command_runs import Potto

from potto import store
from potto.cli import COMMANDS

HALF = "def f(t)\n    integral [0, 1] [x < t] d(x)\n"
WRONG = "def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)\n"


def test_run_prints_values_and_duals(potto: Potto) -> None:
    ran = potto("run", "main.po", main=HALF + "print(f(0.25), deriv(f)((0.25, 1)))\nf(0.5)\n")
    assert (ran.status, ran.out, ran.err) == (0, "0.25 (0.25, 1)\n0.5\n", "")


def test_an_error_spoils_the_statements_that_need_it_only(potto: Potto) -> None:
    ran = potto("run", "main.po", main=f"print(1)\nprint(f(1) + 1)\n{WRONG}print(2 + nothing)\nprint(3)\n")
    assert ran.status == 1 and ran.out == "1\n3\n"
    assert ran.err.count("error[P0301]") == 1 and ran.err.count("error[P0201]") == 1
    assert "`f` is broken by this; it is needed here" in ran.err


def test_run_shows_errors_that_no_statement_meets(potto: Potto) -> None:
    ran = potto("run", "main.po", main="print(1)\n" + WRONG)
    assert ran.status == 1 and ran.out == "1\n"
    assert ran.err.startswith("error[P0301]: ") and "\n --> main.po:3:25\n" in ran.err


def test_run_shows_what_came_before_an_error_of_evaluation(potto: Potto) -> None:
    ran = potto("run", "main.po", main="def f(n) if n > 0 then f(n + 1) else 0\nprint(1)\nprint(f(1))\nprint(2)\n")
    assert ran.status == 1 and ran.out == "1\n"
    assert "P0503" in ran.err and "main.po:3:7" in ran.err


def test_loops_and_names_in_them(potto: Potto) -> None:
    program = "def g(s, x) s(x)\nfor s in [\\x . x + 1, \\x . x^2]:\n    a = g(s, 3)\n    print(a, a + 1)\n"
    assert potto("run", "main.po", main=program).out == "4 5\n9 10\n"


def test_run_as_json(potto: Potto) -> None:
    answer = potto("run", "--json", "main.po", main=HALF + "print(f(0.25))\n").json
    assert answer["output"][0]["text"] == "0.25"
    value = answer["output"][0]["values"][0]["value"]
    assert value == pytest.approx(0.25, rel=1e-15, abs=0) and answer["diagnostics"] == []


def test_run_as_json_keeps_duals_apart(potto: Potto) -> None:
    """Also those of a function that a loop goes through, and of tuples; a pair that is none stays one value."""
    script = (
        "def pair(t) (t, t^2)\nprint(deriv(f)((0.25, 1)))\n"
        "for g in [deriv(f)]:\n    g((0.25, 1))\n    d = g\n    print(d((0.25, 1)), pair(3))\nderiv(pair)((3, 1))\n"
    )
    outputs = potto("run", "--json", "main.po", main=HALF + script).json["output"]
    first, second, third, fourth, fifth = [value for output in outputs for value in output["values"]]
    for dual in (first, second, third):
        assert math.isclose(dual["value"], 0.25, rel_tol=1e-14) and math.isclose(dual["tangent"], 1, rel_tol=1e-14)
    assert fourth["value"] == [3, 9] and fourth["tangent"] is None
    assert fifth["value"] == [3, 9] and fifth["tangent"] == [1, 6] and fifth["tangent_error"] is not None


def test_a_folder_stands_for_its_main_program(potto: Potto, tmp_path: Path) -> None:
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "other.po").write_text("print(1)\n")
    ran = potto("run", "scene")
    assert ran.status == 1 and "P0208" in ran.err
    assert f"name a program in it, such as `{Path('scene', 'other.po')}`" in ran.err
    (tmp_path / "scene" / "main.po").write_text(HALF + "print(f(0.5))\n")
    assert potto("run", "scene").out == "0.5\n"
    assert potto("eval", "scene", "f(0.25)").out == "0.25\n"
    assert "deriv(f)" in potto("deriv", "scene", "f").out


def test_a_plain_function_for_that_of_a_dual_is_told_the_way(potto: Potto) -> None:
    ran = potto("eval", "main.po", r"deriv(g)((1, 1), \y . 1)", main="def g(x, s) s(x)\n")
    assert ran.status == 1 and "P0306" in ran.err
    assert "= help: give the derivative of the function: `deriv(…)`" in ran.err


def test_no_command_is_a_wrong_command_line(potto: Potto) -> None:
    ran = potto()
    assert ran.status == 2 and ran.out == "" and "usage: potto COMMAND" in ran.err


@pytest.mark.parametrize(
    ("line", "help"),
    [
        ("from maths import sin", "`sin` is a builtin: it needs no import"),
        ("import numpy as np", "modules of Python can't be imported; builtins such as `sqrt` and `pi` need no import"),
    ],
)
def test_modules_of_python_are_told_apart(potto: Potto, line: str, help: str) -> None:
    ran = potto("check", "main.po", main=f"{line}\n")
    assert ran.status == 1 and ran.out.count("error[") == 1 and f"= help: {help}" in ran.out


def test_eval_json_of_a_dual(potto: Potto) -> None:
    answer = potto("eval", "main.po", "deriv(f)((0.25, 1))", "--json", main=HALF).json
    assert math.isclose(answer["value"], 0.25, rel_tol=1e-14)
    assert math.isclose(answer["tangent"], 1.0, rel_tol=1e-14)  # D of the length of [0, t]
    assert answer["error"] < 1e-12 and answer["tangent_error"] < 1e-12
    assert answer["converged"] is True and answer["type"] == "(Real, Real)"
    assert {"evals", "seconds", "compile_seconds", "method"} <= set(answer)


def test_eval_json_of_tuples_and_of_what_json_has_no_numbers_for(potto: Potto) -> None:
    answer = potto("eval", "main.po", "(1/3, inf, -inf, inf - inf)", "--json", main="").json
    assert answer["value"] == [1 / 3, "inf", "-inf", "nan"] and answer["tangent"] is None


@pytest.mark.parametrize(
    ("expression", "code"), [("g(1)", "P0201"), ("f(1", "P0102"), ("f(1, 2)", "P0308"), ("", "P01")]
)
def test_eval_says_what_is_wrong_with_the_expression(potto: Potto, expression: str, code: str) -> None:
    ran = potto("eval", "main.po", expression, main=HALF)
    assert ran.status == 1 and ran.out == "" and f"error[{code}" in ran.err and "<expression>:1:" in ran.err
    answer = potto("eval", "main.po", expression, "--json").json
    assert answer["diagnostics"][0]["code"].startswith(code)
    assert set(answer["diagnostics"][0]["range"]) == {"start", "end"}


def test_an_expression_may_start_with_a_minus(potto: Potto) -> None:
    assert potto("eval", "main.po", "-f(0.25)", main=HALF).out == "-0.25\n"
    assert potto("eval", "--rtol", "1e-8", "main.po", "-pi").out.startswith("-3.14159265358979")
    assert potto("eval", "main.po", "-1", "--json").json["value"] == -1.0


def test_eval_with_numbers_asked_for(potto: Potto) -> None:
    options = ("--method", "mc", "--samples", "2e4", "--seed", "3", "--json")
    first = potto("eval", "main.po", "f(0.25)", *options, main=HALF).json
    again = potto("eval", "main.po", "f(0.25)", *options).json
    assert first["method"] == "mc" and first["value"] == again["value"]
    # 5 standard deviations of a mean of 20,000 values of [x < 1/4]
    assert abs(first["value"] - 0.25) < 5 * math.sqrt(0.25 * 0.75 / 2e4)


@pytest.mark.parametrize("option", [("--rtol", "-1"), ("--rtol", "x"), ("--samples", "0"), ("--method", "best")])
def test_impossible_options_are_wrong_use(potto: Potto, option: tuple[str, str]) -> None:
    ran = potto("eval", "main.po", "f(1)", *option, main=HALF)
    assert ran.status == 2 and ran.out == "" and ran.err


def test_stats_go_to_the_person(potto: Potto) -> None:
    ran = potto("eval", "main.po", "f(0.25)", "--stats", main=HALF)
    assert ran.out == "0.25\n" and "evaluations" in ran.err and "kernels" in ran.err
    assert "surfaces kept: 1, dropped: 0" in ran.err and "cut along; no derivative is asked for" in ran.err


def test_stats_say_why_surfaces_are_dropped(potto: Potto) -> None:
    program = "def f(t, a) integral [0, 1] a*[x < t]*[x < 2 + a] d(x)"
    ran = potto("eval", "main.po", "deriv(f)((0.25, 0), (1, 1))", "--stats", "--json", main=program)
    stats = ran.json["stats"]
    assert stats["boundary evaluations"] == 0 and stats["interior evaluations"] == 2
    why = sorted(entry["why"] for entry in stats["surfaces"] if not entry["kept"])
    assert why == ["it does not meet the domain", "nothing that is differentiated moves it"]


def test_standard_input_is_a_file_of_the_folder(potto: Potto) -> None:
    ran = potto("run", "-", stdin="from half import f\nprint(f(0.5))\n", half=HALF)
    assert ran.out == "0.5\n", ran.err
    assert "<stdin>:2:25: error[P0301]" in potto("check", "-", stdin=WRONG).out


def test_check_answers_in_one_line_and_an_excerpt(potto: Potto) -> None:
    ran = potto("check", "main.po", main=WRONG)
    assert ran.status == 1
    first, *rest = ran.out.splitlines()
    assert first == "main.po:2:25: error[P0301]: this condition depends on the variable of integration `x`"
    assert any("^^^^^" in line for line in rest) and any("= help:" in line for line in rest)


def test_check_json(potto: Potto) -> None:
    found = potto("check", "--json", "main.po", main=WRONG).json["diagnostics"]
    assert found[0]["code"] == "P0301" and found[0]["severity"] == "error" and found[0]["file"] == "main.po"
    assert found[0]["range"] == {"start": {"line": 1, "character": 24}, "end": {"line": 1, "character": 29}}
    assert potto("check", "--json", "main.po", main=HALF).json == {"diagnostics": []}


def test_check_walks_folders(potto: Potto, tmp_path: Path) -> None:
    inner = tmp_path / "pkg" / "deep"
    inner.mkdir(parents=True)
    (inner / "bad.po").write_text(WRONG)
    (tmp_path / "pkg" / ".hidden").mkdir()
    (tmp_path / "pkg" / ".hidden" / "worse.po").write_text("def (")
    ran = potto("check", "pkg")
    assert ran.status == 1 and "pkg/deep/bad.po:2:25" in ran.out and "worse" not in ran.out


def test_related_places_in_other_files(potto: Potto) -> None:
    ran = potto("check", "main.po", lib="def step(y) if y > 0 then 1 else 0\n",
                main="from lib import step\ndef f(t)\n    integral [0, 1] step(t - x) d(x)\n")  # fmt: skip
    assert ran.status == 1 and "P0301" in ran.out and "lib.po:1:" in ran.out


def test_fmt(potto: Potto, tmp_path: Path) -> None:
    messy = "def f( t )\n    integral [0,1]   [x<t] d(x)  # keep\n"
    ran = potto("fmt", "--check", "main.po", main=messy)
    assert ran.status == 1 and (tmp_path / "main.po").read_text() == messy
    ran = potto("fmt", "--diff", "main.po")
    assert ran.status == 1 and "-def f( t )" in ran.out and "+def f(t)" in ran.out
    assert potto("fmt", "main.po").status == 0
    formatted = (tmp_path / "main.po").read_text()
    assert "# keep" in formatted and "def f(t)" in formatted
    assert potto("fmt", "--check", "main.po").status == 0
    assert potto("fmt", "-", stdin=messy).out == formatted


def test_fmt_leaves_alone_what_it_cannot_read(potto: Potto, tmp_path: Path) -> None:
    ran = potto("fmt", "main.po", main="def f(t) (t\n")
    assert ran.status == 1 and "P0102" in ran.err and (tmp_path / "main.po").read_text() == "def f(t) (t\n"


def test_a_name_that_is_missing_is_not_called_unused(potto: Potto) -> None:
    ran = potto("check", "main.po", main="let\n")
    assert ran.status == 1 and "P0101" in ran.out and "P0610" not in ran.out


def test_live_expressions(potto: Potto) -> None:
    good = HALF + "#> f(1/3)\n#= 0.333\n#> deriv(f)((0.3, 1))\n#= (0.3, 1)\n#> f(2)\n"
    ran = potto("test", "main.po", main=good)
    assert ran.status == 0 and "3 live expressions in 1 file: all hold" in ran.out
    ran = potto("test", "main.po", main=HALF + "#> f(1/3)\n#= 0.334\n")
    assert ran.status == 1 and "main.po:3: f(1/3)" in ran.err and "expected 0.334" in ran.err
    ran = potto("test", "main.po", main="def f(t) (t\n")
    assert ran.status == 1 and "P0102" in ran.err and "none was asked, and there are errors" in ran.out
    ran = potto("test", "--json", "main.po", main=HALF + "#> nothing\n#= 1\n")
    assert ran.status == 1 and "not defined" in ran.json["tests"][0]["message"]


@pytest.mark.parametrize("wrong", ["0.30001", "(0.3, 1)", "1", "0.3 + 1e-9", "nan"])
def test_a_live_expression_does_not_hold_by_accident(potto: Potto, wrong: str) -> None:
    assert potto("test", "main.po", main=HALF + f"#> f(0.3)\n#= {wrong}\n").status == 1


def test_explain(potto: Potto) -> None:
    ran = potto("explain", "p0520")
    assert ran.status == 0 and ran.out.startswith("P0520: a setting")
    assert "```" not in ran.out
    assert "P0520  a setting" in potto("explain").out
    ran = potto("explain", "P9999")
    assert ran.status == 2 and "no diagnostic P9999" in ran.err
    assert potto("explain", "--json", "P0520").json["pages"][0]["code"] == "P0520"
    assert potto("explain", "Limits").out.startswith("Limits\n")


def test_deriv(potto: Potto) -> None:
    ran = potto("deriv", "main.po", "f", main=HALF)
    assert ran.status == 0
    assert "f : (t: Real) -> Real" in ran.out and "dt*delta(t - x)" in ran.out and "x = t" in ran.out
    ran = potto("deriv", "main.po", "g")
    assert ran.status == 1 and "P0232" in ran.err
    assert potto("deriv", "--json", "main.po", "f").json["surfaces"] == ["x = t"]


def test_deriv_of_what_jumps_outside_of_an_integral(potto: Potto) -> None:
    ran = potto("deriv", "main.po", "step", main="def step(y) [y > 0]\n")
    assert "(Real, Dist[dy])" in ran.out and "dy*delta(y)" in ran.out and "y = 0" in ran.out


def test_deriv_keeps_bounds_that_move_apart(potto: Potto) -> None:
    # D of the integral of x*[x < 1] over [0, t] is t*[t < 1] dt: all of it comes from the bound
    answer = potto("deriv", "--json", "main.po", "f", main="def f(t)\n    integral [0, t] x*[x < 1] d(x)\n").json
    part = answer["integrals"][0]
    assert part["interior"] == "0" and part["boundary"] == [] and len(part["bounds"]) == 1
    assert "dt" in part["bounds"][0] and "[" in part["bounds"][0]


def test_deriv_of_a_delta_is_no_zero(potto: Potto) -> None:
    # the integral of delta(x - t)*x^2 is t^2 within [0, 1], so its derivative is 2*t
    answer = potto("deriv", "--json", "main.po", "f", main="def f(t) integral [0, 1] delta(x - t)*x^2 d(x)\n").json
    assert answer["integrals"][0]["boundary"] == ["integral [0, 1] -x^2*dt*delta'(x - t) d(x)"]
    assert answer["derivative"] == "2*t*dt*[0 < t < 1]"


def test_deriv_of_a_definition_around_integrals_of_others(potto: Potto) -> None:
    program = f"{HALF}def g(t) 3*f(t)^2\n"
    answer = potto("deriv", "--json", "main.po", "g", main=program).json
    assert answer["integrals"][0]["boundary"] == ["integral [0, 1] dt*delta(t - x) d(x)"]
    assert answer["body"]["value"] == "3*(integral [0, 1] [x < t] d(x))^2"
    # D of 3*t^2 within [0, 1], by what the printed formula gives at t = 0.3, dt = 1
    formula = f"let t = 0.3 in let dt = 1 in {answer['derivative']}"
    assert math.isclose(potto("eval", "main.po", formula, "--json").json["value"], 1.8, rel_tol=1e-12)


def test_a_derivative_that_nobody_would_read_is_left_to_json(potto: Potto) -> None:
    text = "def touch(a, d, w) integral [0, pi/w] [a*sin(w*t) > d]*exp(t*d)*(t - w) d(t)"
    ran = potto("deriv", "t.po", "touch", t=text)
    told = next(line for line in ran.out.splitlines() if line.startswith("  whole"))
    whole = potto("deriv", "t.po", "touch", "--json").json["derivative"]
    assert len(whole) > 1000 and f"{len(whole):,} characters" in told and "--json" in told
    assert max(map(len, ran.out.splitlines())) < 200


def test_the_whole_of_a_choice_and_its_delta_can_be_read(potto: Potto) -> None:
    out = potto("deriv", "main.po", "f", main="def f(y, a) if [y > a] then a*y else 2*y\n").out
    assert "whole     (if [a < y] then " in out and ") + y*(a - 2)*(" in out


@pytest.mark.parametrize(
    ("kind", "part"),
    [
        ("tokens", "1:1\tDEF\t'def'"),
        ("tree", "Definition [0, 41) name='f'"),
        ("types", "f : (t: Real) -> Real"),
        ("core", "integral [0, 1] [x < t] d(x)"),
        ("deriv", "delta(t - x)"),
        ("kernel", "def kernel("),
    ],
)
def test_dump(potto: Potto, kind: str, part: str) -> None:
    ran = potto("dump", kind, "main.po", main=HALF)
    assert ran.status == 0 and part in ran.out


def test_cache(potto: Potto, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POTTO_CACHE", str(tmp_path))
    (tmp_path / "mine.txt").write_text("keep")
    ran = potto("cache", "--json")
    assert ran.json["folder"] == str(tmp_path) and ran.json["files"] == 0
    store.put("some-kind", b"key", b"data")
    assert potto("cache", "--json").json["kinds"]["some-kind"]["files"] == 1
    assert "some-kind" in potto("cache").out
    assert potto("cache", "--clear").status == 0
    assert (tmp_path / "mine.txt").exists()
    assert store.get("some-kind", b"key") is None
    monkeypatch.setenv("POTTO_CACHE", "off")
    assert "off" in potto("cache").out and potto("cache", "--json").json["folder"] is None


# The command line itself


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_helps_with_an_example(potto: Potto, command: str) -> None:
    ran = potto(command, "--help")
    assert ran.status == 0 and "example:" in ran.out and f"potto {command}" in ran.out


def test_an_expression_needs_no_file(potto: Potto) -> None:
    assert potto("eval", "1 + 1").out == "2\n"
    assert potto("eval", "integral [0, 1] [x < 0.25] d(x)").out == "0.25\n"
    assert json.loads(potto("eval", "--json", "2^3").out)["value"] == 8
    assert potto("eval", "--set", "t=3", "t^2").out == "9\n"
    wrong = potto("eval", "nothing + 1")
    assert wrong.status == 1 and "`nothing` is not defined" in wrong.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], ""),
        (["chek"], "did you mean `check`?"),
        (["--nope"], "no option --nope"),
        (["eval", "main.po"], "EXPR"),
        (["check"], "PATH"),
        (["check", "--nope", "x.po"], "--nope"),
        (["dump", "ast", "main.po"], "tokens"),
    ],
)
def test_wrong_use(potto: Potto, arguments: list[str], said: str) -> None:
    ran = potto(*arguments)
    assert ran.status == 2 and said in ran.err


def test_colours(potto: Potto, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "\x1b[" in potto("check", "main.po", "--color", "always", main=WRONG).out
    assert "\x1b[" not in potto("check", "main.po").out
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b[" not in potto("check", "main.po", "--color", "auto").out


def test_a_bug_of_ours_is_a_short_report(potto: Potto, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*arguments: object) -> None:
        raise AssertionError("impossible")

    monkeypatch.setattr("potto.checking.check.syntax_diagnostics", broken)
    ran = potto("check", "main.po", main=HALF)
    assert ran.status == 70 and "internal error (AssertionError)" in ran.err and "potto check main.po" in ran.err
    report = Path(ran.err.split("report:")[1].strip())
    assert "impossible" in report.read_text()
    report.unlink()


def test_an_interrupt_ends_with_130(potto: Potto, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("potto.checking.check.syntax_diagnostics", interrupted)
    assert potto("check", "main.po", main=HALF).status == 130


def test_watch_looks_again_when_a_file_changes(potto: Potto, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # The second comes while it is waited for the first to be written.
    looks = iter([HALF + "g = 1\n", HALF + "g = 2\n", None])

    def edit(pause: float) -> None:
        try:
            text = next(looks)
        except StopIteration:
            raise KeyboardInterrupt from None
        if text is not None:
            (tmp_path / "main.po").write_text(text)

    monkeypatch.setattr("potto.cli.files.time.sleep", edit)
    ran = potto("check", "--watch", "main.po", main=WRONG)
    assert ran.status == 130
    assert ran.out.count("P0301") == 1 and "1 error" in ran.err and "no problems" in ran.err


def test_json_is_one_line(potto: Potto) -> None:
    ran = potto("eval", "main.po", "f(0.5)", "--json", main=HALF)
    assert ran.out.count("\n") == 1 and json.loads(ran.out)
