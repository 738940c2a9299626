r"""Derivatives as LaTeX, for notebooks: the interior and the boundary under their integral, and what is left of them.

Owns `derivative_latex` and `function_derivative`, which finds what that typesets. Formulas are typeset by
`syntax.typesetting`.
"""

from __future__ import annotations

from potto.calculus.differentiation.higher_order import NoText, first_derivative
from potto.calculus.explanation.explain import describe, explain_derivative
from potto.calculus.explanation.layout import DerivativeText, IntegralText
from potto.calculus.explanation.notation import Notation, numbers_of
from potto.checking.facts import LONG
from potto.core.terms import Deriv, Global, Term
from potto.elaborate import core_term, elaborate_expression
from potto.modules import DefinitionTarget, resolve
from potto.query import Database
from potto.syntax import nodes
from potto.syntax.typesetting import latex, latex_integral
from potto.types import derivative_type, format_type, infer_expression


def derivative_latex(found: DerivativeText, name: str) -> str | None:
    r"""A derivative as LaTeX without `$`: as the sum of interior and boundary under its integral, and integrated.

    `name` is what the function is called. None where it has no form in symbols, or one that is too long.
    """
    tangents = found.tangents
    head = r"\partial " + str(latex(name))
    sides = [_of_integral(found.integrals[0], tangents)] if found.alone and len(found.integrals) == 1 else []
    whole = _readable(found.tangent, tangents) if found.tangent else None
    if whole is not None and found.divisors:
        apart = [str(latex(f"{divisor} != 0", tangents)) for divisor in found.divisors]
        whole += rf" \quad \text{{for }} {', '.join(apart)}"
    shown = list(dict.fromkeys(side for side in (*sides, whole) if side is not None))
    if not shown:
        return None
    lines = [f"{head if not number else ''} &= {side}" for number, side in enumerate(shown)]
    return r"\begin{aligned}" + r" \\ ".join(lines) + r"\end{aligned}"


def function_derivative(db: Database, file: str, expr: nodes.Expr, name: str) -> DerivativeText:
    """The derivative of an expression that is a function: of a definition in its own words, else of `name`."""
    while isinstance(expr, nodes.Paren):
        expr = expr.inner
    if isinstance(expr, nodes.Name):
        target = resolve(db, file, expr.id)
        if isinstance(target, DefinitionTarget) and not isinstance(core_term(db, target.file, target.name), Deriv):
            return explain_derivative(db, target.file, target.name)
    found = elaborate_expression(db, file, expr)
    type = format_type(derivative_type(infer_expression(db, file, expr).type))

    def term_of(target: Global) -> Term:
        return core_term(db, target.module, target.name)

    try:
        notation = Notation(numbers=numbers_of(db, found.term, expr))
        return describe(first_derivative(found.term, term_of), name, type, term_of, notation)
    except NoText as problem:
        return DerivativeText(name, type, "", False, (), (str(problem),))


def _readable(text: str, tangents: frozenset[str]) -> str | None:
    """A formula, if it is not too long to be read."""
    return latex(text, tangents) if len(text) <= LONG else None


def _of_integral(item: IntegralText, tangents: frozenset[str]) -> str | None:
    """The derivative of one integral before its deltas are integrated out; None if a part has no form."""
    alone = not item.deltas and not item.bounds
    parts = [(item.interior, "interior")] if item.interior and (item.interior != "0" or alone) else []
    parts += [(text, "boundary") for text in item.deltas]
    found = [(_readable(text, tangents), what) for text, what in parts]
    bounds = [_readable(text, tangents) for text in item.bounds]
    if any(text is None for text, _ in found) or any(text is None for text in bounds):
        return None
    moving = [rf"\underbrace{{{text}}}_{{\text{{moving bound}}}}" for text in bounds]
    if not found:
        return " + ".join(moving) or None
    braced = [rf"\underbrace{{{text}}}_{{\text{{{what}}}}}" for text, what in found]
    body = braced[0] if len(braced) == 1 else rf"\Bigl( {' + '.join(braced)} \Bigr)"
    whole = latex_integral(item.head, item.variables, body, tangents)
    return None if whole is None else " + ".join([whole, *moving])
