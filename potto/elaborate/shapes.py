"""What terms stand for, as far as it decides how they are put together: numbers, tuples, arrays.

Owns `Shapes`. Types of definitions come from what `shape` says of them, those of local names from what they were bound
to, so that a term is all that has to be looked at; what is not known is a number.
"""

from __future__ import annotations

from collections.abc import Callable

from potto.core.terms import (
    App,
    Array,
    Branch,
    Const,
    Deriv,
    Fold,
    Global,
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
    stem,
    transform,
    tuple_,
)
from potto.elaborate.signatures import unnamed
from potto.query import Database
from potto.types import interface, shape
from potto.types.still import makes_dual
from potto.types.types import (
    ANY_SIZE,
    REAL,
    ArrayOf,
    Count,
    Diffeo,
    Function,
    Parameter,
    Real,
    TupleOf,
    Type,
    derivative_type,
    resolve,
)
from potto.types.types import TypeVariable as TypeVar
from potto.types.unify import as_tuple, open_type, parts, unify

PLAIN = frozenset({Prim, Const})


class Shapes:
    """The types of the terms of one elaboration. names: of variables that stand for more than a number.

    definition: gives the type of a definition.
    """

    def __init__(self, db: Database, definition: Callable[[Database, str, str], Type] = shape) -> None:
        self.db, self.definition = db, definition
        self.names: dict[str, Type] = {}
        self.known: dict[Term, Type] = {}
        self.meets_records = False  # whether some are made

    def of(self, term: Term) -> Type:
        """The type of a term; of what is not a composite, a number."""
        if type(term) in PLAIN:  # as most are
            return REAL
        found = self.known.get(term)
        if found is None:
            found = self.known[term] = resolve(self._found(term))
        return found

    def named(self, term: Term) -> Type:
        """The same, where parameters of definitions have their names."""
        shapes = Shapes(self.db, lambda db, file, name: interface(db, file, name).type)
        shapes.names = self.names
        shapes.known = {of: type for of, type in self.known.items() if not isinstance(type, Function)}
        return shapes.of(term)

    def _found(self, term: Term) -> Type:
        match term:
            case Var(name=name):
                return self.names.get(name, REAL)
            case Tuple(items=items):
                return TupleOf(tuple(map(self.of, items)))
            case ListOf(items=items):
                return ArrayOf(Count(len(items)), self.of(items[0]) if items else REAL)
            case Array(body=body):
                return ArrayOf(ANY_SIZE, self.of(body))
            case Index(array=array):
                whole = self.of(array)
                return whole.item if isinstance(whole, ArrayOf) else REAL
            case Proj(term=inner, index=index):
                return _part(self.of(inner), index)
            case If(then=inner) | Branch(then=inner) | Integral(body=inner) | Sum(body=inner) | Fold(start=inner):
                return self.of(inner)
            case App() | Global() | Deriv():
                return self._called(term)
            case Lam(params=params, body=body):
                return Function(tuple(Parameter(stem(p), self.names.get(p, REAL)) for p in params), self.of(body))
            case _:
                return REAL

    def parameters(self, function: Term) -> tuple[Type, ...]:
        """The types of what a function takes next; none where that is not known."""
        found = resolve(self._called(function))
        return tuple(p.type for p in found.parameters) if isinstance(found, Function) else ()

    def makes_record(self, function: Term) -> bool:
        """Whether a function is the definition of a record."""
        found = unnamed(self.db, function.module, function.name) if isinstance(function, Global) else None
        return found is not None and found.record

    def erased(self, term: Term, made: dict[Term, Term]) -> Term:
        """A term in which records are the tuples that they are. made: what parts have become."""

        def change(_: Term, new: Term) -> Term:
            return tuple_(new.args) if isinstance(new, App) and self.makes_record(new.function) else new

        return transform(term, change, made=made)

    def _called(self, term: Term) -> Type:
        """The type of a call: that of the definition, for arguments like these."""
        match term:
            case Global(module=file, name=name):
                type = self.definition(self.db, file, name)
                return open_type(type, 1) if _has_variables(type) else type
            case Deriv(function=function):
                return derivative_type(self._called(function))
            case App(function=function, args=args) if not isinstance(function, Lam):
                found = resolve(self._called(function))
                if not isinstance(found, Function):
                    return REAL
                given = tuple(Parameter(None, self.of(arg)) for arg in args if not isinstance(arg, Lam | Deriv))
                if len(given) == len(args):
                    unify(as_tuple(found.parameters), as_tuple(given))
                made = resolve(found.result)
                if self.makes_record(function) and makes_dual(found, dict(enumerate(map(self.of, args)))):
                    return derivative_type(made)
                return made
            case App(function=Lam(body=body)):
                return self.of(body)
            case _:
                return self.of(term)


def _part(whole: Type, index: int) -> Type:
    if isinstance(whole, TupleOf) and index < len(whole.items):
        return resolve(whole.items[index])
    return REAL


def _has_variables(type: Type) -> bool:
    """Whether a type is one of any types."""
    waiting = [type]
    while waiting:
        here = waiting.pop()
        if isinstance(here, Real):  # as most are
            continue
        here = resolve(here)
        if isinstance(here, TypeVar):
            return True
        waiting += parts(here)
    return False


def is_vector(type: Type) -> bool:
    """Whether arithmetic on it goes component by component."""
    return isinstance(type, ArrayOf) or (isinstance(type, TupleOf) and type.record is None)


def dims_of(type: Type) -> int | None:
    """The size of a tuple."""
    if isinstance(type, Diffeo):
        return type.dims
    return len(type.items) if isinstance(type, TupleOf) else None
