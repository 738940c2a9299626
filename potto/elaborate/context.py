"""One elaboration at work: where names come from, fresh binders, and where terms came from.

Owns `Elaboration` and `RULES`, the table of what each kind of expression elaborates to; `expressions`, `calls` and
`binders` fill it. It recurses as deep as the tree is nested, which the parser limits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar, cast

from potto.core.terms import INF, PI, App, Lam, Term, Tuple, app, fresh, global_, hole, lam, proj, var
from potto.elaborate import builtins
from potto.elaborate.shapes import Shapes
from potto.elaborate.values import BuiltinValue, LocalFunction, LocalNames, Value, sizes
from potto.modules.builtins import is_builtin
from potto.modules.graph import owner
from potto.modules.lookup import DefinitionTarget, resolve, resolve_member
from potto.query import Database
from potto.source import Span
from potto.syntax import nodes
from potto.types.types import Real, Type
from potto.types.vectors import place_in

MAX_DEPTH = 300  # calls of local functions within each other: deeper ones never end
MAX_CALLS = 100_000

E = TypeVar("E")
RuleOf = Callable[["Elaboration", E, LocalNames], Value]
RULES: dict[type, RuleOf[Any]] = {}


def rule(kind: type[E]) -> Callable[[RuleOf[E]], RuleOf[E]]:
    """Declare what a kind of expression elaborates to."""

    def declare(function: RuleOf[E]) -> RuleOf[E]:
        RULES[kind] = function
        return function

    return declare


class Elaboration:
    """The elaboration of one definition, statement or expression."""

    def __init__(self, db: Database, file: str, taken: Iterable[str] = ()) -> None:
        self.db, self.file = db, file
        self.taken = set(taken)
        self.numbers: set[str] = set()  # binders that stand for one number each: variables of integration, indices
        self.counted: set[str] = set()  # those of them that go through whole numbers, which nothing moves
        self.shapes = Shapes(db)
        self.origins: dict[Term, Span] = {}
        self.places: dict[Term, Span] = {}  # where conditions were written
        self.made: dict[LocalFunction, Term] = {}
        self.applied: dict[tuple[LocalFunction, tuple[Value, ...]], Value] = {}
        self.depth = self.calls = 0

    # Expressions

    def value(self, expr: nodes.Expr, scope: LocalNames) -> Value:
        """What an expression elaborates to."""
        return RULES[type(expr)](self, expr, scope)

    def term(self, expr: nodes.Expr, scope: LocalNames) -> Term:
        """The core term of an expression."""
        return self.as_term(self.value(expr, scope))

    def terms(self, exprs: Iterable[nodes.Expr], scope: LocalNames) -> tuple[Term, ...]:
        return tuple(self.term(expr, scope) for expr in exprs)

    def block(self, bindings: Sequence[nodes.Binding], scope: LocalNames) -> LocalNames:
        """The names of a block in scope, each line seeing those before it."""
        for binding in bindings:
            value = self.value(binding.value, scope)
            if len(binding.targets) == 1:
                scope = scope.bind({binding.targets[0].name: value})
                continue
            whole, count = self.as_term(value), len(binding.targets)
            if isinstance(whole, Tuple) and len(whole.items) != count:
                parts: Sequence[Term] = [hole(f"{count} names for a tuple of {len(whole.items)}")] * count
            else:
                parts = [proj(whole, place) for place in range(count)]
            scope = scope.bind({target.name: part for target, part in zip(binding.targets, parts)})
        return scope

    # Names

    def name(self, name: str, scope: LocalNames) -> Value:
        """What a name stands for: a local name, else a definition, else a builtin."""
        local = scope.find(name)
        if local is not None:
            return local
        target = resolve(self.db, self.file, name)
        if isinstance(target, DefinitionTarget):
            return global_(target.file, target.name)
        if target is None and is_builtin(name):
            return {"pi": PI, "inf": INF}.get(name) or BuiltinValue(name)
        return hole(f"`{name}` is not defined" if target is None else f"`{name}` is a module")

    def member(self, path: str, name: str, scope: LocalNames) -> Value:
        """What `path.name` stands for; a local name hides a module."""
        head, *inner = path.split(".")
        hidden = scope.find(head) is not None
        target = None if hidden else resolve_member(self.db, self.file, path, name)
        if target is not None:
            return global_(target.file, target.name)
        if not hidden and owner(self.db, self.file, path) is None:
            return hole(f"`{path}.{name}` is not defined")
        found = self.as_term(self.name(head, scope))
        for part in (*inner, name):
            found = self.field(found, part)
        return found

    def field(self, whole: Term, name: str) -> Term:
        """A part of a tuple or a record."""
        place = place_in(self.shapes.of(whole), name)
        return hole(f"there is no part `{name}`") if place is None else self.part_of(whole, place)

    def part_of(self, whole: Term, place: int) -> Term:
        """An item of a tuple, or of a record by the place of its field."""
        if isinstance(whole, App) and self.shapes.makes_record(whole.function):
            return whole.args[place]
        return proj(whole, place)

    # Binders

    def fresh(self, name: str) -> str:
        """A name for a binder that no other binder has."""
        found = fresh(name, self.taken)
        self.taken.add(found)
        return found

    def bind(self, names: Iterable[str], scope: LocalNames) -> tuple[tuple[str, ...], LocalNames]:
        """Fresh variables for names, and the scope in which the names stand for them."""
        pairs = [(name, self.fresh(name)) for name in names]
        inner = scope.bind({name: var(new) for name, new in pairs})
        return tuple(new for _, new in pairs), inner

    def bind_number(self, name: str, scope: LocalNames) -> tuple[str, LocalNames]:
        """A fresh variable that stands for one number."""
        (new,), inner = self.bind((name,), scope)
        self.numbers.add(new)
        return new, inner

    # Functions as terms

    def as_term(self, value: Value) -> Term:
        """The core term of a value: functions become lambdas."""
        if type(value) is LocalFunction:
            found = self.made.get(value)
            if found is None:
                found = self.made[value] = self.function(value)
            return found
        return self.builtin_lambda(value.name) if type(value) is BuiltinValue else cast(Term, value)

    def function(self, closure: LocalFunction, types: Sequence[Sequence[Type]] = ()) -> Term:
        """A function as a term; `types` of its parameters, where they are known."""
        scope, groups = closure.scope, []
        for number, group in enumerate(closure.groups):
            names, scope = self.bind(group, scope)
            groups.append(names)
            for name, type in zip(names, types[number] if number < len(types) else ()):
                if not isinstance(type, Real):
                    self.shapes.names[name] = type
        return lambdas(groups, self.whole(self.as_term(self.body(closure, scope))))

    def whole(self, term: Term) -> Term:
        """A function that calls or names give, with parameters of its own: `\\c . f(x)(c)` for f(x). So a function has
        as many groups of parameters as its type says, and what it does with them can be seen in it."""
        from potto.elaborate.signatures import groups_of_term

        groups = () if isinstance(term, Lam) else groups_of_term(self.db, term, named=False)
        groups = groups_of_term(self.db, term) if groups else ()
        own = [tuple(self.fresh(slot.name or "x") for slot in group) for group in groups]
        for names in own:
            term = app(term, tuple(map(var, names)))
        return lambdas(own, term)

    def body(self, closure: LocalFunction, scope: LocalNames) -> Value:
        """The body of a function whose parameters are in scope."""
        self.calls += 1
        if self.depth >= MAX_DEPTH or self.calls > MAX_CALLS:
            return hole("a local function that is applied to itself never ends")
        self.depth += 1
        for parameter in closure.annotated:
            value = scope.find(parameter.name)
            if (
                parameter.annotation is not None
                and value is not None
                and not isinstance(value, LocalFunction | BuiltinValue)
            ):
                known = {name: size for name, size in sizes(parameter.annotation, value) if scope.find(name) is None}
                scope = scope.bind(known)
        try:
            return self.value(closure.body, self.block(closure.bindings, scope))
        finally:
            self.depth -= 1

    def builtin_lambda(self, name: str) -> Term:
        """A builtin as a function that is passed on."""
        names = tuple(self.fresh(stem) for stem in ("x", "y", "z")[: builtins.parameters_of(name)])
        return lam(names, builtins.applied(self.db, name, tuple(map(var, names))))

    # Where terms came from

    def note(self, term: Term, span: Span) -> Term:
        """Remember where a term came from; the first place counts."""
        self.origins.setdefault(term, span)
        return term

    def noting(self, span: Span) -> Callable[[Term, Term], None]:
        """Remembers branches at their conditions' places, or at `span`."""

        def note(condition: Term, made: Term) -> None:
            place = self.places.get(condition) or self.origins.get(condition) or span
            self.origins.setdefault(made, place)

        return note


def lambdas(groups: Sequence[tuple[str, ...]], body: Term) -> Term:
    """A function of several groups of parameters."""
    for group in reversed(groups):
        body = lam(group, body)
    return body
