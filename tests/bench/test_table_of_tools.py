"""The table of other tools in the README: its numbers for what is installed, and all tools that are asked."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
TABLE = (ROOT / "README.md").read_text("utf-8").partition("## Beside what you know")[2].partition("\n## ")[0]


@pytest.fixture
def neighbours(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    sys.modules.pop("neighbours", None)
    import neighbours

    return neighbours


def test_potto_has_the_whole_derivative(neighbours: ModuleType) -> None:
    (answer,) = neighbours.by_potto()
    ((value, slope),) = answer.pairs
    assert abs(value - neighbours.EXACT[0]) < 1e-13 and abs(slope - neighbours.EXACT[1]) < 1e-13
    assert f"{slope:.12f}" in TABLE


@pytest.mark.parametrize("name", ["JAX", "PyTorch"])
def test_sums_have_a_third_of_it(neighbours: ModuleType, name: str) -> None:
    package, asked = neighbours.TOOLS[name]
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"{package} is not installed: `make test-bridges` runs this")
    (answer,) = asked()
    ((_, slope),) = answer.pairs
    assert abs(slope - neighbours.EXACT[1] / 3) < 1e-4 and f"{slope:.6f}" in TABLE


def test_the_table_has_every_tool(neighbours: ModuleType) -> None:
    assert all(name in TABLE for name in neighbours.TOOLS)
