"""The catalogue of hard problems as core terms: integrals with known answers to 30 digits.

`spec` is written in Python notation; `H(u)` is the Iverson bracket [u >= 0], `where(cond, a, b)` a diffeomorphic
conditional, and a generator expression a sum.
"""

from __future__ import annotations

import ast
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from potto.core import terms as core
from potto.core.terms import Term

CASES: list[dict[str, Any]] = json.loads((Path(__file__).parent / "hard_cases.json").read_text())["cases"]
_OPERATORS = {ast.Add: core.add, ast.Sub: core.sub, ast.Mult: core.mul, ast.Div: core.div, ast.Pow: core.pow_}


def term(text: str) -> Term:
    return _term(ast.parse(text.replace("-inf", "(-inf)"), mode="eval").body)


def _term(node: ast.expr) -> Term:
    match node:
        case ast.Constant():
            return core.const(node.value)
        case ast.Name(id="pi"):
            return core.PI
        case ast.Name(id="inf"):
            return core.INF
        case ast.Name():
            return core.var(node.id)
        case ast.UnaryOp(op=ast.USub()):
            return core.neg(_term(node.operand))
        case ast.BinOp():
            return _OPERATORS[type(node.op)](_term(node.left), _term(node.right))  # type: ignore[operator]
        case ast.Call(func=ast.Name(id="H")):
            return core.branch((_term(node.args[0]),), False, core.ONE, core.ZERO)
        case ast.Call(func=ast.Name(id="where")):
            condition = node.args[0]
            assert isinstance(condition, ast.Compare)
            surface = core.sub(_term(condition.left), _term(condition.comparators[0]))
            strict = isinstance(condition.ops[0], ast.Gt)
            then, orelse = map(_term, node.args[1:])
            if not isinstance(condition.ops[0], (ast.Gt, ast.GtE)) or condition_is_plain(condition):
                return core.if_(core.prim("lt", core.ZERO, surface), then, orelse)
            return core.branch((surface,), strict, then, orelse)
        case ast.Call(func=ast.Name(id="sum")):
            generator = node.args[0]
            assert isinstance(generator, ast.GeneratorExp)
            loop = generator.generators[0]
            assert isinstance(loop.iter, ast.Call) and isinstance(loop.target, ast.Name)
            lo, hi = map(_term, loop.iter.args)
            return core.sum_(loop.target.id, lo, core.sub(hi, core.ONE), _term(generator.elt))
        case ast.Call(func=ast.Name()):
            return core.apply(node.func.id, *map(_term, node.args))
    raise ValueError(ast.dump(node))


def condition_is_plain(condition: ast.Compare) -> bool:
    return not any(isinstance(n, ast.Name) and n.id.startswith(("x", "y", "z")) for n in ast.walk(condition))


@dataclass(frozen=True)
class Problem:
    """A case as a function of its parameters, and where it is asked for."""

    function: core.Lam
    parameters: tuple[str, ...]
    point: tuple[float, ...]


def problem(case: dict[str, Any]) -> Problem:
    spec = case["spec"]
    names = tuple(v[0] for v in spec["vars"])
    bounds = tuple((term(v[1]), term(v[2])) for v in spec["vars"])
    body = core.integral(names, bounds, term(spec["integrand"]))
    parameters = tuple(case["params_hex"])
    point = tuple(float.fromhex(h) for h in case["params_hex"].values())
    return Problem(core.lam(parameters, body), parameters, point)


def value_term(p: Problem) -> Term:
    return core.app(p.function, tuple(map(core.const, p.point))) if p.parameters else p.function.body


def derivative_term(p: Problem, wrt: str) -> Term:
    duals = tuple(
        core.tuple_((core.const(x), core.ONE if name == wrt else core.ZERO))
        for name, x in zip(p.parameters, p.point, strict=True)
    )
    return core.app(core.deriv(p.function), duals)
