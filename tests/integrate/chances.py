"""What measures give to the numbers below a place, by Potto, against their distributions by mpmath.

Owns `check_chances`.
"""

from __future__ import annotations

from collections.abc import Callable

from mpmath import mp

import potto

Cdf = Callable[..., mp.mpf]


def check_chances(measure: str, names: tuple[str, ...], cdf: Cdf, values: tuple[float, ...], method: str) -> None:
    """The chance of what is below t, and its derivative by t and each parameter, which are the `values` in this order:
    by quadrature within their errors and 14 digits, those no more than 1e-9 and 1e-8; by samples within five errors."""
    module = _program(measure, names)
    with mp.workdps(40), potto.settings(method=method, samples=20_000, seed=11):
        exact = [mp.mpf(v) for v in values]
        _check(module.f(*values), cdf(*exact), method, 1e-9)
        for place, name in enumerate(("t", *names)):
            order = tuple(int(i == place) for i in range(len(values)))
            _check(getattr(module, f"d_{name}")(*values), mp.diff(cdf, tuple(exact), order), method, 1e-8)


def _program(measure: str, names: tuple[str, ...]) -> potto.Module:
    every = ("t", *names)
    lines = [f"def f({', '.join(every)}) integral (x ~ {measure}) [x < t] d(x)"]
    for name in every:
        moved = ", ".join(f"({n}, {int(n == name)})" for n in every)
        lines.append(f"def d_{name}({', '.join(every)}) snd(deriv(f)({moved}))")
    return potto.compile("\n".join(lines) + "\n")


def _check(found: potto.Estimate, wanted: mp.mpf, method: str, rel: float) -> None:
    off, size = abs(mp.mpf(float(found)) - wanted), max(1, abs(wanted))
    if method == "quadrature":
        assert off <= found.error + 1e-14 * size and off <= rel * size, (found, wanted)
    else:
        assert off <= 5 * found.error + 1e-9, (found, wanted)
