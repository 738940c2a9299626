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


def _grow(parts: st.SearchStrategy[Term]) -> st.SearchStrategy[Term]:
    some = st.lists(parts, min_size=2, max_size=3)
    return st.one_of(
        some.map(lambda items: add(*items)),
        some.map(lambda items: mul(*items)),
        parts.map(neg),
        st.tuples(parts, parts).map(lambda pair: sub(*pair)),
        st.tuples(parts, parts).map(lambda pair: div(*pair)),
        st.tuples(parts, st.sampled_from((2.0, 3.0, -1.0, 0.5))).map(lambda pair: pow_(pair[0], const(pair[1]))),
        st.tuples(st.sampled_from(("sin", "cos", "exp", "sqrt", "abs", "tanh", "log1p")), parts).map(
            lambda pair: prim(*pair)
        ),
        st.tuples(parts, parts, parts, st.booleans()).map(lambda p: branch((p[0],), p[3], p[1], p[2])),
        st.tuples(parts, parts).map(lambda pair: prim("max", *pair)),
    )


def terms() -> st.SearchStrategy[Term]:
    """Terms over x, y and t with the common builtins and branches."""
    numbers = st.sampled_from((0.0, 1.0, 2.0, 3.0, -1.0, 0.5, 0.1, 7.25)).map(const)
    leaves = st.one_of(st.sampled_from((x, y, t)), numbers)
    return st.recursive(leaves, _grow, max_leaves=12)
