"""What `potto deriv` and the editor print is Potto that one can write."""

from __future__ import annotations

from collections.abc import Callable
from math import log

import pytest
from formulas import Shown

from potto.calculus.explanation.explain import explain_derivative
from potto.calculus.explanation.readable import readable
from potto.checking.facts import derivative_facts
from potto.checking.library import Library
from potto.core.printer import format_term
from potto.core.terms import ONE, ZERO, add, branch, mul, prim, sub, var
from potto.syntax import parse_expression

PROGRAMS = [
    ("def f(s, t) integral (x ~ normal(0, s)) [x < t] d(x)", ("s > 0",)),
    ("def f(a, t) 2*integral (x ~ uniform(0, a)) [x < t]*x d(x)", ("a > 0",)),
    ("def f(r, t) integral (x ~ exponential(r)) exp(-t*x) d(x)", ("r > 0",)),
    (
        "record Noise(mean: Real, width: Real)\n"
        "def f(n: Noise, t) integral (x ~ uniform(-n.width, n.width)) [x + n.mean < t] d(x)",
        ("n.width > 0",),
    ),
    ("def f(a, m, b) integral (x ~ triangular(a, m, b)) x d(x)", ("a <= m and m <= b", "a < b")),
    ("def f(n, t) integral [0, 1] (sum k in 1..n ([x < t/k] + k*t)) * (sum k in 1..n (k*t*x)) d(x)", ()),
    ("def f(n, t) sum k in 1..n (integral [0, 1] [x < t/k] d(x))", ()),
    ("def g(t) integral [0, 1] [x < t] d(x)\ndef f(t) integral [0, 1] g(t*x)*g(x) d(x)", ()),
]


@pytest.mark.parametrize(("program", "where"), PROGRAMS)
def test_formulas_are_potto(program: str, where: tuple[str, ...]) -> None:
    library = Library()
    file = library.put("<text>", program + "\n")
    facts = derivative_facts(library.db, file, "f")
    assert facts is not None and facts.where == where
    parts = [*facts.integrals, *((facts.body,) if facts.body is not None else ())]
    formulas = [text for p in parts for text in (p.value, p.interior, *p.boundary, *p.bounds)]
    shown = explain_derivative(library.db, file, "f")
    formulas += [shown.tangent, *(text for i in shown.integrals for text in (i.integrand, i.interior, *i.deltas))]
    for text in filter(None, [*formulas, facts.derivative, *where]):
        assert "?" not in text and "'" not in text
        assert not parse_expression(text).diagnostics, text
    assert all(f"has a value where {condition}" in shown.notes for condition in where)


def test_an_index_is_named_as_the_formula_has_it() -> None:
    library = Library()
    file = library.put("<text>", "def g(t) [integral [0, i + 1] [x < t] d(x) for i in 0..3]\n"
                                 "def f(t) sum i in 0..3 (i*g(t)[i])\n")  # fmt: skip
    facts = derivative_facts(library.db, file, "f")
    assert facts is not None
    (part,) = facts.integrals
    assert part.each == "i in 0..3"
    assert part.value == "integral [0, i + 1] [x < t] d(x)"


DECIDED = [
    (
        "def f(t, a) integral ([0, 1], [0, 1]) [x < t]*[0*x >= a - a]*[x + y < 1] d(x, y)",
        "[0 < t < 1 and t + y < 1]",
    ),
    ("def f(t) integral ([0, 1], [0, 1]) [x < t]*[x <= t]*[x + y <= t + y] d(x, y)", "[0 < t < 1]"),
    ("def f(t) integral ([0, 1], [0, 1]) [x < t]*[y - y + 1 > 0] d(x, y)", "[0 < t < 1]"),
]


@pytest.mark.parametrize(("program", "conditions"), DECIDED)
def test_conditions_that_say_nothing_are_not_shown(program: str, conditions: str) -> None:
    library = Library()
    file = library.put("<text>", program + "\n")
    shown = str(derivative_facts(library.db, file, "f"))
    assert f"dt*{conditions}" in shown or f"dt*(integral [0, 1] {conditions} d(y))" in shown
    assert "0 = 0" not in shown and "0 >= 0" not in shown and "1 = 0" not in shown


def test_what_never_holds_is_not_shown_and_roots_of_decimals_are_decimals() -> None:
    """A band of the width c/3 around t has one edge above t where c > 0, and none where c < 0."""
    library = Library()
    file = library.put("<text>", "def f(t, c) integral [t, t + 1] [abs(x - t) < c/3] d(x)\n"
                       "def g(t) integral [t, t + 1] [(x - t)^2 < 0.04] d(x)\n"
                       "def h(t) integral [0, 1] [(x - t)^2 < 0.04] d(x)\n")  # fmt: skip
    shown = explain_derivative(library.db, file, "f").tangent
    assert shown == "dt*([c > 3] - [c > 0]) + (dc/3 + dt)*[0 < c < 3]"
    assert explain_derivative(library.db, file, "g").tangent == "0"  # the band moves as the bounds do
    found = explain_derivative(library.db, file, "h").tangent
    assert found == "dt*([-0.2 < t < 0.8] - [0.2 < t < 1.2])"


@pytest.mark.parametrize(
    ("condition", "read"),
    [
        ("x + 2*y < t", "[x < t < x + 2]"),
        ("x^2 + y^2 < t^2", "[x^2 < t^2 < x^2 + 1]"),
        ("x + y + t >= 0", "[-1 < t + x < 0]"),
    ],
)
def test_what_has_two_bounds_stands_between_them(condition: str, read: str) -> None:
    """Also where one of them is found of half of it, or of it with its sign turned."""
    library = Library()
    file = library.put("<text>", f"def f(t) integral ([0, 1], [0, 1]) [{condition}] d(x, y)\n")
    assert read in explain_derivative(library.db, file, "f").tangent


@pytest.mark.parametrize(
    ("program", "read"),
    [
        ("def f(t) integral ([0, 1], [0, 1]) [x*y < t] d(x, y)", "dt*(integral [0, 1] 1/x*[0 < t < x] d(x))"),
        ("def f(t) integral ([0, 1], [0, 1]) [x*(y - t) < 0] d(x, y)", "dt*[0 < t < 1]"),
        ("def f(t) integral ([-1, 0], [0, 1]) [x*y > t] d(x, y)", "dt*(integral [-1, 0] 1/x*[x < t < 0] d(x))"),
    ],
)
def test_factors_whose_sign_is_known_inside_an_integral_are_left_out(program: str, read: str) -> None:
    library = Library()
    file = library.put("<text>", program + "\n")
    assert read in explain_derivative(library.db, file, "f").tangent


def test_a_bracket_that_is_taken_from_one_is_what_holds_elsewhere() -> None:
    b = branch((sub(var("t"), var("x")),), True, ONE, ZERO)
    assert format_term(readable(mul(var("x"), sub(ONE, b)), frozenset())) == "x*[t <= x]"
    assert format_term(readable(mul(var("x"), sub(b, ONE)), frozenset())) == "-x*[t <= x]"


def test_a_sign_that_conditions_tell_is_not_written() -> None:
    """The edges of abs(x - 1/2) < a move apart; that there are two is asked of a, and so is the sign of each slope."""
    library = Library()
    file = library.put("<text>", "def f(a) integral [0, 1] [abs(x - 1/2) < a]*x d(x)\n")
    assert explain_derivative(library.db, file, "f").tangent == "da*[0 < a < 1/2]"


@pytest.mark.parametrize(
    ("program", "read"),
    [
        ("def f(t) integral ([0, 1], [0, x]) [x < t] d(x, y)", "t*dt*[0 < t < 1]"),
        ("def f(t) integral ([0, 1], [x, 1]) [x^2 + y^2 < t]*y d(x, y)",
         "dt/2*(integral [0, 1] [2*x^2 < t < x^2 + 1] d(x))"),
    ],
)  # fmt: skip
def test_what_an_integral_does_not_depend_on_is_not_integrated(program: str, read: str) -> None:
    """A constant is one times the length, 0 is nothing; and x < sqrt(t - x^2) is 2*x^2 < t where x is positive."""
    library = Library()
    file = library.put("<text>", program + "\n")
    assert explain_derivative(library.db, file, "f").tangent == read


def test_what_both_sides_of_a_choice_share_stands_before_it() -> None:
    library = Library()
    file = library.put("<text>", "def f(t, s) integral [0, 1] (if [x < 1/2] then x*exp(-t*x) else 3*exp(-t*x)) d(x)\n")
    shown = explain_derivative(library.db, file, "f").tangent
    assert shown == "-dt*(integral [0, 1] x*exp(-t*x)*(if [x < 1/2] then x else 3) d(x))"


def test_what_all_summands_are_multiples_of_is_cancelled() -> None:
    """The share of a normal distribution between a and b moves by its densities there."""
    library = Library()
    file = library.put("<text>", "def f(a, b, m, s) (erf((b - m)/(s*sqrt(2))) - erf((a - m)/(s*sqrt(2))))/2\n")
    shown = explain_derivative(library.db, file, "f").tangent
    assert shown == (
        "(exp(-(b - m)^2/(2*s^2))*(s*(db - dm) + (m - b)*ds)"
        " + exp(-(a - m)^2/(2*s^2))*(s*(dm - da) + (a - m)*ds))/(s^2*sqrt(2*pi))"
    )


def test_a_choice_by_a_sign_is_a_function_of_the_size() -> None:
    """The root of x^3 = a*b is chosen by its sign, and so is the slope there."""
    library = Library()
    file = library.put(
        "<text>", "def f(a, b) integral [0, 9] [x^3 < a*b] d(x)\ndef g(a, b) integral [a, b] [x^3 < a*b] d(x)\n"
    )
    shown = explain_derivative(library.db, file, "f").tangent
    assert shown == "if [0 < a*b < 729] then (b*da + a*db)/(3*(a*b)^(2/3)) else 0"
    fifth = library.put("h", "def h(t) integral [-9, 9] [x^5 > t - 1]*x d(x)\n")
    shown = explain_derivative(library.db, fifth, "h").tangent
    assert shown == "-sign(t - 1)*dt/(5*abs(t - 1)^(3/5))*[-59048 < t < 59050]"
    surfaces = explain_derivative(library.db, file, "g").integrals[0].surfaces
    assert surfaces[0].roots == ("x = abs(a*b)^(1/3)*sign(a*b)",)


def test_a_root_of_a_product_is_one_of_squares() -> None:
    x, a, r = var("x"), var("a"), var("r")
    product = mul(sub(add(r, a), x), sub(add(r, x), a))
    assert format_term(readable(prim("sqrt", product), frozenset(), {"x": (0, 1)})) == "sqrt(r^2 - (x - a)^2)"


def test_numbers_are_decimals() -> None:
    """What a computer makes of 0.3 - 0.2 is 0.09999999999999998."""
    library = Library()
    side = "def side(x, a, b) (a - b)*(x - b)\n"
    file = library.put("<text>", f"{side}def f(t) integral [0, 1] [side(x, 0.3, 0.2) < t]*(0.3 - 0.2) d(x)\n")
    facts = derivative_facts(library.db, file, "f")
    assert facts is not None and facts.surfaces == ("t = 0.1*(x - 0.2)",)
    assert facts.integrals[0].value == "integral [0, 1] [0.1*(x - 0.2) < t]*0.1 d(x)"


def test_fields_have_their_names() -> None:
    """Also those of what is differentiated by another name, and of what is loaded or defined beside it."""
    library = Library()
    file = library.put(
        "<text>",
        """
record C(f: (Real, Real), focal: Real)
known = C((1, 2), 3)
def f(c: C, t) integral [0, 1] [c.focal*x < c.f.1] d(x)*t*known.focal
df = deriv(f)
""",
    )
    for name in ("f", "df"):
        facts = derivative_facts(library.db, file, name)
        assert facts is not None and facts.surfaces == ("c.f.1 = c.focal*x",)
        assert "dc.focal" in facts.derivative and "known.focal" in facts.derivative and "c.1" not in str(facts)


def test_the_state_of_a_fold_has_the_fields_of_the_first_one() -> None:
    library = Library()
    record = "record S(at: Real, speed: Real)\nfirst = S(1, 0)\n"
    text = record + "def f(k) (fold s = first for i in 1..4 (S(s.at + s.speed/4, s.speed - k*s.at))).at\n"
    facts = derivative_facts(library.db, library.put("<text>", text), "f")
    assert facts is not None and facts.body is not None
    assert "s.speed" in facts.body.value and facts.body.value.endswith(".at") and "s.0.0" not in str(facts)


@pytest.mark.parametrize(
    ("program", "read"),
    [
        ("sum i in 1..3 (integral [0, i] [x < t] d(x))", "dt*(sum i in 1..3 ([0 < t < i]))"),
    ("sum i in 1..5 (integral [0, 1] [x*abs(i) < t/i] d(x))", "dt*(sum i in 1..5 (1/i^2*[0 < t < i^2]))"),
        ("sum i in -5..-1 (integral [0, 1] [x*i < t] d(x))", "-dt*(sum i in -5..-1 (1/i*[i < t < 0]))"),
        ("sum i in -1..5 (integral [0, 1] [x*i < t] d(x))", "dt*(sum i in -1..5 (1/abs(i)*[i*t > 0 and t/i < 1]))"),
        ("sum i in 1..5 (sum j in i..9 (integral [0, 1] [j*x < t] d(x)))",
         "dt*(sum i in 1..5 (sum j in i..9 (1/j*[0 < t < j])))"),
    ],
)  # fmt: skip
def test_an_index_has_the_sign_of_its_range(program: str, read: str) -> None:
    """The third one has none: i may be -1, and 0."""
    library = Library()
    facts = derivative_facts(library.db, library.put("<text>", f"def f(t) {program}"), "f")
    assert facts is not None and facts.derivative == read


@pytest.mark.parametrize(
    ("program", "read"),
    [
        ("integral [0, 1] (if [x < a] then (if [a < b] then 1 else x) else (if [a < b] then 3 else x)) d(x)",
         "-2*da*[0 < a < 1 and a < b]"),
        ("integral ([0, 1], [0, 1]) (if [x < a and y < b] then x*y else x + y)*[x > 2] d(x, y)", "0"),
        ("integral [0, 4] [x^2 > a] d(x)", "if [0 < a < 16] then -da/(2*sqrt(a)) else 0"),
    ],
)  # fmt: skip
def test_what_differs_between_two_choices_is_one(program: str, read: str) -> None:
    library = Library()
    facts = derivative_facts(library.db, library.put("<text>", f"def f(a, b) {program}"), "f")
    assert facts is not None
    assert explain_derivative(library.db, library.put("<text>", f"def f(a, b) {program}"), "f").tangent == read


@pytest.mark.parametrize(
    ("body", "read"),
    [
        ("integral [0, 2] [t*x > 1] d(x)", "dt/t^2*[t > 1/2]"),
        ("(integral [0, 1] [v*x < t] d(x))*[v > 0]", "(dt/v - t*dv/v^2)*[0 < t < v]"),
        ("integral [0, 1] [v*x^2 < t]*[v > 0] d(x)", "(dt/v - t*dv/v^2)/(2*sqrt(t/v))"),
    ],
)
def test_a_size_whose_sign_conditions_tell_is_written_without_bars(body: str, read: str) -> None:
    library = Library()
    file = library.put("<text>", f"def f(t, v) {body}\n")
    found = explain_derivative(library.db, file, "f").tangent
    assert read in found and "abs" not in found and "sign" not in found


SIZES = [
    ("[x*y < t]*y", "abs(t)*dt*(integral [-1, 1] 1/x^2*[t*x > 0 and t/x < 1] d(x))", lambda t: 1 - abs(t)),
    ("[x*y < t]*y^2", "1/(x^2*abs(x))*[t*x > 0 and t/x < 1]", lambda t: (1 - t * t) / 2),
    ("[x*y > -t]*y", "abs(t)*dt*(integral [-1, 1] 1/x^2*[t*x < 0 and t/x > -1] d(x))", lambda t: 1 - abs(t)),
]


@pytest.mark.parametrize(("integrand", "read", "slope"), SIZES)
def test_signs_that_two_brackets_tell_make_sizes(integrand: str, read: str, slope: Callable[[float], float]) -> None:
    """At x*y = t, where both have the sign of t or, of -t, one of them has the other: the integral of |t|^n/|x|^(n + 1)
    over |x| from |t| to 1. To 1e-8, which is what the integral over x is asked for."""
    shown = Shown(f"def f(t) integral ([-1, 1], [0, 1]) {integrand} d(x, y)\n", "f")
    assert read in shown.text.tangent and "[x > 0]" not in shown.text.tangent
    assert shown.problems() == []
    for t in (0.25, -0.5):
        assert shown.module().eval(f"shown_1({t}, 1)").value == pytest.approx(slope(t), abs=1e-8)


def test_a_sign_under_an_integral_makes_a_size() -> None:
    """The slope of the area where x*y < t is 2*log(1/|t|)."""
    shown = Shown("def f(t) integral ([-1, 1], [-1, 1]) [x*y < t] d(x, y)\n", "f")
    assert "1/abs(x)*[" in shown.text.tangent
    assert shown.module().eval("shown_1(-0.25, 1)").value == pytest.approx(2 * log(4), abs=1e-8)


@pytest.mark.parametrize(
    ("function", "read"),
    [
        ("f(t, m) integral [0, 1] abs(x - t)*exp(m*x) d(x)",
         "exp(m*x)*((if [x < t] then 1 else -1)*dt + x*abs(x - t)*dm)"),
        ("f(n, k) integral [-n, n] (if [r > 0] then -k else k)/(2*n) d(r)",
         "(if [r > 0] then 1 else -1)*(k*dn - n*dk)/(2*n^2)"),
        ("f(t) integral ([0, 1], [0, 1]) x*t*[0.1*x + 0.1 < 0.6*y] d(x, y)", "x*dt*[x + 1 < 6*y]"),
        ("f(y, r, z) integral [0, 1] exp(y*(r - x)/2 + x*sin(z))*exp(y*(r - x)/2 + x*sin(r)) d(x)",
         "exp(x*sin(r) + x*sin(z) + y*(r - x))*((r - x)*dy + (y + x*cos(r))*dr + x*cos(z)*dz)"),
    ],
)  # fmt: skip
def test_opposite_sides_tenths_and_exponents_are_told_once(function: str, read: str) -> None:
    """1 comes before -1, conditions compare whole numbers, and what exponents share is added up."""
    library = Library()
    file = library.put("<text>", f"def {function}\n")
    assert explain_derivative(library.db, file, "f").integrals[0].interior == read


@pytest.mark.parametrize(
    ("function", "read"),
    [
        ("f(x, t, s) s*(1 - [x < t])", "ds*[t <= x]"),
        ("f(x, t, s) s*exp(s)*([t <= x] + [x < t])*[x > 2]", "(s + 1)*exp(s)*ds*[x > 2]"),
        ("f(t, s) integral [0, 1] exp(s*x) - exp(s*x)*[x < t] d(x)", "x*exp(s*x)*[t <= x]"),
    ],
)
def test_a_condition_and_its_opposite_are_one(function: str, read: str) -> None:
    library = Library()
    file = library.put("<text>", f"def {function}\n")
    assert read in explain_derivative(library.db, file, "f").tangent


def test_a_formula_has_the_decimals_of_what_it_calls() -> None:
    library = Library()
    file = library.put("<text>", "def s(t) 4.905*t^2\ndef f(h) integral [0, 1] [s(t) < h] d(t)\n")
    assert explain_derivative(library.db, file, "f").tangent == "if [0 < h < 4.905] then dh/(2*sqrt(4.905*h)) else 0"


def test_a_formula_has_the_decimals_of_what_it_names_and_numbers_added_up() -> None:
    library = Library()
    text = "a = 0.2\ndef f(r) integral [0, 1] [(a^2 + 1/100 - r^2 + 9)*x < a] d(x)\n"
    facts = derivative_facts(library.db, library.put("<text>", text), "f")
    assert facts is not None and facts.surfaces == ("a = (a^2 + 9.01 - r^2)*x",)
