"""What the prompt says to definitions, expressions and derivatives. Expected numbers are closed forms."""

from __future__ import annotations

import math
import re

import pytest

JUMP = "def f(t) integral [0, 1] [x < t] d(x)"  # t for t in [0, 1]
WEIGHTED = "def g(t) integral [0, 1] [x < t]*t^2 d(x)"  # t^3: interior 2t*t, boundary t^2


def test_a_definition_echoes_its_type(talk):
    assert talk(JUMP).text == "f : (t: Real) -> Real"


def test_an_entry_may_be_indented_as_on_the_page_that_it_is_copied_from(talk):
    assert talk(" 1 + 1").text == "_1 = 2 : Real"
    assert talk("    def g(t)\n        3*t").text == "g : (t: Real*) -> Real"
    assert talk("  g(2)").parts[0].data["value"] == 6


def test_a_definition_shadows_with_a_note(talk):
    talk(JUMP)
    reply = talk("def f(t) t")
    assert "shadows `f` of <In 1>" in reply.text and not reply.failed


def test_a_value_has_an_error_and_a_cost(talk):
    talk(JUMP)
    reply = talk("f(0.3)")
    value, tail = reply.parts
    assert re.fullmatch(r"_2 = 0\.30{10,} ± \d(?:\.\d)?e-\d+ : Real", value.text)
    assert re.fullmatch(r"quadrature, \d+ evaluations, .*s", tail.text)
    assert value.data["value"] == pytest.approx(0.3, rel=1e-12) and 0 < value.data["error"] < 1e-12


def test_an_exact_value_has_no_error_and_no_cost(talk):
    assert talk("1 + 1").text == "_1 = 2 : Real"


def test_a_sampled_value_says_its_samples_and_seed(talk):
    talk.all(JUMP, ":method mc", ":set seed 7", ":set samples 10000")
    reply = talk("f(0.5)")
    assert "mc, 10,000 samples, seed 7" in reply.text
    digits = re.search(r"= (0\.\d+) ±", reply.text)[1]
    assert len(digits) <= 6  # ten thousand samples give three, of which the second of the error is the fourth


def test_a_derivative_has_its_parts_apart(talk):
    talk(WEIGHTED)
    data = talk.data("deriv(g)((0.3, 1))")
    assert data["value"] == pytest.approx(0.027, rel=1e-12)
    assert data["tangent"] == pytest.approx(3 * 0.3**2, rel=1e-12)
    assert data["interior"] == pytest.approx(2 * 0.3 * 0.3, rel=1e-12)
    assert data["boundary"] == pytest.approx(0.3**2, rel=1e-11)


def test_parts_of_a_moving_disc_in_two_dimensions(talk):
    # the quarter disc of radius r, filled with r: value pi r^3/4, interior pi r^2/4, boundary r * pi r/2
    talk("def h(r) integral ([0, 2], [0, 2]) r*[x^2 + y^2 < r^2] d(x, y)")
    data = talk.data("deriv(h)((1, 1))")
    assert data["tangent"] == pytest.approx(3 * math.pi / 4, rel=1e-8)
    assert data["interior"] == pytest.approx(math.pi / 4, rel=1e-8)
    assert data["boundary"] == pytest.approx(math.pi / 2, rel=1e-7)


def test_moving_bounds_count_as_boundary(talk):
    talk("def h(t) integral [0, t] x*t d(x)")  # t^3/2: interior t^2/2, the bound brings t^2
    data = talk.data("deriv(h)((2, 1))")
    assert data["interior"] == pytest.approx(2, rel=1e-12) and data["boundary"] == pytest.approx(4, rel=1e-12)


def test_parts_of_a_smooth_integrand_have_no_boundary(talk):
    talk("def h(t) integral [0, 1] sin(t*x) d(x)")
    data = talk.data("deriv(h)((1, 1))")
    assert data["boundary"] == 0
    assert data["interior"] == pytest.approx(math.cos(1) + math.sin(1) - 1, rel=1e-12)  # d/dt (1 - cos t)/t at 1


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_parts_of_a_sampled_derivative(talk, method):
    # t*x over x*y < t: the inner integral is min(1, t/x), so the value is t^2 - t^3/2
    talk.all("def q(t) integral ([0, 1], [0, 1]) [x*y < t]*t*x d(x, y)", f":method {method}")
    data = talk.data("deriv(q)((0.3, 1))")
    assert data["interior"] == pytest.approx(0.3 - 0.3**2 / 2, abs=5e-3)
    assert data["boundary"] == pytest.approx(0.3 * (1 - 0.3), abs=5e-3)
    assert data["interior"] + data["boundary"] == pytest.approx(data["tangent"], rel=1e-12)


def test_parts_of_sampled_moving_bounds(talk):
    talk.all("def h(t) integral [0, t] x*t d(x)", ":method mc")
    data = talk.data("deriv(h)((2, 1))")
    assert data["interior"] == pytest.approx(2, abs=0.05) and data["boundary"] == pytest.approx(4, abs=0.1)


def test_parts_of_a_second_derivative(talk):
    # t^3 again: inside, the second derivative of t^2 is 2 over x < t; the rest of 6t is boundary
    talk(WEIGHTED)
    data = talk.data("deriv(deriv(g))(((0.3, 1), (1, 0)))")
    assert data["tangent"] == pytest.approx([0.27, 1.8], rel=1e-12)
    assert data["interior"] == pytest.approx([0.18, 0.6], rel=1e-12)
    assert data["boundary"] == pytest.approx([0.09, 1.2], rel=1e-10)


def test_parts_of_a_moving_delta(talk):
    talk("def h(t) integral [0, 1] t*delta(x - t)*x^2 d(x)")  # t*t^2: inside t^2, the delta's place brings t*2t
    data = talk.data("deriv(h)((0.3, 1))")
    assert data["interior"] == pytest.approx(0.09, rel=1e-12) and data["boundary"] == pytest.approx(0.18, rel=1e-12)
    text = talk(":deriv h").text
    assert "x²·∂t·δ(x − t) dx   # interior" in text and "−t·x²·∂t·δ′(x − t) dx   # boundary" in text
    assert talk.data(":check h(0.3)")["check"]["agree"]


def test_a_second_derivative_in_symbols(talk):
    talk.all(WEIGHTED, "second = deriv(deriv(g))")
    assert "cos(t)·∂∂t − sin(t)·(∂t)²" in talk(":deriv deriv(\\t . sin(t))").text
    for text in (":deriv deriv(g)", ":deriv second"):
        assert "δ(t − x)" in talk(text).text and "∂it = 0" not in talk(text).text
    talk("def h(t, u) integral [0, 1] u(x)*[x < t] d(x)")
    assert "no parameter is a function" in talk(":deriv deriv(h)").text


def test_parts_through_a_composition(talk):
    talk.all(WEIGHTED, "def k(t) sin(g(t)) + t")
    data = talk.data("deriv(k)((0.3, 1))")
    outer = math.cos(0.027)
    assert data["interior"] == pytest.approx(1 + outer * 0.18, rel=1e-12)
    assert data["boundary"] == pytest.approx(outer * 0.09, rel=1e-10)


def test_parts_of_a_remembered_derivative(talk):
    talk.all(WEIGHTED, "deriv(g)((0.3, 1))")
    data = talk.data("_")
    assert data["interior"] == pytest.approx(0.18, rel=1e-12)


def test_answers_stay_at_hand(talk):
    talk.all(JUMP, "f(0.25)")
    assert talk.data("_ * 4")["value"] == pytest.approx(1, rel=1e-12)
    assert talk.data("Out[2] + _3")["value"] == pytest.approx(1.25, rel=1e-12)


def test_an_answer_is_the_value_that_was_answered(talk):
    talk.all(JUMP, ":method mc", ":set samples 1000", "f(0.3)")
    (first,) = [e for outcome in talk.session.entries[-1].outcomes for e in getattr(outcome, "estimates", ())]
    talk.all(":set seed 8", ":set samples 5000", "def f(t) 100*t")  # nothing of this changes what was answered
    again = talk.data("_")
    assert again["value"] == first.value and 1e-3 < first.error < 0.1
    assert again["error"] == pytest.approx(first.error, rel=1e-12)
    assert again["evals"] == 0
    twice = talk.data("_2 * 2")
    assert (twice["value"], twice["error"]) == pytest.approx((2 * first.value, 2 * first.error), rel=1e-12)
    talk(":method quadrature")
    reply = talk("Out[2]")  # the error that it came with: nothing to be warned of
    assert not reply.failed and "P0501" not in reply.text and reply.parts[0].data["converged"] is False


def test_an_answer_stands_still_in_a_derivative(talk):
    talk.all(JUMP, "f(0.25)")
    data = talk.data("deriv(\\t . _*t^2)((3, 1))")
    assert (data["value"], data["tangent"]) == pytest.approx((2.25, 1.5), rel=1e-12)
    talk("g = \\t . integral [0, 1] [x < _2*t] d(x)")
    assert talk.data("deriv(g)((2, 1))")["tangent"] == pytest.approx(0.25, rel=1e-12)
    talk("\\x . f(x)^2")  # a function goes on as a function
    assert talk.data("deriv(_)((0.5, 1))")["tangent"] == pytest.approx(1, rel=1e-12)


def test_the_error_of_an_answer_reaches_what_is_made_of_it(talk):
    talk.all(JUMP, ":method mc", ":set samples 1000", "f(0.3)")
    error = talk.data("_")["error"]
    talk.all(":method auto", "g = \\t . integral [0, 1] [x < _2*t] d(x)")
    data = talk.data("deriv(g)((2, 1))")  # 2a and a: how fast the jump moves is no better known than a
    assert data["error"] == pytest.approx(2 * error, rel=1e-9)
    assert data["tangent_error"] == pytest.approx(error, rel=1e-9)
    assert data["interior"] == 0 and data["boundary"] == pytest.approx(data["tangent"], rel=1e-12)
    pair = talk.data("(_2, [_2^2, 5])")
    assert pair["error"][0] == pytest.approx(error, rel=1e-9) and pair["error"][1][1] == 0
    assert pair["error"][1][0] == pytest.approx(2 * 0.3 * error, rel=0.2)
    sharp = talk.data("_2*0 + f(0.5)")
    assert sharp["error"] < 1e-12


def test_an_answer_outlives_its_file(talk):
    path = talk.write("m.po", "def h(t) integral [0, t] x d(x)\n")
    talk.all(f":load {path}", "h(2)", "(h(1), [h(3), 4])")
    talk.write("m.po", "def h(t) 7*t\n")
    talk.all(":reload")
    assert talk.data("h(2)")["value"] == 14
    assert talk.data("_1")["value"] == pytest.approx(2, rel=1e-12)
    assert talk("_2").text.startswith("_5 = (0.5000000")


def test_a_sampled_derivative_keeps_its_parts(talk):
    talk.all(WEIGHTED, ":method mc", ":set samples 500", "deriv(g)((0.3, 1))", ":set seed 9")
    before = talk.session.parts
    data = talk.data("_")
    (kept,) = set(before.values())
    assert data["interior"] == kept.interior and data["interior"] + data["boundary"] == pytest.approx(data["tangent"])


def test_an_answer_that_there_never_was(talk):
    assert "there is no answer yet" in talk("_").text
    talk.all("1 + 1", "3")
    text = talk("Out[7] + _9").text
    assert "there is no answer 7" in text and "the answers are `_2`, `_3`" in text and "^^^^^^" in text
    assert "there is no answer 9" in text and "define `Ou`" not in text


def test_the_answers_of_a_paste_have_numbers_of_their_own(talk):
    assert talk("1 + 1\n2 + 2").text.split() == ["_1", "=", "2", ":", "Real", "_2", "=", "4", ":", "Real"]
    assert "the answers are `_1`, `_2`" in talk("Out[7]").text


def test_a_constant_is_as_accurate_as_is_asked_for_each_time(talk):
    talk.all("def h(t) integral [0, 1] exp(-t*x^2) d(x)", "a = h(3)", ":plot a*x")
    exact = math.sqrt(math.pi / 12) * math.erf(math.sqrt(3))
    assert talk.data(":eval a")["value"] == pytest.approx(exact, rel=1e-14)
    rows = talk.data(":error a")["table"]
    assert len({row["evals"] for row in rows}) > 6 and rows[0]["error"] > 100 * rows[5]["error"]


def test_carets_stand_under_what_was_typed(talk):
    talk(JUMP)
    talk("f(0.25)")
    text = talk("Out[2] + nothing").text
    assert " 1 | Out[2] + nothing\n  |          ^^^^^^^" in " " + text.replace("\n1 |", "\n 1 |")


def test_free_names_are_to_be_defined(talk):
    reply = talk("x + t")
    assert reply.failed and "`x` is not defined" in reply.text
    assert "define `x` and `t` first" in reply.text and r"`\(x, t) . x + t`" in reply.text


def test_a_function_that_is_missing_is_to_be_defined_as_one(talk):
    assert "such as `def area(x) x^2`" in talk("1 + area(3)").text


def test_the_rule_is_said_with_the_place_in_the_entry(talk):
    reply = talk("def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)")
    assert "error[P0301]" in reply.text and "<In 1>:2:25" in reply.text


def test_an_error_in_an_earlier_entry_shows_that_entry(talk):
    talk("def loop(n) if n > 0 then loop(n + 1) else 0")
    reply = talk("loop(1)")
    assert reply.failed and "error[P05" in reply.text


def test_near_names_are_offered(talk):
    talk("def renderer(c) c")
    assert "did you mean `renderer`?" in talk("rendrer(1)").text


def test_a_loop_prints_without_answers(talk):
    reply = talk("for v in [1, 2]:\n    print(v/4)")
    assert reply.text.splitlines() == ["0.25", "0.5"]


def test_functions_show_their_types(talk):
    assert talk("\\x . x^2").text == "_1 = \\x . x^2 : (x: Real*) -> Real"


def test_a_distribution_shows_its_deltas(talk):
    text = talk("deriv(\\t . \\x . [x < t])((0.3, 1))").text
    assert "Dist[dx]" in text and "tangent     (dt - dx)*delta(t - x)" in text


def test_infinite_values_have_no_error_bar(talk):
    text = talk("1/0").text
    assert "_1 = not converged: inf : Real" in text and "±" not in text


def test_nothing_says_nothing(talk):
    assert talk("").parts == () and talk("   \n").parts == () and talk("# a comment").parts == ()


def test_a_bug_of_ours_ends_no_session(talk, monkeypatch):
    import potto_repl.answers

    def broken(session, text):
        raise ZeroDivisionError("ours")
        yield

    monkeypatch.setattr(potto_repl.answers, "entry_parts", broken)
    reply = talk("1 + 1")
    assert reply.failed and "this is a bug in Potto" in reply.text and "report:" in reply.text
    path = re.search(r"report: +(\S+)", reply.text)[1]
    with open(path) as file:
        assert "ZeroDivisionError" in file.read()
    monkeypatch.undo()
    assert talk("1 + 1").text.endswith("= 2 : Real")


def test_an_interrupt_keeps_what_was_defined(talk, monkeypatch):
    from potto_repl.respond import stream

    parts = stream(talk.session, "def f(t) 2*t\nprint(f(1))\nprint(f(2))")
    next(parts)
    assert next(parts).text == "2"
    with pytest.raises(KeyboardInterrupt):
        parts.throw(KeyboardInterrupt)
    assert talk.data("f(3)")["value"] == 6


def test_deep_recursion_is_a_message(talk):
    talk("def sums(n) if n > 0 then n + sums(n - 1) else 0")
    assert talk.data("sums(500)")["value"] == 125250
    assert "P05" in talk("sums(100000)").text
