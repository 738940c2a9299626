"""References in two variables: closed forms, or heights over x between the places where their order changes."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from typing import Any

import mpmath as mp

from references.tools import Region, Truth, Value, differenced, length, real_roots, second

mpf = mp.mpf
Coefficients = Callable[[Any, Any], Sequence[Any]]


def polynomial_region(
    surfaces: Sequence[Coefficients], holds: Callable[[Any, Any, Any], bool], xs: Sequence[float],
    ys: Sequence[float], weight: Callable[[Any, Any], Any] | None = None, grid: int = 120,
) -> Value:  # fmt: skip
    """A region whose surfaces are polynomials in y: their coefficients over x, the highest power first."""

    def value(t: Any) -> Any:
        def places(x: Any) -> list[list[Any]]:
            return [real_roots(c(x, t)) for c in surfaces]

        return Region(places, lambda x, y: holds(x, y, t), xs, ys, weight, grid).area()

    return value


def balls(x: Any, y: Any) -> Any:
    return 1 / ((x - mpf(0.5)) ** 2 + y * y) + 1 / ((x + mpf(0.5)) ** 2 + y * y)


def two_balls(t: Any) -> Any:
    """With u = y^2 and a, b the squared distances along x: t u^2 + (t (a + b) - 2) u + t a b - a - b < 0."""

    def surface(x: Any, t: Any) -> list[Any]:
        a, b = (x - mpf(0.5)) ** 2, (x + mpf(0.5)) ** 2
        return [t, 0, t * (a + b) - 2, 0, t * a * b - a - b]

    return polynomial_region([surface], lambda x, y, t: balls(x, y) > t, [-2, 0, 2], [-2, 2])(t)


CENTRES = ((mpf(0.25), mpf(0.25), 1), (mpf(0.5), mpf(0.75), 2), (mpf(0.75), mpf(0.375), 3))


def three_balls(t: Any) -> Any:
    """The sum of k/(100 r_k^2) > t in the unit square, times the three denominators: of degree six in y."""

    def surface(x: Any, t: Any) -> list[Any]:
        factors = [[mpf(1), -2 * v, (x - u) ** 2 + v * v] for u, v, _ in CENTRES]
        whole = functools.reduce(product, factors)
        parts = [scaled(product(*(f for j, f in enumerate(factors) if j != k)), CENTRES[k][2]) for k in range(3)]
        return [100 * t * c - (sum(p[i - 2] for p in parts) if i >= 2 else 0) for i, c in enumerate(whole)]

    def holds(x: Any, y: Any, t: Any) -> bool:
        return bool(mp.fsum(k / ((x - u) ** 2 + (y - v) ** 2) for u, v, k in CENTRES) > 100 * t)

    return polynomial_region([surface], holds, [0, 1], [0, 1], grid=60)(t)


def product(p: Sequence[Any], q: Sequence[Any]) -> list[Any]:
    out = [mpf(0)] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            out[i + j] += a * b
    return out


def scaled(p: Sequence[Any], by: Any) -> list[Any]:
    return [by * c for c in p]


def folium(xs: Sequence[float]) -> Value:
    """x^3 + y^3 - 3 t x y < 0 over a square; its node at the origin is a cut."""
    return polynomial_region([lambda x, t: [1, 0, -3 * t * x, x**3]],
                             lambda x, y, t: x**3 + y**3 - 3 * t * x * y < 0, xs, [xs[0], xs[-1]])  # fmt: skip


def circle(x: Any, t: Any) -> list[Any]:
    return [1, 0, x * x - 1]


ellipse_in_circle = polynomial_region(
    [circle, lambda x, t: [1, -mpf(0.6), mpf(0.3) ** 2 + t * t * (x * x / 4 - 1)]],
    lambda x, y, t: x * x + y * y < 1 and x * x / 4 + (y - mpf(0.3)) ** 2 / t**2 < 1, [-2, 2], [-2, 2],
)  # fmt: skip
tilted = polynomial_region(
    [lambda x, t: [1, x, x * x - 1], lambda x, t: [3, -t * x, x * x - t * x - 1]],
    lambda x, y, t: x * x + x * y + y * y < 1 and x * x - t * x * y + 3 * y * y < 1 + t * x, [-2, 2], [-2, 2],
)  # fmt: skip
quintic = polynomial_region(  # by its sections in x, a cubic; so the roles of the variables are changed
    [lambda y, t: [1, 0, -1, y**5 + y - t]], lambda y, x, t: x**3 - x + y**5 + y < t, [-1, 1], [-1, 1],
)  # fmt: skip
elliptic = polynomial_region(
    [lambda x, t: [1, 0, -(x**3) + 3 * x - t]], lambda x, y, t: y * y < x**3 - 3 * x + t, [-3, 3], [-2, 2],
)  # fmt: skip
quartic = polynomial_region(
    [lambda x, t: [1, 0, 3 * x * x - 2, x, x**4 - x * x - t]],
    lambda x, y, t: x**4 + y**4 + 3 * x * x * y * y - x * x - 2 * y * y + x * y < t, [-2, 2], [-2, 2],
)  # fmt: skip
weighted_cubic = polynomial_region(
    [lambda x, t: [1, 0, -x, x**3 - t]], lambda x, y, t: x**3 + y**3 - x * y < t, [-1, 1], [-1, 1],
    lambda x, y: -mp.exp(-x - y),
)  # fmt: skip


def parabola(t: Any) -> Any:
    """The unit disc above y = x^2 - t, over |x| < a where they meet: y^2 + y + t - 1 = 0, the upper one, for t < 1."""
    y = (-1 + mp.sqrt(5 - 4 * t)) / 2
    a = mp.sqrt(y + t)
    return a * mp.sqrt(1 - a * a) + mp.asin(a) - 2 * a**3 / 3 + 2 * a * t


def sine_beside_diagonal(t: Any) -> Any:
    """sin(3 y) < t and y < x in [0, 2]^2: over x there are 2 - y."""
    return length(lambda y: mp.sin(3 * y) < t, [lambda y: mp.sin(3 * y) - t], 0, 2, lambda y: 2 * y - y * y / 2)


def hyperbola(t: Any) -> Any:
    return t * (1 + mp.log(4 / t))


# Bands: cos x + cos y over the whole zone


def states(e: Any) -> Any:
    """The density of states of one band, 4 K(m) with m = 1 - e^2/4, by the arithmetic-geometric mean."""
    return 2 * mp.pi / mp.agm(1, abs(e) / 2)


def below_energy(e: Any) -> Any:
    """The area where cos x + cos y < e: half of the zone at 0; the density has a logarithm there."""
    return 2 * mp.pi**2 + (mp.quad(states, [0, e]) if e else 0)


def two_bands(t: Any) -> Truth:
    """+-sqrt((cos x + cos y)^2 + 0.3^2): the lower band is full, the upper one up to |cos x + cos y| < w."""
    w = mp.sqrt(t * t - mpf(0.3) ** 2)
    return 4 * mp.pi**2 + below_energy(w) - below_energy(-w), 2 * states(w) * t / w


def depth_test(t: Any) -> Any:
    """Where the unit ball at the origin is before the one at (1/2, 0, t).

    With u = y^2 and A - u, B - u under the roots, sqrt(A - u) - sqrt(B - u) = t means sqrt(A - u) = ((A - B)/t + t)/2.
    """

    def places(x: Any) -> list[list[Any]]:
        a, b = 1 - x * x, 1 - (x - mpf(0.5)) ** 2
        edge = ((a - b) / t + t) / 2
        found = [a - edge * edge] if edge >= 0 and edge >= t else []
        return [both_signs(u) for u in ([a], [b], found)]

    def holds(x: Any, y: Any) -> bool:
        a, b = 1 - x * x - y * y, 1 - (x - mpf(0.5)) ** 2 - y * y
        return bool(a > 0 and b > 0 and mp.sqrt(a) > t + mp.sqrt(b))

    return Region(places, holds, [-1, 0.25, 2], [-1, 1]).area()


def both_signs(squares: Sequence[Any]) -> list[Any]:
    return [s * mp.sqrt(u) for u in squares if u > 0 for s in (-1, 1)]


def wave_of_product(t: Any) -> Any:
    """sin(3 x y) + x^2 < t in [-1, 1]^2: arcs of the sine, in 3 x y."""

    def places(x: Any) -> list[list[Any]]:
        s = t - x * x
        if abs(s) >= 1 or x == 0:
            return [[]]
        arcs = (mp.asin(s) + 2 * mp.pi * k for k in (-1, 0, 1)), (mp.pi - mp.asin(s) + 2 * mp.pi * k for k in (-1, 0))
        return [[theta / (3 * x) for theta in arc] for arc in arcs]

    return Region(places, lambda x, y: mp.sin(3 * x * y) + x * x < t, [-1, 0, 1], [-1, 1]).area()


def crossed_exponentials(t: Any) -> Any:
    """x exp(y) + y exp(x) < t in the unit square: y = s(x) by Lambert, x exp(y) + y exp(x) = t."""

    def places(x: Any) -> list[list[Any]]:  # with z = t exp(-x) - y: z exp(z) = x exp(-x) exp(t exp(-x))
        if x == 0:
            return [[t]]
        c = t * mp.exp(-x)
        return [[c - mp.lambertw(x * mp.exp(-x) * mp.exp(c)).real]]

    return Region(places, lambda x, y: x * mp.exp(y) + y * mp.exp(x) < t, [0, 1], [0, 1]).area()


def saddles(t: Any) -> Any:
    """sin(3 x) sin(3 y) < t in [0, 2]^2."""

    def places(x: Any) -> list[list[Any]]:
        s = t / mp.sin(3 * x) if mp.sin(3 * x) else mpf(2)
        if abs(s) >= 1:
            return [[]]
        a = mp.asin(s)
        return [[(v + 2 * mp.pi * k) / 3 for v in (a, mp.pi - a) for k in (-1, 0, 1)]]

    return Region(places, lambda x, y: mp.sin(3 * x) * mp.sin(3 * y) < t, [0, mp.pi / 3, 2], [0, 2]).area()


def gyroid_slice(t: Any) -> Any:
    """sin x cos y + sin y cos z + sin z cos x < t at z = 1/2 over a period: an arc in y over each x."""
    s, c = mp.sin(mpf(0.5)), mp.cos(mpf(0.5))

    def over(x: Any) -> Any:
        return 2 * mp.pi - 2 * mp.acos((t - s * mp.cos(x)) / mp.sqrt(mp.sin(x) ** 2 + c * c))

    return 2 * mp.quad(over, [0, mp.pi / 2, mp.pi])


def ridge(t: Any) -> Any:
    """exp(-((x - y)/s)^2/2), s = 1e-3, over [0, t] x [0, 1]: by a second antiderivative of the bell."""
    s = mpf(1e-3)

    def twice(u: Any) -> Any:
        return s * s * (mp.sqrt(2 * mp.pi) * (u / s) * mp.ncdf(u / s) + mp.exp(-((u / s) ** 2) / 2))

    return twice(t) - twice(mpf(0)) - twice(t - 1) + twice(mpf(-1))


def arm(t: Any) -> Any:
    """cos a + cos(a + b) > t with a, b normal: a + b lies within an arc about a multiple of 2 pi."""
    spread, lean = mpf(0.4), mpf(0.5)

    def over(a: Any) -> Any:
        c = t - mp.cos(a)
        if c >= 1:
            return mpf(0)
        half = mp.acos(c)  # c > -1 everywhere, as t > 0
        ends = (((2 * k * mp.pi - a - lean - half) / spread, 2 * half / spread) for k in range(-2, 3))
        arcs = (mp.ncdf(start + wide) - mp.ncdf(start) for start, wide in ends)
        return mp.npdf(a, mpf(0.3), spread) * mp.fsum(arcs)

    edges = [2 * k * mp.pi + sign * mp.acos(t - 1) for k in (-1, 0, 1) for sign in (-1, 1)]
    inside = sorted(e for e in edges if -5 < e < 6)
    cuts = [mpf(-5), *inside, mpf(6)]
    return mp.fsum(mp.quad(over, mp.linspace(a, b, 5)) for a, b in itertools.pairwise(cuts))


def normal_product(t: Any) -> Truth:
    """The product of two normal variables has the density K_0(|t|)/pi."""
    return mpf(1) / 2 + mp.quad(lambda s: mp.besselk(0, s) / mp.pi, [0, t]), mp.besselk(0, t) / mp.pi


def wavy_half_plane(t: Any) -> Any:
    """sin(3 x) + y < t, both normal."""
    return mp.quad(lambda x: mp.npdf(x) * mp.ncdf(t - mp.sin(3 * x)), mp.linspace(-14, 14, 57), method="gauss-legendre")


def bracket_within(t: Any) -> Any:
    """0.3 [x < t] + x/2 + y < 0.7 in the unit square: lengths min(1, .7 - x/2 - .3 [x < t])."""
    return t * (mpf(0.7) - mpf(0.3)) - t * t / 4 + (1 - t) * mpf(0.7) - (1 - t * t) / 4


def lens(d: Any) -> Any:
    """Two unit discs whose centres are d apart."""
    return 2 * mp.acos(d / 2) - d / 2 * mp.sqrt(4 - d * d)


def superellipse(t: Any) -> Any:
    """x^4 + y^4 < t."""
    return mp.sqrt(t) * 4 * mp.gamma(mpf(5) / 4) ** 2 / mp.gamma(mpf(3) / 2)


def sector(t: Any) -> Any:
    """The angle of (x, y) below t, in the unit disc: from -pi."""
    return (t + mp.pi) / 2


def disc_under_wave(t: Any) -> Any:
    """y < t sin(3 x) + 1/5 in the unit disc."""

    def wave(x: Any) -> Any:
        return t * mp.sin(3 * x) + mpf(0.2)

    def places(x: Any) -> list[list[Any]]:
        return [both_signs([1 - x * x]), [wave(x)]]

    return Region(places, lambda x, y: x * x + y * y < 1 and y < wave(x), [-1, 1], [-1, 1]).area()


def moving_triangle(t: Any) -> Any:
    """x y + y^2 < 1/2 below the diagonal up to t > 1/2: y < x up to 1/2, then below the root."""

    def over(x: Any) -> Any:
        return (-x + mp.sqrt(x * x + 2)) / 2

    return mpf(1) / 8 + mp.quad(over, [mpf(1) / 2, t])


VALUES: dict[str, tuple[Value, float]] = {
    "two metaballs": (two_balls, 1e-3), "three metaballs": (three_balls, 1e-3),
    "folium": (folium([0, 2]), 1e-3), "folium and wings": (folium([-1, 0, 2]), 1e-3),
    "circle and ellipse": (ellipse_in_circle, 1e-3), "circle and parabola": (parabola, 1e-3),
    "two ellipses": (tilted, 1e-3), "sine beside the diagonal": (sine_beside_diagonal, 1e-4),
    "hyperbola": (hyperbola, 1e-4), "depth test": (depth_test, 1e-3), "cubic and quintic": (quintic, 1e-3),
    "elliptic curve": (elliptic, 1e-3), "quartic": (quartic, 1e-3), "weighted cubic": (weighted_cubic, 1e-3),
    "wave of a product": (wave_of_product, 1e-4), "crossed exponentials": (crossed_exponentials, 1e-3),
    "saddles": (saddles, 1e-3), "gyroid slice": (gyroid_slice, 1e-3), "ridge": (ridge, 1e-6), "arm": (arm, 1e-3),
    "wavy half plane": (wavy_half_plane, 1e-3), "bracket within, 2-D": (bracket_within, 1e-3), "lens": (lens, 1e-3),
    "union of discs": (lambda d: 2 * mp.pi - lens(d), 1e-3), "superellipse": (superellipse, 1e-3),
    "fourth powers, by a delta": (lambda t: superellipse(t) / (2 * t), 1e-3),
    "lemniscate": (lambda t: t, 1e-3), "cardioid": (lambda t: 3 * mp.pi * t * t / 2, 1e-3),
    "flower": (lambda t: mp.pi * t * t * (1 + mpf(0.3) ** 2 / 2), 1e-3), "sector": (sector, 1e-3),
    "disc under a wave": (disc_under_wave, 1e-3), "moving triangle": (moving_triangle, 1e-3),
    "disc in its box": (lambda t: mp.pi * t, 1e-3), "ring": (lambda t: mp.pi * (t * t - mpf(0.25)), 1e-3),
}  # fmt: skip
TRUTHS: dict[str, Callable[[Any], Truth]] = {
    **{name: differenced(value, step) for name, (value, step) in VALUES.items()},
    "band": lambda t: (below_energy(t), states(t)), "band near its middle": lambda t: (below_energy(t), states(t)),
    "two bands": two_bands, "product of normals": normal_product,
    "density of states": lambda t: (states(t), mp.diff(states, t)),
}  # fmt: skip
SECONDS: dict[str, Value] = {
    **{name: second(VALUES[name][0]) for name in (
        "folium", "lens", "ring", "superellipse", "union of discs", "hyperbola", "fourth powers, by a delta",
    )},
    "band": lambda t: mp.diff(states, t), "density of states": lambda t: mp.diff(states, t, 2),
}  # fmt: skip
