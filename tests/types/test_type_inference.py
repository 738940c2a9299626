"""Types as they are inferred and printed."""

from __future__ import annotations

import re

import pytest
from marks import FOLDER, database, local_types, type_of

import potto
from potto.syntax import parse_expression
from potto.types import (
    ArrayOf,
    Diffeo,
    Dist,
    Function,
    Parameter,
    Real,
    TupleOf,
    Type,
    TypeVariable,
    derivative_type,
    format_type,
    infer_expression,
)
from potto.types.types import Count

STAR = Real(star=True)

TYPES = [
    # scalars and what must be plain
    ("def f(x) x^2", "(x: Real*) -> Real"),
    ("def f(x) if x > 0 then x else 1", "(x: Real) -> Real"),
    ("def f(x) if [x > 0] then x else 1", "(x: Real*) -> Real"),
    ("def f(x, y) floor(x)*y", "(x: Real, y: Real*) -> Real"),
    ("def f(n, y) sum i in 1..n (i*y)", "(n: Real, y: Real*) -> Real"),
    ("def f(x) [x == 2]", "(x: Real) -> Real"),
    ("k = 2*pi", "Real"),
    # parameters of integrals
    ("def f(t) integral [0, 1] [x < t] d(x)", "(t: Real) -> Real"),
    ("def f(t) integral [0, t] x d(x)", "(t: Real) -> Real"),
    ("def f(t) integral (x ~ normal(0, t)) x^2 d(x)", "(t: Real) -> Real"),
    ("def f(t, u) u + (integral [0, t] x d(x))", "(t: Real, u: Real*) -> Real"),
    # functions
    (r"f = \(x, y) . c . x*y + c", "(x: Real*, y: Real*) -> (c: Real*) -> Real"),
    (r"f = \(x, y) . \c . x*y + c", "(x: Real*, y: Real*) -> (c: Real*) -> Real"),
    ("def f(g, x) g(x) + 1", "(g: a -> Real, x: a) -> Real"),
    ("def f(g, x) g(x)", "(g: a -> b, x: a) -> b"),
    ("def f(g, x) g(g(x + 1))", "(g: Real* -> Real, x: Real*) -> Real"),
    ("def f(g, c) integral [0, 1] g(x) c d(x)", "(g: Real* -> a -> Real, c: a) -> Real"),
    ("def f(h) h(sin)", "(h: (Real* -> Real) -> a) -> a"),
    ("def f(h) h(floor)", "(h: (Real -> Real) -> a) -> a"),
    ("f = sin", "Real* -> Real"),
    ("f = max", "(Real*, Real*) -> Real"),
    (r"f = (\(x, y) . \c . x*y*c)(1, 2)", "(c: Real*) -> Real"),
    # tuples, lists, diffeomorphisms
    ("def f(p) fst(p) + 1", "(p: (Real*, a)) -> Real"),
    ("def f(p) (snd(p), fst(p))", "(p: (a, b)) -> (b, a)"),
    ("def f(x)\n    (a, b) = (x, 2*x)\n    (b, a, 1)", "(x: Real*) -> (Real, Real, Real)"),
    ("f = [1, 2]", "[2] Real"),
    ("f = [sin, floor]", "[2] (Real* -> Real)"),
    ("diffeo f(x, y; c) = (x + c, y)", "(x: Real*, y: Real*) -> (c: Real*) -> Diffeo[2]"),
    ("diffeo f(x; c) = (x - c)", "(x: Real*) -> (c: Real*) -> Diffeo[1]"),
    ("def f(c, k) integral [0, 1] (k(x, c) ? 1 : 0) d(x)", "(c: a, k: (Real*, a) -> Diffeo[n]) -> Real"),
    # type variables
    ("def f(x) x", "(x: a) -> a"),
    ("def f(x, y) x", "(x: a, y: b) -> a"),
    (r"f = \x . \y . x", "(x: a) -> (y: b) -> a"),
    ("def f(x)\n    same = \\y . y\n    same(same(x)) + fst((same(1), same((x, x))))", "(x: Real*) -> Real"),
    # recursion
    ("def f(n) if n > 0 then n*f(n - 1) else 1", "(n: Real) -> Real"),
    ("def f(x, n) if n > 0 then x*f(x, n - 1) else 1", "(x: Real*, n: Real) -> Real"),
    ("def f(g, x, n) if n > 0 then g(f(g, x, n - 1)) else x", "(g: a -> a, x: a, n: Real) -> a"),
    # annotations
    ("def f(x: Real) x^2", "(x: Real) -> Real"),
    ("def f(x: Real*) x^2", "(x: Real*) -> Real"),
    ("def f(p: (Real*, Real)) fst(p)", "(p: (Real*, Real)) -> Real"),
    # derivatives
    ("def g(x) x^2\nf = deriv(g)", "(dx: (Real*, Real*)) -> (Real, Real)"),
    ("def g(x) if x > 0 then x else 0\nf = deriv(g)", "(dx: (Real, Real)) -> (Real, Real)"),
    ("def g(x) [x > 0]\nf = deriv(g)", "(dx: (Real*, Real*)) -> (Real, Dist[dx])"),
    ("def g(x, y) (x*y, [x > 1])\nf = deriv(g)",
     "(dx: (Real*, Real*), dy: (Real*, Real*)) -> ((Real, Real), (Real, Dist[dx]))"  # values, tangents
    ),
    ("def g(p) fst(p) + 1\nf = deriv(g)", "(dp: ((Real*, Real*), (Real*, Real*))) -> (Real, Real)"),
    ("def g(p) (fst(p)*snd(p), 1, 2)\nf = deriv(g)",
     "(dp: ((Real*, Real*), (Real*, Real*))) -> ((Real, Real, Real), (Real, Real, Real))"),
    (r"f = deriv(\x . 1)", "(dx: (Real*, Real*)) -> (Real, Real)"),
    (r"f = deriv(deriv(\x . x^3))",
     "(ddx: ((Real*, Real*), (Real*, Real*))) -> ((Real, Real), (Real, Real))"),
    ("def f(g, t) snd(deriv(g)((t, 1)))", "(g: Real* -> Real, t: Real*) -> Real"),
    ("def g(s, c) integral [0, 1] s(x)*c d(x)\ndef f(c) deriv(g)(deriv(sin), c)", "(c: (Real, Real)) -> (Real, Real)"),
    # distributions
    (r"f = \y . delta(y - 1)", "(y: Real*) -> Dist[y]"),
    (r"f = \(x, y) . 2*delta(x + y) + x", "(x: Real*, y: Real*) -> Dist[x, y]"),
    ("def f(t) integral [0, 1] delta(x - t) d(x)", "(t: Real) -> Real"),
    ("def f(t, y) integral [0, 1] delta(y - t)*x d(x)", "(t: Real, y: Real) -> Dist[t, y]"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), TYPES, ids=[text for text, _ in TYPES])
def test_types(text: str, expected: str) -> None:
    assert type_of(text, "f" if re.search(r"^(def |diffeo )?f\b", text, re.M) else "k") == expected


@pytest.mark.parametrize("text", [text for text, _ in TYPES])
def test_renaming_bound_names_changes_no_type(text: str) -> None:
    """Alpha-renaming: what is bound has other names, and the types say the same but for the names they show."""
    names = ("x", "y", "t", "c", "p", "n", "g", "h", "u", "k", "a", "b", "s", "same")
    name = "f" if re.search(r"^(def |diffeo )?f\b", text, re.M) else "k"
    defined = set(re.findall(r"^(?:def |diffeo )?(\w+)", text, re.M))

    changed = re.sub(
        rf"\b({'|'.join(names)})\b", lambda m: m.group(0) if m.group(0) in defined else m.group(0) + "_2", text
    )
    before, after = type_of(text, name), type_of(changed, name)
    assert re.sub(r"_2\b", "", after) == before


def test_types_inside_an_integral_say_what_they_vary_with() -> None:
    found = local_types(r"""
        def f(t)
            u = 2*t
            integral ([0, 1], [0, u]) (let v = x*t; w = x*y; s = \q . q + x; z = delta(x - t) in s(v) + w*z) d(x, y)
    """)
    assert found == {
        "t": "Real",
        "u": "Real",
        "x": "Real[x]",
        "y": "Real[y]",
        "v": "Real[x]",
        "w": "Real[x, y]",
        "s": "(q: Real*) -> Real",
        "q": "Real",
        "z": "Dist[x]",
    }


def test_expressions() -> None:
    db = database("def f(a, b) a*b\nk = 3")
    key = FOLDER + "main.po"

    def type_text(text: str) -> str:
        inferred = infer_expression(db, key, parse_expression(text).expr)
        assert inferred.diagnostics == ()
        return format_type(inferred.type)

    assert type_text("f") == "(a: Real*, b: Real*) -> Real"
    assert type_text("f(k, 2)") == "Real"
    assert type_text("deriv(f)") == "(da: (Real*, Real*), db: (Real*, Real*)) -> (Real, Real)"
    assert type_text("[f(1, 2), k]") == "[2] Real"
    assert type_text(r"\x . x") == "(x: a) -> a"


def test_expressions_with_further_names() -> None:
    db = database("def f(a, b) a*b")
    expr = parse_expression("g(f(u, 2))").expr
    locals = (("u", Real()), ("g", Function((Parameter("x", STAR),), TupleOf((Real(), Real())))))
    inferred = infer_expression(db, FOLDER + "main.po", expr, locals)
    assert (format_type(inferred.type), inferred.diagnostics) == ("(Real, Real)", ())


def test_an_expression_with_a_mistake() -> None:
    db = database("def f(a, b) a*b")
    inferred = infer_expression(db, FOLDER + "main.po", parse_expression("f(1, 2, 3)").expr)
    assert [d.code for d in inferred.diagnostics] == ["P0308"]


PRINTED: list[tuple[Type, str]] = [
    (Real(), "Real"),
    (STAR, "Real*"),
    (Real(variables=("x", "y")), "Real[x, y]"),
    (Dist(("x",)), "Dist[x]"),
    (TupleOf((Real(), STAR)), "(Real, Real*)"),
    (ArrayOf(Count(3), Real()), "[3] Real"),
    (Diffeo(2), "Diffeo[2]"),
    (Diffeo(None), "Diffeo[n]"),
    (Function((Parameter(None, Real()),), Real()), "Real -> Real"),
    (Function((Parameter(None, TupleOf((Real(), Real()))),), Real()), "((Real, Real)) -> Real"),
    (Function((Parameter(None, Function((Parameter(None, Real()),), Real())),), Real()), "(Real -> Real) -> Real"),
    (
        Function((Parameter("x", TypeVariable("q")), Parameter(None, TypeVariable("r"))), TypeVariable("q")),
        "(x: a, b) -> a",
    ),
    (Function((), Real()), "() -> Real"),
]


@pytest.mark.parametrize(("type", "text"), PRINTED, ids=[text for _, text in PRINTED])
def test_printing(type: Type, text: str) -> None:
    assert format_type(type) == text


def test_derivative_types() -> None:
    """Language, section 3: D Real = (Real, Real), where it jumps (Real[x], Dist[x])."""
    assert format_type(derivative_type(Real())) == "(Real, Real)"
    assert format_type(derivative_type(Real(variables=("x",)))) == "(Real[x], Real[x])"
    assert format_type(derivative_type(Real(variables=("x",), jumps=("x",)))) == "(Real[x], Dist[x])"
    f = Function((Parameter("x", STAR),), Real(jumps=("x",)))
    assert format_type(derivative_type(f)) == "(dx: (Real*, Real*)) -> (Real, Dist[dx])"


def test_a_function_that_is_passed_jumps_over_what_it_is_given() -> None:
    """Its jumps are integrated over where the function that calls it does, or where that one's caller does."""
    m = potto.compile(r"""
def cover(shape) integral ([-1, 1], [-1, 1]) shape(x, y) d(x, y)
def on(shape) cover(shape)
def line(shape, y) integral [-1, 1] shape(x, y) d(x)
def twice(shape, y) (integral [-1, 1] shape(x, y) d(x)) + shape(y, y)
def app(k, y) k(y)
def disc(r) cover(\(x, y) . [x^2 + y^2 < r])
def passed_on(r) on(\(x, y) . [x < r])
def plain(r) cover(\(x, y) . [r > 1]*x)
def across(r, y) line(\(x, y) . [x + y < r], y)
def along(r, y) line(\(x, y) . [y < r], y)
def both(r, y) twice(\(x, y) . [x + y < r], y)
def open(r, y) app(\y . [y < r], y)
def closed(r) integral [0, 1] app(\y . [y < r], x) d(x)
""")
    number, spread = "(Real, Real)", "(Real, Dist[dr, dy])"
    expected = {"disc": number, "passed_on": number, "plain": "(Real, Dist[dr])", "across": number, "along": spread,
                "both": spread, "open": spread, "closed": number}  # fmt: skip
    assert {name: str(potto.deriv(getattr(m, name)).type).partition(" -> ")[2] for name in expected} == expected
