r"""THE rule, P0301: no variable of integration in a plain condition, on whatever way it comes there."""

from __future__ import annotations

from marks import FOLDER, check, database, diagnostics, only

from potto.diagnostics import Related


def places(related: tuple[Related, ...]) -> list[str]:
    return [place.message for place in related]


def test_directly() -> None:
    check("""
        def f(t)
            integral [0, 1] (if x < t then 1 else 0) d(x)
            #                   ^^^^^ error[P0301]: this condition depends on the variable of integration `x`
    """)


def test_the_message_says_where_and_what_to_do() -> None:
    found = only("""
        def f(t)
            integral [0, 1] (if x < t then 1 else 0) d(x)
    """)
    assert found.label == "varies inside the integral"
    assert places(found.related) == ["`x` is bound here"]
    assert found.help == (
        "state the jump as a diffeomorphic condition, `[x < t]`, so that its boundary term is counted"
    )


def test_only_the_part_that_varies_is_shown() -> None:
    check("""
        def f(t)
            integral [0, 1] (if t > 0 and not (x < t or t < 3) then 1 else 0) d(x)
            #                                  ^^^^^ error[P0301]: depends on the variable of integration `x`
    """)


def test_the_other_conditional() -> None:
    check("""
        def f(t)
            integral ([0, 1], [0, 1]) (x*y < t ? 1 : 0) d(x, y)
            #                          ^^^^^^^ error[P0301]: the variables of integration `x` and `y`
    """)


def test_through_local_names() -> None:
    found = only("""
        def f(t)
            integral [0, 1] (let u = 2*x; v = u + 1 in if v < t then 1 else 0) d(x)
    """)
    assert found.code == "P0301"
    assert places(found.related) == ["`x` is bound here", "`u` is defined here", "`v` is defined here"]
    assert "`[v < t]`" in found.help


def test_through_a_local_name_for_a_comparison() -> None:
    check("""
        def f(t)
            integral [0, 1] (let p = x < t in if p then [p] else 0) d(x)
            #                                    ^ error[P0301]: this condition depends
    """)


def test_through_destructuring() -> None:
    check("""
        def f(t)
            integral [0, 1] (let (a, b) = (x, t) in (if b > 0 then 1 else 0) + (if a > 0 then 1 else 0)) d(x)
            #                                                                      ^^^^^ error[P0301]: depends
    """)


def test_through_a_local_function_which_is_fine_elsewhere() -> None:
    found = only(r"""
        def f(t)
            g = \y . if y > 0 then 1 else 0
            integral [0, 1] g(x - t) + g(t) d(x)
    """)
    assert found.code == "P0301" and places(found.related) == ["`x` is bound here", "passed as `y` here"]


def test_in_a_lambda_that_captures_the_variable() -> None:
    check(r"""
        def f(t)
            integral [0, 1] (let g = \y . if x > y then 1 else 0 in g(t)) d(x)
            #                                ^^^^^ error[P0301]: depends on the variable of integration `x`
    """)


def test_through_another_definition() -> None:
    check("""
        def step(y) if y > 0 then 1 else 0
        def twice(z) 2*step(z)
        def f(t) integral [0, 1] twice(x - t) d(x)
        #                              ^^^^^ error[P0301]: `twice` decides a plain condition by its parameter `z`
        def fine(t) integral [0, 1] twice(t)*x d(x)
    """)


def test_the_way_through_other_definitions_is_shown() -> None:
    found = only("""
        def step(y) if y > 0 then 1 else 0
        def twice(z) 2*step(z)
        def f(t) integral [0, 1] twice(x - t) d(x)
    """)
    shown = [(place.owner, place.message) for place in found.related]
    assert shown == [
        (None, "`x` is bound here"),
        ("twice", "passed as `y` here"),
        ("step", "this plain condition decides by it"),
    ]


def test_across_modules() -> None:
    text = """
        # file: lib.po
        def step(y) if y > 0 then 1 else 0
        # file: middle.po
        from lib import step as jump
        def twice(z) 2*jump(z)
        # file: main.po
        import lib
        from middle import twice
        def f(t)
            integral [0, 1] lib.step(x) + twice(x - t) d(x)
            #                        ^ error[P0301]: `step` decides a plain condition by its parameter `y`
            #                                   ^^^^^ error[P0301]: `twice` decides
    """
    check(text)
    found = diagnostics(database(text))[1][1]
    assert [(place.file, place.owner) for place in found.related] == [
        (None, None),
        (FOLDER + "middle.po", "twice"),
        (FOLDER + "lib.po", "step"),
    ]


def test_a_function_with_a_plain_parameter_passed_to_one_that_integrates() -> None:
    found = only("""
        def render(c, shader) integral ([0, 1], [0, 1]) shader(x, y, c) d(x, y)
        def toon(x, y, c) if x > 0 then c else y
        def scene(c) render(c, toon)
    """)
    assert found.code == "P0301" and "the variable of integration `x` of `render`" in found.message
    assert [(place.owner, place.message) for place in found.related] == [
        ("render", "`x` is bound here"),
        ("toon", "this plain condition decides by it"),
    ]


def test_a_lambda_passed_to_one_that_integrates() -> None:
    check(r"""
        def render(c, shader) integral [0, 1] shader(x, c) d(x)
        def scene(c) render(c, \(u, v) . if u > v then 1 else 0)
        #                                   ^^^^^ error[P0301]: the variable of integration `x` of `render`
        def fine(c) render(c, \(u, v) . if v > 0 then u else 0)
    """)


def test_a_function_passed_on_and_on() -> None:
    check("""
        def apply(g, y) g(y)
        def again(h, z) apply(h, z)
        def step(y) if y > 0 then 1 else 0
        def f(t) integral [0, 1] again(step, x - t) d(x)
        #                              ^^^^ error[P0301]: `step` decides a plain condition by its parameter `y`
        def fine(t) again(step, t)
    """)


def test_what_an_unknown_function_gives_varies_with_what_it_is_given() -> None:
    check("""
        def f(g, t) integral [0, 1] (if g(x) > t then 1 else 0) d(x)
        #                               ^^^^^^^^ error[P0301]: depends on the variable of integration `x`
    """)


def test_each_call_of_a_parameter_is_judged_by_itself() -> None:
    check(r"""
        def f(g, t) if g(t) > 0 then integral [0, 1] g(x) d(x) else 0
        def fine(t) f(\y . y*y, t)
    """)


def test_partial_application() -> None:
    check(r"""
        step = \a . \b . if a > b then 1 else 0
        def f(t)
            integral [0, 1] (let s = step(x) in s(t)) d(x)
            #                             ^ error[P0301]: `step` decides a plain condition by its parameter `a`
        def g(t)
            s = step(t)
            integral [0, 1] s(x) d(x)
            #                 ^ error[P0301]: `step` decides a plain condition by its parameter `b`
    """)


def test_functions_that_take_functions() -> None:
    check(r"""
        def outer(h) h(\y . if y > 0 then 1 else 0)
        def fine(t) outer(\g . g(t))
        def f(t) outer(\g . integral [0, 1] g(z)*t d(z))
        #        ^^^^^ error[P0301]: which depends on the variable of integration `z`
    """)


def test_a_captured_variable_reaches_a_condition_through_a_parameter() -> None:
    check(r"""
        def decide(g, t) if g(t) > 0 then 1 else 0
        def f(t) integral [0, 1] decide(\y . y*x, t) d(x)
        #                               ^^^^^^^^ error[P0301]: `decide` decides a plain condition
    """)


def test_a_sum_a_builtin_and_an_equality() -> None:
    check("""
        def f(t)
            integral [0, 3] floor(x)*t d(x)
            #                     ^ error[P0302]: `floor` jumps
        def g(t)
            integral [0, 3] (sum i in 1..x (i*t)) d(x)
            #                            ^ error[P0303]: this bound of a sum
        def c(t)
            integral (x ~ uniform(0, 1), k ~ poisson(x)) [k < t] d(x, k)
            #                                        ^ error[P0303]: how far this measure counts
        def h(t)
            integral [0, 3] [x == t]*x d(x)
            #               ^^^^^^^^ error[P0304]: measure zero
        def fine(t)
            integral [0, 3] floor(t)*x*(sum i in 1..t (i))*[t == 2] d(x)
    """)


def test_the_same_through_other_definitions() -> None:
    check("""
        def down(y) floor(y)
        def upto(n) sum i in 1..n (i)
        def same(a, b) [a == b]
        def f(t) integral [0, 3] down(x) + upto(x) + same(x, t) d(x)
        #                             ^ error[P0302]: `down` applies a builtin that jumps to its parameter `y`
        #                                       ^ error[P0303]: `upto` bounds a sum by its parameter `n`
        #                                                 ^ error[P0304]: `same` tests the equality
    """)


def test_a_builtin_passed_on() -> None:
    check("""
        def mean(g) integral [0, 3] g(x) d(x)
        a = mean(sin)
        b = mean(floor)
        #        ^^^^^ error[P0302]: `floor` jumps
    """)


def test_annotated_parameters() -> None:
    check("""
        def g(x: Real) x^2
        def h(x: Real*) x^2
        def f(t) integral [0, 1] (g(x) + h(x))*t d(x)
        #                           ^ error[P0305]: `g` declares its parameter `x` to be `Real`
    """)


def test_brackets_and_diffeomorphisms_may_vary() -> None:
    check(r"""
        diffeo half(x, y; c) = (x + y + c, x - y)
        step = \y . [y > 0]
        def f(c) integral ([0, 1], [0, 1]) (if half (x, y) c then [x < c] else step(y - c)) d(x, y)
        def g(c) integral [0, 1] (if diffeo(x - c) then 1 else 0)*(if [0 < x < c] then 2 else x) d(x)
        def h(c) integral [0, 1] (if [x < c] and c > 0 then 1 else 0) d(x)
    """)


def test_nested_integrals_may_depend_on_outer_variables() -> None:
    check("""
        def inner(a, b) integral [0, a] [u < b]*u d(u)
        def f(t) integral [0, 1] inner(x, t*x) d(x)
        def g(t) integral ([0, 1], [0, x]) x*y*t d(x, y)
    """)


def test_after_its_integral_a_variable_does_not_vary() -> None:
    check("""
        def f(t) if (integral [0, 1] x*t d(x)) > 0 then 1 else 0
        def g(t) integral [0, 1] (if (integral [0, x] y d(y)) > t then 1 else 0) d(x)
        #                            ^^^^^^^^^^^^^^^^^^^^^^^^^^^^ error[P0301]: the variable of integration `x`
    """)


def test_a_derivative_decides_by_values_only() -> None:
    check(r"""
        step = \y . if y > 0 then y else 0
        dstep = deriv(step)
        def f(t) integral [0, 1] fst(dstep((t, x))) d(x)
        def g(t) integral [0, 1] fst(dstep((x, t))) d(x)
        #                                  ^^^^^^ error[P0301]: `dstep` decides a plain condition
    """)


def test_the_derivative_of_a_parameter() -> None:
    check(r"""
        def slope(g, t) snd(deriv(g)((t, 1)))
        def f(t) integral [0, 1] slope(\y . if y > 0 then y else 0, x*t) d(x)
        #                                      ^^^^^ error[P0301]: the variable of integration `x`
        def fine(t) integral [0, 1] slope(\y . y*y, x*t) d(x)
    """)


def test_recursion_passes_the_demand_on() -> None:
    check("""
        def power(x, n) if n > 0 then x*power(x, n - 1) else 1
        def f(t) integral [0, 1] power(x, 3)*t d(x)
        def g(t) integral [0, 1] power(t, x) d(x)
        #                                 ^ error[P0301]: `power` decides a plain condition by its parameter `n`
    """)


def test_mutual_recursion() -> None:
    check("""
        def even(n, y) if n > 0 then odd(n - 1, y) else y
        def odd(n, y) if n > 0 then even(n - 1, y) else 0
        def f(t) integral [0, 1] even(4, x)*t + odd(x, t) d(x)
        #                                           ^ error[P0301]: `odd` decides a plain condition
    """)


def test_a_list_of_functions_in_a_script() -> None:
    check("""
        def mean(g) integral [0, 1] g(x) d(x)
        def step(y) if y > 0 then 1 else 0
        for g in [sin, step]: print(mean(g))
        #                                ^ error[P0301]: `step` decides a plain condition
    """)


def test_one_mistake_gives_one_message() -> None:
    check("""
        def f(t)
            integral [0, 1] (if x < t and x < 2*undefined then 1 else 0) d(x)
            #                   ^^^^^ error[P0301]: this condition depends
            #                             ^^^^^^^^^^^^^^^ error[P0301]: this condition depends
            #                                   ^^^^^^^^^ error[P0201]: `undefined` is not defined
        def g(t)
            y = f(t) + nothing(t)
            #          ^^^^^^^ error[P0201]: `nothing` is not defined
            z = y*2
            (if z > 0 then z else 1)(y)
        #   ^^^^^^^^^^^^^^^^^^^^^^^^ error[P0307]: this is a number
    """)
