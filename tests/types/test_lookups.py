"""The types of `interp` and `image`, and what is said where they are given something else."""

from __future__ import annotations

import pytest
from marks import check, type_of


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("def f(xs, ys, x) interp(xs, ys, x)", "(xs: [n] Real*, ys: [n] Real*, x: Real*) -> Real"),
        ("def f(ys: [n] (Real, Real), x) interp([0, 1], ys, x)", "(ys: [2] (Real, Real), x: Real*) -> (Real, Real)"),
        ("def f(p: [h, w] Real, u, v) image(p, u, v)", "(p: [h, w] Real, u: Real*, v: Real*) -> Real"),
        ("def f(p, u, v) image(p, u, v)", "(p: [h, w] Real*, u: Real*, v: Real*) -> Real"),
        (
            "def f(p: [h, w] (Real, Real, Real), u, v) image(p, u, v)",
            "(p: [h, w] (Real, Real, Real), u: Real*, v: Real*) -> (Real, Real, Real)",
        ),
    ],
)
def test_types(text, expected):
    assert type_of(text) == expected


def test_mistakes():
    check("""
        def few(x) interp([1, 2], [1, 2, 3], x)
        #          ^^^^^^^^^^^^^^^^^^^^^^^^^^^^ error[P0326]: as many values as places
        def number(x) interp(1, [1, 2], x)
        #                    ^ error[P0306]: first argument of `interp`
        def tuples(x) interp([(1, 2)], [1], x)
        #                    ^^^^^^^^ error[P0306]: first argument of `interp`
        def missing(x) interp([1, 2], x)
        #              ^^^^^^^^^^^^^^^^^ error[P0309]: three arguments
        def functions(x) interp([1, 2], [sin, cos], x)
        #                               ^^^^^^^^^^ error[P0313]: numbers or vectors
        def flat(u, v) image([1, 2], u, v)
        #                    ^^^^^^ error[P0306]: first argument of `image`
        def place(p: [h, w] Real, u) image(p, (u, u), 1)
        #                                     ^^^^^^ error[P0315]: where `image` looks
    """)


def test_what_is_looked_up_varies():
    check("""
        def f(ys: [n] Real) integral [0, 1] (if interp([0, 1], ys, x) > 0 then 1 else 0) d(x)
        #                                       ^^^^^^^^^^^^^^^^^^^^^^^^^ error[P0301]: depends on the variable
        def g(ys: [n] Real, t) integral [0, 1] (if interp([0, 1], ys, t) > 0 then x else 0) d(x)
    """)
