"""Programs with arrays against closed forms and numpy by hand: values, derivatives, and what goes wrong at run time."""

from __future__ import annotations

import math

import numpy as np
import pytest

import potto

PROGRAM = """
def mean(xs: [n] Real) sum i in 0..n-1 (xs[i]) / n
def squares(xs) sum x in xs (x^2)
def differences(xs: [n] Real) [xs[i + 1] - xs[i] for i in 0..n-2]
def outer(u: [n] Real, v: [m] Real) [u[i]*v[j] for i in 0..n-1, j in 0..m-1]
def matrix(a: [n, m] Real, x: [m] Real) [sum j in 0..m-1 (a[i, j]*x[j]) for i in 0..n-1]
def product_of(xs: [n] Real) product x in xs (x)
def least(xs: [n] Real) min x in xs (x)
def greatest(xs: [n] Real) max i in 0..n-1 (xs[i])
def highest(n, t) max i in 1..n (t*(3 - i))
def lowest(n, t) min i in 1..n, j in i..n (t*(i + j))
def highest_under(n, t) integral [0, 1] max i in 1..n (i*[x < t]) d(x)
def highest_of(n, t) max i in 1..n (integral [0, 1] i*[x < t] d(x))
def noted(xs: [n] Real) max x in xs (3)
def halves(x0, n) fold x = x0 for i in 1..n (x/2 + 1)
def spring(k, n)
    (x, v) = fold (x, v) = (1, 0) for i in 1..n (let w = v - k*x*0.01 in (x + w*0.01, w))
    x
def pairs(ps: [n] (Real, Real)) sum p in ps (p.x*p.y)
def triangle(n) sum i in 0..n-1, j in 0..i (i*j)
def steps(ts: [n] Real) integral [0, 1] sum t in ts ([x < t]*x) d(x)
def powers(cs: [n] Real) integral [0, 1] sum i in 0..n-1 (cs[i]*x^i) d(x)
def squared(ts: [n] Real) integral [0, 1] (sum t in ts ([x < t]*x))^2 d(x)
def walk(n, m, s) integral (z ~ normal(m, s)) fold x = 0 for i in 1..n (x + z*i) d(z)
def moments(t) integral [0, t] [x, x^2, x^3] d(x)
def guarded(xs: [n] Real, i) integral [0, 1] (if i > 0 then xs[i - 1]*x else x) d(x)
def chosen(a, b, i) integral [0, 1] [a*x, b*x^2][i] d(x)
"""
M = potto.compile(PROGRAM)
XS = np.array([0.5, -1.25, 2.0, 0.75])


def test_sums_and_means() -> None:
    assert M.mean(XS).value == pytest.approx(XS.mean(), rel=1e-15)
    assert M.squares(XS).value == pytest.approx((XS**2).sum(), rel=1e-15)
    assert M.pairs(np.array([[1.0, 2.0], [3.0, 4.0]])).value == 14
    assert M.triangle(5).value == sum(i * j for i in range(5) for j in range(i + 1))


def test_arrays_of_numbers() -> None:
    assert M.differences(XS).value.tolist() == np.diff(XS).tolist()
    assert M.outer(XS, [1, 2]).value.tolist() == np.outer(XS, [1, 2]).tolist()
    a = np.arange(6.0).reshape(2, 3)
    assert M.matrix(a, [1, 0, 2]).value.tolist() == (a @ [1, 0, 2]).tolist()


def test_products_and_extremes() -> None:
    assert M.product_of(XS).value == pytest.approx(XS.prod(), rel=1e-15)
    assert (M.least(XS).value, M.greatest(XS).value) == (-1.25, 2.0)


@pytest.mark.parametrize("given", ["(xs, dxs)", "xs=(xs, dxs)", "dxs=(xs, dxs)"])
def test_derivatives_by_the_names_of_parameters(given: str) -> None:
    """The derivative of the sum of squares of 1, 2 and 6 along (1, 0, 2) is 2 + 24."""
    program = "def squares(xs: [n] Real) sum x in xs (x^2)\nxs = [1, 2, 6]\ndxs = [1, 0, 2]\n"
    found = potto.compile(program + f"slope = deriv(squares)({given})").slope
    assert (found.value, found.tangent) == (41, 26)


def test_folds() -> None:
    assert M.halves(0, 20).value == 2 - 2.0**-19
    x, v = 1.0, 0.0
    for _ in range(1000):
        v = v - 3 * x * 0.01
        x = x + v * 0.01
    assert M.spring(3, 1000).value == pytest.approx(x, abs=1e-12)  # 1,000 steps, each rounded a little


def test_the_derivative_of_a_fold() -> None:
    """Of x after n steps of x/2 + 1 by the first x: 2^-n."""
    assert potto.grad(M.halves, "x0")(0.3, 10).tangent == 2.0**-10


@pytest.mark.parametrize("count", [1, 3, 40])  # few parameters are differentiated by forward, many in reverse
def test_derivatives_by_elements(count: int) -> None:
    xs = np.random.default_rng(count).uniform(0.1, 0.9, count)
    assert potto.grad(M.mean)(xs).tangent == pytest.approx(np.full(count, 1 / count), rel=1e-15)
    assert potto.grad(M.squares)(xs).tangent == pytest.approx(2 * xs, rel=1e-15)
    assert potto.grad(M.steps)(xs).tangent == pytest.approx(xs, rel=1e-14)
    assert potto.grad(M.powers)(xs).tangent == pytest.approx(1 / (1 + np.arange(count)), rel=1e-13)
    pairs = np.random.default_rng(1).uniform(0, 1, (count, 2))
    assert potto.grad(M.pairs)(pairs).tangent == pytest.approx(pairs[:, ::-1], rel=1e-15)


def test_integrals_of_sums_over_arrays() -> None:
    assert M.steps([0.5, 0.25]).value == pytest.approx((0.25 + 0.0625) / 2, rel=1e-15)
    assert M.powers([1, 2, 3]).value == pytest.approx(3, rel=1e-15)
    # two jumps: (2x)^2 below 1/4, x^2 up to 1/2
    assert M.squared([0.5, 0.25]).value == pytest.approx(4 / 3 / 64 + (1 / 8 - 1 / 64) / 3, rel=1e-14)
    by_first = 0.5**2  # (1*x)^2 at x = 1/2
    assert potto.grad(M.squared)([0.5, 0.25]).tangent[0] == pytest.approx(by_first, rel=1e-13)
    assert potto.grad(M.squared)([0.5, 0.25]).tangent[1] == pytest.approx((4 - 1) * 0.25**2, rel=1e-13)


def test_folds_under_integrals() -> None:
    assert M.walk(3, 2, 1).value == pytest.approx(2 * 6, rel=1e-12)


def test_an_integral_of_an_array_is_an_array() -> None:
    assert M.moments(2).value == pytest.approx([2, 8 / 3, 4], rel=1e-14)
    assert potto.grad(M.moments)(2.0).tangent == pytest.approx([2, 4, 8], rel=1e-12)


def test_an_integral_has_the_shape_of_what_is_integrated() -> None:
    """Moments of [x < t] are t^(k + 1)/(k + 1): polynomials, exact but for roundings."""
    module = potto.compile(r"""
record Ray(start: (Real, Real), length: Real)
record Bundle(first: Ray, weights: [n] Real)
fixed = [1, 2]
def nested(t) integral [0, 1] ([x < t], (x*[x < t], 2)) d(x)
def listed(t) integral [0, 1] (x*[x < t], [[x < t], 3]) d(x)
def length(t) (integral [0, 1] Ray(start=([x < t], 1), length=x*[x < t]) d(x)).length
def rays(n, t) integral [0, 1] [Ray(start=(i, 1), length=i*[x < t]) for i in 1..n] d(x)
def bundle(t) integral [0, 1] Bundle(first=Ray(start=(1, t), length=[x < t]), weights=[x, t*x]) d(x)
def whole(t) integral [0, t] fixed d(x)
def drawn(t) integral (x ~ poisson(t)) ((x, x^2), [3*x]) d(x)
def whole_of(f: Real* -> [2] Real*) integral [0, 1] f(x) d(x)
def called(t) whole_of(\x . [x, t*x])
""")
    t = 0.5
    first, second = module.nested(t).value
    assert (first, *second) == pytest.approx((t, t**2 / 2, 2), rel=1e-14)
    value, listed = module.listed(t).value
    assert (value, listed.tolist()) == (pytest.approx(t**2 / 2, rel=1e-14), pytest.approx([t, 3], rel=1e-14))
    assert module.length(t).value == pytest.approx(t**2 / 2, rel=1e-14)
    assert potto.grad(module.length)(t).tangent == pytest.approx(t, rel=1e-14)
    assert [each[1] for each in potto.grad(module.rays, ["t"])(2, t).tangent] == pytest.approx([1, 2], rel=1e-14)
    first, weights = potto.grad(module.bundle)(t).tangent
    assert (first, weights.tolist()) == (((0, 1), 1), pytest.approx([0, 0.5], rel=1e-14))
    assert module.whole(3).value.tolist() == pytest.approx([3, 6], rel=1e-15)
    assert potto.grad(module.whole)(3).tangent.tolist() == pytest.approx([1, 2], rel=1e-14)
    assert module.called(3).value.tolist() == pytest.approx([0.5, 1.5], rel=1e-14)
    (mean, square), (third,) = module.drawn(2.0).value
    assert (mean, square, third) == pytest.approx((2, 6, 6), rel=1e-9)  # to where the sum over whole numbers is cut


@pytest.mark.parametrize("xs", [[1.0, 1.0], [1.0, 1.0, 2.0, 2.0]])
def test_gradients_at_ties_have_the_shape_of_the_array(xs: list[float]) -> None:
    """Each of the greatest is, to one side: either 0 or 1; those below are 0 to both."""
    found = potto.grad(M.greatest)(xs).tangent
    assert found.shape == (len(xs),)
    assert all(slope == 0 or (slope == 1 and x == max(xs)) for slope, x in zip(found, xs))


def test_gradients_of_lambdas_whose_parameters_have_types() -> None:
    module = potto.compile(r"""
record P(x: Real, y: Real)
of_record = grad(\(p: P) . p.x^2*p.y)
of_tuple = grad(\(p: (Real, [2] Real)) . p.0*p.1[0]*p.1[1])
""")
    assert tuple(module.of_record((3.0, 4.0)).value) == (24, 9)
    first, rest = module.of_tuple((3.0, [4.0, 5.0])).value
    assert (first, list(rest)) == (20, [15, 12])


def test_what_a_plain_condition_excludes_is_not_read() -> None:
    assert M.guarded([5, 7], 0).value == pytest.approx(0.5, rel=1e-15)
    assert M.guarded([5, 7], 1).value == pytest.approx(2.5, rel=1e-15)
    assert M.guarded([5, 7], np.array([0.0, 1.0, 2.0])).value == pytest.approx([0.5, 2.5, 3.5], rel=1e-15)


def test_an_element_that_varies() -> None:
    assert M.chosen(2, 3, 0).value == pytest.approx(1, rel=1e-15)
    assert M.chosen(2, 3, 1).value == pytest.approx(1, rel=1e-15)
    assert potto.grad(M.chosen, "b")(2.0, 3.0, 1.0).tangent == pytest.approx(1 / 3, rel=1e-14)


@pytest.mark.parametrize(
    ("call", "code", "says"),
    [
        (lambda: M.guarded([5, 7], 3), "P0511", "the index 2 is out of range: the array has 2 elements"),
        (lambda: M.guarded([5, 7], 1e300), "P0511", "the index 1e+300 is out of range: the array has 2 elements"),
        (lambda: M.guarded([5, 7], 0.5), "P0512", "the index -0.5 is not a whole number"),
        (lambda: M.highest(0, 1.0), "P0511", "this array or range is empty"),
        (lambda: M.lowest(-2, 1.0), "P0511", "this array or range is empty"),
        (lambda: M.highest_under(0, 0.5), "P0511", "this array or range is empty"),
        (lambda: M.highest_of(0, 0.5), "P0511", "this array or range is empty"),
        (lambda: M.noted([]), "P0511", "this array or range is empty"),
        (lambda: potto.deriv(M.highest)((0, 0), (1.0, 1)), "P0511", "this array or range is empty"),
        (lambda: M.chosen(1, 2, 2), "P0511", "the index 2 is out of range"),
        (lambda: M.matrix([[1, 2], [3, 4]], [1, 2, 3]), "P0509", "`x` has 2 elements, as `a` says, and is given 3"),
        (lambda: M.mean(3), "P0509", "an array is needed"),
        (lambda: M.mean(range(4)), "P0509", "an array is needed, not a Python range: `list(…)` makes one of it"),
        (lambda: M.mean((1, 2)), "P0509", "an array is needed, not a tuple of 2: `list(…)` makes one of it"),
        (lambda: M.pairs(np.zeros((2, 3))), "P0509", "`ps` holds tuples of 2, and is given rows of 3"),
    ],
)
def test_mistakes(call: object, code: str, says: str) -> None:
    with pytest.raises(potto.PottoError) as raised:
        call()  # type: ignore[operator]
    (diagnostic,) = raised.value.diagnostics
    assert diagnostic.code == code
    assert says in diagnostic.message


def test_every_index_at_every_bound() -> None:
    """Sections of an array between all pairs of places, empty ones included."""
    module = potto.compile("def f(xs: [n] Real, a, b) sum i in a..b (xs[i])")
    for a in range(len(XS) + 1):
        for b in range(a - 1, len(XS)):
            assert module.f(XS, a, b).value == pytest.approx(XS[a : b + 1].sum(), abs=1e-15)
    for wrong in (-1, len(XS)):
        with pytest.raises(potto.PottoError, match="out of range"):
            module.f(XS, wrong, wrong)


def test_bounds_that_differ_over_a_batch() -> None:
    module = potto.compile("def f(xs: [n] Real, b) fold s = 0 for i in 0..b (s/2 + xs[i])")
    ends = np.arange(-1.0, 4.0)
    expected = []
    for end in ends.astype(int):
        state = 0.0
        for i in range(end + 1):
            state = state / 2 + XS[i]
        expected.append(state)
    assert module.f(XS, ends).value.tolist() == expected


def test_vectors() -> None:
    module = potto.compile("""
def length_of(u: (Real, Real, Real)) norm(u)
def plane(n: (Real, Real, Real), p: (Real, Real, Real), q: (Real, Real, Real)) dot(n, q - 2*p)/norm(n)
def turned(u: (Real, Real, Real), v: (Real, Real, Real)) cross(u, v)
def mixed(xs: [n] Real, ys: [n] Real) dot(xs + 2*ys, -xs/2)
def turned_array(u: [3] Real, v: [3] Real) cross(u, v)
""")
    u, v, w = (1.0, 2.0, 2.0), (0.5, -1.0, 3.0), (2.0, 1.0, 1.0)
    assert module.length_of(u).value == 3
    assert module.plane(u, v, w).value == pytest.approx(np.dot(u, np.subtract(w, np.multiply(2, v))) / 3, rel=1e-15)
    assert module.turned(u, v).value == pytest.approx(tuple(np.cross(u, v)), rel=1e-15)
    assert module.turned_array(list(u), list(v)).value == pytest.approx(np.cross(u, v), rel=1e-15)
    xs, ys = np.array([1.0, 2.0]), np.array([-1.0, 0.5])
    assert module.mixed(xs, ys).value == pytest.approx(np.dot(xs + 2 * ys, -xs / 2), rel=1e-15)
    assert potto.grad(module.length_of)(u).tangent == pytest.approx(tuple(np.divide(u, 3)), rel=1e-15)


def test_duals_of_arrays_in_the_language() -> None:
    module = potto.compile(
        PROGRAM
        + """
slope = deriv(squares)(([1, 2, 3], [1, 0, 2]))
bent = deriv(differences)(([1, 2, 4], [1, 0, 2]))
still = deriv(powers)(dcs=([1, 2], [0, 1]))
"""
    )
    assert (module.slope.value, module.slope.tangent) == (14, 14)
    assert (module.bent.value.tolist(), module.bent.tangent.tolist()) == ([1, 2], [-1, 2])
    assert module.still.tangent == pytest.approx(0.5, rel=1e-15)


SIZED = """
def ones(m) [1 for i in 1..m]
def added(xs: [n] Real, m) xs + ones(m)
def dotted(xs: [n] Real, t, m) integral [0, 1] dot(xs, [t*x*i for i in 1..m]) d(x)
def paired(xs: [n] Real, ys: [n] Real) sum i in 0..n-1 (xs[i]*ys[i])
def given(xs: [n] Real, m) paired(xs, ones(m)) + paired([2*x for x in xs], xs)
def looked(xs: [n] Real, m) interp([i/m for i in 0..m-1], xs, 0.25)
"""


def test_sizes_that_types_leave_open_are_told_where_arrays_go_together() -> None:
    """Also where the second array is the longer one, whose rest nobody would read."""
    module, xs = potto.compile(SIZED), [1.0, 2.0, 6.0]
    assert module.added(xs, 3).value.tolist() == [2, 3, 7]
    assert module.dotted(xs, 2, 3) == pytest.approx(1 + 4 + 18, rel=1e-14)
    assert module.given(xs, 3) == 9 + 2 * 41
    assert module.looked(xs, 3) == pytest.approx(1.75, rel=1e-14)
    calls = {"added": (xs,), "dotted": (xs, 2), "given": (xs,), "looked": (xs,)}
    for name, arguments in calls.items():
        for other in (2, 4):
            with pytest.raises(potto.PottoError) as told:
                getattr(module, name)(*arguments, other)
            said = told.value.diagnostics[0]
            assert said.code == "P0513" and "3" in said.message and str(other) in said.message


def test_a_large_array_is_a_handful_of_passes() -> None:
    xs = np.random.default_rng(0).uniform(-1, 1, 100_000)
    found = potto.grad(M.squares)(xs)
    assert found.value == pytest.approx(math.fsum(xs**2), rel=1e-13)
    assert np.array_equal(found.tangent, 2 * xs)
    assert found.error < 1e-8


def test_an_array_without_tangents_stands_still() -> None:
    module = potto.compile("def f(a, xs: [n] Real) a*(sum x in xs (x^2))\nk = deriv(f)((2, 1), [1, 2, 3])")
    assert (module.k.value, module.k.tangent) == (28, 14)
    found = potto.deriv(module.f)((2.0, 1.0), np.array([1.0, 2.0]))
    assert (found.value, found.tangent) == (10, 5)


def test_the_least_and_the_greatest_over_a_range_that_a_number_ends() -> None:
    assert (M.highest(1, 1.0).value, M.highest(4, -1.0).value) == (2.0, 1.0)  # the ends of t*(3 - i)
    assert M.lowest(3, 2.0).value == 4.0
    moved = potto.deriv(M.highest_under)((3, 0), (0.3, 1))  # 3*[x < t] is the greatest: 3*t
    assert (moved.value, moved.tangent) == (pytest.approx(0.9), pytest.approx(3.0))


def test_a_batch_goes_through_arrays_of_arrays_of_which_some_move() -> None:
    """Rows that are the same all over the batch beside rows that differ, also where there are as many of both."""
    module = potto.compile("""
def total(a: [n, m] Real) sum i in 0..n-1, j in 0..m-1 ((1 + i + 10*j)*a[i, j])
def first(t) total([[t, 1, 2], [1, 2, 3]])
def last(t) total([[1, 2, 3], [2, t, t]])
def corner(t) [[[t, 1], [2, 3]], [[4, 5], [6, 7]]]
""")
    for count in (2, 3, 4):
        t = np.linspace(1, 2, count)
        assert module.first(t).value == pytest.approx(t + 145, rel=1e-15)
        assert module.last(t).value == pytest.approx(90 + 34 * t, rel=1e-15)
        slopes = potto.grad(module.last)(t).tangent
        assert slopes == pytest.approx(np.full(count, 34.0), rel=1e-15)
        assert module.corner(t).value[:, 0, 0, 0].tolist() == t.tolist()
        assert module.corner(t).value[:, 1].tolist() == [[[4, 5], [6, 7]]] * count


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"eye": (0, 0), "focal": 3}, "`c.eye` is (Real*, Real*, Real*): a tuple of 3 is needed, not a tuple of 2"),
        ({"eye": (0, 0, 0, 0), "focal": 3}, "`c.eye` is (Real*, Real*, Real*): a tuple of 3 is needed"),
        ({"eye": (0, 0, 0), "focal": (1, 2)}, "`c.focal` is Real*: a number is needed, not a tuple of 2"),
        ((0, 0, 0), "`c` is Cam: a tuple of 2 is needed, not a tuple of 3"),
    ],
)
def test_what_a_part_of_a_record_is_given_is_told_with_its_place(given: object, says: str) -> None:
    module = potto.compile("""
record Cam(eye: (Real, Real, Real), focal: Real)
def f(c: Cam) c.focal*c.eye.z
def g(cs: [n] Cam) sum c in cs (c.focal*c.eye.z)
""")
    for call, said in ((lambda: module.f(given), says), (lambda: module.g([given]), says.replace("`c", "`cs[0]", 1))):
        with pytest.raises(potto.PottoError) as raised:
            call()
        assert said in raised.value.diagnostics[0].message
