"""The symbolic dual: a term's value and tangent as core terms.

Owns `dual`. Builtins come from the registry's partials; conditionals go side by side, because a condition that varies
with no variable of integration only chooses; an integral adds what its moving surfaces and bounds sweep (`boundary`).
Functions become functions over pairs `(value, tangent)`. The result holds no `Deriv` of a known function, so it can be
evaluated and differentiated again: an independent check of the numeric derivative, and the text of `potto deriv`.
"""

from __future__ import annotations

from collections.abc import Mapping

from potto.calculus.decomposition.conditioned import conditioned
from potto.calculus.decomposition.joined import joined
from potto.calculus.decomposition.normal_combinations import combined
from potto.calculus.differentiation import loops
from potto.calculus.differentiation.between import scaled
from potto.calculus.differentiation.boundary_terms import at_bounds, at_surfaces, jumps
from potto.calculus.differentiation.deltas import without_deltas, without_leftovers
from potto.calculus.differentiation.derivative import NotSmooth, partial, total, zero_like
from potto.calculus.differentiation.level_sets import level_set, steep, transported
from potto.calculus.differentiation.root_names import RootNames
from potto.calculus.differentiation.stand_ins import as_values
from potto.calculus.inlining.choices import calls_of_items, jumps_as_function
from potto.calculus.inlining.expand import Resolve, expanded, heads_of, known_function
from potto.calculus.solving.pivots import Roots
from potto.calculus.surfaces.case_split import resolved
from potto.calculus.surfaces.trace import spine
from potto.core.terms import (
    ONE,
    ZERO,
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
    ListOf,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    add,
    app,
    branch,
    children,
    delta,
    deriv,
    fold,
    fresh,
    if_,
    index,
    lam,
    list_of,
    mul,
    postorder,
    prim,
    proj,
    rebuild,
    substitute,
    tuple_,
    var,
    with_integrand,
)
from potto.primitives import EXPONENT, PRIMITIVES

Dual = tuple[Term, Term]
_REWRITTEN = 24  # times that an integral is rewritten before it is derived
NO_TANGENTS: Mapping[str, Term] = {}


def nothing_known(name: Global) -> Term | None:
    """Resolves no definition."""
    return None


def dual(term: Term, tangents: Mapping[str, Term], resolve: Resolve = nothing_known) -> Dual:
    """Value and tangent of a term.

    tangents: for each perturbed variable its tangent; for a variable that is a function, its dual function. What is
        not mentioned stands still.
    resolve: the terms of other definitions; those that are not known stay calls of `Deriv(definition)`.
    Raises PottoError (P0502, P0505) where the derivative has no meaning or no closed form.
    """
    return Differentiator(resolve, wanted=Roots.ALL).dual(term, tangents)


def dual_function(function: Lam, resolve: Resolve = nothing_known, frozen: bool = False) -> Lam:
    """The function over duals: each parameter becomes a pair, or a dual function where it is applied; so the result.

    frozen: surfaces and bounds stand still, so that the tangent is the interior alone.
    """
    return Differentiator(resolve, frozen=frozen).function(function)


class Differentiator:
    """One derivation. singular: a jump becomes a delta, for an integral is around it; frozen: it stands still.

    wanted: at which roots of surfaces closed forms are. names: what these roots are called.
    """

    def __init__(
        self, resolve: Resolve, singular: bool = False, frozen: bool = False, wanted: Roots = Roots.STEADY,
        names: RootNames | None = None,
    ) -> None:  # fmt: skip
        self.resolve, self.singular, self.frozen = resolve, singular, frozen
        self.wanted, self.names = wanted, names

    def dual(self, term: Term, tangents: Mapping[str, Term]) -> Dual:
        functions = {n: t for n, t in tangents.items() if n in heads_of(term)}
        value, tangent = _Pass(self, tangents).run(term)
        return as_values(value, functions), as_values(tangent, functions)

    def function(self, function: Lam) -> Lam:
        """Over duals, group by group."""
        return _Pass(self, {}).closed(function)

    def with_deltas(self, body: Term, tangent: Term, tangents: Mapping[str, Term]) -> Term:
        """The tangent of an integrand: where a surface moves, its jump as a delta."""
        names = {n for t in postorder(body) for n in t.free}
        parts = [tangent]
        for item in jumps(body, names, lambda t: self.dual(t, tangents)[1]):
            parts.append(item.contribution)
        return total([p for p in parts if p is not ZERO], zero_like(body))

    def carried_out(self, term: Term) -> Term:
        """Calls of known functions carried out, derivatives of known functions too, with deltas for jumps."""
        inside = Differentiator(self.resolve, not self.frozen, frozen=self.frozen, wanted=self.wanted)
        return calls_of_items(expanded(term, self.resolve, inside.function), self.resolve)


class _Pass:
    """The duals of all subterms under one set of tangents."""

    def __init__(self, owner: Differentiator, tangents: Mapping[str, Term], rewritten: int = 0) -> None:
        self.owner, self.tangents, self.rewritten = owner, tangents, rewritten
        self.found: dict[Term, Dual] = {}
        self.heads: frozenset[str] = frozenset()

    def run(self, term: Term) -> Dual:
        self.heads = heads_of(term) | {n for n, t in self.tangents.items() if isinstance(t, Lam | Global | Deriv)}
        for node in loops.outside_binders(term):
            if node not in self.found:
                self.found[node] = self.node(node)
        return self.found[term]

    def node(self, node: Term) -> Dual:
        parts = children(node)
        still = not any(n in self.tangents for n in node.free) and not isinstance(node, App | Integral | Proj)
        if still and all(self.found[p][0] is p and self.found[p][1] is ZERO for p in parts if p in self.found):
            return node, zero_like(node)
        match node:
            case Var(name=name):
                return node, self.tangents.get(name, ZERO)
            case Prim():
                return self.builtin(node)
            case If():
                (c, _), (a, da), (b, db) = (self.found[p] for p in parts)
                return if_(c, a, b), if_(c, da, db)
            case Branch():
                return self.branch(node)
            case Tuple() | ListOf():
                duals = [self.found[p] for p in parts]
                make = tuple_ if isinstance(node, Tuple) else list_of
                return make(d[0] for d in duals), make(d[1] for d in duals)
            case Proj():
                value, tangent = self.found[node.term]
                return proj(value, node.index), ZERO if tangent is ZERO else proj(tangent, node.index)
            case App():
                return self.call(node)
            case Sum() | Array() | Fold():
                return self.loop(node)
            case Index():
                (whole, tangent), (place, _) = (self.found[p] for p in parts)
                return index(whole, place), loops.element_of(tangent, place)
            case Integral():
                return self.integral(node)
            case Delta() if self.owner.singular and any(self.found[p][1] is not ZERO for p in parts):
                if len(parts) > 1:
                    raise NotSmooth("a delta moves")
                surface, speed = self.found[parts[0]]
                return delta((surface,)), mul(speed, steep(surface))
            case Const() | Global() | Lam() | Deriv() | Hole() | Data():
                return node, ZERO
            case _:
                return rebuild(node, tuple(self.found[p][0] for p in parts)), ZERO

    def builtin(self, node: Prim) -> Dual:
        duals = [self.found[a] for a in node.args]
        values, slopes = tuple(d[0] for d in duals), [d[1] for d in duals]
        value = rebuild(node, values)
        entry = PRIMITIVES[node.op]
        if entry.truth or entry.partials is None or all(s is ZERO for s in slopes):
            return value, ZERO
        if node.op in ("add", "neg"):
            return value, rebuild(node, tuple(slopes))
        moving = [i for i, s in enumerate(slopes) if s is not ZERO]
        names = {i: fresh(f"z{i}", value.free) for i in moving}
        opened = rebuild(node, tuple(var(names[i]) if i in names else v for i, v in enumerate(values)))
        back = {names[i]: values[i] for i in moving}
        parts = {i: scaled(substitute(partial(opened, names[i]), back), slopes[i]) for i in moving}
        if (node.op, 1) == EXPONENT and 1 in parts:
            parts[1] = self.where_it_moves(parts[1], slopes[1])
        return value, add(*parts.values())

    def where_it_moves(self, part: Term, slope: Term) -> Term:
        """What a parameter adds that is an exponent: nothing where it stands still, also where no derivative by it is a
        number, as that of x^n at x < 0. In formulas everything that is named moves."""
        named = isinstance(slope, Var | Proj) and self.owner.wanted is Roots.STEADY
        return if_(prim("eq", slope, ZERO), ZERO, part) if named else part

    def branch(self, node: Branch) -> Dual:
        duals = [self.found[p] for p in children(node)]
        coordinates = tuple(d[0] for d in duals[:-2])
        (a, da), (b, db) = duals[-2:]
        value = branch(coordinates, node.strict, a, b)
        return value, da if da is db else branch(coordinates, node.strict, da, db)

    # Functions

    def call(self, node: App) -> Dual:
        head, groups = spine(node)
        swept = not self.owner.frozen and any(
            jumps_as_function(arg, self.owner.resolve)
            for group in groups
            for arg in group
            if not isinstance(arg, Var) and not self.tangents.keys().isdisjoint(arg.free)
        )  # on pairs it would say nothing of how its jumps move
        if swept or isinstance(head, Lam | Index | Proj | If):
            chosen = calls_of_items(node, self.owner.resolve)
            whole = expanded(chosen, self.owner.resolve if swept else nothing_known)
            again = swept and any(isinstance(n, App) and spine(n)[0] is head for n in postorder(whole))
            if whole is not node and not again:
                return _Pass(self.owner, self.tangents).run(whole)
        if swept:
            raise NotSmooth("a function whose jumps move is handed on to where they are not seen")
        function = self.function(head)
        result: Term = function
        for group in groups:
            result = app(result, tuple(self.argument(a) for a in group))
        result = expanded(result, nothing_known)
        return proj(result, 0), proj(result, 1)

    def argument(self, arg: Term) -> Term:
        """An argument as its dual function takes it."""
        if self.is_function(arg):
            return self.function(arg)
        return tuple_(self.found[arg])

    def is_function(self, term: Term) -> bool:
        match term:
            case Lam() | Deriv():
                return True
            case Var(name=name):
                return name in self.heads
            case Global():
                found = self.owner.resolve(term)
                return found is None or isinstance(found, Lam)
            case _:
                return False

    def function(self, term: Term) -> Term:
        """The dual of a function."""
        match term:
            case Lam():
                return self.closed(term)
            case Var(name=name) if name in self.tangents:
                return self.tangents[name]
            case Deriv(function=inner):
                known = known_function(inner, self.owner.resolve, self.owner.function)
                return deriv(term) if known is None else self.closed(self.owner.function(known))
            case App():
                head, groups = spine(term)
                result = self.function(head)
                for group in groups:
                    result = app(result, tuple(self.argument(a) for a in group))
                return result
            case _:
                return deriv(term)

    def closed(self, function: Lam) -> Lam:
        """The dual of a function, which may use variables from around it."""
        outside = {n: t for n, t in self.tangents.items() if n in function.free}
        taken = {n for t in postorder(function) for n in t.free} | {n for t in outside.values() for n in t.free}
        taken |= set(function.params)
        heads = heads_of(function)
        tangents: dict[str, Term] = {}
        for name in outside:
            tangents[name] = var(fresh(f"{name}'tangent", taken))
            taken |= tangents[name].free
        values: dict[str, Term] = {}
        functions: dict[str, Term] = {}
        params = tuple(self.parameter(p, p in heads, taken, values, tangents, functions) for p in function.params)
        result = as_values(_Pass(self.owner, tangents).body_of(function), functions)
        opened = substitute(result, values)
        stand_ins = {next(iter(t.free)): outside[n] for n, t in tangents.items() if n in outside}
        made = lam(params, substitute(opened, stand_ins))
        assert isinstance(made, Lam)
        return made

    def parameter(
        self, param: str, is_function: bool, taken: set[str],
        values: dict[str, Term], tangents: dict[str, Term], functions: dict[str, Term],
    ) -> str:  # fmt: skip
        """The name of a parameter's dual; what the parameter and its tangent are in terms of it."""
        name = fresh(f"d{param}", taken)
        taken.add(name)
        if is_function:
            tangents[param] = functions[param] = var(name)
        else:
            values[param], tangents[param] = proj(var(name), 0), proj(var(name), 1)
        return name

    def body_of(self, function: Lam) -> Term:
        body = function.body
        if isinstance(body, Lam):
            return self.closed(body)
        if self.owner.singular:
            body = resolved(loops.stepped(body))
        value, tangent = self.run(body)
        if self.owner.singular:
            tangent = self.owner.with_deltas(body, tangent, self.tangents)
        return tuple_((value, tangent))

    # Binders

    def loop(self, node: Sum | Array | Fold) -> Dual:
        """Index by index: how often it goes round stands still."""
        if isinstance(node, Fold):
            return self.fold(node)
        ends = tuple(self.found[p][0] for p in loops.parts_below(node))
        body, tangent = self.under(node.body, (node.variable,))
        return rebuild(node, (*ends, body)), ZERO if tangent is ZERO else rebuild(node, (*ends, tangent))

    def fold(self, node: Fold) -> Dual:
        (lo, _), (hi, _), (start, moves) = (self.found[p] for p in loops.parts_below(node))
        bound = node.variable, node.state
        taken = {*node.free, *node.body.free, *self.tangents, *(n for t in self.tangents.values() for n in t.free)}
        name = fresh(f"d{node.state}", taken.union(bound))
        body, slope = self.under(node.body, bound)
        still = loops.vanishes(moves) and loops.vanishes(slope)
        if not still:
            body, slope = self.under(node.body, bound, {node.state: var(name)})
        value = fold(node.variable, lo, hi, node.state, start, body)
        return value, zero_like(value) if still else loops.dual_fold(value, name, moves, slope)

    def under(self, body: Term, bound: tuple[str, ...], more: Mapping[str, Term] = NO_TANGENTS) -> Dual:
        still = {n: t for n, t in self.tangents.items() if n not in bound}
        return _Pass(self.owner, {**still, **more}).run(body)

    def integral(self, node: Integral) -> Dual:
        whole = resolved(loops.stepped(self.owner.carried_out(joined(node, self.owner.resolve))))
        if isinstance(whole, Integral) and isinstance(whole.body, Array | ListOf):
            whole = loops.of_integrals(whole)
        apart = self.owner.wanted is not Roots.STEADY or not isinstance(whole, Integral)
        fewer = whole if apart else combined(whole)
        if not isinstance(whole, Integral) or fewer is not whole:  # deltas of a combination have one root
            return self.again(fewer)
        plain = without_leftovers(without_deltas(whole, self.owner.wanted))
        if isinstance(plain, Integral) and not apart and not self.owner.frozen:
            plain = conditioned(plain)
        if not isinstance(plain, Integral):
            return self.again(plain)
        moving = {n: t for n, t in self.tangents.items() if n not in plain.variables}
        if not any(n in plain.free for n in moving):
            return plain, zero_like(plain.body)

        def rate(term: Term) -> Term:
            """The tangent of a term as the parameters move; the variables of integration stand still."""
            return _Pass(self.owner, moving).run(term)[1]

        def slope(term: Term, name: str) -> Term:
            return _Pass(self.owner, {name: ONE}).run(term)[1]

        over = level_set(plain)
        if over is not None:
            found = over.standing(plain, rate) if self.owner.frozen else transported(plain, over, rate, slope)
            return plain, total(found, zero_like(plain.body))
        inside = rate(plain.body)
        parts: list[Term] = [] if loops.vanishes(inside) else [with_integrand(plain, inside)]
        if not self.owner.frozen:
            name = None if self.owner.names is None else self.owner.names.along(moving)
            parts += [*at_bounds(plain, rate), *at_surfaces(plain, frozenset(moving), rate, self.owner.wanted, name)]
        return plain, total([p for p in parts if p is not ZERO], zero_like(plain.body))

    def again(self, rewritten: Term) -> Dual:
        """Of what an integral is rewritten to. A recursion in it that is as deep as a parameter says has no end."""
        if self.rewritten > _REWRITTEN:
            raise NotSmooth("a recursion in an integral is as deep as its arguments say")
        return _Pass(self.owner, self.tangents, self.rewritten + 1).run(rewritten)
