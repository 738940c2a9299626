"""The conditions that vary under the integrals of a definition, also those that calls lead to.

Owns `conditions_of` and `expanded`. A function exports what `skeleton` keeps of it: its branches, deltas and calls,
over its parameters; so a caller's check reads no more of a callee than that. Conditions that a callee has over its own
variables of integration alone are the callee's to check, unless a function that the caller passed brought them in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from potto.calculus.sampling import sample_value
from potto.calculus.surfaces import fitted, uncurry
from potto.calculus.trace import spine
from potto.core.terms import (
    ONE,
    ZERO,
    App,
    Branch,
    Const,
    Delta,
    Deriv,
    Global,
    Integral,
    Lam,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    branch,
    children,
    fresh,
    integral,
    lam,
    postorder,
    proj,
    rebuild,
    substitute,
    sum_,
    tuple_,
    var,
)

# The term of another definition: its skeleton, or all of it.
Resolve = Callable[[Global], "Term | None"]
# The dual of a function.
Derive = Callable[[Lam], Lam]

DEEPEST = 60  # calls inside calls
_TWICE = 2  # how often one definition may stand on the path of calls: a recursion repeats its conditions


@dataclass(frozen=True, slots=True)
class Condition:
    """A branch or a delta over variables of integration.

    coordinates: as the definition sees them, calls of known functions carried out.
    anchor: the term of the definition itself that leads here: the branch, the delta, or the call.
    box: the variables of integration that occur, each with its bounds where they are constants.
    """

    coordinates: tuple[Term, ...]
    strict: bool
    anchor: Term
    delta: bool
    box: Mapping[str, tuple[float, float]] = field(hash=False)
    calls: tuple[str, ...] = ()

    @property
    def surface(self) -> Term:
        return self.coordinates[0]

    @property
    def variables(self) -> tuple[str, ...]:
        return tuple(v for v in self.box if any(v in c.free for c in self.coordinates))


def skeleton(term: Term) -> Term:
    """What others need to know of a definition: its conditions and calls over its parameters."""
    groups: list[tuple[str, ...]] = []
    body = term
    while isinstance(body, Lam):
        groups.append(body.params)
        body = body.body
    kept = _kept(body)
    for params in reversed(groups):
        kept = lam(params, kept)
    return kept


def _kept(term: Term) -> Term:
    items: dict[Term, None] = {}
    for node in _outside_binders(term):
        match node:
            case Branch() if node.surface.free:
                items[branch(node.coordinates, node.strict, ONE, ZERO)] = None
            case Delta() if node.free:
                items[node] = None
            case App():
                items[node] = None
            case Integral():
                inner = _kept(node.body)
                if inner.free:
                    items[integral(node.variables, node.bounds, inner)] = None
            case Sum():
                inner = _kept(node.body)
                if inner.free:
                    items[sum_(node.variable, node.lo, node.hi, inner)] = None
            case _:
                pass
    return tuple_(items)


def _outside_binders(root: Term) -> list[Term]:
    order: list[Term] = []
    seen: set[Term] = set()
    stack = [root]
    while stack:
        node = stack.pop()
        if node in seen:
            continue
        seen.add(node)
        order.append(node)
        if isinstance(node, Integral):
            stack.extend(b for pair in node.bounds for b in pair)
        elif isinstance(node, Sum):
            stack.extend((node.lo, node.hi))
        elif isinstance(node, Lam):
            stack.append(node.body)
        else:
            stack.extend(reversed(children(node)))
    return order


def conditions_of(term: Term, skeletons: Resolve, whole: Resolve) -> tuple[Condition, ...]:
    """All conditions under the integrals of a term that vary with variables of integration; each once."""
    walk = _Walk(skeletons, whole)
    body = term
    while isinstance(body, Lam):
        body = body.body
    found = walk.term(body, _Place({}, {}, (), (), None))
    return tuple({(c.coordinates, c.anchor): c for c in found}.values())


@dataclass(frozen=True, slots=True)
class _Place:
    """Where the walk is: what parameters stand for, which functions were passed, the calls that led here."""

    mapping: Mapping[str, Term]
    functions: Mapping[str, Term]
    calls: tuple[str, ...]
    path: tuple[Global, ...]
    anchor: Term | None
    caller: frozenset[str] = frozenset()
    foreign: bool = False


class _Walk:
    def __init__(self, skeletons: Resolve, whole: Resolve) -> None:
        self.skeletons = skeletons
        self.whole = whole
        self.box: dict[str, tuple[float, float]] = {}
        self.seen: set[tuple[object, ...]] = set()
        self.taken: set[str] = set()

    def term(self, term: Term, place: _Place) -> Iterator[Condition]:
        nodes = postorder(term)
        for node in nodes:
            self.taken |= node.free
            if isinstance(node, Integral):
                for name, (lo, hi) in zip(node.variables, node.bounds, strict=True):
                    self.box[name] = (_number(lo, -math.inf), _number(hi, math.inf))
        heads = {node.function for node in nodes if isinstance(node, App)}
        for node in nodes:
            if isinstance(node, Branch | Delta):
                yield from self.condition(node, place)
            elif isinstance(node, App) and node not in heads:
                yield from self.call(node, place)

    def condition(self, node: Branch | Delta, place: _Place) -> Iterator[Condition]:
        coordinates = node.coordinates
        if isinstance(coordinates[0], Proj) and coordinates[0].index == 0 and len(coordinates) == 1:
            whole = self.seen_through(coordinates[0].term, place)
            coordinates = whole.items if isinstance(whole, Tuple) else (self.seen_through(coordinates[0], place),)
        else:
            coordinates = tuple(self.seen_through(c, place) for c in coordinates)
        surface = coordinates[0]
        inside = surface.free & self.box.keys()
        if not inside or (place.calls and not place.foreign and not inside & place.caller):
            return
        if any(isinstance(part, App) for part in postorder(surface)):
            return  # a function parameter decides: the caller who passes it checks
        box = {v: b for v, b in self.box.items() if any(v in c.free for c in coordinates)}
        yield Condition(
            coordinates,
            isinstance(node, Branch) and node.strict,
            place.anchor or node,
            isinstance(node, Delta),
            box,
            place.calls,
        )

    def seen_through(self, term: Term, place: _Place) -> Term:
        known = {**place.mapping, **place.functions}
        return expanded(substitute(term, known), self.whole)

    def call(self, node: App, place: _Place) -> Iterator[Condition]:
        head, groups = spine(node)
        foreign = place.foreign
        dual = isinstance(head, Deriv)
        while isinstance(head, Deriv):
            head = head.function
        if isinstance(head, Var) and head.name in place.functions:
            head, foreign = place.functions[head.name], True
        name, path = "a function", place.path
        function: Term | None = head
        if isinstance(head, Global):
            if path.count(head) >= _TWICE or len(path) >= DEEPEST:
                return
            name, path = head.name, (*path, head)
            function = self.skeletons(head)
        if not isinstance(function, Lam):
            return
        known = {**place.mapping, **place.functions}
        given = tuple(tuple(substitute(a, known) for a in group) for group in groups)
        if dual:
            given = tuple(tuple(_primal(a) for a in group) for group in given)
        key = (head, given, foreign)
        if key in self.seen:
            return
        self.seen.add(key)
        inner = self.entered(function, given, place)
        if inner is not None:
            body, mapping, functions = inner
            caller = place.caller or frozenset(self.box)
            there = _Place(mapping, functions, (*place.calls, name), path, place.anchor or node, caller, foreign)
            yield from self.term(body, there)

    def entered(
        self, function: Lam, given: tuple[tuple[Term, ...], ...], place: _Place
    ) -> tuple[Term, dict[str, Term], dict[str, Term]] | None:
        """The callee's body with names of its own, and what its parameters stand for."""
        params, body = uncurry(function, len(given))
        args = _arguments(function, given)
        if args is None or len(args) != len(params):
            return None
        for arg in args:
            self.taken |= arg.free
        body, own = self.apart(body, params)
        mapping: dict[str, Term] = {}
        functions: dict[str, Term] = dict(place.functions)
        for param, arg in zip(own, args, strict=True):
            if isinstance(arg, Lam | Global | Deriv):
                functions[param] = arg
            else:
                mapping[param] = arg
        return body, mapping, functions

    def apart(self, body: Term, params: tuple[str, ...]) -> tuple[Term, tuple[str, ...]]:
        """A copy of the body in which neither parameters nor bound variables are called like anything met so far."""
        bound = [v for n in postorder(body) for v in (n.variables if isinstance(n, Integral) else ())]
        taken = self.taken | set(self.box) | set(body.free) | set(bound)
        own: list[str] = []
        for param in params:
            own.append(fresh(param, taken))
            taken.add(own[-1])
        body = substitute(body, {p: var(o) for p, o in zip(params, own, strict=True)})
        clash = [v for v in bound if v in self.taken or v in self.box]
        if clash:
            names = {v: fresh(v, taken) for v in dict.fromkeys(clash)}
            body = _renamed(body, names)
        self.taken |= set(own)
        return body, tuple(own)


def _renamed(term: Term, names: Mapping[str, str]) -> Term:
    """Bound variables under other names, everywhere. Names of binders in one definition are distinct."""
    memo: dict[Term, Term] = {}
    for node in postorder(term):
        if isinstance(node, Var):
            memo[node] = var(names.get(node.name, node.name))
            continue
        new = rebuild(node, tuple(memo[c] for c in children(node)))
        if isinstance(new, Integral) and any(v in names for v in new.variables):
            new = integral(tuple(names.get(v, v) for v in new.variables), new.bounds, new.body, new.hints)
        memo[node] = new
    return memo[term]


def _primal(arg: Term) -> Term:
    """The value of a dual given to a derivative; a function is given as its derivative."""
    if isinstance(arg, Deriv):
        return arg.function
    if isinstance(arg, Lam | Global | Const):
        return arg
    return proj(arg, 0)


def _number(term: Term, otherwise: float) -> float:
    if isinstance(term, Const):
        return term.value
    value = sample_value(term, {}) if not term.free else math.nan
    return value if value == value else otherwise


def expanded(term: Term, resolve: Resolve, derive: Derive | None = None) -> Term:
    """The term with calls of known functions carried out; of derivatives too, if it is said how.

    A call of a definition inside itself stays a call: how deep it goes is decided by values.
    """
    return _Expansion(resolve, derive).run(term, ())


class _Expansion:
    """One expansion; a call with the same arguments is carried out once."""

    def __init__(self, resolve: Resolve, derive: Derive | None) -> None:
        self.resolve = resolve
        self.derive = derive
        self.known: dict[tuple[Lam, tuple[Term, ...]], Term] = {}

    def run(self, term: Term, path: tuple[Term, ...]) -> Term:
        memo: dict[Term, Term] = {}
        for node in postorder(term):
            if isinstance(node, Proj):
                memo[node] = proj(memo[node.term], node.index)
                continue
            new = rebuild(node, tuple(memo[c] for c in children(node)))
            memo[node] = self.applied(new, path) if isinstance(new, App) else new
        return memo[term]

    def applied(self, call: App, path: tuple[Term, ...]) -> Term:
        head, groups = spine(call)
        named = head
        while isinstance(named, Deriv):
            named = named.function
        if named in path or len(path) > DEEPEST:
            return call
        function = known_function(head, self.resolve, self.derive)
        if function is None:
            return call
        params, body = uncurry(function, len(groups))
        args = _arguments(function, groups)
        if args is None or len(args) != len(params):
            return call
        key = (function, args)
        if key not in self.known:
            inner = (*path, named) if isinstance(named, Global) else path
            self.known[key] = self.run(substitute(body, dict(zip(params, args, strict=True))), inner)
        return self.known[key]


def _arguments(function: Lam, groups: tuple[tuple[Term, ...], ...]) -> tuple[Term, ...] | None:
    """The arguments of all groups, each group as its parameters take it; None if there are more than it has."""
    args: list[Term] = []
    shape: Term = function
    for group in groups:
        if not isinstance(shape, Lam):
            return None
        args.extend(fitted(group, len(shape.params)))
        shape = shape.body
    return tuple(args)


def known_function(head: Term, resolve: Resolve, derive: Derive | None) -> Lam | None:
    """The function that the head of a call is, if it is known."""
    if isinstance(head, Global):
        found = resolve(head)
        return found if isinstance(found, Lam) else None
    if isinstance(head, Deriv) and derive is not None:
        inner = known_function(head.function, resolve, derive)
        return None if inner is None else derive(inner)
    return head if isinstance(head, Lam) else None
