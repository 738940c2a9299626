"""Arrays, what goes through them, vectors and records: the terms they elaborate to, and what these are worth."""

from __future__ import annotations

import pytest
from lint import lint
from mpmath import mp
from snippets import close, program, shown, term, value

from potto.core.printer import format_term
from potto.core.terms import Global, Term
from potto.elaborate import core, elaborate_expression
from potto.query import Database
from potto.syntax import parse_expression

ARRAYS = [
    ("xs[i + 1]", "xs[i + 1]"),
    ("xs[1]", "xs[1]"),
    ("[j*t for j in 0..2]", "[j*t for j in 0..2]"),
    ("[i*t for i in 1..i]", "[(i1 + 1)*t for i1 in 0..i - 1]"),
    ("[p^2 for p in xs]", "[xs[i1]^2 for i1 in 0..len(xs) - 1]"),
    ("[j*k for j in 0..1, k in 0..j]", "[[j*k for k in 0..j] for j in 0..1]"),
    ("sum j in 0..i, k in 0..j (k)", "sum j in 0..i (sum k in 0..j (k))"),
    ("sum p in xs (p*t)", "sum i1 in 0..len(xs) - 1 (xs[i1]*t)"),
    ("product j in 1..3 (j + t)", "fold p = 1 for j in 1..3 (p*(j + t))"),
    ("min p in xs (p)", "fold m = xs[0] for i1 in 1..len(xs) - 1 (min(m, xs[i1]))"),
    ("fold s = t for j in 1..i (s + j)", "fold s = t for j in 1..i (s + j)"),
    ("fold s = t for p in xs (s*p)", "fold s = t for i1 in 0..len(xs) - 1 (s*xs[i1])"),
    ("fst(fold (a, b) = (0, t) for j in 1..i ((b, a + b)))",
     "(fold state = (0, t) for j in 1..i ((state.1, state.0 + state.1))).0"),
    ("len(xs)", "len(xs)"),
    ("xs + xs", "[xs[k] + xs[k] for k in 0..len(xs) - 1]"),
    ("t*xs - xs/2", "[t*xs[k] - xs[k]/2 for k in 0..len(xs) - 1]"),
    ("-xs", "[-xs[k] for k in 0..len(xs) - 1]"),
    ("dot(xs, xs)", "sum k in 0..len(xs) - 1 (xs[k]*xs[k])"),
    ("dot(xs + xs, xs)", "sum k in 0..len(xs) - 1 ((xs[k] + xs[k])*xs[k])"),
    ("2*(t, i) + (1, 1)", "(2*t + 1, 2*i + 1)"),
    ("norm((t, i))", "sqrt(t*t + i*i)"),
    ("cross((1, 0, 0), (t, i, 2)).2", "i"),
    ("(t, i).x - (t, i).1", "t - i"),
    ("len((t, i, 1))", "3"),
    ("n - 1", "len(xs) - 1"),
]  # fmt: skip


@pytest.mark.parametrize(("body", "expected"), ARRAYS, ids=[body for body, _ in ARRAYS])
def test_arrays_and_vectors(body, expected):
    head, text = shown(f"def f(xs: [n] Real, i, t) {body}").split(" . ", 1)
    assert (head, text) == ("\\(xs, i, t)", expected)


def test_sizes_are_lengths_of_what_carries_them():
    program = "def f(ps: [n] (Real, Real), m: [n - 1, k] Real) 100*n + k"
    assert value(program, "f(ps, m)", ps=[(1, 2)] * 4, m=[[1, 2]] * 3) == 402
    assert value("def g(m: [n, k] Real) 10*n + k", "g(m)", m=[[1, 2, 3]] * 2) == 23
    shifted = "def h(xs: [n + 1] Real) n"
    assert value(shifted, "h(xs)", xs=[1, 2, 3]) == 2


def test_a_matrix_times_a_vector():
    times = "def times(m: [r, c] Real, v: [c] Real) [sum j in 0..c-1 (m[i, j]*v[j]) for i in 0..r-1]"
    close(value(times, "times(m, v)", m=[[1, 2], [3, 4], [5, 6]], v=[10, 1]), [12, 34, 56])


def test_eulers_circle():
    """n steps of (x, v) -> (x + hv, v - hx) multiply by 1 + h^2 in squared length each."""
    circle = "def circle(h) fold (x, v) = (1, 0) for i in 1..50 ((x + h*v, v - h*x))"
    x, v = value(circle, "circle(0.125)")  # type: ignore[misc]
    close(x * x + v * v, (1 + mp.mpf(0.125) ** 2) ** 50)
    close((x, v), ((mp.mpc(1, -0.125) ** 50).real, (mp.mpc(1, -0.125) ** 50).imag))


def test_vectors_within_vectors():
    program = "def f(ps: [n] (Real, Real), t) sum p in (t*ps + ps) (p.x*p.y)"
    close(value(program, "f(ps, 2)", ps=[(1, 2), (3, 5)]), 9 * (2 + 15))


def test_an_integral_of_a_vector_scaled_by_a_density():
    """Of (1, x) under the normal density around m: (1, m)."""
    program = "def f(m) integral (x ~ normal(m, 0.5)) (1, x) d(x)"
    close(value(program, "f(0.3)"), (1, 0.3))


def test_arrays_of_what_calls_give():
    program = """
        def pair(t) (t, t^2)
        def both(u, v) pair(u) + pair(v)
        def list(t) [t, 2*t]
    """
    close(value(program, "both(1, 3)"), (4, 10))
    close(value(program, "list(1) + 2*list(3)"), [7, 14])
    close(value(program, "2*(list(1) + list(3))[1]"), 16)


def test_arrays_of_other_sizes_are_not_put_together():
    """What is too short is an error where it is read, so that it has to be read."""
    assert shown("def f(xs: [_] Real, ys: [_] Real) 2*xs + ys") == (
        "\\(xs, ys) . [2*xs[k] + ys[k] for k in 0..len(xs) - 1]"
    )
    assert shown("def f(xs: [_] Real, ys: [_] Real) xs + 2*ys") == (
        "\\(xs, ys) . [xs[k1] + [2*ys[k] for k in 0..len(ys) - 1][k1] for k1 in 0..len(xs) - 1]"
    )


# Records

SCENE = """
    record Vec(x: Real, y: Real)
    record Camera(eye: Vec, focal: Real)
    def start(t) Camera(Vec(t, 1), 2)
    def zoomed(c: Camera, f) c with focal = f*c.focal
    def size(c: Camera) c.focal*c.eye.x - c.eye.y
    def sizes(cs: [n] Camera) sum c in cs (size(c))
    def lit(c: Camera) integral [0, 1] [x < c.eye.x] d(x)
"""


def test_a_record_is_a_tuple_of_its_fields():
    assert shown(SCENE, "start") == "\\t . ((t, 1), 2)"
    assert shown(SCENE, "zoomed") == "\\(c, f) . (c.0, f*c.1)"
    assert shown(SCENE, "size") == "\\c . (c.1*c.0.0 - c.0.1)"


def test_records_made_by_name_and_changed():
    assert value(SCENE, "size(start(3))") == 5
    assert value(SCENE, "Camera(focal=1, eye=Vec(y=2, x=3))") == ((3, 2), 1)
    assert value(SCENE, "size(zoomed(start(3), 10))") == 59
    both = "start(3) with (focal = 7, eye = start(3).eye with y = 5)"
    assert value(SCENE, both) == ((3, 5), 7)
    assert value(SCENE, "sizes([start(3), start(4)])") == 5 + 7
    assert value(SCENE, "(start(3) with focal = 4).focal") == 4


SWAPPED = """
    record P(y: Real, x: Real)
    record Q(x: Real, y: Real)
    def mean(m, s) integral (z ~ normal(m, s)) P(1, z) d(z)
"""


@pytest.mark.parametrize(
    ("expression", "wanted"),
    [
        ("P(1, 2).x", 2),
        ("(1, 2).x + P(1, 2).x + Q(1, 2).x", 1 + 2 + 1),
        ("(let p = P(1, 2) in p with y = 5).y", 5),
        ("(if 1 > 0 then P(1, 2) else P(3, 4)).x", 2),
        ("[P(1, 2), P(3, 4)][1].x", 4),
        ("[P(i, 2*i) for i in 0..3][3].x", 6),
        ("sum p in [P(1, 2), P(3, 4)] (p.x)", 6),
        ("(sum i in 1..3 (P(1, i))).x", 6),
        ("(fold p = P(1, 2) for i in 1..3 (P(p.x, p.y))).x", 1),
        ("(\\p . p.x)(P(1, 2))", 2),
        ("mean(3, 0.5).x", 3),
    ],
)
def test_fields_of_records_are_told_by_their_names(expression, wanted):
    close(value(SWAPPED, expression), mp.mpf(wanted))


def test_records_of_another_file():
    db = program("from scene import Camera, Vec\ndef f(c: Camera) (c with focal = 9).focal + c.eye.x", scene=SCENE)
    assert format_term(core(db, "<text>", "f").term) == "\\c . (c.0.0 + 9)"
    made = program("import scene\ndef f(t) scene.Camera(scene.Vec(t, 1), 2).eye.x", scene=SCENE)
    assert format_term(core(made, "<text>", "f").term) == "\\t . t"


def test_a_record_as_a_function_is_its_definition():
    assert shown(SCENE, "Vec") == "\\(x, y) . (x, y)"
    assert isinstance(_expression(program(SCENE), "Vec"), Global)


def _expression(db: Database, text: str) -> Term:
    expr = parse_expression(text).expr
    assert expr is not None
    return elaborate_expression(db, "<text>", expr).term


def test_what_is_wrong_elaborates_all_the_same():
    for body in ("c.foca", "c with fokal = 2", "t with x = 2", "xs.y", 'load("a.csv")'):
        assert lint(term(f"record C(focal: Real)\ndef f(c: C, t, xs: [n] Real) {body}")) == []
