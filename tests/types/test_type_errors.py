"""Everything else that types have to say, with what it says."""

from __future__ import annotations

from marks import check, only


def test_names() -> None:
    check(r"""
        # file: lib.po
        soft = \y . 1/(1 + exp(-y))
        # file: main.po
        import lib
        radius = 2
        def f(x) raduis*x
        #        ^^^^^^ error[P0201]: `raduis` is not defined
        def g(x) lib.sotf(x)
        #            ^^^^ error[P0201]: the module `lib` defines no `sotf`
        def h(x) lip.soft(x)
        #        ^^^ error[P0201]: there is no module `lip` here
        k = \c . c.x
        #        ^ error[P0201]: `c` is not a module
        def l(x) lib + x
        #        ^^^ error[P0306]: `lib` is a module, not a value
        def m(x) print(x)
        #        ^^^^^ error[P0201]: `print` is a statement
        def n(x) radius.x
        #        ^^^^^^ error[P0201]: `radius` is a definition, not a module
    """)


def test_near_names_and_the_blanks_around_a_dot() -> None:
    assert only("radius = 2\ndef f(x) raduis*x").help == "did you mean `radius`?"
    assert "after an arrow" in only("def f(c: Real): Real\n    c").help
    assert "`c . x`" in only(r"k = \c . c.x").help
    camera = "record Camera(focal: Real)\n"
    assert only(camera + r"k = \c . c.focal").help == r"say what it is: `\(c: Camera) . …`"
    assert only("def f(u) u.x").help == "say what it is: `u: (Real, Real)`"
    assert only("def f(u) u.z").help == "say what it is: `u: (Real, Real, Real)`"
    assert only("def f(u) exp(u.1)").help == "say in the head what it is: `(u: (Real, Real))`, or the name of a record"


def test_a_name_whose_import_fails_is_reported_there_only() -> None:
    check("""
        from nowhere import a
        import nothing
        def f(x) a(x) + nothing.b(x)
    """)


def test_applying_what_is_no_function() -> None:
    check("""
        def f(x) 2 x
        #        ^ error[P0307]: this is a number
        def g(t) integral [0, 1] exp(x) [x < t] d(x)
        #                        ^^^^^^ error[P0307]: this is a number
        def h(x) (x, x)(1)
        #        ^^^^^^ error[P0307]: this is a tuple of 2
    """)
    assert only("def f(x) 2 x").help == "to multiply, write `*` between the two"


def test_numbers_of_arguments() -> None:
    check(r"""
        def f(a, b) a + b
        def g(x) f(x + 1)
        #          ^^^^^ error[P0309]: `f` needs the argument `b`
        def h(x) f(x, 1, 2, 3)
        #                ^ error[P0308]: `f` takes 2 arguments, but is given 4
        def i(x) sin(x, 1)
        #               ^ error[P0308]: `sin` takes 1 argument, but is given 2
        def j(x) atan2(x + 1)
        #              ^^^^^ error[P0309]: `atan2` needs 1 more argument
        def k(x) f()
        #        ^ error[P0309]: `f` needs the arguments `a` and `b`
        def l(x) max(x, 1, 2, 3) + min(x, 2)
    """)


def test_groups_are_filled_whole_and_in_order() -> None:
    check("""
        def g(a)(b, c) a*b*c
        h = g(1, 2, 3)
        i = g(1)(2, 3)
        j = g(c=3, 1, b=2)
        k = g(1, 2)
        #        ^ error[P0309]: `g` needs the argument `c`
        l = g(b=1, c=2)
        #          ^^^ error[P0309]: `g` needs the argument `a`
        m = g(1, 2, 3, 4)
        #              ^ error[P0308]: `g` takes 3 arguments
        n = (g(1))((2, 3))
    """)


def test_keywords() -> None:
    check(r"""
        def f(alpha, beta) alpha + beta
        def g(x) f(x, betta=2)
        #             ^^^^^ error[P0310]: `f` has no parameter `betta`
        def h(k, x) k(y=x)
        #             ^ error[P0310]: `k` has no parameters with names
        def i(x) sin(x=x)
        #            ^ error[P0310]: `sin` has no parameters with names
        def j(x) deriv(f)(dalpha=(x, 1), dbeta=2)
        def l(x) (\(u, v) . u*v)(v=x, 2)
        def m(x) f(x, 2, alpha=3)
        #             ^ error[P0308]: `f` takes 2 arguments, but is given 3
    """)
    assert only("def f(alpha, beta) alpha + beta\ndef g(x) f(x, betta=2)").help == "did you mean `beta`?"


def test_a_group_and_a_tuple() -> None:
    check(r"""
        def f(a, b) a + b
        def g(p) fst(p) + f(p)
        def h(x) g((x, 2)) + g(x, 2)
        def i(x) f((x, 1, 2))
        #          ^^^^^^^^^ error[P0309]: `f` needs the argument `b`
    """)


def test_conditions() -> None:
    check(r"""
        def f(p) if 2*p then 1 else 0
        #           ^^^ error[P0312]: but this is a number
        def g(p) if (p, 2*p) then 1 else 0
        #           ^^^^^^^^ error[P0312]: but this is a tuple of 2
        def h(p) if sin then p else 0
        #           ^^^ error[P0312]: but this is a function
        def i(p) [[p > 0] and p < 1]
        #         ^^^^^^^ error[P0312]: `and` needs a comparison
        def j(p) (let q = [p > 0] in if q then 1 else 0)
        def k(p) (let q = [0 < p < 1] in if q then 1 else 0)
        #                                   ^ error[P0312]: but this is a number
    """)


def test_comparisons_are_no_values() -> None:
    check("""
        def f(p) p > 0
        #        ^^^^^ error[P0324]: a function gives a number
        def g(p) sin(p > 0) + 3*(p > 1)
        #            ^^^^^ error[P0324]: an argument is a number
        #                       ^^^^^^^ error[P0324]: the right of `*` must be a number
        def h(p) (p, p > 0)
        #            ^^^^^ error[P0324]: a tuple holds numbers
        def i(p) if p > 0 then p > 1 else p > 2
        #                      ^^^^^ error[P0324]: a conditional chooses between numbers
        #                                 ^^^^^ error[P0324]: a conditional chooses between numbers
        def j(p) let q = p > 0 in if q and not q then [q] else 0
    """)


def test_functions_do_not_escape() -> None:
    check(r"""
        def f(g, x) let y = g(x) in if y > 0 then g else g
        #           ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ error[P0313]: a function cannot be the result
        def h(g, x) let _y = g(x) in g
        #           ^^^^^^^^^^^^^^^^^^ error[P0313]: a function cannot be the result
        def i(x, t) integral [0, 1] (if [s < t] then sin else cos)(s*x) d(s)
        #                                            ^^^ error[P0313]: a condition that may vary chooses between numbers
        #                                                     ^^^ error[P0313]: a condition that may vary chooses
        def j(t) integral [0, 1] (\y . x*y*t) d(x)
        #                        ^^^^^^^^^^^^ error[P0313]: the integrand must be a number
        def k(x) 2*sin
        #          ^^^ error[P0313]: the right of `*` must be a number
        curried = \x . \y . x*y
        def partial(x) curried(x)
        other = sin
        def block(x)
            g = \y . x*y
            g
    """)


def test_tuples_have_no_arithmetic() -> None:
    check("""
        diffeo half(x, y; c) = (x + y + c, x - y)
        def f(p) (p, 1) + 2
        #               ^ error[P0315]: `+` has no meaning between a tuple of 2 and a number
        def g(x) 2*half(x, x, 1)
        #          ^^^^^^^^^^^^^ error[P0315]: but this is a diffeomorphism's result
        def h(x) fst(half(x, x, 1)) + (let (u, v) = half(x, x, 2) in u*v)
        def i(x) let (u, v) = (x, x, x) in u*v
        #                     ^^^^^^^^^ error[P0306]: 2 names are bound here, but this is a tuple of 3
    """)


def test_arrays() -> None:
    check("""
        items = [1, 2, 3]
        def f(t) integral [0, 1] [x*t, x] d(x)
        def g(x) [x, 1] + 1
        #               ^ error[P0315]: `+` has no meaning between an array of 2 and a number
        mixed = [1, (2, 3)]
        #           ^^^^^^ error[P0306]: all elements of an array must be of one type
        def h(t) integral [0, 1] items d(_x)
        def k(t) 2^items
        #          ^^^^^ error[P0314]: the right of `^` must be a number, but this is an array of 3
    """)


def test_branches_and_results() -> None:
    check("""
        def f(x) if x > 0 then x else (x, 1)
        #                             ^^^^^^ error[P0306]: both branches must be of one type
        def g(x) -> (Real, Real)
            x + 1
        #   ^^^^^ error[P0306]: the result of `g` must be `(Real, Real)`
        def h(x: (Real*, Real*)) x + 1
        #                          ^ error[P0315]: `+` has no meaning between a tuple of 2 and a number
        def i(x) sin((x, 1))
        #            ^^^^^^ error[P0306]: the argument of `sin` must be `Real`
        def j(k) k(k)
        #        ^ error[P0306]: a function cannot be applied to itself
    """)


def test_annotations() -> None:
    check("""
        def f(c: Real*) if c > 0 then 1 else 0
        #        ^^^^^ error[P0316]: declared to accept what varies
        def g(s: Real -> Real, c) integral [0, 1] s(x)*c d(x)
        #        ^^^^ error[P0316]: declared to take what does not vary
        def h(c: Real, s: (Real*, Real) -> Real) -> Real
            integral [0, 1] s(x, c) d(x)
        def i(d: Diffeo[2]) fst(d)
        def j(p: (Real*, Real)) fst(p)*snd(p)
    """)


def test_duals() -> None:
    check(r"""
        def f(c, s) integral [0, 1] s(x)*[x < c] d(x)
        df = deriv(f)
        a = df((1, 2), deriv(sin))
        b = df(1, deriv(sin))
        c = df(dc=(1, 2), ds=deriv(\x . x^2))
        d2 = df((1, 2), sin)
        #               ^^^ error[P0306]: `ds` of `df` must be
        e = df((1, 2, 3), deriv(sin))
        #      ^^^^^^^^^ error[P0306]: `dc` of `df` must be
        g = deriv(3)
        #         ^ error[P0307]: `deriv` takes a function, but this is a number
        h = deriv(sin(3))
        #         ^^^^^^ error[P0307]: `deriv` takes a function
        def j(x) deriv(j)(x, 1)
        #        ^^^^^^^^^^^^^^ error[P0306]: the result of `j`, as it is used in it, must be `Real`
        #              ^ error[P0317]: `j` always needs itself again
        def k(s, t) deriv(s)(t) + 1
        #                 ^ error[P0306]: the derivative of this function takes and gives pairs
        i = deriv(sin, cos)
        #   ^^^^^^^^^^^^^^^ error[P0308]: `deriv` takes one function
        def l(s, t) s(deriv(s))
        #                   ^ error[P0306]: the derivative of this function takes and gives pairs
        def m(s) s(\x . deriv(s))
        #                     ^ error[P0306]: the derivative of this function takes and gives pairs
    """)
    assert "deriv(" in only("def f(s) s(1)\na = deriv(f)(sin)").help


def test_integrals() -> None:
    check("""
        def f(t) integral ([0, x], [0, 1]) x*y*t d(x, y)
        #                      ^ error[P0318]: this bound depends on `x`
        def g(t) integral ([0, y], [0, 1]) x*y*t d(x, y)
        #                      ^ error[P0318]: this bound depends on `y`
        def h(t) integral (x ~ nrmal(0, 1), y ~ normal(0)) x*y*t d(x, y)
        #                      ^^^^^ error[P0322]: there is no measure `nrmal`
        #                                       ^^^^^^ error[P0322]: `normal` takes 2 parameters
        def i(t) integral (x ~ normal(0, t), y ~ uniform(x, t)) x*y d(x, y)
        def j(t) integral [(t, 1), 1] x d(x)
        #                  ^^^^^^ error[P0315]: a bound of an integral must be a number
    """)


def test_recursion() -> None:
    check("""
        def fact(n) if n > 0 then n*fact(n - 1) else 1
        def bad(n) n*bad(n - 1)
        #            ^^^ error[P0317]: `bad` always needs itself again
        def jump(n) if [n > 0] then jump(n - 1) else 1
        #                           ^^^^ error[P0317]: `jump` always needs itself again
        def first(n) second(n)
        #            ^^^^^^ error[P0317]: `first` always needs `second`
        def second(n) first(n)
        #             ^^^^^ error[P0317]: `second` always needs `first`
        value = value + 1
        #       ^^^^^ error[P0317]: `value` always needs itself again
    """)


def test_deltas() -> None:
    check(r"""
        spike = \y . delta(y - 1)
        lone = delta(3)
        #      ^^^^^^^^ error[P0320]: varies with no variable
        def f(t) integral [0, 1] delta(x - t)*t d(x)
        def g(t) integral [0, 1] delta(x - t)*delta(x - t) d(x)
        #                                     ^^^^^^^^^^^^ error[P0321]: the product of two deltas
        def h(t) integral [0, 1] delta(x - t)^2 d(x)
        #                        ^^^^^^^^^^^^ error[P0321]: the product of two deltas
        def i(t) integral [0, 1] sin(delta(x - t)) + t/delta(x - t) d(x)
        #                            ^^^^^^^^^^^^ error[P0321]: you cannot take its `sin`
        #                                              ^^^^^^^^^^^^ error[P0321]: you cannot divide by it
        def j(t) integral ([0, 1], [0, 1]) delta(x - t)*delta(y - t) d(x, y)
        print(spike(3))
        #     ^^^^^^^^ error[P0320]: a distribution, not a number
        k = delta
        #   ^^^^^ error[P0323]: `delta` is not a function that can be passed on
    """)


def test_scripts() -> None:
    check("""
        def f(t) integral [0, 1] [x < t] d(x)
        for c in [0.1, 0.2]: print(f(c), c)
        for c in 3: print(c)
        #        ^ error[P0306]: `for` goes through an array
        for c in [1, 2]: print(f(c, 1))
        #                           ^ error[P0308]: `f` takes 1 argument
        print(f(1) > 0)
        #     ^^^^^^^^ error[P0324]: what is shown
        f(2)
        f(g)
        # ^ error[P0201]: `g` is not defined
    """)


def test_lints() -> None:
    check("""
        def f(x)
            u = 2*x
        #   ^ warning[P0610]: `u` is not used
            _v = 3
            x + 1
        def g(t) integral ([0, 1], [0, 1]) x*t d(x, y)
        #                                           ^ warning[P0611]: `y` is not used
        def h(x) integral [0, x] x^2 d(x)
        #                              ^ warning[P0612]: `x` hides the parameter
        def i(t) integral [0, 1] t*[x < 0.5] d(x)
        edge = 0.5
        def k(t) integral [0, 1] t*[x < 2*edge] d(x)
        #                          ^^^^^^^^^^^^ hint[P0613]: no parameter moves this surface: `edge` is a constant
        def l(t) integral [0, 1] (let u = 2*x in t*[sin(u) < pi/4]) d(x)
        def j(x) if 1 < 2 then x else 0
        #           ^^^^^ warning[P0614]: this condition never changes
        area = integral ([0, 1], [0, 1]) [x^2 + y^2 < 1] d(x, y)
    """)


def test_what_is_wrong_gives_no_lints() -> None:
    check("""
        def f(x)
            total = 2*x
            totl + 1
        #   ^^^^ error[P0201]: `totl` is not defined
    """)


def test_a_tuple_that_is_too_large() -> None:
    lines = ["def f(x)", "    a0 = (x, x)"]
    lines += [f"    a{n} = (a{n - 1}, a{n - 1})" for n in range(1, 13)]
    assert only("\n".join([*lines, "    a12"])).code == "P0325"
