"""How formatted code looks: each case is what was written and what becomes of it."""

from __future__ import annotations

import textwrap

import pytest
from syntax_samples import PAPER

from potto.syntax import format_source


def formatted(text: str, diffeo: bool = False) -> str:
    return format_source(textwrap.dedent(text).lstrip("\n"), diffeo)


def check(written: str, expected: str) -> None:
    assert formatted(written) == textwrap.dedent(expected).lstrip("\n")
    assert formatted(expected) == textwrap.dedent(expected).lstrip("\n")


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("x=1", "x = 1"),
        ("x = f( a,b )+g [ 1,2 ]", "x = f(a, b) + g [1, 2]"),
        ("x = f (a) c", "x = f (a) c"),
        ("x=-a^ -2*-b", "x = -a^-2 * -b"),
        ("x = a/b-c", "x = a / b - c"),
        (r"x = \ (a,b).\c.a+1", r"x = \(a, b) . \c . a + 1"),
        (r"x = \(a,b).c. 1", r"x = \(a, b) . c . 1"),
        ("x = p?a:b", "x = p ? a : b"),
        ("x = f(dc = (-2,1) ,g)", "x = f(dc=(-2, 1), g)"),
        ("x = (let a=1 ;b=f(c = 2) in a)", "x = (let a = 1; b = f(c=2) in a)"),
        ("x = f(fold(a,b)=(1,2)for i in 1..n(g(k = b)))", "x = f(fold (a, b) = (1, 2) for i in 1..n (g(k=b)))"),
        ("x = f(fold s=1 for i in 1..n(s),k = 1)", "x = f(fold s = 1 for i in 1..n (s), k=1)"),
        ("x = f(c with a=2,k = 1)", "x = f(c with a = 2, k=1)"),
        ("x = f(c with (a = 2,b = 3),k = 1)", "x = f(c with (a=2, b=3), k=1)"),
        ("x = integral([0,1],[ 0,t ])(x*y)d(x ,y)", "x = integral ([0, 1], [0, t]) (x * y) d(x, y)"),
        ("x = integral [0,1](x)d (x)", "x = integral [0, 1] (x) d(x)"),
        ("x = integral (x~normal( m,s)) x d(x)", "x = integral (x ~ normal(m, s)) x d(x)"),
        ("x = sum i in 1 .. n(i)", "x = sum i in 1..n (i)"),
        ("x = sum i in 2...n (i)", "x = sum i in 2...n (i)"),
        ("x = [a<b and  not c]", "x = [a < b and not c]"),
        ("x = exp(y)[y<t]", "x = exp(y) [y < t]"),
        ("x = diffeo (u,v) ?1 :0", "x = diffeo(u, v) ? 1 : 0"),
        ("def f (x,y)( z ):x", "def f(x, y)(z): x"),
        ("def f(x) - x", "def f(x) -x"),
        (
            "def f(x:Real*,g:(Real,Real*)->Real)->Real [x]\n x",
            "def f(x: Real*, g: (Real, Real*) -> Real) -> Real[x]\n    x",
        ),
        ("for v in xs :\n  print( v )", "for v in xs:\n    print(v)"),
        ("from  m  import a,b  as c", "from m import a, b as c"),
        ("from m import( a,b )", "from m import (a, b)"),
        ("diffeo f(x,y;c)=(x,\n y)", "diffeo f(x, y; c) = (x,\n    y)"),
        ("x = 1   # why", "x = 1  # why"),
        ("x = λy.y", "x = λy . y"),
    ],
)
def test_spacing(written: str, expected: str) -> None:
    assert format_source(written) == expected + "\n"
    assert format_source(expected) == expected + "\n"


def test_the_paper() -> None:
    assert formatted(PAPER["renderer.po"]) == textwrap.dedent("""\
        from half_plane import cond
        def renderer(c, shader)
            integral ([0, 1], [0, 1])
                ((shader (x, y)) c)
                * (((cond (x, y)) c) ? 1 : 0) d(x, y)
        drenderer = deriv(renderer)
    """)


def test_comments_and_blank_lines_are_kept() -> None:
    check(
        """
        # about f,
        # at length


        def f(a,b)   # its head

          # own line
          x=a
        # in the first column
          y = (x,   # first
            b, # second

            # before the end
             a)


          x+y # last
          # after it



        # alone

        z=1
        """,
        """
        # about f,
        # at length


        def f(a, b)  # its head

            # own line
            x = a
            # in the first column
            y = (x,  # first
                b,  # second

                # before the end
                a)

            x + y  # last
            # after it


        # alone

        z = 1
        """,
    )


def test_continuation_lines() -> None:
    check(
        """
        def f(x)
          if x>0
          then (
             x)
          else -x
        y = [
           1,
          [2,
            3],
        ]
        """,
        """
        def f(x)
            if x > 0
                then (
                    x)
                else -x
        y = [
            1,
            [2,
                3],
        ]
        """,
    )


def test_clauses_of_a_diffeomorphism() -> None:
    check(
        """
        diffeo f(x, y) =
          r = x
          (r, y)
           inverse (u,v).(u,v)
          where x>0
        """,
        """
        diffeo f(x, y) =
            r = x
            (r, y)
            inverse (u, v) . (u, v)
            where x > 0
        """,
    )


def test_long_lines_are_broken_as_far_out_as_can_be() -> None:
    long = " + ".join(f"some_function({name}_parameter, other)" for name in ("first", "second", "third", "fourth"))
    out = formatted(f"x = {long}")
    assert out == (
        "x = some_function(first_parameter, other) + some_function(second_parameter, other)\n"
        "    + some_function(third_parameter, other) + some_function(fourth_parameter, other)\n"
    )
    assert max(map(len, out.split("\n"))) <= 100


def test_bodies_come_to_a_line_of_their_own_before_bounds_ranges_and_variables_are_broken() -> None:
    head = "def pixel(mesh: [n] ((Real, Real), (Real, Real), (Real, Real)), grey: [n] Real, px, py, h)"
    bounds = "integral ([px, px + h], [py, py + h])"
    summed = "sum i in 0..n - 1 (grey[i] * inside(mesh[i], x, y)) d(x, y)"
    laid_out = f"{head}\n    {bounds}\n        {summed}\n"
    assert formatted(f"{head} {bounds} {summed}") == laid_out == formatted(laid_out)
    first, second = "weights[i] * (observations[i + 1] - observations[i])^2", "integral [0, c] x * [x < t] d(x)"
    loop = f"sum i in 0..number_of_them - 2 ({first}\n        * {second})"
    assert formatted(f"def loss(c, t): {loop}") == f"def loss(c, t):\n    {loop}\n"
    negative = f"def loss(c, t)\n    -{loop}\n"
    assert formatted(f"def loss(c, t) -{loop}") == negative == formatted(negative)


def test_broken_chunks_are_kept_as_they_are() -> None:
    text = "x   = (1,\n      2\ndef f(x)  x+\n\n\n\n\ny=1\n"
    assert format_source(text) == "x   = (1,\n      2\ndef f(x)  x+\n\n\ny = 1\n"


def test_line_ends_are_kept() -> None:
    assert format_source("x=1\r\n\r\ny=2") == "x = 1\r\n\r\ny = 2\r\n"
    assert format_source("x=1\ry=2") == "x = 1\ny = 2\n"
