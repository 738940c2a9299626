"""Core terms from text, and their values by mpmath: what the tests of the calculus share.

`term("(x - 0.5)**2 - t")` reads Python's notation; `where(s, a, b)` is a Branch on s >= 0, `H(s)` the bracket,
`integral(body, (x, lo, hi), ...)` an integral, outermost variable first. `value` is an evaluator of its own, so that
nothing here is checked against itself.
"""

from __future__ import annotations

import ast
import itertools
from collections.abc import Mapping
from typing import Any

import mpmath

from potto.core import terms as t
from potto.core.terms import Term

_BINARY = {ast.Add: t.add, ast.Sub: t.sub, ast.Mult: t.mul, ast.Div: t.div, ast.Pow: t.pow_}


def term(text: str) -> Term:
    return _read(ast.parse(text.strip().replace("^", "**"), mode="eval").body)


def _read(node: ast.expr) -> Term:
    match node:
        case ast.Constant(value=value):
            return t.const(float(value))
        case ast.Name(id="pi"):
            return t.PI
        case ast.Name(id="inf"):
            return t.INF
        case ast.Name(id=name):
            return t.var(name)
        case ast.BinOp(left=left, op=op, right=right):
            return _BINARY[type(op)](_read(left), _read(right))
        case ast.UnaryOp(operand=operand):
            return t.neg(_read(operand))
        case ast.Call(func=ast.Name(id=name), args=args):
            return _call(name, args)
        case _:
            raise ValueError(ast.dump(node))


def _call(name: str, args: list[ast.expr]) -> Term:
    if name == "integral":
        ranges = [list(a.elts) for a in args[1:] if isinstance(a, ast.Tuple)]
        names = tuple(r[0].id for r in ranges if isinstance(r[0], ast.Name))
        return t.integral(names, tuple((_read(r[1]), _read(r[2])) for r in ranges), _read(args[0]))
    read = [_read(a) for a in args]
    match name:
        case "where":
            return t.branch((read[0],), False, read[1], read[2])
        case "H":
            return t.branch((read[0],), False, t.ONE, t.ZERO)
        case "delta":
            return t.delta(tuple(read))
        case _:
            return t.prim(name, *read)


# Values


def value(term: Term, env: Mapping[str, Any], known: dict[Term, Any] | None = None) -> Any:
    """The value of a term by mpmath; nan where it is not real. known: those of terms in the same environment."""
    known = {} if known is None else known
    if term not in known:
        known[term] = _value(term, env, known)
    return known[term]


def _value(term: Term, env: Mapping[str, Any], known: dict[Term, Any]) -> Any:
    match term:
        case t.Const(name="pi"):
            return +mpmath.pi
        case t.Const(value=number):
            return mpmath.mpf(number)
        case t.Var(name=name):
            return mpmath.mpf(env[name])
        case t.Branch():
            surface = value(term.surface, env, known)
            holds = surface > 0 if term.strict else surface >= 0
            return value(term.then if holds else term.orelse, env, known)
        case t.If():
            return value(term.then if _truth(term.condition, env, known) else term.orelse, env, known)
        case t.Prim(op=op, args=args):
            return _builtin(op, [value(a, env, known) for a in args])
        case t.Proj(term=inner, index=index):
            return value(inner, env, known)[index]
        case t.Tuple(items=items):
            return tuple(value(i, env, known) for i in items)
        case t.Sum():
            lo, hi = int(value(term.lo, env, known)), int(value(term.hi, env, known))
            return mpmath.fsum(value(term.body, {**env, term.variable: i}) for i in range(lo, hi + 1))
        case t.Integral():
            return _integral(term.variables, term.bounds, term.body, env)
        case _:
            raise ValueError(type(term).__name__)


def _truth(term: Term, env: Mapping[str, Any], known: dict[Term, Any]) -> bool:
    assert isinstance(term, t.Prim)
    if term.op in ("and", "or"):
        left, right = (_truth(a, env, known) for a in term.args)
        return (left and right) if term.op == "and" else (left or right)
    if term.op == "not":
        return not _truth(term.args[0], env, known)
    a, b = (value(x, env, known) for x in term.args)
    return bool({"lt": a < b, "le": a <= b, "eq": a == b, "ne": a != b}[term.op])


# Integrals: cut where a branch of the body changes its mind, then a rule on every piece


def _integral(variables: tuple[str, ...], bounds: Any, body: Term, env: Mapping[str, Any]) -> Any:
    name, (lo, hi) = variables[0], bounds[0]
    a, b = value(lo, env), value(hi, env)

    def inner(x: Any) -> Any:
        here = {**env, name: x}
        if len(variables) > 1:
            return _integral(variables[1:], bounds[1:], body, here)
        result = value(body, here)
        return result if result == result else mpmath.mpf(0)

    if mpmath.isinf(a) or mpmath.isinf(b):
        return mpmath.quad(inner, [a, 0, b] if a < 0 < b else [a, b])
    nested = len(variables) > 1 or any(isinstance(n, t.Integral) for n in t.postorder(body))
    rule = "gauss-legendre" if nested else "tanh-sinh"
    pieces = _pieces(name, a, b, body, env, 24 if nested else 60, variables[1:2], bounds[1:2])
    total = mpmath.mpf(0)
    for lower, upper in itertools.pairwise(pieces):
        total += mpmath.quad(inner, [lower, upper], method=rule, maxdegree=4 if nested else 6)
    return total


def _pieces(
    name: str,
    a: Any,
    b: Any,
    body: Term,
    env: Mapping[str, Any],
    count: int,
    further: tuple[str, ...] = (),
    bounds: Any = (),
) -> list[Any]:
    branches = [n for n in t.postorder(body) if isinstance(n, t.Branch)]
    nested = [n for n in t.postorder(body) if isinstance(n, t.Integral)]

    def signature(x: Any) -> tuple[int, ...]:
        """Which branches hold, and in how many pieces the integrals further in come."""
        here = {**env, name: x}
        known = [n for n in branches if n.surface.free <= here.keys()]
        inner = [(n.variables[0], *n.bounds[0], n.body) for n in nested]
        if further:
            inner.append((further[0], *bounds[0], body))
        counts, values = [], dict[Term, Any]()
        for other, lo, hi, within in inner:
            if (lo.free | hi.free) <= here.keys():
                ends = value(lo, here, values), value(hi, here, values)
                counts.append(len(_pieces(other, *ends, within, here, 16)) if ends[0] != ends[1] else 0)
        return (*(int(value(n.surface, here, values) > 0) for n in known), *counts)

    grid = [a + (b - a) * mpmath.mpf(i) / count for i in range(count + 1)]
    middles = [(x + y) / 2 for x, y in itertools.pairwise(grid)]
    cuts = [a]
    for x, y in itertools.pairwise([a + (b - a) / 10**9, *middles, b - (b - a) / 10**9]):
        left = signature(x)
        if left != signature(y):
            for _ in range(30 if further or nested else 50):
                m = (x + y) / 2
                x, y = (m, y) if signature(m) == left else (x, m)
            cuts.append((x + y) / 2)
    return [*cuts, b]


_NAMES = {"max": max, "min": min, "abs": abs, "clamp": lambda x, lo, hi: min(max(x, lo), hi)}


def _builtin(op: str, args: list[Any]) -> Any:
    if any(a != a for a in args):
        return mpmath.nan
    try:
        match op:
            case "add":
                result = mpmath.fsum(args)
            case "mul":
                result = mpmath.fprod(args)
            case "neg":
                result = -args[0]
            case "div":
                if args[1] == 0:
                    return mpmath.nan if args[0] == 0 else mpmath.inf * mpmath.sign(args[0])
                result = args[0] / args[1]
            case "pow":
                if args[0] == 0 and args[1] < 0:
                    return mpmath.inf
                result = mpmath.power(*args)
            case _:
                result = (_NAMES.get(op) or getattr(mpmath, op))(*args)
    except (ZeroDivisionError, ValueError):
        return mpmath.nan
    return mpmath.nan if isinstance(result, mpmath.mpc) else result
