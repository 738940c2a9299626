"""The studies that the paper's prototype was published with (github.com/divicomp/potto_applications), in Potto.

Owns `STUDIES`: a pixel under a triangle whose colour is linear or quadratic, beside the figures that were published of
it; more and more jumps, each moved by a parameter of its own; shaders swapped under 90 of them. Each is an iterator of
lines of a table. Answers are held to closed forms before they have a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

import numpy as np
from paper_programs import CORNERS, EDGE, LINEAR, MASK, QUADRATIC, SHARES, with_shares
from paper_timing import Compiled, size, timed

import potto

Pair = tuple[float, float]  # a value and a slope

# What its authors plot as the paper's third figure (benchmarks/rasterization_plotter.py there), on a machine that they
# do not name. Sizes are nodes of syntax of the derivative.
PUBLISHED = {
    "linear": (
        Compiled("  the prototype, as published", 0.0156, 0.4471, 3315),
        Compiled("  Teg, as published", 1.375, 1.1158, 11712),
    ),
    "quadratic": (
        Compiled("  the prototype, as published", 0.0163, 0.4571, 3507),
        Compiled("  Teg, as published", 7.1918, 3.613, 56511),
    ),
}

# Two corners move to the right by t, and with them the side between them, the diagonal of the pixel, of which half is
# covered. The linear colour is 1 everywhere; the quadratic one is 4 u v with the shares of these corners, which are
# u = (6 - 2t + 4x - (1 + t) y)/(15 + 3t) and v = (6 + 2t - x + (4 + t) y)/(15 + 3t); over x + y < 1 + t that is
# rational.
TRIANGLE = (2.0, -1.0, -1.0, 2.0, -2.0, -2.0)
ALONG = (1.0, 0.0, 1.0, 0.0, 0.0, 0.0)
PIXELS = {
    "linear": (LINEAR, ("p", "q", "r"), (1.0, 1.0, 1.0), (1 / 2, 1.0)),
    "quadratic": (QUADRATIC, ("p", "q", "r", "f", "g", "k"), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0), (577 / 1350, 5321 / 6750)),
}


def pixels() -> Iterator[Compiled]:
    """A triangle in a pixel: value and slope, ours measured and those of others as they were published."""
    for kind, (shade, names, colours, exact) in PIXELS.items():
        head = f"def pixel({', '.join((*CORNERS, *names))})"
        text = f"{EDGE}{SHARES}{head}\n    integral ([0, 1], [0, 1]) {MASK} * {with_shares(shade)} d(x, y)\n"
        duals = [*zip(TRIANGLE, ALONG, strict=True), *((c, 0.0) for c in colours)]
        yield _measured(
            f"{kind} colour, Potto", text, lambda m, duals=duals: _pair(potto.deriv(m.pixel)(*duals)), exact
        )
        yield from PUBLISHED[kind]


def _pair(found: potto.Estimate) -> Pair:
    return float(found.value), float(found.tangent)


def _measured(name: str, text: str, call: Callable[[potto.Module], Pair], exact: Pair) -> Compiled:
    """From its text to value and slope, and these once more. Raises ValueError if they are wrong."""

    def first() -> potto.Module:
        module = potto.compile(text)
        call(module)
        return module

    whole, module = timed(first)
    again, found = timed(lambda: call(module), 5)
    return Compiled(name, max(whole - again, 0.0), again, size(module), _off(name, found, exact))


def _off(name: str, found: Pair, exact: Pair) -> float:
    """As a part of its size, or of 1."""
    off = max(abs(a - b) / max(1.0, abs(b)) for a, b in zip(found, exact, strict=True))
    if not off < 1e-11:
        raise ValueError(f"{name} is off by {off:.1e}")
    return off


SWAPS = (0, 1, 5)  # how many are told of
SUMMED = """
def jumps(a: [n] Real, shader)
    integral [-1, 1] sum i in 0..n - 1 ([x + a[i] > 0] * shader(a[i], x)) d(x)
"""


def written(n: int, term: str = "shader(a{0}, x)") -> str:
    """The same for n jumps, without a loop; with a term in place of the shader a whole program."""
    names = [f"a{i}" for i in range(n)] + ["shader"] * (term == "shader(a{0}, x)")
    terms = " + ".join(f"[x + a{i} > 0] * {term.format(f'{i}')}" for i in range(n))
    return f"def jumps({', '.join(names)})\n    integral [-1, 1] {terms} d(x)\n"


def _places(n: int) -> Any:
    return 1 / np.arange(10, 10 + n)


def _exact(n: int, k: float) -> Pair:
    """Of a + k x between -a and 1, and the slope if all a grow alike."""
    a = _places(n)
    return float((a * (1 + a) + k * (1 - a**2) / 2).sum()), float((1 + 2 * a - k * a).sum())


def _shaded(module: potto.Module, n: int, shader: str) -> Pair:
    """Value and slope under a shader, of the sum over an array or of the program without a loop."""
    given, function = potto.deriv(getattr(module, shader)), potto.deriv(module.jumps)
    if "a" in module.jumps.parameters:
        return _pair(function((_places(n), np.ones(n)), given))
    return _pair(function(*((a, 1.0) for a in _places(n)), given))


def _sum(pairs: Iterable[Pair]) -> Pair:
    value, slope = (sum(part) for part in zip(*pairs, strict=True))
    return value, slope


def jumps() -> Iterator[Compiled]:
    """n conditionals that a parameter each moves, under two shaders: as a sum over an array, and written one by one."""
    shaders = "first = \\(a, x) . a + x\nsecond = \\(a, x) . a - x\n"
    for n in (1, 10, 50):
        exact = _sum(_exact(n, k) for k in (1.0, -1.0))
        for name, text in (("in a sum", SUMMED), ("one by one", written(n))):

            def both(module: potto.Module, n: int = n) -> Pair:
                return _sum(_shaded(module, n, shader) for shader in ("first", "second"))

            yield _measured(f"{n} {'jump' if n == 1 else 'jumps'}, {name}", text + shaders, both, exact)


def swaps() -> Iterator[Compiled]:
    """Shaders under 90 jumps: the first, then each after another; and programs that have them written in."""
    n, slopes = 90, [1.0 + k / 8 for k in range(SWAPS[-1] + 1)]
    for name, text in (("in a sum", SUMMED), ("one by one", written(n))):
        shaders = "".join(f"s{k} = \\(a, x) . a + {slope} * x\n" for k, slope in enumerate(slopes))
        module, passed = potto.compile(text + shaders), []
        for k, slope in enumerate(slopes):
            call = partial(_shaded, module, n, f"s{k}")
            whole, _ = timed(call)
            again, found = timed(call)
            off = _off(name, found, _exact(n, slope))
            passed.append(Compiled(name, max(whole - again, 0.0), again, 0, off))
            if k in SWAPS:
                yield _added(f"{_counted(k)}, {name}", passed, size(module))
    passed = []
    for k, slope in enumerate(slopes):
        text = written(n, f"(a{{0}} + {slope} * x)")
        duals = [(a, 1.0) for a in _places(n)]
        passed.append(_measured("", text, lambda m, duals=duals: _pair(potto.deriv(m.jumps)(*duals)), _exact(n, slope)))
        if k in SWAPS:
            yield _added(f"{_counted(k)}, whole programs", passed, sum(part.size for part in passed))


def _counted(k: int) -> str:
    return "no swap" if k == 0 else "a swap" if k == 1 else f"{k} swaps"


def _added(name: str, parts: list[Compiled], terms: int) -> Compiled:
    return Compiled(
        name, sum(p.compiling for p in parts), sum(p.evaluating for p in parts), terms, max(p.off for p in parts)
    )


STUDIES = {
    "pixels": ("a triangle in a pixel, as the prototype was measured (the paper's third figure)", pixels),
    "jumps": ("more and more jumps, each with a parameter of its own, under two shaders", jumps),
    "swaps": ("shaders swapped under 90 jumps: all of them together", swaps),
}
