"""The programs under examples/ check without complaint, and each value that is written in them is a test.

Those values come from the closed forms that stand beside them in comments, evaluated with mpmath; that they hold is
`potto test examples/`, a command of README.md, whose commands are run.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from potto.evaluating.world import World
from potto.runtime.script import Shown
from potto.syntax import live_expressions

ROOT = Path(__file__).resolve().parents[2] / "examples"
WORLDS = ("worked", "dynamics", "probability", "fields")
PROGRAMS = sorted(path for world in WORLDS for path in (ROOT / world).rglob("*.po"))


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda p: p.stem)
def test_values_that_are_written_are_tests(path):
    world = World([ROOT / path.relative_to(ROOT).parts[0]])
    file = world.key(path)
    complaints = [item.diagnostic for item in world.diagnostics(file)]
    assert [d.message for d in complaints if d.severity in ("error", "warning")] == []
    text = path.read_text()
    assert sum(live.expected is not None for live in live_expressions(text)) == len(re.findall(r"^#= ", text, re.M))


def test_the_programs_of_the_paper_run_as_printed():
    world = World([ROOT / "paper"])
    shown = list(world.run(world.key(ROOT / "paper" / "main.po")))
    assert all(isinstance(event, Shown) for event in shown)
    assert [event.text for event in shown] == ["(0, 0)"] * 3  # the edge passes through the corner (1, 1) only


# u = x + y has the density w(u) = u on [0, 1] and 2 - u on [1, 2], so with the shader s the value is the integral of
# s(u + c) w(u) over u >= -c, and the tangent that of s'(u + c) w(u) plus s(0) w(-c); both by mpmath at 40 digits.
@pytest.mark.parametrize(
    ("shader", "value", "tangent"),
    [
        ("const", 0.755, 0.7),
        ("lin", 0.28985012527965065568, 0.18891560822213426497),
        ("quad", 0.11390386576943940145, 0.0455890722835269362),
    ],
)
def test_the_renderer_where_the_edge_crosses_the_pixel(shader, value, tangent):
    world = World([ROOT / "paper"])
    found = world.evaluate(world.key(ROOT / "paper" / "main.po"), f"drenderer(dc=(-0.7, 1), d{shader}_shader)").estimate
    # smooth integrands on either side of a straight edge: quadrature is exact to rounding
    assert found.value == pytest.approx(value, rel=1e-12, abs=0)
    assert found.tangent == pytest.approx(tangent, rel=1e-12, abs=0)
