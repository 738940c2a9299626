"""Families of diffeomorphisms whose inverse is known.

Owns `DiffeoFamily` and `FAMILIES`. An entry says all that there is to say about a family: the map, its inverse, where
its coordinates and parameters may lie, and, for those that cannot be inverted one variable at a time, the terms by
which the inverter recognizes it inside a larger map. Property tests run over the whole registry.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from msgspec import Struct

from potto.core.terms import HALF, TWO, Prim, Term, add, div, mul, pow_, prim, sub

Terms = tuple[Term, ...]
Interval = tuple[float, float]


class Recognition(Struct, frozen=True):
    """How a family shows inside a term.

    anchor: what the inputs of the family may be if a builtin applied to terms belongs to it.
    images: terms over the inputs, and what each is over the outputs of the family.
    nonnegative: outputs that are never negative.
    """

    anchor: Callable[[Prim], tuple[Terms, ...]]
    images: Callable[[Terms, Terms], Mapping[Term, Term]]
    nonnegative: tuple[int, ...] = ()


class DiffeoFamily(Struct, frozen=True):
    """One family of invertible, differentiable maps.

    params, domain: an interval for each parameter and each coordinate in which the family is invertible.
    forward, inverse: from coordinates (or images) and parameters to images (or coordinates), as terms.
    """

    name: str
    dims: int
    doc: str
    forward: Callable[[Terms, Terms], Terms]
    inverse: Callable[[Terms, Terms], Terms]
    params: tuple[Interval, ...] = ()
    domain: tuple[Interval, ...] = ()
    recognition: Recognition | None = None


FAMILIES: dict[str, DiffeoFamily] = {}

_BOX: tuple[Interval, Interval] = ((-3.0, 3.0), (-3.0, 3.0))


def _register(family: DiffeoFamily) -> DiffeoFamily:
    if family.name in FAMILIES:
        raise ValueError(f"family {family.name} is registered twice")
    FAMILIES[family.name] = family
    return family


# Affine families


def _affine2_inverse(u: Terms, p: Terms) -> Terms:
    a, b, c, d, e, f = p
    det = sub(mul(a, d), mul(b, c))
    v, w = sub(u[0], e), sub(u[1], f)
    return div(sub(mul(d, v), mul(b, w)), det), div(sub(mul(a, w), mul(c, v)), det)


scale_shift = _register(
    DiffeoFamily(
        "scale_shift",
        dims=1,
        doc="Scaling by a positive factor, then a shift.",
        forward=lambda x, p: (add(mul(p[0], x[0]), p[1]),),
        inverse=lambda u, p: (div(sub(u[0], p[1]), p[0]),),
        params=((0.2, 3.0), (-2.0, 2.0)),
        domain=((-3.0, 3.0),),
    )
)

affine2 = _register(
    DiffeoFamily(
        "affine2",
        dims=2,
        doc="The plane under a matrix and a shift.",
        forward=lambda x, p: (
            add(mul(p[0], x[0]), mul(p[1], x[1]), p[4]),
            add(mul(p[2], x[0]), mul(p[3], x[1]), p[5]),
        ),
        inverse=_affine2_inverse,
        params=((1.5, 3.0), (-1.0, 1.0), (-1.0, 1.0), (1.5, 3.0), (-2.0, 2.0), (-2.0, 2.0)),
        domain=_BOX,
    )
)

rotation = _register(
    DiffeoFamily(
        "rotation",
        dims=2,
        doc="The plane turned by an angle.",
        forward=lambda x, p: (
            sub(mul(x[0], prim("cos", p[0])), mul(x[1], prim("sin", p[0]))),
            add(mul(x[0], prim("sin", p[0])), mul(x[1], prim("cos", p[0]))),
        ),
        inverse=lambda u, p: (
            add(mul(u[0], prim("cos", p[0])), mul(u[1], prim("sin", p[0]))),
            sub(mul(u[1], prim("cos", p[0])), mul(u[0], prim("sin", p[0]))),
        ),
        params=((-3.0, 3.0),),
        domain=_BOX,
    )
)

shear = _register(
    DiffeoFamily(
        "shear",
        dims=2,
        doc="The plane sheared along x.",
        forward=lambda x, p: (add(x[0], mul(p[0], x[1])), x[1]),
        inverse=lambda u, p: (sub(u[0], mul(p[0], u[1])), u[1]),
        params=((-3.0, 3.0),),
        domain=_BOX,
    )
)

# Families of one variable at a time

log_scale = _register(
    DiffeoFamily(
        "log_scale",
        dims=1,
        doc="The positive half line on a logarithmic scale.",
        forward=lambda x, p: (mul(p[0], prim("log", x[0])),),
        inverse=lambda u, p: (prim("exp", div(u[0], p[0])),),
        params=((0.2, 3.0),),
        domain=((0.05, 20.0),),
    )
)

parabola = _register(
    DiffeoFamily(
        "parabola",
        dims=2,
        doc="The plane with a parabola straightened.",
        forward=lambda x, p: (sub(x[1], mul(p[0], pow_(x[0], TWO))), x[0]),
        inverse=lambda u, p: (u[1], add(u[0], mul(p[0], pow_(u[1], TWO)))),
        params=((-3.0, 3.0),),
        domain=_BOX,
    )
)

hyperbolic = _register(
    DiffeoFamily(
        "hyperbolic",
        dims=2,
        doc="The first quadrant by product and ratio.",
        forward=lambda x, p: (mul(x[0], x[1]), div(x[0], x[1])),
        inverse=lambda u, p: (prim("sqrt", mul(u[0], u[1])), prim("sqrt", div(u[0], u[1]))),
        domain=((0.1, 4.0), (0.1, 4.0)),
    )
)

# Families that only a pair of coordinates together inverts


def _polar_images(x: Terms, u: Terms) -> Mapping[Term, Term]:
    (p, q), (radius, _) = x, u
    squares = [(pow_(p, TWO), pow_(q, TWO)), (prim("mul", p, p), prim("mul", q, q))]
    images: dict[Term, Term] = {prim("atan2", q, p): u[1]}
    for a, b in ((p, q), (q, p)):
        images[prim("hypot", a, b)] = radius
    for a, b in squares:
        for total in (add(a, b), add(b, a)):
            images[prim("sqrt", total)] = radius
            images[total] = pow_(radius, TWO)
    return images


polar = _register(
    DiffeoFamily(
        "polar",
        dims=2,
        doc="The plane by distance and angle; cut along the negative half of the first axis.",
        forward=lambda x, p: (prim("hypot", x[0], x[1]), prim("atan2", x[1], x[0])),
        inverse=lambda u, p: (mul(u[0], prim("cos", u[1])), mul(u[0], prim("sin", u[1]))),
        domain=((0.1, 3.0), (-3.0, 3.0)),
        recognition=Recognition(
            anchor=lambda node: ((node.args[1], node.args[0]),) if node.op == "atan2" else (),
            images=_polar_images,
            nonnegative=(0,),
        ),
    )
)


def _turned(node: Prim, op: str) -> tuple[Terms, ...]:
    """Radius and angle of a r cos(w): the radius is one of the factors."""
    if node.op != "mul":
        return ()
    inner = [a for a in node.args if isinstance(a, Prim) and a.op == op]
    if len(inner) != 1:
        return ()
    return tuple((a, inner[0].args[0]) for a in node.args if a is not inner[0] and a.free)


def _multiples(first: str, second: str) -> Callable[[Terms, Terms], Mapping[Term, Term]]:
    """What r f(w) and r g(w) become, for two builtins f and g."""

    def images(x: Terms, u: Terms) -> Mapping[Term, Term]:
        parts = [(prim(op, x[1]), image) for op, image in zip((first, second), u, strict=True)]
        return {product: image for part, image in parts for product in (mul(x[0], part), mul(part, x[0]))}

    return images


cartesian = _register(
    DiffeoFamily(
        "cartesian",
        dims=2,
        doc="Distance and angle as points of the plane; for positive distances and angles between -pi and pi.",
        forward=lambda x, p: (mul(x[0], prim("cos", x[1])), mul(x[0], prim("sin", x[1]))),
        inverse=lambda u, p: (prim("hypot", u[0], u[1]), prim("atan2", u[1], u[0])),
        domain=((0.1, 3.0), (-3.0, 3.0)),
        recognition=Recognition(anchor=lambda node: _turned(node, "cos"), images=_multiples("cos", "sin")),
    )
)


rapidity = _register(
    DiffeoFamily(
        "rapidity",
        dims=2,
        doc="The wedge |y| < x by hyperbolic distance and rapidity.",
        forward=lambda x, p: (mul(x[0], prim("cosh", x[1])), mul(x[0], prim("sinh", x[1]))),
        inverse=lambda u, p: (
            prim("sqrt", mul(sub(u[0], u[1]), add(u[0], u[1]))),
            mul(HALF, prim("log", div(add(u[0], u[1]), sub(u[0], u[1])))),
        ),
        domain=((0.1, 3.0), (-2.0, 2.0)),
        recognition=Recognition(anchor=lambda node: _turned(node, "cosh"), images=_multiples("cosh", "sinh")),
    )
)
