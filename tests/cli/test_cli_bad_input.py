"""Input of every bad kind: a diagnostic or a right answer; never a traceback, a hang or silence."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from command_runs import Potto

LENGTH = "def f(t)\n    integral [0, 1] [x < t] d(x)\n"

BAD = {
    "binary": (bytes(range(256)) * 10, "P0209"),
    "utf16": ("def f(t) t\n".encode("utf-16"), "P0209"),
    "nul": (b"def f(t)\x00 t\n", "P01"),
    "ten_megabytes_in_a_line": (b"a = " + b"x" * 10_000_000 + b"\n", "P01"),
    "open_bracket": (b"def f(t)\n    (t + 1\n", "P01"),
    "closing_bracket": (b"def f(t) t))\n", "P01"),
    "nested": (b"def f(t) " + b"(" * 10_000 + b"t" + b")" * 10_000 + b"\n", "P01"),
    "nested_open": (b"def f(t) " + b"(" * 10_000 + b"\n", "P01"),
    "nested_minus": (b"def f(t) " + b"-" * 10_000 + b"t\n", "P01"),
    "nested_power": (b"def f(t) " + b"^".join([b"t"] * 5_000) + b"\n", "P01"),
    "endless": (b"def f(n) f(n + 1)\nprint(f(1))\n", "P0"),
    "itself": (b"a = a\nprint(a)\n", "P0"),
    "only_junk": (b"??? !!! ;;;\n", "P01"),
}


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("command", ["check", "run", "fmt", "test"])
def test_bad_files_get_a_diagnostic(potto: Potto, tmp_path: Path, name: str, command: str) -> None:
    data, code = BAD[name]
    (tmp_path / "bad.po").write_bytes(data)
    ran = potto(command, "bad.po")
    said = ran.out + ran.err
    if command == "fmt" and name in ("endless", "itself"):  # well-formed, only without a meaning
        assert ran.status == 0
        return
    assert ran.status == 1 and f"error[{code}" in said
    assert (tmp_path / "bad.po").read_bytes() == data
    assert max(map(len, said.splitlines())) < 400


@pytest.mark.parametrize("command", ["check", "run", "fmt", "test", "eval", "deriv", "dump"])
def test_no_file_and_a_folder_for_a_file(potto: Potto, tmp_path: Path, command: str) -> None:
    (tmp_path / "folder.po").mkdir()
    (tmp_path / "main.po").write_text(LENGTH)
    for name in ("mian.po", "folder.po", "main.po/below.po"):
        before = ["core"] if command == "dump" else []
        after = ["f"] if command in ("eval", "deriv") else []
        ran = potto(command, *before, name, *after)
        walks = name == "folder.po" and command in ("check", "fmt", "test")  # these take folders, but this one is empty
        assert ran.status == 1 and f"error[{'P0230' if walks else 'P0208'}]" in ran.out + ran.err
        if name == "mian.po":
            assert "did you mean `main.po`?" in ran.out + ran.err


@pytest.mark.parametrize("command", ["eval", "deriv", "render", "fit", "view"])
def test_a_file_that_comes_second(potto: Potto, tmp_path: Path, command: str) -> None:
    (tmp_path / "main.po").write_text(LENGTH)
    start = ["x=1"] if command == "fit" else []
    ran = potto(command, "1 + 1" if command == "eval" else "f", "main.po", *start)
    swapped = "'1 + 1'" if command == "eval" else "f"
    assert ran.status == 1 and f"the file comes first: `main.po {swapped}`" in ran.err


GOOD = {
    "empty": (b"", ""),
    "comment": (b"# nothing\n", ""),
    "no_newline": (b"print(2)", "2\n"),
    "tabs": (b"def f(t)\n\tintegral [0, 1]\n\t\t[x < t] d(x)\nprint(f(0.25))\n", "0.25\n"),
    "windows": (b"def f(t)\r\n    integral [0, 1] [x < t] d(x)\r\nprint(f(0.25))\r\n", "0.25\n"),
    "byte_order_mark": (b"\xef\xbb\xbfdef f(t) t\nprint(f(3))\n", "3\n"),
    "greek": ("def f(θ) 2*θ\nprint(f(2))\n".encode(), "4\n"),
    # 0 + 1 + ... + 4999
    "sum_of_5000": (b"def f(t) " + b" + ".join(b"%d*t" % i for i in range(5000)) + b"\nprint(f(1))\n", "12497500\n"),
    "1000_names": (
        b"def f(t)\n" + b"".join(b"    a%d = %s + 1\n" % (i, b"a%d" % (i - 1) if i else b"t") for i in range(1000))
        + b"    a999\nprint(f(1))\n",
        "1001\n",
    ),
    "300_definitions": (
        b"def f0(t) t\n" + b"".join(b"def f%d(t) f%d(t) + 1\n" % (i, i - 1) for i in range(1, 300))
        + b"print(f299(1))\n",
        "300\n",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", GOOD)
def test_odd_but_right_files(potto: Potto, tmp_path: Path, name: str) -> None:
    data, out = GOOD[name]
    (tmp_path / "odd.po").write_bytes(data)
    ran = potto("run", "odd.po")
    assert (ran.status, ran.out) == (0, out), ran.err


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("f(0/0)", "nan"),
        ("f(inf)", 1.0),
        ("f(-inf)", 0.0),
        ("integral [1, 0] x^2 d(x)", -1 / 3),
        ("integral [2, 2] exp(x) d(x)", 0.0),
        ("integral [0, inf] exp(-x) d(x)", 1.0),
        ("integral [-inf, inf] exp(-x^2) d(x)", math.sqrt(math.pi)),
        ("1/0", "inf"),
        ("sqrt(-1)", "nan"),
    ],
)
def test_numbers_at_the_edge(potto: Potto, expression: str, value: float | str) -> None:
    ran = potto("eval", "--json", "main.po", expression, main=LENGTH)
    assert ran.status == 0, ran.out
    if isinstance(value, str):
        assert ran.json["value"] == value
    else:
        # what was asked for by default, and a little for rounding where the value is 0
        assert math.isclose(ran.json["value"], value, rel_tol=1e-10, abs_tol=1e-13)
        assert ran.json["converged"]
