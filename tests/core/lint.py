"""Invariants of core terms.

Owns `lint`. Elaboration and every transform of terms must keep them; tests run it on whatever they build, and a
program never sees it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from potto.core.terms import (
    Array,
    Branch,
    Fold,
    Hole,
    If,
    Integral,
    Lam,
    Prim,
    Sum,
    Term,
    bound_names,
    children,
    postorder,
)

_COMPARISONS = frozenset(("lt", "le", "eq", "ne"))
_LOGIC = {"and": 2, "or": 2, "not": 1}
_TRUTH = _COMPARISONS | frozenset(_LOGIC)
_ARITIES: Mapping[str, int] = {"neg": 1, "div": 2, "pow": 2, **dict.fromkeys(_COMPARISONS, 2), **_LOGIC}
_AT_LEAST_TWO = frozenset(("add", "mul", "min", "max"))


def lint(term: Term) -> list[str]:
    """What is wrong with a term, as sentences for its builder; empty where all is well."""
    problems: list[str] = []
    for node in postorder(term):
        problems += _shape(node)
        problems += _truth(node)
        if isinstance(node, Integral):
            problems += _bounds(node)
    problems += _binders(term)
    return list(dict.fromkeys(problems))


def _shape(node: Term) -> Iterator[str]:
    """Every node has the parts that its kind needs."""
    match node:
        case Prim(op=op, args=args) if op in _AT_LEAST_TWO and len(args) < 2:
            yield f"`{op}` has {len(args)} argument"
        case Prim(op=op, args=args) if _ARITIES.get(op, len(args)) != len(args):
            yield f"`{op}` has {len(args)} arguments instead of {_ARITIES[op]}"
        case Branch(coordinates=()):
            yield "a branch has no surface"
        case Lam(params=params) if len(set(params)) != len(params):
            yield f"a function binds a parameter twice: {', '.join(params)}"
        case Integral(variables=variables):
            if not len(variables) == len(node.bounds) == len(node.hints):
                yield f"an integral over {len(variables)} variables has {len(node.bounds)} pairs of bounds"
            if len(set(variables)) != len(variables):
                yield f"an integral binds a variable twice: {', '.join(variables)}"
        case _:
            pass


def _truth(node: Term) -> Iterator[str]:
    """Truth values stand in conditions and under logic, and nowhere else; nothing else stands there."""
    if isinstance(node, If):
        if not _is_truth(node.condition):
            yield f"the condition of an if is a {type(node.condition).__name__}, not a truth value"
        numbers: tuple[Term, ...] = (node.then, node.orelse)
    elif isinstance(node, Prim) and node.op in _LOGIC:
        yield from (f"`{node.op}` of what is not a truth value" for arg in node.args if not _is_truth(arg))
        numbers = ()
    else:
        numbers = children(node)
    yield from (
        f"the truth value of `{part.op}` stands where a number belongs, in a {_name(node)}"
        for part in numbers
        if isinstance(part, Prim) and part.op in _TRUTH
    )


def _is_truth(term: Term) -> bool:
    return isinstance(term, Hole) or (isinstance(term, Prim) and term.op in _TRUTH)


def _name(node: Term) -> str:
    return f"`{node.op}`" if isinstance(node, Prim) else type(node).__name__


def _bounds(node: Integral) -> Iterator[str]:
    """Bounds and hints see only the variables further out."""
    for level, name in enumerate(node.variables):
        hidden = set(node.variables[level:])
        for bound in (*node.bounds[level], *node.hints[level]):
            seen = sorted(hidden & bound.free)
            if seen:
                yield f"a bound of {name} depends on {', '.join(seen)}, which it cannot see"


def _binders(term: Term) -> Iterator[str]:
    """No name is bound inside of a binder of the same name, and none is both bound and free."""
    inside: dict[Term, frozenset[str]] = {}
    for node in postorder(term):
        below = frozenset[str]().union(*(inside[part] for part in children(node)))
        own = frozenset(bound_names(node))
        scope = _scope(node, inside)
        yield from (f"{name} is bound again inside of its own scope" for name in sorted(own & scope))
        inside[node] = below | own
    yield from (f"{name} is both free and bound" for name in sorted(inside[term] & term.free))


def _scope(node: Term, inside: Mapping[Term, frozenset[str]]) -> frozenset[str]:
    """The names bound within the scope of a binder: the names it binds must not be among them."""
    match node:
        case Lam(body=body) | Sum(body=body) | Integral(body=body) | Array(body=body) | Fold(body=body):
            return inside[body]
        case _:
            return frozenset()
