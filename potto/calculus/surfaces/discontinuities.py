"""The surfaces of a term: where it jumps, where it has a kink, where it stops being smooth, through its calls.

Owns `findings` and `surfaces_below`. A function compiled alone exports its conditions as terms over its parameters;
here a caller's arguments are put in for them. Each jump comes with the trace that forces it: the path of sites from the
term to the branch. Plain conditions and sums that decide what there is are asked of `decide`, so that a recursion is
followed only as deep as its values go.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache

from msgspec.structs import replace

from potto.calculus.decomposition.sweep import sweep
from potto.calculus.inlining.currying import arguments_of, groups_of, sizes_of, uncurry
from potto.calculus.inlining.expand import Expansion, holds_call
from potto.calculus.surfaces.case_split import by_extremes
from potto.calculus.surfaces.domains import ends_of_domain
from potto.calculus.surfaces.finding import Decide, Finding, Resolve
from potto.calculus.surfaces.nested_brackets import BINDERS, pieces
from potto.calculus.surfaces.trace import CallSite, Side, Subkernel, layout, spine
from potto.core.terms import (
    App,
    Branch,
    Const,
    Deriv,
    If,
    Integral,
    Lam,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    children,
    const,
    postorder,
    proj,
    substitute,
    tuple_,
)  # fmt: skip
from potto.primitives import PRIMITIVES

DEEPEST = 2000
ROUNDS = 12  # of a recursion that are carried out in a surface


class TooDeep(Exception):
    """A recursion was followed past `DEEPEST` calls."""


def undecided(term: Term) -> float | None:
    return term.value if isinstance(term, Const) else None


def underlying(head: Term, resolve: Resolve) -> tuple[Lam | None, int]:
    """The function that is called, or whose derivative is called; and how many derivatives of it are taken."""
    order = 0
    function: Term | None = head
    while function is not None and not isinstance(function, Lam):
        if isinstance(function, Deriv):
            function, order = function.function, order + 1
        else:
            function = resolve(function)
    return function, order


def findings(term: Term, resolve: Resolve, decide: Decide = undecided) -> tuple[Finding, ...]:
    """All surfaces of a term, jumps with the trace that forces them. Raises TooDeep."""
    return _Search(resolve, decide).findings(term)


def surfaces_below(terms: Iterable[Term], resolve: Resolve, decide: Decide) -> tuple[Finding, ...]:
    """The surfaces of some terms together, whatever they have in common once, without traces. Raises TooDeep."""
    return _Search(resolve, decide, set()).findings(tuple_(terms))


@lru_cache(maxsize=4096)
def _telling(term: Term) -> tuple[Prim | Integral, ...]:
    """The builtins and integrals of a term that may jump or bend somewhere: of hundreds of sums and products none."""
    parts = layout(term).order
    return tuple(node for node in parts if isinstance(node, Integral) or (isinstance(node, Prim) and _turns(node)))


def _turns(node: Prim) -> bool:
    entry = PRIMITIVES[node.op]
    turning = entry.kinks(*node.args) or entry.steps(*node.args) or centers(node) or entry.edges(*node.args)
    return bool(node.free and turning)


def carried_out(term: Term, resolve: Resolve) -> Term:
    """A term with the calls in it replaced by what they give, as far as `resolve` knows, also of functions that are
    parameters: then it can be solved. A recursion stays a call after some rounds."""
    return _Carrying(resolve).out(term)


class _Carrying:
    """Terms with calls carried out, each with the same arguments once."""

    def __init__(self, resolve: Resolve, rounds: int = 1) -> None:
        self.resolve = resolve
        self.expansion = Expansion(resolve, rounds=rounds)

    def out(self, term: Term) -> Term:
        if not holds_call(term):
            return term
        known = {node.name: self.resolve(node) for node in postorder(term) if isinstance(node, Var)}
        passed: dict[str, Term] = {name: function for name, function in known.items() if isinstance(function, Lam)}
        return self.expansion.of(substitute(term, passed))

    def found(self, f: Finding) -> Finding:
        if f.critical is None and not holds_call(f.surface):
            return f
        critical = None if f.critical is None else f.critical.mapped(self.out)
        return replace(f, surface=self.out(f.surface), critical=critical)


class _Search:
    """once: calls that were gone into, where each is gone into once, whoever calls."""

    def __init__(self, resolve: Resolve, decide: Decide, once: set[tuple[Term, ...]] | None = None) -> None:
        self.resolve = resolve
        self.decide = decide
        self.once = once
        self.near, self.deep = _Carrying(resolve), _Carrying(resolve, ROUNDS)

    def findings(self, term: Term) -> tuple[Finding, ...]:
        found = tuple(self.deep.found(f) for f in self.term(term, {}, (), 0))
        ends = {end: None for f in found if f.kind == "jump" for end in ends_of_domain(f.surface)}
        return (*found, *(Finding("kink", end) for end in ends))

    def term(self, term: Term, mapping: dict[str, Term], path: tuple[int, ...], depth: int) -> Iterator[Finding]:
        if depth > DEEPEST:
            raise TooDeep
        for node in _telling(term):
            yield from self.builtin(node, mapping) if isinstance(node, Prim) else self.nested(node, mapping)
        for number, site in enumerate(layout(term).sites):
            here = (*path, number)
            match site:
                case Side(branch=branch):
                    yield Finding("jump", substitute(branch.surface, mapping), here, branch.strict)
                case Subkernel():
                    yield from self.part(site, mapping, here, depth)
                case CallSite():
                    yield from self.call(site, mapping, here, depth)

    def builtin(self, node: Prim, mapping: dict[str, Term]) -> Iterator[Finding]:
        entry = PRIMITIVES[node.op]
        for kink in entry.kinks(*node.args):
            for piece in self.pieces(kink, mapping):
                yield Finding("kink", piece)
        for step in entry.steps(*node.args):
            for piece in self.pieces(step, mapping):
                yield Finding("step", piece)
        for center in centers(node):
            yield Finding("center", substitute(center, mapping))
        if node.op != "div":  # a pole is not an edge to cut at: the integral diverges there or the pole is outside
            for edge in entry.edges(*node.args):
                for piece in self.pieces(edge, mapping):
                    yield Finding("edge", piece)

    def pieces(self, surface: Term, mapping: dict[str, Term]) -> Iterator[Term]:
        """What a surface is on either side of the conditions inside of it, also of those that calls lead to."""
        surface = self.near.out(substitute(surface, mapping))
        return (piece for piece in pieces(surface) if piece.free)

    def nested(self, node: Integral, mapping: dict[str, Term]) -> Iterator[Finding]:
        """What the variables around an integral see of it: jumps that none of its variables take part in, and kinks."""
        inner = substitute(node, mapping)
        assert isinstance(inner, Integral)
        inner = by_extremes(inner)
        found, own = self.findings(inner.body), set(inner.variables)
        bounds = (f for pair in inner.bounds for bound in pair for f in self.findings(bound))
        for f in (*found, *bounds):
            if f.kind == "step" or (f.kind == "jump" and not f.surface.free & own):
                yield replace(f, path=())
        swept = (f for f in found if f.kind != "jump" or f.surface.free & own)
        yield from sweep(inner, swept, self.resolve, self.findings).outer

    def part(self, site: Subkernel, mapping: dict[str, Term], path: tuple[int, ...], depth: int) -> Iterator[Finding]:
        owner = site.owner
        if isinstance(owner, If):
            outcome = self.decide(substitute(owner.condition, mapping))
            if outcome is not None and bool(outcome) != (site.index == 0):
                return
        if isinstance(owner, Sum):
            lo, hi = (self.decide(substitute(b, mapping)) for b in (owner.lo, owner.hi))
            if lo is None or hi is None:
                return
            for number in range(int(lo), int(hi) + 1):
                inner = {**mapping, owner.variable: const(number)}
                yield from self.term(owner.body, inner, (*path, number - int(lo)), depth + 1)
            return
        yield from self.term(site.body.body, mapping, path, depth + 1)

    def call(self, site: CallSite, mapping: dict[str, Term], path: tuple[int, ...], depth: int) -> Iterator[Finding]:
        found = self.called(substitute(site.head, mapping))
        if found is None:
            return
        function, before, order = found
        groups = (*before, *(tuple(substitute(a, mapping) for a in group) for group in site.groups))
        params, body = uncurry(function, sizes_of(groups))
        args = arguments_of(function, groups)
        if len(args) != len(params):
            return
        for _ in range(order):
            args = tuple(map(_primal, args))
        if self.once is not None:
            if (function, *args) in self.once:
                return
            self.once.add((function, *args))
        yield from self.term(body, dict(zip(params, args, strict=True)), path, depth + 1)

    def called(self, head: Term) -> tuple[Lam, tuple[tuple[Term, ...], ...], int] | None:
        """What stands at the head of a call: the function, what it was given before, how many derivatives are taken.

        A function that earlier calls gave in full is what these gave, as it is when the program runs.
        """
        head, before = _spine(head)
        function, order = underlying(head, self.resolve)
        while function is not None and groups_of(function) < len(before):
            own = groups_of(function)
            params, body = uncurry(function, sizes_of(before[:own]))
            args = arguments_of(function, before[:own])
            if len(args) != len(params):
                return None
            for _ in range(order):
                args = tuple(map(_primal, args))
            head, first = _spine(substitute(body, dict(zip(params, args, strict=True))))
            before = (*first, *before[own:])
            function, more = underlying(head, self.resolve)
            order += more
        return None if function is None else (function, before, order)


@lru_cache(maxsize=4096)
def centers(node: Prim) -> tuple[Term, ...]:
    """Terms around whose zeros a builtin may be concentrated, if a part of its argument is steep."""
    centered = PRIMITIVES[node.op].centered
    if node.op == "pow" and not node.args[0].free:
        where = node.args[1]
    elif centered or node.op in ("exp", "div"):
        where = node.args[1] if node.op == "div" else node.args[0]
    else:
        return ()
    if not where.free:
        return ()
    if centered:
        return (where,)
    if node.op == "div" and isinstance(where, Prim) and where.op in ("pow", "mul"):
        return ()  # a pole there, not a center
    found: dict[Term, None] = {}
    for part in postorder(where, below=_values):
        if not isinstance(part, Prim) or not part.free:
            continue
        if part.op == "pow" and isinstance(part.args[1], Const) and part.args[1].value % 2 == 0:
            found[part.args[0]] = None
        elif part.op == "mul" and len(set(part.args)) < len(part.args):
            found.update((a, None) for a in part.args if part.args.count(a) > 1 and a.free)
        elif node.op == "div" and part.op in ("exp", "cosh"):
            found[part.args[0]] = None
    return tuple(found)


def _values(node: Term) -> Sequence[Term]:
    """What a value is made of: not what a condition compares, at which it is cut anyway."""
    if isinstance(node, BINDERS):
        return ()
    return (node.then, node.orelse) if isinstance(node, Branch | If) else children(node)


def _spine(head: Term) -> tuple[Term, tuple[tuple[Term, ...], ...]]:
    """What is called, and the groups of arguments that it was given before."""
    return spine(head) if isinstance(head, App) else (head, ())


def _primal(arg: Term) -> Term:
    """The value of a dual given to a derivative; functions are given as derivatives of functions."""
    if isinstance(arg, Deriv):
        return arg.function
    if isinstance(arg, Tuple) and len(arg.items) == 2:
        return arg.items[0]
    if isinstance(arg, (Lam, Const)):
        return arg
    return proj(arg, 0) if isinstance(arg, (Proj, App)) else arg
