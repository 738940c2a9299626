"""A prompt that grows: entries see those before them, shadow them, and leave no trace where they are wrong."""

from __future__ import annotations

import pytest

from potto.evaluating.session import Defined, Imported, Said, Session, Valued
from potto.reports.render import ProgramError, render

JUMP = "def f(t) integral [0, 1] [x < t] d(x)"


def session(tmp_path, **files):
    for name, text in files.items():
        (tmp_path / f"{name}.po").write_text(text)
    return Session([tmp_path])


def only(outcomes):
    (outcome,) = outcomes
    return outcome


def codes(outcomes):
    return [o.located.diagnostic.code for o in outcomes if isinstance(o, Said)]


def value(found):
    return float(only(only(found).estimates).value)


def test_a_definition_joins_and_shows_its_type(tmp_path):
    s = session(tmp_path)
    outcome = only(s.run(JUMP))
    assert isinstance(outcome, Defined) and outcome.text == "f : (t: Real) -> Real" and outcome.shadows is None
    assert value(s.run("f(0.25)")) == pytest.approx(0.25, rel=1e-12)  # the length of [0, 0.25]


def test_derivatives_of_earlier_entries(tmp_path):
    s = session(tmp_path)
    s.run(JUMP)
    s.run("df = deriv(f)")
    found = only(s.run("df(dt=(0.25, 1))"))
    assert found.type == "(Real, Real)"
    assert found.estimates[0].tangent or found.estimates[0].value[1] == pytest.approx(1, rel=1e-12)


def test_later_definitions_shadow_for_later_entries_only(tmp_path):
    s = session(tmp_path)
    s.run("def f(t) t + 1")
    s.run("def g(t) 10*f(t)")
    outcome = only(s.run("def f(t) t + 2"))
    assert outcome.shadows == "`f` of <In 1>"
    assert value(s.run("f(0)")) == 2
    assert value(s.run("g(0)")) == 10


def test_a_definition_may_use_the_one_that_it_replaces_only_as_recursion(tmp_path):
    s = session(tmp_path)
    s.run("def f(n) n")
    s.run("def f(n) if n > 0 then n*f(n - 1) else 1")
    assert value(s.run("f(5)")) == 120


def test_builtins_can_be_shadowed(tmp_path):
    s = session(tmp_path)
    outcomes = s.run("sin = \\x . 2*x")
    assert [o.shadows for o in outcomes if isinstance(o, Defined)] == ["the builtin `sin`"]
    assert value(s.run("sin(2)")) == 4


def test_one_entry_may_hold_several_things_in_any_order(tmp_path):
    s = session(tmp_path)
    outcomes = s.run("a = 3\nprint(b(a), a)\ndef b(x)\n    y = x^2\n    y + 1\nb(1)")
    assert [type(o).__name__ for o in outcomes] == ["Defined", "Defined", "Valued", "Valued"]
    assert [o.text for o in outcomes if isinstance(o, Valued)] == ["10 3", "2"]
    assert [o.type for o in outcomes if isinstance(o, Valued)] == [None, "Real"]


def test_answers_stay_at_hand(tmp_path):
    s = session(tmp_path)
    assert only(s.run("1 + 1")).names == ("_", "_1")
    assert value(s.run("_ * 3")) == 6
    assert value(s.run("_ * 3")) == 18
    assert value(s.run("_1 + _2")) == 8
    assert value(s.run("_ - (\n  1)")) == 7
    assert s.names() == {}


def test_an_answer_keeps_its_meaning_when_names_change(tmp_path):
    s = session(tmp_path)
    s.run("a = 1")
    s.run("a + 1")
    s.run("a = 5")
    assert value(s.run("_2")) == 2


def test_answers_can_be_functions(tmp_path):
    s = session(tmp_path)
    s.run("\\x . x^2")
    assert value(s.run("_(3)")) == 9


def test_an_entry_with_an_error_joins_nothing_and_is_kept_for_its_excerpt(tmp_path):
    s = session(tmp_path)
    outcomes = s.run("def f(t) t\ng = nothing")
    assert codes(outcomes) == ["P0201"] and all(isinstance(o, Said) for o in outcomes)
    text = render(outcomes[0].located, s.source)
    assert "<In 1>:2:5" in text and "g = nothing" in text
    assert codes(s.run("f(1)")) == ["P0201"]
    assert codes(s.run("def k(t) integral [0, 1] (if x < t then 1 else 0) d(x)")) == ["P0301"]
    assert codes(s.run("f(")) and codes(s.run("k(1)")) == ["P0201"]


def test_near_names_of_earlier_entries_are_offered(tmp_path):
    s = session(tmp_path)
    s.run("def renderer(c) c")
    assert "renderer" in only(s.run("rendrer(1)")).located.diagnostic.help


def test_imports_accumulate(tmp_path):
    s = session(tmp_path, m="def g(x) x + 1\ndef h(x) x*2", n="from m import g as again")
    assert only(s.run("from m import g")) == Imported("m", ("g",))
    assert only(s.run("import m as k")) == Imported("m", ("k",))
    assert value(s.run("g(k.h(3))")) == 7
    s.run("from n import again")
    assert value(s.run("again(1)")) == 2
    assert codes(s.run("from m import gg")) == ["P0203"]
    assert codes(s.run("from nowhere import x")) == ["P0202"]


def test_names_are_those_in_scope(tmp_path):
    s = session(tmp_path, m="def g(x) x")
    s.run("def f(t) t")
    s.run("from m import g")
    s.run("import m")
    s.run("def f(t, u) t")
    assert {name: target and target.file for name, target in s.names().items()} == {
        "f": "<In 4>",
        "m": None,
        "g": str(tmp_path / "m.po"),
    }
    assert s.target("f").file == "<In 4>" and s.target("nothing") is None


def test_load_brings_a_file_and_its_folder(tmp_path):
    folder = tmp_path / "deep"
    folder.mkdir()
    (folder / "a.po").write_text("from b import g\ndef f(x) g(x) + 1")
    (folder / "b.po").write_text("def g(x) 2*x\ndef only_here(x) x")
    s = session(tmp_path)
    s.run("def f(x) 0")
    outcome = s.load(folder / "a.po")[-1]
    assert isinstance(outcome, Imported) and set(outcome.names) == {"f", "g"}
    assert value(s.run("f(3) + g(1)")) == 9  # what is loaded later shadows
    assert value(s.run("def only(x) x\nonly(1)")[1:]) == 1
    s.run("from b import only_here")
    assert value(s.run("only_here(4)")) == 4
    assert s.load(folder / "none.po")[-1].is_error


def test_reload_takes_what_changed(tmp_path):
    s = session(tmp_path, a="def f(x) x")
    s.load(tmp_path / "a.po")
    s.run("def g(x) f(x) + 10")
    assert value(s.run("g(1)")) == 11
    (tmp_path / "a.po").write_text("def f(x) 100*x")
    assert s.reload() == []
    assert value(s.run("g(1)")) == 110
    (tmp_path / "a.po").write_text("def f(x) 100*")
    assert codes(s.reload())
    assert codes(s.run("g(1)"))
    (tmp_path / "a.po").write_text("def f(x) x")
    s.reload()
    assert value(s.run("g(1)")) == 11


def test_questions_make_no_entry(tmp_path):
    s = session(tmp_path)
    s.run(JUMP)
    assert not s.infer("f(0.5)").diagnostics and s.infer("g(1)").diagnostics[0].code == "P0201"
    assert s.infer("f(").diagnostics
    assert s.evaluate("f(0.5)").estimate.value == pytest.approx(0.5, rel=1e-12)
    with pytest.raises(ProgramError):
        s.evaluate("f(y)")
    assert s.number == 1


def test_reset_forgets(tmp_path):
    s = session(tmp_path)
    s.run("a = 1")
    s.reset()
    assert s.names() == {} and codes(s.run("a")) == ["P0201"]
    assert s.number == 2


def test_an_error_at_run_time_ends_the_entry_and_keeps_its_definitions(tmp_path):
    s = session(tmp_path)
    outcomes = s.run("def loop(n) if n > 0 then loop(n + 1) else 0\nloop(1)\nprint(5)")
    assert isinstance(outcomes[0], Defined) and codes(outcomes) and not [o for o in outcomes if isinstance(o, Valued)]
    assert s.target("loop") is not None


def test_many_entries_stay_quick(tmp_path):
    s = session(tmp_path)
    for k in range(150):
        s.run(f"def f{k}(x) sin(x)" if k == 0 else f"def f{k}(x) f{k - 1}(x) + 1")
    with s.db.recording() as events:
        assert value(s.run("f149(0)")) == 149
    again = [e for e in events if e.kind == "executed" and e.query == "core" and e.args[1] != "_"]
    assert len({e.args for e in again}) == len(again)


def test_a_derivative_in_which_nothing_moves_is_said_once(tmp_path):
    s = session(tmp_path)
    list(s.steps(JUMP))
    found = list(s.steps("deriv(f)(0.3)"))
    assert codes(found) == ["P0615"] and any(isinstance(o, Valued) for o in found)
    assert codes(list(s.steps("print(deriv(f)(0.3))"))) == ["P0615"]
    assert codes(list(s.steps("deriv(f)((0.3, 1))"))) == []
    assert [located.diagnostic.code for located in s.evaluate("deriv(f)(0.3)").remarks] == ["P0615"]
