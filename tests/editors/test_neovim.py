"""Potto in Neovim, as `editors/neovim/potto.lua` sets it up, against the real server."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from editors_folder import EDITORS, Run

SESSION = Path(__file__).with_name("neovim.lua")


def test_a_session(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POTTO_EDITORS", str(EDITORS))
    said = run("nvim", "--clean", "--headless", "-c", f"luafile {SESSION}", "-c", "cquit")
    found = json.loads(said.partition("FOUND")[2].splitlines()[0])
    assert found["filetype"] == "potto" and found["commentstring"] == "# %s"
    assert found["diagnostic"]["code"] == "P0301"
    assert (found["diagnostic"]["line"], found["diagnostic"]["from"], found["diagnostic"]["to"]) == (2, 24, 35)
    assert "cover : (r: Real) -> Real" in found["hover"] and "dcover : (dr: (Real, Real))" in found["hover"]
    assert found["renamed"][0] == "from shapes import ball" and "ball(x, y, r)" in found["renamed"][1]
    assert found["renamed"][2] == "def ball(x, y, r) [x^2 + y^2 < r^2]"
    assert "if [x + c > 0.5] then 1 else 0" in found["fixed"]
    assert float(found["value"].split()[0]) == pytest.approx(math.pi / 16, rel=1e-8)  # a quarter of a disc
    assert "more" in found["lenses"]  # without being asked for
    assert found["groups"][:4] == ["pottoDefine", "pottoFunction", "pottoIntegral", "pottoConditional"]


OLDER = ["buf_attach_client", "codelens.refresh"]
TODAY = ["start", "inlay_hint.enable", "codelens.enable"]


@pytest.mark.parametrize(
    ("today", "called"),
    [("1", [*TODAY, *TODAY]), ("0", ["start_client", *OLDER, *OLDER, "codelens.refresh"])],
)
def test_functions_that_newer_versions_give_up_are_called_in_older_ones_alone(
    run: Run, monkeypatch: pytest.MonkeyPatch, today: str, called: list[str]
) -> None:
    """`start_client` is given up since 0.11, `codelens.refresh` since 0.12: stand-ins note which ones are called. One
    client serves both files of a folder."""
    monkeypatch.setenv("POTTO_EDITORS", str(EDITORS))
    monkeypatch.setenv("POTTO_TODAY", today)
    said = run("nvim", "--clean", "--headless", "-c", f"luafile {SESSION.with_name('neovim_names.lua')}", "-c", "cquit")
    assert json.loads(said.partition("FOUND")[2].splitlines()[0]) == called
