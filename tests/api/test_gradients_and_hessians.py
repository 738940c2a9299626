"""Derivatives by many parameters in one pass, Hessians times vectors, deriv(deriv f): a dozen answers on paper.

Each from Python (`grad`, `hvp`), from the language (`deriv(deriv(f))`), and a few from the command line. The expected
numbers are mpmath's derivatives of closed forms.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto
from potto.__main__ import main

# name: program, where, closed form
Closed = Callable[..., Any]


def shade(c: Any, g: Any) -> Any:
    def part(a: Any, b: Any, density: Closed) -> Any:
        return mp.quad(lambda z: (g + z) ** 2 * density(z), [a, b])

    return part(0, 1 + c, lambda z: z - c) + part(1 + c, 2 + c, lambda z: 2 + c - z)


CASES: dict[str, tuple[str, tuple[float, ...], Closed]] = {
    "area": ("def f(t) integral [0, 1] x*[x < t] d(x)", (0.3,), lambda t: t**2 / 2),
    "growth": ("def f(t) integral [0, 1] exp(t*x)*[x < t] d(x)", (0.6,), lambda t: (mp.e ** (t * t) - 1) / t),
    "disc": ("def f(r) integral ([-1, 1], [-1, 1]) [x^2 + y^2 < r^2] d(x, y)", (0.7,), lambda r: mp.pi * r**2),
    "corner": ("def f(c) integral ([0, 1], [0, 1]) [x + y + c >= 0] d(x, y)", (-0.7,), lambda c: 1 - c**2 / 2),
    "box": ("def f(a, b) integral ([0, 1], [0, 1]) [x < a]*[y < b] d(x, y)", (0.3, 0.6), lambda a, b: a * b),
    "triangle": ("def f(a, b) integral ([0, 1], [0, 1]) [a*x + b*y < 1/2] d(x, y)", (0.8, 0.9),
                 lambda a, b: 1 / (8 * a * b)),
    "ellipse": ("def f(a, b) integral ([-1, 1], [-1, 1]) [(x/a)^2 + (y/b)^2 < 1] d(x, y)", (0.8, 0.6),
                lambda a, b: mp.pi * a * b),
    "product": ("def f(a, b) integral [0, 1] b^2*x*[x < a*b] d(x)", (0.8, 0.6), lambda a, b: b**2 * (a * b) ** 2 / 2),
    "nested": ("def f(t) integral [0, 1] (integral [0, 1] [y < t*x] d(y))^2 d(x)", (0.7,), lambda t: t**2 / 3),
    "moving": ("def f(t) integral [0, t] x^2*t d(x)", (0.7,), lambda t: t**4 / 3),
    "plane": ("def f(t) integral ([0, 1], [0, 1], [0, 1]) [x + y + z < t] d(x, y, z)", (0.9,), lambda t: t**3 / 6),
    "wave": ("def f(t, w) integral [0, 1] cos(w*x)*[x < t] d(x)", (0.7, 5.0), lambda t, w: mp.sin(w * t) / w),
    "shade": ("def f(c, g) integral ([0, 1], [0, 1]) (g + x + y + c)^2*[x + y + c >= 0] d(x, y)", (-0.7, 2.0), shade),
}  # fmt: skip
VECTOR = (0.75, -1.25)


def exact(closed: Closed, at: tuple[float, ...], *orders: int) -> float:
    with mp.workdps(30):
        point = tuple(mp.mpf(a) for a in at)
        return float(mp.diff(closed, point if len(point) > 1 else point[0],
                             tuple(orders) if len(point) > 1 else orders[0]))  # fmt: skip


def hessian_times(closed: Closed, at: tuple[float, ...]) -> list[float]:
    n = len(at)
    units = np.eye(n, dtype=int)
    return [sum(VECTOR[j] * exact(closed, at, *map(int, units[i] + units[j])) for j in range(n)) for i in range(n)]


@pytest.mark.parametrize("name", CASES)
def test_gradients_in_one_pass(name: str) -> None:
    text, at, closed = CASES[name]
    f = potto.compile(text).f
    found = potto.grad(f, f.parameters)(*at)
    alone = potto.grad(f, f.parameters[0])(*at)
    assert found.converged and found.evals <= 2.5 * alone.evals  # as many nodes as for one, and a few more for the rest
    for i, parameter in enumerate(f.parameters):
        wanted = exact(closed, at, *(int(i == j) for j in range(len(at))))
        assert abs(found[parameter] - wanted) <= 1e-11 * max(1.0, abs(wanted))


@pytest.mark.parametrize("name", CASES)
def test_hessians_times_vectors(name: str) -> None:
    text, at, closed = CASES[name]
    f = potto.compile(text).f
    found = potto.hvp(f, dict(zip(f.parameters, VECTOR)))(*at)
    assert found.converged
    bounds = found.tangent_error if len(at) > 1 else (found.tangent_error,)
    for parameter, wanted, bound in zip(f.parameters, hessian_times(closed, at), bounds):
        off = abs(found[parameter] - wanted)
        assert off <= 1e-10 * max(1.0, abs(wanted)) and off <= bound + 1e-15 * max(1.0, abs(wanted))


@pytest.mark.parametrize("name", CASES)
def test_the_derivative_of_the_derivative_in_the_language(name: str) -> None:
    """Along one direction twice: ((value, slope), (slope, bend))."""
    text, at, closed = CASES[name]
    duals = ", ".join(f"(({a}, {v}), ({v}, 0))" for a, v in zip(at, VECTOR))
    found = potto.compile(text).eval(f"deriv(deriv(f))({duals})")
    bend = sum(v * h for v, h in zip(VECTOR, hessian_times(closed, at)))
    (value, slope), (again, second) = found.value, found.tangent
    assert abs(value - float(closed(*map(mp.mpf, at)))) < 1e-11 and abs(slope - again) < 1e-11
    assert found.converged and abs(second - bend) <= 1e-10 * max(1.0, abs(bend))


def test_arrays_and_functions_stand_beside_the_vector() -> None:
    m = potto.compile("def f(t, s) integral [0, 1] s(x)*[x < t] d(x)\ndef square(x) x^2")
    t = np.array([0.2, 0.5, 0.8])
    np.testing.assert_allclose(potto.hvp(m.f, {"t": 1.0})(t, m.square).tangent, 2 * t, rtol=1e-12)


def test_a_guard_beside_a_hole() -> None:
    """s*sin(t)/t bends by -s/3 in t at t = 0: to eight digits, by what lies beside t = 0."""
    m = potto.compile("def f(t, s) if t == 0 then s else s*sin(t)/t")
    found = potto.hessian(m.f, wrt=["t", "s"])(0.0, 1.5)
    assert (np.abs(found.value - [[-0.5, 0.0], [0.0, 0.0]]) <= found.error + 1e-15).all() and found.error.max() <= 1e-8


def test_what_has_no_second_derivative_says_so() -> None:
    """The derivative of [x < a][x < b] jumps where a = b: a product of deltas on one surface."""
    m = potto.compile("def f(a, b) integral [0, 1] [x < a]*[x < b] d(x)")
    with pytest.raises(potto.PottoError) as caught:
        potto.hvp(m.f, {"a": 1.0, "b": 0.0})(0.5, 0.5)
    assert caught.value.diagnostics[0].code == "P0505"
    with pytest.raises(potto.PottoError, match="no parameter `c`"):
        potto.hvp(m.f, {"c": 1.0})


@pytest.mark.parametrize("name", ["disc", "box", "wave"])
def test_from_the_command_line(name: str, tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    text, at, closed = CASES[name]
    names = potto.compile(text).f.parameters
    (tmp_path / "p.po").write_text(text)
    words = ["deriv", str(tmp_path / "p.po"), "f", *(f"{n}={a}" for n, a in zip(names, at)), "--json"]
    for n, v in zip(names, VECTOR):
        words += ["--along", f"{n}={v}"]
    assert main(words) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["converged"] and list(answer["gradient"]) == list(names)
    wanted = hessian_times(closed, at)
    assert list(answer["hessian_product"].values()) == pytest.approx(wanted, rel=1e-10, abs=1e-12)


def test_the_command_line_for_people(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "p.po").write_text(CASES["box"][0])
    assert main(["deriv", str(tmp_path / "p.po"), "f", "a=0.25", "b=0.5", "--along", "a=2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines == ["f = 0.125", "  by a: 0.5", "  by b: 0.25", "Hessian times (a=2)", "  by a: 0"]
    assert main(["deriv", str(tmp_path / "p.po"), "f", "a=0.25", "--wrt", "a"]) == 1
    assert "no value is given for `b`" in capsys.readouterr().err


def test_a_derivative_of_a_record_has_its_fields() -> None:
    module = potto.compile(
        "record P(a: Real, b: Real)\nrecord Q(p: P, c: Real)\ndef f(t, p: P) Q(P(t^2*p.a, t^3), 3*t)"
    )
    p = {"a": 5.0, "b": 1.0}
    found = potto.grad(module.f, ["t", "p"])(2.0, p)
    assert (found.value.p.a, found.value.c) == (20, 6)
    assert (found["t"].p.a, found["t"].p.b, found["t"].c) == (20, 12, 3)
    assert (found["p"]["a"].p.a, found["p"]["b"].c) == (4, 0)
    over = potto.grad(module.f)(np.array([1.0, 2.0]), p)
    assert over.tangent.p.b.tolist() == [3, 12]
    value, slope = potto.value_and_grad(module.f)(2.0, p)
    assert (value.p.b, slope.p.b) == (8, 12)
    assert potto.jvp(module.f, {"t": 1.0})(2.0, p).tangent.p.a == 20
