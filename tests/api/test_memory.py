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


def test_a_call_leaves_nothing_to_the_garbage_collector() -> None:
    """Not even one that finds out what is new of a region of parameters: what nothing refers to any more is gone at
    once, however much memory it holds."""
    f = potto.compile("def f(c) integral ([0, 1], [0, 1]) 1/(sqrt(2)*(x + y + c) + 2)^2*[x + y + c >= 0] d(x, y)").f
    f(-0.7)
    gc.collect()
    gc.disable()
    gc.set_debug(gc.DEBUG_SAVEALL)
    try:
        for c in (-0.4, -0.3):
            f(c)
        gc.collect()
        left = [thing for thing in gc.garbage if type(thing).__module__.startswith("potto")]
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.enable()
    assert not left
