"""Long and deep programs: no stack overflows, and no time that grows faster than the program (but for small powers)."""

from __future__ import annotations

import time

import pytest
from marks import FOLDER, database, diagnostics, only, type_of

from potto.types import format_type, interface

LONG = {
    "a chain": "def f(x) " + " + ".join(f"x*{n}" for n in range(1, 5000)),
    "brackets": "def f(x) integral [0, 1] (" + " + ".join(f"[y < x*{n}]" for n in range(1, 2000)) + ") d(y)",
    "nesting": "def f(x) " + "(1 + sin(" * 18 + "x" + ")^2)" * 18,
    "applied lambdas": "def f(x) " + "(\\y . 1 + (" * 18 + "x" + "))(1)" * 18,
    "local names": "def f(x)\n    u0 = x\n"
    + "".join(f"    u{n} = u{n - 1} + 1\n" for n in range(1, 1000)) + "    u999",
    "local functions": "def f(x)\n    u0 = \\y . y + x\n"
    + "".join(f"    u{n} = \\y . u{n - 1}(u{n - 1}(y)) + 1\n" for n in range(1, 300))
    + "    u299(x)",
    "definitions": "f0 = \\x . x + 1\n" + "".join(f"def f{n}(x) f{n - 1}(f{n - 1}(x))\n" for n in range(1, 600))
    + "def f(x) f599(x)",
    "definitions upwards": "def f(x) f599(x)\n"
    + "".join(f"def f{n}(x) f{n - 1}(f{n - 1}(x))\n" for n in range(599, 0, -1))
    + "f0 = \\x . x + 1",
    "functions of functions": "def f0(g, x) g(x)\n"
    + "".join(f"def f{n}(g, x) f{n - 1}(\\z . g(z) + f{n - 1}(g, z), x)\n" for n in range(1, 40))
    + "def f(x) f39(sin, x)",
    "conditions": "def f(x) " + "".join(f"if [x > {n}] then {n} else (" for n in range(40)) + "0" + ")" * 40,
}  # fmt: skip


@pytest.mark.parametrize("name", LONG)
def test_long_programs(name: str) -> None:
    db = database(LONG[name])
    started = time.process_time()
    assert [d for _, d in diagnostics(db) if d.severity == "error"] == []
    assert time.process_time() - started < 5  # some 0.3 s on a quiet machine
    assert format_type(interface(db, FOLDER + "main.po", "f").type).endswith("-> Real")


def test_many_groups() -> None:
    assert type_of("def f(x) " + "".join(f"\\y{n} . " for n in range(60)) + "x + 1").count("->") == 61


def test_a_long_way_is_shown_in_short() -> None:
    lets = "; ".join(f"u{n} = u{n - 1} + 1" for n in range(1, 300))
    found = only(f"def f(t)\n    integral [0, 1] (let u0 = x; {lets} in if u299 > t then 1 else 0) d(x)")
    assert found.code == "P0301" and 2 < len(found.related) < 12
    assert found.related[0].message == "`x` is bound here" and found.related[-1].message == "`u299` is defined here"


def test_a_tuple_that_doubles() -> None:
    lines = "".join(f"    u{n} = (u{n - 1}, u{n - 1})\n" for n in range(1, 40))
    text = f"def f(x)\n    u0 = (x, x)\n{lines}    u39"
    assert {d.code for _, d in diagnostics(database(text))} == {"P0325"}
