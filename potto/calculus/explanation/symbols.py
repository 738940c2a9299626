"""Calls in a derivative as a program writes them, with names that exist.

Owns `Words`, `Formula`, `shorter`, `symbols` and `over_functions`. Derivatives take and give pairs: what moves `f(c)`
is the second of one, `snd(deriv(f)((c, dc)))`, and of a parameter `shader`, whose derivative is given too,
`snd(dshader((x, 0))((c, dc)))`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from msgspec import Struct

from potto.calculus.algebra.ranges import Box
from potto.calculus.differentiation.derivative import vanishes
from potto.calculus.differentiation.root_names import RootNames
from potto.calculus.explanation.bound_names import as_written, named_alike
from potto.calculus.explanation.decimals import in_decimals
from potto.calculus.explanation.guarded import guarded
from potto.calculus.explanation.notation import Notation
from potto.calculus.explanation.readable import readable
from potto.calculus.explanation.readable_parts import ReadableParts
from potto.calculus.surfaces.trace import spine
from potto.core.printer import LEFT_OUT
from potto.core.simplify import simplify
from potto.core.terms import (
    NAN,
    ONE,
    ZERO,
    App,
    Array,
    Branch,
    Deriv,
    Fold,
    Global,
    If,
    Lam,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    app,
    branch,
    children,
    mul,
    postorder,
    proj,
    rebuild,
    sub,
    transform,
    var,
)
from potto.primitives import PRIMITIVES

_SECOND = var("snd")


class NoFormula(Exception):
    """Internal: nothing that can be written, or that anybody would read. The text says which."""


class Formula(Struct, frozen=True):
    """A formula as text, the term that it is, and those that names in it stand for."""

    text: str
    terms: tuple[Term, ...] = ()


class Words(Struct, frozen=True):
    """How the terms of a derivative are written: the names of its parameters' derivatives, and the program's words."""

    functions: Mapping[str, str]
    notation: Notation
    names: frozenset[str]
    tangents: frozenset[str]
    progress: ReadableParts
    roots: RootNames

    def plain(self, term: Term) -> str:
        """A term as it is written, parts of records by their names."""
        named = self.notation.fields(as_written(term, self.names))
        return self.notation.text(simplify(in_decimals(named)))

    def equation(self, surface: Term, variables: Iterable[str]) -> str:
        """Where a surface is, `x = t` for t - x."""
        return self.notation.equation(self.notation.fields(surface), variables)

    def condition(self, term: Term) -> str:
        """A comparison as people write it: `s > 0` for -s < s."""
        match term:
            case Prim(op="lt", args=(left, right)):
                bracket = branch((simplify(self.notation.fields(sub(right, left))),), True, ONE, ZERO)
                return self.notation.text(readable(bracket, frozenset()))[1:-1]
            case _:
                return self.plain(term)

    def text(self, term: Term, *inside: str, box: Box | None = None) -> str:
        """A formula that is Potto, in the parameters, their tangents and the indices it is `inside` of; what it calls
        roots it says first. Raises NoFormula."""
        return self.formula(term, *inside, box=box).text

    def formula(self, term: Term, *inside: str, box: Box | None = None) -> Formula:
        """The same with the terms that it is written from."""
        found = guarded(self._readable(term, inside, box), box)
        meant = {name: self.read(term) for name, term in self.roots.used_in(found)}
        named = "; ".join(f"{name} = {self._written(term)}" for name, term in meant.items())
        text = f"let {named} in {self._written(found)}" if meant else self._written(found)
        return Formula(text, (found, *meant.values()))

    def under_integral(self, term: Term, *inside: str, box: Box) -> str:
        """The same of what stands under an integral, `inside` of its variables too: its brackets guard it there."""
        return self._written(self._readable(term, inside, box))

    def read(self, term: Term, box: Box | None = None) -> Term:
        """A term in which nothing moves, simplified; parts of records by their names. box: the ranges of what varies
        inside of an integral."""
        return readable(simplify(self.notation.fields(term)), frozenset(), box)

    def _readable(self, term: Term, inside: tuple[str, ...], box: Box | None) -> Term:
        plain = symbols(without_guards(simplify(transform(term, _by_formula))), self.functions)
        known = self.names | {"snd", *inside, *self.roots.meanings}
        strangers = {name for name in plain.free - known if name.rstrip("'") != "delta"}  # `delta'`: its derivative
        if strangers:
            raise NoFormula(f"where it jumps depends on `{min(strangers)}`, over which it is summed")
        alike = named_alike(plain, self.names.union(inside, self.roots.meanings))
        return readable(simplify(self.notation.fields(alike)), self.tangents, box, self.progress)

    def _written(self, term: Term) -> str:
        text = self.notation.text(term)
        if LEFT_OUT in text:
            raise NoFormula("the formula is too long to be shown")
        return text


def shorter(told: Iterator[tuple[Formula, ...]]) -> tuple[Formula, ...]:
    """Of formulas that may call roots by names and the same without, the shorter ones."""
    named = next(told)
    if not any(len(formula.terms) > 1 for formula in named):
        return named
    return min(named, next(told), key=lambda formulas: sum(len(formula.text) for formula in formulas))


def _by_formula(_: Term, node: Term) -> Term:
    """What a program can't name, by what it can."""
    entry = PRIMITIVES.get(node.op) if isinstance(node, Prim) else None
    if entry is None or entry.surface or entry.formula is None or entry.truth:
        return node
    return entry.formula(*children(node))


def symbols(term: Term, functions: Mapping[str, str]) -> Term:
    """Values of calls as calls, tangents as those of derivatives; `functions`: the names of parameters' derivatives.

    Brackets become factors, as people write them: what they guard against is not evaluated here.
    """
    originals = {dual: name for name, dual in functions.items()}
    memo: dict[Term, Term] = {}
    for node in postorder(term):
        if isinstance(node, Proj):
            memo[node] = _projection(node, functions, originals, memo)
        else:
            memo[node] = _factored(rebuild(node, tuple(memo[c] for c in children(node))))
    return memo[term]


def without_guards(term: Term) -> Term:
    """Without what is decided for single values of numbers, and without `nan` where there is no root: brackets around
    it say where it is."""
    indices = {node.variable for node in postorder(term) if isinstance(node, Sum | Array | Fold)}

    def change(_: Term, new: Term) -> Term:
        match new:
            case If(condition=Prim(op="eq", args=(left, right)), then=then, orelse=orelse) if (
                then is ZERO and right is ZERO and not left.free <= indices
            ):
                return orelse
            case Branch(then=then, orelse=orelse) if orelse is NAN:
                return then
            case Branch(surface=Prim(op="neg", args=(Prim(op="abs"),)), strict=False, orelse=orelse):
                return orelse
            case _:
                return new

    return transform(term, change)


def _factored(node: Term) -> Term:
    """What is 0 elsewhere as a product with a bracket."""
    if not isinstance(node, Branch) or isinstance(node.then, Tuple):
        return node
    if node.orelse is ZERO and node.then is not ONE:
        return mul(branch(node.coordinates, node.strict, ONE, ZERO), node.then)
    if node.then is ZERO and node.orelse is not ONE and len(node.coordinates) == 1:
        return mul(branch(node.coordinates, node.strict, ZERO, ONE), node.orelse)
    return node


def _projection(
    node: Proj, functions: Mapping[str, str], originals: Mapping[str, str], memo: Mapping[Term, Term]
) -> Term:
    """A part of something: of a call of a derivative the value or the tangent."""
    inner = memo[node.term]
    if inner is ZERO:  # a part of a tangent of which nothing moves
        return ZERO
    if not isinstance(node.term, App):
        return rebuild(node, (inner,))
    head, groups = spine(node.term)
    given = isinstance(head, Var) and head.name in originals
    if not given and not (isinstance(head, Deriv) and isinstance(head.function, Global)):
        return rebuild(node, (inner,))
    shown = [tuple(symbols(a, functions) for a in group) for group in groups]
    if node.index == 0:
        assert isinstance(head, Var | Deriv)
        original = var(originals[head.name]) if isinstance(head, Var) else head.function
        return _call(original, [tuple(_value(a, originals) for a in group) for group in shown])
    if given:
        return app(_SECOND, (_call(head, shown),))
    if not any(_moves(a) for group in shown for a in group):
        return ZERO
    return app(_SECOND, (_call(head, [tuple(_shortened(a) for a in group) for group in shown]),))


def _call(head: Term, groups: list[tuple[Term, ...]]) -> Term:
    for group in groups:
        head = app(head, group)
    return head


def _value(arg: Term, originals: Mapping[str, str]) -> Term:
    """The value of a dual."""
    if isinstance(arg, Tuple) and len(arg.items) == 2:
        return arg.items[0]
    if isinstance(arg, Var) and arg.name in originals:
        return var(originals[arg.name])
    return arg.function if isinstance(arg, Deriv) else proj(arg, 0)


def over_functions(term: Term) -> bool:
    """Whether a derivative is given a function that is written out: its parameters are pairs, which nobody reads."""
    heads = (spine(node) for node in postorder(term) if isinstance(node, App))
    return any(isinstance(arg, Lam) for head, groups in heads if isinstance(head, Deriv) for g in groups for arg in g)


def _moves(arg: Term) -> bool:
    """Whether an argument of a derivative is one that can move what it is given to."""
    rests = isinstance(arg, Tuple) and len(arg.items) == 2 and vanishes(arg.items[1])
    return not (rests or isinstance(arg, Deriv))


def _shortened(arg: Term) -> Term:
    """A plain number stands for a dual that does not move."""
    return arg.items[0] if isinstance(arg, Tuple) and len(arg.items) == 2 and arg.items[1] is ZERO else arg
