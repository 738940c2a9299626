"""Hover: what the calculus knows, where the cursor is."""

from __future__ import annotations

import pytest
from ide_fixture import fixture

import potto.ide as ide

PAPER = """
    # file: half_plane.diffeo
    # a diffeomorphism of (x, y), with the parameter c
    cond = \\(x, y) . \\c . (x + y + c, x - y + c)
    # file: renderer.po
    from half_plane import cond
    # Integrates a shader over the half plane.
    def renderer(c, shader)
        integral ([0,1], [0,1])
            ((shader (x,y)) c)
            *(((cond (x, y)) c)?1:0) d(x,y)
    drenderer = deriv(renderer)
    # file: main.po
    from renderer import drenderer
    import half_plane as planes
    shade = deriv(\\(x,y) . c. 1)
    print(drenderer(dc=(-2,1), $0shade))
    """


def test_function_shows_its_types_its_comment_and_both_terms():
    f = fixture(PAPER.replace("$0", "").replace("def renderer", "def $0renderer"))
    text = f.hover()
    assert "renderer : (c: Real, shader: (Real*, Real*) -> Real -> Real) -> Real" in text
    assert "drenderer : (dc: (Real, Real), " in text
    assert "Integrates a shader over the half plane." in text
    assert "interior    ∫₀¹∫₀¹ snd(∂shader((x, 0), (y, 0))((c, ∂c)))·[x + y + c ≥ 0] dx dy" in text
    assert "boundary    ∫₀¹∫₀¹ shader(x, y)(c)·∂c·δ(x + y + c) dx dy" in text
    assert "- `x + y + c = 0` moved by `c`; at `y = -x - c`" in text


def test_diffeomorphism_shows_inverse_and_determinant():
    f = fixture(PAPER.replace("import cond", "import co$0nd").replace("$0shade", "shade"))
    text = f.hover()
    assert "(x: Real*, y: Real*) -> (c: Real*) -> Diffeo[2]" in text
    assert "- inverse: `(u, v) . ((u - 2*c + v)/2, (u - v)/2)`" in text  # by hand: u+v = 2x+2c, u-v = 2y
    assert "- determinant: `-2`" in text
    assert "half_plane.diffeo" in text


def test_import_shows_the_interface_of_the_module():
    f = fixture(PAPER)
    text = f.hover("half_plane")
    assert "cond : (x: Real*, y: Real*) -> (c: Real*) -> Diffeo[2]" in text
    assert "a diffeomorphism of" not in text  # that is about `cond`
    assert f.hover("planes") == text


def test_keyword_of_a_derivative_shows_the_dual_of_the_parameter():
    text = fixture(PAPER).hover("dc=")
    assert text.startswith("```potto\ndc : (Real, Real)\n")
    assert "parameter of `renderer`" in text and "moves the surface `x + y + c = 0`" in text


@pytest.mark.parametrize("needle", ["[x^2", "x^2 + y^2 <", "]) d("])
def test_condition_shows_what_completes_it(needle):
    f = fixture("def quarter(r)\n    integral ([0, 1], [0, 1]) ([x^2 + y^2 < r^2]) d(x, y)\n")
    by = {"[x^2": 0, "x^2 + y^2 <": 5, "]) d(": 1}[needle]
    text = f.hover(needle, by)
    assert "```potto\ndiffeo(r^2 - (x^2 + y^2), x)\n```" in text
    assert "completed by `x`" in text and "moved by `r`" in text
    assert "- determinant: `2*y`" in text  # of (r² - x² - y², x) over (x, y): |-2x -2y; 1 0| = 2y
    assert "- surface: `y = -sqrt(r^2 - x^2)`" in text


def test_condition_without_a_diffeomorphism_says_why():
    f = fixture("def f(t)\n    integral ([0, 1], [0, 1]) [x^5 + x*y^3 + sin(x*y) + y^5 < t] d(x, y)\n")
    text = f.hover(" < t", 1)
    assert (
        text.startswith("**not a diffeomorphism** over `x, y`: where ") and "the surface is found numerically" in text
    )
    f = fixture("def f(t)\n    integral [0, 1] [0.3*[x < t] + x^3 - x $0< t] d(x)\n")
    assert f.hover().startswith("**not a diffeomorphism** over `x`: where ")


def test_variable_of_integration_shows_its_domain_and_what_varies_with_it():
    f = fixture(
        """
        def f(a, t)
            integral [a, 2*a] (let s = $0x*a in [s < t]*s) d(x)
        """
    )
    text = f.hover()
    assert "x : Real[x]" in text and "variable of integration of `f`" in text
    assert "from `a` to `2*a`" in text
    assert "varies with it: `s`" in text
    assert "moved by `a`, `t`" in text


def test_measures_made_of_measures_and_those_inside():
    f = fixture("def f(m)\n    integral (x ~ truncated(gamma(m, 2), 0, 3)) gamma(x)*x d(x)\n")
    assert "`x ~ truncated(gamma(m, 2), 0, 3)`" in f.hover("x d(x)")
    assert "x ~ truncated(measure, lo, hi)" in f.hover("truncated")
    assert "- mean: `a/r`" in f.hover("gamma(m")
    assert "gamma : (x: Real*) -> Real" in f.hover("gamma(x)") and "digamma(x)" in f.hover("gamma(x)")


def test_variable_of_a_measure_shows_the_measure():
    f = fixture("def f(m)\n    integral (x ~ normal(m, 2)) x^2 d(x)\n")
    assert "`x ~ normal(m, 2)`" in f.hover("x^2")
    text = f.hover("normal")
    assert "x ~ normal(m, s)" in text and "- mean: `m`" in text and "- variance: `s^2`" in text


def test_local_name_and_sum_and_loop():
    f = fixture(
        """
        def f(a)
            b = a*2
            b + sum i in 1..3 (i*b)
        for v in [1, 2]:
            print(f(v))
        """
    )
    assert "is `a*2`" in f.hover("b +") and "b : Real\n" in f.hover("b +")
    assert "from `1` to `3`" in f.hover("i*b")
    assert "v : Real" in f.hover("v))") and "in `[1, 2]`" in f.hover("v))")


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("sqrt", ("sqrt : (x: Real*) -> Real", "d sqrt(x) = ")),
        ("sin", ("d sin(x) = cos(x)*dx",)),
        ("max", ("bends where", "…")),
        ("floor", ("(x: Real) -> Real", "it jumps")),
        ("deriv", ("duals",)),
        ("pi", ("Real",)),
    ],
)
def test_builtin_shows_its_rule(name, parts):
    f = fixture(f"y = {name}\n")
    text = f.hover(name)
    for part in parts:
        assert part in text


def test_keywords_and_types_are_explained():
    f = fixture("def f(a: Real*) -> Real\n    integral [0, a] [x < 0.5] d(x)\n")
    assert "surfaces" in f.hover("integral") and "moving bound" in f.hover("integral")
    assert "accepts one that does" in f.hover("Real*")
    assert "Defines a function" in f.hover("def")


def test_plain_parameter_says_so():
    f = fixture("def f(a, b) if a > 0 then b else 1\n")
    assert "must not vary: `a`" in f.hover("f(")
    assert "must not vary" in f.hover("a,") and "must not vary" not in f.hover("b)")


def test_shadowing_finds_the_inner_name():
    f = fixture("x = 3\ndef f(x) (let x = x + 1 in $0x*2) + x\n")
    assert "is `x + 1`" in f.hover()
    assert "parameter of `f`" in f.hover("x)", 0)
    assert f.hover("x = 3").startswith("```potto\nx : Real")


def test_re_exported_and_unicode_names():
    f = fixture(
        """
        # file: a.po
        # The angle.
        def θ(α) α/2
        # file: b.po
        from a import θ as θ_half
        # file: main.po
        from b import θ_half
        y = θ_ha$0lf(1)
        """
    )
    assert "The angle." in f.hover() and "α: Real" in f.hover() and "a.po" in f.hover()


def test_broken_text_keeps_what_can_be_read():
    f = fixture("def g(a, b) a*b\ndef f(a)\n    integral [0, 1] $0g(a, x + ) d(x\n")
    assert "g : (a: Real*, b: Real*) -> Real" in f.hover()
    assert f.hover("a, x") != ""


def test_a_comment_has_no_hover_but_a_live_expression_has():
    f = fixture("def f(x) x\n\n# f and integral\n#> f(2)\n")
    assert f.hover("f and") == "" and f.hover("integral") == ""
    assert "f : " in f.hover("f(2)")


def test_hover_is_one_word():
    f = fixture("def f(x) x + 1\n")
    found = ide.hover_at(f.db, f.file, f.find("x +"))
    assert found is not None and f.at(found.span) == "x"


def test_a_derivative_shows_what_it_is_the_derivative_of():
    text = "def f(t) integral [0, 1] [x < t] d(x)\nd$0f = deriv(f)\n"
    shown = fixture(text).hover()
    assert "the derivative of `f`" in shown and "boundary    ∫₀¹ ∂t·δ(t − x) dx" in shown


def test_a_function_without_integrals_lists_its_surfaces():
    shown = fixture("def $0disc(x, y, r) [x^2 + y^2 < r^2]\n").hover()
    assert "**surfaces**" in shown and "moved by `x`, `y`, `r`" in shown


def test_surfaces_are_written_alike_everywhere():
    f = fixture("def f(t) integral [0, 1] [x < t]*[2*x < 2*t] d(x)\n")
    assert "`x = t` moved by `t`" in f.hover("f(t)")
    assert f.hover("t)").count("moves the surface `x = t`") == 1
    assert f.hover("x <").count("surface `x = t`, moved by `t`") == 1


def test_a_parameter_shows_what_it_accepts():
    f = fixture("def f(a, n) if n > 0 then a else 1\n")
    assert "a : Real*" in f.hover("a, n") and "n : Real\n" in f.hover("n)")


def test_names_in_live_expressions_and_statements_have_types():
    f = fixture(
        """
        #> integral (x ~ uniform(1, 4)) x^2 d(x)
        #> (\\y . exp(y))(1)
        for v in [1, 2]:
            print((\\z . z*v)(2))
        """
    )
    assert "x : Real[x]" in f.hover("x^2") and "distributed as `x ~ uniform(1, 4)`" in f.hover("x^2")
    assert "y : Real" in f.hover("y . exp")
    assert "z : Real" in f.hover("z*v") and "v : Real" in f.hover("v)")


def test_a_variable_of_integration_says_whose_bounds_vary_with_it():
    f = fixture("def area(t)\n    integral ([0, t], [0, x]) x + y d(x, y)\n")
    assert "from `0` to `t`" in f.hover("x + y") and "varies with it: the bounds of `y`" in f.hover("x + y")
    assert "varies with it" not in f.hover("y d(x")


def test_a_condition_without_an_inverse_in_closed_form_says_so():
    shown = fixture("def f(t)\n    integral ([0, 1], [0, 1]) $0[sin(x*y) > t] d(x, y)\n").hover()
    assert "inverse: none in closed form; the surface is found numerically" in shown
    singular = "(if $0diffeo(x + y + t, 2*x + 2*y) then 1 else 0)"
    shown = fixture(f"def f(t)\n    integral ([0, 1], [0, 1]) {singular} d(x, y)\n").hover()
    assert "not a diffeomorphism" in shown and "determinant is 0" in shown


def test_plain_condition_says_what_decides_it():
    f = fixture("def f(n, x) if n > 0 then x*f(n - 1, x) else 1\n")
    assert f.hover("> 0") == "**plain condition**, decided by `n`: no integral jumps with it"


def test_plain_condition_that_varies_shows_what_it_would_be_in_brackets():
    f = fixture("def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)\n")
    text = f.hover("< t")
    assert text.startswith("**plain condition**, but it varies inside the integral")
    assert text.endswith("In brackets it would be\n\n```potto\ndiffeo(t - x)\n```")
    f = fixture("def f(t)\n    integral [0, 1] (if x^5 + sin(x*t) + x^2 > 0.3 then 1 else 0) d(x)\n")
    text = f.hover("> 0.3")
    assert "In brackets it would be\n\n**no diffeomorphism**: no inverse was found for `x^5 + sin(x*t)" in text


def test_conditions_that_are_joined_are_not_called_plain():
    f = fixture("def f(t)\n    integral [0, 1] ([x < t] and [x > t/2] ? 1 : 0) d(x)\n")
    assert "plain" not in f.hover("and") and "both conditions hold" in f.hover("and")


def test_bracket_over_parameters_says_where_it_jumps():
    f = fixture("def step(y, k) [y > 2*k]*y\n")
    assert f.hover("> 2") == (
        "**jump** where `y = 2*k`, moved by `y`, `k`\n\n"
        "It is made a diffeomorphism where `step` is given something that varies."
    )


def test_what_has_an_error_says_which():
    text = fixture("def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)\n").hover("f(")
    assert "*This definition has an error:* this condition depends on the variable of integration `x`" in text
    text = fixture("diffeo bad(x, y; a) = (x + y, 2*x + 2*y)\n").hover("bad")
    assert "**no diffeomorphism**: (x + y, 2*x + 2*y) is not invertible in `x` and `y`: its determinant is 0" in text
    assert "coordinate 2 varies only together with coordinate 1" in text


def test_names_in_parentheses_are_bound_to_their_parts():
    f = fixture("def f(p, c)\n    (r, g) = (c, c^2)\n    (a, b) = p\n    r + g + a + b\n")
    assert "is `c^2`" in f.hover("g + a")
    assert "is part 2 of `p`" in f.hover("b\n")


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("abs", "d abs(x) = (if [x >= 0] then 1 else -1)*dx"),
        ("clamp", " + (if [lo <= x] then [hi <= x] else [hi <= lo])*dhi"),
        ("max", "d max(x, y) = [y <= x]*dx + [x < y]*dy"),
        ("sin", "d sin(x) = cos(x)*dx"),
    ],
)
def test_rules_read_as_they_are_meant(name, rule):
    assert rule in fixture(f"y = {name}\n").hover(name)


def test_why_a_boundary_has_no_closed_form_is_said_once():
    text = fixture("def f(t)\n    integral [0, 1] [x^5 + sin(x*t) + x^2 > 0.3] d(x)\n").hover("f(")
    assert text.count("which no single inverse undoes") == 1


def test_why_a_parameter_must_not_vary():
    assert "must not vary: its annotation says so" in fixture("def f(k: Real) k^2\n").hover("k:")
    assert "must not vary: it decides a plain condition" in fixture("def f(k) if k > 0 then 1 else 2\n").hover("k)")


def test_what_a_file_of_data_holds(tmp_path):
    from potto.checking.library import Library
    from potto.ide.hover.hovers import hover_at

    (tmp_path / "people.csv").write_text("height,weight\n1.5,60\n1.75,80\n")
    (tmp_path / "main.po").write_text('people = load("people.csv")\nmean = sum h in people.height (h)/2\n')
    library = Library([tmp_path])
    key = library.key(tmp_path / "main.po")
    said = hover_at(library.db, key, 2)
    assert said is not None
    assert "height [2] from 1.5 to 1.75" in said.markdown
    (tmp_path / "people.csv").write_text("height,weight\n1.5,60\n1.75,80\n2,90\n")
    assert library.refresh()
    said = hover_at(library.db, key, 2)
    assert said is not None
    assert "height [3] from 1.5 to 2" in said.markdown


@pytest.mark.parametrize("made", ["(1, 2)", "[1, 2, 3]", "integral [0, 1] [x < 0.3] d(x)"])
def test_what_nothing_moves_has_no_derivative(made: str) -> None:
    assert "deriv" not in (text := fixture(f"k = {made}\n").hover("k")) and "d k" not in text and "k : " in text
    assert "d k : " in fixture("k = (sin, cos)\n").hover("k")


def test_the_name_of_a_size_is_a_number():
    assert (
        "n : Real" in (text := fixture("def f(xs: [n] Real) sum x in xs (x)/n\n").hover("/n", 1))
        and "size of `f`" in text
    )
