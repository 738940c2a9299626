"""The text of the kernel that a definition becomes, for people who look inside."""

from __future__ import annotations

from potto.core.terms import Lam, Term, lam, postorder
from potto.kernels.cells import Pattern
from potto.kernels.compile import kernel
from potto.projects.settings import DEFAULTS
from potto.runtime.evaluate import Program
from potto.runtime.evaluation.arguments import uncurried


def kernel_text(program: Program, file: str, name: str) -> str | None:
    """The kernel of a function that carries one tangent in every number; None for what is not a function."""
    term = program.linker.function(program.linker.term(file, name))
    if not isinstance(term, Lam):
        return None
    machine = program.machine(DEFAULTS).with_directions(1)
    body = _body(term)
    sizes: list[int] = []
    inner: Term = term
    while isinstance(inner, Lam):
        sizes.append(len(inner.params))
        inner = inner.body
    whole, _ = uncurried(term, tuple(sizes))
    patterns = tuple(_pattern(parameter, body) for parameter in whole.params)
    return kernel(lam(whole.params, whole.body), patterns, 1, True, machine).text


def _body(term: Term) -> Term:
    while isinstance(term, Lam):
        term = term.body
    return term


def _pattern(parameter: str, body: Term) -> Pattern:
    """A moving number, or a function that moves if the parameter is called."""
    from potto.core.terms import App, Var

    for node in postorder(body):
        head = node.function if isinstance(node, App) else None
        if isinstance(head, Var) and head.name == parameter:
            return ("function", False, True)
    return (False, (2,))
