"""What can go wrong while a program is evaluated: the kinds of diagnostics P05xx raised by kernels."""

from __future__ import annotations

from potto.diagnostics import PottoError, declare
from potto.source import NOWHERE as NOWHERE

_KINDS = {"tuple": "a tuple", "list": "an array", "Rows": "an array"}

NOT_A_NUMBER = declare("P0502", "a value of the wrong kind where a number is needed")
TOO_DEEP = declare("P0503", "a recursion that does not end")
BROKEN = declare("P0504", "a program with errors cannot be evaluated")
NO_MEASURE = declare("P0506", "a measure that its parameters give no density")
BAD_SUM = declare("P0507", "the bounds of a sum are not integers")
NO_MEANING = declare("P0508", "a delta outside of an integral")
WRONG_CALL = declare("P0509", "a function called with values that do not fit it")


class Coincidence(PottoError):
    """A second derivative is asked for where a surface is met outside of integrals (P0505): what lies beside it tells
    whether there is one (`evaluation/derivatives/sides`)."""


def not_a_number(value: object) -> PottoError:
    kind = _KINDS.get(type(value).__name__, "a function")
    return PottoError([NOT_A_NUMBER(NOWHERE, f"{kind} stands where a number is needed")])


def wrong_call(message: str, help: str = "") -> PottoError:
    return PottoError([WRONG_CALL(NOWHERE, message, help=help)])
