"""Derivatives by the roots of quadratic equations: told by names for the roots, and right at each."""

from __future__ import annotations

from itertools import pairwise

import mpmath
import pytest
from formulas import Shown

from potto.checking.facts import derivative_facts
from potto.checking.library import Library
from potto.checking.typeset import derivative_latex

WHOLE = (
    "let D = b^2 - 4*a*c; x1 = -(b + sqrt(D))/(2*a); x2 = (sqrt(D) - b)/(2*a) in if [D > 0] then"
    " -((x1^2*da + x1*db + dc)*[0 < x1 < 1] + (x2^2*da + x2*db + dc)*[0 < x2 < 1])/sqrt(D) else 0"
)


def test_both_roots_share_all_but_their_place() -> None:
    """A root x of a*x^2 + b*x + c moves by -(x^2*da + x*db + dc) over the slope there, which is sqrt(D) or -sqrt(D)."""
    shown = Shown("def f(a, b, c) integral [0, 1] [a*x^2 + b*x + c < 0] d(x)\n", "f")
    assert shown.text.tangent == WHOLE
    assert shown.problems() == []
    assert r"\quad \text{where } D = b^{2} - 4 \, a \, c, x_{1} = " in str(derivative_latex(shown.text, "f"))


PLACES = [(3, -3.1, 0.5), (-2.0, 1.7, -0.2), (2, 1, -0.7), (-1, 0.3, 0.4), (1, 1, 1), (0.01, -1, 0.3)]
FACTORS = {"1": lambda x: x, "x^2": lambda x: x**3 / 3}  # with their antiderivatives


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("factor", FACTORS)
def test_the_formula_has_the_slope_of_the_integral_between_the_roots(
    factor: str, place: tuple[float, float, float]
) -> None:
    """Two roots in the domain, one, and none, for either sign of a. To 1e-10: the least a takes digits of a root."""
    shown = Shown(f"def f(a, b, c) integral [0, 1] [a*x^2 + b*x + c < 0]*{factor} d(x)\n", "f")
    along = 0.3, -0.7, 0.4

    def integral(step: mpmath.mpf) -> mpmath.mpf:
        a, b, c = (mpmath.mpf(p) + step * mpmath.mpf(d) for p, d in zip(place, along, strict=True))
        root = mpmath.sqrt(b * b - 4 * a * c) if b * b > 4 * a * c else None
        ends = [] if root is None else sorted([(-b - root) / (2 * a), (-b + root) / (2 * a)])
        cuts = [mpmath.mpf(0), *(x for x in ends if 0 < x < 1), mpmath.mpf(1)]
        inside = [(p, q) for p, q in pairwise(cuts) if a * (p + q) ** 2 / 4 + b * (p + q) / 2 + c < 0]
        return sum((FACTORS[factor](q) - FACTORS[factor](p) for p, q in inside), mpmath.mpf(0))

    with mpmath.workdps(40):
        slope = float(mpmath.diff(integral, 0))
    arguments = ", ".join(map(repr, (*place, *along)))
    assert shown.module().eval(f"shown_1({arguments})").value == pytest.approx(slope, rel=1e-10, abs=1e-12)


BOTH = "let D = b^2 - 4*a*c; u1 = -(b + sqrt(D))/(2*a); u2 = (sqrt(D) - b)/(2*a) in if [D > 0] then -("


@pytest.mark.parametrize(
    ("surface", "root"),
    [
        ("a*exp(2*x) + b*exp(x) + c", "(u1*da + db + dc/u1)*["),
        ("a*exp(x)^2 + b*exp(x) + c", "(u1*da + db + dc/u1)*["),
        ("a*log(x)^2 + b*log(x) + c", "exp(u1)*(u1^2*da + u1*db + dc)*["),
        ("a*sin(x)^2 + b*sin(x) + c", "(u1^2*da + u1*db + dc)/sqrt(1 - u1^2)"),
        ("a*x^4 + b*x^2 + c", "(u1^2*da + u1*db + dc)/sqrt(u1)"),
    ],
)
def test_roots_of_what_is_quadratic_in_a_function(surface: str, root: str) -> None:
    """u = exp(x) moves by -(u^2*da + u*db + dc) over the slope, and x by dx/du = 1/u times that; others alike."""
    shown = Shown(f"def f(a, b, c) integral [0, 1] [{surface} < 0] d(x)\n", "f")
    assert shown.problems() == []
    assert shown.text.tangent.startswith(BOTH) and "sign(" not in shown.text.tangent
    assert root in shown.text.tangent and root.replace("u1", "u2") in shown.text.tangent


FUNCTIONS = {  # with their inverses, where these are in the domain
    "exp(x)": lambda u: mpmath.log(u) if u > 0 else None,
    "log(x)": mpmath.exp,
    "sin(x)": lambda u: mpmath.asin(u) if abs(u) <= 1 else None,
    "x^2": lambda u: mpmath.sqrt(u) if u >= 0 else None,
    "1/(1 + x)": lambda u: 1 / u - 1 if u else None,
    "tanh(x)": lambda u: mpmath.atanh(u) if abs(u) < 1 else None,
    "cos(x)": lambda u: mpmath.acos(u) if abs(u) <= 1 else None,  # which falls
    "(x - 2)^2": lambda u: 2 - mpmath.sqrt(u) if u >= 0 else None,
}
AROUND = [(3, -5, 1.9), (-2, 3.3, -1.25), (1, -1.9, -0.6), (2, 1, -0.7), (1, 0.3, -1.1), (1, 1, 1), (-1, 0.1, 0.3)]


@pytest.mark.parametrize("u", FUNCTIONS)
@pytest.mark.parametrize("place", AROUND)
def test_the_slope_where_it_is_quadratic_in_a_function(u: str, place: tuple[float, float, float]) -> None:
    """Held against the length between the roots, to 40 digits; to 1e-10 as above."""
    surface = f"a*({u})^2 + b*({u}) + c"
    shown = Shown(f"def f(a, b, c) integral [0, 1] [{surface} < 0] d(x)\n", "f")
    along, function = (0.3, -0.7, 0.4), eval(f"lambda x: {u.replace('^', '**')}", vars(mpmath))

    def integral(step: mpmath.mpf) -> mpmath.mpf:
        a, b, c = (mpmath.mpf(p) + step * mpmath.mpf(d) for p, d in zip(place, along, strict=True))
        root = mpmath.sqrt(b * b - 4 * a * c) if b * b > 4 * a * c else None
        ends = [] if root is None else [FUNCTIONS[u](r) for r in ((-b - root) / (2 * a), (-b + root) / (2 * a))]
        cuts = [mpmath.mpf(0), *sorted(x for x in ends if x is not None and 0 < x < 1), mpmath.mpf(1)]
        middles = [(q - p, function((p + q) / 2)) for p, q in pairwise(cuts)]
        return sum((length for length, v in middles if a * v * v + b * v + c < 0), mpmath.mpf(0))

    with mpmath.workdps(40):
        slope = float(mpmath.diff(integral, 0))
    arguments = ", ".join(map(repr, (*place, *along)))
    assert shown.module().eval(f"shown_1({arguments})").value == pytest.approx(slope, rel=1e-10, abs=1e-12)


def test_names_of_roots_are_no_parameters_and_no_functions() -> None:
    program = "def x2(t) t^2\ndef f(D, x1) integral [0, 1] [D*x^2 + x1*x + x2(x1) < D] d(x)*x2(D)\n"
    shown = Shown(program, "f")
    assert shown.text.tangent.startswith("let D1 = x1^2 + 4*D*(D - x1^2); x3 = ")
    assert shown.problems() == []
    given, module = "0.5, 0.25, 0.3, 0.7", shown.module()
    along = module.eval("snd(deriv(f)((0.5, 0.3), (0.25, 0.7)))").value
    assert module.eval(f"shown_1({given})").value == pytest.approx(along, rel=1e-9)


@pytest.mark.parametrize(
    ("program", "read"),
    [
        ("integral [-1, 1] [x^2 < t]*x^2 d(x)", "if [0 <= t < 1] then sqrt(t)*dt else 0"),
        ("integral [0, 3] [x^2 - 3*x + t < 0] d(x)", "if [0 < t < 9/4] then -2*dt/sqrt(9 - 4*t) else 0"),
    ],
)
def test_what_is_shorter_without_names_has_none(program: str, read: str) -> None:
    shown = Shown(f"def f(t) {program}\n", "f")
    assert read in shown.text.tangent and "let" not in shown.text.tangent


DIVIDED = [
    ("(a, b, c) integral [0, 1] [a*x^2 + b*x + c < 0] d(x)", ("a",)),
    ("(w, t) integral [-1/2, 1/2] [t < w*u] d(u)", ("w",)),
    ("(t, v) integral [0, 1] [v*x < t] d(x)*[v > 0]", ()),  # where the bracket is 0 the formula is
    ("(t) integral [0, 2] [t*x > 1] d(x)", ()),
    ("(t, v) integral [0, 1] [x < t/v] d(x)", ()),  # which has no value there itself
    ("(s, t) integral (x ~ normal(0, s)) [x < t] d(x)", ()),
    ("(r) integral [0, 1] [x^2 < r] d(x)", ()),  # has no derivative there
]


@pytest.mark.parametrize(("program", "divisors"), DIVIDED)
def test_what_a_formula_divides_by_is_said(program: str, divisors: tuple[str, ...]) -> None:
    library = Library()
    facts = derivative_facts(library.db, library.put("<text>", f"def f{program}\n"), "f")
    assert facts is not None and facts.divisors == divisors
    shown = Shown(f"def f{program}\n", "f")
    assert [note for note in shown.text.notes if "!=" in note] == [f"the formula holds for {d} != 0" for d in divisors]
    assert all(f"for       {d} != 0" in facts.text for d in divisors)
    assert all(rf"\text{{for }} {d} \ne 0" in str(derivative_latex(shown.text, "f")) for d in divisors)
