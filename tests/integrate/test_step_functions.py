"""Conditions in one variable that count through step functions: values, derivatives and bounds against closed forms.

Truths are sums over the stretches between the cuts in 40 digits: the conditions are decided at the middle of each by
comparing numbers, not by anything of Potto's.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import mpmath
import numpy as np
import pytest
from call_counts import calls_in

import potto
from potto.python import derived_calls

DIGITS = 40
STEP = 2.3
RNG = np.random.default_rng(7)
Number = mpmath.mpf


def truth(
    primitive: Callable[[Number, Sequence[bool]], Number], cuts: Sequence[float], low: float = 0.0, high: float = 1.0
) -> tuple[Number, list[Number]]:
    """The integral from low to high of a function of x and of which of `x < cut` hold, and its derivatives by the cuts,
    by its primitive and what it jumps by: the sums of `primitive` over the ends of the stretches."""
    with mpmath.workdps(DIGITS):
        ends = sorted({low, high, *(a for a in cuts if low < a < high)})
        total = Number(0)
        for a, b in itertools.pairwise(ends):
            sides = [(a + b) / 2 < cut for cut in cuts]
            total += primitive(Number(b), sides) - primitive(Number(a), sides)
        slopes = []
        for number, cut in enumerate(cuts):
            if not low < cut < high:
                slopes.append(Number(0))
                continue
            sides = [cut < other for other in cuts]
            left, right = ([*sides[:number], inside, *sides[number + 1 :]] for inside in (True, False))
            jump = (mpmath.diff(lambda x, s=s: primitive(x, s), Number(cut)) for s in (left, right))
            slopes.append(next(jump) - next(jump))
        return total, slopes


def checked(answer: potto.Estimate, value: Number, slopes: Sequence[Number], digits: float = 1e-13) -> None:
    """Within `digits` of the largest number, and within the bounds that the answer gives for itself."""
    assert answer.converged
    found = [answer.value, *np.atleast_1d(answer.tangent)]
    errors = [answer.error, *np.atleast_1d(answer.tangent_error)]
    exact = [value, *slopes]
    size = max(map(abs, exact))
    for x, error, true in zip(found, errors, exact, strict=True):
        assert abs(x - true) <= max(error, 2.0**-52 * abs(true))
        assert abs(x - true) <= digits * size


def parameters(n: int) -> list[str]:
    return [f"a{k}" for k in range(n)]


@pytest.mark.parametrize("n", [5, 12, 13, 40, 200])
def test_a_function_of_how_many_conditions_hold(n: int) -> None:
    names, at = parameters(n), RNG.uniform(-0.2, 1.2, n).tolist()
    terms = " + ".join(f"[x < {name}]" for name in names)
    f = potto.compile(f"def f({', '.join(names)}) integral [0, 1] 1/(1 + {terms}) d(x)").f
    checked(potto.grad(f, names)(*at), *truth(lambda x, sides: x / (1 + sum(sides)), at))


@pytest.mark.parametrize("n", [5, 12, 13, 40, 200])
def test_beside_what_is_no_polynomial(n: int) -> None:
    """Coefficients are no whole numbers, and parameters: sums along the cuts are rounded, and move."""
    names, at, t, c = parameters(n), RNG.uniform(-0.2, 1.2, n).tolist(), 0.7, 0.3
    terms = " + ".join(f"{1 + k / 10}*c*[x < {name}]" for k, name in enumerate(names))
    f = potto.compile(f"def f(t, c, {', '.join(names)}) integral [0, 1] exp(x*t)*(1 + {terms}) d(x)").f
    with mpmath.workdps(DIGITS):

        def height(sides: Sequence[bool], c: float) -> Number:
            return 1 + sum(Number(1 + k / 10) * c * inside for k, inside in enumerate(sides))

        value, slopes = truth(lambda x, s: height(s, c) * mpmath.exp(x * t) / t, at)
        by_t, _ = truth(lambda x, s: height(s, c) * mpmath.exp(x * t) * (x / t - 1 / Number(t) ** 2), at)
        by_c = (value - truth(lambda x, s: mpmath.exp(x * t) / t, at)[0]) / c
    checked(potto.grad(f, ["t", "c", *names])(t, c, *at), value, [by_t, by_c, *slopes])
    batch = potto.grad(f, "t")(np.array([t, t / 2]), c, *at)
    checked(potto.grad(f, "t")(t / 2, c, *at), batch.value[1], [batch.tangent[1]])
    assert batch.value[0] == pytest.approx(float(value), rel=1e-13, abs=0)


@pytest.mark.parametrize("written, primitive", [
    ("x^2*({0})^2 - ({0})", lambda x, n: x**3 / 3 * n**2 - x * n),
    ("({0})/(2 + x + ({0}))", lambda x, n: n * mpmath.log(2 + x + n)),
    ("sin(x)*({0})*(3 - ({0})/10)", lambda x, n: -mpmath.cos(x) * n * (3 - Number(n) / 10)),
    ("exp(-({0})/10)*cos(5*x)", lambda x, n: mpmath.exp(-Number(n) / 10) * mpmath.sin(5 * x) / 5),
])  # fmt: skip
def test_in_many_forms(written: str, primitive: Callable[[Number, int], Number]) -> None:
    """Conditions either way round, strict or not, with other slopes, and as conditionals; bounds that are numbers."""
    n = 20
    names, at = parameters(n), RNG.uniform(-0.9, 1.9, n).tolist()
    forms = ("[x < {}]", "(1 - [{} <= x])", "[2*x - {0} <= {0}]", "(if [x < {}] then 3 else 2) - 2")
    terms = " + ".join(forms[k % len(forms)].format(name) for k, name in enumerate(names))
    f = potto.compile(f"def f({', '.join(names)}) integral [-0.5, 1.5] {written.format(f'({terms})')} d(x)").f
    checked(potto.grad(f, names)(*at), *truth(lambda x, sides: primitive(x, sum(sides)), at, -0.5, 1.5), 1e-12)


def test_coefficients_that_are_no_whole_numbers() -> None:
    """They stand still, and their sums are rounded."""
    n, t = 20, 0.8
    terms = " + ".join(f"{k / 10}*[x < {k / n}*t]" for k in range(1, n))
    f = potto.compile(f"def f(t, c) integral [0, 1] cos(c*x)*({terms}) d(x)").f
    with mpmath.workdps(DIGITS):
        cuts = [(Number(k / 10), Number(k / n)) for k in range(1, n)]
        value = mpmath.fsum(h * mpmath.sin(3 * s * t) / 3 for h, s in cuts)
        by_t = mpmath.fsum(h * s * mpmath.cos(3 * s * t) for h, s in cuts)
        by_c = mpmath.fsum(h * (s * t * mpmath.cos(3 * s * t) / 3 - mpmath.sin(3 * s * t) / 9) for h, s in cuts)
    checked(potto.grad(f, ["t", "c"])(t, 3.0), value, [by_t, by_c])


def test_cuts_and_heights_that_several_parameters_move() -> None:
    """Each cut is moved by its own parameter and by two that are shared, heights by a product that is 0: cuts have no
    slope, `c` has one."""
    n, s, c, d = 30, 0.25, 0.0, 1.5
    names, at = parameters(n), RNG.uniform(-0.4, 1.1, n).tolist()
    terms = " + ".join(f"c*d*{k + 1}*[x < {name} + s*s - {k}*0.001*s]" for k, name in enumerate(names))
    f = potto.compile(f"def f(s, c, d, {', '.join(names)}) integral [0, 1] exp(x)*({terms}) d(x)").f
    with mpmath.workdps(DIGITS):
        cuts = [min(max(Number(a) + s * s - k * Number(0.001) * s, 0), 1) for k, a in enumerate(at)]
        by_c = d * mpmath.fsum((k + 1) * mpmath.expm1(cut) for k, cut in enumerate(cuts))
    checked(potto.grad(f, ["s", "c", "d", *names])(s, c, d, *at), Number(0), [0, by_c, 0, *[0] * n])


def test_in_reverse_as_forward(monkeypatch: pytest.MonkeyPatch) -> None:
    """Products of derivatives by cuts, heights and the rest with those of these by the parameters, along either way,
    also when it was asked for before. Where cuts are moved by several parameters some hundred roundings differ."""
    n, t, c = 25, 0.7, -0.4
    names = parameters(n)
    terms = " + ".join(f"({k} + c)*[x < {name}*t + {names[k - 1]}^2/9]" for k, name in enumerate(names))
    f = potto.compile(f"def f(t, c, {', '.join(names)}) integral [0, 2*t] exp(x*t)/(40 + ({terms})/{n}) d(x)").f
    for at in (RNG.uniform(-0.3, 2.5, n).tolist() for _ in range(5)):
        monkeypatch.setattr(derived_calls, "MANY", 1000)
        forward = potto.grad(f, ["t", "c", *names])(t, c, *at)
        monkeypatch.setattr(derived_calls, "MANY", 1)
        for wrt in (["t", "c", *names], [*names, "c", "t"]):
            first, again = potto.grad(f, wrt)(t, c, *at), potto.grad(f, wrt)(t, c, *at)
            assert (again.tangent, again.tangent_error) == (first.tangent, first.tangent_error) and first.converged
            for name in wrt:
                assert first[name] == pytest.approx(forward[name], rel=1e-12, abs=1e-15)
            assert first.value == pytest.approx(forward.value, rel=1e-14, abs=0)


def test_a_gradient_costs_a_few_values() -> None:
    """By functions called, at parameters that are new; values are answered at once from the second call on."""
    n = 160
    names = parameters(n)
    f = potto.compile(
        f"def f({', '.join(names)}) integral [0, 1] 1/(1 + {' + '.join(f'[x < {name}]' for name in names)}) d(x)"
    ).f
    gradient, places = potto.grad(f, names), np.linspace(0.1, 0.9, n)
    with potto.settings(backend="numpy"):
        for at in (places, places + 1e-3):
            f(*at.tolist())
            gradient(*at.tolist())
        value, all_slopes = (calls_in(lambda run=run: run(*(places + 2e-3).tolist())) for run in (f, gradient))
    assert all_slopes <= 6 * value  # one and a half of them for what a tape has for each parameter


def test_where_nothing_is_integrated_nothing_is_asked_for() -> None:
    """log(x - 1/2) has no value below 1/2, where no condition holds."""
    n = 20
    terms = " + ".join(f"[x > 0.6 + {k / 100}*t]" for k in range(n))
    f = potto.deriv(potto.compile(f"def f(t) integral [0, 1] log(x - 0.5)*({terms}) d(x)").f)
    with mpmath.workdps(DIGITS):
        half, at = Number(1) / 2, [Number(0.6) + Number(k / 100) for k in range(n)]

        def primitive(x: Number) -> Number:
            return (x - half) * (mpmath.log(x - half) - 1)

        value = mpmath.fsum(primitive(Number(1)) - primitive(a) for a in at)
        slope = mpmath.fsum(-Number(k / 100) * mpmath.log(a - half) for k, a in enumerate(at))
    checked(f((1.0, 1.0)), value, [slope])


def test_cuts_that_are_one() -> None:
    """Twice as many conditions as cuts: the general way tells what happens there."""
    names = parameters(30)
    terms = " + ".join(f"[x < {name}]" for name in names)
    f = potto.compile(f"def f({', '.join(names)}) integral [0, 1] 1/(1 + {terms}) d(x)").f
    at = np.repeat(RNG.uniform(0.1, 0.9, 15), 2).tolist()
    found = f(*at)
    value, _ = truth(lambda x, sides: x / (1 + sum(sides)), at)
    assert abs(found.value - value) <= max(found.error, 1e-15)


def test_a_cut_on_a_bound_has_two_derivatives() -> None:
    """Of `[x < a]` at a = 1 the integral stays as it is to the right of 1."""
    terms = " + ".join(f"[x < {k / 10}*b]" for k in range(1, 10))
    f = potto.deriv(potto.compile(f"def f(a, b) integral [0, 1] ([x < a] + {terms})*exp(x) d(x)").f)
    found = f((1.0, 1.0), (0.9, 0.0))
    (note,) = found.notes
    assert note.backward == pytest.approx(np.e, rel=1e-14, abs=0) and note.forward == 0


@pytest.mark.parametrize("batch", [1, 50])
@pytest.mark.parametrize("integrand", ["1/(1 + {})", "exp(x*t)*({})"])
def test_twice_the_conditions_cost_twice_as_much(integrand: str, batch: int) -> None:
    """Evaluations, and functions that are called, at parameters that are new at each call."""
    costs = []
    for n in (5, 10, 20, 40, 80, 160, 320, 640):
        terms = " + ".join(f"[x < {k}*t/{n + 1}]" for k in range(1, n + 1))
        f = potto.deriv(potto.compile(f"def f(t) integral [0, 1] {integrand.format(terms)} d(x)").f)
        new = iter(np.outer((0.9, 0.3, 0.6, 0.45), np.linspace(0.9, 1.0, batch)))

        def call(f: potto.Function = f, new: object = new) -> potto.Estimate:
            t = next(new)  # type: ignore[call-overload]
            return f((float(t[0]), 1.0) if batch == 1 else (t, np.ones(batch)))

        with potto.settings(backend="numpy"):  # when machine code is made depends on the time that numpy took
            call()
            call()
            costs.append((np.sum(call().evals), calls_in(call)))
    for small, large in itertools.pairwise(costs):
        assert large[0] <= STEP * small[0]
        assert large[1] <= STEP * small[1]


# What a condition compares, with the place up to which it holds on [0, 1], and the speed of that by the parameter.
CURVED = {
    "x^2 < {}": (lambda a: mpmath.sqrt(a), lambda a: 1 / (2 * mpmath.sqrt(a))),
    "exp(x) < 1 + {}": (lambda a: mpmath.log(1 + a), lambda a: 1 / (1 + a)),
    "k*x < {}": (lambda a: a / Number(0.8), lambda a: 1 / Number(0.8)),
    "k*x^2 + x - {} < 0": (
        lambda a: (mpmath.sqrt(1 + 4 * Number(0.8) * a) - 1) / (2 * Number(0.8)),
        lambda a: 1 / mpmath.sqrt(1 + 4 * Number(0.8) * a),
    ),
    "sqrt(x + 1) < 1 + {}/2": (lambda a: (1 + a / 2) ** 2 - 1, lambda a: 1 + a / 2),
    "1/(1 + x) > 1 - {}/3": (lambda a: 1 / (1 - a / 3) - 1, lambda a: 1 / (1 - a / 3) ** 2 / 3),
}


@pytest.mark.parametrize("condition", CURVED)
@pytest.mark.parametrize("n", [5, 13, 60])
def test_conditions_that_are_curved_or_have_parameters_for_slopes(condition: str, n: int) -> None:
    names, at = parameters(n), RNG.uniform(0.01, 1.2, n).tolist()
    terms = " + ".join(f"[{condition.format(name)}]" for name in names)
    f = potto.compile(f"def f(k, {', '.join(names)}) integral [0, 1] exp(x)/(1 + {terms}) d(x)").f
    place, speed = CURVED[condition]
    with mpmath.workdps(DIGITS):
        cuts = [place(Number(a)) for a in at]
        value, slopes = truth(lambda x, sides: mpmath.exp(x) / (1 + sum(sides)), cuts)
        slopes = [slope * speed(Number(a)) for slope, a in zip(slopes, at, strict=True)]
    checked(potto.grad(f, names)(0.8, *at), value, slopes)
    batch = potto.grad(f, names[0])(0.8, np.array(at[:1] * 3), *at[1:])
    assert batch.value[2] == pytest.approx(float(value), rel=1e-13, abs=0)
    assert batch.tangent[2] == pytest.approx(float(slopes[0]), rel=1e-12, abs=0)


def test_roots_that_come_in_pairs_or_are_not_there() -> None:
    """`x^2 < a` between two cuts, one of which may be below the range; nowhere for a < 0."""
    n, low = 20, -0.6
    names, at = parameters(n), RNG.uniform(-0.5, 1.2, n).tolist()
    terms = " + ".join(f"{k}*[x^2 < {name}]" for k, name in enumerate(names))
    f = potto.compile(f"def f({', '.join(names)}) integral [{low}, 1] exp(x)*({terms}) d(x)").f
    with mpmath.workdps(DIGITS):
        value, slopes = Number(0), []
        for k, a in enumerate(at):
            root = mpmath.sqrt(max(a, 0))
            lower, upper = max(-root, Number(low)), min(root, 1)
            value += k * (mpmath.exp(upper) - mpmath.exp(lower)) if a > 0 else 0
            edges = [x for x in (-root, root) if low < x < 1 and a > 0]
            slopes.append(k * mpmath.fsum(mpmath.exp(x) / (2 * root) for x in edges))
    checked(potto.grad(f, names)(*at), value, slopes)


def union(at: Sequence[float], half: float) -> list[tuple[Number, Number, int | None, int | None]]:
    """The stretches of [0, 1] that lie within `half` of one of these, with whose ends they are; None: of the range."""
    found: list[list[tuple[Number, int]]] = []
    for x, k in sorted((x, k) for k, x in enumerate(at)):
        if found and x - half < found[-1][1][0]:
            found[-1][1] = (Number(x) + half, k)
        else:
            found.append([(Number(x) - half, k), (Number(x) + half, k)])
    return [
        (max(a, Number(0)), min(b, Number(1)), i if a > 0 else None, j if b < 1 else None)
        for (a, i), (b, j) in found
        if b > 0 and a < 1
    ]


@pytest.mark.parametrize("n", [5, 13, 40])
@pytest.mark.parametrize("written", ["[{}]", "[max({}) > 0]", "(1 - [not ({})])"])
def test_a_union_of_many(n: int, written: str) -> None:
    half, names, at = 0.3 / n, parameters(n), RNG.uniform(-0.1, 1.1, n).tolist()
    one = f"{half!r} - abs(x - {{}})" if "max" in written else f"abs(x - {{}}) < {half!r}"
    inside = written.format((", " if "max" in written else " or ").join(one.format(name) for name in names))
    f = potto.compile(f"def f({', '.join(names)}) integral [0, 1] exp(x)*{inside} d(x)").f
    with mpmath.workdps(DIGITS):
        value, slopes = Number(0), [Number(0)] * n
        for a, b, i, j in union(at, half):
            value += mpmath.exp(b) - mpmath.exp(a)
            for end, whose, sign in ((a, i, -1), (b, j, 1)):
                if whose is not None:
                    slopes[whose] += sign * mpmath.exp(end)
    checked(potto.grad(f, names)(*at), value, slopes, 1e-12)  # ends of a stretch all but cancel


@pytest.mark.parametrize("n", [5, 13, 30])
def test_the_first_condition_that_holds(n: int) -> None:
    """n values that are parameters, and what all conditions have to hold for."""
    names, values = parameters(n), [f"c{k}" for k in range(n)]
    at, c = np.sort(RNG.uniform(0.02, 0.98, n)).tolist(), RNG.uniform(-1, 1, n).tolist()
    chosen = "0"
    for name, value in zip(reversed(names), reversed(values), strict=True):
        chosen = f"(if [x < {name}] then {value} else {chosen})"
    every = " and ".join(f"x > {name}/2" for name in names)
    f = potto.compile(f"def f({', '.join((*names, *values))}) integral [0, 1] exp(x)*({chosen} + 3*[{every}]) d(x)").f
    with mpmath.workdps(DIGITS):
        ends = [Number(0), *map(Number, at)]
        pieces = [mpmath.exp(b) - mpmath.exp(a) for a, b in itertools.pairwise(ends)]
        value = mpmath.fsum(x * y for x, y in zip(pieces, c, strict=True)) + 3 * (mpmath.e - mpmath.exp(ends[-1] / 2))
        by_cut = [(x - y) * mpmath.exp(a) for a, x, y in zip(at, c, [*c[1:], 0.0], strict=True)]
        by_cut[-1] -= 3 * mpmath.exp(ends[-1] / 2) / 2
    checked(potto.grad(f, [*names, *values])(*at, *c), value, [*by_cut, *pieces], 1e-12)


def test_a_condition_without_a_value_is_told() -> None:
    """log(x) has no value below 0, which is nobody's cut but its own."""
    names = parameters(8)
    terms = " + ".join(f"[log(x) < {name}]" for name in names)
    f = potto.compile(f"def f({', '.join(names)}) integral [-0.1, 1] 1/(1 + {terms}) d(x)").f
    found = f(*np.linspace(-3.0, -0.1, 8).tolist())
    assert np.isnan(found.value)


FORMS = {
    "curved": "[x^2 < {k}*t/{m}]",
    "slopes": "[t*x < {k}/{m}]",
    "asked": "[exp(x) < 1 + {k}*t/{m}]",
    "calls": "inside(x, {k}*t/{m})",
}


@pytest.mark.parametrize("batch", [1, 20])
@pytest.mark.parametrize("form", [*FORMS, "union", "greatest"])
def test_twice_as_many_of_any_form(form: str, batch: int) -> None:
    """Evaluations, and functions that are called, at parameters that are new at each call."""
    costs = []
    for n in (5, 10, 20, 40, 80):
        ks = range(1, n + 1)
        if form == "union":
            integrand = f"exp(x)*[{' or '.join(f'abs(x - {k}*t/{n + 1}) < 0.3/{n}' for k in ks)}]"
        elif form == "greatest":
            integrand = f"exp(x)*[max({', '.join(f'0.3/{n} - abs(x - {k}*t/{n + 1})' for k in ks)}) > 0]"
        else:
            integrand = f"exp(x)/(1 + {' + '.join(FORMS[form].format(k=k, m=n + 1) for k in ks)})"
        program = f"def inside(x, a) [x^2 < a]\ndef f(t) integral [0, 1] {integrand} d(x)"
        f = potto.deriv(potto.compile(program).f)
        new = iter(np.outer((0.9, 0.85, 0.95, 0.92), np.linspace(0.97, 1.0, batch)))

        def call(f: potto.Function = f, new: object = new) -> potto.Estimate:
            t = next(new)  # type: ignore[call-overload]
            return f((float(t[0]), 1.0) if batch == 1 else (t, np.ones(batch)))

        with potto.settings(backend="numpy"):  # when machine code is made depends on the time that numpy took
            call()
            call()
            costs.append((np.sum(call().evals), calls_in(call)))
    for small, large in itertools.pairwise(costs):
        assert all(b <= STEP * a for a, b in zip(small, large, strict=True)), costs


def test_a_union_is_planned_in_as_many_steps_as_it_has_regions() -> None:
    """Functions that its first call calls: 2^n ways lead through its conditions."""
    costs = []
    for n in (10, 20, 40, 80):
        inside = " or ".join(f"abs(x - {k}*t/{n + 1}) < 0.3/{n}" for k in range(1, n + 1))
        f = potto.compile(f"def f(t) integral [0, 1] exp(x)*[{inside}] d(x)").f
        costs.append(calls_in(lambda f=f: f(0.9)))  # type: ignore[misc]
    assert all(large <= STEP * small for small, large in itertools.pairwise(costs)), costs


@pytest.mark.parametrize("condition", ["x < {k}*t/{m}", "x^2 < {k}*t/{m}"])
def test_a_sum_costs_what_it_costs_written_out(condition: str) -> None:
    """Functions that are called at parameters that are new, and the value against its closed form."""
    n, root, t = 30, 2 if "^" in condition else 1, Number(0.9)
    term, costs = condition.format(k="k", m=n + 1), list[int]()
    with mpmath.workdps(DIGITS):
        cuts = [mpmath.root(k * t / (n + 1), root) for k in range(1, n + 1)]
        value, slopes = truth(lambda x, sides: x / (1 + sum(sides)), cuts)
        by_t = mpmath.fsum(s * a / (root * t) for s, a in zip(slopes, cuts, strict=True))
    for each in (f"sum k in 1..{n} ([{term}])", " + ".join(f"[{term.replace('k', str(k))}]" for k in range(1, n + 1))):
        f = potto.compile(f"def f(t) integral [0, 1] 1/(1 + {each}) d(x)").f
        checked(potto.grad(f, "t")(0.9), value, [by_t])
        f(0.95)
        costs.append(calls_in(lambda f=f: f(0.85)))  # type: ignore[misc]
    assert costs[0] == costs[1]
