"""Machine code that does two or four cells at a time, where there are no more: right, and the same as with eight."""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp
import pytest

import potto
from potto.integrate.fixed import straight
from potto.integrate.fixed.proved_sums import alone
from potto.kernels.making import counts

pytest.importorskip("llvmlite")

# Integrands of a variable #, and integrals of them from 0.
INTEGRANDS: dict[str, Callable[[mp.mpf], mp.mpf]] = {
    "exp(-#)": lambda x: 1 - mp.exp(-x),
    "log(1 + #)": lambda x: (1 + x) * mp.log(1 + x) - x,
    "sin(#)": lambda x: 1 - mp.cos(x),
    "cos(#)": mp.sin,
    "sin(200000 + #)": lambda x: mp.cos(200000) - mp.cos(200000 + x),  # too far for the polynomials
    "erf(#)": lambda x: x * mp.erf(x) + (mp.exp(-x * x) - 1) / mp.sqrt(mp.pi),  # by the C library
    "1/(1 + #)^2": lambda x: x / (1 + x),
    "sqrt(1 + #)": lambda x: 2 * (mp.sqrt(1 + x) ** 3 - 1) / 3,
}


def bands(integrand: str, variable: str, cells: int) -> str:
    """From t/2 to t, t/4 to t/3 and so on, at u = 1."""
    sides = " + ".join(f"{(-1) ** (k + 1)}*[u*{variable} < t/{k}]" for k in range(1, 2 * cells + 1))
    return f"def f(t, u) integral [0, 2] {integrand.replace('#', variable)}*({sides}) d({variable})"


def noted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Of how many cells it is asked how many are to be done at a time, where cells are not those of step functions."""
    monkeypatch.setattr(straight, "FEW_CUTS", straight.MOST_CUTS)
    asked, lanes = list[int](), alone._lanes

    def asking(count: int) -> int:
        asked.append(count)
        return lanes(count)

    monkeypatch.setattr(alone, "_lanes", asking)
    return asked


@pytest.mark.parametrize("cells", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("integrand", list(INTEGRANDS))
def test_few_cells_are_right(integrand: str, cells: int, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = noted(monkeypatch)
    slope = potto.grad(potto.compile(bands(integrand, "x", cells)).f, "t")
    with potto.settings(backend="native"):
        before = counts.native_points
        found = [slope(0.75, 1.0) for _ in range(3)][-1]
    assert counts.native_points > before and set(asked) == {cells}
    with mp.workdps(30):
        whole, t = INTEGRANDS[integrand], mp.mpf(0.75)
        value = sum((-1) ** (k + 1) * whole(t / k) for k in range(1, 2 * cells + 1))
        rate = sum((-1) ** (k + 1) * mp.diff(whole, t / k) / k for k in range(1, 2 * cells + 1))
        assert abs(found.value - value) <= found.error < 1e-10
        assert abs(found.tangent - rate) <= found.tangent_error < 1e-10


@pytest.mark.parametrize("cells", [1, 3])
@pytest.mark.parametrize("integrand", ["exp(-#)", "cos(#)", "1/(1 + #)^2"])
def test_not_a_bit_is_another(integrand: str, cells: int, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[tuple[float, ...]] = []
    asked = noted(monkeypatch)
    for parameter in "ts":  # else one plan would do for both
        program = bands(integrand, "y", cells).replace("t/", f"{parameter}/").replace("(t,", f"({parameter},")
        slope = potto.grad(potto.compile(program).f, parameter)
        with potto.settings(backend="native"):
            found = [slope(t, 1.0) for t in (0.85, 0.86, 0.85)][-1]
        told.append((found.value, found.error, found.tangent, found.tangent_error))
        monkeypatch.setattr(alone, "NARROW", ())
    assert len(asked) == 2 and told[0] == told[1]
