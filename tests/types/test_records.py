"""Records: their types, what is said of wrong ones, and what varies in them, field by field."""

from __future__ import annotations

import pytest
from marks import FOLDER, check, database, only

from potto.types import derivative_type, format_type, interface

MAIN = FOLDER + "main.po"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("def f(c: Camera) c.focal", "(c: Camera) -> Real"),
        ("def f(c: Camera) c.eye", "(c: Camera) -> Vec"),
        ("def f(t) Camera(Vec(t, 1), 2)", "(t: Real*) -> Camera"),
        ("def f(t) Camera(focal=2, eye=Vec(t, 1))", "(t: Real*) -> Camera"),
        ("def f(c: Camera, t) c with focal = t", "(c: Camera, t: Real*) -> Camera"),
        ("def f(cs: [n] Camera) cs[0].eye.x", "(cs: [n] Camera) -> Real"),
        ("def f(c: Camera, d: Camera) [c, d]", "(c: Camera, d: Camera) -> [2] Camera"),
        ("f = Camera", "(eye: Vec, focal: Real*) -> Camera"),
        ("def f(c: (Camera, Real)) fst(c).focal", "(c: (Camera, Real)) -> Real"),
        ("f = deriv(\\(c: Camera) . c.focal)", "(dc: (Camera, Camera)) -> (Real, Real)"),
    ],
)
def test_types(text, expected):
    db = database(f"record Vec(x: Real, y: Real)\nrecord Camera(eye: Vec, focal: Real)\n{text}")
    assert format_type(interface(db, MAIN, "f").type) == expected


def test_a_size_in_a_record():
    db = database("record Mesh(xs: [n] Real, h: Real)\ndef f(m: Mesh, k: Mesh) m.xs[0] + k.xs[1]")
    assert format_type(interface(db, MAIN, "f").type) == "(m: Mesh, k: Mesh) -> Real"


def test_a_record_of_another_name_is_made_of_the_fields_of_the_first():
    text = "record Vec(x: Real, y: Real)\nrecord Pixel(y: Real, x: Real, grey: Real)\n"
    text += "def norm2(v: Vec) v.x^2 + v.y^2\ndef f(p: Pixel) norm2(p)"
    assert only(text).help == "write `Vec(x=p.x, y=p.y)`"


@pytest.mark.parametrize(
    ("call", "help"),
    [
        ("Camera(eye=1, focal=1, foo=2)", "it has `eye`, `focal`"),
        ("Camera(eye=1, foo=2)", "did you mean `focal`?"),
        ("Camera(1, 2) with (focal = t, foo = 2)", "it has `eye`, `focal`"),
        ("lens(focal=1, foo=2)", "it has `eye`, `focal`"),
        ("lens(eye=1, foo=2)", "did you mean `focal`?"),
    ],
)
def test_a_name_that_is_given_is_not_suggested(call: str, help: str):
    text = f"record Camera(eye: Real, focal: Real)\ndef lens(eye, focal) eye*focal\ndef f(t) {call}"
    assert only(text).help == help


def test_mistakes():
    check("""
        record Vec(x: Real, y: Real)
        record Camera(eye: Vec, focal: Real)
        def unknown(c: Camera) c.foca
        #                        ^^^^ error[P0332]: has no field
        def changed(c: Camera) c with fokal = 2
        #                             ^^^^^ error[P0332]: has no field
        def added(c: Camera) c + 1
        #                    ^ error[P0315]: a record
        def given(c: Camera) c.focal
        def tuple(t) given((1, 2))
        #                  ^^^^^^ error[P0306]: must be `Camera`
        def another(v: Vec) given(v)
        #                         ^ error[P0306]: must be `Camera`
        def missing(t) Camera(eye=Vec(1, 2))
        #                     ^^^^^^^^^^^^^ error[P0309]: focal
        def extra(t) Vec(x=1, y=2, z=3)
        #                          ^ error[P0332]: has no field
        def none(c: Camra) 1
        #           ^^^^^ error[P0116]: no type
        def function(c: given) 1
        #               ^^^^^ error[P0116]: not a record
        def number(t) t with x = 2
        #             ^ error[P0333]: which record
    """)


def test_fields_vary_one_by_one():
    check("""
        record Camera(eye: Real, focal: Real)
        def plain(c: Camera) if c.focal > 0 then c.eye else 1
        def fine(t) integral [0, 1] plain(Camera(x, t)) d(x)
        def still(t) integral [0, 1] plain(Camera(x, x) with focal = t) d(x)
        def moved(t) integral [0, 1] plain(Camera(t, t) with focal = x) d(x)
        #                                  ^^^^^^^^^^^^^^^^^^^^^^^^^^^ error[P0301]: depends on the variable
    """)


def test_the_derivative_of_a_record_has_its_name():
    found = interface(database("record P(x: Real, y: Real)\ndef f(p: P) p"), MAIN, "f").type
    assert format_type(derivative_type(found)) == "(dp: (P, P)) -> (P, P)"


def test_a_record_within_itself():
    check("""
        record Node(v: Real, next: Node)
        #                          ^^^^ error[P0331]: a record cannot contain itself: `Node` is a field of `Node`
        record A(b: [3] B)
        #               ^ error[P0331]: records cannot contain each other: `A`, `B`
        record B(a: (A, Real))
        #            ^ error[P0331]: records cannot contain each other
    """)


def test_with_behind_what_has_no_fields():
    check("""
        record Camera(focal: Real)
        t = (1, 2) with x = 3
        #   ^^^^^^ error[P0333]: this is a tuple of 2, not a record
        def f(c) c with focal = 3
        #        ^ error[P0333]: it is not known which record this is
    """)


@pytest.mark.parametrize(
    ("written", "meant"),
    [("Camra", ("Camera",)), ("float", ("Real",)), ("ℝ", ("Real",)), ("camera", ("Camera",)), ("Mesh", ())],
)
def test_the_type_that_may_be_meant(written, meant):
    found = only(f"record Camera(focal: Real)\ncamer = 1\ndef f(c: {written}) c.focal")
    assert found.code == "P0116"  # and no more is said of `c`
    assert [edit.text for suggestion in found.suggestions for edit in suggestion.edits] == list(meant)
