"""The state of inferring one definition's types, and the rules by node.

Owns `Inference`: what was found out per node (for the walk over dependence that follows, and for editors), the local
names in scope, what is to be looked at once everything else is known, and the diagnostics. The rules themselves are in
`infer`, `calls` and `integrals`, registered by `rule`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, Literal, NamedTuple, TypeVar

from msgspec import Struct

from potto.diagnostics import Diagnostic
from potto.modules.lookup import DefinitionTarget
from potto.source import Span
from potto.syntax import nodes
from potto.types.mismatches import mismatch, misused_derivative, not_a_number, shadowing
from potto.types.scope import Local, LocalKind, Meaning, Outside, RecursiveName, Scope
from potto.types.types import (
    REAL,
    UNKNOWN,
    ArrayOf,
    Diffeo,
    Dist,
    Function,
    Meta,
    Parameter,
    Real,
    TupleOf,
    Type,
    TypeVariable,
    Unknown,
    dual_name,
    dual_of_array,
    dual_of_tuple,
    resolve,
)
from potto.types.unify import MAX_LEAVES, is_named_alike, leaves, occurs, settle, unify

MOST_DUALS = 50  # that lead to each other: more than levels of functions of functions
STACK = 8000  # frames: two per node, for 200 levels of nesting and what is written between them

Condition = Literal["plain", "bracket", "diffeo"]
Rule = Callable[["Inference", Any], Type]
RULES: dict[type, Rule] = {}
F = TypeVar("F", bound=Callable[..., Type])


def rule(*node_types: type) -> Callable[[F], F]:
    """Register the rule that infers nodes of these types."""

    def register(function: F) -> F:
        for node_type in node_types:
            RULES[node_type] = function
        return function

    return register


def ensure_stack() -> None:
    """Python's own limit is too low for 200 levels of nesting; frames of Python functions live on the heap."""
    if sys.getrecursionlimit() < STACK:
        sys.setrecursionlimit(STACK)


class ArgumentPlan(Struct, frozen=True):
    """Which arguments fill which parameters: per group its slots, or None if it stays open. A slot lists the arguments
    that fill the parameter (several make up its tuple). `spread`: the only argument is a tuple for the whole group."""

    groups: tuple[tuple[tuple[int, ...], ...] | None, ...]
    spread: bool = False


class NamedPart(Struct, frozen=True):
    """The name of a part where it is written (`u.x`, `c with x = 1`): what it is of, and its type."""

    span: Span
    name: str
    whole: Type
    type: Type


class End(NamedTuple):
    """A size as another one that is not known, if there is such a one in it, and a number."""

    base: Type | None
    offset: int


class IndexReach(Struct, frozen=True):
    """The least and the greatest that the index `name` of a range is."""

    name: str
    over: nodes.Range
    low: End
    high: End


class _Pending(Struct, frozen=True):
    """A type that is not known yet, and what is to be its dual; `node` is what is derived.

    `generation`: how many duals led here, each through what was not known of the one before.
    """

    primal: Meta
    derived: Meta
    node: nodes.Expr
    generation: int

    @property
    def is_endless(self) -> bool:
        """Whether the dual would be part of itself, as that of an `h` which is given its own derivative."""
        if self.generation > MOST_DUALS or leaves(self.primal) >= MAX_LEAVES:
            return True
        return occurs(self.derived, self.primal)


class Inference:
    """Infers the types in one definition (or statement, or expression)."""

    def __init__(self, outside: Outside, members: dict[DefinitionTarget, Type]) -> None:
        self.outside, self.members = outside, members
        self.scope = Scope()
        self.level = 1
        self.diagnostics: list[Diagnostic] = []
        self.types: dict[int, Type] = {}
        self.meanings: dict[int, Meaning] = {}
        self.binders: dict[int, Local] = {}
        self.locals: list[Local] = []
        self.plans: dict[int, ArgumentPlan] = {}
        self.conditions: dict[int, Condition] = {}
        self.comparisons: list[nodes.Compare] = []
        self.brackets: set[int] = set()
        self.owners: dict[int, Meaning] = {}  # of members of no module, `u.x`: what `u` is
        self.fields: dict[int, list[int]] = {}  # of `u.x`, and of `c with x = 1`: where in the tuple it is
        self.parts: list[NamedPart] = []
        self.heads: set[int] = set()  # the parameters of the definition itself
        self.still: set[int] = set()  # arguments of derivatives that are given without their tangents
        self.sizes: dict[str, Type] = {}  # the names of sizes in annotations
        self.mixed: set[int] = set()  # the `and`, `or`, `not` of conditions, where brackets may stand
        self.integrals = 0  # how many integrals are around the place that is looked at
        self.reaches: dict[int, IndexReach] = {}  # by locals: what the indices of loops reach where it is looked at
        self._late: list[Callable[[], None]] = []
        self._duals: list[_Pending] = []
        self._generation = 0  # of the dual that is being derived

    # Expressions

    def infer(self, expr: nodes.Expr) -> Type:
        """The type of an expression."""
        inferred = RULES[expr.__class__](self, expr)
        self.types[id(expr)] = inferred
        return inferred

    def number(self, expr: nodes.Expr, where: str) -> None:
        """Infer an expression that must be a number; `where` says what needs it ("the left of `+`")."""
        found = self.types[id(expr)] = RULES[expr.__class__](self, expr)
        if found is not REAL:  # as it is mostly
            self.need_number(found, expr, where)

    def need_number(self, type: Type, expr: nodes.Expr, where: str) -> None:
        found = resolve(type)
        if isinstance(found, Real) or (isinstance(found, Meta) and unify(found, REAL)):
            return
        if isinstance(found, Unknown | Dist):
            return
        self.report(not_a_number(found, expr, where))

    def fresh(self) -> Meta:
        return Meta(self.level)

    def fresh_size(self, name: str) -> Meta:
        """A size that is not known yet, and what it would like to be called."""
        return Meta(self.level, size=name)

    def report(self, diagnostic: Diagnostic) -> None:
        self.diagnostics.append(diagnostic)

    def say(self, diagnostic: Diagnostic | None) -> None:
        """Report, if there is anything to be reported."""
        if diagnostic is not None:
            self.diagnostics.append(diagnostic)

    def later(self, check: Callable[[], None]) -> None:
        """Postpone a check until all types are known."""
        self._late.append(check)

    # Names

    def bind(self, node: object, local: Local) -> Local:
        """Bring a name into scope."""
        before = self.scope.find(local.name)
        if before is not None and local.name and not local.name.startswith("_"):
            self.report(shadowing(local, before))
        self.scope.bind(local)
        self.binders[id(node)] = local
        self.locals.append(local)
        return local

    def bind_group(
        self, parameters: tuple[nodes.Parameter, ...], annotated: Callable[[Any], Type], of_lambda: bool = False
    ) -> list[Local]:
        """Bring a group of parameters into scope."""
        found = []
        for parameter in parameters:
            type = self.fresh() if parameter.annotation is None else annotated(parameter.annotation)
            local = Local(parameter.name, parameter.span, "parameter", type, of_lambda=of_lambda)
            found.append(self.bind(parameter, local))
        return found

    def local(self, node: object, name: str, span: Span, kind: LocalKind, type: Type) -> Local:
        return self.bind(node, Local(name, span, kind, type))

    def recursive(self) -> bool:
        """Whether the definition refers to one of its own group."""
        return RecursiveName in map(type, self.meanings.values())

    def loop(self) -> Reaching:
        """What indices reach in a loop is forgotten behind it."""
        return Reaching(self, self.reaches)

    def at_times(self) -> Reaching:
        """In what may not be evaluated each time that a loop turns."""
        return Reaching(self, {})

    # Fitting

    def expect(self, actual: Type, expected: Type, expr: nodes.Expr, what: str) -> None:
        """Report `what` if the types do not fit."""
        if not unify(actual, expected):
            self.report(mismatch(actual, expected, expr, what))

    def fits(self, actual: Type, expected: Type) -> bool:
        """Whether an argument fits what is expected: a plain number may also be given where a dual is."""
        actual, expected = resolve(actual), resolve(expected)
        if not isinstance(expected, TupleOf):
            return unify(actual, expected)
        if expected.dual and isinstance(first := resolve(expected.items[0]), ArrayOf):
            if not isinstance(actual, TupleOf):
                return unify(actual, first)  # an array without tangents
        elif expected.dual and isinstance(actual, Real | Dist):
            return True
        if expected.dual and isinstance(actual, Meta):
            self.later(lambda: self._fit_late(actual, expected))
            return True
        same = isinstance(actual, TupleOf) and is_named_alike(actual, expected)
        if same and isinstance(actual, TupleOf) and len(actual.items) == len(expected.items):
            fits = [self.fits(item, other) for item, other in zip(actual.items, expected.items)]
            return all(fits)
        return unify(actual, expected)

    def _fit_late(self, actual: Type, expected: Type) -> None:
        """What nothing else made a number is a dual."""
        if isinstance(resolve(actual), Meta):
            unify(actual, expected)

    # Duals

    def dual(self, type: Type, node: nodes.Expr) -> Type:
        """D of a type, as far as it is known: what is not known yet follows when it is. `node` is what is derived."""
        type = resolve(type)
        match type:
            case Real() | Dist() | TypeVariable():
                return TupleOf((REAL, REAL), dual=True)
            case TupleOf(items, dual):
                settle(type)  # its dual is not known before its parts are
                return dual_of_tuple(tuple(self.dual(item, node) for item in items), dual, type.record)
            case ArrayOf(size, item):
                settle(type)
                return dual_of_array(size, self.dual(item, node))
            case Function(group, result):
                names = (None if parameter.name is None else dual_name(parameter.name) for parameter in group)
                duals = (Parameter(name, self.dual(p.type, node)) for name, p in zip(names, group))
                return Function(tuple(duals), self.dual(result, node))
            case Diffeo(dims):
                return UNKNOWN if dims is None else dual_of_tuple((TupleOf((REAL, REAL), dual=True),) * dims)
            case Meta():
                derived = Meta(type.level)
                self._duals.append(_Pending(type, derived, node, self._generation + 1))
                return derived
            case _:
                return UNKNOWN

    def settle_duals(self, force: bool = False) -> None:
        """Derive the types that are known by now; `force`: what is not known at the end is a number."""
        pending, self._duals = self._duals, []
        waiting: list[_Pending] = []
        while pending:
            item = pending.pop()
            if isinstance(resolve(item.primal), Meta):
                if not force:
                    waiting.append(item)
                    continue
                unify(item.primal, REAL)
            self._generation = item.generation
            if item.is_endless or not unify(item.derived, self.dual(item.primal, item.node)):
                unify(item.derived, UNKNOWN)
                self.report(misused_derivative(item.node))
            pending += self._duals
            self._duals = []
        self._duals, self._generation = waiting, 0

    def primal_of(self, derived: Type) -> Type | None:
        """The type whose dual `derived` is to be, if that is known no better yet."""
        derived = resolve(derived)
        for pending in self._duals:
            if resolve(pending.derived) is derived:
                return resolve(pending.primal)
        return None

    # The end

    def finish(self) -> None:
        """Do what had to wait until all is known."""
        self.settle_duals()
        checks, self._late = self._late, []
        for check in checks:
            check()
        self.settle_duals(force=True)
        checks, self._late = self._late, []
        for check in checks:
            check()


class Reaching:
    """A block in which indices are known to reach something, which is forgotten behind it."""

    __slots__ = ("_around", "_inference", "_inside")

    def __init__(self, inference: Inference, inside: dict[int, IndexReach]) -> None:
        self._inference, self._inside, self._around = inference, inside, inference.reaches

    def __enter__(self) -> None:
        self._inference.reaches = self._inside

    def __exit__(self, *raised: object) -> None:
        self._inference.reaches = self._around
