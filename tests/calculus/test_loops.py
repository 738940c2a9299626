"""Derivatives of arrays, elements, sums over them and folds, against closed forms and differences by mpmath."""

from __future__ import annotations

import pytest
from mpmath import mp

from potto.calculus.differentiation.derivative import NotSmooth, partial
from potto.calculus.differentiation.dual import dual, dual_function
from potto.core.printer import format_term
from potto.core.reference import evaluate
from potto.core.simplify import simplify
from potto.core.terms import (
    ONE,
    ZERO,
    Lam,
    Term,
    add,
    app,
    array,
    branch,
    const,
    data,
    deriv,
    fold,
    if_,
    index,
    integral,
    lam,
    length,
    list_of,
    mul,
    postorder,
    prim,
    proj,
    sub,
    sum_,
    tuple_,
    var,
)

i, n, s, t, x, xs, state = map(var, ("i", "n", "s", "t", "x", "xs", "state"))
LAST = sub(length(xs), ONE)
GIVEN = [0.5, 1.5, -0.25]
MOVES = [1.0, -2.0, 0.5]


@pytest.fixture(autouse=True)
def _digits():
    with mp.workdps(60):
        yield


def bracket(surface: Term) -> Term:
    return branch((surface,), False, ONE, ZERO)


def close(found: object, wanted: object, digits: int = 20) -> None:
    if isinstance(wanted, tuple | list):
        assert isinstance(found, tuple | list) and len(found) == len(wanted)
        for part, other in zip(found, wanted, strict=True):
            close(part, other, digits)
    else:
        assert abs(found - wanted) <= mp.mpf(10) ** -digits * max(1, abs(wanted))  # type: ignore[operator]


def pendulum(steps: Term, start: Term) -> Term:
    """Explicit Euler of x'' = -sin x with step t."""
    here, speed = proj(state, 0), proj(state, 1)
    step = tuple_((add(here, mul(t, speed)), sub(speed, mul(t, prim("sin", here)))))
    return fold("i", ONE, steps, "state", start, step)


OF_T = {
    "a power": fold("i", ONE, const(5), "state", ONE, mul(state, t)),
    "a power of a moving start": fold("i", ONE, const(5), "state", t, mul(state, state)),
    "no steps": fold("i", ONE, ZERO, "state", mul(t, t), mul(state, t)),
    "a step that forgets": fold("i", ONE, const(3), "state", t, mul(i, t)),
    "a pendulum": proj(pendulum(const(20), tuple_((ONE, ZERO))), 0),
    "a pendulum pushed": proj(pendulum(const(20), tuple_((t, mul(t, t)))), 1),
    "a fold in a fold": fold(
        "i", ONE, const(3), "state", t, fold("j", ONE, i, "s", state, add(mul(s, t), var("j"), state))
    ),
    "an element": index(array("i", const(4), prim("exp", mul(i, t))), const(3)),
    "an element of a list": index(list_of((t, mul(t, t))), index(xs, ZERO)),
    "an element of what is chosen": index(
        if_(prim("lt", ZERO, n), array("i", const(2), mul(t, i)), list_of((ZERO, ZERO))), ONE
    ),
    "a sum over elements": sum_("i", ZERO, LAST, prim("sin", mul(t, index(xs, i)))),
    "a sum over records": sum_("i", ZERO, ONE, proj(index(array("j", n, tuple_((mul(t, var("j")), t))), i), 0)),
}


@pytest.mark.parametrize("name", OF_T)
def test_both_symbolic_derivatives_are_those_of_the_value(name):
    """`dual` and `partial` against differences of the value."""
    term, point = OF_T[name], {"t": 0.7, "n": 3.0, "xs": [1.0, 0.5, -2.0]}
    wanted = evaluate(app(deriv(lam(("t",), term)), (tuple_((t, ONE)),)), point, digits=60)
    value, tangent = dual(term, {"t": ONE})
    close((evaluate(value, point), evaluate(tangent, point)), wanted)
    close(evaluate(partial(term, "t"), point), wanted[1])
    close(evaluate(partial(simplify(term), "t"), point), wanted[1])


def test_the_dual_of_a_function_of_an_array():
    """The mean of squares: its tangent is the mean of twice the products."""
    mean = lam(("xs",), prim("div", sum_("i", ZERO, LAST, mul(index(xs, i), index(xs, i))), length(xs)))
    found = dual_function(mean)
    assert isinstance(found, Lam)
    value, tangent = evaluate(app(found, (var("given"),)), {"given": (GIVEN, MOVES)})
    close(value, sum(v * v for v in GIVEN) / mp.mpf(3))
    close(tangent, 2 * sum(v * d for v, d in zip(GIVEN, MOVES, strict=True)) / mp.mpf(3))


def test_the_dual_of_an_array_is_an_array_of_values_and_one_of_tangents():
    scaled = lam(("xs", "t"), array("i", length(xs), mul(t, index(xs, i))))
    found = evaluate(app(dual_function(scaled), (var("given"), tuple_((const(2), ONE)))), {"given": (GIVEN, MOVES)})
    close(found, ([2 * v for v in GIVEN], [v + 2 * d for v, d in zip(GIVEN, MOVES, strict=True)]))


def test_what_stands_still_has_zeros_of_its_shape():
    still = array("i", n, tuple_((i, mul(i, i))))
    assert dual(still, {"t": ONE}) == (still, array("i", n, tuple_((ZERO, ZERO))))
    heights = data("heights.csv", "00", "height")
    assert dual(mul(t, index(heights, ONE)), {"t": ONE})[1] is index(heights, ONE)
    assert dual(mul(t, length(xs)), {"xs": var("dxs")})[1] is ZERO


def test_a_derivative_reads_well():
    squares = sum_("i", ZERO, sub(n, ONE), mul(index(xs, i), index(xs, i)))
    tangent = dual(squares, {"xs": var("dxs")})[1]
    assert format_term(simplify(tangent)) == "sum i in 0..n - 1 (2*xs[i]*dxs[i])"


# Jumps


def test_jumps_at_the_elements_of_an_array_that_move():
    """integral [0, 1] (sum over xs of [x < xs[i]]): the sum of the elements, as long as they are in 0..1."""
    edges = sum_("i", ZERO, LAST, bracket(sub(index(xs, i), x)))
    tangent = dual(integral(("x",), ((ZERO, ONE),), edges), {"xs": var("dxs")})[1]
    close(evaluate(tangent, {"xs": [0.25, 0.5, 2.0], "dxs": [3.0, 5.0, 7.0]}), 8)


def test_jumps_under_several_indices_of_which_one_bounds_the_other():
    """Sum of j [x < t (i + j)] for j up to i: integrates to t times the sum of j (i + j)."""
    inner = sum_("j", ZERO, i, mul(var("j"), bracket(sub(mul(t, add(i, var("j"))), x))))
    tangent = dual(integral(("x",), ((ZERO, ONE),), sum_("i", ZERO, const(2), inner)), {"t": ONE})[1]
    close(evaluate(tangent, {"t": 0.1}), sum(k * (m + k) for m in range(3) for k in range(m + 1)))


def test_a_jump_at_each_step_of_a_fold():
    """The product of 1 + [x < i t] for i = 1, 2: 4 up to t, then 2 up to 2 t, then 1."""
    factors = fold("i", ONE, const(2), "state", ONE, mul(state, add(ONE, bracket(sub(mul(i, t), x)))))
    tangent = dual(integral(("x",), ((ZERO, ONE),), factors), {"t": ONE})[1]
    close(evaluate(tangent, {"t": 0.3}), 4)


def test_a_jump_that_the_state_decides_is_written_out():
    """s = x, then twice s + [s > t]: jumps at x = t, and at x = t - 1 (not in 0..1) or t."""
    steps = fold("i", ONE, const(2), "state", x, add(state, bracket(sub(state, t))))
    whole = integral(("x",), ((ZERO, ONE),), steps)
    value, tangent = dual(whole, {"t": ONE})
    close(evaluate(value, {"t": 0.3}), mp.mpf("0.5") + 2 * (1 - mp.mpf(0.3)))
    close(evaluate(tangent, {"t": 0.3}), -2)


def test_a_jump_that_the_state_decides_at_steps_that_are_not_known():
    steps = fold("i", ONE, n, "state", x, add(state, bracket(sub(state, t))))
    with pytest.raises(NotSmooth):
        dual(integral(("x",), ((ZERO, ONE),), steps), {"t": ONE})


def test_an_integral_of_an_array():
    """The integral of [x < t] (i + 1) x over 0..1, for i = 0, 1, 2: (i + 1) t^2 / 2."""
    ramp = array("i", const(3), mul(bracket(sub(t, x)), x, add(i, ONE)))
    found = dual(integral(("x",), ((ZERO, ONE),), ramp), {"t": ONE})
    assert not any(node is ramp for node in postorder(found[1]))
    close(evaluate(found[1], {"t": 0.4}), [mp.mpf(0.4) * k for k in (1, 2, 3)])
