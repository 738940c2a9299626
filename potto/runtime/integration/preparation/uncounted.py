"""Deltas of derivatives under an integral that were not found: told, for without them the answer would be wrong.

Owns `NOT_COUNTED` and `not_found`.
"""

from __future__ import annotations

from potto.diagnostics import PottoError, declare
from potto.kernels import errors

NOT_COUNTED = declare("P0510", "deltas of a derivative that were not found")


def not_found(reason: str) -> PottoError:
    return PottoError([NOT_COUNTED(
        errors.NOWHERE, f"the deltas of a derivative under this integral were not found: {reason}",
        help="differentiate the integral as a whole",
    )])  # fmt: skip
