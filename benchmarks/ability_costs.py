"""Abilities that are told by a ratio of costs: the same thing written in two ways, or twice as much of it."""

from __future__ import annotations

import math
import statistics
import sys
from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
from ability_lines import CATALOGUES, CLOCK, Finding, Line, covered, doubling, listed, once, relative, warm
from run import PROGRAM, by_hand, exact_quad, gauss

import potto

sys.path += CATALOGUES
STEP = 2.3  # what twice as much may cost
SAME = 1.5  # what the same may cost, written in another way
INTEGRAL = "integral [0, 1]"
SQUARE = "integral ([0, 1], [0, 1])"


def conditions() -> Finding:
    """1/(1 + how many of t/(n+1), 2t/(n+1), … lie above x): a function of all conditions, so that no sum splits it."""
    seconds, t = {}, 0.9
    for n in (10, 20, 40, 80):
        count = " + ".join(f"[x < {k}*t/{n + 1}]" for k in range(1, n + 1))
        f = potto.deriv(potto.compile(f"def f(t) {INTEGRAL} 1/(1 + {count}) d(x)").f)
        answer, seconds[n] = once(lambda f=f: f((t, 1.0)))
    harmonic = math.fsum(1 / k for k in range(2, n + 2))
    value, slope = t * harmonic / (n + 1) + 1 - n * t / (n + 1), (harmonic - n) / (n + 1)
    off, ratio = max(relative(answer.value, value), relative(answer.tangent, slope)), doubling(seconds)
    met = ratio <= STEP and off <= 1e-12 and covered(answer, value, slope)
    return Finding(answer.value, answer.error, off, answer.evals, seconds[80], ratio, met, listed(seconds))


def gradient() -> Finding:
    n = 80
    names = [f"a{k}" for k in range(1, n + 1)]
    count = " + ".join(f"[x < {name}]" for name in names)
    f = potto.compile(f"def f({', '.join(names)}) {INTEGRAL} 1/(1 + {count}) d(x)").f
    at = {name: 0.9 * k / (n + 1) for k, name in enumerate(names, 1)}
    value, alone = once(lambda: f(**at))
    answer, seconds = once(lambda: potto.grad(f, names)(**at))
    exact = np.array([1 / (2 + n - k) - 1 / (1 + n - k) for k in range(1, n + 1)])
    off = float(np.max(np.abs(np.array(answer.tangent) - exact) / np.abs(exact)))
    met = seconds <= 4 * alone and off <= 1e-12
    return Finding(value.value, value.error, off, answer.evals, seconds, seconds / alone, met)


def summands() -> Finding:
    n = 640
    body = " + ".join(f"{k}*[x < {k}*t/{n + 1}]" for k in range(1, n + 1))
    written = potto.deriv(potto.compile(f"def f(t) {INTEGRAL} ({body}) d(x)").f)
    looped = potto.deriv(potto.compile(f"def f(t) {INTEGRAL} sum k in 1..{n} (k*[x < k*t/{n + 1}]) d(x)").f)
    exact = math.fsum(k * k / (n + 1) for k in range(1, n + 1))
    seconds = other = math.inf
    for _ in range(3):  # machine code is made meanwhile, for both
        answer, took = once(lambda: written((0.9, 1.0)))
        seconds, other = min(seconds, took), min(other, once(lambda: looped((0.9, 1.0)))[1])
    ratio, off = seconds / other, relative(answer.tangent, exact)
    met = ratio <= SAME and off <= 1e-12 and covered(answer, 0.9 * exact, exact)
    return Finding(answer.value, answer.error, off, answer.evals, seconds, ratio, met)


INSIDE = (
    "[({2} - {0})*(y - {1}) - ({3} - {1})*(x - {0}) > 0]*[({4} - {2})*(y - {3}) - ({5} - {3})*(x - {2}) > 0]"
    "*[({0} - {4})*(y - {5}) - ({1} - {5})*(x - {4}) > 0]*{6}"
)
TRIANGLES = ((0.1, 0.2, 0.7, 0.15, 0.4, 0.7, 1.0), (0.2, 0.1, 0.9, 0.3, 0.3, 0.8, 2.0),
             (0.3, 0.3, 0.8, 0.35, 0.6, 0.9, 0.5), (0.15, 0.4, 0.6, 0.2, 0.75, 0.75, 1.5))  # fmt: skip


def triangles() -> Finding:
    names = [[f"{c}{i}" for c in ("ax", "ay", "bx", "by", "cx", "cy", "s")] for i in range(len(TRIANGLES))]
    every = ", ".join(name for group in names for name in group)
    at = {name: value for group, values in zip(names, TRIANGLES) for name, value in zip(group, values)}
    parts = {
        "through": " + ".join(f"tri(x, y, {', '.join(group)})" for group in names),
        "written": " + ".join(INSIDE.format(*group) for group in names),
    }
    formal = ["ax", "ay", "bx", "by", "cx", "cy", "s"]
    m = potto.compile(f"def tri(x, y, {', '.join(formal)}) {INSIDE.format(*formal)}\n" + "\n".join(
        f"def {name}({every}) {SQUARE} ({body}) d(x, y)" for name, body in parts.items()))  # fmt: skip
    answer, seconds = once(lambda: potto.grad(m.through, list(at))(**at))
    ratio = seconds / once(lambda: potto.grad(m.written, list(at))(**at))[1]
    exact = sum(s * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2 for ax, ay, bx, by, cx, cy, s in TRIANGLES)
    off = relative(answer.value, exact)
    met = ratio <= SAME and off <= 1e-12 and answer.converged
    return Finding(answer.value, answer.error, off, answer.evals, seconds, ratio, met)


def octagon() -> Finding:
    """cos(pi/2) is 6e-17: two edges are parallel to an axis but for that."""
    edges = "*".join(f"[x*cos(a + {k}*pi/4) + y*sin(a + {k}*pi/4) < 0.7]" for k in range(8))
    f = potto.deriv(potto.compile(f"def f(a) integral ([-1, 1], [-1, 1]) {edges} d(x, y)").f)
    exact = 8 * 0.49 * math.tan(math.pi / 8)
    answer, seconds = once(lambda: f((0.0, 1.0)))
    ratio = seconds / once(lambda: f((0.3, 1.0)))[1]
    off = max(relative(answer.value, exact), abs(answer.tangent))
    met = ratio <= SAME and off <= 1e-9 and covered(answer, exact, 0.0)
    return Finding(answer.value, answer.error, off, answer.evals, seconds, ratio, met)


def equation() -> tuple[Callable[..., Any], Any]:
    """Equation (1) and its quadratic shader, both as duals."""
    m = potto.compile(PROGRAM)
    return potto.deriv(m.renderer), potto.deriv(m.quad)


def many_by_hand(c: Any, rule: tuple[Any, Any]) -> Any:
    """What an expert writes in numpy for many values of c at once: values and derivatives, as `by_hand` has them."""
    x, w = rule
    root, rows = math.sqrt(2.0), []
    for a, b, part in ((0 * c, -c, 1), (-c, 1 + 0 * c, 0)):
        outer = a[:, None] + (b - a)[:, None] * x
        low = (part * (-c[:, None] - outer))[:, :, None]
        z = outer[:, :, None] + low + (1 - low) * x + c[:, None, None]
        weight = (b - a)[:, None, None] * w[:, None] * w * (1 - low)
        y = 1 / (root * z + 2)
        rows.append(((weight * y**2).sum((1, 2)), -2 * root * (weight * y**3).sum((1, 2))))
    return rows[0][0] + rows[1][0], rows[0][1] + rows[1][1] - c / 4


def many_values() -> Finding:
    d, shader = equation()
    c = np.linspace(-0.99, -0.01, 10_000)
    answer, seconds = once(lambda: d((c, 1.0), shader))
    rule = gauss(8)
    theirs = warm(lambda: many_by_hand(c, rule))
    off = max(relative(float(got[i]), exact) for i in (0, 5_000, 9_999)
              for got, exact in zip((answer.value, answer.tangent), exact_quad(float(c[i]))))  # fmt: skip
    each = seconds / len(c)
    met = each <= 5e-6 and off <= 1e-11 and answer.converged
    note = f"{each * 1e6:.2f} us a value, by hand {theirs / len(c) * 1e6:.2f}"
    value, error = float(answer.value[0]), float(answer.error[0])
    return Finding(value, error, off, answer.evals, seconds, seconds / theirs, met, note)


def array_of_one() -> Finding:
    d, shader = equation()
    one = np.array([-0.7])
    seconds = number = math.inf
    for _ in range(5):  # machine code is made meanwhile
        answer, took = once(lambda: d((one, 1.0), shader))
        seconds, number = min(seconds, took), min(number, once(lambda: d((-0.7, 1.0), shader))[1])
    off = relative(float(answer.tangent[0]), exact_quad(-0.7)[1])
    ratio = seconds / number
    return Finding(float(answer.value[0]), float(answer.error[0]), off, answer.evals, seconds, ratio, ratio <= SAME)


def one_call() -> Finding:
    d, shader = equation()
    answer, seconds = once(lambda: d((-0.7, 1.0), shader))
    rule = gauss(10)
    ratio = seconds / warm(lambda: by_hand(-0.7, rule))
    value, slope = exact_quad(-0.7)
    off = max(relative(answer.value, value), relative(answer.tangent, slope))
    met = seconds <= 9e-5 and off <= 1e-13 and covered(answer, value, slope)
    return Finding(answer.value, answer.error, off, answer.evals, seconds, ratio, met)


def picture(program: str, parameter: float, value: float, slope: float) -> Finding:
    """512 x 512 pixels, and what they add up to."""
    d = potto.deriv(potto.compile(program).pixel)
    px, py = np.meshgrid(np.arange(512) / 512, np.arange(512) / 512)
    answer, seconds = once(lambda: d((px, 0.0), (py, 0.0), (parameter, 1.0)))
    off = max(relative(answer.value.sum(), value), relative(answer.tangent.sum(), slope))
    each = seconds / 512**2
    note = f"{each * 1e6:.2f} us a pixel"
    met = each <= 1e-7 and off <= 1e-9 and answer.converged
    return Finding(answer.value.sum(), answer.error.sum(), off, answer.evals, seconds, None, met, note)


def half_plane_pixels() -> Finding:
    return picture(PROGRAM, -0.7, *exact_quad(-0.7))


def circle_pixels() -> Finding:
    program = "def pixel(px, py, r) integral ([px, px + 1/512], [py, py + 1/512]) [x^2 + y^2 < r^2] d(x, y)"
    return picture(program, 0.8, math.pi * 0.16, math.pi * 0.4)


def thermostat() -> Finding:
    from references import line

    seconds, t = {}, 0.7
    for n in (4, 8, 16, 32):
        state = "u"
        for _ in range(n):
            state = f"step({state}, t)"
        f = potto.deriv(potto.compile(f"def step(u, t) 0.8*u + 0.5*[u < t]\ndef f(t) integral [0, 2] {state} d(u)").f)
        answer, seconds[n] = once(lambda f=f: f((t, 1.0)))
    with mp.workdps(40):
        value, slope = (float(x) for x in line.differenced(line.thermostat(32))(mp.mpf(t)))
    off, ratio = max(relative(answer.value, value), relative(answer.tangent, slope)), doubling(seconds)
    met = ratio <= STEP and off <= 1e-10 and covered(answer, value, slope)
    return Finding(answer.value, answer.error, off, answer.evals, seconds[32], ratio, met, listed(seconds))


def mesh_pairs() -> Finding:
    """Pixels and triangles of a warped mesh with their gradients, all at once and one by one."""
    from test_members import MODULE, NAMES, WRT, covered_area, mesh

    rows = mesh("warped", 400)
    f = potto.grad(MODULE.covered, WRT)
    together, seconds = once(lambda: f(**dict(zip(NAMES, rows.T))))
    single = [f(**dict(zip(NAMES, map(float, row)))) for row in rows]
    exact = np.array([covered_area(row) for row in rows])
    off = float(np.max(np.abs(together.value - exact))) * 256  # of a pixel's area
    ratio = together.evals / sum(one.evals for one in single)
    same = all(one.converged == told for one, told in zip(single, together.member_converged))
    met = ratio <= 1.1 and same and off <= 1e-10
    note = f"{together.evals / 400:.0f} evaluations a pair, {int(np.sum(together.member_converged))} of 400 converged"
    return Finding(exact.sum(), float(np.sum(together.error)), off, together.evals, seconds, ratio, met, note)


def quotient() -> Finding:
    """A lamp at a height of 0.3 over (s, 0.4) lights a disc: as a quotient, and multiplied out."""
    pixel = "integral ([u, u + 1/32], [v, v + 1/32])"
    square = "((x - s)^2 + (y - 0.4)^2 + 0.09)"
    program = (f"def quotient(u, v, s) {pixel} [1/(pi*{square}) > 1.6] d(x, y)\n"
               f"def product(u, v, s) {pixel} [1 > 1.6*pi*{square}] d(x, y)")  # fmt: skip
    m, (u, v) = potto.compile(program), np.meshgrid(np.arange(32) / 32, np.arange(32) / 32)
    as_written, multiplied = potto.deriv(m.quotient), potto.deriv(m.product)
    answer, seconds = once(lambda: as_written((u, 0.0), (v, 0.0), (0.5, 1.0)))
    ratio = seconds / once(lambda: multiplied((u, 0.0), (v, 0.0), (0.5, 1.0)))[1]
    off = relative(answer.value.sum(), 1 / 1.6 - math.pi * 0.09)
    met = ratio <= SAME and off <= 1e-9 and answer.converged
    return Finding(answer.value.sum(), answer.error.sum(), off, answer.evals, seconds, ratio, met)


def shader_as_parameter() -> Finding:
    d = "d(x, y)"
    pixel = "integral ([u, u + 1/256], [v, v + 1/256])"
    shade = "1/(sqrt(2)*(x + y + c) + 2)^2"
    program = (f"shade = \\(x, y) . c . {shade}\n"
               f"def given(u, v, c, shader) {pixel} shader (x, y) c*[x + y + c >= 0] {d}\n"
               f"def inlined(u, v, c) {pixel} {shade}*[x + y + c >= 0] {d}")  # fmt: skip
    m = potto.compile(program)
    shader, (u, v) = potto.deriv(m.shade), np.meshgrid(np.arange(256) / 256, np.arange(256) / 256)
    given, inlined = potto.deriv(m.given), potto.deriv(m.inlined)
    answer, seconds = once(lambda: given((u, 0.0), (v, 0.0), (-0.7, 1.0), shader))
    ratio = seconds / once(lambda: inlined((u, 0.0), (v, 0.0), (-0.7, 1.0)))[1]
    off = relative(answer.tangent.sum(), exact_quad(-0.7)[1])
    met = ratio <= SAME and off <= 1e-9 and answer.converged
    return Finding(answer.value.sum(), answer.error.sum(), off, answer.evals, seconds, ratio, met)


def camera() -> Finding:
    """A triangle in space, a pinhole camera, a point light, a shader with a threshold: sixteen pixels, by a corner."""
    from test_what_zeros_cost import CAMERA

    m = potto.compile(CAMERA)
    shader, pixel, w = potto.deriv(m.lambert), potto.deriv(m.pixel), 0.125
    seconds, evals, converged = [], [], True
    for i in range(16):
        u, v = (-0.5 + (2 * k + 1) * w for k in divmod(i, 4))
        at = [(u, 0.0), (v, 0.0), (w, 0.0), (0.1, 1.0), (0.0, 0.0), (0.85, 0.0)]
        pixel(shader, *at)  # what is made once is made now
        start = CLOCK()
        answer = pixel(shader, *at)
        seconds.append(CLOCK() - start)
        evals.append(answer.evals)
        converged &= answer.converged
    middle, ratio = statistics.median(seconds), max(evals) / statistics.median(evals)
    note = f"median of 16 pixels; the worst takes {max(seconds) * 1e3:.0f} ms, the ratio is that of evaluations"
    met = ratio <= 20 and converged and middle <= 1e-4
    return Finding(evals=int(statistics.median(evals)), seconds=middle, ratio=ratio, met=met, note=note)


LINES = (
    Line("conditions", "a function of n conditions and its derivative, n = 10, 20, 40, 80",
         f"twice as many cost at most {STEP} times as much", conditions),
    Line("gradient", "a function of 80 conditions, by 80 parameters; ratio to its value", "at most 4", gradient),
    Line("summands", "640 similar summands written out; ratio to `sum k in 1..640`", f"at most {SAME}", summands),
    Line("triangles", "4 triangles through a function, gradient in 28; ratio to written out", f"at most {SAME}",
         triangles),
    Line("octagon", "an 8-gon with edges along an axis up to 6e-17; ratio to rotated by 0.3", f"at most {SAME}",
         octagon),
    Line("one call", "eq. (1) and its derivative, warm; ratio to numpy by hand", "at most 90 us", one_call),
    Line("many values", "eq. (1) at 10,000 values of c in one call; ratio to numpy by hand", "at most 5 us a value",
         many_values),
    Line("array of one", "eq. (1) at an array of one; ratio to a number", f"at most {SAME}", array_of_one),
    Line("half-plane pixels", "512 x 512 pixels of eq. (1)", "at most 0.1 us a pixel", half_plane_pixels),
    Line("circle pixels", "512 x 512 pixels of a disc", "at most 0.1 us a pixel", circle_pixels),
    Line("thermostat", "n decisions, each on the one before, n = 4, 8, 16, 32",
         f"exact, and twice as many cost at most {STEP} times as much", thermostat),
    Line("mesh pairs", "400 pixels of triangles as an array; ratio of evaluations to one by one",
         "at most 1.1, and the same converge", mesh_pairs),
    Line("quotient", "1,024 pixels of `1/(pi*dot(l,l)) > th`; ratio to multiplied out", f"at most {SAME}", quotient),
    Line("shader as parameter", "256 x 256 pixels of eq. (1); ratio to the shader inlined", f"at most {SAME}",
         shader_as_parameter),
    Line("camera", "a triangle in space, its edges and shader: the derivative of 16 pixels by a corner",
         "0.1 ms a pixel, and no pixel evaluates over 20 times the median", camera),
)  # fmt: skip
