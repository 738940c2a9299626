"""What is packed comes back equal; what is not ours, or no data, does not come at all."""

from __future__ import annotations

import math
from contextlib import suppress
from fractions import Fraction
from typing import Any

import msgspec
import pytest
from core_terms import terms
from hypothesis import given
from hypothesis import strategies as st

from potto.core.packing import keep, packed, recall, unpacked
from potto.core.terms import const, lam, prim, var
from potto.kernels.written import Written
from potto.projects.settings import BAD_SETTING as KIND

plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary() | st.fractions(),
    lambda parts: st.lists(parts) | st.lists(parts).map(tuple) | st.dictionaries(st.text(), parts),
    max_leaves=20,
)


def same(a: Any, b: Any) -> bool:
    """Equal with nan, signs of zeros and types."""
    return repr(a) == repr(b)


@given(value=plain)
def test_data_comes_back(value: object) -> None:
    assert same(unpacked(packed(value)), value)


@given(term=terms())
def test_terms_come_back_as_the_same_objects(term: Any) -> None:
    assert unpacked(packed(term)) is term
    assert unpacked(packed((term, [term], {"a": term}))) == (term, [term], {"a": term})


def test_a_shared_subterm_is_packed_once() -> None:
    """2^200 leaves, 201 terms: 20 bytes each are enough."""
    term: Any = var("x")
    for _ in range(200):
        term = prim("add", term, term)
    assert len(packed(term)) < 201 * 20 and unpacked(packed(term)) is term


WRITTEN = Written("a", b"", {"f": "sqrt"}, {"o": (1, 2)}, True)


@pytest.mark.parametrize("value", [WRITTEN, KIND, frozenset({"a"}), 2**200, -(2**200), Fraction(1, 3)])
def test_structs_kinds_sets_and_long_numbers(value: object) -> None:
    found = unpacked(packed(value))
    assert found == value and type(found) is type(value)
    if value is KIND:
        assert found is value  # compared by identity where it is asked for


def test_floats_come_back_to_the_last_bit() -> None:
    for value in (0.1, -0.0, math.inf, 5e-324, 1.7976931348623157e308):
        assert unpacked(packed(value)).hex() == value.hex()
    assert unpacked(packed(const(0.1))).value.hex() == (0.1).hex()


class Stranger(msgspec.Struct):
    x: int


@pytest.mark.parametrize("value", [len, object(), Stranger(1), 1j, (1, {2: print})])
def test_what_is_no_data(value: object) -> None:
    with pytest.raises((TypeError, LookupError)):
        packed(value)
    keep("test", b"no data", value)
    assert recall("test", b"no data") is None


@given(data=st.binary(max_size=200))
def test_bytes_of_others(data: bytes) -> None:
    with suppress(ValueError):
        unpacked(data)


@pytest.mark.parametrize("name", ["os:system", "potto.store:put", "potto.nothing:A", "potto.source:Nothing", "potto:x"])
def test_nothing_but_structs_of_ours_is_made(name: str) -> None:
    with pytest.raises(ValueError, match="not a value"):
        unpacked(msgspec.msgpack.encode([[name], [], [5, 0, "echo"]]))


def test_kept_and_recalled() -> None:
    value = (lam(("x",), prim("mul", var("x"), const(2.0))), 0.1)
    keep("test", b"key", value)
    assert recall("test", b"key") == value and recall("test", b"another") is None
