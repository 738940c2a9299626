"""Conditions on fractions: numerators are solved where denominators vary too, and every pole turns the sign.

The truth is measured by mpmath between all roots of the numerator multiplied out by hand and all poles.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest

import potto

LO, HI = -1.0, 3.0

# The condition; the numerator's coefficients and the poles as functions of t; what has to be positive.
LINES: dict[str, tuple[str, Callable, Callable, Callable]] = {
    "two poles": (
        "1/(x - t) + 1/(x - 1) > 2",
        lambda t: [-2, 2 + 2 * (t + 1), -(t + 1) - 2 * t],
        lambda t: [t, 1],
        lambda x, t: 1 / (x - t) + 1 / (x - 1) - 2,
    ),
    "affine over affine": (
        "((x - t)/(x + 2*t))^2 + (3/(x + 2*t))^2 > 4",
        lambda t: [1 - 4, -2 * t - 16 * t, t**2 + 9 - 16 * t**2],
        lambda t: [-2 * t],
        lambda x, t: ((x - t) ** 2 + 9) / (x + 2 * t) ** 2 - 4,
    ),
    "through a function": (
        "q(x, t)*q(x, t) - 2*q(x, t)/x < 1",
        lambda t: [2 * t - 2, 6 * t - 3 * t**2, -4 * t**2],
        lambda t: [2 * t, 0],
        lambda x, t: 1 + 2 * (x - t) / (x - 2 * t) / x - ((x - t) / (x - 2 * t)) ** 2,
    ),
    "a fraction of fractions": (
        "(1/x + t)/(1/x - 1/(x - t)) < x/2",
        lambda t: [t, 1 - t * t + t / 2, -t],  # (1 + t*x)*(x - t)/(-t) < x/2
        lambda t: [0, t],
        lambda x, t: x / 2 - (1 / x + t) / (1 / x - 1 / (x - t)),
    ),
    "a common factor": (
        "(x^2 - t^2)/(x - t) + 1/(x - t) > 3",
        lambda t: [1, -3, 1 - t**2 + 3 * t],
        lambda t: [t],
        lambda x, t: (x * x - t * t + 1) / (x - t) - 3,
    ),
    "negative powers": (
        "(x - t)^(-2) + (x - t)^(-1)*x > t",
        lambda t: [1 - t, -t + 2 * t * t, 1 - t**3],
        lambda t: [t],
        lambda x, t: (x - t) ** -2 + x / (x - t) - t,
    ),
}


def measured(name: str, t: mp.mpf) -> mp.mpf:
    _, coefficients, poles, positive = LINES[name]
    with mp.workdps(50):
        top = [mp.mpf(c) for c in coefficients(t)]
        while top[0] == 0:
            top = top[1:]
        roots = mp.polyroots(top[::-1], asc=True, maxsteps=500, extraprec=200)
        places = [mp.re(r) for r in roots if abs(mp.im(r)) < mp.mpf(10) ** -30]
        inside = sorted(p for p in (*places, *map(mp.mpf, poles(t))) if LO < p < HI)
        ends = [mp.mpf(LO), *inside, mp.mpf(HI)]
        return sum((b - a for a, b in pairwise(ends) if b > a and positive((a + b) / 2, t) > 0), mp.mpf(0))


@pytest.mark.parametrize("t", [0.3, 0.7, -0.45, 1.9])
@pytest.mark.parametrize("name", LINES)
def test_every_root_and_every_pole_counts(name: str, t: float) -> None:
    source = f"def q(x, t) (x - t)/(x - 2*t)\ndef f(t) integral [{LO}, {HI}] [{LINES[name][0]}] d(x)"
    answer = potto.deriv(potto.compile(source).f)((t, 1.0))
    with mp.workdps(50):
        value = float(measured(name, mp.mpf(t)))
        slope = float(mp.diff(lambda s: measured(name, s), mp.mpf(t), h=mp.mpf(10) ** -20))
    assert answer.converged
    assert abs(answer.value - value) <= answer.error + 1e-15 * HI
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-13 * max(1.0, abs(slope))
    assert answer.error <= 1e-11
    assert answer.tangent_error <= 1e-9 * max(1.0, abs(slope))


LAMP = """
def lamp(x, y, s, th)
    c = 2/(1 - 0.3*x - 0.1*y)
    lx = s - c*x
    ly = 0.4 - c*y
    lz = 1.2 - c
    [1/(pi*(lx*lx + ly*ly + lz*lz)) > th]
def multiplied(x, y, s, th)
    w = 1 - 0.3*x - 0.1*y
    [w*w > th*pi*((s*w - 2*x)^2 + (0.4*w - 2*y)^2 + (1.2*w - 2)^2)]
def quotient(u, v, s, th) integral ([u, u + 1/8], [v, v + 1/8]) lamp(x, y, s, th) d(x, y)
def product(u, v, s, th) integral ([u, u + 1/8], [v, v + 1/8]) multiplied(x, y, s, th) d(x, y)
def lit(s, th) integral ([-4, 8], [-4, 4]) lamp(x, y, s, th) d(x, y)
"""


def test_a_lamp_over_a_plane_seen_through_a_pinhole_lights_a_conic() -> None:
    """Both forms cost the same; what they come to is the area of the ellipse, by its matrix."""
    m, (u, v) = potto.compile(LAMP), np.meshgrid(np.arange(8) / 8, np.arange(8) / 8)
    found = [potto.deriv(f)((u, 0.0), (v, 0.0), (0.5, 1.0), (0.35, 0.0)) for f in (m.quotient, m.product)]
    assert found[0].converged
    assert found[0].evals <= 1.2 * found[1].evals
    assert np.all(abs(found[0].value - found[1].value) <= found[0].error + found[1].error)
    assert np.all(abs(found[0].tangent - found[1].tangent) <= found[0].tangent_error + found[1].tangent_error)


def ellipse(s: mp.mpf, th: mp.mpf) -> mp.mpf:
    """The area where w^2 > th pi |M (x, y, 1)|^2, as that of a conic with its matrix."""
    w = mp.matrix([[-mp.mpf(0.3), -mp.mpf(0.1), 1]])
    lamp = (s, mp.mpf(0.4), mp.mpf(1.2))
    rows = [place * w - 2 * mp.eye(3)[i, :] for i, place in enumerate(lamp)]
    form = th * mp.pi * sum((r.T * r for r in rows), mp.zeros(3)) - w.T * w
    small = form[:2, :2]
    return mp.pi * -mp.det(form) / mp.det(small) ** mp.mpf(1.5)


def test_the_area_of_such_a_conic() -> None:
    answer = potto.deriv(potto.compile(LAMP).lit)((0.5, 1.0), (0.35, 0.0))
    with mp.workdps(40):
        s, th = mp.mpf(0.5), mp.mpf(0.35)
        value, slope = float(ellipse(s, th)), float(mp.diff(lambda p: ellipse(p, th), s))
    assert answer.converged
    assert abs(answer.value - value) <= answer.error + 1e-15 * value
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-14 * abs(slope)
    assert answer.error <= 1e-10 * value


# dot(n, l) is 2 - dot(n, lamp), however it is written; so |l|^2 is less than a number.
SHADED = """
def shade(x, y, s, th)
    c = 2/(1 - 0.3*x - 0.1*y)
    lx = s - c*x
    ly = 0.4 - c*y
    lz = 1.2 - c
    d2 = lx^2 + ly^2 + lz^2
    [(0.3*lx + 0.1*ly - lz)/(sqrt(0.3^2 + 0.1^2 + 1)*{}) > th]
def lit(s, th) integral ([-4, 8], [-4, 4]) shade(x, y, s, th) d(x, y)
"""
SHADERS = {"sqrt(d2)": 0.5, "sqrt(d2)*d2": 1.5, "d2": 1.0}


@pytest.mark.parametrize("below", SHADERS)
def test_a_cosine_over_a_power_of_the_distance_lights_a_conic_too(below: str) -> None:
    def area(s: mp.mpf, th: mp.mpf) -> mp.mpf:
        normal = (-mp.mpf(0.3), -mp.mpf(0.1), mp.mpf(1))
        lamp = (s, mp.mpf(0.4), mp.mpf(1.2))
        cosine = (2 - mp.fdot(normal, lamp)) / mp.sqrt(mp.fdot(normal, normal))
        return ellipse(s, 1 / (mp.pi * (cosine / th) ** (1 / mp.mpf(SHADERS[below]))))

    at = 0.94389 / 1.2 ** SHADERS[below]  # |l|^2 is less than about 1.2
    answer = potto.deriv(potto.compile(SHADED.format(below)).lit)((0.5, 1.0), (at, 0.0))
    with mp.workdps(40):
        s, th = mp.mpf(0.5), mp.mpf(at)
        value, slope = float(area(s, th)), float(mp.diff(lambda p: area(p, th), s))
    assert answer.converged
    assert answer.evals <= 3_000  # closed roots: nothing is searched for
    assert abs(answer.value - value) <= answer.error + 1e-14 * value
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-13 * abs(slope)
    assert answer.error <= 1e-10 * value
