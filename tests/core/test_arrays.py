"""Arrays, elements, folds and data as terms: what walks over terms, prints, packs, shortens and evaluates them."""

from __future__ import annotations

import pytest
from core_terms import ONE, TWO, ZERO, area, bracket, n, s, t, terms, x, y
from hypothesis import given, settings
from hypothesis import strategies as st
from lint import lint
from mpmath import mp

from potto.core.binders import apart
from potto.core.packing import packed, unpacked
from potto.core.printer import format_term
from potto.core.reference import evaluate
from potto.core.simplify import simplify
from potto.core.terms import (
    Term,
    add,
    app,
    array,
    bound_names,
    children,
    const,
    data,
    deriv,
    fold,
    index,
    lam,
    length,
    list_of,
    mul,
    neg,
    postorder,
    proj,
    rebuild,
    rename_bound,
    replaced,
    sub,
    substitute,
    sum_,
    tuple_,
    var,
)

i, j, xs, state = map(var, ("i", "j", "xs", "state"))
LAST = sub(n, ONE)
HEIGHTS = data("heights.csv", "00", "height")


def element(body: Term) -> Term:
    return array("i", n, body)


@st.composite
def programs(draw: st.DrawFn) -> Term:
    """Numbers made by way of arrays of three elements, sums and folds over them; `i` and `state` are bound."""
    inside, start = draw(terms()), draw(terms())
    body = substitute(inside, {draw(st.sampled_from("xy")): i})
    whole = array("i", const(3), body)
    match draw(st.sampled_from(("index", "sum", "fold", "length", "tuple"))):
        case "index":
            return index(whole, const(draw(st.integers(0, 2))))
        case "sum":
            return sum_("j", ZERO, sub(length(whole), ONE), mul(index(whole, j), start))
        case "fold":
            step = add(mul(const(0.5), state), substitute(inside, {"x": i, "y": state}))
            return fold("i", ONE, TWO, "state", start, step)
        case "length":
            return mul(length(whole), start)
        case _:
            return proj(index(array("j", TWO, tuple_((index(whole, j), start))), ONE), 0)


def same(first: Term, second: Term, point: dict[str, float], other: dict[str, float] | None = None) -> None:
    a, b = evaluate(first, point), evaluate(second, other or point)
    assert (mp.isnan(a) and mp.isnan(b)) or a == b or abs(a - b) <= mp.mpf("1e-25") * max(1, abs(a))


POINT = {"x": 0.3, "y": -1.2, "t": 0.7}


@settings(deadline=None, max_examples=60)
@given(programs())
def test_a_term_is_rebuilt_from_its_children(term: Term) -> None:
    for node in postorder(term):
        assert rebuild(node, children(node)) is node
        assert all(part.free <= node.free | set(bound_names(node)) for part in children(node))
    assert unpacked(packed(term)) is term


@settings(deadline=None, max_examples=60)
@given(programs(), terms())
def test_substitution_is_evaluation_at_the_value(term: Term, given: Term) -> None:
    value = evaluate(given, POINT)
    if mp.isfinite(value):
        same(substitute(term, {"t": given}), term, POINT, {**POINT, "t": value})


@settings(deadline=None, max_examples=60)
@given(programs(), st.sampled_from(("i", "j", "state")))
def test_what_is_put_in_is_not_captured(term: Term, name: str) -> None:
    free = substitute(term, {"t": var(name)})
    same(free, term, {**POINT, "t": 0.45} | ({name: 0.45} if name in free.free else {}))


@settings(deadline=None, max_examples=60)
@given(programs())
def test_names_of_bound_variables_mean_nothing(term: Term) -> None:
    for node in postorder(term):
        if bound_names(node):
            other = rename_bound(node, {name: f"{name}'other" for name in bound_names(node)})
            assert bound_names(other) == tuple(f"{name}'other" for name in bound_names(node))
            assert other.free == node.free
            same(replaced(term, {node: other}), term, POINT)
            assert rename_bound(other, dict(zip(bound_names(other), bound_names(node), strict=True))) is node


@settings(deadline=None, max_examples=60)
@given(programs())
def test_binders_are_told_apart(term: Term) -> None:
    found = apart(substitute(element(term), {"n": add(i, state)}))
    assert lint(found) == []


@settings(deadline=None, max_examples=60)
@given(programs())
def test_shortened_terms_have_the_same_value(term: Term) -> None:
    before = evaluate(term, POINT)
    if mp.isfinite(before):
        assert abs(evaluate(simplify(term), POINT) - before) <= mp.mpf("1e-15") * max(1, abs(before))


# Constructors and shortening


def test_what_is_written_out_is_read_at_once():
    assert index(list_of((x, y)), ONE) is y
    assert length(list_of((x, y))) is TWO
    assert length(element(i)) is n


@pytest.mark.parametrize("place", [2.0, -1.0, 0.5])
def test_a_place_that_there_is_not_stays(place):
    assert index(list_of((x, y)), const(place)).index.value == place
    assert simplify(index(array("i", TWO, i), const(place))).index.value == place


def test_an_element_at_a_known_place_of_an_array_made_on_the_spot():
    assert simplify(index(array("i", const(3), mul(x, i)), TWO)) is mul(TWO, x)
    open_ended = index(element(mul(x, i)), TWO)
    assert simplify(open_ended) is open_ended  # whether there is such a place is a matter of n


def test_a_fold_without_steps():
    assert simplify(fold("i", ONE, ZERO, "state", x, mul(state, i))) is x
    assert simplify(fold("i", ONE, n, "state", x, state)) is x


def test_no_loop_is_written_out():
    total, steps = sum_("i", ONE, const(3), index(xs, i)), fold("i", ONE, const(3), "state", x, mul(state, t))
    assert simplify(total) is total
    assert simplify(steps) is steps


# Text


@pytest.mark.parametrize(
    ("term", "text"),
    [
        (element(mul(x, i)), "[x*i for i in 0..n - 1]"),
        (array("i", const(4), i), "[i for i in 0..3]"),
        (array("i", add(n, ONE), i), "[i for i in 0..n]"),
        (array("i", add(n, const(-1)), i), "[i for i in 0..n - 2]"),
        (index(xs, add(i, ONE)), "xs[i + 1]"),
        (index(index(xs, i), j), "xs[i][j]"),
        (index(add(x, y), i), "(x + y)[i]"),
        (length(xs), "len(xs)"),
        (fold("i", ZERO, LAST, "s", x, add(s, i)), "fold s = x for i in 0..n - 1 (s + i)"),
        (proj(index(xs, ZERO), 2), "xs[0].2"),
        (lam(("c",), proj(var("c"), 2)), "\\c . (c.2)"),
        (HEIGHTS, 'load("heights.csv").height'),
        (data("photo.png", "00", ""), 'load("photo.png")'),
        (fold("i'1", ZERO, LAST, "s'1", x, add(var("s'1"), var("i'1"))), "fold s = x for i in 0..n - 1 (s + i)"),
    ],
)
def test_terms_read_well(term, text):
    assert format_term(term) == text


# The oracle


def test_arrays_and_their_elements():
    squares = array("i", const(4), mul(i, i))
    assert evaluate(squares) == [0, 1, 4, 9]
    assert evaluate(index(squares, const(3))) == 9
    assert evaluate(sum_("i", ZERO, sub(length(xs), ONE), mul(index(xs, i), i)), {"xs": [5.0, 7.0, 11.0]}) == 29
    with pytest.raises(IndexError):
        evaluate(index(squares, const(4)))


def test_data_is_given():
    held = {("heights.csv", "height"): [1.5, 2.5]}
    assert evaluate(index(HEIGHTS, ONE), data=held) == 2.5


def test_a_fold_of_several_numbers():
    """Fibonacci's numbers."""
    step = tuple_((proj(state, 1), add(proj(state, 0), proj(state, 1))))
    pair = fold("i", ONE, const(30), "state", tuple_((ZERO, ONE)), step)
    assert evaluate(pair) == (832040, 1346269)


def test_the_derivative_of_a_fold():
    """t^5."""
    power = lam(("t",), fold("i", ONE, const(5), "state", ONE, mul(state, t)))
    value, slope = evaluate(app(deriv(power), (tuple_((TWO, ONE)),)))
    assert value == 32 and abs(slope - 80) < 1e-25


def test_the_dual_of_an_array_is_a_pair_of_arrays():
    squares = lam(("xs",), array("i", length(xs), mul(index(xs, i), index(xs, i))))
    values, tangents = evaluate(app(deriv(squares), (var("given"),)), {"given": ([1.0, 2.0, 3.0], [1.0, 0.0, -1.0])})
    assert values == [1, 4, 9]
    assert all(abs(a - b) < 1e-25 for a, b in zip(tangents, (2, 0, -6), strict=True))


def test_an_integral_of_an_array_and_jumps_at_its_elements():
    body = array("i", const(2), mul(add(i, ONE), bracket(sub(index(xs, i), x))))
    found = evaluate(area(body, "x"), {"xs": [0.25, 0.5]})
    assert all(abs(a - b) < 1e-25 for a, b in zip(found, (0.25, 1.0), strict=True))


def test_minus_of_an_element():
    assert format_term(neg(index(xs, i))) == "-xs[i]"
