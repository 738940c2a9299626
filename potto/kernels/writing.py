"""The texts of kernels, from terms.

Owns `Writer`, and `Runtime`. A kernel is a Python function over numpy arrays, `k(rt, trace, *values) -> value`; what it
does not compute itself (calls, integrals, sums, lazy sides) it asks of the runtime `rt`, which it knows by the methods
of `Runtime` only.
"""

from __future__ import annotations

import marshal
from collections.abc import Sequence
from typing import Any, Protocol

from potto.calculus.surfaces.trace import CallSite, TermSites, immediate, integrating, is_lazy, layout
from potto.core.terms import (
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
    postorder,
)  # fmt: skip
from potto.kernels.cells import Cell, Pattern, Trace, Value
from potto.kernels.emit import ZERO, Lines, Scalar
from potto.kernels.kinks import watched
from potto.kernels.known import Dynamic, Known, Structure, is_inexact, moves
from potto.kernels.taping import TapeLines
from potto.kernels.written import Written


class Runtime(Protocol):
    """What kernels ask of the runtime. Groups of arguments are tuples of values."""

    @property
    def taping(self) -> bool: ...
    @property
    def side(self) -> int: ...
    @property
    def root(self) -> bool: ...
    def global_value(self, module: str, name: str) -> Value: ...
    def inexact(self, term: Term) -> bool: ...
    def closure(self, lam: Lam, captured: dict[str, Value]) -> Value: ...
    def derived(self, function: Value) -> Value: ...
    def call(self, function: Value, groups: tuple[tuple[Value, ...], ...], trace: Trace | None) -> Value: ...
    def integral(self, term: Integral, env: dict[str, Value]) -> Value: ...
    def added(self, terms: tuple[Term, ...], env: dict[str, Value]) -> Value: ...
    def sum(self, term: Sum, lo: Value, hi: Value, env: dict[str, Value], trace: Trace | None) -> Value: ...
    def array(self, term: Array, size: Value, env: dict[str, Value]) -> Value: ...
    def index(self, term: Index, array: Value, place: Value) -> Value: ...
    def length(self, term: Length, array: Value, like: Value | None) -> Value: ...
    def fold(self, term: Fold, lo: Value, hi: Value, start: Value, env: dict[str, Value]) -> Value: ...
    def data(self, term: Data) -> Value: ...
    def lazy(self, mask: Any, term: If | Branch, env: dict[str, Value], traces: tuple[Any, Any]) -> Value: ...
    def falls(self, surface: Any, strict: bool) -> Any: ...
    def kink(self, term: Prim | Branch, kinks: tuple[tuple[Any, Any], ...], args: tuple[Cell, ...]) -> None: ...
    def project(self, value: Value, index: int) -> Value: ...
    def term(self, term: Term, env: dict[str, Value]) -> Value: ...
    def fail(self, term: Hole | Delta) -> Value: ...


class Writer:
    """Writes one function. One instance per kernel; the methods follow the kinds of terms."""

    def __init__(self, lam: Lam, patterns: tuple[Pattern, ...], directions: int, rounding: bool, rt: Runtime) -> None:
        self.lam, self.rt, self.directions = lam, rt, directions
        self.out = TapeLines(rounding) if rt.taping else Lines(directions, rounding, rt.side)
        self.layout: TermSites = layout(lam.body)
        self.values: dict[Term, Known] = {}
        self.env: dict[str, Known] = {}
        self.objects: dict[str, Term | tuple[Term, ...]] = {}
        self.arguments = [f"arg{i}" for i in range(len(lam.params))]
        for param, argument, pattern in zip(lam.params, self.arguments, patterns, strict=True):
            self.env[param] = self.unpack(argument, pattern)

    def written(self) -> Written:
        for node in postorder(self.lam.body, below=self.at_once):
            self.values[node] = self.emit(node)
        result = self.pack(self.values[self.lam.body])
        body = [*self.out.lines, f"return {result}"]
        text = f"def kernel(rt, trace, {', '.join(self.arguments)}):\n    " + "\n    ".join(body) + "\n"
        plain = "rt." not in text.replace("rt.falls(", "")
        plain = plain and not any(isinstance(known, Dynamic) for known in self.env.values())
        places = {term: place for place, term in enumerate(postorder(self.lam.body))}
        objects = {
            name: tuple(places[term] for term in kept) if isinstance(kept, tuple) else places[kept]
            for name, kept in self.objects.items()
        }
        code = marshal.dumps(compile(text, "<kernel>", "exec"))
        return Written(text, code, dict(self.out.functions), objects, plain)

    # Arguments in, results out

    def unpack(self, name: str, pattern: Pattern) -> Known:
        match pattern:
            case ("tuple", *parts):
                names = [self.out.name("p") for _ in parts]
                self.out.lines.append(f"({', '.join(names)},) = {name}")
                return Structure(tuple(map(self.unpack, names, parts)), False)
            case ("rows", inexact, *moves):
                return Dynamic(name, inexact, tuple(moves))
            case ("list",):
                return Dynamic(name, True, (True,) * self.directions)
            case ("function", inexact, *moves):
                return Dynamic(name, inexact, tuple(moves))
            case (inexact, tangents):
                v = self.out.let(f"{name}.v")
                t = tuple(
                    None if kind == 0 else "1.0" if kind == 1 else self.out.let(f"{name}.t[{d}]", "t")
                    for d, kind in enumerate(tangents)
                )
                if not inexact:
                    return Scalar(v, None, t, self.out.none)
                e = self.out.let(f"{name}.e if {name}.e is not None else 0.0", "e")
                et = tuple(
                    self.out.let(f"{name}.et[{d}] if {name}.et[{d}] is not None else 0.0", "e") if x else None
                    for d, x in enumerate(t)
                )
                return Scalar(v, e, t, et)
        raise TypeError(f"unknown pattern {pattern!r}")

    def pack(self, known: Known) -> str:
        """An expression that makes a value of what is known in parts."""
        if isinstance(known, Dynamic):
            return known.name
        if isinstance(known, Structure):
            items = "".join(f"{self.pack(p)}, " for p in known.parts)
            return f"listed([{items}])" if known.is_list else f"({items})"
        t = "".join(f"{x}, " for x in known.t)
        if known.exact:
            return f"Cell({known.v}, None, ({t}))"
        return f"Cell({known.v}, {known.e}, ({t}), ({''.join(f'{x}, ' for x in known.et)}))"

    def scalar(self, known: Known) -> Scalar:
        """The parts of a number; unpacked (and checked to be one) where it came from elsewhere."""
        if isinstance(known, Scalar):
            return known
        name = known.name if isinstance(known, Dynamic) else self.pack(known)
        k = self.directions
        names = [self.out.name("u") for _ in range(2 + 2 * k)]
        self.out.lines.append(f"({', '.join(names)},) = parts({name}, {k})")
        if isinstance(known, Structure):
            return self.out.plain(names[0])
        t = tuple(x if moves else None for x, moves in zip(names[2 : 2 + k], known.moves, strict=True))
        if not known.inexact:
            return Scalar(names[0], None, t, self.out.none)
        et = tuple(x if moves else None for x, moves in zip(names[2 + k :], known.moves, strict=True))
        return Scalar(names[0], names[1], t, et)

    def known(self, term: Term) -> Known:
        return self.values[term]

    def number(self, term: Term) -> Scalar:
        scalar = self.scalar(self.values[term])
        self.values[term] = scalar
        return scalar

    def keep(self, value: Term | tuple[Term, ...]) -> str:
        """A name under which generated code finds an object (a term, a tuple of names)."""
        name = f"o{len(self.objects)}"
        self.objects[name] = value
        return name

    def trace(self, term: Term, which: int) -> str:
        at = self.layout.index[term, which]
        return f"(trace.get({at}) if trace else None)"

    # Terms

    def together(self, term: Prim) -> frozenset[Term]:
        """The summands that integrate, which are evaluated together."""
        return integrating(term, self.rt.inexact if self.rt.root else None)

    def at_once(self, term: Term) -> tuple[Term, ...]:
        """The children that come before a term itself."""
        together = self.together(term) if isinstance(term, Prim) else ()
        return tuple(part for part in immediate(term) if part not in together)

    def emit(self, term: Term) -> Known:
        match term:
            case Const():
                return self.out.constant(term.value)
            case Var():
                return self.env[term.name]
            case Prim():
                together = self.together(term)
                args = [self.number(a) for a in term.args if a not in together]
                if together:
                    args.append(self.scalar(self.added(tuple(a for a in term.args if a in together))))
                if self.watching and (kinks := watched(self.out, term, args)):
                    self.watch(term, kinks, args)
                return self.out.apply(term.op, args)
            case If() | Branch():
                return self.conditional(term)
            case Tuple() | ListOf():
                return Structure(tuple(map(self.known, term.items)), isinstance(term, ListOf))
            case Proj():
                return self.projection(term)
            case Lam():
                return self.closure(term)
            case App():
                return self.call(self.layout.sites[self.layout.index[term, 0]])
            case Global():
                return self.global_(term)
            case Deriv():
                return self.derived(term)
            case Integral():
                return self.integral(term)
            case Sum():
                return self.sum(term)
            case Fold():
                return self.fold(term)
            case Array() | Index() | Length() | Data():
                return self.array(term)
            case Hole() | Delta():
                return self.dynamic(f"rt.fail({self.keep(term)})", False, ())

    @property
    def watching(self) -> bool:
        """Whether it is to be noted where one-sided derivatives differ."""
        return bool(self.directions and self.rt.root and not self.rt.side)

    def watch(self, term: Prim | Branch, numbers: str, args: Sequence[Scalar]) -> None:
        """Have it noted where one of these numbers is 0 to rounding."""
        found = "".join(f"{self.pack(arg)}, " for arg in args)
        self.out.lines.append(f"rt.kink({self.keep(term)}, {numbers}, ({found}))")

    def dynamic(self, expression: str, inexact: bool, movers: tuple[Known, ...]) -> Dynamic:
        return Dynamic(self.out.let(expression, "d"), inexact or self.out.rounding, self.moves(movers))

    def moves(self, movers: tuple[Known, ...]) -> tuple[bool, ...]:
        return tuple(any(moves(m, d) for m in movers) for d in range(self.directions))

    def environment(self, names: frozenset[str]) -> tuple[str, tuple[Known, ...]]:
        """A dict display of free variables, and what they are."""
        order = sorted(names)
        known = tuple(self.env[n] for n in order)
        return "{" + ", ".join(f"{n!r}: {self.pack(k)}" for n, k in zip(order, known, strict=True)) + "}", known

    def conditional(self, term: If | Branch) -> Known:
        if is_lazy(term):
            return self.lazy(term)
        if isinstance(term, If):
            return self.select(self.number(term.condition).v, term)
        mask, spoiled = self.side(term)
        result = self.select(mask, term)
        if isinstance(result, Scalar):
            return Scalar(self.out.let(f"{result.v} if {spoiled} is None else {result.v} + {spoiled}"),
                          result.e, result.t, result.et)  # fmt: skip
        return result

    def side(self, term: Branch) -> tuple[str, str]:
        """The mask of a branch, forced or as it falls, and nan wherever its surface is nan (None where nowhere)."""
        mask, spoiled = self.out.name("m"), self.out.name("z")
        surface = self.number(term.surface)
        if self.watching and any(surface.t):
            self.watch(term, f"(({surface.v}, {surface.e or ZERO}), )", (surface,))
        self.out.lines.append(f"{mask} = {self.trace(term, 2)}; {spoiled} = None")
        self.out.lines.append(f"if {mask} is None: {mask}, {spoiled} = rt.falls({surface.v}, {term.strict})")
        return mask, spoiled

    def select(self, mask: str, term: If | Branch) -> Known:
        return self.selected(mask, self.known(term.then), self.known(term.orelse))

    def selected(self, mask: str, a: Known, b: Known) -> Known:
        if isinstance(a, Structure) and isinstance(b, Structure) and len(a.parts) == len(b.parts):
            return Structure(tuple(self.selected(mask, x, y) for x, y in zip(a.parts, b.parts)), a.is_list)
        if isinstance(a, Scalar) and isinstance(b, Scalar):
            return self.out.select(mask, a, b)
        select = self.out.ufunc("support.select_value")
        inexact = is_inexact(a) or is_inexact(b)
        return self.dynamic(f"{select}({mask}, {self.pack(a)}, {self.pack(b)})", inexact, (a, b))

    def lazy(self, term: If | Branch) -> Known:
        if isinstance(term, If):
            mask = self.number(term.condition).v
        else:
            mask, spoiled = self.side(term)
            self.out.lines.append(f"if {spoiled} is not None: {mask} = ({mask}, {spoiled})")
        env, known = self.environment(term.then.free | term.orelse.free)
        traces = f"({self.trace(term, 0)}, {self.trace(term, 1)})"
        return self.dynamic(f"rt.lazy({mask}, {self.keep(term)}, {env}, {traces})", True, known)

    def projection(self, term: Proj) -> Known:
        known = self.known(term.term)
        if isinstance(known, Structure) and term.index < len(known.parts):
            return known.parts[term.index]
        return self.dynamic(f"rt.project({self.pack(known)}, {term.index})", is_inexact(known), (known,))

    def closure(self, term: Lam) -> Known:
        env, known = self.environment(term.free)
        inexact = self.rt.inexact(term) or any(map(is_inexact, known))
        return self.dynamic(f"rt.closure({self.keep(term)}, {env})", inexact, known)

    def call(self, site: object) -> Known:
        assert isinstance(site, CallSite)
        head = self.known(site.head)
        groups = tuple(tuple(map(self.known, group)) for group in site.groups)
        packed = "".join("(" + "".join(f"{self.pack(a)}, " for a in group) + "), " for group in groups)
        movers = (head, *(a for group in groups for a in group))
        trace = self.trace(site.call, 0)
        return self.dynamic(f"rt.call({self.pack(head)}, ({packed}), {trace})", any(map(is_inexact, movers)), movers)

    def global_(self, term: Global) -> Known:
        name = self.out.let(f"rt.global_value({term.module!r}, {term.name!r})", "g")
        return Dynamic(name, self.rt.inexact(term), (False,) * self.directions)

    def derived(self, term: Deriv) -> Known:
        """The layout leaves out the function under a `Deriv`, since its sites are not those of a call."""
        inner = term.function
        function = self.values.get(inner)
        if function is None and isinstance(inner, Lam | Global | Var | Deriv):
            function = self.emit(inner)
        elif function is None:
            env, known = self.environment(inner.free)
            function = self.dynamic(f"rt.term({self.keep(inner)}, {env})", True, known)
        return self.dynamic(f"rt.derived({self.pack(function)})", is_inexact(function), (function,))

    def integral(self, term: Integral) -> Known:
        env, known = self.environment(term.free)
        return self.dynamic(f"rt.integral({self.keep(term)}, {env})", True, known)

    def added(self, terms: tuple[Term, ...]) -> Known:
        env, known = self.environment(frozenset().union(*(term.free for term in terms)))
        return self.dynamic(f"rt.added({self.keep(terms)}, {env})", True, known)

    def sum(self, term: Sum) -> Known:
        env, known = self.environment(term.body.free - {term.variable})
        lo, hi = self.pack(self.known(term.lo)), self.pack(self.known(term.hi))
        inexact = self.out.rounding or self.rt.inexact(term.body) or any(map(is_inexact, known))
        text = f"rt.sum({self.keep(term)}, {lo}, {hi}, {env}, {self.trace(term, 0)})"
        return self.dynamic(text, inexact, known)

    def fold(self, term: Fold) -> Known:
        env, known = self.environment(term.body.free - {term.variable, term.state})
        lo, hi, start = (self.known(part) for part in (term.lo, term.hi, term.start))
        text = f"rt.fold({self.keep(term)}, {self.pack(lo)}, {self.pack(hi)}, {self.pack(start)}, {env})"
        return self.dynamic(text, True, (start, *known))

    def array(self, term: Array | Index | Length | Data) -> Known:
        match term:
            case Array():
                env, known = self.environment(term.body.free - {term.variable})
                inexact = self.rt.inexact(term.body) or any(map(is_inexact, known))
                return self.dynamic(
                    f"rt.array({self.keep(term)}, {self.pack(self.known(term.size))}, {env})", inexact, known
                )
            case Index():
                array, place = self.known(term.array), self.known(term.index)
                text = f"rt.index({self.keep(term)}, {self.pack(array)}, {self.pack(place)})"
                return self.dynamic(text, is_inexact(array), (array,))
            case Length():
                like = "None" if term.like is None else self.pack(self.known(term.like))
                text = f"rt.length({self.keep(term)}, {self.pack(self.known(term.array))}, {like})"
                return self.dynamic(text, False, ())
            case Data():
                return self.dynamic(f"rt.data({self.keep(term)})", False, ())
