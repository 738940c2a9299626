"""Types of arrays: sizes as they are inferred and printed, and what is said of them."""

from __future__ import annotations

import pytest
from marks import FOLDER, check, database, only, type_of

from potto.checking.check import diagnostics

TYPES = [
    ("def f(xs: [n] Real) sum i in 0..n-1 (xs[i])", "(xs: [n] Real) -> Real"),
    ("def f(xs) sum x in xs (x^2)", "(xs: [n] Real*) -> Real"),
    ("def f(xs, i) xs[i] + 1", "(xs: [n] Real*, i: Real) -> Real"),
    ("def f(xs, i, j) xs[i, j] + 1", "(xs: [n, m] Real*, i: Real, j: Real) -> Real"),
    ("k = [1, 2, 3]", "[3] Real"),
    ("k = [[1, 2], [3, 4], [5, 6]]", "[3, 2] Real"),
    ("k = [(1, 2), (3, 4)]", "[2] (Real, Real)"),
    ("k = [i*j for i in 0..3, j in 1..2]", "[4, 2] Real"),
    ("def f(n) [i^2 for i in 0..n-1]", "(n: Real) -> [_] Real"),
    ("def f(xs: [n] Real) [xs[i + 1] - xs[i] for i in 0..n-2]", "(xs: [n] Real) -> [n - 1] Real"),
    ("def f(xs: [n] Real) [x for x in xs]", "(xs: [n] Real) -> [n] Real"),
    ("def f(xs) [2*xs[i] for i in 0..len(xs)-1]", "(xs: [n] Real*) -> [n] Real"),
    ("def f(u: [n] Real, v: [m] Real) [u[i]*v[j] for i in 0..n-1, j in 0..m-1]",
     "(u: [n] Real, v: [m] Real) -> [n, m] Real"),
    ("def f(u: (Real*, Real*), v) 2*u + v", "(u: (Real*, Real*), v: (Real*, Real*)) -> (Real, Real)"),
    ("def f(u: [3] Real*) -u/2", "(u: [3] Real*) -> [3] Real"),
    ("def f(u, v) dot(u, v)", "(u: [n] Real*, v: [n] Real*) -> Real"),
    ("def f(v) cross((1, 2, 3), v)", "(v: (Real*, Real*, Real*)) -> (Real, Real, Real)"),
    ("def f(x, n) fold s = x for i in 1..n (s/2 + i)", "(x: Real*, n: Real) -> Real"),
    ("def f(n) fold (x, v) = (1, 0) for i in 1..n ((x + v, v - x))", "(n: Real) -> (Real, Real)"),
    ("def f(t) integral [0, 1] [x, x*t] d(x)", "(t: Real) -> [2] Real"),
    ("def f(ts) integral [0, 1] sum t in ts ([x < t]) d(x)", "(ts: [n] Real) -> Real"),
    ("def g(xs) sum x in xs (x)\nf = deriv(g)", "(dxs: ([n] Real*, [n] Real*)) -> (Real, Real)"),
    ("def g(xs) [x^2 for x in xs]\nf = deriv(g)", "(dxs: ([n] Real*, [n] Real*)) -> ([n] Real, [n] Real)"),
    ("p = (1, 2)\ndef f(q: (Real*, Real*)) p.x*q.y + q.0", "(q: (Real*, Real*)) -> Real"),
    ("def f(ps: [n] (Real*, Real*)) sum p in ps (p.x*p.y)", "(ps: [n] (Real*, Real*)) -> Real"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), TYPES, ids=[text for text, _ in TYPES])
def test_types(text: str, expected: str) -> None:
    assert type_of(text, "k" if text.startswith("k") else "f") == expected


def test_sizes_that_do_not_agree() -> None:
    check("""
        def f(u: (Real, Real)) u + (1, 2, 3)
        #                        ^ error[P0326]: but the left has 2 and the right 3
        k = [1, 2] - [1, 2, 3, 4]
        #          ^ error[P0326]: but the left has 2 and the right 4
        def g(u: [3] Real) dot(u, [1, 2])
        #                  ^^^^^^^^^^^^^^ error[P0326]: these are `[3] Real` and `[2] Real`
        def h(x) cross((1, 2), (x, 2, 3))
        #              ^^^^^^ error[P0326]: `cross` takes vectors of three numbers
        def two(xs: [2] Real) xs[0] + xs[1]
        l = two([1, 2, 3])
        #       ^^^^^^^^^ error[P0326]: must be `[2] Real`, but this is `[3] Real`
        m = [[1, 2], [3]]
        #            ^^^ error[P0326]: must be `[2] Real`, but this is `[1] Real`
    """)


def test_sizes_that_follow_from_each_other_agree_in_any_order() -> None:
    check("""
        def diff(xs: [n] Real) [xs[i + 1] - xs[i] for i in 0..n-2]
        def pair(xs: [n + 1] Real, ys: [n] Real) dot(ys, diff(xs))
        def before(xs, ys) pair(xs, ys) + dot(diff(xs), ys)
        def after(ys, xs) dot(ys, diff(xs)) + pair(xs, ys)
        k = pair([1, 2, 3], [1, 2, 3])
        #                   ^^^^^^^^^ error[P0326]: `ys` of `pair` must be `[2] Real`, but this is `[3] Real`
        def last(xs: [n] Real, ys: [n - 1] Real) xs[0] + ys[0]
        l = last([1, 2, 3], [1, 2, 3])
        #                   ^^^^^^^^^ error[P0326]: `ys` of `last` must be `[2] Real`, but this is `[3] Real`
    """)


def test_an_index_into_few_elements() -> None:
    check("""
        def none(xs: [0] Real) xs[0]
        #                         ^ error[P0328]: the index 0 is out of range: the array has no elements
        k = [7][1]
        #       ^ error[P0328]: the index 1 is out of range: the array has 1 element
    """)
    found = only("k = [][0]")
    assert found.label == "there are none" and found.help == "an array without elements has no index"
    assert only("k = [7][1]").help == "indices count from 0, so the last one is 0"


def test_indices() -> None:
    check("""
        k = [1, 2, 3]
        l = k[3]
        #     ^ error[P0328]: the index 3 is out of range: the array has 3 elements
        m = k[-1]
        #     ^^ error[P0328]: the index -1 is out of range
        def f(g) g(1) + g[0]
        #               ^ error[P0329]: only an array has elements, but this is a function
        def h(x) (x, 2)[0]
        #        ^^^^^^ error[P0329]: only an array has elements, but this is a tuple of 2
        n = 4
        i = sum i in n (i)
        #            ^ error[P0329]: a sum goes through an array or a range
        def j(t) integral [0, 1] k[x] d(x)
        #                          ^ error[P0301]: this index depends on the variable of integration `x`
        def o(t) integral [0, 3] sum i in 0..x (k[i]) d(x)
        #                                    ^ error[P0303]: this bound of a sum depends on
    """)


def test_an_index_that_follows_a_range_out_of_its_array() -> None:
    check("""
        k = [1, 2, 3]
        a = sum i in 0..3 (k[i])
        #                    ^ error[P0328]: the index `i` is out of range: it reaches 3, and the array has 3 elements
        b = fold s = 0 for i in 1..len(k) (s + k[i - 2])
        #                                        ^^^^^ error[P0328]: the index `i - 2` is out of range: it reaches -1
        def c(xs: [n] Real) [xs[i + 1] - xs[i] for i in 0..n-1]
        #                       ^^^^^ error[P0328]: the index `i + 1` is out of range: it reaches the number of
        def d(xs: [n, m] Real) max i in 0..n-1, j in 0..i (xs[i - j, m - 1 - i] + xs[n - j, 0])
        #                                                                            ^^^^^ error[P0328]: the index `n -
        def e(xs) integral [0, 1] sum i in 0..len(xs) (xs[i]*[x < i]) d(x)
        #                                                 ^ error[P0328]: the index `i` is out of range
    """)


def test_indices_that_stay_in_range_where_they_are_reached() -> None:
    check("""
        def a(xs: [n] Real) sum i in 0..n-1 (if i < n - 1 then xs[i + 1] else 0)
        def b(xs: [n] Real) sum i in 0..n-1 (let x = xs[i + 1] in if i < n - 1 then x else 0)
        def c(xs: [n] Real) sum i in 0..n-1, j in i+1..n-1 (xs[i + 1]*xs[j])
        def d(xs: [n] Real) sum i in 0..n-1 (sum j in 0..i-1 (xs[i - 1]*xs[j + 1]*xs[i - j] + xs[n - 1 - i]))
        def e(xs: [n] Real) sum i in 1..n (xs[i - 1] + xs[n - i]) + sum i in 3..2 (xs[i - 9])
        def f(xs: [n] Real, ys: [n + 1] Real) sum i in 0..n (ys[i]) + sum k in 0..4 (xs[k])
    """)


def test_an_index_that_is_a_size() -> None:
    check("""
        def a(xs: [n] Real) xs[n]
        #                      ^ error[P0328]: the index `n` is out of range: it is not below the number of elements
        def b(xs: [n, m] Real) xs[n - 1, m] + xs[n - 1, m - 1]
        #                                ^ error[P0328]: the index `m` is out of range
        def c(xs: [n + 1] Real) xs[n] + xs[n + 2]
        #                                  ^^^^^ error[P0328]: the index `n + 2` is out of range
        def d(xs: [n] Real, ys: [m] Real) xs[m] + ys[len(xs)] + ys[len(ys)]
        #                                                          ^^^^^^^ error[P0328]: the index `len(ys)`
        def e(xs: [n] Real) (let ds = [xs[i + 1] - xs[i] for i in 0..n-2] in ds[n - 1])
        #                                                                       ^^^^^ error[P0328]: the index `n - 1`
        k = [1, 2, 3]
        l = k[len(k)]
        #     ^^^^^^ error[P0328]: the index 3 is out of range: the array has 3 elements
    """)
    assert only("def a(xs: [n] Real) xs[n]").help == "indices count from 0, so the last one is `n - 1`"
    assert only("def a(xs: [n + 2] Real) xs[n + 3]").help == "indices count from 0, so the last one is `n + 1`"


def test_an_index_inside_of_another_definition_must_not_vary() -> None:
    check("""
        def at(xs, i) xs[i]
        def f(t) integral [0, 3] at([1, 2, t], x) d(x)
        #                                      ^ error[P0301]: `at` indexes by its parameter `i`
    """)


def test_parts() -> None:
    check("""
        def f(u: (Real, Real)) u.z
        #                        ^ error[P0327]: a tuple of 2 has no part `.z`
        def g(xs: [3] Real) (xs).focal
        #                        ^^^^^ error[P0327]: this is an array of 3, which has no part `.focal`
        def h(u: (Real, Real)) (u + u).2
        #                              ^ error[P0327]: a tuple of 2 has no part `.2`
    """)


def test_a_fold_keeps_the_form_of_its_state() -> None:
    check("""
        def f(n) fold s = 0 for i in 1..n ((s, i))
        #                                  ^^^^^^ error[P0306]: must be `Real`, but this is `(Real, Real)`
        def g(n) fold (a, b) = 1 for i in 1..n ((a, b))
        #                      ^ error[P0306]: 2 names are bound here, but the state is a number
    """)


def test_an_array_has_no_power() -> None:
    assert "take one of its elements" in only("def f(xs: [n] Real) xs^2").help


def test_a_call_of_an_array_is_an_index_meant() -> None:
    assert only("xs = [1, 2]\nk = xs(0)").help == "an element of an array is written with brackets: `xs[i]`"


def test_an_index_is_a_whole_number() -> None:
    check("""
        k = [1, 2][0.5]
        #          ^^^ error[P0330]: an index must be a whole number, but this is 0.5
        def f(xs: [n] Real) xs[-1.5] + xs[1e0]
        #                      ^^^^ error[P0330]: but this is -1.5
        def g(xs: [n, m] Real) xs[0, -1]
        #                            ^^ error[P0328]: the index -1 is out of range: no array has one below 0
    """)


def test_nothing_has_no_least() -> None:
    check("""
        a = min x in [] (x)
        #            ^^ error[P0334]: `min` goes through an empty array, which has no least element
        def f(t) max i in 3..1 (t*i)
        #                 ^^^^ error[P0334]: `max` goes through an empty range, which has no greatest element
        b = sum x in [] (x)
        c = product i in 3..1 (i)
        def g(xs: [n] Real) min x in xs (x)
    """)


def test_places_of_a_look_up_rise() -> None:
    check("""
        def f(x) interp([0, 2, 1], [0, 1, 2], x)
        #                      ^ error[P0335]: `interp` needs increasing places, but 1 follows 2
        def g(x) interp([-1, (-1)], [0, 1], x)
        #                    ^^^^ error[P0335]: `interp` needs increasing places, but -1 follows -1
        def h(a, x) interp([0, a, -1], [0, 1, 2], x)
        def k(x) interp([-2, -1, 0.5], [0, 1, 2], x)
    """)


def test_a_size_and_a_parameter_of_one_name() -> None:
    check("""
        def f(n: Real, xs: [n] Real) n*xs[0]
        #                   ^ warning[P0612]: the size `n` is not the parameter `n`
    """)
    assert type_of("def f(n, xs) n*norm(xs)") == "(n: Real*, xs: [m] Real*) -> Real"
    shown = type_of("def g(xs, m: Real, n)(ys) norm(xs)*m*n*norm(ys)")
    assert shown == "(xs: [k] Real*, m: Real, n: Real*) -> (ys: [l] Real*) -> Real"


@pytest.mark.parametrize(("text", "code", "places"), [
    ("def a(xs: [n] Real, ys: [n] Real) xs[0]*ys[0]\nb = a([1, 2, 3], [1, 2])", "P0326", ["[1, 2, 3]: so `n` is 3"]),
    ("def a(xs: [n + 1] Real, ys: [n] Real) xs[0]\nb = a(ys=[1, 2], xs=[1, 2])", "P0326", ["[1, 2]: so `n` is 1"]),
    ("m = [[1, 2], [3]]", "P0326", ["[1, 2]: as the first one is"]),
    ("f = fold s = [1, 2] for i in 1..3 ([s[0]])", "P0326", ["[1, 2]: the state at first"]),
    ("def f(t) if t > 0 then [1, 2] else [1]", "P0326", ["[1, 2]: the first one"]),
    ("def f(t) -> [3] Real\n    [t, t]", "P0326", ["[3] Real: declared here"]),
    ("a = dot([1, 2], [1, 2, 3])", "P0326", ["[1, 2]: `[2] Real`", "[1, 2, 3]: `[3] Real`"]),
    ("a = interp([1, 2], [1, 2, 3], 1)", "P0326", ["[1, 2]: `[2] Real`", "[1, 2, 3]: `[3] Real`"]),
    ("u = [1, 2]\nv = [1]\na = u + v", "P0326", ["u: `u` is `[2] Real`", "v: `v` is `[1] Real`"]),
    ("def f(u: [2] Real) u - u*2 + [1]", "P0326", ["u - u*2: `[2] Real`", "[1]: `[1] Real`"]),
    ("v = [1]\ndef a(xs: [3] Real) xs[0]\nb = a(v)", "P0326",
     ["xs: [3] Real: `xs` is declared here", "v: `v` is defined here"]),
    ("v = [1]\ndef a(t)(xs: [3] Real) t*xs[0]\nb = a(1)(v)", "P0326", ["v: `v` is defined here"]),
    ("v = [1]\nrecord R(xs: [3] Real)\nb = R(xs=v)", "P0326",
     ["xs: [3] Real: `xs` is declared here", "v: `v` is defined here"]),
    ("g = [[1, 2], [3, 4], [5, 6]]\na = g[1, 2]", "P0328", ["g: `g` is defined here"]),
    ("record P(x: Real)\ndef f(p: P) p.y", "P0332", ["P: `P` is defined here"]),
    ("record P(x: Real)\np = P(x=1, z=2)", "P0332", ["P: `P` is defined here"]),
    ("record P(x: Real)\np = P(x=1) with w = 2", "P0332", ["P: `P` is defined here"]),
])  # fmt: skip
def test_what_disagrees_is_told_with_the_place_that_says_otherwise(text: str, code: str, places: list[str]) -> None:
    (located,) = diagnostics(database(text), FOLDER + "main.po")
    said = located.diagnostic
    assert said.code == code
    assert [f"{text[r.span.start : r.span.end]}: {r.message}" for r in said.related] == places


def test_the_record_of_another_file() -> None:
    db = database("# file: lib.po\nrecord P(x: Real)\n# file: main.po\nfrom lib import P\ndef f(p: P) p.y")
    (located,) = diagnostics(db, FOLDER + "main.po")
    related = [(r.file, r.span.start, r.message) for r in located.diagnostic.related]
    assert related == [(FOLDER + "lib.po", 7, "`P` is defined here")]
