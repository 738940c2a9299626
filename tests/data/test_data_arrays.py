"""Numpy's files: what numpy writes is read, and no program within a file is run."""

from __future__ import annotations

import io
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from data_files import mistake, plain
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from potto.data import NumberArray, RealNumber, RecordColumns, Sizes, Table, shape, shape_of, values_of

DTYPES = ("<f8", ">f8", "<f4", ">f2", "|b1", "|u1", "|i1", "<i2", ">i4", "<u4", "<i8", "=f8", "longdouble")
arrays = st.sampled_from(DTYPES).flatmap(
    lambda dtype: hnp.arrays(np.dtype(dtype), hnp.array_shapes(min_dims=0, max_dims=4, max_side=4))
).filter(lambda array: bool(np.isfinite(np.asarray(array, np.float64)).all()))  # fmt: skip


def saved(array: Any, **how: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, array, **how)
    return file.getvalue()


def many(compressed: bool = False, **named: Any) -> bytes:
    file = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(file, **named)
    return file.getvalue()


@given(arrays, st.booleans())
def test_what_is_saved_is_read(array: npt.NDArray[Any], fortran: bool) -> None:
    array = np.asfortranarray(array) if fortran and array.ndim else array
    with np.errstate(over="ignore"):
        expected = np.asarray(array, np.float64)
    assert plain("a.npy", saved(array)) == expected.tolist()
    assert shape_of(Path("a.npy"), saved(array)) == (Sizes(array.shape) if array.shape else RealNumber())


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_versions(version: tuple[int, int]) -> None:
    file = io.BytesIO()
    np.lib.format.write_array(file, np.arange(6.0).reshape(2, 3), version=version)
    assert plain("a.npy", file.getvalue()) == [[0, 1, 2], [3, 4, 5]]


def test_numbers_are_aligned_wherever_they_start() -> None:
    head = b"{'descr': '<f8', 'fortran_order': False, 'shape': (2,)}"
    content = b"\x93NUMPY\x01\x00" + bytes([len(head), 0]) + head + np.array([1.0, 2.0]).tobytes()
    value = values_of(Path("a.npy"), content)
    assert isinstance(value, NumberArray) and value.values.flags.aligned and value.values.tolist() == [1, 2]


@given(st.dictionaries(st.sampled_from(["a", "b", "rate", "x y", "2"]), arrays, min_size=1, max_size=3), st.booleans())
def test_archives_are_columns(named: dict[str, npt.NDArray[Any]], compressed: bool) -> None:
    content = many(compressed, **named)
    names = {"x y": "x_y", "2": "_2"}
    with np.errstate(over="ignore"):
        expected = {names.get(key, key): np.asarray(array, np.float64).tolist() for key, array in named.items()}
    assert plain("a.npz", content) == expected


def test_the_shape_of_an_archive() -> None:
    content = many(x=np.zeros((2, 3)), n=np.float64(3))
    assert shape_of(Path("a.npz"), content) == RecordColumns((("x", Sizes((2, 3))), ("n", RealNumber())))
    table = values_of(Path("a.npz"), content)
    assert isinstance(table, Table) and table["n"] == 3 and isinstance(table["x"], NumberArray)


class Bomb:
    """Says so when it is unpickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return pytest.fail, ("a pickle was read",)


def test_nothing_is_unpickled() -> None:
    objects = np.array([Bomb(), 1], dtype=object)
    for content in (saved(objects, allow_pickle=True), pickle.dumps(Bomb())):
        found = mistake("a.npy", content)
        assert found.code == "P0805" and found.message.startswith("the file holds Python objects (a pickle)")
        assert found == shape_of(Path("a.npy"), content)
    assert mistake("a.npz", many(x=objects)).message.startswith("`x`: the file holds Python objects (a pickle)")


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros(2, complex), "the array holds complex numbers, not real numbers"),
        (np.array(["a"]), "the array holds texts, not real numbers"),
        (np.array([b"a"]), "the array holds texts, not real numbers"),
        (np.zeros(2, "M8[s]"), "the array holds dates, not real numbers"),
        (np.zeros(2, "m8[s]"), "the array holds durations, not real numbers"),
        (np.zeros(2, "V3"), "the array holds records, not real numbers"),
        (np.zeros((2, 0)), "the array holds no values: its shape is (2, 0)"),
    ],
)
def test_what_is_no_array_of_reals(array: npt.NDArray[Any], message: str) -> None:
    found = mistake("a.npy", saved(array))
    assert (found.code, found.message) == ("P0805", message)
    assert shape_of(Path("a.npy"), saved(array)) == found
    assert mistake("a.npz", many(x=array)).message == f"`x`: {message}"


@pytest.mark.parametrize(
    ("array", "row", "column", "message"),
    [
        ([1.0, np.inf], 2, None, "row 2: inf is not finite"),
        ([[1.0, 2.0], [3.0, np.nan]], 2, 2, "row 2, column 2: nan is not finite"),
        ([[[1.0, -np.inf]]], 1, 1, "entry [0, 0, 1], counted from 0: -inf is not finite"),
        (np.nan, None, None, "the number: nan is not finite"),
    ],
)
def test_what_is_not_finite(array: Any, row: int | None, column: int | None, message: str) -> None:
    found = mistake("a.npy", saved(array))
    assert (found.code, found.row, found.column, found.message) == ("P0803", row, column, message)
    for kind in ("<f2", ">f2", "<f4", ">f4", ">f8", "g"):
        assert mistake("a.npy", saved(np.asarray(array, kind))) == found
    parts = np.ones(np.shape(array), [("a", "i2"), ("x", ">f4"), ("y", "f8", 2)])
    finite = values_of(Path("a.npy"), saved(parts))
    assert isinstance(finite, Table) and shape_of(Path("a.npy"), saved(parts)) == shape(finite)
    parts["x"] = array
    assert mistake("a.npy", saved(parts)).message == f"`x`: {message}"
    inside = mistake("a.npz", many(x=array))
    assert (inside.row, inside.column, inside.message) == (row, column, f"`x`: {message}")


@given(st.data())
def test_damaged_files_are_answered(data: st.DataObject) -> None:
    content = data.draw(st.sampled_from([saved(np.eye(3)), many(x=np.eye(3)), many(True, x=np.eye(9), y=np.arange(3))]))
    at, byte = data.draw(st.integers(0, len(content) - 1)), data.draw(st.integers(0, 255))
    changed = content[:at] + bytes([byte]) + content[at + 1 :]
    for damaged in (changed, content[:at]):
        for name in ("a.npy", "a.npz"):
            shape_of(Path(name), damaged)
            values_of(Path(name), damaged)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.npy", b"", "the file is empty"),
        ("a.npy", b"1,2\n3,4\n and more", "the file is not an NPY file: it does not start like one"),
        ("a.npy", saved(np.eye(3))[:-1], "the file ends too early: it has 199 bytes where its head promises 200"),
        ("a.npy", b"\x93NUMPY\x09\x00\x00\x00\x00\x00\x00", "the file is of version 9 of NPY, which is not known"),
        ("a.npy", saved(np.eye(3)).replace(b"{", b"(", 1), "the head of the NPY file is broken"),
        ("a.npy", saved(np.eye(3)).replace(b"(3, 3)", b"(3,-3)", 1), "the head of the NPY file is broken"),
        ("a.npy", b"\x93NUMPY\x02\x00\xff\xff\xff\x7f", "the head of the NPY file is too long: 2147483659 bytes"),
        ("a.npz", b"", "the file is not an NPZ file: file is not a zip file"),
        ("a.npz", saved(np.eye(3)), "the file is not an NPZ file: file is not a zip file"),
        ("a.npz", many(), "the file holds no arrays"),
    ],
)
def test_malformed_files(name: str, content: bytes, message: str) -> None:
    found = mistake(name, content)
    assert (found.code, found.message) == ("P0805", message)
    assert shape_of(Path(name), content) == found


def test_other_files_in_an_archive() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("notes.txt", "hello")
    assert mistake("a.npz", file.getvalue()).message == "`notes.txt` within the file is not an array"


def test_elements_with_names_are_a_table() -> None:
    """Part by part, whatever the kinds, also where each part is several numbers."""
    array = np.array([(1, [2.5, 3.0]), (4, [5.0, 6.0])], [("x", "i2"), ("at 0", "<f4", (2,))])
    content = saved(array)
    assert shape_of(Path("a.npy"), content) == RecordColumns((("x", Sizes((2,))), ("at_0", Sizes((2, 2)))))
    found = values_of(Path("a.npy"), content)
    assert isinstance(found, Table)
    assert [found[name].values.tolist() for name in ("x", "at_0")] == [[1, 4], [[2.5, 3], [5, 6]]]
    array["at 0"][1, 0] = np.nan
    wrong = mistake("a.npy", saved(array))
    assert (wrong.row, wrong.column, wrong.message) == (2, 1, "`at 0`: row 2, column 1: nan is not finite")
    assert mistake("a.npy", saved(np.zeros(2, [("x", complex)]))).message.startswith("`x`: the array holds complex")
    assert mistake("a.npz", many(x=array)).message == "`x`: the array holds records, not real numbers"
