"""What a module takes goes with it."""

from __future__ import annotations

import gc
import weakref

import potto

TEXT = """
def brightness(x, c) c*x
def seen(t, c) integral ([0, 1], [0, 1]) brightness(x, c)*[x + y < t]*[x*x + y < c] d(x, y)
def many(t, xs) sum x in xs (integral [0, 1] ([u*x < t] + [u < x*t]) d(u))
"""


def test_a_module_that_is_dropped_is_forgotten() -> None:
    module = potto.compile(TEXT)
    potto.grad(module.seen, ["t", "c"])(0.3, 0.4)
    potto.grad(module.many, ["t"])(0.3, [0.2, 0.5, 0.9])
    programs = weakref.ref(module.seen._world)
    del module
    gc.collect()
    assert programs() is None
