"""An integral of tangents as the tangent of an integral.

Owns `shifted`. What `deriv(f)` gives along (u, u') is the derivative of f(u + s u') by s at s = 0, deltas and all: that
is what a distribution is. So the integral over anything that is linear in such tangents is the derivative, by s, of the
integral with f(u + s u') in their place. No delta has to be written down, so f may jump where no closed form tells:
the integral is differentiated by numbers, along the cuts of f.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from potto.calculus.differentiation.boundary_terms import total, vanishes
from potto.calculus.differentiation.derivative import zero_like
from potto.calculus.differentiation.tangents import NotShifted, Shapes, Site, Sites
from potto.calculus.inlining.expand import Resolve, expanded, named
from potto.calculus.surfaces.trace import spine
from potto.core.terms import (
    ONE,
    ZERO,
    App,
    Branch,
    Deriv,
    Global,
    If,
    Integral,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    add,
    app,
    children,
    deriv,
    fresh,
    integral,
    lam,
    mul,
    postorder,
    postorder_by,
    proj,
    rebuild,
    transform,
    tuple_,
    var,
)

STEP = "step@"  # what the names of steps begin with, as no other does
LINEAR, BEYOND = 1, 2  # how a term depends on tangents; 0: not at all


def shifted(term: Integral, resolve: Resolve, leads: Callable[[Term], bool], shapes: Shapes) -> Term | None:
    """An equal term without tangents that may have deltas; None where there are no such tangents.

    leads: whether a definition leads to derivatives. shapes: how the values of free variables are built.
    Raises NotShifted.
    """
    def known(name: Global) -> Term | None:
        found = resolve(name) if leads(name) else None
        return None if found is None else _spelled(found, resolve)

    body = _projected(expanded(_spelled(term.body, resolve), known))
    _refuse_recursion(body, frozenset(term.variables), leads)
    sites = Sites(body, term.variables, resolve, shapes)
    if not sites.jumping:
        return None
    whole = integral(term.variables, term.bounds, body, term.hints)
    return _Shift(sites, sites.jumping).rewritten(whole)


def _spelled(term: Term, resolve: Resolve) -> Term:
    """With derivatives that have names written out."""
    return transform(term, lambda _, new: _derivative_named(new, resolve) if isinstance(new, Global) else new)


def _derivative_named(name: Global, resolve: Resolve) -> Term:
    found = named(name, resolve)
    return _spelled(found, resolve) if isinstance(found, Deriv) else name


def _projected(body: Term) -> Term:
    """With the parts of conditionals, sums and integrals taken inside of them."""
    return transform(body, lambda _, new: _part(new.term, new.index) if isinstance(new, Proj) else new)


def _part(term: Term, index: int) -> Term:
    match term:
        case If():
            return rebuild(term, (term.condition, _part(term.then, index), _part(term.orelse, index)))
        case Branch():
            return rebuild(term, (*term.coordinates, _part(term.then, index), _part(term.orelse, index)))
        case Sum():
            return rebuild(term, (term.lo, term.hi, _part(term.body, index)))
        case _:
            return proj(term, index)


def _refuse_recursion(body: Term, variables: frozenset[str], leads: Callable[[Term], bool]) -> None:
    for node in postorder(body):
        head = spine(node)[0] if isinstance(node, App) else None
        if isinstance(head, Global) and leads(head) and node.free & variables:
            raise NotShifted(f"`{head.name}` is a recursion with derivatives in it")


@dataclass(frozen=True, slots=True)
class _Part:
    """A component of what a site gives: `path` are the projections from the site on, the last ones into a tuple."""

    site: Site
    path: tuple[int, ...]

    @property
    def tangent(self) -> int:
        """Which tangent, its projections read as a binary number; 0 is the value."""
        return int("".join(map(str, self.path[: self.site.order])), 2)


class _Shift:
    def __init__(self, sites: Sites, jumping: dict[App, Site]) -> None:
        self.sites = sites
        self.jumping = jumping
        self.depends: dict[Term, int] = {}

    def rewritten(self, term: Term) -> Term:
        """The term with the integrals of tangents replaced."""
        depends = self.dependence(term)
        if not depends:
            return term
        if isinstance(term, Integral):
            if depends == LINEAR:
                return self.replaced(term)
            return self.apart(term)
        return rebuild(term, tuple(map(self.rewritten, children(term))))

    def apart(self, term: Integral) -> Term:
        """An integral that is not linear in all tangents: summand by summand, or in those that surely have deltas."""
        body = term.body
        if isinstance(body, Prim) and body.op == "add":
            return add(*(self.rewritten(_over(term, arg)) for arg in body.args))
        inner = rebuild(body, tuple(map(self.rewritten, children(body)))) if _has_integrals(body) else body
        if inner is not body:
            rest = _Shift(self.sites, self.jumping)
            return rest.rewritten(_over(term, inner)) if rest.dependence(inner) != BEYOND else self.hard(term, inner)
        return self.hard(term, body)

    def hard(self, term: Integral, body: Term) -> Term:
        """With the tangents that are smooth, as far as one sees, left to be evaluated point by point."""
        some = {call: site for call, site in self.jumping.items() if call in self.sites.hard}
        if len(some) == len(self.jumping):
            raise NotShifted("its tangent has deltas, and is used in a way that is not linear")
        return _Shift(self.sites, some).rewritten(_over(term, body))

    # How a term depends on the tangents

    def part(self, node: Term) -> _Part | None:
        path: list[int] = []
        at = node
        while isinstance(at, Proj):
            path.append(at.index)
            at = at.term
        site = self.jumping.get(at) if isinstance(at, App) else None
        if site is None or len(path) < site.order:
            return None
        return _Part(site, tuple(reversed(path)))

    def dependence(self, term: Term) -> int:
        waiting = [term]
        while waiting:
            node = waiting[-1]
            if node in self.depends:
                waiting.pop()
                continue
            part = self.part(node)
            if part is not None:
                self.depends[node] = LINEAR if part.tangent else 0
                continue
            left = [c for c in children(node) if c not in self.depends]
            if left and node not in self.jumping:
                waiting.extend(left)
                continue
            self.depends[node] = BEYOND if node in self.jumping else self._of(node)
        return self.depends[term]

    def _of(self, node: Term) -> int:
        parts = [self.depends[c] for c in children(node)]
        most = max(parts, default=0)
        if not most:
            return 0
        match node:
            case Prim(op="add" | "neg"):
                return most
            case Prim(op="mul"):
                return min(sum(parts), BEYOND)
            case Prim(op="div"):
                return BEYOND if parts[1] else most
            case If():
                return BEYOND if parts[0] else most
            case Branch():
                return BEYOND if any(parts[:-2]) else most
            case Integral() | Sum():
                return BEYOND if most != self.depends[node.body] or sum(parts) > self.depends[node.body] else most
            case Tuple() | Proj():
                return most
            case _:
                return BEYOND

    # Linear integrals

    def replaced(self, term: Integral) -> Term:
        found = [part for node in postorder_by(term.body, self._below) if (part := self.part(node)) is not None]
        for part in found:
            self.check(part.site)
        kinds = sorted({part.tangent for part in found if part.tangent})
        zero = zero_like(term.body)
        still = self.built(term.body, None, True)
        parts: list[Term] = [] if vanishes(still) else [_over(term, still)]
        names = {n for node in postorder(term) for n in node.free} | set(term.variables)
        for kind in kinds:
            parts.append(self.derivative(term, kind, names))
        return total(parts, zero)

    def check(self, site: Site) -> None:
        """A tangent that has deltas moves nothing, but in a dual as a whole."""
        for arg in (a for group in site.groups for a in group):
            inner = self.sites.pair(arg)
            if inner is not None:
                self.check(inner)
            elif any(p.tangent and p.site.call in self.sites.hard for n in postorder(arg) if (p := self.part(n))):
                raise NotShifted("a tangent with deltas is given to it as a tangent of its own making")

    def derivative(self, term: Integral, kind: int, names: set[str]) -> Term:
        """The derivative by the steps that one kind of tangent is the derivative by."""
        steps = [fresh(f"{STEP}{place}", names) for place in range(kind.bit_length()) if kind >> place & 1]
        places = [1 << place for place in range(kind.bit_length()) if kind >> place & 1]
        alone = dict(zip(places, map(var, steps), strict=True))
        ways: list[tuple[int, Term]] = list(alone.items())
        if len(places) > 1:
            ways.append((kind, mul(*alone.values())))
        result: Term = _over(term, self.built(term.body, (kind, tuple(ways)), False))
        for step in steps:
            result = proj(app(deriv(lam((step,), result)), (tuple_((ZERO, ONE)),)), 1)
        return result

    def built(self, body: Term, kind: tuple[int, tuple[tuple[int, Term], ...]] | None, whole: bool) -> Term:
        """The integrand with f(u + s u') for one kind of tangent and 0 for the others.

        whole: with what does not depend on the tangents; else without it.
        """
        memo: dict[Term, Term] = {}

        def kept(node: Term) -> Term:
            """A summand, or a side of a conditional."""
            return memo[node] if whole or self.dependence(node) else zero_like(node)

        for node in postorder_by(body, self._below):
            part, parts = self.part(node), children(node)
            new = tuple(memo[c] for c in parts) if part is None else ()
            if part is not None:
                memo[node] = self._component(part, kind)
            elif isinstance(node, Prim) and node.op == "add" and self.dependence(node):
                memo[node] = add(*map(kept, parts))
            elif isinstance(node, Tuple) and self.dependence(node):
                memo[node] = tuple_(map(kept, parts))
            elif isinstance(node, If | Branch) and self.dependence(node):
                memo[node] = rebuild(node, (*new[:-2], kept(parts[-2]), kept(parts[-1])))
            else:
                memo[node] = rebuild(node, new)
        return memo[body]

    def _below(self, node: Term) -> tuple[Term, ...]:
        return () if self.part(node) is not None else children(node)

    def _component(self, part: _Part, kind: tuple[int, tuple[tuple[int, Term], ...]] | None) -> Term:
        inside = part.path[part.site.order :]
        if not part.tangent:
            result = self.sites.shifted(part.site, ())
        elif kind is not None and part.tangent == kind[0]:
            result = self.sites.shifted(part.site, kind[1])
        else:
            result = self.sites.zero(part.site)
        for index in inside:
            result = proj(result, index)
        return result


def _has_integrals(body: Term) -> bool:
    return any(isinstance(node, Integral) for node in postorder(body))


def _over(term: Integral, body: Term) -> Term:
    return integral(term.variables, term.bounds, body, term.hints)
