"""Laws of sizes: what holds for some numbers unifies in any order, and what does not is found out."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from potto.types.format import format_type
from potto.types.types import ANY_SIZE, REAL, ArrayOf, Count, Meta, Shifted, Type, resolve, shifted
from potto.types.unify import unify

# Numbers that the sizes stand for: so large that no offset takes one below 0, where sizes stop.
NUMBERS = st.lists(st.integers(20, 30), min_size=2, max_size=5)
OFFSETS = st.integers(-4, 4)


@st.composite
def equations(draw: st.DrawFn) -> tuple[list[int], list[tuple[int, int, int]]]:
    """Numbers, and pairs of them with what is added to the first: `size of a + offset` against `size of b + …`."""
    numbers = draw(NUMBERS)
    place = st.integers(0, len(numbers) - 1)
    return numbers, draw(st.lists(st.tuples(place, place, OFFSETS), min_size=1, max_size=8))


def sides(metas: list[Meta], numbers: list[int], a: int, b: int, offset: int) -> tuple[Type, Type]:
    """The two sides of an equation that holds for the numbers, made before anything is known about them."""
    other = numbers[a] + offset - numbers[b]
    left = Shifted(metas[a], offset) if offset else metas[a]
    right = Shifted(metas[b], other) if other else metas[b]
    return left, right


@given(equations())
def test_what_holds_for_some_numbers_unifies_in_any_order(system):
    numbers, pairs = system
    for order in (pairs, pairs[::-1]):
        metas = [Meta(1, size="n") for _ in numbers]
        made = [sides(metas, numbers, *pair) for pair in order]
        assert all(unify(left, right) for left, right in made)
        assert all(unify(right, left) for left, right in made)  # what is known stays so


@given(equations(), st.data())
def test_a_number_that_is_known_makes_those_known_that_hang_on_it(system, data):
    numbers, pairs = system
    metas = [Meta(1, size="n") for _ in numbers]
    first = data.draw(st.integers(0, len(numbers) - 1))
    known = {first}
    for left, right in [sides(metas, numbers, *pair) for pair in pairs]:
        assert unify(left, right)
    for _ in numbers:  # what hangs on the first one, found by going from size to size
        known |= {y for a, b, _ in pairs for x, y in ((a, b), (b, a)) if x in known}
    assert unify(metas[first], Count(numbers[first]))
    for place in known:
        assert shifted(metas[place], 0) == Count(numbers[place])
        assert not unify(metas[place], Count(numbers[place] + 1))
        assert format_type(ArrayOf(Shifted(metas[place], -1), REAL)) == f"[{numbers[place] - 1}] Real"


@given(OFFSETS.filter(bool), st.booleans())
def test_no_size_is_larger_than_itself(offset, turned):
    n, m = Meta(1, size="n"), Meta(1, size="m")
    assert unify(n, m)
    pair = (m, Shifted(n, offset))
    assert not unify(*(pair[::-1] if turned else pair))


@given(st.integers(0, 9), st.integers(0, 9))
def test_numbers_are_equal_or_not(a, b):
    assert unify(Count(a), Count(b)) == (a == b)
    assert unify(ArrayOf(Count(a), REAL), ArrayOf(Count(b), REAL)) == (a == b)


@given(st.integers(0, 9), OFFSETS)
def test_any_size_fits_all(number, offset):
    for size in (Count(number), Shifted(Meta(1, size="n"), offset), ANY_SIZE):
        assert unify(size, ANY_SIZE) and unify(ANY_SIZE, size)


def test_a_size_is_not_less_than_nothing():
    n = Meta(1, size="n")
    assert not unify(Shifted(n, 2), Count(1))
    assert resolve(n) is n
