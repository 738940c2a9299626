"""Tables in text: written by the standard library and read back, and what is said of rows that are not right."""

from __future__ import annotations

import csv
import io
import time
from pathlib import Path

import pytest
from data_files import mistake, plain
from hypothesis import given
from hypothesis import strategies as st

from potto.data import DataMistake, shape_of, values_of
from potto.data.encodings import identifiers
from potto.data.files import MEMORY
from potto.data.tables import separated
from potto.data.values import NumberArray, RecordColumns, Sizes, Table
from potto.syntax.tokens import FIRST_NAME

TEXTS = ["anna", "2020-01-31", "12 kg", "naïve", "a b", "x1"]
reals = st.floats(allow_nan=False, allow_infinity=False)
boxes = st.integers(1, 5).flatmap(lambda width: st.lists(st.lists(reals, min_size=width, max_size=width), min_size=1))


def written(rows: list[list[object]], **layout: object) -> str:
    file = io.StringIO()
    csv.writer(file, **layout).writerows(rows)  # type: ignore[arg-type]
    return file.getvalue()


@given(boxes, st.sampled_from(",;\t| "), st.sampled_from(["\n", "\r\n", "\r"]), st.booleans(), st.booleans())
def test_what_is_written_is_read(rows: list[list[float]], delimiter: str, end: str, header: bool, quotes: bool) -> None:
    width = len(rows[0])
    names = [f"x{at}" for at in range(width)]
    layout = {"delimiter": delimiter, "lineterminator": end, "quoting": csv.QUOTE_ALL if quotes else csv.QUOTE_MINIMAL}
    text = written([names, *rows] if header else list(rows), **layout)
    if header:
        expected: object = {name: list(column) for name, column in zip(names, zip(*rows))}
    else:
        expected = [row[0] for row in rows] if width == 1 else rows
    assert plain("t.csv", text) == expected
    assert plain("t.CSV", "\ufeff" + text) == expected


@given(boxes, st.sampled_from(";\t|"))
def test_decimal_commas(rows: list[list[float]], delimiter: str) -> None:
    text = "\n".join(delimiter.join(repr(number).replace(".", ",") for number in row) for row in [[0.5], *rows][1:])
    if len(rows[0]) > 1:
        assert plain("t.csv", text) == rows


cells = st.one_of(
    reals.map(repr), st.sampled_from(["1_0", "inf", "nan", "", "NA", "٣", "1.", ".5", "+1", " 2 ", "x", "1e999", "#"])
)


@given(st.lists(st.lists(cells, min_size=1, max_size=3), min_size=1, max_size=4), st.sampled_from(",;\t "))
def test_both_ways_give_the_same(rows: list[list[str]], delimiter: str) -> None:
    """Quotes in a comment keep the fast way out."""
    text = "\n".join(delimiter.join(row) for row in rows)
    fast, careful = values_of(Path("t.csv"), text.encode()), values_of(Path("t.csv"), f'{text}\n# "'.encode())
    if isinstance(fast, DataMistake):
        assert fast == careful
    else:
        assert plain("t.csv", text) == plain("t.csv", f'{text}\n# "')


@given(st.binary(max_size=60))
def test_any_bytes_are_answered(content: bytes) -> None:
    for name in ("t.csv", "t.tsv", "t.json", "t.npy", "t.npz", "t.png", "t.jpg"):
        shape_of(Path(name), content)
        values_of(Path(name), content)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("5", [5.0]),
        ("1,2,3", [[1.0, 2.0, 3.0]]),
        ("x\n1\n2\n", {"x": [1.0, 2.0]}),
        ("# made today\n\n x , y\n# units: m, s\n1, 2\n  \n3,4\n\n", {"x": [1.0, 3.0], "y": [2.0, 4.0]}),
        ("a b\n1 2\n 3   4 \n", {"a": [1.0, 3.0], "b": [2.0, 4.0]}),
        ('"first name" b\n1 2\n', {"first_name": [1.0], "b": [2.0]}),
        ('"a\nb",c\n# no\n1,2\n', {"a_b": [1.0], "c": [2.0]}),
        ("total weight\n1\n2\n", {"total_weight": [1.0, 2.0]}),
        ("time (s; UTC),x\n1,2\n3,4", {"time_s_UTC": [1.0, 3.0], "x": [2.0, 4.0]}),
        ("year,2019,2020\n1,2,3", {"year": [1.0], "_2019": [2.0], "_2020": [3.0]}),
        (",a\n0,5\n1,6", {"column_1": [0.0, 1.0], "a": [5.0, 6.0]}),
        ("x,y,\n1,2,\n3,4,\n", {"x": [1.0, 3.0], "y": [2.0, 4.0]}),  # a comma at the end of each line
        ("x,x,x_2,λ\n1,2,3,4", {"x": [1.0], "x_3": [2.0], "x_2": [3.0], "_λ": [4.0]}),
        ("größe;v²\n1,5;2\n", {"größe": [1.5], "v_": [2.0]}),
        ("1,5;2,5\n3;4", [[1.5, 2.5], [3.0, 4.0]]),
        ("1,5 2,5\n3,0 4,5", [[1.5, 2.5], [3.0, 4.5]]),
        ("1\t2\n3\t4", [[1.0, 2.0], [3.0, 4.0]]),
        ("a|b\n-1e-3|+.5\n", {"a": [-0.001], "b": [0.5]}),
    ],
)
def test_layouts(text: str, expected: object) -> None:
    assert plain("t.csv", text) == expected


def test_only_tabs_separate_in_tsv() -> None:
    assert plain("t.tsv", "a, b\n1\n2") == {"a_b": [1.0, 2.0]}


def said(text: str, name: str = "t.csv") -> tuple[str, int | None, int | None, str, str]:
    found = mistake(name, text)
    return found.code, found.row, found.column, found.found, found.message


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x,y\n1,\n,2\n", ("P0803", 2, 2, "", "line 2, column `y`: there is no value")),
        ("x,y\n1,2,\n3,,\n", ("P0803", 2, None, "3", "line 2 has 3 values, but the header has 2 names")),
        ("x\n# c\n\n1\nNA\n", ("P0803", 5, 1, "NA", "line 5, column `x`: there is no value, only `NA`")),
        ("1\nnan\n", ("P0803", 2, 1, "nan", "line 2, column 1: there is no value, only `nan`")),
        ("NaN\n1\n", ("P0803", 1, 1, "NaN", "line 1, column 1: there is no value, only `NaN`")),
        ("1,-,2\n", ("P0803", 1, 2, "-", "line 1, column 2: there is no value, only `-`")),
        ("x\ty\n1\tParis\n2\t3", ("P0803", 2, 2, "Paris", "line 2, column `y`: `Paris` is text, not a number")),
        ("1,2\n3,4\n5,6,7", ("P0803", 3, None, "3", "line 3 has 3 values, but line 1 has 2")),
        ("x,y\n1,2\n3\n", ("P0803", 3, None, "1", "line 3 has 1 value, but the header has 2 names")),
        ("x,y\n1,2\n3,4\n-inf,3", ("P0803", 4, 1, "-inf", "line 4, column `x`: `-inf` is not finite")),
        ("1\n1e999", ("P0803", 2, 1, "1e999", "line 2, column 1: `1e999` is not finite")),
        ("x\n1_000", ("P0803", 2, 1, "1_000", "line 2, column `x`: `1_000` is text, not a number")),
        ("x\n٣", ("P0803", 2, 1, "٣", "line 2, column `x`: `٣` is text, not a number")),
        ("x;y\n1,5;2.5", ("P0803", 2, 1, "1,5", "line 2, column `x`: `1,5` is text, not a number")),
        ("x;y\n1.234,5;2.5", ("P0803", 2, 1, "1.234,5", "line 2, column `x`: `1.234,5` is not a number")),
        ('"a\nb",c\n1,2\n3,"x\ny"', ("P0803", 4, 2, "x\ny", "line 4, column `c`: `x y` is text, not a number")),
        ('x,y\n1,"2\n3,4', ("P0805", 2, None, "", "a quote on line 2 is not closed")),
        ('x,y\n1,"2"3\n', ("P0805", 2, None, "", "a quote on line 2 ends within a value")),
        ("x,y\n", ("P0805", None, None, "", "the file has a header and no rows")),
        ("", ("P0805", None, None, "", "the file holds no values")),
        ("# nothing\n\n", ("P0805", None, None, "", "the file holds no values")),
        ("1,2\n3,\0\n", ("P0805", 2, None, "", "line 2 holds a NUL byte: this is not text")),
    ],
)  # fmt: skip
def test_mistakes(text: str, expected: tuple[object, ...]) -> None:
    assert said(text) == expected


@pytest.mark.parametrize(
    ("text", "kept", "gaps"),
    [
        ("x,y\n1,2\n3,\n", {"x": [1.0, 3.0]}, (("y", 3),)),
        ("x,y,z\n1,NA,2\n3,nan,\n", {"x": [1.0, 3.0]}, (("y", 2), ("z", 3))),
        ("x;y\n;2.5\n;3.5\n", {"y": [2.5, 3.5]}, (("x", 2),)),
        ("x;y;who\n1,5;;Ann\n2,5;4;Bob", {"x": [1.5, 2.5]}, (("y", 2),)),
    ],
)
def test_columns_that_lack_values_are_left_out(text: str, kept: object, gaps: object) -> None:
    assert plain("t.csv", text) == kept
    found = separated(text, tabs=False)
    assert isinstance(found, Table)
    assert found.gaps == gaps


def test_tabs_alone_are_a_row_without_values() -> None:
    assert said("1\t2\n\t\n", "t.tsv") == ("P0803", 2, 1, "", "line 2, column 1: there is no value")


def test_a_long_text_is_shown_in_part() -> None:
    assert said(f"x\n{'a' * 100}")[-1] == f"line 2, column `x`: `{'a' * 39}…` is text, not a number"


def test_what_is_no_utf8() -> None:
    found = mistake("t.csv", b"x\n1\n\xe9\n")
    assert (found.code, found.row, found.found) == ("P0805", 3, "0xe9")
    assert found.message == "line 3 is not UTF-8 text: it holds the byte 0xe9"
    assert mistake("t.csv", "x\n1".encode("utf-16")).message == "this is UTF-16 text, not UTF-8"
    assert mistake("t.csv", b"\xef\xbb\xbfx\n\xff").row == 2


@given(st.lists(st.text(max_size=4), max_size=6))
def test_names_are_identifiers_and_differ(names: list[str]) -> None:
    found = identifiers(names)
    assert len(set(found)) == len(names) and all(map(FIRST_NAME.fullmatch, found))
    assert identifiers(found) == found


def test_a_late_mistake_is_found_in_a_large_file() -> None:
    rows = "x,y\n" + "1.5,2\n" * 50_000
    assert said(rows + "1,2,3\n" + rows)[:2] == ("P0803", 50_002)
    assert said(rows + "1,oops\n")[:4] == ("P0803", 50_002, 2, "oops")


@pytest.mark.slow
def test_a_hundred_thousand_rows_take_less_than_a_second() -> None:
    text = "t,x,y\n" + "".join(f"{at / 100},{at / 7},{-at / 3}\n" for at in range(100_000))
    MEMORY.clear()
    start = time.process_time()
    assert shape_of(Path("t.csv"), text.encode()) == RecordColumns(tuple((name, Sizes((100_000,))) for name in "txy"))
    assert time.process_time() - start < 0.5
    MEMORY.clear()
    start = time.process_time()
    assert plain("t.csv", text)["x"][-1] == 99_999 / 7
    assert time.process_time() - start < 1


def test_comments_within_quotes_are_none() -> None:
    assert separated('"a\n# b"\n1', tabs=False).fields[0][0] == "a_b"  # type: ignore[union-attr]


@given(boxes, st.integers(0, 5), st.lists(st.sampled_from(TEXTS), min_size=1), st.sampled_from(",;\t|"), st.booleans())
def test_columns_of_text_are_left_out(
    rows: list[list[float]], at: int, texts: list[str], delimiter: str, lacking: bool
) -> None:
    at = min(at, len(rows[0]))
    labels = [texts[n % len(texts)] for n in range(len(rows))]
    if lacking and len(rows) > 1:
        labels[0], labels[-1] = "", texts[0]
    names = [f"x{n}" for n in range(len(rows[0]))]
    named = [*names[:at], "label", *names[at:]]
    text = written([named, *([*row[:at], label, *row[at:]] for row, label in zip(rows, labels))], delimiter=delimiter)
    found = separated(text, delimiter == "\t")
    assert isinstance(found, Table)
    assert found.texts == ("label",)
    assert {name: column.values.tolist() for name, column in found.fields if isinstance(column, NumberArray)} == {
        name: list(column) for name, column in zip(names, zip(*rows))
    }


@pytest.mark.parametrize("value", ["1,5", "1_000", "1 000", "'5", "٣", "1e400", "inf"])
def test_what_is_meant_as_a_number_is_not_left_out(value: str) -> None:
    assert isinstance(values_of(Path("a.csv"), f"x;y\n{value};2.5\n{value};3.5\n".encode()), DataMistake)


def test_a_table_of_nothing_but_text_is_refused() -> None:
    assert isinstance(values_of(Path("a.csv"), b"name,city\nanna,Paris\n"), DataMistake)
