"""Builtins applied to arguments: `fst snd deriv delta` and the entries of `PRIMITIVES`."""

from __future__ import annotations

from collections.abc import Sequence

from potto.core.terms import App, Branch, Global, If, Proj, Term, Tuple, Var, apply, delta, deriv, hole, proj, tuple_
from potto.elaborate.signatures import dims_of_term
from potto.primitives import PRIMITIVES
from potto.query import Database

UNARY = ("fst", "snd", "deriv", "delta")


def parameters_of(name: str) -> int:
    """How many parameters a builtin has where it is passed on; those that take any number have two."""
    return 1 if name in UNARY else PRIMITIVES[name].arity or 2


def applied(db: Database, name: str, args: Sequence[Term]) -> Term:
    """A builtin applied to one group of arguments."""
    if name not in UNARY:
        return _primitive(name, tuple(args))
    if not args:
        return hole(f"`{name}` needs an argument")
    if name == "delta":
        return delta(_coordinates(db, args))
    only = args[0] if len(args) == 1 else tuple_(args)
    if name == "deriv":
        return deriv(only) if len(args) == 1 else hole("`deriv` takes one function")
    return proj(only, int(name == "snd"))


def _primitive(name: str, args: tuple[Term, ...]) -> Term:
    arity = PRIMITIVES[name].arity
    wanted = arity or 2
    if len(args) == 1 and wanted > 1:
        (only,) = args
        if isinstance(only, Tuple):
            args = only.items
        elif isinstance(only, App | Var | Proj | Global | If | Branch):
            args = tuple(proj(only, place) for place in range(wanted))
    if len(args) != wanted and not (arity is None and len(args) > wanted):
        return hole(f"`{name}` takes {wanted} argument{'s' if wanted != 1 else ''}")
    return apply(name, *args)


def _coordinates(db: Database, args: Sequence[Term]) -> tuple[Term, ...]:
    """What a delta is of: numbers, or the result of a diffeomorphism."""
    if len(args) != 1:
        return tuple(args)
    (only,) = args
    if isinstance(only, Tuple):
        return only.items
    dims = dims_of_term(db, only)
    return (only,) if dims is None else tuple(proj(only, place) for place in range(dims))
