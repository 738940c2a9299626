"""Areas of what conics and lines make by `and`, `or` and `not` within a square, by Green's theorem in closed form.

Along x each conic has at most two sections, (-p +- sqrt(p^2 - 4*c*r))/(2*c) with p and r polynomials, whose integrals
are elementary, as are those of their speeds. A section counts where what is asked of a point changes across it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import mpmath as mp

Conic = tuple[float, float, float, float, float, float]  # a*x*x + b*x*y + c*y*y + d*x + e*y + f < t
Inside = Callable[[Sequence[bool]], bool]
Polynomial = list[mp.mpf]  # the constant first
DIGITS = 60


def area(
    conics: Sequence[Conic], t: float, side: float, inside: Inside, speeds: Sequence[int] | None = None
) -> tuple[mp.mpf, mp.mpf]:
    """The area of what is inside in [-side, side]^2, and its derivative by t. speeds: how many times t each conic is
    held against, once by default."""
    with mp.workdps(DIGITS):
        speeds = speeds or [1] * len(conics)
        own = [_in_y(conic, speed * mp.mpf(t)) for conic, speed in zip(conics, speeds, strict=True)]
        end = mp.mpf(side)
        bounds: list[list[Polynomial]] = [[[y], [mp.mpf(1)], [mp.mpf(0)]] for y in (end, -end)]
        places = {-end, end}
        for first, second in itertools.combinations([*own, *bounds], 2):
            places.update(_real_roots(_resultant(first, second)))
        for r, p, c in own:
            places.update(_real_roots(_less(_times(p, p), _times([4 * c[0]], r)) if c[0] else p))
        ends = sorted(x for x in places if abs(x) <= end)
        value = slope = mp.mpf(0)
        for low, high in itertools.pairwise(ends):
            for part, rate in _sections(own, speeds, low, high, end, inside):
                value, slope = value + part, slope + rate
        return value, slope


def places(first: Conic, second: Conic, side: float = 2.0) -> list[tuple[mp.mpf, mp.mpf]]:
    """Where two conics with t = 0 cross in [-side, side]^2; of a conic and a line the line is second."""
    with mp.workdps(DIGITS):
        one, other = _in_y(first, mp.mpf(0)), _in_y(second, mp.mpf(0))
        (r, p, c), (s, q, d) = one, other
        found = []
        for x in _real_roots(_resultant(one, other)):
            top = _at(_less(_times(c, s), _times(d, r)), x)
            below = _at(_less(_times(c, q), _times(d, p)), x)
            if not c[0] and not d[0]:
                top, below = (_at(of, x) for of in ((s, q) if any(q) else (r, p)))
            found.append((x, -top / below))
        return [(x, y) for x, y in found if abs(x) <= side and abs(y) <= side]


def _sections(
    conics: Sequence[list[Polynomial]], speeds: Sequence[int], low: mp.mpf, high: mp.mpf, end: mp.mpf, inside: Inside
) -> list[tuple[mp.mpf, mp.mpf]]:
    """What each section between two places adds to the area, and to its derivative."""
    middle, found = (low + high) / 2, []
    at = [[_at(part, middle) for part in conic] for conic in conics]

    def holds(y: mp.mpf) -> list[bool]:
        return [r + p * y + c * y * y < 0 for r, p, c in at]

    found += [(end * (high - low), mp.mpf(0)) for sign in (1, -1) if inside(holds(sign * end))]
    for number, (r, p, c) in enumerate(at):
        for sign in (1, -1) if c else (0,):
            square = p * p - 4 * c * r
            if square < 0 or (not c and not p):
                continue
            y = (-p + sign * mp.sqrt(square)) / (2 * c) if c else -r / p
            if abs(y) >= end:
                continue
            held = holds(y)
            held[number] = True
            within = inside(held)
            held[number] = False
            change = within - inside(held)
            if change:  # below a section it holds where it grows upwards
                way = change if p + 2 * c * y > 0 else -change
                whole, speed = _integrals(conics[number], sign, low, high)
                found.append((way * whole, way * speed * speeds[number]))
    return found


def _integrals(conic: list[Polynomial], sign: int, low: mp.mpf, high: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    """The integrals of a section over a stretch, and of its derivative by t, which is taken from r."""
    r, p, (c, *_) = conic
    if not c:
        assert not any(p[1:])  # else it is a hyperbola with an upright asymptote
        return -_primitive(r, low, high) / p[0], (high - low) / p[0]
    square = _less(_times(p, p), _times([4 * c], r))
    (root, inverse), (before, beneath) = (_of_root(square, x) for x in (high, low))
    root, inverse = root - before, inverse - beneath
    return (-_primitive(p, low, high) + sign * root) / (2 * c), sign * inverse


def _of_root(square: Polynomial, x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    """Primitives of the root of a polynomial of degree 2, and of 1 over it."""
    c, b, a = (*square, mp.mpf(0), mp.mpf(0))[:3]
    root = mp.sqrt(max(a * x * x + b * x + c, mp.mpf(0)))
    if not a:
        return (2 * root**3 / (3 * b), 2 * root / b) if b else (root * x, x / root)
    if a > 0:
        inverse = mp.log(abs(2 * mp.sqrt(a) * root + 2 * a * x + b)) / mp.sqrt(a)
    else:
        part = -(2 * a * x + b) / mp.sqrt(b * b - 4 * a * c)
        inverse = mp.asin(max(min(part, mp.mpf(1)), mp.mpf(-1))) / mp.sqrt(-a)
    return (2 * a * x + b) / (4 * a) * root + (4 * a * c - b * b) / (8 * a) * inverse, inverse


def _in_y(conic: Conic, t: mp.mpf) -> list[Polynomial]:
    """The coefficients of 1, y and y*y as polynomials in x."""
    a, b, c, d, e, f = map(mp.mpf, conic)
    return [[f - t, d, a], [e, b], [c]]


def _resultant(first: list[Polynomial], second: list[Polynomial]) -> Polynomial:
    (r, p, c), (s, q, d) = first, second
    a, b, e = _less(_times(c, s), _times(d, r)), _less(_times(c, q), _times(d, p)), _less(_times(p, s), _times(q, r))
    return _less(_times(a, a), _times(b, e)) if any(c) or any(d) else e


def _real_roots(polynomial: Polynomial) -> list[mp.mpf]:
    simple = _without_multiples(_trimmed(polynomial))
    if len(simple) < 2:
        return []
    roots = mp.polyroots(simple, maxsteps=400, extraprec=200, error=False, asc=True)
    return [mp.re(root) for root in roots if abs(mp.im(root)) < mp.mpf(10) ** (-DIGITS / 3)]


def _trimmed(polynomial: Polynomial, size: mp.mpf | None = None) -> Polynomial:
    """Without leading coefficients that are rounding of what has this size."""
    least = (size or max(map(abs, polynomial))) * mp.mpf(10) ** (5 - DIGITS)
    found = list(polynomial)
    while found and abs(found[-1]) <= least:
        found.pop()
    return found


def _without_multiples(polynomial: Polynomial) -> Polynomial:
    """The polynomial with each root once: over what it has in common with its derivative, by Euclid's algorithm."""
    shared, rest = polynomial, [k * c for k, c in enumerate(polynomial)][1:]
    while rest:
        size = max(map(abs, rest))
        shared, rest = [c / size for c in rest], _divided(shared, [c / size for c in rest])[1]
    return _divided(polynomial, shared)[0] if len(shared) > 1 else polynomial


def _divided(p: Polynomial, q: Polynomial) -> tuple[Polynomial, Polynomial]:
    """The quotient and the remainder."""
    rest, quotient = list(p), list[mp.mpf]()
    while len(rest) >= len(q):
        quotient.append(rest[-1] / q[-1])
        rest = [a - quotient[-1] * b for a, b in zip(rest, [mp.mpf(0)] * (len(rest) - len(q)) + q, strict=True)][:-1]
    return quotient[::-1], _trimmed(rest, max(map(abs, p)))


def _times(p: Polynomial, q: Polynomial) -> Polynomial:
    found = [mp.mpf(0)] * (len(p) + len(q) - 1)
    for (i, a), (j, b) in itertools.product(enumerate(p), enumerate(q)):
        found[i + j] += a * b
    return found


def _less(p: Polynomial, q: Polynomial) -> Polynomial:
    return [a - b for a, b in itertools.zip_longest(p, q, fillvalue=mp.mpf(0))]


def _at(p: Polynomial, x: mp.mpf) -> mp.mpf:
    return sum((c * x**k for k, c in enumerate(p)), mp.mpf(0))


def _primitive(p: Polynomial, low: mp.mpf, high: mp.mpf) -> mp.mpf:
    return sum((c * (high ** (k + 1) - low ** (k + 1)) / (k + 1) for k, c in enumerate(p)), mp.mpf(0))
