"""Short names for terms, and random ones, for the tests of core."""

from __future__ import annotations

from hypothesis import strategies as st

from potto.core.terms import (
    ONE,
    ZERO,
    Term,
    add,
    branch,
    const,
    div,
    integral,
    mul,
    neg,
    pow_,
    prim,
    sub,
    var,
)

x, y, t, s, c, n = map(var, "xytscn")
TWO, THREE, HALF = const(2.0), const(3.0), const(0.5)
UNIT = ((ZERO, ONE),)


def bracket(surface: Term, strict: bool = False) -> Term:
    """[surface >= 0] or [surface > 0]."""
    return branch((surface,), strict, ONE, ZERO)


def area(body: Term, *names: str) -> Term:
    """The integral over the unit interval, square, ..."""
    return integral(names, UNIT * len(names), body)


_STEPS = {
    "add": lambda a, b, c: add(a, b, c),
    "sub": lambda a, b, c: sub(a, b),
    "mul": lambda a, b, c: mul(a, b),
    "square": lambda a, b, c: pow_(a, TWO),
    "inverse": lambda a, b, c: pow_(a, const(-1.0)),
    "div": lambda a, b, c: div(a, b),
    "neg": lambda a, b, c: neg(a),
    "sin": lambda a, b, c: prim("sin", a),
    "cos": lambda a, b, c: prim("cos", a),
    "exp": lambda a, b, c: prim("exp", a),
    "sqrt": lambda a, b, c: prim("sqrt", a),
    "abs": lambda a, b, c: prim("abs", a),
    "log1p": lambda a, b, c: prim("log1p", a),
    "max": lambda a, b, c: prim("max", a, b),
    "branch": lambda a, b, c: branch((a,), False, b, c),
    "strict": lambda a, b, c: branch((a,), True, b, c),
}
_NUMBERS = tuple(map(const, (0.0, 1.0, 2.0, 3.0, -1.0, 0.5, 0.1, 7.25)))


@st.composite
def terms(draw: st.DrawFn) -> Term:
    """Terms over x, y and t with the common builtins and branches; each step works on what there is already."""
    pool: list[Term] = [x, y, t, draw(st.sampled_from(_NUMBERS)), draw(st.sampled_from(_NUMBERS))]
    for step in draw(st.lists(st.sampled_from(sorted(_STEPS)), min_size=1, max_size=7)):
        parts = (draw(st.integers(0, len(pool) - 1)) for _ in range(3))
        pool.append(_STEPS[step](*(pool[-1 - k] for k in parts)))
    return pool[-1]
