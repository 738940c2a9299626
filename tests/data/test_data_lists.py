"""JSON: what the standard library writes is read, and places are told by path and line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from data_files import mistake, plain
from hypothesis import given
from hypothesis import strategies as st

from potto.data import Table, shape_of, values_of
from potto.data.lists import nested
from potto.data.mistakes import DataRefused
from potto.data.values import NumberArray

reals = st.floats(allow_nan=False, allow_infinity=False)
numbers = st.one_of(reals, st.integers(-(2**53), 2**53))


def box(dimensions: tuple[int, ...]) -> st.SearchStrategy[Any]:
    found: st.SearchStrategy[Any] = numbers
    for length in reversed(dimensions):
        found = st.lists(found, min_size=length, max_size=length)
    return found


boxes = st.lists(st.integers(1, 3), max_size=4).map(tuple).flatmap(box)


@given(boxes, st.sampled_from([None, 1]))
def test_what_is_written_is_read(data: Any, indent: int | None) -> None:
    assert plain("d.json", json.dumps(data, indent=indent)) == data


@given(st.dictionaries(st.sampled_from("abcdef"), boxes, min_size=1))
def test_objects_are_columns(data: dict[str, Any]) -> None:
    found = plain("d.json", json.dumps(data))
    assert found == data and list(found) == list(data)


@given(st.integers(1, 3), st.dictionaries(st.sampled_from("abc"), boxes, min_size=1))
def test_objects_in_a_list_are_rows(count: int, row: dict[str, Any]) -> None:
    assert plain("d.json", json.dumps([row] * count)) == {name: [entry] * count for name, entry in row.items()}


@given(st.integers(1, 3), st.integers(1, 2), st.dictionaries(st.sampled_from("abc"), boxes, min_size=1))
def test_objects_within_objects_are_tables_within_tables(count: int, inner: int, row: dict[str, Any]) -> None:
    data = [{"p": row, "q": [row] * inner, "name": "a"}] * count
    found = plain("d.json", json.dumps({"rows": data}))["rows"]
    columns = {name: [entry] * count for name, entry in row.items()}
    assert found == {"p": columns, "q": {name: [[entry] * inner] * count for name, entry in row.items()}}


def test_texts_are_left_out() -> None:
    rows = [
        {"id": "a", "x": 1, "at": {"unit": "mm", "y": 2}, "tags": ["u"]},
        {"id": None, "x": 3, "at": {"unit": "m", "y": 4}, "tags": []},
    ]
    found = values_of(Path("d.json"), json.dumps(rows).encode())
    assert isinstance(found, Table) and found.texts == ("id", "tags")
    assert isinstance(at := found["at"], Table) and at.texts == ("unit",)
    assert plain("d.json", json.dumps(rows)) == {"x": [1, 3], "at": {"y": [2, 4]}}


@pytest.mark.parametrize(
    ("text", "kept", "gaps"),
    [
        ('{"x": 1,\n"y": null}', {"x": 1}, (("y", 2),)),
        ('[{"x": 1, "y": 2},\n{"x": 3,\n"y": null},\n{"x": 5, "y": null}]', {"x": [1, 3, 5]}, (("y", 3),)),
        ('{"x": [[1, 2], [3, 4]],\n"y": [[1, 2],\n[null, 4]], "z": ["a", null]}', {"x": [[1, 2], [3, 4]]}, (("y", 3),)),
        ('[{"x": 1, "p": {"y": 1}},\n{"x": 2, "p": null}]', {"x": [1, 2]}, (("p", 2),)),
        ('{"x": 1, "y": "null", "z": 2}', {"x": 1, "z": 2}, ()),
    ],
)
def test_what_lacks_values_is_left_out(text: str, kept: object, gaps: object) -> None:
    found = values_of(Path("d.json"), text.encode())
    assert isinstance(found, Table) and found.gaps == gaps
    assert plain("d.json", text) == kept


def test_an_object_within_one_leaves_out_what_it_lacks() -> None:
    text = '{"camera": {"focal": 35,\n"gain": null}, "x": 1}'
    found = values_of(Path("d.json"), text.encode())
    assert isinstance(found, Table) and found.gaps == ()
    assert isinstance(camera := found["camera"], Table) and camera.gaps == (("gain", 2),)
    assert plain("d.json", text) == {"camera": {"focal": 35}, "x": 1}


@given(
    st.recursive(
        st.one_of(numbers, st.none(), st.booleans(), st.text(max_size=2)),
        lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=2), inner)),
    )
)
def test_any_json_is_answered(data: Any) -> None:  # fmt: skip
    shape_of(Path("d.json"), json.dumps(data, indent=1).encode())


@pytest.mark.parametrize(
    ("text", "code", "row", "column", "message"),
    [
        ("[1,\n2,\nNaN]", "P0803", 3, 3, "line 3, `[2]`: nan is not finite"),
        ("-Infinity", "P0803", 1, None, "line 1: -inf is not finite"),
        ('{"a": [[1, 2],\n[3, 1e999]]}', "P0803", 2, 2, "line 2, `a[1][1]`: inf is not finite"),
        ("[[1, 2],\n [3]]", "P0803", 2, 2, "line 2, `[1]`: the list has 1, but those before it have 2 values"),
        ("[[1], 2]", "P0803", 1, 2, "line 1, `[1]`: a number stands among lists"),
        ("[1,\n [2]]", "P0803", 2, 2, "line 2, `[1]`: a list stands among numbers"),
        ('[1, "x, ]"]', "P0803", 1, 2, "line 1, `[1]`: `x, ]` is a text, not a number"),
        ("[true]", "P0803", 1, 1, "line 1, `[0]`: this is true or false, not a number"),
        ("[1,\nnull]", "P0803", 2, 2, "line 2, `[1]`: this is null, not a number"),
        ('{"y": null}', "P0803", 1, None, "line 1, `y`: this is null, not a number"),
        ('[{"x": "a", "y": null}]', "P0803", 1, 1, "line 1, `[0].x`: `a` is a text, not a number"),
        ('[{"x": 1},\n{"x": null}]', "P0803", 2, 2, "line 2, `[1].x`: this is null, not a number"),
        ('[{"x": 1},\n{"y": 2}]', "P0803", 2, 2, "line 2, `[1]`: the object has `y`, and the first one `x`"),
        ('[{"x": 1},\n7]', "P0803", 2, 2, "line 2, `[1]`: this stands among objects"),
        ("[{}]", "P0805", None, None, "the file holds no values: its objects are empty"),
        ('{"x": [{"y": 1}, 2]}', "P0803", 1, 2, "line 1, `x[1]`: this stands among objects"),
        (
            '[{"p": {"y": 1}},\n{"p": {"z": 2}}]',
            "P0803",
            2,
            2,
            "line 2, `[1].p`: the object has `z`, and the first one",
        ),
        ('[{"p": [{"y": [1]}]},\n{"p": [{"y": [1,\n null]}]}]', "P0803", 2, 1, "line 2, `[1].p[0].y`: the list has 2"),
        ('[{"p": [{"y": [1]}]},\n{"p": [{"y": [\nnull]}]}]', "P0803", 3, 1, "line 3, `[1].p[0].y[0]`: this is null"),
        ('[{"x": "a"},\n{"x": "2"}]', "P0803", 1, 1, "line 1, `[0].x`: `a` is a text, not a number"),
        ('[{"x": 1, "y": "1"}]', "P0803", 1, 1, "line 1, `[0].y`: `1` is a text, not a number"),
        ('{"x": [1], "y": [[]]}', "P0803", 1, 1, "line 1, `y[0]`: the list is empty"),
        ("[]", "P0803", 1, None, "line 1: the list is empty"),
        ("{}", "P0805", None, None, "the file holds no values: its object is empty"),
        ('{"x": 1, "x": 2}', "P0805", None, None, "an object has the name `x` twice"),
        ("[1,\n2,]", "P0805", 2, None, "line 2 is not JSON: "),
        (" \n", "P0805", None, None, "the file holds no values"),
        ("[" * 40 + "1" + "]" * 40, "P0805", None, None, "lists are nested more than 32 deep"),
        ("[" * 100_000, "P0805", None, None, "lists are nested more than 32 deep"),
    ],
)
def test_mistakes(text: str, code: str, row: int | None, column: int | None, message: str) -> None:
    found = mistake("d.json", text)
    assert (found.code, found.row, found.column) == (code, row, column)
    assert found.message.startswith(message)


def test_large_whole_numbers() -> None:
    assert plain("d.json", "[1" + "0" * 300 + ", 2]") == [1e300, 2.0]
    assert mistake("d.json", "1" + "0" * 5000).message == "line 1: inf is not finite"


@pytest.mark.parametrize(
    "text",
    [
        "[-0, 0, -0.0]",
        "[0, 5e-324, 2.2250738585072011e-308, 1.7976931348623157e308, 0.1e-6, 123456789012345678901234567890]",
        '{"a:b": [1, 2.5], "c": {"d": [[1], [2]]}}',  # a colon that stands in a name
        '[{"x": 1, "y": 1e23}, {"x": 9007199254740993, "y": -3}]',
    ],
)
def test_numbers_are_those_that_python_reads(text: str) -> None:
    """Bit by bit, also where a whole number is too large for a double to have all its digits."""

    def flat(value: object) -> list[float]:
        if isinstance(value, dict):
            return [number for item in value.values() for number in flat(item)]
        return [number for item in value for number in flat(item)] if isinstance(value, list) else [value]  # type: ignore[list-item]

    def told(value: object) -> list[float]:
        if isinstance(value, Table):
            return [number for _, item in value.fields for number in told(item)]
        return [*value.numbers] if isinstance(value, NumberArray) else [value]  # type: ignore[list-item]

    known = json.loads(text, parse_int=float)
    if isinstance(known, list) and isinstance(known[0], dict):
        known = {name: [entry[name] for entry in known] for name in known[0]}
    assert [*map(float.hex, told(nested(text)))] == [*map(float.hex, flat(known))]


def test_a_name_that_is_given_twice_is_told_among_many() -> None:
    with pytest.raises(DataRefused) as refused:
        nested('[{"x": 1}, {"x": 1, "x": 2}]')
    assert "twice" in refused.value.mistake.message
