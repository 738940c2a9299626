"""The conditions that vary under the integrals of a definition, also those that calls lead to.

Owns `conditions_of`, `called_by` and `skeleton`. A function exports what `skeleton` keeps of it: its branches, deltas
and calls, over its parameters; so a caller's check reads no more of a callee than that. Conditions that a callee has
over its own variables of integration alone are the callee's to check, unless a function that the caller passed brought
them in or decides them.

So a call is only entered if a variable of integration or a function goes in with its arguments, and a call of what
leads to no condition is not exported: a definition costs by its own size and not by all that lies below its calls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

from msgspec import Struct

from potto.calculus.algebra.point_values import sample_value
from potto.calculus.differentiation.loops import parts_below
from potto.calculus.inlining.currying import arguments_of, groups_of, sizes_of, uncurry
from potto.calculus.inlining.expand import MOST_NAMES, Expansion, Resolve, expanded
from potto.calculus.inlining.numbers import IntegralsAsParameters
from potto.calculus.surfaces.trace import spine
from potto.core.terms import (
    ONE,
    ZERO,
    App,
    Array,
    Branch,
    Const,
    Delta,
    Deriv,
    Fold,
    Global,
    Holding,
    Integral,
    Lam,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    bound_apart,
    branch,
    fresh,
    integral,
    lam,
    postorder,
    proj,
    rebuild,
    substitute,
    transform,
    tuple_,
    var,
)

MOST_CALLS = 1000  # that are entered for one definition: calls with ever new arguments may double at each level
UNNAMED = "a function"  # in `calls`: one that is written where it is called
_TWICE = 2  # how often one definition may stand on the path of calls: a recursion repeats its conditions


class Condition(Struct, frozen=True):
    """A branch or a delta over variables of integration.

    coordinates: as the definition sees them, calls of known functions carried out.
    anchor: the term of the definition itself that leads here: the branch, the delta, or the call.
    box: the variables of integration that occur, each with its bounds where they are constants.
    path: the definitions that were entered on the way here; `written`: the coordinates as the text has them that it
    stands in, mostly that of the last of these.
    """

    coordinates: tuple[Term, ...]
    strict: bool
    anchor: Term
    delta: bool
    box: Mapping[str, tuple[float, float]]
    calls: tuple[str, ...] = ()
    path: tuple[Global, ...] = ()
    written: tuple[Term, ...] = ()

    def __hash__(self) -> int:
        """Without the box, which cannot be hashed."""
        return hash((self.coordinates, self.strict, self.anchor, self.delta, self.calls))

    @property
    def surface(self) -> Term:
        return self.coordinates[0]

    @property
    def variables(self) -> tuple[str, ...]:
        return tuple(v for v in self.box if any(v in c.free for c in self.coordinates))


def called_by(calls: Sequence[str]) -> str:
    """The `calls` of a condition in words, the one that it stands in first."""
    return ", called by ".join(c if c == UNNAMED else f"`{c}`" for c in reversed(calls))


def skeleton(term: Term, leads_on: Callable[[Global], bool] = lambda _: True) -> Term:
    """What others need to know of a definition: its conditions and calls over its parameters.

    `leads_on`: whether a definition that is called has conditions, or calls that lead to some.
    """
    if isinstance(term, Deriv | Global):  # another name, or the derivative of another definition
        return term
    groups: list[tuple[str, ...]] = []
    body: Term = term
    while isinstance(body, Lam):
        groups.append(body.params)
        body = body.body
    kept = _kept(body, leads_on)
    for params in reversed(groups):
        kept = lam(params, kept)
    return kept


def _kept(term: Term, leads_on: Callable[[Global], bool]) -> Term:
    items: dict[Term, None] = {}
    for node in postorder(term, below=_outside_bodies):
        match node:
            case Branch() if node.surface.free:
                items[branch(node.coordinates, node.strict, ONE, ZERO)] = None
            case Delta() if node.free:
                items[node] = None
            case App():
                called = called_definition(node)
                if called is None or leads_on(called):
                    items[node] = None
            case Integral():
                inner = _kept(node.body, leads_on)
                if inner.free:
                    items[integral(node.variables, node.bounds, inner)] = None
            case Sum() | Array() | Fold():
                inner = _kept(node.body, leads_on)
                if inner.free:
                    items[rebuild(node, (*parts_below(node), inner))] = None
            case _:
                pass
    return tuple_(items)


def called_definition(call: App) -> Global | None:
    """The definition that a call, or a call of its derivative, is of."""
    head: Term = call
    while isinstance(head, App | Deriv):
        head = head.function
    return head if isinstance(head, Global) else None


def has_conditions(exported: Term | None) -> bool:
    """Whether a skeleton has conditions, or calls that might lead to some."""
    if isinstance(exported, Deriv | Global):
        return True
    body: Term | None = exported
    while isinstance(body, Lam):
        body = body.body
    return isinstance(exported, Lam) and not (isinstance(body, Tuple) and not body.items)


def _outside_bodies(node: Term) -> Sequence[Term]:
    """The children of a node but for what is integrated, summed or done at each step of a loop."""
    if isinstance(node, Integral):
        return [bound for pair in node.bounds for bound in pair]
    return parts_below(node)


def conditions_of(
    term: Term, skeletons: Resolve, whole: Resolve, given: Mapping[str, Term] = {}
) -> tuple[Condition, ...]:
    """All conditions under the integrals of a term that vary with variables of integration; each once. given: functions
    that some of its parameters stand for."""
    walk = _Walk(skeletons, whole)
    body = term
    while isinstance(body, Lam):
        body = body.body
    walk.term(body, _Place({}, given, (), (), None))
    found = [walk.condition(node, place) for node, place in reversed(walk.met)]  # what is called is expanded first
    return tuple({(c.coordinates, c.anchor): c for c in reversed(found) if c is not None}.values())


class _Place(Struct, frozen=True):
    """Where the walk is: what parameters stand for, which functions were passed, the calls that led here.

    `caller`: the variables of integration around the call that was entered first, or around that of a function that was
    passed; None outside of calls. `names`: the names of parameters here, each with the one in the text.
    """

    mapping: Mapping[str, Term]
    functions: Mapping[str, Term]
    calls: tuple[str, ...]
    path: tuple[Global, ...]
    anchor: Term | None
    caller: frozenset[str] | None = None
    names: Mapping[str, Term] = {}


_BODIES = (Lam, Sum, Array, Fold)
_LOOKED_AT = frozenset({*_BODIES, Integral, App, Branch, Delta})


class _Walk:
    def __init__(self, skeletons: Resolve, whole: Resolve) -> None:
        self.skeletons = skeletons
        self.whole = whole
        self.box: dict[str, tuple[float, float]] = {}
        self.seen: set[tuple[object, ...]] = set()
        self.taken: set[str] = set()
        self.met: list[tuple[Branch | Delta, _Place]] = []
        self.expansion = Expansion(whole, stands_for=IntegralsAsParameters(whole, self.box))
        self.calls = Holding(App)

    def term(self, term: Term, place: _Place) -> None:
        nodes = postorder(term)
        self.taken |= term.free
        looked_at = [node for node in nodes if type(node) in _LOOKED_AT]
        for node in looked_at:
            if isinstance(node, Integral):
                self.taken.update(node.variables)
                for name, (lo, hi) in zip(node.variables, node.bounds, strict=True):
                    self.box[name] = (_number(lo, -math.inf), _number(hi, math.inf))
            elif isinstance(node, _BODIES):
                self.taken |= node.body.free
        heads = {node.function for node in looked_at if isinstance(node, App)}
        for node in looked_at:
            if isinstance(node, (Branch, Delta)):
                self.met.append((node, place))
            elif isinstance(node, App) and node not in heads:
                self.call(node, place)

    def condition(self, node: Branch | Delta, place: _Place) -> Condition | None:
        coordinates = node.coordinates
        mine = _decided_by(coordinates[0], place.functions)
        over = self.box.keys() if mine or place.caller is None else place.caller
        if over.isdisjoint(_reached(coordinates[:1], place)):
            return None
        if isinstance(coordinates[0], Proj) and coordinates[0].index == 0 and len(coordinates) == 1:
            whole = self.seen_through(coordinates[0].term, place)
            coordinates = whole.items if isinstance(whole, Tuple) else (self.seen_through(coordinates[0], place),)
        else:
            coordinates = tuple(self.seen_through(c, place) for c in coordinates)
        surface = coordinates[0]
        if over.isdisjoint(surface.free) or self.calls(surface):  # a function parameter decides: its caller checks
            return None
        box = {v: b for v, b in self.box.items() if any(v in c.free for c in coordinates)}
        strict, anchor = isinstance(node, Branch) and node.strict, place.anchor or node
        written = tuple(substitute(c, place.names) for c in node.coordinates)
        return Condition(coordinates, strict, anchor, isinstance(node, Delta), box, place.calls, place.path, written)

    def seen_through(self, term: Term, place: _Place) -> Term:
        known = {**place.mapping, **place.functions}
        return self.expansion.of(substitute(term, known))

    def call(self, node: App, place: _Place) -> None:
        head, groups = spine(node)
        caller = place.caller
        order = 0
        while isinstance(head, Deriv):
            head, order = head.function, order + 1
        if isinstance(head, Var) and head.name in place.functions:
            head, caller = place.functions[head.name], frozenset(self.box)
        if caller is None:
            caller = frozenset(self.box)
        if caller.isdisjoint(head.free) and not self.goes_in(groups, caller, place):
            return
        name, path = UNNAMED, place.path
        function: Term | None = head
        if isinstance(head, Global):
            if path.count(head) >= _TWICE:
                return
            name, path = head.name, (*path, head)
            function, further = self.followed(head)
            order += further
            if groups_of(function) < len(groups):  # it gives a function under another form: that is in its body alone
                function = self.whole(head)
        if not isinstance(function, Lam):
            return
        known = {**place.mapping, **place.functions}
        given = tuple(tuple(_given(a, known) for a in group) for group in groups)
        for _ in range(order):
            given = tuple(tuple(_primal(a) for a in group) for group in given)
        key = (head, given, caller)
        if key in self.seen or len(self.seen) >= MOST_CALLS:
            return
        self.seen.add(key)
        if (inner := self.entered(function, given, place)) is not None:
            body, mapping, functions, names = inner
            there = _Place(mapping, functions, (*place.calls, name), path, place.anchor or node, caller, names)
            self.term(body, there)

    def followed(self, name: Global) -> tuple[Term | None, int]:
        """The skeleton that a name leads to through other names, and how many derivatives are taken on the way."""
        found, order = self.skeletons(name), 0
        for _ in range(MOST_NAMES):
            if isinstance(found, Deriv):
                found, order = found.function, order + 1
            elif isinstance(found, Global):
                found = self.skeletons(found)
            else:
                break
        return found, order

    def goes_in(self, groups: tuple[tuple[Term, ...], ...], caller: frozenset[str], place: _Place) -> bool:
        """Whether a variable of integration or a function is given to a call; else the rest is the callee's."""
        flat = [item for group in groups for arg in group for item in (arg.items if isinstance(arg, Tuple) else (arg,))]
        if any(isinstance(arg, Lam | Global | Deriv) and not _is_open(arg, place) for arg in flat):
            return True
        if place.functions and any(isinstance(arg, Var) and arg.name in place.functions for arg in flat):
            return True
        return not caller.isdisjoint(_reached(flat, place))

    def entered(
        self, function: Lam, given: tuple[tuple[Term, ...], ...], place: _Place
    ) -> tuple[Term, dict[str, Term], dict[str, Term], dict[str, Term]] | None:
        """The callee's body with names of its own, what its parameters stand for, and which ones they are."""
        params, body = uncurry(function, sizes_of(given))
        args = arguments_of(function, given)
        if len(args) != len(params):
            return None
        for arg in args:
            self.taken |= arg.free
        body, own = self.apart(body, params)
        mapping: dict[str, Term] = {}
        functions = {name: place.functions[name] for name in body.free if name in place.functions}
        for param, arg in zip(own, args, strict=True):
            if isinstance(arg, Lam | Global | Deriv):
                functions[param] = arg
            else:
                mapping[param] = arg
        return body, mapping, functions, _renamed(own, params)

    def apart(self, body: Term, params: tuple[str, ...]) -> tuple[Term, tuple[str, ...]]:
        """A copy of the body in which neither parameters nor bound variables are called like anything met so far."""
        met = self.taken | self.box.keys()
        bound = {name for node in postorder(body) if isinstance(node, Integral) for name in node.variables}
        taken, own = met.union(body.free, bound), list[str]()
        for param in params:
            own.append(fresh(param, taken))
            taken.add(own[-1])
        body = substitute(body, _renamed(params, own))
        if not met.isdisjoint(bound):
            body = transform(body, lambda _, new: bound_apart(new, met) if isinstance(new, Integral) else new)
        self.taken |= set(own)
        return body, tuple(own)


def _renamed(names: Iterable[str], others: Iterable[str]) -> dict[str, Term]:
    """Variables by the names that they had, of those that have others now."""
    return {name: var(other) for name, other in zip(names, others, strict=True) if name != other}


def _decided_by(surface: Term, functions: Mapping[str, Term]) -> bool:
    """Whether a function that was passed decides a condition: then it is its caller's, over whatever it varies with."""
    heads = (spine(part)[0] for part in postorder(surface) if isinstance(part, App)) if functions else ()
    return any(isinstance(head, Var) and head.name in functions for head in heads)


def _is_open(function: Lam | Global | Deriv, place: _Place) -> bool:
    """Whether what a function gives hangs on a function that only the callers of the definition know, and it brings no
    condition of its own: then no condition that it decides can be told here."""
    if not isinstance(function, Lam):
        return False
    parts = postorder(function.body)
    if any(not isinstance(part, App | Var | Const | Prim | Tuple | Proj) for part in parts):
        return False
    heads = (spine(part)[0] for part in parts if isinstance(part, App))
    return any(isinstance(head, Var) and head.name in function.free - place.functions.keys() for head in heads)


def _given(argument: Term, known: Mapping[str, Term]) -> Term:
    """An argument with what is known put in. In one that is a function, calls of functions that are known by now are
    carried out: left as they are, each level of a chain that passes a function on would go through all before it."""
    found = substitute(argument, known)
    return expanded(found, lambda _: None) if found is not argument and isinstance(found, Lam) else found


def _reached(terms: Iterable[Term], place: _Place) -> set[str]:
    """The names that terms have free once parameters are what they stand for."""
    found: set[str] = set()
    for name in {name for term in terms for name in term.free}:
        stands_for = place.mapping.get(name) or place.functions.get(name)
        found.update((name,) if stands_for is None else stands_for.free)
    return found


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
