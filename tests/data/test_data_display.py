"""Values in a line, and as small pictures."""

from __future__ import annotations

import struct
import zlib
from array import array

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from potto.data import Item, NumberArray, NumberRow, RealNumber, Table, summary, thumbnail


def of(values: object, item: Item | None = None) -> NumberArray:
    numbers = np.asarray(values, np.float64)
    item = item or RealNumber()
    dimensions = numbers.shape if isinstance(item, RealNumber) else numbers.shape[:-1]
    return NumberArray(dimensions, item, array("d", numbers.ravel().tolist()))


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (3.25, "3.25"),
        (of([1, 2, 3]), "[3] from 1 to 3, mean 2 ▁▅█"),
        (of(range(8)), "[8] from 0 to 7, mean 3.5 ▁▂▃▄▅▆▇█"),
        (of([[1, 1], [1, 1]]), "[2, 2] all 1 ▁▁▁▁"),
        (of(np.arange(48)), "[48] from 0 to 47, mean 23.5 ▁▁▁▂▂▂▃▃▃▄▄▄▅▅▅▆▆▆▇▇▇███"),
        (of([[0, 0, 0], [1, 1, 1]], NumberRow(3)), "[2] of rows of 3 from 0 to 1, mean 0.5 ▁█"),
        (of([1e308, 1.5e308, -1e308]), "[3] from -1e+308 to 1.5e+308, mean 5e+307 ▇█▁"),
        (Table((("x", of([1, 2])), ("n", 3.0))), "x [2] from 1 to 2, mean 1.5 ▁█; n 3"),
        (Table(tuple((name, 1.0) for name in "abcdef")), "a 1; b 1; c 1; d 1; and 2 more"),
    ],
)
def test_summaries(value: float | NumberArray | Table, expected: str) -> None:
    assert summary(value) == expected


@given(
    hnp.arrays(
        np.float64, hnp.array_shapes(max_dims=3, max_side=40), elements=st.floats(allow_nan=False, allow_infinity=False)
    )
)
def test_summaries_are_short_lines(numbers: np.ndarray) -> None:  # fmt: skip
    shown = summary(of(numbers))
    assert "\n" not in shown and "nan" not in shown and "inf" not in shown
    assert 1 <= sum(char in "▁▂▃▄▅▆▇█" for char in shown) <= 24


def pixels(png: bytes | None) -> np.ndarray:
    """The bytes of a picture that has one part and no filters."""
    assert png is not None
    width, height, depth, colour = struct.unpack(">IIBB", png[16:26])
    (size,) = struct.unpack(">I", png[33:37])
    channels = {0: 1, 2: 3}[colour]
    lines = np.frombuffer(zlib.decompress(png[41 : 41 + size]), np.uint8).reshape(height, 1 + channels * width)
    assert depth == 8 and not lines[:, 0].any()
    return lines[:, 1:].reshape(height, width, channels)


def test_thumbnails_keep_their_proportions() -> None:
    assert pixels(thumbnail(of(np.ones((100, 1000))))).shape == (6, 64, 1)
    assert pixels(thumbnail(of(np.ones((1000, 3))))).shape == (64, 1, 1)
    assert pixels(thumbnail(of(np.zeros((65, 65, 3)), NumberRow(3)))).shape == (64, 64, 3)
    assert pixels(thumbnail(of(np.ones((2, 3))))).tolist() == [[[255]] * 3] * 2


def test_thumbnails_show_the_mean_of_what_falls_to_a_pixel() -> None:
    stripes = np.tile([0.0, 1.0], (128, 64))
    assert (pixels(thumbnail(of(stripes))) == 128).all()


def test_other_numbers_are_shown_from_the_least_to_the_greatest() -> None:
    assert pixels(thumbnail(of([[-5.0, 0.0], [5.0, 5.0]]))).ravel().tolist() == [0, 128, 255, 255]
    assert pixels(thumbnail(of([[7.0, 7.0]]))).ravel().tolist() == [0, 0]
    assert pixels(thumbnail(of([[-1.7e308, 1.7e308]]))).ravel().tolist() == [0, 255]


def test_what_is_no_picture_has_no_thumbnail() -> None:
    for value in (1.0, of([1, 2]), of(np.ones((2, 2, 2))), of(np.ones((2, 2, 4)), NumberRow(4)), Table((("x", 1.0),))):
        assert thumbnail(value) is None
