"""A chain of definitions costs what grows with its text, to check and at its first call: what one call leads to is
carried out once, however deep it is."""

from __future__ import annotations

import pytest
from call_counts import calls_in

import potto

KINDS = {
    "in the condition": "def f{0}(x, t) if [f{1}(x, t) > {0}/100] then x + t else x - t",
    "as a bracket": "def f{0}(x, t) [f{1}(x, t) + x > {0}/100]",
    "a state": "def f{0}(x, t) 0.8*f{1}(x, t) + 0.5*[f{1}(x, t) < t]",
    "an integral in the condition": "def f{0}(x, t) x*(integral [0, 1] [y < f{1}(t, t)] d(y))",
    "a product": "def f{0}(x, t) f{1}(x, t)*[f{1}(x, t) > t]",
}


def chain(kind: str, n: int) -> str:
    lines = [f"def f0(x, t) x*t + {n}", *(KINDS[kind].format(i, i - 1) for i in range(1, n + 1))]
    return "\n".join((*lines, f"def g(t) integral [0, 1] f{n}(x, t) d(x)"))


def calls(source: str) -> int:
    """How many functions are called while a program is checked."""
    return calls_in(lambda: potto.compile(source))


@pytest.mark.parametrize("kind", KINDS)
def test_twice_as_long_a_chain_takes_about_twice_as_long_to_check(kind: str) -> None:
    calls(chain(kind, 3))
    few, many = calls(chain(kind, 24)), calls(chain(kind, 48))
    assert many <= 2.6 * few  # the text is 2.1 times as long


def test_twice_as_long_a_chain_takes_about_twice_as_long_to_call() -> None:
    def first(n: int) -> int:
        program = potto.compile(chain("a state", n))
        return calls_in(lambda: program.g(0.5))

    first(3)
    few, many = first(40), first(80)
    assert many <= 2.3 * few
