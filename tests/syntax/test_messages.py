"""What is said of each mistake, and where."""

from __future__ import annotations

import pytest
from syntax_help import check_messages, messages

from potto.syntax import parse_chunk, print_item


def test_an_expression_is_missing() -> None:
    check_messages("""
        x = 1 +
        #     ^ error[P0101]: expected an expression after `+`
        y = f(a, , b)
        #      ^ error[P0101]: expected an expression after `,`
        z = [a and]
        #      ^^^ error[P0101]: expected an expression after `and`
        w = a + * b
        #     ^ error[P0101]: expected an expression after `+`
        v = (*b)
        #   ^ error[P0101]: expected an expression after `(`
        u = if p then else 1
        #        ^^^^ error[P0101]: expected an expression after `then`, before `else`
        t =
        # ^ error[P0101]: expected an expression after `=`
        s = integral [0, 1] d(x)
        #                   ^ error[P0101]: expected what is integrated before `d(...)`
        r = ()
        #   ^^ error[P0101]: there is nothing between these parentheses
    """)


def test_an_integral_alone_is_one_mistake() -> None:
    check_messages("""
        x = integral
        #   ^^^^^^^^ error[P0104]: expected the bounds after `integral`
        def f(t) integral
        #        ^^^^^^^^ error[P0104]: expected the bounds after `integral`
        y = (integral)
        #    ^^^^^^^^ error[P0104]: expected the bounds after `integral`
    """)


def test_brackets() -> None:
    check_messages("""
        x = (1 + 2
        #   ^ error[P0102]: this `(` is never closed
        y = [1, 2)
        #        ^ error[P0102]: this `)` does not close the `[`
        z = 1)
        #    ^ error[P0102]: this `)` closes nothing
        w = f([1, 2)
        #     ^ error[P0102]: this `[` is never closed
        def f(t)
            a = (1 + t
        #       ^ error[P0102]: this `(` is never closed
            a*2
    """)


def test_an_unclosed_bracket_is_closed_where_the_indentation_says_so() -> None:
    found = parse_chunk("def f(t)\n    a = (1 + t\n    a*2").item
    assert found is not None
    assert print_item(found) == "def f(t)\n    a = (1 + t)\n    a * 2"


def test_a_bracket_says_where_it_was_opened() -> None:
    ((found, _),) = messages("y = [1, 2)")
    assert [(related.span.start, related.message) for related in found.related] == [(4, "opened here")]


def test_what_does_not_belong() -> None:
    check_messages("""
        def f(x) x then y
        #          ^^^^ error[P0103]: unexpected `then`
        x = a, b
        #    ^ error[P0103]: unexpected `,`
        x = (a; b)
        #     ^ error[P0103]: a `;` separates
    """)


def test_unfinished() -> None:
    check_messages("""
        def f(x) if x > 0 x else 1
        #                   ^^^^ error[P0104]: expected `then` after the condition of `if`
        def f(x) if x > 0: x else 1
        #                ^ error[P0104]: expected `then` after the condition of `if`
        def f(x) if x > 0 then x
        #                      ^ error[P0104]: expected `else` after the first choice of `if`
        x = let a = 1
        #           ^ error[P0104]: expected `in` after the names of `let`
        x = p ? a
        #       ^ error[P0104]: expected `:` after the first choice of `? :`
        x = sum i in 1..n i
        #                 ^ error[P0104]: expected the body of `sum` in parentheses
        x = sum i in 0..len(u)-1 u
        #                        ^ error[P0104]: expected the body of `sum` in parentheses
        x = integral x d(x)
        #   ^^^^^^^^ error[P0104]: expected the bounds after `integral`
        x = integral [0] x d(x)
        #            ^^^ error[P0104]: an interval has two ends
        x = \\y y
        #      ^ error[P0104]: expected `.` after the parameters of a lambda
    """)


@pytest.mark.parametrize(
    ("text", "code", "place", "message"),
    [
        ("for v in [1, 2]", "P0104", "for", "this `for` has no statements"),
        ("for v in [1, 2] print(v)", "P0104", "print", "expected `:` before the statement of this `for`"),
        ("while x > 0: print(x)", "P0117", "while", "Potto has no `while`"),
        ("function f(x) { return x }", "P0117", "function", "Potto has no `function`"),
        ("var x = 3", "P0117", "var", "Potto has no `var`"),
        ("// a comment", "P0117", "//", "a comment starts with `#`, not with `//`"),
        ("else", "P0103", "else", "unexpected `else`"),
        ("import", "P0118", "import", "expected a module after `import`"),
        ("from .m import a", "P0118", ".", "a module's name does not begin with a dot"),
        ("from ..m import a", "P0118", "..", "a module's name does not begin with a dot"),
        ("import a, b", "P0118", ",", "one `import` takes one module"),
        ("x = sum(y)", "P0103", "(", "the variable of a `sum` stands without parentheses, its terms stand in them"),
        ("x = 1 if p else 2", "P0103", "if", "unexpected `if`"),
        ("def", "P0115", "def", "expected a name after `def`"),
        ("f(x) = x^2", "P0119", "f(x)", "a function with parameters is defined with `def`"),
        ("x == 3 = 4", "P0115", "x == 3", "only a name can be defined"),
        ("def f(x)", "P0101", "f", "`f` has no body"),
    ],
)
def test_chunks_that_start_with_their_mistake(text: str, code: str, place: str, message: str) -> None:
    ((found, under),) = messages(text)
    assert (found.code, under, found.message) == (code, place, message)


def test_an_integral_without_its_variables() -> None:
    check_messages("""
        def f(t) integral [0, 1] x*t
        #        ^^^^^^^^ error[P0105]: this `integral` has no `d(...)`
        x = (integral [0, 1] x, 2)
        #    ^^^^^^^^ error[P0105]: this `integral` has no `d(...)`
        y = ∫ [0, 1] x
        #   ^ error[P0105]: this `∫` has no `d(...)`
    """)


def test_the_last_line() -> None:
    check_messages("""
        def f(x)
            a = x
        #   ^^^^^ error[P0106]: a definition's last line must be its result
        def f(x)
            x + 1
        #   ^^^^^ error[P0106]: the value of this line is lost
            x
    """)


def test_reserved_words() -> None:
    check_messages("""
        def sum(x) x
        #   ^^^ error[P0107]: `sum` is a reserved word and can't be a name
        def f(x)
            for = 3
        #   ^^^ error[P0107]: `for` is a reserved word
            x
        def f(in) 1
        #     ^^ error[P0107]: `in` is a reserved word
    """)


def test_equals() -> None:
    check_messages("""
        y = if x = 3 then 1 else 2
        #        ^ error[P0108]: `=` names a value; it does not compare
        y = [x = 3]
        #      ^ error[P0108]: `=` names a value
        y = (x = 3)
        #    ^^^^^ error[P0108]: names an argument, but this is not a call
        y = x = 3
        #     ^ error[P0108]: `=` names a value
    """)


def test_bounds() -> None:
    check_messages("""
        x = integral [0, 1] x d(x, y)
        #                     ^^^^^^^ error[P0109]: 2 variables of integration, but bounds for 1
        x = integral ([0, 1], [0, 1]) x d(x)
        #                               ^^^^ error[P0109]: 1 variable of integration, but bounds for 2
        x = integral (x ~ normal(0, 1), [0, 1]) x d(y, x)
        #                                           ^ error[P0109]: this variable is `y`, but its bound is for `x`
    """)


@pytest.mark.parametrize("body", ["x*y", "(x*y)", "[x + y < 1]"])
def test_bounds_beside_each_other(body: str) -> None:
    ((found, _),) = messages(f"a = integral [0, 1] [0, 1] {body} d(x, y)")
    assert found.code == "P0117" and found.help == "write `integral ([0, 1], [0, 1]) … d(x, y)`"


def test_duplicates() -> None:
    check_messages("""
        def f(x, x) x
        #        ^ error[P0110]: the parameter `x` is here twice
        def f(x)(x) x
        #        ^ error[P0110]: the parameter `x` is here twice
        y = integral ([0, 1], [0, 1]) x d(x, x)
        #                                    ^ error[P0110]: the variable of integration `x` is here twice
        y = \\(a, a) . a
        #        ^ error[P0110]: the parameter `a` is here twice
        y = f(a=1, a=2)
        #          ^ error[P0110]: the argument `a` is here twice
        y = let (a, a) = (1, 2) in a
        #           ^ error[P0110]: the name `a` is here twice
    """)


@pytest.mark.parametrize(
    ("text", "place", "help"),
    [
        ("x = 1.2.3", "1.2.3", "write `2`, `0.5` or `1e-3`"),
        ("x = 2y", "2y", "to multiply, write `2*y`"),
        ("x = 1e", "1e", "to multiply, write `1*e`"),
        ("x = 1_000", "1_000", "write `1000`"),
        ("x = .5", ".5", "write `0.5`"),
    ],
)
def test_bad_numbers(text: str, place: str, help: str) -> None:
    ((found, under),) = messages(text)
    assert (found.code, under, found.help) == ("P0111", place, help)


@pytest.mark.parametrize(
    ("text", "place", "part"),
    [
        ("x = a $ b", "$", "`$`"),
        ("x = a @@@ b", "@@@", "`@`"),
        ("x = y²", "²", "superscript two"),
        ("x = {a}", "{", "`{`"),
        ("x = \0", "\0", "not text"),
        ("x = \u200b1", "\u200b", "U+200B (zero width space)"),
    ],
)
def test_unknown_characters(text: str, place: str, part: str) -> None:
    found, under = messages(text)[0]
    assert (found.code, under) == ("P0112", place)
    assert part in found.message


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("def f(t)\n      a = t\n    a", "    "),
        ("def f(t)\n\ta = t\n        a", "        "),
        ("  x = 1", "  "),
    ],
)
def test_indentation(text: str, place: str) -> None:
    ((found, under),) = messages(text)
    assert (found.code, under) == ("P0113", place)


def test_records() -> None:
    check_messages("""
        record Nothing()
        #             ^^ error[P0122]: a record needs at least one field
        record Untyped(x, y: Real)
        #              ^ error[P0122]: the field `x` has no type
        record Joined(x: Real y: Real)
        #                     ^ error[P0122]: expected `,` before `y`
    """)


def test_names() -> None:
    check_messages("""
        def f(3) x
        #     ^ error[P0115]: `3` is not a name: a parameter must be one
        def f((a, b), c) a
        #     ^^^^^^ error[P0115]: `(a, b)` is not a name: a parameter must be one
        def f(n) fold ((a, b), c) = ((1, 2), 3) for i in 1..n (((a + c, b), c))
        #              ^^^^^^ error[P0115]: `(a, b)` is not a name: a state must be one
        fold ((a, b), c) = ((1, 2), 3) for i in 1..3 (((a + c, b), c))
        #     ^^^^^^ error[P0115]: `(a, b)` is not a name: a state must be one
        x = sum (a, b) in [(1, 2)] (a*b)
        #       ^ error[P0103]: what goes through an array has one name
        def f(a=1) a
        #     ^^^ error[P0115]: a parameter can't have a default value
        x = integral [0, 1] x d(2*x)
        #                       ^^^ error[P0115]: `2*x` is not a name: a variable of integration must be one
        x = a.
        #   ^^ error[P0115]: expected a name after `a.`
        x = let 3 = 4 in 5
        #       ^ error[P0115]: only a name, or names in parentheses, can stand before `=`
        x = (a: Real)
        #    ^^^^^^^ error[P0115]: only a parameter can be given a type
    """)


def test_types() -> None:
    check_messages("""
        def f(a: [1.5] Real) a
        #         ^^^ error[P0116]: a size is a whole number or a name
        def f(a: [3]) a
        #        ^^^ error[P0116]: the type of the elements is missing
        def f(a: Dist) a
        #        ^^^^ error[P0116]: a distribution names its variables
        def f(a: Diffeo[x]) a
        #        ^^^^^^^^^ error[P0116]: `Diffeo` takes the number of its variables
        def f(a: ()) a
        #        ^^ error[P0116]: there is no empty type
    """)


def test_other_languages() -> None:
    check_messages("""
        x = a ** b
        #     ^^ error[P0117]: `**` is written `^` in Potto
        x = a && b || c
        #     ^^ error[P0117]: `&&` is written `and` in Potto
        #          ^^ error[P0117]: `||` is written `or` in Potto
        x = "hello"
        #   ^^^^^^^ error[P0117]: Potto has no text strings
        def f(x) return x
        #        ^^^^^^ error[P0117]: Potto has no `return`
    """)


def test_imports() -> None:
    check_messages("""
        from m import *
        #             ^ error[P0118]: an import says which names it takes
        from m import
        #      ^^^^^^ error[P0118]: expected a name after `import`
        from m
        #    ^ error[P0118]: expected `import` after the module
    """)


def test_heads() -> None:
    check_messages("""
        def f(x) = 3
        #        ^ error[P0119]: a `def` has no `=`
        def f 3
        #   ^ error[P0119]: `f` has no parameters
    """)


def test_diffeomorphisms() -> None:
    ((found, under),) = messages("c = (x, y)", diffeo=True)
    assert (found.code, under) == ("P0120", "(x, y)")
    ((found, under),) = messages("diffeo c() = 3")
    assert (found.code, under) == ("P0120", "c")


def test_print_takes_no_named_arguments() -> None:
    ((found, under),) = messages("print(a=1)")
    assert (found.code, under) == ("P0121", "a")


@pytest.mark.parametrize("broken", ["x + ", "(", "if x then", "integral [0, 1] x +", "let a =", "f(1, 2", "a b = c"])
def test_a_broken_definition_keeps_its_name_and_parameters(broken: str) -> None:
    parsed = parse_chunk(f"def f(x, y)(z)\n    a = x\n    {broken}")
    assert parsed.diagnostics
    assert parsed.item is not None
    assert print_item(parsed.item).startswith("def f(x, y)(z)\n    a = x\n")


def test_arrays_and_folds() -> None:
    check_messages("""
        x = fold s = 0 for i in 1..3
        #                          ^ error[P0104]: expected the step of `fold` in parentheses
        x = (c with a = 1, b = 2)
        #                  ^^^^^ error[P0108]: `b = …` stands behind a `with` of one field
        x = xs[0:2]
        #       ^ error[P0103]: an index is one place, not a range
        x = xs[0..2]
        #       ^^ error[P0103]: an index is one place, not a range
        x = [2*y for y in [1, 2] if y > 1]
        #                        ^^ error[P0103]: an array has no filter: its size is known before its elements
        x = sum y in ys if y > 1 (y)
        #               ^^ error[P0103]: `sum` has no filter
        x = sum i in 1..3: i
        #                ^ error[P0104]: expected the body of `sum` in parentheses, without `:`
        x = fold s = 0 for i in 1..3: s + i
        #                           ^ error[P0104]: expected the step of `fold` in parentheses, without `:`
        x = [(i, j) for i in 1..2 for j in 1..2]
        #                         ^^^ error[P0103]: unexpected `for`
        x = c with a = 1, b = 2
        #               ^ error[P0103]: one field follows `with`
        x = c with a.b = 1
        #          ^^^ error[P0115]: `with` changes a field of the record, and `a.b` is a part of one
    """)
