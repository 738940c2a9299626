"""Calls carried out: a term in which known functions are replaced by what they do.

Owns `expanded`, `holds_call`, `Expansion`, `Calls`, `known_function`, `named` and `heads_of`. Calls inside calls are
gone into on a stack of their own (`Step`, `driven`), so that no number of them is too deep.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator
from functools import partial
from itertools import chain

from potto.calculus.inlining.currying import arguments_of, sizes_of, uncurry
from potto.calculus.surfaces.trace import spine
from potto.core.binders import Bound, apart
from potto.core.terms import (
    App,
    Array,
    Const,
    Deriv,
    Global,
    Holding,
    If,
    Index,
    Lam,
    ListOf,
    Proj,
    Term,
    Tuple,
    Var,
    children,
    const,
    deriv,
    fresh,
    index,
    lam,
    list_of,
    postorder,
    proj,
    rebuild,
    substitute,
    transform,
    tuple_,
    unknown,
    var,
)

# The term of another definition: its skeleton, or all of it.
Resolve = Callable[[Global], "Term | None"]
# The dual of a function.
Derive = Callable[[Lam], Lam]

Groups = tuple[tuple[Term, ...], ...]
# What gives a term once those that it yields have given theirs, which it is sent.
Step = Generator["Step", Term, Term]

MOST_ITEMS = 64  # functions in an array that are looked at one by one
MOST_NAMES = 100  # that a definition may lead through


holds_call = Holding(App)


def _below_calls(node: Term) -> tuple[Term, ...]:
    """The children of a term, as far as there are calls in it: the rest stays as it is."""
    return children(node) if holds_call(node) else ()


def expanded(term: Term, resolve: Resolve, derive: Derive | None = None, rounds: int = 1) -> Term:
    """The term with calls of known functions carried out; of derivatives too, if it is said how.

    rounds: how many calls of a recursion are carried out inside each other.
    """
    return Expansion(resolve, derive, rounds).of(term)


def driven(step: Step) -> Term:
    """What a step gives in the end: recursion, on a stack that has no end."""
    waiting: list[Step] = [step]
    given: Term | None = None
    while waiting:
        try:
            waiting.append(waiting[-1].send(given) if given is not None else next(waiting[-1]))
            given = None
        except StopIteration as end:
            waiting.pop()
            given = end.value
    assert given is not None
    return given


class Calls:
    """Calls that were carried out, each with the same arguments once."""

    def __init__(self) -> None:
        self.known: dict[tuple[Lam, tuple[Term, ...]], Term] = {}

    def carried_out(self, call: App, function: Lam, groups: Groups, run: Callable[[Term], Step]) -> Step:
        """What `run` makes of the function's body with the arguments in it; the call, if they don't fit."""
        params, body = uncurry(function, sizes_of(groups))
        args = arguments_of(function, groups)
        if len(args) != len(params):
            return call
        key = (function, args)
        if key not in self.known:
            self.known[key] = yield run(substitute(body, dict(zip(params, args, strict=True))))
        return self.known[key]


class Expansion:
    """Calls carried out in one term or several, each call with the same arguments once.

    A call of a definition inside itself stays a call after some rounds: how deep it goes is decided by values. What
    such calls lead to is forgotten between terms, since it depends on where they stand. Binders that get inside of each
    other have names of their own. stands_for: what is put for a call that is not carried out, if anything is.
    """

    def __init__(
        self, resolve: Resolve, derive: Derive | None = None, rounds: int = 1,
        stands_for: Callable[[App], Term | None] = lambda _: None,
    ) -> None:  # fmt: skip
        self.resolve = resolve
        self.stands_for = stands_for
        self.derive = derive
        self.rounds = rounds
        self.calls = Calls()
        self.within = Counter[Term]()  # the functions that are being carried out
        self.left = False  # whether a call was, for its rounds
        self.made: dict[Term, Term] = {}  # what terms are with all calls in them carried out
        self.bound: Bound = {}

    def of(self, term: Term) -> Term:
        whole = driven(self.run(term))
        if self.left:
            self.calls, self.made, self.left = Calls(), {}, False
        return apart(whole, self.bound)

    def run(self, term: Term) -> Step:
        if not holds_call(term):
            return term
        made, order = self.made, unknown(term, self.made, _below_calls)
        for node in order:
            if not holds_call(node):
                made[node] = node
            elif isinstance(node, Proj):
                made[node] = proj(made[node.term], node.index)
            else:
                new = rebuild(node, tuple([made[c] for c in children(node)]))
                made[node] = (yield self.applied(new)) if isinstance(new, App) else new
        found = made[term]
        if self.left:  # elsewhere the same may be carried out
            for node in order:
                del made[node]
        return found

    def inside(self, named: Term, term: Term) -> Step:
        """What is carried out within a function."""
        self.within[named] += 1
        found = yield self.run(term)
        self.within[named] -= 1
        return found

    def applied(self, call: App) -> Step:
        if (known := self.stands_for(call)) is not None:
            return known
        head, groups = spine(call)
        named = head
        while isinstance(named, Deriv):
            named = named.function
        if self.within[named] >= self.rounds:
            self.left = True
            return call
        if isinstance(head, Deriv):
            spelled = tuple([tuple(map(self.spelled, group)) for group in groups])
            if any(isinstance(arg, Array) and _has_functions(arg.body) for arg in chain.from_iterable(spelled)):
                return call  # until it is known which functions there are
            if any(map(_has_functions, chain.from_iterable(spelled))):
                head, groups = yield from self.in_parts(head, spelled, named)
        function = known_function(head, self.resolve, self.derive)
        if function is None:
            return call
        run = partial(self.inside, named) if isinstance(named, Global) else self.run
        return (yield self.calls.carried_out(call, function, groups, run))

    def spelled(self, arg: Term) -> Term:
        """An array of what is made of functions, element by element, where it is known which they are."""
        if not isinstance(arg, Array) or not _has_functions(arg.body):
            return arg
        whole = transform(arg, lambda _, new: self.listed(new) if isinstance(new, Global) else new)
        if not isinstance(whole, Array) or not isinstance(whole.size, Const) or whole.size.value > MOST_ITEMS:
            return arg
        return list_of(substitute(whole.body, {whole.variable: const(n)}) for n in range(int(whole.size.value)))

    def listed(self, name: Global) -> Term:
        found = named(name, self.resolve)
        return found if isinstance(found, ListOf) else name

    def in_parts(self, head: Deriv, groups: Groups, named: Term) -> Generator[Step, Term, tuple[Term, Groups]]:
        """The derivative of a function of the parts of those arguments in which there are functions, and these parts:
        duals stand side by side in them, and a parameter that is called is seen to be a function, also where it is
        handed on."""
        inner = known_function(head.function, self.resolve, self.derive)
        if inner is None:
            return head, groups
        params, body = uncurry(inner, sizes_of(groups))
        args = arguments_of(inner, groups)
        if args != tuple(chain.from_iterable(groups)) or len(args) != len(params):
            return head, groups
        taken, parts = {*params, *body.free}, list[tuple[str, Term]]()
        whole = {param: _named(param, arg, taken, parts) for param, arg in zip(params, args, strict=True)}
        names, given = zip(*parts, strict=True)
        opened = transform(substitute(body, whole), _part_by_part)
        functions = {name for name, arg in parts if _has_functions(arg)}
        if _hands_on(opened, functions):
            opened = yield self.inside(named, opened)
        return deriv(lam(names, opened)), (given,)


def _has_functions(arg: Term) -> bool:
    """Whether an argument is a function, or a tuple or an array in which there is one."""
    if isinstance(arg, Tuple | ListOf):
        return any(map(_has_functions, arg.items))
    return isinstance(arg, Deriv | Lam)


def _part_by_part(_: Term, new: Term) -> Term:
    """A part of an element of an array of tuples as an element of an array of these parts."""
    if isinstance(new, Proj) and isinstance(new.term, Index) and isinstance(new.term.array, ListOf):
        return index(list_of(proj(item, new.index) for item in new.term.array.items), new.term.index)
    return new


def _hands_on(term: Term, functions: set[str]) -> bool:
    """Whether one of these functions is an argument of a call, or a part of one."""
    waiting = [arg for node in postorder(term) if isinstance(node, App) for arg in node.args]
    while waiting:
        arg = waiting.pop()
        if isinstance(arg, Var) and arg.name in functions:
            return True
        if isinstance(arg, Tuple | ListOf):
            waiting += arg.items
    return False


def _named(name: str, arg: Term, taken: set[str], parts: list[tuple[str, Term]]) -> Term:
    """A parameter as it is put together of its parts, each of which gets a name, with its argument."""
    if isinstance(arg, Tuple | ListOf) and _has_functions(arg):
        items = [_named(name, item, taken, parts) for item in arg.items]
        return tuple_(items) if isinstance(arg, Tuple) else list_of(items)
    own = fresh(name, taken)
    taken.add(own)
    parts.append((own, arg))
    return var(own)


def known_function(head: Term, resolve: Resolve, derive: Derive | None) -> Lam | None:
    """The function that the head of a call is, if it is known."""
    if isinstance(head, Global):
        found = named(head, resolve)
        if isinstance(found, Deriv) and derive is not None:  # a derivative that has a name
            return known_function(found, resolve, derive)
        return found if isinstance(found, Lam) else None
    if isinstance(head, Deriv) and derive is not None:
        inner = known_function(head.function, resolve, derive)
        return None if inner is None else derive(inner)
    if isinstance(head, Proj):
        whole = named(head.term, resolve) if isinstance(head.term, Global) else None
        return known_function(whole.items[head.index], resolve, derive) if isinstance(whole, Tuple) else None
    return head if isinstance(head, Lam) else None


def named(name: Global, resolve: Resolve) -> Term | None:
    """What a name stands for, through definitions that are other names."""
    found: Term | None = name
    for _ in range(MOST_NAMES):
        if not isinstance(found, Global):
            return found
        found = resolve(found)
    return None


def heads_of(term: Term) -> frozenset[str]:
    """The variables that are functions: those that are applied, also by their place in an array."""
    heads = [node.function for node in postorder(term) if isinstance(node, App)]
    found: set[str] = set()
    while heads:
        match heads.pop():
            case Var(name=name):
                found.add(name)
            case Deriv(function=inner):
                heads.append(inner)
            case Index(array=ListOf(items=items)):
                heads += items
            case Proj(term=Index(array=ListOf(items=items)), index=number):
                heads += [proj(item, number) for item in items if isinstance(item, Tuple)]
            case If(then=then, orelse=orelse):
                heads += (then, orelse)
    return frozenset(found)
