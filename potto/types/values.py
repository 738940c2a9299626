"""What a value depends on: abstract values with the shape of a type and, at each number, where it comes from.

Owns `Value` and its algebra. A `Source` is a variable of integration or an input of a function. An `AbstractFunction`
is a function that is known: symbolic inputs, its result in terms of them, and effects: what it demands of them (`Sink`)
and what it passes to the functions among them (`Port`). An `Abstract` is a function that is an input itself: it has
ports for what it is given and a symbolic result. It is assumed that what an unknown function gives varies with all that
it is given; so every call is judged by itself, and a function can be judged without its callers.

An interface is an `AbstractFunction` whose sources are interned by number, so that equal interfaces are equal values.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from msgspec import Struct

from potto.source import NOWHERE, Span

SourceKind = Literal["variable", "input", "other"]  # other: the index of a sum, or what is wrong
SinkKind = Literal["condition", "jump", "sum", "count", "index", "equality", "declared", "integral", "delta"]


@dataclass(eq=False, repr=False, slots=True)
class Source:
    """Where variation comes from. `number` is set for those of an interface; `origin` for another definition's."""

    kind: SourceKind
    name: str
    span: Span = NOWHERE
    number: int = -1
    origin: Any = None

    def __repr__(self) -> str:
        return f"<{self.kind} {self.name}>"


class Step(Struct, frozen=True):
    """One step on the way of a dependence: a place and what happens there."""

    span: Span
    message: str
    argument: bool = False


class Joined(Struct, frozen=True):
    """A way made of two ways."""

    first: Trail
    second: Trail


Trail = Step | Joined | None
Sources = Mapping[Source, Trail]
Surface = frozenset[Source]


class Spike(Struct, frozen=True):
    """A delta: what its surface varies with, and a key that is the same for the same surface."""

    over: Surface
    key: str


class AbstractScalar(Struct, frozen=True):
    """A number, a truth value or anything whose inside is not known.

    `carriers`: sources of unknown type that it may be itself (the rest only decides which). `jumps`: the surfaces
    across which it jumps; of a truth value, those of its comparisons. `spikes`: its deltas; of a truth value, its
    equalities.
    """

    sources: Sources
    jumps: frozenset[Surface] = frozenset()
    spikes: frozenset[Spike] = frozenset()
    carriers: frozenset[Source] = frozenset()


class TupleValue(Struct, frozen=True):
    items: tuple[Value, ...]


class ListValue(Struct, frozen=True):
    item: Value


@dataclass(eq=False, repr=False, slots=True)
class Port:
    """A place where an unknown function is given something."""

    name: str
    number: int = -1
    origin: Any = None


class PortTuple(Struct, frozen=True):
    items: tuple[PortTree, ...]


class PortFunction(Struct, frozen=True):
    """A function is given: `inputs` is what it will be called with, `result` gets what it gives."""

    inputs: tuple[Value, ...]
    result: PortTree


class NoPort(Struct, frozen=True):
    """What is given here is not looked at (a tangent)."""


PortTree = Port | PortTuple | PortFunction | NoPort


@dataclass(eq=False, repr=False, slots=True)
class Sink:
    """A place that must not vary. `origin` tells the definition of a place elsewhere, `number` its input there."""

    kind: SinkKind
    span: Span = NOWHERE
    number: int = -1
    origin: Any = None
    node: Any = None


class Effect(Struct, frozen=True):
    """`value` goes to `to` when the function is called."""

    to: Sink | Port
    value: Value


class AbstractFunction(Struct, frozen=True):
    inputs: tuple[Value, ...]
    result: Value
    effects: tuple[Effect, ...] = ()


@dataclass(frozen=True, slots=True)
class Abstract:
    """A function that is an input. `taint`: what it was given in earlier groups."""

    ports: tuple[PortTree, ...]
    result: Value
    taint: Sources = field(default_factory=dict)


class Choice(Struct, frozen=True):
    """One of several functions (the items of a list)."""

    options: tuple[Value, ...]


Value = AbstractScalar | TupleValue | ListValue | AbstractFunction | Abstract | Choice

NONE: Sources = {}
STILL = AbstractScalar(NONE)
HAZE = Source("other", "?")
HAZY = AbstractScalar({HAZE: None})  # what is wrong: varies with it knows what, and breaks no rule
