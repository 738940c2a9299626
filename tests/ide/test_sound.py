"""Whether the terms of a definition mean something: not if anything that it needs is wrong, however far away."""

from __future__ import annotations

import pytest
from ide_fixture import fixture

from potto.ide.hover.derivatives import is_sound


@pytest.mark.parametrize(
    ("program", "expected"),
    [
        (
            "def f(t) nowhere\ndef g(t) f(t)\ndef h(t) g(t)\ndef k(t) t\n",
            {"f": False, "g": False, "h": False, "k": True},
        ),
        ("def f(t) g(t)\ndef g(t) h(t)\ndef h(t) t(1, 2) + t\n", {"f": False, "g": False, "h": False}),
        ("def f(t) if t < 0 then 0 else g(t - 1)\ndef g(t) f(t)\ndef h(t) g(t)\n", {"f": True, "g": True, "h": True}),
        (
            "def f(t) if t < 0 then 0 else g(t - 1)\ndef g(t) f(t) + nowhere\ndef h(t) f(t)\ndef k(t) sin(t)\n",
            {"f": False, "g": False, "h": False, "k": True},
        ),
        (
            "def f(t) if t < 0 then 0 else deriv(f)((t, 1))\ndef g(t) f(t)\ndef h(t) deriv(sin)((t, 1))\n",
            {"f": False, "g": False, "h": True},
        ),
        ("def f(t) integral [0, 1] (if x < t then 1 else 0) d(x)\ndef g(t) f(t) + 1\n", {"f": False, "g": False}),
        ("def f(\ndef g(t) f(t)\ndef h(t) t\n", {"g": False, "h": True}),
    ],
)  # fmt: skip
def test_what_needs_something_wrong_is_wrong(program: str, expected: dict[str, bool]) -> None:
    f = fixture(program)
    for order in (expected, dict(reversed(expected.items()))):
        fresh = fixture(program)
        assert {name: is_sound(fresh.db, fresh.file, name) for name in order} == order
    text = f.text()
    f.library.files.set_text(f.file, text.replace("nowhere", "t"))
    fresh = fixture(text.replace("nowhere", "t"))
    for name in expected:
        assert is_sound(f.db, f.file, name) == is_sound(fresh.db, fresh.file, name)


def test_through_modules() -> None:
    low = "# file: a.po\ndef f(t) nowhere\ndef g(t) t\n"
    f = fixture(low + "# file: b.po\nfrom a import f, g\ndef h(t) f(t)\ndef k(t) g(t)\n")
    assert (is_sound(f.db, f.file, "h"), is_sound(f.db, f.file, "k")) == (False, True)


def test_a_long_chain() -> None:
    chain = "def f0(t) t\n" + "".join(f"def f{i}(t) f{i - 1}(t) + 1\n" for i in range(1, 400))
    for text, expected in ((chain, True), (chain.replace("f0(t) t", "f0(t) nowhere"), False)):
        f = fixture(text)
        assert is_sound(f.db, f.file, "f399") is expected
