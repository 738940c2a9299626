"""Records as answers: they are shown as programs write them, at every face, and so can be written behind `#=`."""

import pickle

import pytest

import potto
from potto.evaluating.live import outcomes_of
from potto.evaluating.session import Session
from potto.evaluating.world import World

CAMERAS = r"""
record Camera(eye: (Real, Real, Real), focal: Real)
record Shape(r: Real, shade: Real -> Real)
front = Camera(eye=(0, 0, -5), focal=1.5)
two = [front, front with focal = 3]
def at(t) Camera((0, 0, t), integral [0, 1] 2*x*[x < t] d(x))
def lit(t) Shape(r=t^2, shade=\x . t*x)
def both(t) (t^2, \x . t*x)
"""


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        ("front", "Camera(eye=(0, 0, -5), focal=1.5)"),
        ("two", "[Camera(eye=(0, 0, -5), focal=1.5), Camera(eye=(0, 0, -5), focal=3)]"),
        ("(front, 1)", "(Camera(eye=(0, 0, -5), focal=1.5), 1)"),
        ("at(0.5)", "Camera(eye=(0, 0, 0.5), focal=0.25)"),
        ("deriv(at)((0.5, 1))", "(Camera(eye=(0, 0, 0.5), focal=0.25), Camera(eye=(0, 0, 1), focal=1))"),
        ("D(at)(0.5)", "Camera(eye=(0, 0, 1), focal=1)"),
        ("lit(3)", "Shape(r=9, shade=<function>)"),
        ("D(lit)(3)", "Shape(r=6, shade=<function>)"),
        ("(sin, 1)", "(<function>, 1)"),
    ],
)  # fmt: skip
def test_a_record_is_shown_with_its_fields(written: str, shown: str) -> None:
    world = World()
    world.put("cameras.po", f"{CAMERAS}print({written})\n#> {written}\n")
    assert [event.text for event in world.run("cameras.po")] == [shown]
    assert [outcome.value for outcome in outcomes_of(world, "cameras.po")] == [shown]


def test_what_is_shown_can_be_expected() -> None:
    world = World()
    cases = {
        "front": "Camera(eye=(0, 0, -5), focal=1.5)",
        "at(1/3)": "Camera(focal=0.111, eye=(0, 0, 0.333))",
        "two": "[front, Camera((0, 0, -5), 3)]",
    }
    wrong = {"at(1/3)": "Camera(focal=0.333, eye=(0, 0, 0.111))", "two": "[front, front]", "(sin, 1)": "(cos, 1)"}
    for expected, holds in ((cases, True), (wrong, False)):
        world.put("cameras.po", CAMERAS + "".join(f"#> {one}\n#= {other}\n" for one, other in expected.items()))
        assert [outcome.passed for outcome in outcomes_of(world, "cameras.po")] == [holds] * len(expected)


def test_a_loop_goes_through_records_and_vectors() -> None:
    world = World()
    loop = "for c in two:\n    d = c with focal = c.focal + 1\n    print(d, 2*c.eye, d.eye.z)\n"
    world.put("cameras.po", CAMERAS + loop)
    assert [event.text for event in world.run("cameras.po")] == [
        "Camera(eye=(0, 0, -5), focal=2.5) (0, 0, -10) -5",
        "Camera(eye=(0, 0, -5), focal=4) (0, 0, -10) -5",
    ]


def test_a_derivative_goes_into_functions_that_are_parts_of_the_answer() -> None:
    m = potto.compile(CAMERAS)
    assert m.eval("snd(D(both)(3))(5)").value == 5  # t*x by t, at x = 5
    assert m.eval("D(lit)(3).shade(5)").value == 5
    assert m.eval("snd(deriv(both)((3, 1)))((5, 1))").value == (15, 8)  # with x moving too


def test_python_has_the_fields_of_a_record() -> None:
    found = potto.compile(CAMERAS).at(0.5)
    assert found.value.eye == (0, 0, 0.5) and found.value == ((0, 0, 0.5), found.value.focal)
    assert str(pickle.loads(pickle.dumps(found))) == str(found)
    with pytest.raises(AttributeError, match="has no field `lens`"):
        _ = found.value.lens


def test_an_answer_at_the_prompt_keeps_its_fields() -> None:
    session = Session()
    session.run(CAMERAS)
    assert [valued.text for valued in session.run("two")] == [valued.text for valued in session.run("_")]
    assert session.run("_[1].focal")[-1].text == "3"


def test_derivatives_by_a_record_that_is_given_as_a_dict() -> None:
    """Alone as beside the value: by the record's name, and still a dict."""
    scaled = potto.compile("record Lens(focal: Real, eye: Real)\ndef f(c: Lens, t) c.focal^2*t + c.eye\n").f
    lens = {"focal": 2.0, "eye": 1.0}
    value, slopes = potto.value_and_grad(scaled)(lens, 3.0)
    assert value == 13
    assert slopes.value == {"focal": 12, "eye": 1}
    assert str(slopes) == "Lens(focal=12, eye=1)"
    assert str(potto.value_and_grad(scaled, ["c", "t"])(lens, 3.0)[1]) == "(Lens(focal=12, eye=1), 4)"
    assert str(pickle.loads(pickle.dumps(slopes))) == str(slopes)
