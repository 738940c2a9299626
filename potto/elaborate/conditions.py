"""Conditions: comparisons and logic to conditionals, plain or diffeomorphic.

Owns `choose`. A condition is a truth-valued term (lt le eq ne and or not), an Iverson bracket that is made already, or
the result of a diffeomorphism. `a < b` made diffeomorphic is a `Branch` on the surface b - a.
"""

from __future__ import annotations

from collections.abc import Callable, Set

from potto.core.terms import (
    ONE,
    ZERO,
    App,
    Branch,
    Const,
    Global,
    Hole,
    If,
    Prim,
    Proj,
    Term,
    Tuple,
    Var,
    branch,
    if_,
    postorder,
    prim,
    proj,
    sub,
)

COMPARISONS = frozenset(("lt", "le", "eq", "ne"))
LOGIC = frozenset(("and", "or", "not"))
_EVERYWHERE = frozenset(("add", "neg", "mul", "abs", "min", "max"))  # defined for all numbers
Note = Callable[[Term, Term], None]  # (the condition, the branch that was made of it)


def compare(op: str, a: Term, b: Term) -> Term:
    """One comparison as a truth-valued term."""
    match op:
        case "<":
            return prim("lt", a, b)
        case "<=":
            return prim("le", a, b)
        case ">":
            return prim("lt", b, a)
        case ">=":
            return prim("le", b, a)
        case "==":
            return prim("eq", a, b)
        case _:
            return prim("ne", a, b)


def logic(op: str, parts: list[Term]) -> Term:
    """`and` or `or` of several conditions."""
    result = parts[-1]
    for part in reversed(parts[:-1]):
        result = prim(op, part, result)
    return result


def is_truth(term: Term) -> bool:
    """Whether a term is a comparison or made of comparisons."""
    return isinstance(term, Prim) and (term.op in COMPARISONS or term.op in LOGIC)


def is_indicator(term: Term) -> bool:
    """Whether a term is an Iverson bracket: conditionals, all of whose ends are 1 or 0."""
    if not isinstance(term, If | Branch):
        return False
    stack, seen = [term.then, term.orelse], set[Term]()
    while stack:
        end = stack.pop()
        if isinstance(end, If | Branch):
            if end not in seen:
                seen.add(end)
                stack += (end.then, end.orelse)
        elif end is not ONE and end is not ZERO:
            return False
    return True


def negated(condition: Term) -> Term:
    """The opposite of a truth-valued term. `not` moves inwards: the opposite of a < b is b <= a."""
    assert isinstance(condition, Prim)
    a = condition.args[0]
    match condition.op:
        case "not":
            return a
        case "lt":
            return prim("le", condition.args[1], a)
        case "le":
            return prim("lt", condition.args[1], a)
        case "eq":
            return prim("ne", a, condition.args[1])
        case "ne":
            return prim("eq", a, condition.args[1])
        case op:
            return prim("or" if op == "and" else "and", *(_opposite(part) for part in condition.args))


def _opposite(part: Term) -> Term:
    return negated(part) if is_truth(part) else prim("not", part)


def choose(
    condition: Term, then: Term, orelse: Term, jumps: bool, note: Note, counted: Set[str] = frozenset()
) -> Term:  # fmt: skip
    """`then` where a condition holds, else `orelse`. `jumps`: comparisons are made diffeomorphic, but for those of
    numbers that count something, by these names."""
    if is_truth(condition):
        assert isinstance(condition, Prim)
        if not jumps and not _has_bracket(condition):
            return if_(condition, then, orelse)
        return _chosen(condition, then, orelse, jumps, note, counted)
    if is_indicator(condition):
        return _refilled(condition, then, orelse, note)
    if isinstance(condition, Hole):
        return condition
    coordinates = coordinates_of(condition)
    made = branch(coordinates, False, then, orelse)
    note(condition, made)
    return made


def coordinates_of(value: Term) -> tuple[Term, ...]:
    """The components of a diffeomorphism's result, as far as they are known; of an unknown one, the first."""
    if isinstance(value, Tuple):
        return value.items
    if isinstance(value, App | Var | Proj | Global | If | Branch):
        return (proj(value, 0),)
    return (value,)


def _has_bracket(condition: Prim) -> bool:
    """Whether a bracket (or a diffeomorphism's result) stands among the parts of a condition."""
    stack: list[Term] = [condition]
    while stack:
        part = stack.pop()
        if not is_truth(part):
            return True
        assert isinstance(part, Prim)
        if part.op in LOGIC:
            stack += part.args
    return False


def _chosen(condition: Prim, then: Term, orelse: Term, jumps: bool, note: Note, counted: Set[str]) -> Term:
    match condition.op:
        case "and" | "or":
            first, rest = condition.args
            inner = choose(rest, then, orelse, jumps, note, counted)
            if condition.op == "and":
                return choose(first, inner, orelse, jumps, note, counted)
            return choose(first, then, inner, jumps, note, counted)
        case "not":
            inside = condition.args[0]
            if is_truth(inside):
                return choose(negated(inside), then, orelse, jumps, note, counted)
            return choose(inside, orelse, then, jumps, note, counted)
        case "lt" | "le" if jumps and not _fixed(condition, counted):
            a, b = condition.args
            made = branch((sub(b, a),), condition.op == "lt", then, orelse)
            note(condition, made)
            return made
        case _:
            return if_(condition, then, orelse)


def _fixed(condition: Prim, counted: Set[str]) -> bool:
    """Whether a comparison is between numbers that nothing moves: there is no surface then.

    What has no value for some numbers stays a surface, which says so.
    """
    if not condition.free:
        return not any(isinstance(part, App | Global) for part in postorder(condition))
    sides = postorder(*condition.args)
    return condition.free <= counted and all(
        isinstance(part, Var | Const) or (isinstance(part, Prim) and part.op in _EVERYWHERE) for part in sides
    )


def _refilled(indicator: Term, then: Term, orelse: Term, note: Note) -> Term:
    """An Iverson bracket's conditionals with other ends."""
    made: dict[Term, Term] = {ONE: then, ZERO: orelse}
    stack = [indicator]
    while stack:
        term = stack[-1]
        if term in made:
            stack.pop()
            continue
        assert isinstance(term, If | Branch)
        missing = [end for end in (term.then, term.orelse) if end not in made]
        if missing:
            stack += missing
            continue
        stack.pop()
        if isinstance(term, If):
            made[term] = if_(term.condition, made[term.then], made[term.orelse])
        else:
            made[term] = branch(term.coordinates, term.strict, made[term.then], made[term.orelse])
            note(term, made[term])
    return made[indicator]
