"""Walking terms without recursion: children, rebuilding, postorder, substitution.

Owns what every pass is made of. Only binders recurse, and they nest no deeper than a person writes them.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence, Set
from operator import attrgetter, is_
from typing import Any, Generic, TypeVar

from potto.core.folding import apply
from potto.core.term_kinds import (
    App,
    Array,
    Branch,
    Const,
    Data,
    Delta,
    Deriv,
    Fold,
    Global,
    Hole,
    If,
    Index,
    Integral,
    Lam,
    Length,
    ListOf,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    app,
    array,
    branch,
    delta,
    deriv,
    fold,
    if_,
    index,
    integral,
    lam,
    length,
    list_of,
    proj,
    sum_,
    tuple_,
    union_of,
    var,
)

Binder = TypeVar("Binder", bound=Term)
Found = TypeVar("Found")
Key = TypeVar("Key")


def children(term: Term) -> tuple[Term, ...]:
    """The subterms of a term, in the order in which `rebuild` takes them."""
    return _CHILDREN[type(term)](term)


def _none(term: Term) -> tuple[Term, ...]:
    return ()


def _of_integral(term: Integral) -> tuple[Term, ...]:
    return (*(b for pair in term.bounds for b in pair), *(p for points in term.hints for p in points), term.body)


# By the type of the term: this is asked more often than anything else.
_CHILDREN: dict[type, Callable[[Any], tuple[Term, ...]]] = {
    Const: _none,
    Var: _none,
    Global: _none,
    Hole: _none,
    Data: _none,
    Prim: attrgetter("args"),
    If: attrgetter("condition", "then", "orelse"),
    Branch: lambda term: (*term.coordinates, term.then, term.orelse),
    Tuple: attrgetter("items"),
    ListOf: attrgetter("items"),
    Proj: lambda term: (term.term,),
    Lam: lambda term: (term.body,),
    App: lambda term: (term.function, *term.args),
    Integral: _of_integral,
    Delta: attrgetter("coordinates"),
    Sum: attrgetter("lo", "hi", "body"),
    Fold: attrgetter("lo", "hi", "start", "body"),
    Array: attrgetter("size", "body"),
    Index: attrgetter("array", "index"),
    Length: lambda term: (term.array,) if term.like is None else (term.array, term.like),
    Deriv: lambda term: (term.function,),
}


def rebuild(term: Term, parts: tuple[Term, ...]) -> Term:
    """The same term over other children, folded by the smart constructors."""
    old = children(term)
    if len(parts) != len(old):
        raise ValueError(f"{len(parts)} parts for {len(old)} children")
    if all(map(is_, parts, old)):
        return term
    match term:  # what has no children is the term itself
        case Prim():
            return apply(term.op, *parts)
        case If():
            return if_(*parts)
        case Branch():
            return branch(parts[:-2], term.strict, parts[-2], parts[-1])
        case Tuple():
            return tuple_(parts)
        case ListOf():
            return list_of(parts)
        case Proj():
            return proj(parts[0], term.index)
        case Lam():
            return lam(term.params, parts[0])
        case App():
            return app(parts[0], parts[1:])
        case Integral():
            n = len(term.variables)
            bounds = tuple((parts[2 * i], parts[2 * i + 1]) for i in range(n))
            rest = iter(parts[2 * n : -1])
            hints = tuple(tuple(next(rest) for _ in points) for points in term.hints)
            return integral(term.variables, bounds, parts[-1], hints)
        case Delta():
            return delta(parts)
        case Sum():
            lo, hi, body = parts
            return sum_(term.variable, lo, hi, body, term.endless)
        case Fold():
            lo, hi, start, body = parts
            return fold(term.variable, lo, hi, term.state, start, body)
        case Array():
            return array(term.variable, *parts)
        case Index():
            return index(*parts)
        case Length():
            return length(parts[0], term.rising, parts[1] if len(parts) > 1 else None, term.filled)
        case Deriv():
            return deriv(parts[0])
        case Const() | Var() | Global() | Hole() | Data():
            return term


def postorder(*roots: Term, below: Callable[[Term], Sequence[Term]] | None = None) -> list[Term]:
    """Every distinct subterm once, children (or whatever `below` leads to) before parents. Does not recurse."""
    seen: set[Term] = set()
    order: list[Term] = []
    stack: list[Term | None] = list(reversed(roots))  # None: the term below it has all its children in the order
    pop, push = stack.pop, stack.append
    while stack:
        term = pop()
        if term is None:
            order.append(pop())  # type: ignore[arg-type]
        elif term not in seen:
            seen.add(term)
            parts = _CHILDREN[type(term)](term) if below is None else below(term)
            if not parts:
                order.append(term)
                continue
            push(term)
            push(None)
            for child in reversed(parts):
                if child not in seen:
                    push(child)
    return order


def transform(
    root: Term,
    change: Callable[[Term, Term], Term],
    below: Callable[[Term], Sequence[Term]] = children,
    made: dict[Term, Term] | None = None,
) -> Term:
    """A term rebuilt from below: `change` makes of every part, and of the same over changed children, what it becomes.

    below: the children of a part, or none where it is changed only as a whole. made: what parts have become; it grows.
    """
    order = postorder(root, below=below) if made is None else unknown(root, made, below)
    made = {} if made is None else made
    for node in order:
        parts = tuple([made[child] for child in below(node)])
        made[node] = change(node, rebuild(node, parts) if parts else node)
    return made[root]


def replaced(root: Term, parts: Mapping[Term, Term]) -> Term:
    """A term with some of its parts replaced; what is in them is not looked at."""
    return transform(root, lambda node, new: parts.get(node, new), lambda n: () if n in parts else children(n))


def unknown(root: Term, known: Container[Term], below: Callable[[Term], Sequence[Term]] = children) -> list[Term]:
    """The parts of a term that nothing is known of yet, children first: what is known is not gone into."""
    if root in known:
        return []
    order = postorder(root, below=lambda node: () if node in known else below(node))
    return [node for node in order if node not in known]


class Kept(Generic[Key, Found]):
    """What was found out about terms, in a table for as long as it is not too large. Then comes a new one; whoever
    fills the one before goes on with that."""

    def __init__(self, most: int = 4096) -> None:
        self.most = most
        self.found: dict[Key, Found] = {}

    def table(self) -> dict[Key, Found]:
        if len(self.found) > self.most:
            self.found = {}
        return self.found


class Told(Generic[Found]):
    """What is told of a term by what is told of its parts. What was looked through once is not looked through again.

    tell: of a term, and what was told of each of the parts that are below it.
    """

    def __init__(
        self, tell: Callable[[Term, list[Found]], Found], below: Callable[[Term], Sequence[Term]] = children
    ) -> None:
        self.tell = tell
        self.below = below
        self.known: Kept[Term, Found] = Kept(65536)

    def __call__(self, term: Term) -> Found:
        known = self.known.table()
        for node in unknown(term, known, self.below):
            known[node] = self.tell(node, [known[part] for part in self.below(node)])
        return known[term]


class Holding(Told[bool]):
    """Whether terms have parts of some kinds."""

    def __init__(self, *kinds: type[Term]) -> None:
        super().__init__(lambda node, parts: type(node) in kinds or any(parts))


def outside(root: Term, binders: tuple[type[Term], ...]) -> Iterator[Term]:
    """The parts of a term that are not inside a binder of these kinds, each once; the outermost binders are parts."""
    waiting, seen = [root], set[Term]()
    while waiting:
        node = waiting.pop()
        if node not in seen:
            seen.add(node)
            yield node
            if not isinstance(node, binders):
                waiting.extend(children(node))


def reached(*roots: Term, resolve: Callable[[Global], Term | None]) -> Iterator[list[Term]]:
    """The parts of terms, and those of the definitions that they lead to, as `postorder` has them, each once.

    resolve: what a name stands for; None where nobody knows.
    """
    waiting, seen = list(roots), set[Term]()
    while waiting:
        parts = postorder(waiting.pop())
        yield parts
        names = [node for node in parts if isinstance(node, Global) and node not in seen]
        seen.update(names)
        waiting += [known for name in names if (known := resolve(name)) is not None]


_BOUND: dict[type, Callable[[Any], tuple[str, ...]]] = {
    Lam: lambda t: t.params,
    Integral: lambda t: t.variables,
    Sum: lambda t: (t.variable,),
    Array: lambda t: (t.variable,),
    Fold: lambda t: (t.variable, t.state),
}


def bound_names(term: Term) -> tuple[str, ...]:
    """The variables that a term binds in its parts."""
    found = _BOUND.get(type(term))
    return () if found is None else found(term)


def fresh(name: str, taken: Iterable[str]) -> str:
    """A name like `name` that is not taken: `x`, `x'1`, `x'2`, ..."""
    if not isinstance(taken, Set):
        taken = set(taken)
    number, candidate = 0, name
    while candidate in taken:
        number += 1
        candidate = f"{stem(name)}'{number}"
    return candidate


def stem(name: str) -> str:
    """What a fresh name was made from: the name that a person wrote."""
    return name.split("'")[0]


def substitute(term: Term, mapping: Mapping[str, Term]) -> Term:
    """Replace free variables by terms at once, renaming binders that would capture. Recursion only at binders."""
    mapping = {name: new for name, new in mapping.items() if name in term.free}
    if not mapping:
        return term
    untouched, incoming = frozenset(mapping).isdisjoint, union_of(mapping.values())

    def below(node: Term) -> Sequence[Term]:
        return () if type(node) in _BOUND else [part for part in children(node) if not untouched(part.free)]

    made: dict[Term, Term] = {}
    for node in postorder(term, below=below):
        if isinstance(node, Var):
            made[node] = mapping[node.name]
        elif type(node) in _BOUND:
            made[node] = _in_scopes(node, mapping, _fresh_names(node, incoming))
        else:
            made[node] = rebuild(node, tuple([made.get(part, part) for part in children(node)]))
    return made[term]


def _fresh_names(binder: Term, taken: Set[str]) -> dict[str, str]:
    """Other names for what a binder binds, where those are taken."""
    names: dict[str, str] = {}
    clash = [name for name in bound_names(binder) if name in taken]
    if clash:
        used = {*taken, *bound_names(binder), *(name for part in children(binder) for name in part.free)}
        for name in clash:
            names[name] = fresh(name, used)
            used.add(names[name])
    return names


def rename_bound(term: Binder, names: Mapping[str, str]) -> Binder:
    """The same binder with other names for (some of) the variables that it binds."""
    renamed = _in_scopes(term, {}, names)
    assert isinstance(renamed, type(term))
    return renamed


def bound_apart(term: Binder, taken: Set[str]) -> Binder:
    """The same binder with other names for the variables that it binds, where those are taken."""
    names = _fresh_names(term, taken)
    return rename_bound(term, names) if names else term


def _in_scopes(term: Term, mapping: Mapping[str, Term], names: Mapping[str, str]) -> Term:
    """A binder with free variables replaced, and with names for those that it binds, each where it is seen: bounds of
    an integral see the variables before them only."""
    seen = dict(mapping)

    def enter(name: str) -> str:
        seen.pop(name, None)
        if name in names:
            seen[name] = var(names[name])
        return names.get(name, name)

    match term:
        case Lam():
            return lam(tuple([enter(name) for name in term.params]), substitute(term.body, seen))
        case Sum():
            lo, hi = substitute(term.lo, seen), substitute(term.hi, seen)
            return sum_(enter(term.variable), lo, hi, substitute(term.body, seen), term.endless)
        case Fold():
            lo, hi, start = (substitute(part, seen) for part in (term.lo, term.hi, term.start))
            variable, state = enter(term.variable), enter(term.state)
            return fold(variable, lo, hi, state, start, substitute(term.body, seen))
        case Array():
            size = substitute(term.size, seen)
            return array(enter(term.variable), size, substitute(term.body, seen))
        case Integral():
            variables, bounds, hints = list[str](), list[tuple[Term, Term]](), list[tuple[Term, ...]]()
            for name, (lo, hi), points in zip(term.variables, term.bounds, term.hints, strict=True):
                bounds.append((substitute(lo, seen), substitute(hi, seen)))
                hints.append(tuple([substitute(p, seen) for p in points]))
                variables.append(enter(name))
            return integral(tuple(variables), tuple(bounds), substitute(term.body, seen), tuple(hints))
        case _:
            raise TypeError(f"{type(term).__name__} binds nothing")
