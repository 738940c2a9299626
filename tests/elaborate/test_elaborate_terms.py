"""Each piece of syntax elaborates to the term that it means."""

from __future__ import annotations

import pytest
from snippets import shown, term

from potto.core.terms import (
    INF,
    ONE,
    PI,
    ZERO,
    Hole,
    add,
    app,
    branch,
    const,
    delta,
    deriv,
    div,
    global_,
    if_,
    integral,
    lam,
    list_of,
    mul,
    neg,
    postorder,
    pow_,
    prim,
    proj,
    sub,
    sum_,
    tuple_,
    var,
)
from potto.syntax import parse_chunk

A, B, C, N, T, X, Y = map(var, ("a", "b", "c", "n", "t", "x", "y"))
TWO, THREE = const(2), const(3)


def bracket(*coordinates, strict=False):
    return branch(coordinates, strict, ONE, ZERO)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("pi", PI),
        ("-inf", neg(INF)),
        ("x + y - a", add(X, Y, neg(A))),
        ("x - x", prim("add", X, neg(X))),  # not 0 where x is not finite
        ("x*y/a*b", mul(div(mul(X, Y), A), B)),
        ("x/y/a", div(div(X, Y), A)),
        ("-x^2", neg(pow_(X, TWO))),
        ("x^y^2", pow_(X, pow_(Y, TWO))),
        ("min(x, y, a)", prim("min", X, Y, A)),
        ("clamp(x, a, b)", prim("clamp", X, A, B)),
        ("atan2 (y, x)", prim("atan2", Y, X)),
        ("(x, (y, 2))", tuple_((X, tuple_((Y, TWO))))),
        ("fst (x, y)", X),
        ("snd(t)", proj(T, 1)),
        ("[x, y]", list_of((X, Y))),
        ("sum i in 1..n (i*x)", sum_("i", ONE, N, mul(var("i"), X))),
    ],
)
def test_arithmetic_and_composites(body, expected):
    assert term(f"def f(x, y, a, b, n, t) {body}").body is expected


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        # a < b is a branch on b - a, strict
        ("[x < t]", bracket(sub(T, X), strict=True)),
        ("[x <= t]", bracket(sub(T, X))),
        ("[x > t]", bracket(sub(X, T), strict=True)),
        ("[x >= t]", bracket(sub(X, T))),
        ("[x + y + c >= 0]", bracket(add(X, Y, C))),
        ("[a <= x < b]", branch((sub(X, A),), False, bracket(sub(B, X), strict=True), ZERO)),
        ("[x < a or x > b]", branch((sub(A, X),), True, ONE, bracket(sub(X, B), strict=True))),
        # strictness flips under `not`, and `and` becomes `or`
        ("[not x < t]", bracket(sub(X, T))),
        ("[not x >= t]", bracket(sub(T, X), strict=True)),
        ("[not (x < a and x > b)]", branch((sub(X, A),), False, ONE, bracket(sub(B, X)))),
        ("[not (x < a or x >= b)]", branch((sub(X, A),), False, bracket(sub(B, X), strict=True), ZERO)),
        ("[not not x < a]", bracket(sub(A, X), strict=True)),
        # equality has no surface, nor have numbers that nothing moves
        ("[x == a]", if_(prim("eq", X, A), ONE, ZERO)),
        ("[not x == a]", if_(prim("ne", X, A), ONE, ZERO)),
        ("[1 < 2]", if_(prim("lt", ONE, TWO), ONE, ZERO)),
        # brackets as conditions
        ("if [x < t] then a else b", branch((sub(T, X),), True, A, B)),
        ("if [a < x < b] then 2 else 3", branch((sub(X, A),), True, branch((sub(B, X),), True, TWO, THREE), THREE)),
        ("[x < t] ? a : b", branch((sub(T, X),), True, A, B)),
        # plain ones
        ("if x < t then a else b", if_(prim("lt", X, T), A, B)),
        ("x > t ? a : b", if_(prim("lt", T, X), A, B)),
        ("if x < t and not x == a then a else b",
         if_(prim("and", prim("lt", X, T), prim("not", prim("eq", X, A))), A, B)),
        ("if a < x < b then 2 else 3", if_(prim("and", prim("lt", A, X), prim("lt", X, B)), TWO, THREE)),
        # diffeomorphisms in place
        ("if diffeo(x + y, x - y) then a else b", branch((add(X, Y), sub(X, Y)), False, A, B)),
        ("diffeo(x + y) ? a : b", branch((add(X, Y),), False, A, B)),
    ],
)  # fmt: skip
def test_conditions(body, expected):
    assert term(f"def f(x, y, a, b, c, t) {body}").body is expected


def test_a_comparison_under_a_local_name_is_plain_or_diffeomorphic_as_it_is_used():
    assert shown("def f(x, t)\n    p = x < t\n    if p then 1 else 0") == "\\(x, t) . if x < t then 1 else 0"
    assert term("def f(x, t)\n    p = x < t\n    [p]").body is bracket(sub(T, X), strict=True)
    assert term("def f(x, t)\n    p = x < t\n    [not p]").body is bracket(sub(X, T))
    assert term("def f(x, t)\n    p = [x < t]\n    if p then 2 else 3").body is branch((sub(T, X),), True, TWO, THREE)


def test_the_result_of_an_unknown_diffeomorphism_decides_by_its_first_component():
    call = app(app(var("cond"), (X, Y)), (C,))
    expected = branch((proj(call, 0),), False, A, B)
    assert term("def f(cond, x, y, c, a, b) if cond (x,y) c then a else b").body is expected
    assert term("def f(cond, x, y, c, a, b) ((cond (x, y)) c) ? a : b").body is expected


def test_a_known_diffeomorphism_is_written_into_the_branch():
    text = "def f(x, y, c)\n    cond = \\(x, y) . c . (x + y + c, x - y)\n    if cond (x, y) c then 1 else 0"
    assert term(text).body is bracket(add(X, Y, C), sub(X, Y))


def test_a_diffeomorphism_of_another_definition_is_named_and_not_looked_into():
    text = "diffeo cond(x, y; c) = (x + y + c, x - y)\ndef f(x, y, c) if cond (x, y) c then 1 else 0"
    call = app(app(global_("<text>", "cond"), (X, Y)), (C,))
    assert term(text).body is bracket(proj(call, 0))
    assert term(text, "cond") is lam(("x", "y"), lam(("c",), tuple_((add(X, Y, C), sub(X, Y)))))


def test_deltas():
    assert term("def f(x, t) delta(x - t)").body is delta((sub(X, T),))
    assert term("def f(x, y, t) delta(x - t, y)").body is delta((sub(X, T), Y))
    assert term("def f(x, y, t) delta(diffeo(x - t, y))").body is delta((sub(X, T), Y))
    call = app(app(global_("<text>", "k"), (X, Y)), (T,))
    text = "diffeo k(x, y; t) = (x - t, y)\ndef f(x, y, t) delta(k (x, y) t)"
    assert term(text).body is delta((proj(call, 0), proj(call, 1)))
    text = "def k(x) 2*x\ndef f(x) delta(k(x))"
    assert term(text).body is delta((app(global_("<text>", "k"), (X,)),))


def test_integrals_see_outer_variables_in_their_bounds():
    expected = integral(("x", "y"), ((ZERO, T), (X, ONE)), mul(X, Y))
    assert term("def f(t) integral ([0, t], [x, 1]) x*y d(x, y)").body is expected


def test_measures_become_densities():
    body = term("def f(t) integral (x ~ uniform(0, 2)) x d(x)").body
    assert body is integral(("x",), ((ZERO, TWO),), mul(div(ONE, TWO), X))
    body = term("def f(t) integral (x ~ normal(0, 1), y ~ uniform(x, 2)) (x, y) d(x, y)").body
    assert body.bounds == ((neg(INF), INF), (X, TWO)) and len(body.body.items) == 2 and body.hints[0]


def test_the_density_goes_into_tuples_of_branches_and_calls():
    text = "def g(x) (x, 2*x)\ndef f(t) integral (x ~ uniform(0, 2)) {} d(x)"
    half = div(ONE, TWO)
    call = app(global_("<text>", "g"), (X,))
    found = term(text.format("g(x)")).body.body
    assert found is tuple_((mul(half, proj(call, 0)), mul(half, proj(call, 1))))
    found = term(text.format("if [x < t] then (1, 2) else (3, 4)")).body.body
    ends = (tuple_((half, mul(half, TWO))), tuple_((mul(half, THREE), mul(half, const(4)))))
    assert found is branch((sub(T, X),), True, *ends)


def test_a_measure_with_impossible_parameters_is_no_number():
    body = term("def f(s) integral (x ~ normal(0, s)) x d(x)").body
    assert body.condition is prim("lt", ZERO, var("s")) and isinstance(body.orelse, Hole)


def test_builtins_are_functions():
    assert term("def f(g, x) g(sin, x)").body is app(var("g"), (lam(("x'1",), prim("sin", var("x'1"))), X))
    assert term("f = fst") is lam(("x",), proj(X, 0))
    assert term("f = atan2") is lam(("x", "y"), prim("atan2", X, Y))
    assert term("f = deriv(sin)") is deriv(lam(("x",), prim("sin", X)))


def test_long_chains_are_flat():
    body = term("def f(x) " + " + ".join(["x^2"] * 5000)).body
    assert body.op == "add" and len(body.args) == 5000
    body = term("def f(x) " + "/".join(["x"] * 5000)).body
    assert len(postorder(body)) == 5000  # x and 4999 quotients


@pytest.mark.parametrize(
    ("opening", "inner", "closing"),
    [
        ("(", "x", ")"),
        ("sin(", "x", ")"),
        ("(\\y . y + (", "x", "))(1)"),
        ("let y = x in (", "y", ")"),
        ("[0 < ", "x", "]"),
    ],
)
def test_deep_nesting_does_not_overflow(opening, inner, closing):
    """As deep as the parser goes."""
    texts = ("def f(x) " + opening * depth + inner + closing * depth for depth in range(250, 9, -10))
    deepest = next(text for text in texts if not parse_chunk(text).diagnostics)
    assert not [n for n in postorder(term(deepest)) if isinstance(n, Hole)]


@pytest.mark.parametrize("twice", ["hypot({0}, {0})", "{0}*{0}", "{0} + {0}", "{0}^{0}"])
def test_a_chain_of_local_functions_is_shared_and_not_repeated(twice):
    lines = ["    g0 = \\y . y + a"] + [f"    g{k} = \\y . {twice.format(f'g{k - 1}(y)')}" for k in range(1, 60)]
    body = term("def f(x, a)\n" + "\n".join(lines) + "\n    g59(x)")
    assert len(postorder(body)) < 200
