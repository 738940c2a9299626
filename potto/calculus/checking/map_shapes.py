"""What is wrong with a map before its inverse is looked for: how many components, kinks, calls of who knows what."""

from __future__ import annotations

from collections.abc import Sequence

from potto.calculus.algebra.ranges import Box
from potto.calculus.checking.solvability import COMPONENTS, NO_INVERSE, NOT_DIFFERENTIABLE, ConditionProblem, kinks
from potto.calculus.solving.inverse_map import listed
from potto.core.printer import format_term
from potto.core.terms import App, Term, postorder


def wrong_shape(components: Sequence[Term], variables: Sequence[str], box: Box) -> ConditionProblem | None:
    """Too few or too many components, or a place where one is not differentiable."""
    if len(components) != len(variables):
        return ConditionProblem(
            COMPONENTS,
            f"{many(len(components), 'component')} over {many(len(variables), 'variable')}",
            f"{len(components)} here, {many(len(variables), 'variable')}",
            (),
            f"give {many(len(variables), 'component')}: an invertible map has as many as variables",
        )
    kink = kinks(components, variables, box)
    if kink is None:
        return None
    return ConditionProblem(
        NOT_DIFFERENTIABLE,
        f"the map is not differentiable where `{format_term(kink)}` is 0",
        "has a kink",
        ("a diffeomorphism is differentiable everywhere, and so is its inverse",),
        "keep to one side of the kink with `where`, or split the map at it",
    )


def unknown_call(components: Sequence[Term], variables: Sequence[str]) -> ConditionProblem | None:
    """A call of a parameter, or of what always needs itself again, of which nothing is known before the map is used."""
    for node in postorder(*components):
        if isinstance(node, App) and node.free & frozenset(variables):
            return ConditionProblem(
                NO_INVERSE,
                f"no inverse was found for ({', '.join(map(format_term, components))}) in {listed(variables)}: "
                f"what `{format_term(node)}` gives is not known here",
                "not known here",
                ("a diffeomorphism is inverted where it is defined, whatever is given to it later",),
                "write what the function does instead of calling it, or pass its values as numbers",
            )
    return None


def many(count: int, noun: str) -> str:
    """A number of things."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
