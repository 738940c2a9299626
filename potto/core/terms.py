"""Core terms: what programs mean, with nothing left of how they were written.

Owns the closed union `Term`. Terms are hash-consed: two equal terms are one object, so equality is `is`, hashing is
free and sharing survives every pass. Passes that walk a whole term use `postorder`, which does not recurse and visits
a shared term once. A term knows its free variables (`.free`) and a digest of its content (`.digest`).

Smart constructors (`add`, `mul`, `div`, ...) fold constants where the result is exact, drop neutral elements and
flatten; they never reorder operands and never change where a term is defined or which value it takes.
"""

from __future__ import annotations

import hashlib
import math
import threading
import weakref
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeGuard, TypeVar


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True, repr=False)
class _Base:
    free: frozenset[str] = field()
    digest: bytes = field()

    def __repr__(self) -> str:
        """The kind and the text, cut short: a shared term may be a small object and an endless text."""
        from potto.core.printer import format_term

        return f"<{type(self).__name__} {format_term(self, 200)}>"  # type: ignore[arg-type]

    def __reduce__(self) -> Any:
        return _rebuild, (type(self), tuple(getattr(self, name) for name in _FIELDS[type(self)]))


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Const(_Base):
    """A number. `name` is set for named ones (`pi`), which the oracle evaluates to more digits."""

    value: float
    name: str | None


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Var(_Base):
    """A parameter, a variable of integration or the index of a sum. Binders in one definition have distinct names."""

    name: str


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Prim(_Base):
    """A builtin applied to terms. `op` names an entry of `potto.primitives`.

    add and mul take any number of arguments; neg, div, pow as named. lt le eq ne and or not make truth values, which
    stand only in the condition of an `If`.
    """

    op: str
    args: tuple[Term, ...]


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class If(_Base):
    """A plain conditional: the condition varies with no variable of integration."""

    condition: Term
    then: Term
    orelse: Term


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Branch(_Base):
    """A diffeomorphic conditional: `then` where the first coordinate is >= 0 (> 0 when strict), else `orelse`.

    `coordinates` are the components of the diffeomorphism that the author wrote: only the first decides. Over no
    variable of integration it is an ordinary conditional.
    """

    coordinates: tuple[Term, ...]
    strict: bool
    then: Term
    orelse: Term

    @property
    def surface(self) -> Term:
        return self.coordinates[0]


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Tuple(_Base):
    items: tuple[Term, ...]


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Proj(_Base):
    """Component `index` (from 0) of a tuple of `size` components (0 where the size is not known)."""

    term: Term
    index: int


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class ListOf(_Base):
    items: tuple[Term, ...]


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Lam(_Base):
    """A function of one group of parameters."""

    params: tuple[str, ...]
    body: Term


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class App(_Base):
    """One group of arguments given to a function. A group of n parameters also takes one tuple of n, and back."""

    function: Term
    args: tuple[Term, ...]


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Global(_Base):
    """Another definition, by module (the key of its file) and name."""

    module: str
    name: str


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Integral(_Base):
    """The iterated integral of `body`, `variables[0]` outermost; bounds may use variables further out.

    `hints` are, per variable, points where a density is concentrated: the integrator cuts there, nothing depends on it.
    """

    variables: tuple[str, ...]
    bounds: tuple[tuple[Term, Term], ...]
    body: Term
    hints: tuple[tuple[Term, ...], ...]


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Delta(_Base):
    """The Dirac delta of a diffeomorphism's first coordinate."""

    coordinates: tuple[Term, ...]


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Sum(_Base):
    """The sum of `body` for the integers `variable` from `lo` to `hi`, both included; 0 when there are none."""

    variable: str
    lo: Term
    hi: Term
    body: Term


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Deriv(_Base):
    """The derivative of a function: takes duals `(value, tangent)`, gives a dual."""

    function: Term


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Hole(_Base):
    """Where the program is wrong: evaluating it raises the diagnostic that said so."""

    reason: str


Term = (
    Const
    | Var
    | Prim
    | If
    | Branch
    | Tuple
    | Proj
    | ListOf
    | Lam
    | App
    | Global
    | Integral
    | Delta
    | Sum
    | Deriv
    | Hole
)

_FIELDS: dict[type, tuple[str, ...]] = {
    Const: ("value", "name"),
    Var: ("name",),
    Prim: ("op", "args"),
    If: ("condition", "then", "orelse"),
    Branch: ("coordinates", "strict", "then", "orelse"),
    Tuple: ("items",),
    Proj: ("term", "index"),
    ListOf: ("items",),
    Lam: ("params", "body"),
    App: ("function", "args"),
    Global: ("module", "name"),
    Integral: ("variables", "bounds", "body", "hints"),
    Delta: ("coordinates",),
    Sum: ("variable", "lo", "hi", "body"),
    Deriv: ("function",),
    Hole: ("reason",),
}

_table: weakref.WeakValueDictionary[bytes, Any] = weakref.WeakValueDictionary()
_lock = threading.Lock()
T = TypeVar("T", bound=_Base)
_NOTHING: frozenset[str] = frozenset()


def _feed(value: object, into: list[bytes]) -> None:
    if isinstance(value, _Base):
        into.append(value.digest)
    elif isinstance(value, tuple):
        into.append(b"(%d" % len(value))
        for item in value:
            _feed(item, into)
    elif isinstance(value, float):
        into.append(value.hex().encode())
    else:
        into.append(repr(value).encode())


def _make(cls: type[T], free: frozenset[str], *fields: object) -> T:
    parts = [cls.__name__.encode()]
    for value in fields:
        _feed(value, parts)
    digest = hashlib.blake2b(b"\x00".join(parts), digest_size=16).digest()
    with _lock:
        found = _table.get(digest)
        if found is None:
            found = cls(free, digest, *fields)
            _table[digest] = found
    return found


def _union(terms: Iterable[Term]) -> frozenset[str]:
    result = _NOTHING
    for term in terms:
        if term.free and not term.free <= result:
            result = result | term.free if result else term.free
    return result


def _rebuild(cls: type, fields: tuple[Any, ...]) -> Any:
    return _REBUILD[cls](*fields)


# Constructors, one for each kind of term


def const(value: float, name: str | None = None) -> Const:
    value = float(value)
    return _make(Const, _NOTHING, 0.0 if value == 0 else value, name)


def var(name: str) -> Var:
    return _make(Var, frozenset((name,)), name)


def prim(op: str, *args: Term) -> Prim:
    """A builtin as it stands, nothing folded. See `add`, `mul`, ... and `apply` for the folding ones."""
    return _make(Prim, _union(args), op, args)


def if_(condition: Term, then: Term, orelse: Term) -> Term:
    if then is orelse:
        return then
    return _make(If, _union((condition, then, orelse)), condition, then, orelse)


def branch(coordinates: tuple[Term, ...], strict: bool, then: Term, orelse: Term) -> Term:
    return _make(Branch, _union((*coordinates, then, orelse)), coordinates, strict, then, orelse)


def tuple_(items: Iterable[Term]) -> Tuple:
    items = tuple(items)
    return _make(Tuple, _union(items), items)


def proj(term: Term, index: int) -> Term:
    if isinstance(term, Tuple) and index < len(term.items):
        return term.items[index]
    return _make(Proj, term.free, term, index)


def list_of(items: Iterable[Term]) -> ListOf:
    items = tuple(items)
    return _make(ListOf, _union(items), items)


def lam(params: tuple[str, ...], body: Term) -> Lam:
    return _make(Lam, body.free.difference(params), params, body)


def app(function: Term, args: tuple[Term, ...]) -> App:
    return _make(App, _union((function, *args)), function, args)


def global_(module: str, name: str) -> Global:
    return _make(Global, _NOTHING, module, name)


def integral(
    variables: tuple[str, ...],
    bounds: tuple[tuple[Term, Term], ...],
    body: Term,
    hints: tuple[tuple[Term, ...], ...] | None = None,
) -> Integral:
    if hints is None:
        hints = ((),) * len(variables)
    free = body.free
    for name, (lo, hi), points in reversed(list(zip(variables, bounds, hints, strict=True))):
        free = free.difference((name,)) | lo.free | hi.free | _union(points)
    return _make(Integral, free, variables, bounds, body, hints)


def delta(coordinates: tuple[Term, ...]) -> Delta:
    return _make(Delta, _union(coordinates), coordinates)


def sum_(variable: str, lo: Term, hi: Term, body: Term) -> Sum:
    return _make(Sum, lo.free | hi.free | body.free.difference((variable,)), variable, lo, hi, body)


def deriv(function: Term) -> Deriv:
    return _make(Deriv, function.free, function)


def hole(reason: str) -> Hole:
    return _make(Hole, _NOTHING, reason)


def _prim_from(op: str, args: tuple[Term, ...]) -> Prim:
    return prim(op, *args)


_REBUILD: dict[type, Any] = {
    Const: const,
    Var: var,
    Prim: _prim_from,
    If: if_,
    Branch: branch,
    Tuple: tuple_,
    Proj: proj,
    ListOf: list_of,
    Lam: lam,
    App: app,
    Global: global_,
    Integral: integral,
    Delta: delta,
    Sum: sum_,
    Deriv: deriv,
    Hole: hole,
}

ZERO = const(0.0)
ONE = const(1.0)
PI = const(math.pi, "pi")
INF = const(math.inf, "inf")


# Arithmetic that folds

LONGEST = 1000

def _exact_integer(value: float) -> bool:
    return value.is_integer() and abs(value) < 2.0**53


def _flattens(arg: Term, op: str) -> TypeGuard[Prim]:
    """Whether the operands of `arg` join those around it. Long ones stay apart: x*x of a shared x would double them."""
    return isinstance(arg, Prim) and arg.op == op and len(arg.args) <= LONGEST


def add(*args: Term) -> Term:
    """The sum; flattened, zeros dropped, integers added up (exactly)."""
    terms: list[Term] = []
    total = 0.0
    for arg in args:
        for term in arg.args if _flattens(arg, "add") else (arg,):
            if isinstance(term, Const) and _exact_integer(term.value) and _exact_integer(total + term.value):
                total += term.value
            else:
                terms.append(term)
    if total:
        terms.append(const(total))
    if not terms:
        return ZERO
    return terms[0] if len(terms) == 1 else prim("add", *terms)


def neg(arg: Term) -> Term:
    if isinstance(arg, Const) and arg.name is None:
        return const(-arg.value)
    if isinstance(arg, Prim) and arg.op == "neg":
        return arg.args[0]
    return prim("neg", arg)


def sub(a: Term, b: Term) -> Term:
    if a is b and not isinstance(a, Const):
        return prim("add", a, neg(b))  # x - x is not 0 where x is not finite; `simplify` may decide
    return add(a, neg(b))


def mul(*args: Term) -> Term:
    """The product; flattened, ones dropped, integers multiplied (exactly). A factor 0 makes it 0."""
    factors: list[Term] = []
    total, sign = 1.0, 1
    for arg in args:
        for term in arg.args if _flattens(arg, "mul") else (arg,):
            if isinstance(term, Prim) and term.op == "neg":
                sign, term = -sign, term.args[0]
            if isinstance(term, Const) and _exact_integer(term.value) and _exact_integer(total * term.value):
                total *= term.value
            else:
                factors.append(term)
    if total == 0:
        return ZERO
    if total != 1:
        factors.insert(0, const(abs(total)))
        sign = -sign if total < 0 else sign
    if total == -1:
        factors.pop(0)
    if not factors:
        return const(sign)
    product = factors[0] if len(factors) == 1 else prim("mul", *factors)
    return product if sign > 0 else neg(product)


def div(a: Term, b: Term) -> Term:
    if b is ONE:
        return a
    if (
        isinstance(a, Const)
        and isinstance(b, Const)
        and _exact_integer(a.value)
        and _exact_integer(b.value)
        and b.value
    ):
        quotient = a.value / b.value
        if math.frexp(b.value)[0] in (0.5, -0.5) or quotient.is_integer():
            return const(quotient)
    return prim("div", a, b)


def pow_(base: Term, exponent: Term) -> Term:
    if exponent is ONE:
        return base
    if isinstance(base, Const) and isinstance(exponent, Const):
        whole = _exact_integer(base.value) and exponent.value.is_integer() and 0 <= exponent.value <= 64
        if whole and abs(base.value) ** exponent.value < 2.0**53:
            return const(base.value**exponent.value)
    return prim("pow", base, exponent)


# Walking


def children(term: Term) -> tuple[Term, ...]:
    """The subterms of a term, in the order in which `rebuild` takes them."""
    match term:
        case Const() | Var() | Global() | Hole():
            return ()
        case Prim(args=args):
            return args
        case If():
            return (term.condition, term.then, term.orelse)
        case Branch():
            return (*term.coordinates, term.then, term.orelse)
        case Tuple(items=items) | ListOf(items=items):
            return items
        case Proj():
            return (term.term,)
        case Lam():
            return (term.body,)
        case App():
            return (term.function, *term.args)
        case Integral():
            return (
                *(b for pair in term.bounds for b in pair),
                *(p for points in term.hints for p in points),
                term.body,
            )
        case Delta():
            return term.coordinates
        case Sum():
            return (term.lo, term.hi, term.body)
        case Deriv():
            return (term.function,)


def rebuild(term: Term, parts: tuple[Term, ...]) -> Term:
    """The same term over other children, folded by the smart constructors."""
    if all(new is old for new, old in zip(parts, children(term), strict=True)):
        return term
    match term:
        case Const() | Var() | Global() | Hole():
            return term
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
            return sum_(term.variable, *parts)
        case Deriv():
            return deriv(parts[0])


def apply(op: str, *args: Term) -> Term:
    """A builtin, folded where one of the folding constructors exists for it."""
    fold = _FOLDING.get(op)
    return prim(op, *args) if fold is None else fold(*args)


_FOLDING: dict[str, Any] = {"add": add, "mul": mul, "neg": neg, "div": div, "pow": pow_}


def postorder(*roots: Term) -> list[Term]:
    """Every distinct subterm once, children before parents. Does not recurse."""
    seen: set[Term] = set()
    order: list[Term] = []
    stack: list[tuple[Term, bool]] = [(root, False) for root in reversed(roots)]
    while stack:
        term, done = stack.pop()
        if done:
            order.append(term)
        elif term not in seen:
            seen.add(term)
            stack.append((term, True))
            stack.extend((child, False) for child in reversed(children(term)) if child not in seen)
    return order


def bound_names(term: Term) -> tuple[str, ...]:
    match term:
        case Lam(params=params):
            return params
        case Integral(variables=variables):
            return variables
        case Sum(variable=variable):
            return (variable,)
        case _:
            return ()


def fresh(name: str, taken: Iterable[str]) -> str:
    """A name like `name` that is not taken: `x`, `x'1`, `x'2`, ..."""
    taken = set(taken)
    stem, number, candidate = name.split("'")[0], 0, name
    while candidate in taken:
        number += 1
        candidate = f"{stem}'{number}"
    return candidate


def substitute(term: Term, mapping: Mapping[str, Term]) -> Term:
    """Replace free variables by terms at once, renaming binders that would capture."""
    mapping = {name: new for name, new in mapping.items() if name in term.free}
    if not mapping:
        return term
    return _Substitution(mapping).run(term)


class _Substitution:
    """One mapping and what it has made of the terms met so far. Recursion only at binders."""

    def __init__(self, mapping: Mapping[str, Term]) -> None:
        self.mapping = mapping
        self.names = frozenset(mapping)
        self.memo: dict[Term, Term] = {}
        self.incoming = _union(mapping.values())

    def run(self, root: Term) -> Term:
        stack: list[tuple[Term, bool]] = [(root, False)]
        memo = self.memo
        while stack:
            term, ready = stack.pop()
            if term in memo:
                continue
            if not (term.free & self.names):
                memo[term] = term
            elif isinstance(term, Var):
                memo[term] = self.mapping[term.name]
            elif bound_names(term):
                memo[term] = self.binder(term)
            elif ready:
                memo[term] = rebuild(term, tuple(memo[c] for c in children(term)))
            else:
                stack.append((term, True))
                stack.extend((c, False) for c in children(term) if c not in memo)
        return memo[root]

    def binder(self, term: Term) -> Term:
        bound = bound_names(term)
        inner = {n: t for n, t in self.mapping.items() if n not in bound}
        clash = [n for n in bound if n in self.incoming]
        if clash:
            taken = set(self.incoming) | set(term.free) | set(bound) | {n for c in children(term) for n in c.free}
            names: dict[str, str] = {}
            for n in clash:
                names[n] = fresh(n, taken)
                taken.add(names[n])
            term = rename_bound(term, names)
            return self.binder(term)
        if isinstance(term, Integral):
            return self.integral(term)
        if isinstance(term, Sum):
            return sum_(term.variable, self.run(term.lo), self.run(term.hi), substitute(term.body, inner))
        assert isinstance(term, Lam)
        return lam(term.params, substitute(term.body, inner))

    def integral(self, term: Integral) -> Term:
        """Bounds of variable k see the variables before k only: the mapping thins as it goes in."""
        inner = dict(self.mapping)
        bounds: list[tuple[Term, Term]] = []
        hints: list[tuple[Term, ...]] = []
        for name, (lo, hi), points in zip(term.variables, term.bounds, term.hints, strict=True):
            bounds.append((substitute(lo, inner), substitute(hi, inner)))
            hints.append(tuple(substitute(p, inner) for p in points))
            inner.pop(name, None)
        return integral(term.variables, tuple(bounds), substitute(term.body, inner), tuple(hints))


def rename_bound(term: Term, names: Mapping[str, str]) -> Term:
    """The same binder with other names for (some of) the variables that it binds."""
    renaming = {old: var(new) for old, new in names.items()}
    match term:
        case Lam():
            return lam(tuple(names.get(p, p) for p in term.params), substitute(term.body, renaming))
        case Sum():
            return sum_(names.get(term.variable, term.variable), term.lo, term.hi, substitute(term.body, renaming))
        case Integral():
            bounds, hints, seen = [], [], dict[str, Term]()
            for name, (lo, hi), points in zip(term.variables, term.bounds, term.hints, strict=True):
                bounds.append((substitute(lo, seen), substitute(hi, seen)))
                hints.append(tuple(substitute(p, seen) for p in points))
                if name in renaming:
                    seen[name] = renaming[name]
            return integral(
                tuple(names.get(v, v) for v in term.variables), tuple(bounds), substitute(term.body, seen), tuple(hints)
            )
        case _:
            raise TypeError(f"{type(term).__name__} binds nothing")
