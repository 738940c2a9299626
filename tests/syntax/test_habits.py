"""What users of other languages and of mathematics write out of habit: one message, which says what to write here."""

from __future__ import annotations

import pytest
from syntax_help import check_messages, everything, messages

from potto.syntax import split
from potto.syntax.parser import parse_chunk


def test_python() -> None:
    check_messages("""
        f = lambda x: x + 1
        #   ^^^^^^ error[P0117]: Potto has no `lambda`
        def f(x) x // 2
        #          ^^ error[P0117]: Potto has no `//`
        def f(x) x += 1
        #          ^^ error[P0117]: Potto has no `+=`: a name keeps its value
        def f(x) 1_000*x
        #        ^^^^^ error[P0111]: `1_000` is not a number
        def f(n)
            s = 0
            for i in range(n):
        #   ^^^ error[P0103]: a `for` goes through a list in a script, not in a definition
                s = s + i
            s
        for i in 1..3: print(i)
        #         ^^ error[P0103]: a `for` goes over a list, not over a range
        for (a, b) in pairs: print(a*b)
        #   ^ error[P0115]: a `for` has one variable
        for v in [1, 2] print(v)
        #               ^^^^^ error[P0104]: expected `:` before the statement of this `for`
        def f(a)
            p, q = (a, a)
        #   ^^^^ error[P0115]: names that take a tuple apart stand in parentheses
            p + q
        def integral(x) x
        #   ^^^^^^^^ error[P0107]: `integral` is a reserved word
    """)


def test_other_languages() -> None:
    check_messages("""
        let x = 3
        #       ^ error[P0104]: expected `in` after the names of `let`
        g = \\x . let a = 1, b = 2 in a + b
        #                 ^ error[P0103]: unexpected `,`
        def f(x)
            // what follows is kept
        #   ^^ error[P0117]: a comment starts with `#`
            y = 3
            x + y
    """)


def test_mathematics() -> None:
    check_messages("""
        def f(t) integral [0, 1] [x < t] dx
        #        ^^^^^^^^ error[P0105]: this `integral` has no `d(...)`
        def f(t) integral (0, 1) [x < t] d(x)
        #        ^^^^^^^^^^^ error[P0104]: the bounds of an integral stand in brackets
        def f(t) integral(0, 1, [x < t], x)
        #        ^^^^^^^^^^ error[P0104]: the bounds of an integral stand in brackets
        def f(t) integral (x in [0, 1]) x d(x)
        #        ^^^^^^^^^^^^^^^^^^^^^^ error[P0117]: the bounds of an integral come first
        def f(t) integral x = 0..t, y in [0, 2*t] x*y
        #        ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ error[P0117]: the bounds of an integral come first
        def f(t) integral x ~ normal(0, 1) [x < t]
        #        ^^^^^^^^^^^^^^^^^^^^^^^^^ error[P0117]: the bounds of an integral come first
        def f(t) integral [0, 1], [0, t] x*y d(x, y)
        #        ^^^^^^^^^^^^^^^^^^^^^^^ error[P0117]: the bounds of several variables stand in parentheses
        def f(t) integral [0, 1] [0, t] x*y d(x) d(y)
        #        ^^^^^^^^^^^^^^^^^^^^^^ error[P0117]: the bounds of several variables stand in parentheses
        def f(t) integral [0, t] x*t d(x) d(t)
        #                                 ^ error[P0117]: an integral ends with one `d(...)`, which names all
        def f(t) integral [0, 1] [x, t*x] d(x)
        def f(t) integral([0, t], 2*x, x)
        #        ^^^^^^^^ error[P0117]: an integral is not a call
        def f(m) integral (normal(m, 1)) [x > 0] d(x)
        #                  ^^^^^^ error[P0104]: expected a variable and `~` before `normal`
        def f(n) sum i = 1..n (i^2)
        #              ^ error[P0104]: expected `in` after the variable of `sum`
        def f(x) -> x^2
        #        ^^ error[P0119]: the body of a `def` follows its head without an arrow
        f = x => x^2
        #     ^^ error[P0117]: a function without a name starts with `\\`, not with an arrow
        def f(t) sum(i in 1..3) i*t
        #           ^ error[P0103]: the variable of a `sum` stands without parentheses
        def f(x) g'(x)
        #         ^ error[P0112]: Potto does not know the character `'`
        def f(x) x – 1
        #          ^ error[P0112]: Potto does not know the character `–`
    """)


@pytest.mark.parametrize(
    ("written", "instead"),
    [
        ("sum(xs)", "sum x in xs (x)"),
        ("sum([1, 2])", "sum x in [1, 2] (x)"),
        ("sum [1, 2]", "sum x in [1, 2] (x)"),
        ("sum(people.height)/2", "sum x in people.height (x)"),
        ("sum(f(a, b))", "sum x in f(a, b) (x)"),
        ("sum(a^2 for a in xs)", "sum a in xs (a^2)"),
        ("sum(i in 1..3) (i)", "sum i in 1..3 (body)"),
        ("sum(i, 1, 3)", "sum i in 1..n (body)"),
        ("sum()", "sum i in 1..n (body)"),
    ],
)
def test_what_is_summed_in_other_languages_is_said_here(written: str, instead: str) -> None:
    for before in ("", "2*", "let a = 1 in "):
        helps = [d.help for d in parse_chunk(f"def f(xs) {before}{written}").diagnostics if d.code == "P0103"]
        assert helps[0] == f"write `{instead}`"


def test_a_line_that_is_indented_more_goes_on() -> None:
    check_messages("""
        def f(x)
            a = x
              b = 2
        #     ^ error[P0113]: this line is indented more than the one above
            a + b
        def g(x)
            if x = 1 then 2 else 3
        #        ^ error[P0108]: `=` names a value; it does not compare
    """)


@pytest.mark.parametrize(
    ("text", "help"),
    [
        ("def f(t) integral [0, 1] t dx", "write `d(x)`"),
        ("def f(t) integral [0, 1] t d θ", "write `d(θ)`"),
        ("def f(t) integral [0, 1] t dx dy", "write `d(x, y)`"),
        ("def f(t) 2*integral x = 0..2*t, y in [0, 1] x", "write `integral ([0, 2*t], [0, 1]) … d(x, y)`"),
        ("def f(t) ∫ x from 0 to 1 of t*x", "write `∫ [0, 1] … d(x)`"),
        ("def f(t) integral x ~ beta(2, t), y in [0, 1] x", "write `integral (x ~ beta(2, t), [0, 1]) … d(x, y)`"),
        ("def f(t) integral([0, t], 2*x, x)", "write `integral [0, t] 2*x d(x)`"),
        ("let f(x) = x^2", "write `def f(…) body`"),
        ("record Row = {x: Real, y: [3] Real}", "write `record Row(x: Real, y: [3] Real)`"),
        ("record Row {x: Real}", "write `record Row(x: Real)`"),
        ("record Row\n    x: Real\n    y: Real", "write `record Row(x: Real, y: Real)`"),
        ("type Row = (x: Real)", "write `record Row(x: Real)`"),
        ("data Row = Row(x: Real)", "write `record Row(x: Real)`"),
        ("struct Row { x: Real; }", "write `record Row(x: Real)`"),
        (
            "p = {x: 1, y: 2*t}",
            "declare `record Point(x: Real, y: Real)` at the top, then write `Point(x=1, y=2*t)`; the type is `Point`",
        ),
        (
            "def f(p: {x: [n] Real}) p.x[0]",
            "declare `record Point(x: [n] Real)` at the top, then write `Point(x=…)`; the type is `Point`",
        ),
        ("p = Point{x = 1}", "write `Point(x=1)`"),
        ("xs = {1, 2}", "write `[1, 2]`"),
        ("xs = 1:10", "write `1..10` where a `sum`, a `for` or an array goes through it"),
        ("def f(xs: Real[]) xs[0]", "the type of an array starts with its size: `[n] Real`"),
        ("def f(xs: Vec<Real>) xs[0]", "the type of an array starts with its size: `[n] Real`"),
        ("def f(xs: List[Real]) xs[0]", "the type of an array starts with its size: `[n] Real`"),
        ("def f(xs: Real[3]) xs[0]", "an array of 3 of them is `[3] Real`"),
        ("def f(a: [n][m] Real) a[0][0]", "between the sizes of an array of arrays is a blank: `[n] [m] Real`"),
        ('xs = read("data.csv")', 'write `load("data.csv")`, with what it holds as a value of the program'),
        ("f x = x", "write `def f(x) …`"),
        ("def f x = x", "write `def f(x)`, or without `def`: `f = …`"),
        ("def f(x y) x", "write `,` between the two"),
        ("f(x, y)(c) = x", "write `def f(x, y)(c) …`"),
        ("x = 0x10", "write `16`"),
        ("x = 1_000", "write `1000`"),
        ("x = 2y", "to multiply, write `2*y`"),
        ("def f(a)\n    (p, q), r = a\n    p", "to make a tuple, write parentheses around it"),
        ("def f(a)\n    p, q = a\n    p", "write `(p, q) = …`"),
        ("u, v = (1, 2)", "write `pair = …`, then `u = fst pair` and `v = snd pair`"),
        ("(u, v) = (1, 2)", "write `pair = …`, then `u = fst pair` and `v = snd pair`"),
        ("u, v, w = (1, 2, 3)", "write `u = let (u, v, w) = … in u`; `v = let (u, v, w) = … in v`"),
        ("d = c with (a.b = 1)", "write `c with a = (c.a with b = …)`"),
        ("d = c with (x = 2, a.b = 1)", "write `c with a = (c.a with b = …)`"),
        ("record R(from: Real)", "choose another name, such as `from_`"),
        ("record R(x: Real, for: Real)", "choose another name, such as `for_`"),
    ],
)
def test_the_hint_is_what_to_write(text: str, help: str) -> None:
    found = [diagnostic for diagnostic, _ in messages(text)]
    assert found[0].help == help and (len(found) == 1 or "dx" in text or "θ" in text or "(p, q)" in text)


@pytest.mark.parametrize("text", ["while(x)", "val = 3", "class (3)", "def function(x) x", "fun 1", "with x"])
def test_words_of_other_languages_are_names_where_that_is_right(text: str) -> None:
    assert messages(text) == []


def test_lines_within_brackets_may_start_in_the_first_column() -> None:
    text = "xs = [\n1,\n# one\n2,\n3\n]\nprint(f(1,\n2))\ndef g(x) (x\n+ 2)\n"
    assert messages(text) == []
    assert [chunk.text.count("\n") for chunk in split(text)] == [5, 1, 1]


@pytest.mark.parametrize(
    "next", ["def g(x) (x)", "y = (1)", "print((1))", "from m import (a)", "for v in (xs): (v)", "diffeo d(x) = (x)"]
)
def test_an_open_bracket_swallows_no_definition(next: str) -> None:
    text = f"def f(a) (a + 1\n{next}\n)"
    assert [chunk.text.partition("\n")[0] for chunk in split(text)] == ["def f(a) (a + 1", next]
    assert len([d for _, parsed in everything(f"def f(a) (a + 1\n{next}") for d in parsed.diagnostics]) == 1
