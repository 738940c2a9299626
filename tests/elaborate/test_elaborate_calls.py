"""Calls: which argument fills which parameter of which group."""

from __future__ import annotations

import pytest
from snippets import elaborated, program, term

from potto.core.terms import Hole, app, const, deriv, global_, lam, mul, proj, sub, tuple_, var
from potto.elaborate import signature

X, Y, P = var("x"), var("y"), var("p")
G = global_("<text>", "g")
DEFINED = "def g(a, b)(c) a - b*c\n"


def names(db, name):
    found = signature(db, "<text>", name)
    return [[slot.name for slot in group] for group in found.groups]


@pytest.mark.parametrize(
    "call",
    ["g(1, x)(y)", "g (1, x) y", "g(1, x, y)", "g(b=x, 1)(y)", "g(b=x, a=1)(c=y)", "g(c=y, 1, x)", "g(1, c=y, b=x)"],
)
def test_keywords_bind_in_any_place_and_the_others_fill_in_order(call):
    assert term(DEFINED + f"def f(x, y) {call}").body is app(app(G, (const(1), X)), (Y,))


def test_a_group_that_gets_nothing_becomes_a_group_of_the_caller():
    whole = app(app(G, (const(1), X)), (var("c"),))
    assert term(DEFINED + "def f(x) g(1, x)") is lam(("x",), lam(("c",), whole))
    assert term(DEFINED + "def f(x) (let h = g(1, x) in h)") is lam(("x",), lam(("c",), whole))
    given = app(app(G, (const(1), const(2))), (var("c"),))
    assert term(DEFINED + "f = g(1, 2)") is lam(("c",), given)
    assert term(DEFINED + "f = g") is G
    dual = app(app(deriv(G), (P,)), (var("dc"),))
    assert term("def g(a)(c) a - c\ndef f(p) deriv(g)(p)") is lam(("p",), lam(("dc",), dual))


@pytest.mark.parametrize("call", ["g(1)", "g(z=1, 2)(3)", "g(1, 2, 3, 4)", "g(1, 2, a=3, b=4)", "g(c=1)", "g()"])
def test_what_does_not_fit_is_a_hole(call):
    assert isinstance(term(DEFINED + f"def f(x) {call}").body, Hole)


def test_a_tuple_for_a_group_and_a_group_for_a_tuple():
    assert term(DEFINED + "def f(p, y) g(p)(y)").body is app(app(G, (proj(P, 0), proj(P, 1))), (Y,))
    assert term(DEFINED + "def f(x, y) let p = (x, 1) in g(p)(y)").body is app(app(G, (X, const(1))), (Y,))
    one = "def g(p) fst(p) + snd(p)\n"
    assert term(one + "def f(x) g(x, 2)").body is app(G, (tuple_((X, const(2))),))
    assert term(one + "def f(x) g((x, 2))").body is app(G, (tuple_((X, const(2))),))
    local = "def f(x, y)\n    h = \\p . fst(p) - snd(p)\n    h(x, y)"
    assert term(local).body is sub(X, Y)


def test_unknown_functions_are_applied_as_it_is_written():
    shader = var("shader")
    assert term("def f(shader, x, y) (shader (x, y)) 2").body is app(app(shader, (X, Y)), (const(2),))
    assert isinstance(term("def f(h, x) h(a=x)").body, Hole)


@pytest.mark.parametrize(
    "call", ["h(2)(x)", "h(2, x)", "h(c=x, 2)", "h(c=x, a=2)", "h(a=2)(c=x)", "let k = h(2) in k(x)"]
)
def test_local_functions_are_evaluated_on_the_spot(call):
    for text in ("\\a . c . a*c", "\\a . \\c . a*c", "\\a . let b = a in \\c . b*c"):
        assert term(f"def f(x)\n    h = {text}\n    {call}").body is mul(const(2), X), text


def test_arguments_may_be_functions():
    text = "def f(x)\n    twice = \\(g, a) . g(g(a))\n    twice(\\y . y*x, x)"
    assert term(text).body is mul(X, X, X)
    assert term("def f(x)\n    use = \\g . g(x, 2)\n    use(\\(a, b) . a - b)").body is sub(X, const(2))
    assert term("def f(x)\n    use = \\g . g(x, 2)\n    use(\\a . b . a - b)").body is sub(X, const(2))
    assert term("def f(x)\n    use = \\g . g(x, 2)\n    use(min)").body is term("def f(x) min(x, 2)").body


def test_signatures_follow_aliases_imports_deriv_and_partial_application():
    db = program(
        DEFINED
        + """\
h = g
k = g(1, 2)
dg = deriv(g)
ddg = deriv(dg)
from m import far
dfar = deriv(far)
def late(a) \\b . a*b
diffeo w(x, y; t) = (x + t, y)
number = 3
""",
        m="far = \\(x, y) . s . x*s",
    )
    assert names(db, "h") == [["a", "b"], ["c"]]
    assert names(db, "k") == [["c"]]
    assert names(db, "dg") == [["da", "db"], ["dc"]]
    assert names(db, "ddg") == [["dda", "ddb"], ["ddc"]]
    assert names(db, "dfar") == [["dx", "dy"], ["ds"]]
    assert names(db, "late") == [["a"], ["b"]]
    assert names(db, "w") == [["x", "y"], ["t"]]
    assert names(db, "number") == []
    assert signature(db, "<text>", "missing") is None


def test_duals_go_to_derivatives_by_name():
    text = "def r(c, s) s(c)\ndr = deriv(r)\ndef f(t) dr(dc=(-2, 1), t)"
    pair = tuple_((const(-2), const(1)))
    assert term(text).body is app(global_("<text>", "dr"), (pair, var("t")))
    text = "def r(c, s) s(c)\ndef f(t) deriv(r)(ds=t, 3)"
    assert term(text).body is app(deriv(global_("<text>", "r")), (const(3), var("t")))
    text = "def f(t) deriv(\\(x, y) . x*y)(dy=(t, 1), 2)"
    assert [type(a).__name__ for a in term(text).body.args] == ["Const", "Tuple"]


def test_a_dual_for_one_parameter_is_a_pair():
    text = "def r(c) c^2\ndef f(t) deriv(r)(t, 1)"
    assert term(text).body is app(deriv(global_("<text>", "r")), (tuple_((var("t"), const(1))),))


def test_calls_have_origins():
    text = DEFINED + "def f(x) g(1, x)(2)"
    spans = [s for _, s in elaborated(text).origins]
    assert len(spans) == 2
