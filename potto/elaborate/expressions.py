"""Expressions to terms.

Owns `Elaborator`: one definition or expression, its environment of local names, the names that its binders have
taken, and where the branches, deltas, calls and integrals that it makes were written.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from potto.core import terms as core
from potto.core.terms import Prim, Term, Tuple
from potto.elaborate import calls
from potto.elaborate.conditions import bracketed, is_truth
from potto.measures import MEASURES
from potto.modules import DefinitionTarget, resolve, resolve_member
from potto.primitives import PRIMITIVES
from potto.query import Database
from potto.source import Span
from potto.syntax import nodes
from potto.syntax.nodes import Expr

Env = Mapping[str, Term]
CONSTANTS = {"pi": core.PI, "inf": core.INF}
_COMPARISONS = {"<": ("lt", False), "<=": ("le", False), ">": ("lt", True), ">=": ("le", True), "==": ("eq", False),
                "!=": ("ne", False)}  # fmt: skip


class Elaborator:
    """Elaborates expressions of one file; binders come out with distinct names."""

    def __init__(self, db: Database, file: str, taken: Sequence[str] = ()) -> None:
        self.db, self.file = db, file
        self.taken: set[str] = set(taken)
        self.origins: dict[Term, Span] = {}
        self.written: dict[Term, Span] = {}

    # Names

    def bind(self, name: str) -> str:
        """A name for a binder, distinct from all others of this definition."""
        new = core.fresh(name, self.taken)
        self.taken.add(new)
        return new

    def note(self, term: Term, span: Span) -> Term:
        self.origins.setdefault(term, span)
        return term

    def note_branch(self, span: Span) -> calls.NoteBranch:
        def note(made: Term, truth: Term) -> None:
            self.note(made, self.written.get(truth, span))

        return note

    def name(self, expr: nodes.Name, env: Env) -> Term:
        if expr.id in env:
            return env[expr.id]
        target = resolve(self.db, self.file, expr.id)
        if isinstance(target, DefinitionTarget):
            return core.global_(target.file, target.name)
        if target is None and expr.id in CONSTANTS:
            return CONSTANTS[expr.id]
        if target is None and expr.id in PRIMITIVES and PRIMITIVES[expr.id].surface:
            return self.builtin_as_function(expr.id)
        if target is None and expr.id in calls.PROJECTIONS:
            param = self.bind("p")
            return core.lam((param,), core.proj(core.var(param), calls.PROJECTIONS[expr.id]))
        return core.hole(f"`{expr.id}` is not a value here")

    def builtin_as_function(self, name: str) -> Term:
        entry = PRIMITIVES[name]
        params = tuple(self.bind(stem) for stem in "xyz"[: entry.arity or 2])
        return core.lam(params, core.apply(name, *map(core.var, params)))

    def is_free(self, name: str, env: Env) -> bool:
        """Whether a name still means what the language gives it."""
        return name not in env and resolve(self.db, self.file, name) is None

    # Expressions

    def expr(self, expr: Expr, env: Env) -> Term:
        match expr:
            case nodes.Number():
                return core.const(expr.value)
            case nodes.Name():
                return self.name(expr, env)
            case nodes.Member():
                target = resolve_member(self.db, self.file, expr.path, expr.name)
                return core.hole(f"`{expr.path}.{expr.name}` is not a value here") if target is None else core.global_(
                    target.file, target.name
                )  # fmt: skip
            case nodes.Paren():
                return self.expr(expr.inner, env)
            case nodes.Unary():
                return self.unary(expr, env)
            case nodes.Chain():
                return self.chain(expr, env)
            case nodes.Power():
                return core.pow_(self.expr(expr.base, env), self.expr(expr.exponent, env))
            case nodes.Compare() | nodes.Logic():
                return self.truth(expr, env)
            case nodes.Bracket():
                return self.conditional(expr, core.ONE, core.ZERO, env)
            case nodes.ListLiteral():
                return core.list_of(self.expr(item, env) for item in expr.items)
            case nodes.Tuple():
                return core.tuple_(self.expr(item, env) for item in expr.items)
            case nodes.If():
                return self.conditional(expr.condition, self.expr(expr.then, env), self.expr(expr.orelse, env), env)
            case nodes.Lambda():
                return self.function(expr.groups, expr.body, env)
            case nodes.Apply():
                return calls.apply(self, expr, env)
            case nodes.Integral():
                return self.integral(expr, env)
            case nodes.Sum():
                name = self.bind(expr.variable.name)
                body = self.expr(expr.body, {**env, expr.variable.name: core.var(name)})
                return core.sum_(name, self.expr(expr.lo, env), self.expr(expr.hi, env), body)
            case nodes.Let():
                return self.expr(expr.body, self.bindings(expr.bindings, env))
            case nodes.InlineDiffeo():
                return core.tuple_(self.expr(c, env) for c in expr.components)
            case nodes.ErrorExpr():
                return core.hole("this could not be read")

    def unary(self, expr: nodes.Unary, env: Env) -> Term:
        if expr.op == "not":
            return self.truth(expr, env)
        inner = self.expr(expr.operand, env)
        return core.neg(inner) if expr.op == "-" else inner

    def chain(self, expr: nodes.Chain, env: Env) -> Term:
        """Sums flat; products and quotients from the left, runs of `*` flat."""
        first = self.expr(expr.first, env)
        if expr.rest[0].op in "+-":
            terms = [first]
            for operand in expr.rest:
                value = self.expr(operand.value, env)
                terms.append(value if operand.op == "+" else core.neg(value))
            return core.add(*terms)
        factors = [first]
        for operand in expr.rest:
            value = self.expr(operand.value, env)
            if operand.op == "*":
                factors.append(value)
            else:
                factors = [core.div(core.mul(*factors) if len(factors) > 1 else factors[0], value)]
        return core.mul(*factors) if len(factors) > 1 else factors[0]

    def function(self, groups: Sequence[Sequence[nodes.Parameter]], body: Expr, env: Env) -> Term:
        inner = dict(env)
        names = []
        for group in groups:
            fresh = tuple(self.bind(p.name) for p in group)
            inner.update((p.name, core.var(n)) for p, n in zip(group, fresh, strict=True))
            names.append(fresh)
        return abstracted(names, self.expr(body, inner))

    def bindings(self, bindings: Sequence[nodes.Binding], env: Env) -> dict[str, Term]:
        """The environment after local names are bound, one after the other."""
        inner = dict(env)
        for binding in bindings:
            value = self.expr(binding.value, inner)
            if len(binding.targets) == 1:
                inner[binding.targets[0].name] = value
            else:
                inner.update((t.name, core.proj(value, i)) for i, t in enumerate(binding.targets))
        return inner

    # Conditions

    def truth(self, expr: Expr, env: Env) -> Term:
        """A condition as a truth value."""
        match expr:
            case nodes.Paren():
                return self.truth(expr.inner, env)
            case nodes.Bracket():
                return self.truth(expr.condition, env)
            case nodes.Unary(op="not"):
                return self.wrote(core.prim("not", self.truth(expr.operand, env)), expr.span)
            case nodes.Logic():
                return self.wrote(core.prim(expr.op, *(self.truth(o, env) for o in expr.operands)), expr.span)
            case nodes.Compare():
                return self.comparison(expr, env)
            case _:
                return self.expr(expr, env)

    def wrote(self, truth: Term, span: Span) -> Term:
        self.written.setdefault(truth, span)
        return truth

    def comparison(self, expr: nodes.Compare, env: Env) -> Term:
        parts = []
        left, start = self.expr(expr.first, env), expr.first.span
        for operand in expr.rest:
            right = self.expr(operand.value, env)
            op, swapped = _COMPARISONS[operand.op]
            made = core.prim(op, right, left) if swapped else core.prim(op, left, right)
            parts.append(self.wrote(made, start.cover(operand.value.span)))
            left, start = right, operand.value.span
        return parts[0] if len(parts) == 1 else self.wrote(core.prim("and", *parts), expr.span)

    def conditional(self, condition: Expr, then: Term, orelse: Term, env: Env) -> Term:
        """Plain for a comparison, diffeomorphic for a bracket or a diffeomorphism's result."""
        match condition:
            case nodes.Paren():
                return self.conditional(condition.inner, then, orelse, env)
            case nodes.Bracket():
                return bracketed(self.truth(condition.condition, env), then, orelse, self.note_branch(condition.span))
            case nodes.Logic() | nodes.Unary(op="not") if _has_surfaces(condition):
                return self.logic(condition, then, orelse, env)
        value = self.truth(condition, env)
        if is_truth(value):
            return self.note(core.if_(value, then, orelse), condition.span)
        if isinstance(value, core.Hole):
            return value
        coordinates = value.items if isinstance(value, Tuple) else (core.proj(value, 0),)
        if is_one_if_zero(value):
            assert isinstance(value, core.Branch)
            made = core.branch(value.coordinates, value.strict, then, orelse)
        elif isinstance(value, core.Const) or (isinstance(value, Prim) and not isinstance(value, Tuple)):
            made = core.branch((value,), False, then, orelse)
        else:
            made = core.branch(coordinates, False, then, orelse)
        return self.note(made, condition.span)

    def logic(self, condition: nodes.Logic | nodes.Unary, then: Term, orelse: Term, env: Env) -> Term:
        """`and`, `or`, `not` of conditions some of which are diffeomorphic."""
        if isinstance(condition, nodes.Unary):
            return self.conditional(condition.operand, orelse, then, env)
        result = then if condition.op == "and" else orelse
        for operand in reversed(condition.operands):
            if condition.op == "and":
                result = self.conditional(operand, result, orelse, env)
            else:
                result = self.conditional(operand, then, result, env)
        return result

    # Integrals

    def integral(self, expr: nodes.Integral, env: Env) -> Term:
        inner = dict(env)
        names: list[str] = []
        bounds: list[tuple[Term, Term]] = []
        hints: list[tuple[Term, ...]] = []
        densities: list[Term] = []
        guards: list[tuple[Term, str]] = []
        for place, bound in enumerate(expr.bounds):
            if isinstance(bound, nodes.MeasureBound):
                written = bound.variable
            elif place < len(expr.variables):
                written = expr.variables[place].name
            else:
                return core.hole("this integral has more bounds than variables")
            name = self.bind(written)
            if isinstance(bound, nodes.Interval):
                bounds.append((self.expr(bound.lo, inner), self.expr(bound.hi, inner)))
                hints.append(())
            else:
                measure = MEASURES.get(bound.measure)
                args = [self.expr(a, inner) for a in bound.arguments]
                if measure is None or len(args) != len(measure.parameters):
                    return core.hole(f"`{bound.measure}` is not a measure with {len(args)} parameter(s)")
                bounds.append(measure.support(*args))
                hints.append(measure.hints(*args))
                densities.append(measure.density(core.var(name), *args))
                guards += [(c, f"{bound.measure}: {why}") for c, why in measure.valid(*args)]
            names.append(name)
            inner[written] = core.var(name)
        if len(names) != len(expr.variables):
            return core.hole("this integral has fewer bounds than variables")
        body = self.weighted(self.expr(expr.body, inner), densities)
        made: Term = self.note(core.integral(tuple(names), tuple(bounds), body, tuple(hints)), expr.span)
        for condition, why in reversed(guards):
            if not condition.free & set(names):
                made = core.if_(condition, made, core.hole(why))
        return made

    def weighted(self, body: Term, densities: list[Term]) -> Term:
        if not densities:
            return body
        if isinstance(body, Tuple):
            return core.tuple_(self.weighted(item, densities) for item in body.items)
        return core.mul(body, *densities)


def abstracted(groups: Sequence[tuple[str, ...]], body: Term) -> Term:
    """A function of curried groups of parameters."""
    for group in reversed(groups):
        body = core.lam(group, body)
    return body


def is_one_if_zero(term: Term) -> bool:
    """Whether a term is an Iverson bracket of one surface, as a local name for `[p]` is."""
    return isinstance(term, core.Branch) and term.then is core.ONE and term.orelse is core.ZERO


def _has_surfaces(expr: Expr) -> bool:
    """Whether a logical condition has an operand that is a bracket or a diffeomorphism, not a comparison."""
    stack: list[Expr] = [expr]
    while stack:
        node = stack.pop()
        match node:
            case nodes.Logic():
                stack.extend(node.operands)
            case nodes.Unary(op="not"):
                stack.append(node.operand)
            case nodes.Paren():
                stack.append(node.inner)
            case nodes.Compare() | nodes.Name():
                continue
            case _:
                return True
    return False


