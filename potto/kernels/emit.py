"""Arithmetic of kernels: from a builtin's entry to lines of Python over numpy arrays.

Owns `Scalar` (the variables that hold the parts of a cell) and `Lines`. Per builtin the value, and where they exist
the error bound and the tangents, are emitted together, from the partial derivatives of the registry:
v = f(a), t_d = sum_i p_i(a) t_i,d, e = sum_i |p_i| e_i and et_d = sum_i |p_i| et_i,d + sum_ij |t_i,d p_ij| e_j, first
order in the errors, and where rounding is kept track of what the p_i are off themselves, which `slopes` knows.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, reduce
from itertools import chain

from msgspec import Struct

from potto.calculus.differentiation.derivative import partial
from potto.core.terms import Branch, Const, If, Prim, Term, Var, const, postorder, var
from potto.kernels.slopes import EXACT, Loss, losses
from potto.kernels.whole import ROUNDING, UNIT_ROUNDOFF
from potto.primitives import EXPONENT, PRIMITIVES
from potto.primitives.walking import formula_of

ZERO = "0.0"
ONE = "1.0"
LONG = 24  # summands or factors on a line
COMPARISONS = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}


class Scalar(Struct, frozen=True):
    """Names of the variables that hold a cell's parts; None where a part is exactly zero, "1.0" where it is one."""

    v: str
    e: str | None
    t: tuple[str | None, ...]
    et: tuple[str | None, ...]

    @property
    def exact(self) -> bool:
        return self.e is None and not any(self.et)

    @property
    def plain(self) -> bool:
        """Whether there is nothing but a value."""
        return self.exact and not any(self.t)


Bend = Callable[[int, int], str | None]  # how the slope by one argument changes with another
Losses = Mapping[int, Loss]  # what slopes are off
Tangents = tuple[tuple[str | None, ...], tuple[str | None, ...]]  # and their errors


def _number(x: Scalar) -> float | None:
    """The number that a constant is."""
    if not x.plain or x.v[0].isalpha():
        return None
    return float(x.v)


@lru_cache(maxsize=4096)
def partials(op: str, arity: int) -> tuple[tuple[str, ...], tuple[Term, ...]]:
    """Placeholder names for the arguments of a builtin, and its partial derivatives over them."""
    names = tuple(f"#{i}" for i in range(arity))
    rule = PRIMITIVES[op].partials
    if rule is None:
        return names, ()
    return names, tuple(rule(*map(var, names)))


@lru_cache(maxsize=4096)
def second_partial(op: str, arity: int, i: int, j: int) -> Term:
    names, first = partials(op, arity)
    return partial(first[i], names[j])


@lru_cache(maxsize=4096)
def _parts(term: Term) -> tuple[Term, ...]:
    return tuple(postorder(term))


def exact_slopes(op: str, args: Sequence[Scalar], d: int) -> list[tuple[str, str]] | None:
    """The slopes that the tangent in a direction is made with, and the tangents that they multiply, where slopes are
    arguments as they are, or twice that; None where a builtin's slopes are rounded themselves."""
    if op == "add":
        return [(ONE, x) for a in args if (x := a.t[d])]
    if op == "mul":
        a, b = args
        return [(y.v, t) for x, y in ((a, b), (b, a)) if (t := x.t[d])]
    if op == "pow" and args[1].v == "2.0":
        return [(args[0].v, t) for t in args[0].t[d : d + 1] if t]
    return None


class Lines:
    """Generated lines in order, with fresh names and the numpy functions that they use.

    side: -1 or 1 where what stands at a kink moves, in each direction, as it does before it or behind it.
    """

    def __init__(self, directions: int, rounding: bool, side: int = 0) -> None:
        self.directions = directions
        self.rounding = rounding
        self.side = side
        self.lines: list[str] = []
        self.functions: dict[str, str] = {}
        self.count = 0
        self.known: dict[str, str] = {}
        self.none: tuple[None, ...] = (None,) * directions

    def name(self, letter: str = "v") -> str:
        self.count += 1
        return f"{letter}{self.count}"

    def let(self, expression: str, letter: str = "v") -> str:
        """A variable that holds the expression: the one that already does, where arithmetic is met again."""
        known = self.known.get(expression)
        if known is not None:
            return known
        name = self.name(letter)
        self.lines.append(f"{name} = {expression}")
        if "rt." not in expression:
            self.known[expression] = name
        return name

    def ufunc(self, name: str) -> str:
        local = "f_" + name.replace(".", "_")
        self.functions[local] = name
        return local

    def constant(self, value: float) -> Scalar:
        text = repr(float(value))
        if text in ("inf", "-inf", "nan"):
            text = f"float({text!r})"
        return Scalar(text, None, self.none, self.none)

    def plain(self, text: str) -> Scalar:
        return Scalar(text, None, self.none, self.none)

    # Sums of products, with what is zero or one left out

    def product(self, *factors: str) -> str:
        factors = tuple(f for f in factors if f != ONE)
        return "*".join(factors) if factors else ONE

    def total(self, terms: Sequence[str]) -> str | None:
        """A variable that holds the sum."""
        if not terms:
            return None
        if len(terms) == 1:
            return terms[0] if terms[0].isidentifier() or terms[0] == ONE else self.let(terms[0], "t")
        return self.joined(" + ", terms, "t")

    def joined(self, sign: str, parts: Sequence[str], letter: str) -> str:
        """A variable that holds a sum or product; long ones are cut into lines, which Python's parser prefers."""
        name = self.let(sign.join(parts[:LONG]), letter)
        for start in range(LONG, len(parts), LONG):
            name = self.let(sign.join([name, *parts[start : start + LONG]]), letter)
        return name

    # Builtins

    def apply(self, op: str, args: Sequence[Scalar]) -> Scalar:
        if not self.rounding and (op == "add" or op in COMPARISONS):
            numbers = [number for a in args if (number := _number(a)) is not None]
            if len(numbers) == len(args):  # in a partial derivative: the exponent of a power, and whether it is 0
                folded = sum(numbers) if op == "add" else getattr(operator, op)(*numbers)
                return self.constant(folded) if op == "add" else self.plain(repr(folded))
        if op in COMPARISONS:
            a, b = args
            return self.plain(self.let(f"{a.v} {COMPARISONS[op]} {b.v}", "m"))
        if op in ("and", "or", "min", "max") and len(args) > 2:
            return reduce(lambda result, arg: self.apply(op, (result, arg)), args)
        if op in ("and", "or", "not"):
            f = self.ufunc("logical_" + op)
            return self.plain(self.let(f"{f}({', '.join(a.v for a in args)})", "m"))
        if op == "add":
            return self.add(args)
        if op == "mul":
            return self.mul(args)
        if op == "neg":  # exact, so what it may be off by stays as it is
            (a,) = args
            return Scalar(self.let(f"-{a.v}"), a.e, *self.negated(a))
        return self.chain(op, args, self.value(op, args))

    def value(self, op: str, args: Sequence[Scalar]) -> str:
        a = [x.v for x in args]
        if op == "pow":
            if a[1] in (ZERO, ONE):
                return ONE if a[1] == ZERO else a[0]
            square = {"2.0": "{0}*{0}", "3.0": "{0}*{0}*{0}"}.get(a[1])
            if square is not None:
                return self.let(square.format(a[0]))
            return self.let(f"{self.ufunc('power')}({a[0]}, {a[1]})")
        if op == "div":
            return self.let(f"{self.ufunc('divide')}({a[0]}, {a[1]})")
        entry = PRIMITIVES[op]
        if not entry.numpy and not entry.guarded:
            whole, names = formula_of(op, len(a))
            return self.smooth(whole, {n: self.plain(x) for n, x in zip(names, a, strict=True)}, {}).v
        name = "builtin." + op if entry.guarded else entry.numpy
        return self.let(f"{self.ufunc(name)}({', '.join(a)})")

    def add(self, args: Sequence[Scalar]) -> Scalar:
        v = self.total([a.v for a in args]) or ZERO
        e = self.total([a.e for a in args if a.e])
        return self.rounded(Scalar(v, e, *self.added(args)), "add", args)

    def added(self, args: Sequence[Scalar]) -> Tangents:
        """The tangents of a sum."""
        t, et = [], []
        for d in range(self.directions):
            t.append(self.total([x for a in args if (x := a.t[d])]))
            bounds = [x for a in args if (x := a.et[d])]
            if self.rounding and len(factors := exact_slopes("add", args, d) or ()) > 1:
                bounds.append(self.kept(t[-1] or ZERO, factors))
            et.append(self.total(bounds))
        return tuple(t), tuple(et)

    def negated(self, x: Scalar) -> Tangents:
        """The tangents of a number with the other sign."""
        return tuple(t and self.let(f"-{t}", "t") for t in x.t), x.et

    def mul(self, args: Sequence[Scalar]) -> Scalar:
        if all(a.plain for a in args) and not self.rounding:
            return self.plain(self.joined("*", [a.v for a in args], "v"))
        result = args[0]
        for arg in args[1:]:
            result = self.chain("mul", (result, arg), self.let(f"{result.v}*{arg.v}"))
        return result

    def chain(self, op: str, args: Sequence[Scalar], v: str) -> Scalar:
        """The chain rule by the registry's partials, for arguments that move or are not exact."""
        if all(a.plain for a in args):
            return self.rounded(self.plain(v), op, args)
        names, first = partials(op, len(args))
        if not first:  # a builtin that jumps: constant between its jumps
            return self.plain(v)
        local = {n: self.plain(a.v) for n, a in zip(names, args, strict=True)}
        memo: dict[Term, Scalar] = {}
        moving = [i for i, a in enumerate(args) if not a.plain]
        slope = {i: self.smooth(first[i], local, memo).v for i in moving}
        lost = {i: self.loss(first[i], memo) for i in moving} if self.tracked(op, args) else {}

        def bend(i: int, j: int) -> str | None:
            curve = self.smooth(second_partial(op, len(args), i, j), local, memo).v
            return None if curve == ZERO else curve

        e = self.total([self.moved(op, args, i, slope[i], x) for i in moving if (x := args[i].e)])
        if self.side and self.directions and PRIMITIVES[op].kinks(*map(var, names)):
            return self.rounded(Scalar(v, e, *self.on_one_side(op, args, bend, lost)), op, args)
        return self.rounded(Scalar(v, e, *self.tangents(op, args, slope, bend, lost)), op, args)

    def on_one_side(self, op: str, args: Sequence[Scalar], bend: Bend, lost: Losses) -> Tangents:
        """The tangents of a builtin with kinks: where it is at one its slopes are not the same in every direction."""
        names, first = partials(op, len(args))
        found = []
        for d in range(self.directions):
            rows = [tuple(t if n == d else None for n, t in enumerate(a.t)) for a in args]
            local = {n: Scalar(a.v, None, row, self.none) for n, a, row in zip(names, args, rows, strict=True)}
            memo: dict[Term, Scalar] = {}
            self.side, side = 0, self.side
            slopes = {i: self.smooth(first[i], local, memo, (d, side)).v for i, a in enumerate(args) if not a.plain}
            self.side = side
            t, et = self.tangents(op, args, slopes, bend, lost)
            found.append((t[d], et[d]))
        return tuple(t for t, _ in found), tuple(et for _, et in found)

    def tracked(self, op: str, args: Sequence[Scalar]) -> bool:
        """Whether it matters what a builtin's slopes are off."""
        moving = any(x for a in args for x in a.t)
        return self.rounding and moving and all(exact_slopes(op, args, d) is None for d in range(self.directions))

    def loss(self, slope: Term, memo: dict[Term, Scalar]) -> Loss:
        """What a slope is off. memo: its parts."""

        def steep(node: Prim) -> list[str]:
            names, first = partials(node.op, len(node.args))
            local = {n: memo[arg] for n, arg in zip(names, node.args, strict=True)}
            own: dict[Term, Scalar] = {}
            return [self.smooth(term, local, own).v for term in first]

        return losses(slope, {term: scalar.v for term, scalar in memo.items()}, steep, self)

    def tangents(
        self, op: str, args: Sequence[Scalar], slopes: Mapping[int, str], bend: Bend, lost: Losses
    ) -> Tangents:
        """The tangents of a builtin with these slopes by those of its arguments that move or are not exact."""
        t, et = [], []
        for d in range(self.directions):
            moving = {i: x for i in slopes if (x := args[i].t[d])}
            parts = {i: self.product(slopes[i], x) for i, x in moving.items()}
            if self.rounding and len(parts) > 1:
                parts = {i: self.let(part, "t") for i, part in parts.items()}
            t.append(self.total(list(parts.values())))
            bounds = [self.off(op, args, i, slope, x) for i, slope in slopes.items() if (x := args[i].et[d])]
            for i, x in moving.items():
                for j in slopes:
                    if (e := args[j].e) and (curve := bend(i, j)):
                        bounds.append(self.off(op, args, j, curve, x, e))
            if self.rounding and parts:
                bounds += self.tangent_rounded(t[-1] or ZERO, exact_slopes(op, args, d), parts, lost)
                bounds += [
                    f"abs({self.product(off, x)})" for i, x in moving.items() if (off := lost.get(i, EXACT).rest)
                ]
            et.append(self.total(bounds))
        return tuple(t), tuple(et)

    def moved(self, op: str, args: Sequence[Scalar], i: int, slope: str, e: str) -> str:
        """What a builtin is off as its i-th argument is off by e: where that is exact nothing, however steep it is."""
        size = self.off(op, args, i, slope, e)
        numbers = [var(a.v) if (number := _number(a)) is None else const(number) for a in args]
        if not PRIMITIVES[op].steep(*numbers):
            return size
        return f"{self.ufunc('support.by_error')}({size}, {e})"

    def off(self, op: str, args: Sequence[Scalar], i: int, *factors: str) -> str:
        """What a builtin is off as its i-th argument is."""
        size = f"abs({self.product(*factors)})"
        return size if (op, i) != EXPONENT else f"{self.ufunc('support.by_exponent')}({args[0].v}, {size})"

    def tangent_rounded(
        self, t: str, exact: list[tuple[str, str]] | None, parts: Mapping[int, str], lost: Losses
    ) -> list[str]:
        """What a tangent rounds off that is a sum of slopes times tangents."""
        if exact is not None:
            return [] if len(exact) == 1 and ONE in exact[0] else [self.kept(t, exact)]
        steps = 1 if len(parts) == 1 else 2  # a product, and the sum that it goes into
        return [f"{max(lost.get(i, EXACT).part + steps, 2) * UNIT_ROUNDOFF!r}*abs({x})" for i, x in parts.items()]

    def kept(self, t: str, exact: Sequence[tuple[str, str]]) -> str:
        """What a tangent rounds off whose slopes are numbers as they are."""
        return f"{self.ufunc('whole.slopes')}({', '.join((t, *chain.from_iterable(exact)))})"

    def rounded(self, x: Scalar, op: str, args: Sequence[Scalar]) -> Scalar:
        """With the rounding of this operation added to the bounds, where the kernel keeps track of it."""
        if not self.rounding:
            return x
        e, entry = x.e, PRIMITIVES[op]
        if entry.ulp:
            unit = f"{(1.0 if callable(entry.ulp) else entry.ulp) * UNIT_ROUNDOFF!r}*abs({x.v})"
            if op in ROUNDING:
                unit = f"{self.ufunc('whole.' + op)}({', '.join((x.v, *(a.v for a in args)))})"
            elif callable(entry.ulp):
                unit = f"{self.ufunc('places.' + op)}({', '.join(a.v for a in args)})*{unit}"
            if callable(entry.off):
                unit += f" + {self.ufunc('strays.' + op)}({', '.join(a.v for a in args)})"
            elif entry.off:
                unit += f" + {entry.off!r}"
            e = self.let(f"{e + ' + ' if e else ''}{unit}", "e")
        return Scalar(x.v, e, x.t, x.et)

    def smooth(
        self, term: Term, local: dict[str, Scalar], memo: dict[Term, Scalar],
        along: tuple[int, int] | None = None,
    ) -> Scalar:  # fmt: skip
        """A term made of builtins and selections only, such as a partial derivative; values only.

        along: the direction, and the side, by which it is told where what is 0 lies.
        """
        rounding, self.rounding = self.rounding, False
        for node in _parts(term):
            if node in memo:
                continue
            match node:
                case Const():
                    memo[node] = self.constant(node.value)
                case Var():
                    memo[node] = local[node.name]
                case Prim():
                    memo[node] = self.apply(node.op, [memo[a] for a in node.args])
                case Branch():
                    mask = self.falls(memo[node.surface], node.strict, along)
                    memo[node] = self.select(mask, memo[node.then], memo[node.orelse])
                case If():
                    memo[node] = self.select(memo[node.condition].v, memo[node.then], memo[node.orelse])
                case _:
                    raise TypeError(f"{type(node).__name__} in a partial derivative")
        self.rounding = rounding
        return memo[term]

    def falls(self, surface: Scalar, strict: bool, along: tuple[int, int] | None) -> str:
        """The mask of a branch of a partial derivative."""
        tangent = None if along is None else surface.t[along[0]]
        if along is None or tangent is None:
            return self.let(f"{surface.v} {'>' if strict else '>='} 0.0", "m")
        return self.let(f"{self.ufunc('support.beside')}({surface.v}, {tangent}, {float(along[1])!r})", "m")

    def select(self, mask: str, a: Scalar, b: Scalar) -> Scalar:
        if mask in ("True", "False"):
            return a if mask == "True" else b

        def pick(x: str | None, y: str | None) -> str | None:
            if x == y:
                return x
            return self.let(f"{self.ufunc('support.select')}({mask}, {x or ZERO}, {y or ZERO})", "s")

        v = pick(a.v, b.v)
        assert v is not None
        return Scalar(v, pick(a.e, b.e), tuple(map(pick, a.t, b.t)), tuple(map(pick, a.et, b.et)))
