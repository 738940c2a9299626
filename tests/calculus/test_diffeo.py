"""Diffeomorphisms and conditions, checked: what is invertible passes in silence, what is not says why and where."""

from __future__ import annotations

import textwrap

import pytest

from potto.calculus.checking import conditions
from potto.calculus.checking.conditions import has_conditions
from potto.calculus.checking.diffeo import DiffeoInfo, check_conditions, diffeo_info, exported
from potto.calculus.inlining.expand import expanded
from potto.core.printer import format_term
from potto.core.terms import Branch, global_, lam, postorder, var
from potto.diagnostics import Diagnostic
from potto.modules import chunk_start, names
from potto.query import Database

FILE = "<text>"


def database(text: str, **others: str) -> Database:
    db = Database()
    db.set_input(("overlay", FILE), textwrap.dedent(text).strip("\n") + "\n")
    for name, other in others.items():
        db.set_input(("overlay", name), textwrap.dedent(other).strip("\n") + "\n")
    return db


def check(text: str) -> list[Diagnostic]:
    db = database(text)
    return [d for name in names(db, FILE) for d in check_conditions(db, FILE, name)]


def codes(text: str) -> list[str]:
    return [d.code for d in check(text)]


def info(text: str, name: str) -> DiffeoInfo:
    found = diffeo_info(database(text), FILE, name)
    assert found is not None
    return found


FINE = [
    "def f(t)\n    integral [0, 1] [x < t] d(x)",
    "def f(t)\n    integral [0, 1] [0 <= x < t] d(x)",
    "def f(t)\n    integral [0, 1] [x < t and x > t/2 or x < 0.1] d(x)",
    "def f(t)\n    integral [0, 1] [not x < t] d(x)",
    "def f(r)\n    integral ([-1, 1], [-1, 1]) [x^2 + y^2 < r^2] d(x, y)",
    "def f(r)\n    integral ([-1, 1], [-1, 1]) [hypot(x, y) < r] d(x, y)",
    "def f(r)\n    integral ([-1, 1], [-1, 1]) [abs(x) + abs(y) < r] d(x, y)",
    "def f(t)\n    integral [0, 1] [sin(40*pi*x) > t] d(x)",
    "def f(t)\n    integral ([0, 1], [0, 1]) [x*y < t] d(x, y)",
    "def f(a, b)\n    integral ([0, 1], [0, 1]) [x*cos(a) + y*sin(a) < b] d(x, y)",
    # not solvable, but increasing
    "def f(t)\n    integral [0, 1] [x*exp(x) < t] d(x)",
    "def f(t)\n    integral [-1, 1] [x^3 + x < t] d(x)",
    "def f(t)\n    integral [0, 9] [x + sin(x)/2 < t] d(x)",
    # one variable of several is enough
    "def f(t)\n    integral ([0, 1], [0, 1]) [x*exp(x)*sin(x) + y < t] d(x, y)",
    "def f(c)\n    integral ([0, 1], [0, 1]) if diffeo(x + y + c, x - y) then x else y d(x, y)",
    "def f(c)\n    integral ([0, 1], [0, 1]) if diffeo(x + y + c) then x else y d(x, y)",
    "def f(c)\n    integral ([0, 1], [0, 1], [0, 1]) if diffeo(x + y*z + c, y) then x else y d(x, y, z)",
    # varies with no variable of integration: plain
    "def f(c)\n    integral [0, 1] (if [c > 0] then x else 1) d(x)",
    # a function of what it is called with
    "def step(y)\n    [y > 0]\n\ndef f(t)\n    integral [0, 1] step(t*x - 1) d(x)",
    "def bump(y)\n    [y*exp(y)*sin(y) > 0.1]\n\ndef f(t)\n    bump(t)",
    "diffeo cond(x, y; c) = (x + y + c, x - y + c)\n\n"
    "def f(c)\n    integral ([0, 1], [0, 1]) ((cond (x, y)) c ? 1 : 0) d(x, y)",
    "diffeo polar(x, y) = (hypot(x, y), atan2(y, x))",
    "diffeo point(r, w; a, b) = (a + r*cos(w), b + r*sin(w)) where r > 0",
    "diffeo wave(x) = (sin(x)) where -1 < x, x < 1",
    "def f(t)\n    integral [0, 1] delta(x - t) d(x)",
    "def f(t)\n    integral ([0, 1], [0, 1]) (delta(x - t)*delta(y - t)) d(x, y)",
]


@pytest.mark.parametrize("text", FINE)
def test_what_is_invertible_passes(text: str) -> None:
    assert check(text) == []


SQUARE = "def f(c)\n    integral ([0, 1], [0, 1]) "
LINE = "def f(c)\n    integral [0, 1] "

WRONG = [
    ("P0401", SQUARE + "if diffeo(x + y + c, 2*x + 2*y) then 1 else 0 d(x, y)", "determinant"),
    ("P0401", "diffeo d(x, y; c) = (x + y + c, x + y - c)", "determinant is 0"),
    ("P0401", "diffeo d(x, y; c) = (x*y, x*y + c)", "determinant is 0"),
    ("P0401", "diffeo d(x, y, z) = (x - y, y - z, z - x)", "determinant is 0"),
    ("P0616", "def f(t)\n    integral [0, 9] [x + 2*sin(x) < t] d(x)", "has no closed form"),
    ("P0616", "def f(t)\n    integral [-9, 9] [x*exp(x) < t] d(x)", "has no closed form"),
    ("P0616", "def f(t)\n    integral [0, 1] [x^x < t] d(x)", "has no closed form"),
    ("P0402", LINE + "if diffeo(x + 2*sin(3*x) - c) then 1 else 0 d(x)", "in `x`"),
    ("P0616", LINE + "delta(x^3 - x - c) d(x)", "has no closed form"),
    ("P0405", LINE + "if diffeo(0.3*[x < c] + 0.5*x - c) then 1 else 0 d(x)", "jumps where `c - x` is 0"),
    ("P0405", SQUARE + "if diffeo(x - [y < c], x + y) then 1 else 0 d(x, y)", "jumps where `c - y` is 0"),
    ("P0402", "diffeo d(x; t) = (x + sin(x) + t)", "no inverse was found"),
    ("P0402", "diffeo d(x) = (sin(x))", "no inverse was found"),
    ("P0403", "diffeo d(x; t) = (x^3 + t) inverse (u) . (u^(1/3) - t)", "does not lead back"),
    ("P0403", "diffeo d(x, y) = (x + y, x - y) inverse (u, v) . ((u + v)/2, (u + v)/2)", "does not lead back"),
    ("P0403", "diffeo d(x) = (x^2) inverse (u) . (sqrt(u))", "does not lead back"),
    ("P0403", "diffeo d(x; t) = (x^3 + t) inverse (u) . (u - t)^(1/3)", "not defined where the map leads"),
    ("P0404", "diffeo d(x, y) = (x + y, x - y, x)", "3 components over 2 variables"),
    ("P0404", "diffeo d(x, y) = (x + y)", "1 component over 2 variables"),
    ("P0404", "diffeo d(x, y) = (x + y, x - y) inverse (u, v) . (u + v)", "the inverse takes 2 values to 1 component"),
    ("P0404", LINE + "if diffeo(x + c, 2*x) then 1 else 0 d(x)", "2 coordinates over 1 variable"),
    ("P0405", "diffeo d(x, y) = (abs(x) + y, x - y)", "not differentiable where `x` is 0"),
    ("P0405", "diffeo d(x, y) = (max(x, y), x - 2*y)", "not differentiable where `x - y` is 0"),
    ("P0406", "def f(t)\n    integral [0, 1] [x^2 + t^2 <= 0] d(x)", "never positive"),
    ("P0505", "def f(t)\n    integral [0, 1] (delta(x - t)*delta(t - x)) d(x)", "no meaning"),
    ("P0505", "def f(t)\n    integral [0, 1] delta(x - t)^2 d(x)", "no meaning"),
]


@pytest.mark.parametrize(("code", "text", "says"), WRONG)
def test_what_is_not_says_why(code: str, text: str, says: str) -> None:
    found = check(text)
    assert [d.code for d in found] == [code], found
    assert says in found[0].message
    assert found[0].severity == {"P0406": "warning", "P0616": "hint"}.get(code, "error")


def test_the_place_is_the_condition() -> None:
    text = "def f(t)\n    1 + integral [0, 9] [x + 2*sin(x) < t] d(x)\n"
    db = database(text)
    (found,) = check_conditions(db, FILE, "f")
    span = found.span.shift(chunk_start(db, FILE, "f"))
    assert text[span.start : span.end].strip("[]") == "x + 2*sin(x) < t"


def test_the_notes_say_for_each_variable_why() -> None:
    body = "if diffeo(x + 2*sin(x) + y*cos(y) - t) then 1 else 0"
    (found,) = check(f"def f(t)\n    integral ([0, 9], [0, 9]) ({body}) d(x, y)")
    assert len(found.notes) == 2
    assert any("for `x`" in n and "sin" in n for n in found.notes)
    assert any("for `y`" in n and "cos" in n for n in found.notes)


def test_a_condition_in_another_function_is_checked_where_it_is_called() -> None:
    text = """
        def bump(y)
            [y*sin(y) > 0.1]

        def f(t)
            integral [0, 9] bump(t*x) d(x)
    """
    (found,) = check(text)
    assert found.code == "P0616"
    assert "inside `bump`" in found.notes[-1]


def test_a_function_given_as_an_argument_is_checked_where_it_is_given() -> None:
    text = """
        def area(shader)
            integral [0, 9] shader(x) d(x)

        def f(t)
            area(\\y . [y*sin(y) > t])

        def g(t)
            area(\\y . [y > t])
    """
    db = database(text)
    assert check_conditions(db, FILE, "area") == ()
    assert [d.code for d in check_conditions(db, FILE, "f")] == ["P0616"]
    assert check_conditions(db, FILE, "g") == ()


def test_one_function_passed_through_two() -> None:
    text = """
        def inner(g, a)
            integral [0, 9] g(x, a) d(x)

        def outer(g, b)
            inner(g, 2*b)

        def wiggle(x, a)
            [x*sin(x) > a]

        def f(t)
            outer(wiggle, t)
    """
    db = database(text)
    assert [d.code for d in check_conditions(db, FILE, "f")] == ["P0616"]
    assert check_conditions(db, FILE, "outer") == ()


def test_a_recursion_ends() -> None:
    text = """
        def f(n, x)
            if n > 0 then [x < n]*f(n - 1, x) + f(n - 1, x/2) else 1

        def g()
            integral [0, 9] f(3, x) d(x)
    """
    assert check(text) == []


def test_calls_that_double_are_looked_at_once() -> None:
    lines = ["def f0(x)\n    [x > 0]\n"]
    lines += [f"def f{i}(x)\n    f{i - 1}(x)*f{i - 1}(x)\n" for i in range(1, 40)]
    text = "\n".join([*lines, "def top(t)\n    integral [0, 1] f39(x - t) d(x)\n"])
    db = database(text)
    assert check_conditions(db, FILE, "top") == ()


# Information for hover


def shown(found: DiffeoInfo) -> list[list[str]]:
    return [[format_term(part) for part in branch] for branch in found.branches]


def test_inverse_and_determinant_of_a_half_plane() -> None:
    found = info("diffeo cond(x, y; c) = (x + y + c, x - y + c)", "cond")
    assert (found.variables, found.parameters, found.values) == (("x", "y"), (("c",),), ("u", "v"))
    assert shown(found) == [["(u - 2*c + v)/2", "(u - v)/2"]]
    assert found.determinant is not None and format_term(found.determinant) == "-2"
    assert found.proven and found.method == "affine"


def test_a_fold_has_two_branches_and_where_selects_one() -> None:
    both = info("diffeo fold(x; t) = (x^2 - t)", "fold")
    assert len(both.branches) == 2
    one = info("diffeo fold(x; t) = (x^2 - t) where x > 0", "fold")
    assert len(one.branches) == 1 and shown(one)[0][0].startswith("sqrt")


def test_a_given_inverse_is_proven_or_says_that_it_was_sampled() -> None:
    proven = info("diffeo d(x, y) = (x + y, x - y) inverse (u, v) . ((u + v)/2, (u - v)/2)", "d")
    assert proven.proven and proven.notes == ()
    sampled = info("diffeo d(x) = (sinh(x)) inverse (u) . (log(u + sqrt(u^2 + 1)))", "d")
    assert not sampled.proven and "sample points" in sampled.notes[0]


def test_a_condition_on_an_integral_says_why_and_what_to_write_instead() -> None:
    (said,) = check("def f(t) integral [0, 1] [(integral [0, 1] [y < x*t] d(y)) > 0.1] d(x)")
    assert said.code == "P0402" and "`x` is inside an integral" in said.notes[0]
    assert said.help == "write `integral [0, 1] [y < x*t] d(y)` as a formula in `x`"
    assert not check("def f(t) integral [0, 1] [clamp(x*t, 0, 1) > 0.1] d(x)")


def test_an_integral_in_a_condition_may_not_jump_with_another_variable() -> None:
    # solved for u it is u = t/g(v), but g's own surface moves with v
    program = """
        def g(x) integral [0, 1] [u < x]*u d(u)
        def f(t) integral ([0, 1], [0, 1]) [u*g(v) < t] d(v, u)
    """
    (said,) = check(program)
    assert said.code == "P0402" and "a surface inside an integral moves with" in said.notes[0]


@pytest.mark.parametrize(
    ("inverse", "right"),
    [
        ("log(u + sqrt(u^2 + 1))", True),  # asinh, which symbols don't decide
        ("log(u + sqrt(u^2 + 1)) + 1e-9", False),
        ("log(u + sqrt(u^2 + 1 + 1e-18))", False),  # no double shows this
        ("log(u + sqrt(u^2 + 1))*(1 + 1e-11)", False),
    ],
)
def test_an_inverse_that_is_off_by_a_little_is_wrong(inverse: str, right: bool) -> None:
    said = check(f"diffeo d(x) = (sinh(x)) inverse (u) . ({inverse})")
    assert [d.code for d in said if d.severity == "error"] == ([] if right else ["P0403"])
    assert right or "which is off by" in said[0].message


@pytest.mark.parametrize(
    "program",
    [
        "diffeo d(x) = (0.1*sinh(0.3*x)) inverse (u) . (log(10*u + sqrt((10*u)^2 + 1))/0.3)",  # decimals are exact
        "diffeo d(x) = (1.4142135623730951*sinh(x)) inverse (u) . "
        "(log(u/sqrt(2) + sqrt((u/sqrt(2))^2 + 1)))",  # a rounded constant is as good as its digits
    ],
)
def test_constants_of_an_inverse_count_as_they_are_written(program: str) -> None:
    assert [d.code for d in check(program) if d.severity == "error"] == []


def test_a_wrong_inverse_shows_the_point() -> None:
    (found,) = check("diffeo d(x) = (x^2) inverse (u) . (sqrt(u))")
    assert "x = -" in found.message and "where" in found.help


def test_other_definitions_have_no_diffeo_info() -> None:
    assert diffeo_info(database("def f(t)\n    t"), FILE, "f") is None


# Increments


def test_a_callee_that_keeps_its_conditions_rechecks_nobody() -> None:
    before = """
        def step(y)
            [y > 0]*(1 + y)

        def f(t)
            integral [0, 1] step(t*x - 1) d(x)
    """
    db = database(before)
    assert check_conditions(db, FILE, "f") == ()
    db.set_input(("overlay", FILE), textwrap.dedent(before).strip("\n").replace("1 + y", "7 - y*y") + "\n")
    with db.recording() as events:
        assert check_conditions(db, FILE, "f") == ()
    ran = {e.query.rpartition(".")[2] for e in events if e.kind == "executed"}
    assert "core" in ran and "exported" in ran  # of `step`, which has changed
    assert "check_conditions" not in ran


def test_a_call_that_no_variable_of_integration_goes_into_is_not_looked_into() -> None:
    before = """
        def edge(y)
            integral [0, 1] [x < y] d(x)

        def f(t)
            integral [0, 1] [x < t]*x d(x) + edge(t) + edge(2*t)
    """
    db = database(before)
    assert check_conditions(db, FILE, "f") == ()
    db.set_input(("overlay", FILE), textwrap.dedent(before).strip("\n").replace("x < y", "x^2 < y") + "\n")
    with db.recording() as events:
        assert check_conditions(db, FILE, "f") == ()
    assert not [e for e in events if e.kind == "executed" and e.query in ("exported", "check_conditions")]


def test_what_leads_to_no_condition_is_not_exported() -> None:
    db = database("def a(x)\n    x + 1\n\ndef b(x)\n    a(x)*[x < 1] + a(2*x)\n\ndef c(x)\n    a(x) + sin(x)\n")
    shown = {name: format_term(skeleton) for name in "abc" if (skeleton := exported(db, FILE, name)) is not None}
    assert [has_conditions(exported(db, FILE, name)) for name in "abc"] == [False, True, False], shown
    assert "a(" not in shown["b"]


def test_recursive_definitions_export_their_conditions() -> None:
    db = database("def a(x, n)\n    if n > 0 then b(x, n - 1) else [x < 1]\n\ndef b(x, n)\n    a(x/2, n)\n")
    assert all(has_conditions(exported(db, FILE, name)) for name in "ab")


def test_calls_that_double_at_every_level_are_followed_to_an_end() -> None:
    levels = [f"def f{n}(x)\n    f{n - 1}(2*x) + f{n - 1}(x/3)\n" for n in range(1, 30)]
    text = "\n".join(["def f0(x)\n    [x < 1]\n", *levels, "def g(t)\n    integral [0, 1] f29(x*t) d(x)\n"])
    assert check(text) == []  # there are 2^29 conditions


def test_a_chain_that_hands_a_function_on_is_followed_once_a_level(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[object] = []
    entered = conditions._Walk.entered
    monkeypatch.setattr(conditions._Walk, "entered", lambda *given: (seen.append(given), entered(*given))[1])
    levels = [f"def f{n}(h, t)\n    f{n - 1}(\\x . h(x) + {n}, t)\n" for n in range(1, 40)]
    chain = "\n".join(["def f0(h, t)\n    integral [0, 1] [h(x) > t] d(x)\n", *levels])
    assert check(chain) == []
    assert not seen  # no level knows `h`, so none has to look into the one below
    (said,) = check(chain + "\ndef g(h, t)\n    f39(\\x . h(x)*[x*sin(x)*exp(x) < t], t)\n")
    assert said.code == "P0616"
    assert len(seen) < 3 * 40


def test_a_condition_that_a_passed_function_brings_is_the_callers() -> None:
    area = "def area(h)\n    integral [0, 1] h(x) d(x)\n\n"
    (said,) = check(area + "def f(t)\n    area(\\x . [x*sin(x)*exp(x) < t])\n")
    assert said.code == "P0616"
    assert check(area + "def f(t)\n    area(\\x . [x < t])\n") == []


def test_a_diffeomorphism_that_is_none_is_reported_where_it_is_defined_and_not_where_it_is_used() -> None:
    program = """
        diffeo half(x, y; c) = (COMPONENTS)

        def shader(x, y)(c) (half(x, y; c) ? x : y)

        def render(c)
            integral ([0, 1], [0, 1]) shader(x, y)(c) + (half(x, y; c) ? 1 : 2) d(x, y)
    """
    assert codes(program.replace("COMPONENTS", "x + y + c, x - y")) == []
    (said,) = check(program.replace("COMPONENTS", "x - y + c, x - y"))
    assert said.code == "P0401" and "whose determinant is 0" in str(said.notes)


def test_a_diffeomorphism_that_calls_what_it_is_given_is_refused() -> None:
    (said,) = check("diffeo d(x, y; c) = (x + y + c(x), x - y)")
    assert said.code == "P0402" and "`c(x)`" in said.message
    assert codes("diffeo d(x, y; c, k) = (x + y + c(k), x - y)") == []


# Calls carried out


def test_calls_are_carried_out_through_curried_groups() -> None:
    function = lam(("x", "y"), lam(("c",), var("x")))
    from potto.core.terms import app

    call = app(app(global_("m", "f"), (var("a"), var("b"))), (var("k"),))
    assert expanded(call, lambda g: function) is var("a")


def test_a_recursion_is_carried_out_once() -> None:
    from potto.core.terms import ONE, add, app

    body = add(app(global_("m", "f"), (var("n"),)), ONE)
    call = app(global_("m", "f"), (var("a"),))
    found = expanded(call, lambda g: lam(("n",), body))
    assert found is add(call, ONE)
    assert not any(isinstance(n, Branch) for n in postorder(found))


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (r"over(\x . x*sin(9*x)*exp(x), t)", ["P0616"]),
        ("over(wave, t)", ["P0616"]),
        ("on(wave, t)", ["P0616"]),  # handed on
        ("inner(wave, t)", ["P0616"]),  # called by what is handed on
        ("snd(renamed(deriv(wave), (t, 1)))", ["P0616"]),  # through a derivative that has names
        (r"over(\x . x + exp(x), t)", []),  # increasing
        (r"on(\x . x^2, t)", []),
        (r"integral [0, 1] over(\x . wave(x) + y, t) d(y)", []),  # solved for y
        ("unused(wave, t)", []),  # it decides nothing
    ],
)
def test_a_condition_that_a_passed_function_decides_is_checked_where_it_is_passed(body: str, said: list[str]) -> None:
    db = database(
        """
def wave(x) x*sin(9*x)*exp(x)
def over(h, t) integral [0, 1] [h(x) > t] d(x)
def on(h, t) over(h, t)
def inner(k, t) over(\\x . k(x)^2, t)
def unused(h, t) integral [0, 1] [x > t]*h(x) d(x)
dover = deriv(over)
renamed = dover
"""
        + f"def f(t) {body}\n"
    )
    assert [d.code for d in check_conditions(db, FILE, "f")] == said
    assert not check_conditions(db, FILE, "over") and not check_conditions(db, FILE, "inner")
