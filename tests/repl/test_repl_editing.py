"""What typing means, without keys: when an entry is over, indentation, pastes, symbols, completion."""

from __future__ import annotations

import pytest
from potto_repl.backslash_symbols import SYMBOLS, ascii_only, expanded, pretty, readable, typed
from potto_repl.complete import candidates
from potto_repl.editing import indentation, is_over, unprompted


@pytest.mark.parametrize("text", [
    "1 + 1", "f(1)", "def f(t) t", "def f(t)\n    t\n", "def f(t)\n    t\n\n", ")", "f(1,\n  2)", ":type f(", "f?", "",
    "a = 1", "for v in [1]:\n    print(v)\n", "integral [0, 1]\n    x d(x)",
])  # fmt: skip
def test_these_are_handed_in(text):
    assert is_over(text)


@pytest.mark.parametrize("text", [
    "def f(t)", "def f(t)\n    a = t", "def f(t)\n    a = t\n    a", "f(", "f(1,", "1 +", "integral [0, 1] x", "a =",
    "for v in [1]:", "for v in [1]:\n    print(v)", "if x then 1", "(1,\n 2", "def f(t) (",
])  # fmt: skip
def test_these_go_on(text):
    assert not is_over(text)


def test_two_empty_lines_end_anything():
    assert is_over("f(1,\n\n") and not is_over("f(1,\n")


@pytest.mark.parametrize(("text", "width"), [
    ("def f(t)", 4), ("def f(t):", 4), ("def f(t) = ", 4), ("def f(c, s)", 4), ("def f(t) t", 0), ("for v in [1]:", 4),
    ("f(1,", 4), ("a =", 4), ("    x = 1", 4), ("    f(", 8), ("1 + 1", 0), ("def f(t)\n    x = t", 4), ("", 0),
    ("def f(t) # why", 4), ("diffeo g(x; c) =", 4),
])  # fmt: skip
def test_indentation(text, width):
    assert indentation(text) == " " * width


def test_prompts_are_taken_off_a_paste_with_the_answers():
    pasted = "1 po> def f(t)\n   ...     t^2\nf : (t: Real) -> Real\n2 po> f(2)\n_2 = 4 : Real\n"
    assert unprompted(pasted) == "def f(t)\n    t^2\nf(2)"
    assert unprompted("po> 1\r\npo> 2") == "1\n2"
    assert unprompted("def f(t)\r\n    t\r") == "def f(t)\n    t\n"


def test_symbols():
    assert typed("x + \\the") == "\\the" and expanded("\\the") == "θ" and expanded("\\theta") == "θ"
    assert expanded("\\int") == "∫" and expanded("\\_2") == "₂" and expanded("\\qqq") is None
    assert typed("\\x . x") is None and expanded("\\e") is None  # epsilon, eta, ell
    assert readable("∂ f") == "deriv f" and readable("f") == "f"


def test_every_symbol_is_read_by_potto():
    from potto.syntax import parse_expression

    for name, symbol in SYMBOLS.items():
        if symbol in "∫∂≤≥≠λ":
            continue
        word = f"x{symbol}" if name.startswith("_") else symbol
        assert not parse_expression(word).diagnostics, name


def test_symbols_are_answered_and_read_back(talk):
    talk("def f(θ) ∫ [0, 1] [x ≤ θ] d(x)")
    assert talk.data("(∂ f)((0.3, 1))".replace("∂ ", "deriv "))["tangent"] == pytest.approx(1, rel=1e-12)
    assert pretty("integral [0, 1] [x <= t] d(x)", True) == "∫ [0, 1] [x ≤ t] d(x)"
    assert ascii_only("0.3 ± 1e-9 ∂θ") == "0.3 +/- 1e-9 deriv \\u03b8"


# Completion


def words(talk, before):
    return {found.text: found for found in candidates(talk.session, before)}


def test_names_complete_with_types_and_docs(talk):
    talk("# how long\ndef renderer(c) integral [0, 1] [x < c] d(x)")
    found = words(talk, "1 + ren")
    assert list(found) == ["renderer"] and found["renderer"].length == 3
    assert found["renderer"].type == "(c: Real) -> Real" and found["renderer"].doc == "how long"
    assert {"sin", "sinh"} <= set(words(talk, "si")) and "angle" in words(talk, "si")["sin"].doc
    assert "integral" in words(talk, "def f(t)\n    inte") and "normal" in words(talk, "integral (x ~ nor")


def test_commands_and_their_arguments_complete(talk):
    talk.write("scene.po", "def f(t) t")
    talk.write("other.txt", "")
    (talk.folder / "shapes").mkdir()
    assert {":load"} == set(words(talk, ":lo")) and "FILE" in words(talk, ":lo")[":load"].type
    assert set(words(talk, ":load s")) == {"scene.po", "shapes/"}
    assert set(words(talk, ":method q")) == {"quadrature", "qmc"}
    assert set(words(talk, ":set th")) == {"theme"} and set(words(talk, ":set theme ")) == {"dark", "light", "none"}
    assert "P0301" in words(talk, ":explain p03") and "plain" in words(talk, ":explain p03")["P0301"].doc
    assert set(words(talk, ":help pl")) == {"plot"}
    talk("def wave(t) t")
    assert "wave" in words(talk, ":plot wa") and "wave" in words(talk, ":t 1 + wa")
    assert words(talk, ":nonsense x") == {}


def test_modules_and_members_complete(talk):
    talk.write("scene.po", "def edge(t) t\ndef area(t) t")
    assert set(words(talk, "from sc")) == {"scene"}
    assert set(words(talk, "from scene import e")) == {"edge"}
    talk("import scene")
    assert set(words(talk, "scene.a")) == {"area"} and words(talk, "scene.a")["area"].type == "(t: a) -> a"


def test_a_comment_waits_for_its_definition():
    assert not is_over("# how long") and is_over("# how long\n")
    assert not is_over("# how long\ndef f(t)") and is_over("# how long\ndef f(t) t")


def test_nothing_completes_nothing(talk):
    assert words(talk, "") == {} and words(talk, "1 + ") == {}
