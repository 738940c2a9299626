"""Abilities that are told by an accuracy: regions of the catalogue, against answers by mathematics."""

from __future__ import annotations

import sys
from typing import Any

from ability_lines import CATALOGUES, Finding, Line, covered, once, relative

import potto

sys.path += CATALOGUES
from regions import REGIONS, Region

SAME = 1.5  # what the same may cost, written in another way


def asked(region: Region, **chosen: Any) -> tuple[Any, float]:
    """The value and the derivative of a region, and the seconds of a call."""
    f = potto.deriv(potto.compile(region.program).f)
    with potto.settings(**chosen):
        return once(lambda: f((region.at, 1.0)))


def accuracy(name: str, within: float, seconds: float) -> Finding:
    """A region to an accuracy of value and derivative, in some time."""
    region = REGIONS[name]
    answer, spent = asked(region)
    off = max(relative(answer.value, region.value), relative(answer.tangent, region.derivative))
    met = off <= within and spent <= seconds and covered(answer, region.value, region.derivative)
    note = f"derivative {answer.tangent:.10g} ± {answer.tangent_error:.1e}"
    return Finding(answer.value, answer.error, off, answer.evals, spent, None, met, note)


def line(name: str, what: str, within: float, seconds: float = 1.0) -> Line:
    goal = f"value and derivative to {within:.0e}, with bounds that hold, in {seconds:g} s"
    return Line(name, what, goal, lambda: accuracy(name, within, seconds))


def alike(name: str, other: Region) -> Finding:
    """A region, and the same written in another way."""
    region = REGIONS[name]
    answer, seconds = asked(region)
    ratio = seconds / asked(other)[1]
    off = max(relative(answer.value, region.value), relative(answer.tangent, region.derivative))
    met = ratio <= SAME and off <= 1e-8 and covered(answer, region.value, region.derivative)
    return Finding(answer.value, answer.error, off, answer.evals, seconds, ratio, met)


def six_as_product() -> Region:
    from dataclasses import replace

    names = "xyzwuv"
    body = "*".join(f"[{v} < t]" for v in names)
    box = ", ".join(["[0, 1]"] * len(names))
    return replace(REGIONS["six below"], program=f"def f(t) integral ({box}) {body} d({', '.join(names)})")


def ridge(**chosen: Any) -> Finding:
    """What is asked for more accurately must not come with a larger bound."""
    region = REGIONS["ridge in space"]
    answer, seconds = asked(region, **chosen)
    rough = answer if chosen else asked(region, rtol=1e-3)[0]
    off = relative(answer.value, region.value)
    met = answer.error <= rough.error and off <= chosen.get("rtol", 1e-8) and covered(answer, region.value)
    return Finding(answer.value, answer.error, off, answer.evals, seconds, answer.error / rough.error, met)


LINES = (
    line("gyroid slab", "a gyroid over a period in x and y, 0 < z < 1", 1e-8),
    line("union of balls", "two balls that overlap", 1e-8),
    Line("ball, nested", "a ball as three integrals; ratio to one", f"at most {SAME}, to 1e-8",
         lambda: alike("ball, nested", REGIONS["ball"])),
    line("touching ball, 5-D", "a ball that touches its box on all sides", 1e-8, 10.0),
    line("touching ball, 6-D", "a ball that touches its box on all sides", 1e-8, 10.0),
    line("five normals", "a half-space under five normal densities", 1e-8),
    Line("six below", "`[x1 < t and … and x6 < t]`; ratio to the product of six brackets", f"at most {SAME}, to 1e-8",
         lambda: alike("six below", six_as_product())),
    Line("smooth, 8-D, nested", "a smooth function as eight integrals; ratio to one", f"at most {SAME}, to 1e-8",
         lambda: alike("smooth, 8-D, nested", REGIONS["smooth, 8-D"])),
    Line("ridge", "a Gaussian ridge in three variables by default; ratio of the bound to that at rtol=1e-3",
         "at most 1, and 1e-8", ridge),
    Line("ridge at 1e-3", "the same with rtol=1e-3", "1e-3, with a bound that holds", lambda: ridge(rtol=1e-3)),
    line("torus", "a torus", 1e-8),
    line("arm", "an arm of two links with normal angles", 1e-9),
)  # fmt: skip
