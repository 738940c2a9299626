"""What an expert writes by hand for `throughput`: in numpy here, in C in `throughput_by_hand.c`.

Owns the functions of both, under one name each, and the pictures that they are asked for. Every function gives values
and derivatives as rows of one array.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

ROOT = np.sqrt(2.0)
SIDE = 512
TRIANGLE = (0.13, 0.21, 0.83, 0.37, 0.41, 0.91)  # counterclockwise; no edge along an axis
X, W = (0.5 * (np.polynomial.legendre.leggauss(8)[0] + 1), 0.5 * np.polynomial.legendre.leggauss(8)[1])
CHUNK = 128

Rows = Any


def pixels(side: int = SIDE) -> tuple[Rows, Rows]:
    """The lower left corners of the pixels of the unit square, row by row."""
    x, y = np.meshgrid(np.arange(side) / side, np.arange(side) / side)
    return x.ravel(), y.ravel()


# A mean over random points, a chunk at a time that stays in the cache


def smooth_samples(c: float, n: int) -> tuple[float, float]:
    """The mean of exp(-c x y) over n points of the unit square, and its standard error."""
    return _sampled(lambda x, y: np.exp(-c * x * y), n)


def cut_samples(c: float, n: int) -> tuple[float, float]:
    """The same of eq. (1), which jumps."""
    return _sampled(lambda x, y: np.where(x + y + c >= 0, 1 / (ROOT * (x + y + c) + 2) ** 2, 0.0), n)


def _sampled(integrand: Callable[[Rows, Rows], Rows], n: int) -> tuple[float, float]:
    random, total, squares = np.random.default_rng(0), 0.0, 0.0
    for start in range(0, n, 1 << 13):
        values = integrand(*random.random((2, min(1 << 13, n - start))))
        total, squares = total + values.sum(), squares + values @ values
    mean = total / n
    return mean, float(np.sqrt(max(squares / n - mean * mean, 0.0) / n))


# Eq. (1), quadratic shader s(z) = 1/(sqrt(2) z + 2)^2, z = x + y + c >= 0, over the square of side h with z = c at its
# corner: Gauss rules on the part where the edge cuts lines along y, and on the part where it does not


def half_plane(c: Rows, h: float = 1.0) -> Rows:
    """Values and derivatives by c, (2, n)."""
    out = np.empty((2, c.size))
    for start in range(0, c.size, CHUNK):
        at = slice(start, start + CHUNK)
        out[:, at] = _half_planes(c[at] / h, h)
    return out


def _half_planes(c: Rows, h: float) -> Rows:
    first, last = np.clip(-c - 1, 0, 1), np.clip(-c, 0, 1)
    value, rate = 0.0, (last - first) / 4 * h
    for a, b, below in ((first, last, True), (last, np.ones_like(c), False)):
        x = a[:, None] + (b - a)[:, None] * X
        low = (np.clip(-c[:, None] - x, 0, 1) if below else np.zeros_like(x))[:, :, None]
        w = 1 / (ROOT * h * (c[:, None, None] + x[:, :, None] + low + (1 - low) * X) + 2)
        weight = ((b - a)[:, None] * W)[:, :, None] * W * (1 - low)
        s = w * w * weight
        value = value + s.sum(axis=(1, 2)) * h * h
        rate = rate - (2 * ROOT * h * h) * (s * w).sum(axis=(1, 2))
    return value, rate


def picture(c: float) -> Rows:
    """Pixels of eq. (1): those that are cut as above, the others by 16 nodes, (2, n)."""
    x, y = pixels()
    h, z = 1 / SIDE, x + y + c
    out, nodes = np.zeros((2, z.size)), np.polynomial.legendre.leggauss(4)
    cut = np.nonzero((z < 0) & (z > -2 * h))[0]
    out[:, cut] = half_plane(z[cut], h)
    for at in np.array_split(np.nonzero(z >= 0)[0], 16):
        value, rate = np.zeros(at.size), np.zeros(at.size)
        for u, p in zip(*nodes, strict=True):
            for v, q in zip(*nodes, strict=True):
                w = 1 / (ROOT * (z[at] + h * (1 + (u + v) / 2)) + 2)
                s = w * w * (p * q * h * h / 4)
                value += s
                rate -= 2 * ROOT * s * w
        out[0, at], out[1, at] = value, rate
    return out


def disc(r: float) -> Rows:
    """Pixels of the disc about (1/2, 1/2) of radius sqrt(r), and derivatives by r, (2, n)."""
    x, y = pixels()
    h = 1 / SIDE
    a, b = (np.minimum(np.abs(p - 0.5), np.abs(p + h - 0.5)) for p in (x, y))  # by symmetry, in one quarter
    out = np.zeros((2, x.size))
    out[0, (a + h) ** 2 + (b + h) ** 2 <= r] = h * h
    cut = np.nonzero((a * a + b * b < r) & ((a + h) ** 2 + (b + h) ** 2 > r))[0]
    x, y = a[cut], b[cut]
    left, right = (np.clip(np.sqrt(np.maximum(r - e * e, 0)), x, x + h) for e in (y + h, y))

    def under(x: Rows) -> Rows:
        return (x * np.sqrt(np.maximum(r - x * x, 0)) + r * np.arcsin(np.minimum(x / np.sqrt(r), 1))) / 2

    out[0, cut] = (left - x) * h + under(right) - under(left) - y * (right - left)
    out[1, cut] = (np.arcsin(np.minimum(right / np.sqrt(r), 1)) - np.arcsin(np.minimum(left / np.sqrt(r), 1))) / 2
    return out


def pairs(corners: Rows, x: Rows, y: Rows, h: float) -> Rows:
    """Areas of triangles (6, n) in squares at x, y with derivatives by the coordinates of the corners, (7, n)."""
    out = np.zeros((7, x.size))
    for i, j in ((0, 2), (2, 4), (4, 0)):
        ax, ay, bx, by = corners[i], corners[i + 1], corners[j], corners[j + 1]
        dx, dy = bx - ax, by - ay
        s, t = ((p - q) / d for p, q, d in ((x, ax, dx), (y, ay, dy)))
        s2, t2 = s + h / dx, t + h / dy
        lo, hi = np.clip(np.minimum(s, s2), 0, 1), np.clip(np.maximum(s, s2), 0, 1)
        up, down = (_ramp(ay + e * dy - y, h) for e in (hi, lo))
        out[0] -= dx * (up - down) / dy
        lo, hi = np.maximum(lo, np.minimum(t, t2)), np.minimum(hi, np.maximum(t, t2))
        hi = np.maximum(lo, hi)
        second = (hi * hi - lo * lo) / 2
        first = hi - lo - second
        for at, weight in ((i, first), (j, second)):
            out[1 + at] += dy * weight
            out[2 + at] -= dx * weight
    return out


def _ramp(y: Rows, h: float) -> Rows:
    """The integral of min(max(y, 0), h)."""
    inside = np.clip(y, 0, h)
    return inside * inside / 2 + h * np.maximum(y - h, 0)


def triangle(t: float) -> Rows:
    """Pixels of the triangle, moved by t along x, and derivatives by t, (2, n)."""
    x, y = pixels()
    found = pairs([e + t * (i % 2 == 0) for i, e in enumerate(TRIANGLE)], x, y, 1 / SIDE)
    return np.stack((found[0], found[1] + found[3] + found[5]))


def kernel(x: Rows, y: Rows, c: float, out: Rows, work: Rows) -> None:
    """The shader and its derivative by c at points, into (2, n)."""
    np.add(x, y, out=work)
    np.add(work, c, out=work)
    np.multiply(work, ROOT, out=work)
    np.add(work, 2.0, out=work)
    np.divide(1.0, work, out=work)
    np.multiply(work, work, out=out[0])
    np.multiply(out[0], work, out=out[1])
    np.multiply(out[1], -2 * ROOT, out=out[1])


# C


@lru_cache(maxsize=1)
def compiled() -> Any:
    """The functions in C, by `cc -O3 -march=native`; None where there is no compiler."""
    found = shutil.which("cc")
    if found is None:
        return None
    source = Path(__file__).with_name("throughput_by_hand.c")
    folder = Path(tempfile.mkdtemp())
    flags = ["-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-shared", "-fPIC"]
    done = subprocess.run([found, *flags, str(source), "-o", str(folder / "by_hand.so"), "-lm"], capture_output=True)
    if done.returncode:
        return None
    library = ctypes.CDLL(str(folder / "by_hand.so"))
    shutil.rmtree(folder)
    return library


def in_c(name: str, out: Rows, *arguments: Any) -> Callable[[], Rows] | None:
    """A call of a function in C that fills `out`; numbers are doubles, arrays pointers, n comes first."""
    library = compiled()
    if library is None:
        return None
    function = getattr(library, name)
    function.restype = None
    given: list[Any] = [ctypes.c_long(out.shape[-1])]
    for x in (*arguments, out):
        given.append(ctypes.c_void_p(x.ctypes.data) if isinstance(x, np.ndarray) else ctypes.c_double(x))

    def run(kept: Any = (arguments, out)) -> Rows:
        function(*given)
        return kept[1]

    return run
