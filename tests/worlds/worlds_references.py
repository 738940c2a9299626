"""What the tests of the worlds share: programs by name, and derivatives by differences of 60-digit values."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath as mp

import potto

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
DIGITS = 60


def program(name: str) -> potto.Module:
    return potto.load(EXAMPLES / f"{name}.po")


def dual(module: potto.Module, function: str, place: float) -> tuple[float, float]:
    """Value and derivative of a function of one number, both of which have converged."""
    found = module.eval(f"deriv({function})(({place!r}, 1))")
    assert found.converged, found.reasons
    value, tangent = found.value, found.tangent
    return float(value), float(tangent)


def reference(f: Callable[[Any], Any], place: float) -> tuple[float, float]:
    """Value and one-sided difference of a function of mpmath's numbers: off by 1e-25 times its second derivative."""
    with mp.workdps(DIGITS):
        step = mp.mpf(10) ** -25
        here = f(mp.mpf(place))
        return float(here), float((f(mp.mpf(place) + step) - here) / step)


def agrees(found: tuple[float, float], exact: tuple[float, float], tolerance: float) -> None:
    """Value and derivative, each within the tolerance of its size or of 1."""
    for got, expected in zip(found, exact):
        assert abs(got - expected) <= tolerance * max(1.0, abs(expected)), (found, exact)
