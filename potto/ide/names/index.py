"""The names of a chunk: where each is bound and where each is used, with the binder that it means.

Owns `index`, the one walk over a tree that all features about names read. It knows the scoping rules and no files: what
a name that is not bound inside its chunk means is for `symbols`. Cached by the text of the chunk, spans relative to it.
Names in live expressions (`#> e`) and in what could not be parsed are found too.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from typing import Any, Literal

from msgspec import Struct

from potto.modules import parsed
from potto.query import Database, query
from potto.source import NOWHERE, Span
from potto.syntax import RESERVED, children, live_expressions, nodes, parse_expression, walk

BinderKind = Literal["parameter", "local", "variable", "index", "loop", "size"]
Role = Literal["bind", "use", "member", "path", "field", "keyword", "define", "module", "import", "alias", "measure"]
_Groups = Sequence[Sequence[nodes.Parameter]]
_WORD = re.compile(r"[^\W\d]\w*")


class BoundName(Struct, frozen=True):
    """A name that is bound inside a chunk; `scope` is where it can be used."""

    name: str
    span: Span
    kind: BinderKind
    scope: Span


class Occurrence(Struct, frozen=True):
    """A name in the text. `binder` counts the binders of the chunk; -1: it means something outside of it.

    `path` is the module of a member, or the module of an import. `callee` is the function of a keyword argument.
    """

    span: Span
    name: str
    role: Role
    binder: int = -1
    path: str = ""
    callee: nodes.Expr | None = None

    def __hash__(self) -> int:
        """Without the callee, which may be a large tree."""
        return hash((self.span, self.name, self.role, self.binder, self.path))


class NameIndex(Struct, frozen=True):
    """The names of a chunk, in the order of the text."""

    binders: tuple[BoundName, ...]
    occurrences: tuple[Occurrence, ...]
    starts: tuple[int, ...]

    def at(self, offset: int) -> Occurrence | None:
        """The name that an offset touches. If two meet there, the one that begins there."""
        place = bisect_right(self.starts, offset) - 1
        for candidate in (place, place - 1):
            if candidate >= 0:
                found = self.occurrences[candidate]
                if found.span.start <= offset <= found.span.end:
                    return found
        return None

    def of(self, binder: int) -> tuple[Occurrence, ...]:
        """All places of a name that is bound inside."""
        return tuple(o for o in self.occurrences if o.binder == binder)

    def visible(self, offset: int) -> tuple[tuple[int, BoundName], ...]:
        """The binders in scope at an offset, the innermost of each name."""
        found: dict[str, tuple[int, BoundName]] = {}
        for number, binder in enumerate(self.binders):
            if binder.scope.start <= offset <= binder.scope.end:
                before = found.get(binder.name)
                if before is None or len(binder.scope) <= len(before[1].scope):
                    found[binder.name] = (number, binder)
        return tuple(found.values())


@query(keep=8192)
def index(db: Database, text: str, diffeo: bool) -> NameIndex:
    """The names of a chunk's text."""
    walk = _Walk(text)
    item = parsed(db, text, diffeo).item
    if item is not None:
        walk.run(item)
    if "#>" in text:
        for live in live_expressions(text):
            walk.base = live.text_span.start
            walk.run(parse_expression(live.text).expr)
    found = sorted(walk.occurrences, key=lambda o: o.span)
    unique = tuple(dict.fromkeys(found))
    return NameIndex(tuple(walk.binders), unique, tuple(o.span.start for o in unique))


class _Bind(Struct, frozen=True):
    numbers: tuple[int, ...]


class _Unbind(Struct, frozen=True):
    names: tuple[str, ...]


class _Walk:
    """A walk without recursion; `base` is added to all spans."""

    def __init__(self, text: str) -> None:
        self.text, self.base = text, 0
        self.end = len(text)
        self.binders: list[BoundName] = []
        self.occurrences: list[Occurrence] = []
        self.environment: dict[str, list[int]] = {}

    def run(self, root: nodes.Node | nodes.Statement) -> None:
        stack: list[Any] = [root]
        while stack:
            step = stack.pop()
            if isinstance(step, _Bind):
                for number in step.numbers:
                    self.environment.setdefault(self.binders[number].name, []).append(number)
            elif isinstance(step, _Unbind):
                for name in step.names:
                    self.environment[name].pop()
            else:
                stack.extend(reversed(self.steps(step)))

    # Recording

    def add(self, span: Span, name: str, role: Role, binder: int = -1, path: str = "", callee: Any = None) -> None:
        if name and len(span):
            self.occurrences.append(Occurrence(span.shift(self.base), name, role, binder, path, callee))

    def use(self, span: Span, name: str) -> None:
        self.add(span, name, "use", self.meant(name))

    def meant(self, name: str) -> int:
        bound = self.environment.get(name)
        return bound[-1] if bound else -1

    def binder(self, name: str, span: Span, kind: BinderKind, scope: Span) -> int:
        end = self.end if self.text[scope.end :].strip() == "" else scope.end + self.base
        self.binders.append(BoundName(name, span.shift(self.base), kind, Span(scope.start + self.base, end)))
        number = len(self.binders) - 1
        self.add(span, name, "bind", number)
        return number

    def words(self, span: Span) -> None:
        """The words of what could not be parsed."""
        at = span.shift(self.base)
        for found in _WORD.finditer(self.text, at.start, at.end):
            if found.group() not in RESERVED:
                self.use(Span(found.start() - self.base, found.end() - self.base), found.group())

    # What to visit in each kind of node

    def steps(self, node: Any) -> Sequence[Any]:
        match node:
            case nodes.Name(span=span, id=name):
                self.use(span, name)
            case nodes.Member():
                self._member(node)
            case nodes.Field():
                self._part(node.name_span, node.name)
                return (node.value,)
            case nodes.With():
                for argument in node.arguments:
                    self._part(argument.name_span or NOWHERE, argument.name or "")
                return (node.record, *(argument.value for argument in node.arguments))
            case nodes.ErrorExpr(span=span) | nodes.BrokenItem(span=span):
                self.words(span)
            case nodes.Argument():
                return (node.value,)
            case nodes.Apply():
                return self._apply(node)
            case nodes.Lambda():
                return self._headed(node.groups, node.span, (node.body,))
            case nodes.Integral():
                return self._integral(node)
            case nodes.Reduction() | nodes.Comprehension():
                return self._through(node.clauses, node.body, (node.body,))
            case nodes.Fold():
                scope = node.body.span
                state = [self.binder(t.name, t.span, "local", scope) for t in node.targets]
                return (node.start, *self._through(node.clauses, node.body, self._scoped(state, (node.body,))))
            case nodes.Let():
                return self._block(node.bindings, (node.body,), node.span.end, "local")
            case nodes.Binding():
                return (node.value,)
            case nodes.NamedType(span=span, name=name) if "." not in name:
                self.use(span, name)
            case nodes.RealType():
                self._real_type(node)
            case _:
                return self._item(node)
        return ()

    def _item(self, node: Any) -> Sequence[Any]:
        """The steps of what stands in a file by itself."""
        match node:
            case nodes.Definition():
                self.add(node.name_span, node.name, "define")
                return self._definition(node)
            case nodes.DiffeoDefinition():
                self.add(node.name_span, node.name, "define")
                return self._diffeo(node)
            case nodes.RecordDefinition():
                self.add(node.name_span, node.name, "define")
                return self._headed((node.fields,), node.span, ())
            case nodes.DeclaredInverse():
                return self._headed((node.parameters,), node.span, node.components)
            case nodes.For():
                number = self.binder(node.variable.name, node.variable.span, "loop", node.span)
                return (node.iterable, *self._scoped((number,), self._statements(node)))
            case nodes.FromImport() | nodes.Import():
                self._import(node)
                return ()
            case _:
                return children(node)

    def _member(self, node: nodes.Member) -> None:
        """`u.a.b`, parts of a local name; else a name in a module, or what only who knows files can tell apart."""
        head, *names = node.path.split(".")
        at = node.path_span.start
        if self.meant(head) < 0:
            self.add(node.path_span, node.path, "path")
            self.add(node.name_span, node.name, "member", path=node.path)
            return
        self.use(Span(at, at + len(head)), head)
        at += len(head) + 1
        for name in names:
            self._part(Span(at, at + len(name)), name)
            at += len(name) + 1
        self._part(node.name_span, node.name)

    def _part(self, span: Span, name: str) -> None:
        if not name.isdigit():
            self.add(span, name, "field")

    def _apply(self, node: nodes.Apply) -> Sequence[Any]:
        for argument in node.arguments:
            if argument.name is not None and argument.name_span is not None:
                function = call_head(node.function)[0]
                hidden = isinstance(function, nodes.Name) and self.meant(function.id) >= 0
                self.add(argument.name_span, argument.name, "keyword", callee=None if hidden else node.function)
        return (node.function, *(argument.value for argument in node.arguments))

    def _through(self, clauses: Sequence[nodes.Clause], body: nodes.Expr, inner: Iterable[Any]) -> tuple[Any, ...]:
        """What goes through clauses: each sees the variables before it, the body all of them."""
        steps: list[Any] = []
        names: list[str] = []
        for clause, after in zip(clauses, (*clauses[1:], None)):
            start = body.span.start if after is None else min(after.span.start, body.span.start)
            kind: BinderKind = "index" if isinstance(clause.over, nodes.Range) else "loop"
            end = max(body.span.end, clauses[-1].span.end)
            number = self.binder(clause.variable.name, clause.variable.span, kind, Span(start, end))
            steps += (clause.over, _Bind((number,)))
            names.append(clause.variable.name)
        return (*steps, *inner, _Unbind(tuple(names)))

    def _scoped(self, numbers: Iterable[int], inner: Iterable[Any]) -> tuple[Any, ...]:
        given = tuple(numbers)
        return (_Bind(given), *inner, self._unbind(given))

    def _unbind(self, numbers: Iterable[int]) -> _Unbind:
        return _Unbind(tuple(self.binders[number].name for number in numbers))

    def _groups(self, groups: _Groups, scope: Span) -> tuple[int, ...]:
        return tuple(
            self.binder(p.name, _name_span(p), "parameter", Span(p.span.end, max(p.span.end, scope.end)))
            for group in groups
            for p in group
        )

    def _headed(
        self, groups: _Groups, scope: Span, inner: Iterable[Any], result: nodes.TypeExpr | None = None
    ) -> Sequence[Any]:
        """Parameters, and the names of their sizes, which they hide, around what they are seen in."""
        types = [p.annotation for group in groups for p in group if p.annotation is not None]
        types += [] if result is None else [result]
        return self._scoped((*self._sizes(types, scope), *self._groups(groups, scope)), (*types, *inner))

    def _sizes(self, types: Iterable[nodes.TypeExpr], scope: Span) -> Iterable[int]:
        """The names of sizes, which are numbers in the body; each is bound where it is written first."""
        found: dict[str, int] = {}
        written = (node for type in types for node in walk(type) if isinstance(node, nodes.ArrayType))
        for size in (size for node in written for size in node.sizes):
            name = size.name or "_"
            span = Span(size.span.start, size.span.start + len(name))
            if name in found or self.meant(name) >= 0:
                self.add(span, name, "use", found[name] if name in found else self.meant(name))
            elif name != "_":
                found[name] = self.binder(name, span, "size", Span(span.end, max(span.end, scope.end)))
        return found.values()

    def _integral(self, node: nodes.Integral) -> Sequence[Any]:
        steps: list[Any] = []
        numbers: list[int] = []
        for place in range(max(len(node.bounds), len(node.variables))):
            bounds = node.bounds[place] if place < len(node.bounds) else None
            start = node.span.start if bounds is None else bounds.span.end
            number = -1
            if place < len(node.variables):
                variable = node.variables[place]
                number = self.binder(variable.name, variable.span, "variable", Span(start, node.span.end))
            if isinstance(bounds, nodes.MeasureBound):
                same = number >= 0 and self.binders[number].name == bounds.variable
                if not same and number < 0:
                    number = self.binder(bounds.variable, bounds.variable_span, "variable", Span(start, node.span.end))
                else:
                    self.add(bounds.variable_span, bounds.variable, "bind", number if same else -1)
                for name, span in ((bounds.measure, bounds.measure_span), *bounds.inner):
                    self.add(span, name, "measure")
                steps.extend(bounds.arguments)
            elif bounds is not None:
                steps += [bounds.lo, bounds.hi]
            if number >= 0:
                steps.append(_Bind((number,)))
                numbers.append(number)
        return (*steps, node.body, self._unbind(numbers))

    def _block(
        self, bindings: Sequence[nodes.Statement], rest: Sequence[Any], end: int, kind: BinderKind
    ) -> Sequence[Any]:
        """Bindings one after the other, each seeing those before it."""
        steps: list[Any] = []
        numbers: list[int] = []
        for binding in bindings:
            steps.append(binding)
            if isinstance(binding, nodes.Binding):
                scope = Span(binding.span.end, max(end, binding.span.end))
                bound = tuple(self.binder(t.name, t.span, kind, scope) for t in binding.targets)
                steps.append(_Bind(bound))
                numbers += bound
        return (*steps, *rest, self._unbind(numbers))

    def _definition(self, node: nodes.Definition) -> Sequence[Any]:
        block = self._block(node.bindings, (node.body,), node.span.end, "local")
        return self._headed(node.groups, node.span, block, node.result)

    def _diffeo(self, node: nodes.DiffeoDefinition) -> Sequence[Any]:
        groups = (node.variables, *node.groups)
        inverse = () if node.inverse is None else (node.inverse,)
        block = self._block(node.bindings, (*node.components, *inverse, *node.where), node.span.end, "local")
        return self._headed(groups, node.span, block)

    def _statements(self, node: nodes.For) -> Sequence[Any]:
        return self._block(node.body, (), node.span.end, "local")

    def _import(self, node: nodes.FromImport | nodes.Import) -> None:
        self.add(node.module_span, node.module, "module")
        if isinstance(node, nodes.Import):
            if node.alias is not None and node.alias_span is not None:
                self.add(node.alias_span, node.alias, "alias", path=node.module)
            return
        for name in node.names:
            self.add(name.name_span, name.name, "import", path=node.module)
            if name.alias is not None and name.alias_span is not None:
                self.add(name.alias_span, name.alias, "alias", path=node.module)

    def _real_type(self, node: nodes.RealType) -> None:
        """`Real[x]` talks about a variable or a parameter that is in scope."""
        if not node.variables:
            return
        at = node.span.shift(self.base)
        bracket = self.text.find("[", at.start, at.end)
        for found in _WORD.finditer(self.text, max(bracket, at.start), at.end):
            if self.meant(found.group()) >= 0:
                self.use(Span(found.start() - self.base, found.end() - self.base), found.group())


def call_head(expr: nodes.Expr) -> tuple[nodes.Expr, int, int]:
    """The function at the start of a chain of calls, how many groups of arguments it was given, and how often it was
    differentiated."""
    given = derived = 0
    while True:
        if isinstance(expr, nodes.Paren):
            expr = expr.inner
        elif isinstance(expr, nodes.Apply) and _is_deriv(expr):
            expr, derived = expr.arguments[0].value, derived + 1
        elif isinstance(expr, nodes.Apply):
            expr, given = expr.function, given + 1
        else:
            return expr, given, derived


def _is_deriv(node: nodes.Apply) -> bool:
    return isinstance(node.function, nodes.Name) and node.function.id == "deriv" and len(node.arguments) == 1


def _name_span(parameter: nodes.Parameter) -> Span:
    """Where the name of a parameter stands; an annotation may follow it."""
    return Span(parameter.span.start, parameter.span.start + len(parameter.name))
