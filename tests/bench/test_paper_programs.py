"""The programs of the paper's study: gradients against other ways of finding them, and peers that are not here."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import potto

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"
sys.path.append(str(FOLDER))
from paper_programs import PROGRAMS, Program, by_clipping, differences, quadratic  # noqa: E402
from paper_studies import ALONG, PIXELS, STUDIES, TRIANGLE  # noqa: E402


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: program.name)
def test_programs_of_teg(program: Program) -> None:
    """Slopes of the reference are differences, good to nine digits."""
    wrt = list(program.parameters[: program.moving])
    found = potto.grad(getattr(potto.compile(program.text), program.function), wrt)(*program.place)
    slopes = np.array([float(t) for t in (found.tangent if program.moving > 1 else [found.tangent])])
    assert found.converged and abs(float(found.value) - program.exact(program.place)) < 1e-11
    assert np.abs(slopes - differences(program)).max() < 1e-9


@pytest.fixture
def peers(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(FOLDER))
    import paper_peers

    return paper_peers


@pytest.mark.parametrize("peer", ["teg", "prototype"])
def test_a_peer_that_is_not_here_is_told(peers: ModuleType, peer: str, tmp_path: Path) -> None:
    """A folder without it, and one in which another package has its name: what it does not offer is said."""
    assert "give a clone" in peers.asked(peer, None)["missing"]
    for name in ("teg", "potto"):
        (tmp_path / f"{name}.py").write_text("", encoding="utf-8")
    assert "cannot import name" in peers.asked(peer, tmp_path)["missing"]


@pytest.mark.slow
def test_the_study_has_its_tables() -> None:
    words = [sys.executable, str(FOLDER / "paper.py"), "--only", "programs", "--only", "shaders"]
    told = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert all(program.name in told for program in PROGRAMS) and told.count("SKIPPED") == 2
    assert all(f"{study}: {title}" in told for study, (title, _) in STUDIES.items())
    assert told.count("as published") == 4 and "swapped for the quad shader" in told


@pytest.mark.parametrize("kind", list(PIXELS))
def test_pixels_of_the_prototype(kind: str) -> None:
    """What the study takes for their values and slopes, by the clipped polygon and its differences to one side."""
    _, _, colours, (value, slope) = PIXELS[kind]
    shade = by_clipping(quadratic if kind == "quadratic" else lambda s, c: sum(a * b for a, b in zip(s, c)), 0.0, 1)

    def at(t: float) -> float:
        return shade([x + t * along for x, along in zip(TRIANGLE, ALONG, strict=True)] + list(colours))

    h = 1e-3
    weights = (-49 / 20, 6, -15 / 2, 20 / 3, -15 / 4, 6 / 5, -1 / 6)  # of sixth order
    assert abs(at(0.0) - value) < 1e-14
    for side in (h, -h):
        assert abs(sum(w * at(k * side) for k, w in enumerate(weights)) / side - slope) < 1e-9
