"""The derivative in symbols: what `potto deriv` says."""

from __future__ import annotations

import textwrap

import pytest

from potto.calculus.explanation import readable, readable_parts
from potto.calculus.explanation.explain import DerivativeText, describe, explain_derivative
from potto.calculus.explanation.notation import Notation
from potto.checking.library import Library
from potto.core.terms import Global, Term
from potto.elaborate import core
from potto.query import Database

FILE = "<text>"


def explain(text: str, name: str) -> DerivativeText:
    db = Database()
    db.set_input(("overlay", FILE), textwrap.dedent(text).strip("\n") + "\n")
    return explain_derivative(db, FILE, name)


RENDERER = """
    diffeo cond(x, y; c) = (x + y + c, x - y + c)

    def renderer(c, shader)
        integral ([0, 1], [0, 1]) ((shader (x, y)) c)*(((cond (x, y)) c) ? 1 : 0) d(x, y)
"""


def test_equation_two_of_the_paper() -> None:
    found = explain(RENDERER, "renderer")
    (item,) = found.integrals
    assert item.interior == "snd(dshader((x, 0), (y, 0))((c, dc)))*[x + y + c >= 0]"
    assert item.deltas == ("shader(x, y)(c)*dc*delta(x + y + c)",)
    assert found.alone and "# interior" in found.text and "# boundary" in found.text


def test_the_delta_integrated_out() -> None:
    (item,) = explain(RENDERER, "renderer").integrals
    (boundary,) = item.boundary
    assert boundary.startswith("dc*(integral [0, 1] shader(x, -c - x)(c)*[")


def test_surfaces_say_what_moves_them_and_where_they_are() -> None:
    (surface,) = explain(RENDERER, "renderer").integrals[0].surfaces
    assert surface.equation == "x + y + c = 0"
    assert surface.moved_by == ("c",)
    assert surface.roots == ("y = -x - c",)


def test_a_surface_that_nothing_moves() -> None:
    found = explain("def f(t)\n    integral [0, 1] (t*[x < 0.5]) d(x)", "f")
    (surface,) = found.integrals[0].surfaces
    assert surface.moved_by == ()
    assert found.integrals[0].deltas == () and "moved by no parameter" in found.text


def test_a_moving_bound() -> None:
    found = explain("def f(t)\n    integral [0, t^2] exp(x) d(x)", "f")
    assert found.integrals[0].bounds == ("2*t*exp(t^2)*dt",)
    assert "# moving bound" in found.text


def test_a_function_that_jumps_is_a_distribution() -> None:
    found = explain("def step(y)\n    [y > 0]", "step")
    assert found.tangent == "dy*delta(y)"
    assert "Dist" in found.type


def test_what_is_around_an_integral() -> None:
    text = """
        def f(t)
            integral [0, 1] [x < t] d(x)

        def loss(t, a)
            (f(t) - a)^2
    """
    found = explain(text, "loss")
    assert found.tangent == "2*(f(t) - a)*(snd(deriv(f)((t, dt))) - da)"
    assert found.integrals == ()


def test_a_boundary_found_by_numbers_says_so() -> None:
    found = explain("def f(t)\n    integral [0, 1] [x*exp(x) < t] d(x)", "f")
    (item,) = found.integrals
    assert item.deltas == ("dt*delta(t - x*exp(x))",)
    assert "`x` itself" in item.reason and "found by numbers" in found.text


def test_a_recursion_is_not_followed() -> None:
    found = explain("def fact(n)\n    if n > 0 then n*fact(n - 1) else 1", "fact")
    assert "deriv(fact)" in found.tangent


def test_a_derivative_is_explained_by_what_it_is_one_of() -> None:
    text = """
        def f(t)
            integral [0, 1] [x < t] d(x)

        df = deriv(f)
        again = df
        dg = deriv(\\x . 1/x)
    """
    for name in ("df", "again"):
        found = explain(text, name)
        assert (found.name, found.by) == ("f", name)
        assert found.integrals[0].deltas == ("dt*delta(t - x)",)
        assert f"`{name}` is the derivative of `f`" in found.text
    assert explain(text, "dg").tangent == "-dx/x^2"


def test_a_function_that_lacks_some_arguments_still_has_parameters() -> None:
    text = """
        def k(a)(b)
            a*[b > a]

        half = k(0.5)
        same = half
    """
    assert explain(text, "half").tangent == "db/2*delta(b - 0.5)"
    assert explain(text, "same").tangent == "db/2*delta(b - 0.5)"


def test_a_jump_in_a_call_counts_once() -> None:
    text = """
        def step(y)
            [y > 0]

        def twice(y)
            step(2*y)
    """
    assert explain(text, "twice").tangent == "2*dy*delta(2*y)"


def test_each_surface_of_a_sum_has_its_own_index() -> None:
    """The delta stands inside of the sum over the surfaces: outside of it `k` means nothing."""
    text = """
        def stairs(t)
            integral [0, 1] (sum k in 1..3 ([x > t*k])) d(x)
    """
    ((item,),) = [explain(text, "stairs").integrals]
    (boundary,) = item.deltas
    assert boundary.startswith("-dt*(sum k") and boundary.endswith("))")
    inside = boundary.removeprefix("-dt*")
    assert "delta(" in inside and inside.count("(") == inside.count(")")


def test_a_long_formula_gives_way_while_it_is_written() -> None:
    """An edit does not wait until it is simplified."""

    class Enough(Exception):
        pass

    def pause() -> None:
        raise Enough

    db = Database()
    db.set_input(("overlay", FILE), "def f(c) exp(c + c^2 + c^7)\n")
    term = core(db, FILE, "f").term

    def resolve(target: Global) -> Term:
        return core(db, target.module, target.name).term

    with pytest.raises(Enough):
        describe(term, "f", "", resolve, Notation(), pause)
    assert describe(term, "f", "", resolve, Notation()).tangent == "(2*c + 7*c^6 + 1)*exp(c + c^2 + c^7)*dc"


def forget_parts() -> None:
    for kept in (readable_parts._KNOWN, readable_parts._FACTORS, readable_parts._PRODUCTS, readable_parts._WRITTEN):
        kept.found = {}


def test_a_formula_is_the_same_whatever_was_written_before() -> None:
    """What is kept of its parts tells a parameter from a variable of integration, and both from a whole number."""
    body = "cos(pi*k + x)*abs(x)^3*sqrt(x^2*(1 + k^2) + a*x^2)*a"
    texts = [
        f"def f(a, x, k) {body}",
        f"def f(a, k) integral [-1, 1] {body} d(x)",
        f"def f(a, x) sum k in 1..7 ({body})",
    ]
    alone = []
    for text in texts:
        forget_parts()
        alone.append(explain(text, "f").text)
    assert len(set(alone)) == len(texts)
    for order in (texts, texts[::-1]):
        forget_parts()
        together = {text: explain(text, "f").text for text in order}
        assert [together[text] for text in texts] == alone


def test_after_a_key_the_parts_of_a_formula_are_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten summands, and one of them is edited."""
    tried: list[Term] = []
    shortest = readable._Work._shortest
    monkeypatch.setattr(readable._Work, "_shortest", lambda self, node: tried.append(node) or shortest(self, node))
    forget_parts()
    text = "def f(a, b) " + " + ".join(f"sin(a*{n}.5)*exp(b^{n})" for n in range(2, 12))
    explain(text, "f")
    cold = len(tried)
    explain(text.replace("a*7.5", "a*7.25"), "f")
    assert cold > 50 and len(tried) - cold < 0.4 * cold


def test_a_recursion_in_an_integral_that_has_no_end_is_told() -> None:
    """How deep it goes is a matter of values, and each step of it derives the next one under the integral."""
    library = Library()
    text = """
def over(y, a) [y > a]
def often(n, y, a) if n > 0 then often(n - 1, y, a) + n*snd(deriv(over)((y, 0), (a, 1))) else 0
def f(n, a) integral [0, 1] often(n, x, a) d(x)
"""
    found = explain_derivative(library.db, library.put("<text>", text), "f")
    assert not found.tangent and "as deep as its arguments say" in found.problems[0]


def test_roots_are_named_where_they_exist() -> None:
    """No `nan`, no marks of copies, and no condition that always holds."""
    found = explain("def f(r, d) integral (a ~ uniform(0, pi/2)) [abs(a - d) < r]*[cos(a) < d] d(a)", "f")
    (item,) = found.integrals
    roots = [root for surface in item.surfaces for root in surface.roots]
    periodic = ["a = acos(d) + 2*pi*k for integers k", "a = 2*pi*k - acos(d) for integers k"]
    assert roots == ["a = d - r", "a = r + d", *periodic]
    assert found.conditions == ()


def test_the_tangent_of_a_field_is_typeset_as_one() -> None:
    found = explain("record S(at: Real)\ndef f(s: S) integral [0, 1] [x < s.at] d(x)", "f")
    assert "∂s.at" in found.unicode(found.integrals[0].deltas[0])


def test_conditions_that_always_hold_are_not_told() -> None:
    assert explain("def f(p) integral (k ~ binomial(10, p)) k d(k)", "f").conditions == ("0 < p and p < 1",)
