"""Inverses of maps: inverse after map is the identity, on some branch, for every family of the registry and more."""

from __future__ import annotations

import math
import random

import mpmath
import pytest
from calculus_terms import term, value

from potto.calculus.algebra.affine import affine, determinant, solve_affine
from potto.calculus.solving.inverse_map import Failure, InverseMap, dependence, invert, jacobian
from potto.core.terms import Term, substitute, var
from potto.diffeos import FAMILIES, DiffeoFamily

FAMILY = pytest.mark.parametrize("family", FAMILIES.values(), ids=lambda f: f.name)


def names(family: DiffeoFamily) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return tuple(f"x{i}" for i in range(family.dims)), tuple(f"p{i}" for i in range(len(family.params)))


def forward(family: DiffeoFamily) -> tuple[Term, ...]:
    xs, ps = names(family)
    return family.forward(tuple(map(var, xs)), tuple(map(var, ps)))


def points(family: DiffeoFamily, count: int = 20) -> list[dict[str, float]]:
    source = random.Random(family.name)
    xs, ps = names(family)
    box = dict(zip((*xs, *ps), (*family.domain, *family.params), strict=True))
    return [{n: source.uniform(*b) for n, b in box.items()} for _ in range(count)]


def numbers(terms: tuple[Term, ...], env: dict[str, float]) -> list[float]:
    with mpmath.workdps(30):
        return [float(value(t, env)) for t in terms]


@FAMILY
def test_the_inverse_of_a_family_leads_back(family: DiffeoFamily) -> None:
    xs, ps = names(family)
    back = family.inverse(forward(family), tuple(map(var, ps)))
    for env in points(family):
        # 30 digits inside, so that only the doubles at the end are rounded
        assert numbers(back, env) == pytest.approx([env[x] for x in xs], rel=1e-14, abs=1e-14)


@FAMILY
def test_a_family_is_inverted_without_being_told(family: DiffeoFamily) -> None:
    xs, _ = names(family)
    found = invert(forward(family), xs)
    assert isinstance(found, InverseMap), found
    for env in points(family):
        image = dict(zip(found.values, numbers(forward(family), env), strict=True))
        solutions = [numbers(b, {**env, **image}) for b in found.branches]
        here = [env[x] for x in xs]
        assert any(s == pytest.approx(here, rel=1e-9, abs=1e-9) for s in solutions), (solutions, here)


@FAMILY
def test_the_determinant_agrees_with_differences(family: DiffeoFamily) -> None:
    xs, _ = names(family)
    found = invert(forward(family), xs)
    assert isinstance(found, InverseMap)
    h = mpmath.mpf(10) ** -10
    for env in points(family, 5):
        with mpmath.workdps(40):
            exact = {n: mpmath.mpf(v) for n, v in env.items()}
            matrix = mpmath.matrix(family.dims, family.dims)
            for j, x in enumerate(xs):
                for i, c in enumerate(forward(family)):
                    up, down = ({**exact, x: exact[x] + s * h} for s in (1, -1))
                    matrix[i, j] = (value(c, up) - value(c, down)) / (2 * h)
            difference = float(mpmath.det(matrix))
        # central differences with h = 1e-10 are good to h^2 times a third derivative of moderate size
        assert numbers((found.determinant,), env)[0] == pytest.approx(difference, rel=1e-12, abs=1e-14)


MAPS = [
    ("x + y + c; x - y + c", "xy"),
    ("x*cos(a) - y*sin(a); x*sin(a) + y*cos(a)", "xy"),
    ("x + y + z; x - y; y + 2*z*c", "xyz"),
    ("a*x + y + z + w; x - b*y; z + c*w; w - x", "xyzw"),
    ("hypot(x, y) - r; atan2(y, x)", "xy"),
    ("(x - a)^2 + (y - b)^2 - r^2; atan2(y - b, x - a)", "xy"),
    ("r*cos(w) + a; r*sin(w) + b", "rw"),
    ("2*a*r*cos(w); b*r*sin(w)", "rw"),
    ("x*y; x/y", "xy"),
    ("t - x*y; y", "xy"),
    ("y - x^2; x", "xy"),
    ("x^2 - y; x + y", "xy"),
    ("exp(x) + y; y^3", "xy"),
    ("x*exp(x) + y; x", "xy"),
    ("log(x)*2 + t", "x"),
    ("(x - 1)^3", "x"),
    ("x^2; y", "xy"),
    ("r*cosh(w); r*sinh(w)", "rw"),
    ("x^2 - y^2; 2*x*y", "xy"),
    ("hypot(x, y); x", "xy"),
    ("x^3 + y; x^3 - y", "xy"),
    ("x + sin(y); y", "xy"),
    ("x; y + x^2; z + sin(x*y)", "xyz"),
]


@pytest.mark.parametrize(("text", "variables"), MAPS)
def test_maps_are_inverted(text: str, variables: str) -> None:
    coordinates = tuple(term(part) for part in text.split(";"))
    found = invert(coordinates, tuple(variables))
    assert isinstance(found, InverseMap), found
    source = random.Random(text)
    free = sorted({n for c in coordinates for n in c.free})
    for _ in range(10):
        env = {n: source.uniform(0.2, 2.0) for n in free}
        image = dict(zip(found.values, numbers(coordinates, env), strict=True))
        solutions = [numbers(b, {**env, **image}) for b in found.branches]
        here = [env[v] for v in variables]
        assert any(s == pytest.approx(here, rel=1e-8, abs=1e-8) for s in solutions), (solutions, here)


@pytest.mark.parametrize(
    ("text", "variables", "says"),
    [
        ("x + y; 2*x + 2*y", "xy", "together with coordinate 1"),
        ("x + y; 3", "xy", "does not vary"),
        ("2*x*y + x; 4*x*y + 2*x + 1", "xy", "together with coordinate 1"),
        ("x + y; exp(x + y)", "xy", "together with coordinate 1"),
        ("x - y; y - z; z - x", "xyz", "function of the others"),
        ("x*cos(a) + y*sin(a); x*cos(a)*2 + y*sin(a)*2", "xy", "together with coordinate 1"),
    ],
)
def test_singular_maps_are_told_apart(text: str, variables: str, says: str) -> None:
    coordinates = tuple(term(part) for part in text.split(";"))
    found = invert(coordinates, tuple(variables))
    assert isinstance(found, Failure) and found.singular
    assert says in dependence(coordinates, tuple(variables))


def test_what_repeats_needs_a_branch() -> None:
    found = invert((term("sin(x)"), term("y")), ("x", "y"))
    assert isinstance(found, Failure) and not found.singular
    assert "periodic" in found.reason
    assert isinstance(invert((term("sin(x)"), term("y")), ("x", "y"), selected=True), InverseMap)


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 6])
def test_affine_systems_are_solved_exactly(size: int) -> None:
    source = random.Random(size)
    names_ = [f"x{i}" for i in range(size)]
    rows = []
    matrix = [[source.uniform(-2, 2) + (3 if i == j else 0) for j in range(size)] for i in range(size)]
    for row in matrix:
        text = " + ".join(f"{c!r}*{n}" for c, n in zip(row, names_, strict=True))
        found = affine(term(text), names_)
        assert found is not None
        rows.append(found)
    values = [term(f"v{i}") for i in range(size)]
    solution = solve_affine(rows, values)
    assert solution is not None
    env = {f"v{i}": source.uniform(-1, 1) for i in range(size)}
    expected = mpmath.lu_solve(mpmath.matrix(matrix), mpmath.matrix([env[f"v{i}"] for i in range(size)]))
    # cofactors of a well-conditioned matrix of at most six rows lose at most a few digits
    assert numbers(solution, env) == pytest.approx([float(e) for e in expected], rel=1e-12, abs=1e-12)


def test_a_determinant_that_vanishes_identically_is_zero() -> None:
    rows = jacobian((term("x*cos(a) + y*sin(a)"), term("x*cos(a)^3 + y*sin(a)*cos(a)^2 + 0*x")), ("x", "y"))
    from potto.calculus.algebra.rational_form import is_zero

    assert is_zero(determinant(rows))


def test_the_determinant_of_a_rotation_is_one() -> None:
    rows = jacobian((term("x*cos(a) - y*sin(a)"), term("x*sin(a) + y*cos(a)")), ("x", "y"))
    assert determinant(rows) is term("1")


def test_branches_of_a_fold_meet_where_the_determinant_vanishes() -> None:
    found = invert((term("x^2"), term("y")), ("x", "y"))
    assert isinstance(found, InverseMap) and len(found.branches) == 2
    at_fold = [numbers(b, {"u": 0.0, "v": 1.0}) for b in found.branches]
    assert at_fold[0] == at_fold[1] == [0.0, 1.0]
    assert numbers((substitute(found.determinant, {"x": term("0")}),), {}) == [0.0]
    assert math.isnan(numbers(found.branches[0], {"u": -1.0, "v": 1.0})[0])
