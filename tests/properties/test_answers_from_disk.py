"""What comes from disk is what would have been made: answers are those of a process that keeps nothing, to the bit."""

from __future__ import annotations

from pathlib import Path

import pytest
from how_many import examples
from program_checks import where
from program_source import random_program

import potto
from potto.kernels import compile as kernels
from potto.runtime.integration import problem


@pytest.mark.filterwarnings("ignore::potto.ProgramWarning")
@pytest.mark.parametrize("number", range(0, 3 * examples(16, 300), 3))
def test_random_programs_answer_the_same_from_disk(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("POTTO_CACHE", "off")
    without, _ = answer(number)
    monkeypatch.setenv("POTTO_CACHE", str(tmp_path))
    (first, _), (second, recalled) = answer(number), answer(number)
    assert without == first == second
    assert recalled > 0 or not second.startswith("("), "or it was refused"


def answer(number: int) -> tuple[str, int]:
    """The dual in a process that knows nothing yet, or why there is none, and how many kernels were found on disk."""
    kernels.clear()
    problem.clear()
    p = where(number)
    with potto.settings(max_evals=100_000):
        try:
            found = potto.deriv(potto.compile(random_program(number)[0]).f)((p.t, p.dt), (p.s, p.ds))
        except potto.PottoError as error:
            return repr([(said.code, said.message) for said in error.diagnostics]), 0  # texts are numbered
    numbers = (found.value, found.error, found.tangent, found.tangent_error, found.evals, found.converged)
    return repr(numbers), found.stats["kernels from disk"]
