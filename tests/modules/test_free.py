"""Free names: what each construct binds, and where. The expectation is in the snippet's comment."""

from __future__ import annotations

import pytest

from potto.modules import free_members, free_names, free_references
from potto.modules.free import references_in
from potto.source import Span
from potto.syntax import nodes, parse_chunk, parse_expression

EXPRESSIONS = [
    ("x + y * 2 - sin(x)", "x y sin"),
    ("\\(x, y) . c . x + y + c + z", "z"),
    ("(\\x . x)(x)", "x"),
    ("f(n=3, m=n)", "f n"),
    ("if p then a else b", "p a b"),
    ("p ? a : b", "p a b"),
    ("[a <= x < b and not q > 0]", "a x b q"),
    ("integral [0, t] x*t d(x)", "t"),
    ("integral [0, x] x d(x)", "x"),
    ("integral ([0, a], [0, x]) x*y d(x, y)", "a"),
    ("integral ([0, y], [0, x]) x*y d(x, y)", "y"),
    ("integral (x ~ normal(m, s), y ~ uniform(x, b)) x*y d(x, y)", "m s b"),
    ("sum i in i..n (i*k)", "i n k"),
    ("let a = a; (b, c) = f(a) in a + b + c + d", "a f d"),
    ("(let a = 1 in a) + a", "a"),
    ("diffeo(u, v)", "u v"),
    ("[1, a, (b, c)]", "a b c"),
    ("2^a^-b", "a b"),
    ("deriv(f)(c)", "deriv f c"),
]


@pytest.mark.parametrize(("text", "free"), EXPRESSIONS)
def test_free_names_of_expressions(text: str, free: str) -> None:
    parsed = parse_expression(text)
    assert not parsed.diagnostics, parsed.diagnostics
    assert free_names(parsed.expr) == set(free.split())


ITEMS = [
    ("def f(a)(b) a + b + c + f(a)", "c f"),
    ("def f(a)\n    b = a + b\n    (c, d) = g(b)\n    a + b + c + d + e", "b g e"),
    ("x = y", "y"),
    ("for v in vs:\n    w = v\n    print(v, w, u)", "vs u"),
    ("print(a, \\b . b)", "a"),
    ("diffeo m(x, y; c) = (x + c, y + k)", "k"),
    ("from m import a", ""),
    ("def f(g: (Real) -> Real, x: Real) -> Real g(x)", ""),
]


@pytest.mark.parametrize(("text", "free"), ITEMS)
def test_free_names_of_items(text: str, free: str) -> None:
    parsed = parse_chunk(text)
    assert not parsed.diagnostics, parsed.diagnostics
    assert parsed.item is not None
    assert free_names(parsed.item) == set(free.split())


def test_an_inverse_sees_its_own_parameters_and_the_further_groups() -> None:
    item = parse_chunk("diffeo m(x, y; c) = (x + c, y)\n    inverse (u, v) . (u - c, v + w)").item
    assert item is not None
    assert free_names(item) == {"w"}


def test_members_of_modules() -> None:
    item = parse_chunk("def f(x)\n    k = x\n    m.g(x) + pkg.m.h + k.q").item
    assert item is not None
    assert free_members(item) == {("m", "g"), ("pkg.m", "h")}
    assert free_names(item) == set()


def test_references_come_in_the_order_of_the_text() -> None:
    text = "f(b) + (p ? a : if q then (\\x . x + c)(d) else e)"
    found = [text[r.span.start : r.span.end] for r in free_references(parse_expression(text).expr)]
    assert found == ["f", "b", "p", "a", "q", "c", "d", "e"]


CALLS = [
    ("f(x) + f(2*x)", "f"),
    ("f(x) + m.g(x)", "f m.g"),
    ("f(x, k=2)", ""),  # by the parameter's name
    ("f(x) + h(f)", "h"),  # passed on
    ("(f)(x)", ""),
    ("(\\f . f(x))(c) + f(x)", "f"),  # the inner one is another
    ("f(f(x))", "f"),
]


@pytest.mark.parametrize(("text", "called"), CALLS)
def test_what_is_only_called_by_place(text: str, called: str) -> None:
    found = references_in(parse_expression(text).expr).only_called
    assert {name if path is None else f"{path}.{name}" for path, name in found} == set(called.split())


def test_deep_trees() -> None:
    at, expr = Span(0, 1), nodes.Name(Span(0, 1), "x")
    deep: nodes.Expr = expr
    for place in range(30_000):
        group = ((nodes.Parameter(at, f"v{place % 7}"),),)
        deep = nodes.Lambda(at, group, nodes.Paren(at, deep)) if place % 2 else nodes.Unary(at, "-", deep)
    assert free_names(deep) == {"x"}
