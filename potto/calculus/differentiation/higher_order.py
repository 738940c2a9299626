"""Derivatives of derivatives, and of deltas, as terms for people to read.

Owns `first_derivative`, which makes a derivative a function that can be differentiated once more, and `moving_deltas`.
"""

from __future__ import annotations

from collections.abc import Callable

from potto.calculus.differentiation.derivative import NotSmooth
from potto.calculus.differentiation.dual import Differentiator
from potto.calculus.differentiation.level_sets import coefficient
from potto.calculus.inlining.expand import Resolve, heads_of, named
from potto.calculus.solving.pivots import NoClosedForm, Roots
from potto.core.terms import (
    ZERO,
    Delta,
    Deriv,
    Global,
    Integral,
    Lam,
    Term,
    app,
    lam,
    mul,
    postorder,
    var,
)
from potto.diagnostics import PottoError


class NoText(Exception):
    """A derivative that is not written down: says why."""


def first_derivative(term: Term, resolve: Resolve) -> Term:
    """A function as it is; of a derivative, the tangent as a function of the parameters and their tangents.

    Differentiated, that is the second derivative along a curve: `dt` is the tangent of t, `ddt` that of dt.
    Raises NoText.
    """
    at = named(term, resolve) if isinstance(term, Global) else term
    if not isinstance(at, Deriv):
        return at if isinstance(at, Lam) else term
    body, params = first_derivative(at.function, resolve), list[str]()
    while isinstance(body, Lam):
        params.extend(body.params)
        body = body.body
    if heads_of(body) & set(params):
        raise NoText("a second derivative is written down only where no parameter is a function")
    tangents = {p: var(f"d{p}") for p in params}
    names = tuple(dict.fromkeys((*params, *(f"d{p}" for p in params))))
    try:
        return lam(names, Differentiator(resolve, wanted=Roots.ALL).dual(body, tangents)[1])
    except (NoClosedForm, NotSmooth) as problem:
        raise NoText(f"the first derivative has no closed form: {problem}") from None
    except PottoError as problem:
        raise NoText(problem.diagnostics[0].message) from None


def moving_deltas(node: Integral, rate: Callable[[Term], Term]) -> list[Term]:
    """What deltas in an integrand give when they move: their factor, their speed and the derivative of delta."""
    found: list[Term] = []
    for spike in [inner for inner in postorder(node.body) if isinstance(inner, Delta)]:
        speed, parts = rate(spike.coordinates[0]), coefficient(node.body, spike)
        if speed is not ZERO and parts is not None:
            found.append(mul(parts[0], speed, app(var("delta'"), (spike.coordinates[0],))))
    return found
