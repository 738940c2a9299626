"""What names mean: shadowing, fresh binders, files, and functions that are written where they are used."""

from __future__ import annotations

import pytest
from snippets import elaborated, program, shown, term

from potto.core.terms import (
    ONE,
    Hole,
    Integral,
    Lam,
    add,
    app,
    bound_names,
    const,
    global_,
    lam,
    mul,
    neg,
    postorder,
    sub,
    var,
)
from potto.elaborate import (
    BindCore,
    ForCore,
    ShowCore,
    core_term,
    diffeo_core,
    elaborate_expression,
    elaborate_statement,
)
from potto.source import Span
from potto.syntax import parse_chunk, parse_expression

X, Y = var("x"), var("y")


def binders(found):
    return [name for node in postorder(found) for name in bound_names(node)]


def test_an_inner_name_hides_an_outer_one():
    assert shown("def f(x)\n    x = x + 1\n    x = 2*x\n    x") == "\\x . 2*(x + 1)"
    assert shown("def f(x) let x = x + 1 in let x = 3*x in x") == "\\x . 3*(x + 1)"
    assert term("def f(x) (\\x . x + 1)(x^2)").body is add(term("def g(x) x^2", "g").body, ONE)


def test_a_variable_of_integration_hides_a_parameter_in_its_body_but_not_in_its_bounds():
    body = term("def f(x) integral [0, x] x d(x)").body
    assert body.bounds[0][1] is X and body.body is var("x'1")


def test_binders_are_distinct():
    inner = "integral [0, 1] (integral [0, x] x d(x)) d(x)"
    found = term(f"def f(x) (integral [0, 1] x d(x))*({inner}) + sum x in 1..3 (x)")
    assert len(binders(found)) == len(set(binders(found))) == 5


def test_a_function_that_is_used_twice_binds_anew():
    found = term("def f(t)\n    g = \\a . integral [0, a] x d(x)\n    g(t)*g(g(t))")
    assert len(set(binders(found))) == len(binders(found)) == 3  # t, and one x for each argument


def test_arguments_are_not_captured():
    text = "def f(x)\n    g = \\a . integral [0, 1] a*x d(x)\n    g(x)"
    body = term(text).body
    assert body.body is mul(X, var(body.variables[0])) and body.variables[0] != "x"


def test_local_functions_see_the_names_where_they_are_written():
    assert term("def f(x)\n    y = x\n    g = \\a . a + y\n    y = 5\n    g(y)").body is add(X, const(5))


def test_user_names_shadow_builtins_and_constants():
    assert term("def f(pi) pi").body is var("pi")
    assert term("pi = 3\ndef f(x) pi*x").body is mul(global_("<text>", "pi"), X)
    assert term("def f(sin, x) sin(x)").body is app(var("sin"), (X,))
    assert term("def delta(x) x\ndef f(x) delta(x)").body is app(global_("<text>", "delta"), (X,))
    assert term("def f(e) e").body is var("e")


def test_definitions_of_other_files_are_named_by_their_own_file():
    other = "def g(x) x\ndef k(x) x"
    assert term("from m import g as h\ndef f(x) h(x)", m=other).body is app(global_("/m.po", "g"), (X,))
    assert term("import m\ndef f(x) m.k(x)", m=other).body is app(global_("/m.po", "k"), (X,))
    found = term("from re import g\ndef f(x) g(x)", re="from m import g", m=other)
    assert found.body is app(global_("/m.po", "g"), (X,))
    assert isinstance(term("import m\ndef f(m, x) m.k(x)", m=other).body, Hole)  # a parameter hides the module


def test_recursion_is_a_reference():
    assert shown("def f(n) if n > 0 then n*f(n - 1) else 1") == "\\n . if 0 < n then n*f(n - 1) else 1"


def test_what_is_wrong_is_a_hole_without_a_word():
    for text in ("def f(x) nothing", "def f(x) g.h", "def f(x) 2(x)", "def f(x) sin(x, x)", "def f(x) (\\y . y)(z=1)"):
        found = elaborated(text)
        assert isinstance(found.term.body, Hole), text


def test_applying_a_function_to_itself_ends():
    holes = [n for n in postorder(term("f = (\\x . x x)(\\x . x x)")) if isinstance(n, Hole)]
    assert holes


def test_destructuring_of_known_and_unknown_tuples():
    assert term("def f(x, y)\n    (u, v) = (x + y, x - y)\n    u*v").body is mul(add(X, Y), sub(X, Y))
    assert shown("def f(p)\n    (u, v) = p\n    u - v") == "\\p . (p.0 - p.1)"


def test_origins_are_the_places_in_the_chunk():
    text = "def f(t, g) integral [0, 1] [x < t and 1 <= g(x)]*delta(x - t) d(x)"
    found = {type(t).__name__ + ("" if s is None else text[s.start : s.end]) for t, s in elaborated(text).origins}
    assert found == {
        "Branch" + "x < t",
        "Branch" + "1 <= g(x)",
        "App" + "g(x)",
        "Delta" + "delta(x - t)",
        "Integral" + text[12:],
    }


def test_moving_a_definition_or_renaming_a_space_leaves_its_term():
    db = program("def f(x) x + 1")
    before = core_term(db, "<text>", "f")
    db.set_input(("overlay", "<text>"), "\n\n# moved\ndef f(x)   x+1")
    assert core_term(db, "<text>", "f") is before


def test_a_body_edit_of_a_callee_elaborates_no_caller_again():
    db = program("def g(a, b) a*b\ndef f(x) g(b=x, 2)")
    core_term(db, "<text>", "f")
    db.set_input(("overlay", "<text>"), "def g(a, b) b*a + a\ndef f(x) g(b=x, 2)")
    with db.recording() as events:
        core_term(db, "<text>", "f")
    assert not [e for e in events if e.kind == "executed" and e.query == "core" and e.args[1] == "f"]


@pytest.mark.parametrize(
    "edited, runs",
    [
        ("def g(c, d) [c < d]*c", False),  # other names, and something jumps
        ("def g(a: (Real, Real), b) a.x*b", True),
        ("def g(a, b, c) a*b*c", True),
    ],
)
def test_a_term_rests_on_the_shapes_of_what_it_calls(edited, runs):
    db = program("def g(a, b) a*b\ndef f(x) g(x, 2) + integral [0, 1] g(x, y) d(y)")
    core_term(db, "<text>", "f")
    db.set_input(("overlay", "<text>"), edited + "\ndef f(x) g(x, 2) + integral [0, 1] g(x, y) d(y)")
    with db.recording() as events:
        core_term(db, "<text>", "f")
    assert bool([e for e in events if e.kind == "executed" and e.query == "core" and e.args[1] == "f"]) == runs


def test_a_call_with_keywords_follows_the_names_of_parameters():
    db = program("def g(a, b) a - b\ndef f(x) g(b=x, 2)")
    assert core_term(db, "<text>", "f") is term("def g(a, b) a - b\ndef f(x) g(2, x)")
    db.set_input(("overlay", "<text>"), "def g(b, a) b - a\ndef f(x) g(b=x, 2)")
    assert core_term(db, "<text>", "f") is term("def g(b, a) b - a\ndef f(x) g(x, 2)")


def test_expressions_with_locals():
    db = program("def g(a, b) a - b")
    expr = parse_expression("g(b=v, w)").expr
    found = elaborate_expression(db, "<text>", expr, ("v", ("w", ONE))).term
    assert found is app(global_("<text>", "g"), (ONE, var("v")))
    body = parse_expression("integral [0, 1] x*v d(x) + x").expr
    found = elaborate_expression(db, "<text>", body, ("x", "v")).term
    assert isinstance(found, Integral) or found.args[0].variables != ("x",)  # the free x is not captured
    assert found.free == {"x", "v"}


def test_statements():
    db = program("")
    item = parse_chunk("print(1, x)").item
    found = elaborate_statement(db, "<text>", item, ("x",))
    assert isinstance(found, ShowCore) and [v.term for v in found.values] == [ONE, X]
    item = parse_chunk("for v in [1, 2]:\n    (a, b) = (v, 1)\n    print(a)").item
    loop = elaborate_statement(db, "<text>", item)
    assert isinstance(loop, ForCore) and loop.variable == "v" and len(loop.iterable.term.items) == 2
    inner = elaborate_statement(db, "<text>", loop.body[0], ("v",))
    assert isinstance(inner, BindCore) and inner.names == ("a", "b") and inner.value.term.items == (var("v"), ONE)


def test_the_parts_of_a_diffeomorphism():
    text = """\
diffeo k(x, y; c) = (x + c, y*x)
    inverse (u, v) . (u - c, v/(u - c))
    where x > 0, y > 0
"""
    parts = diffeo_core(program(text), "<text>", "k")
    assert parts.variables == ("x", "y") and parts.groups == (("c",),)
    assert parts.components == (add(X, var("c")), mul(Y, X))
    assert parts.inverse.values == ("u", "v") and parts.inverse.components[0] is sub(var("u"), var("c"))
    assert len(parts.where) == 2
    assert diffeo_core(program("def f(x) x"), "<text>", "f") is None


def test_a_definition_without_parameters_is_its_term():
    assert term("f = 2*3") is const(6)
    assert term("g = \\x . x\nf = g") is global_("<text>", "g")
    assert term("f = \\(x, y) . c . x - c") is lam(("x", "y"), lam(("c",), add(X, neg(var("c")))))
    assert isinstance(term("def f(x) \\y . x + y").body, Lam)
    assert Span(0, 0) not in {s for _, s in elaborated("def f(x) sin(x)").origins}
