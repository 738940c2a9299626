"""What to do about an estimate that is not as accurate as was asked: told by why it is not.

Owns `advice`, the reasons of integrals that diverge and of samples that were too few, and `ROUGH`, of which a reader
need not be warned: that answer came with its error. The reasons are those of `Estimate.reasons`; one that is not known
here gets advice that suits all.
"""

from __future__ import annotations

from collections.abc import Iterable

from potto.integrate.adaptive.divergence import BOUNDLESS
from potto.integrate.adaptive.undefined import UNDEFINED

INFINITE = "the integral is infinite, or beyond what numbers can hold"
NO_VALUE = "the integral has no value, or none within reach"
DIVERGENT = {INFINITE, NO_VALUE}
TOO_FEW = "so many samples give fewer digits than were asked for"
ROUGH = "an answer that it is made of is no more accurate"
_LESS = "ask for less accuracy (`--rtol`)"
_POLE = (
    "more evaluations are of no use to an integral that diverges: look for a pole in the domain or at its ends, or a "
    "tail that falls too slowly, and leave it out by the bounds or a condition"
)
_MORE = "allow more evaluations (`--max-evals`) or " + _LESS
# What a reason has in it, and what helps then. More evaluations help where it is they that ran out, and nowhere else.
_ADVICE: tuple[tuple[str, str], ...] = (
    ("the budget of evaluations is spent", _MORE + "; if no number of them is enough, the integral may diverge"),
    (
        "no accuracy was reached",
        f"{_POLE}; if the integrand is only rough, sampling gives a few digits (`--method mc`)",
    ),
    (
        "lies on a bound",
        "more evaluations change nothing: ask at parameters beside these, where the surface lies inside or outside",
    ),
    (BOUNDLESS, "more evaluations change nothing: ask at parameters beside these"),
    ("along the axes", "turn the variables of integration, so that no surface runs along several of their axes"),
    (TOO_FEW, "sample more (`--samples`) or " + _LESS),
    ("no sample fell", "sample more (`--samples`), or integrate by `--method quadrature`"),
    ("too many roots", "shorten the domain, or sample (`--method mc`)"),
    ("inside an inner integral", "write both integrals as one: `integral ([..], [..]) .. d(x, y)`"),
    ("rounding", "more evaluations cannot help, the numbers have no more digits: " + _LESS),
    (
        UNDEFINED,
        "leave such places out by the bounds, or guard the condition: `if [x > -1] then [sqrt(1 + x) < t] else 0`",
    ),
    (INFINITE, _POLE),
    (NO_VALUE, _POLE),
    ("not a number", "look for a builtin that is used where it is not defined, and guard it with a condition"),
)


def advice(reasons: Iterable[str]) -> str:
    """What helps against the reasons, each advice once."""
    found = dict.fromkeys(next((help for mark, help in _ADVICE if mark in reason), _MORE) for reason in reasons)
    return "; ".join(found)
