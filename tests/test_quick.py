"""A `value` is what a frozen dataclass with slots would be."""

from __future__ import annotations

import copy
import pickle
from dataclasses import dataclass
from typing import Any

import pytest

from potto.quick import replace, value


@value
class Pair:
    """Doc."""

    x: int
    y: str = "a"

    def both(self) -> str:
        return self.y * self.x


@value
class Nothing:
    pass


@value
class One:
    x: object

    def __repr__(self) -> str:
        return "one"


@dataclass(frozen=True, slots=True)
class Model:
    x: int
    y: str = "a"


def test_it_is_made_compared_hashed_and_shown_by_its_fields() -> None:
    assert Pair(2) == Pair(x=2, y="a") != Pair(2, "b") and Pair(2) != Model(2) and Nothing() == Nothing() != One(1)
    assert hash(Pair(2)) == hash(Pair(x=2)) and len({Pair(2), Pair(2), Pair(3)}) == 2
    assert repr(Pair(2)) == "Pair(x=2, y='a')" and repr(One(3)) == "one" and repr(Nothing()) == "Nothing()"
    assert Pair(3, "b").both() == "bbb" and Pair.__doc__ == "Doc." and Pair.__match_args__ == Model.__match_args__


def test_a_nan_is_equal_to_itself_as_in_a_tuple() -> None:
    nan = float("nan")
    assert One(nan) == One(nan) and One(nan) != One(float("nan"))


@pytest.mark.parametrize("change", [lambda v: setattr(v, "x", 1), lambda v: delattr(v, "x"), lambda v: v.nothing])
def test_it_is_frozen(change: Any) -> None:
    with pytest.raises(AttributeError):
        change(Pair(2))
    with pytest.raises((AttributeError, TypeError)):
        Pair(2).z = 3


@pytest.mark.parametrize("arguments", [(), (1, "a", 3)])
def test_its_fields_are_asked_for(arguments: Any) -> None:
    with pytest.raises(TypeError):
        Pair(*arguments)


def test_it_is_copied_and_pickled() -> None:
    for v in (Pair(2), One((1, "b")), Nothing()):
        assert pickle.loads(pickle.dumps(v)) == v == copy.deepcopy(v)
    assert replace(Pair(2), y="c") == Pair(2, "c") and replace(Model(2), x=3) == Model(3)
