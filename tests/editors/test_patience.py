"""What the tests in a real editor wait for is given one patience, whatever else the machine does."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

E2E = Path(__file__).parents[2] / "editors" / "vscode" / "e2e"
ASKED = """
import { until } from "./waiting.mjs";
const begun = Date.now();
let asked = 0;
const third = await until(async () => ++asked === 3 && "there");
const never = await until(() => false);
console.log(JSON.stringify({ third, asked, never, waited: Date.now() - begun }));
"""


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_something_is_asked_until_it_is_there_or_the_patience_is_over() -> None:
    ran = subprocess.run(["node", "--input-type=module", "-e", ASKED], cwd=E2E, capture_output=True, text=True,
                         env={**os.environ, "POTTO_E2E_PATIENCE": "300"}, check=True)  # fmt: skip
    found = json.loads(ran.stdout)
    assert (found["third"], found["asked"], found["never"]) == ("there", 3, False)
    assert found["waited"] >= 300  # ms; above only a slow machine is


def test_no_test_counts_how_often_it_has_waited() -> None:
    """But that which kills an evaluation again and again: each time one must have begun."""
    counted = {path.name for path in E2E.glob("*.mjs") if "waitForTimeout" in path.read_text(encoding="utf-8")}
    assert counted == {"previews.mjs"}
