"""Unification: making two types equal by finding out what is not known yet.

Owns the levels of `Meta` that decide what a local name generalises over. A group of n parameters and one parameter that
is a tuple of n are the same to it; names of parameters, and all that says what varies, are not its business. `Unknown`
fits everything. Where two types do not fit it says so and leaves what it has found: the caller reports once.
"""

from __future__ import annotations

from collections.abc import Callable

from potto.types.types import (
    REAL,
    AnySize,
    ArrayOf,
    Count,
    Diffeo,
    Dist,
    Function,
    Meta,
    Parameter,
    Real,
    Shifted,
    SizeVar,
    Truth,
    TupleOf,
    Type,
    TypeVariable,
    Unknown,
    groups_of,
    resolve,
    shifted,
    with_items,
)

NUMBERS = (Real, Dist)
SIZES = (Count, SizeVar, Shifted, AnySize)
_TUPLES = (TupleOf, Diffeo)
MAX_LEAVES = 4096  # numbers in one tuple: beyond it a program is wrong (or hostile)


def unify(a: Type, b: Type) -> bool:
    """Whether the types fit; makes them equal."""
    if a is b:  # as numbers mostly are
        return True
    a, b = _reduced(a), _reduced(b)
    if (
        a is b or type(a) is Unknown or type(b) is Unknown
    ):  # of a class that a value is not of, `isinstance` takes longer
        return True
    if isinstance(a, Meta):
        return _bind(a, b)
    if isinstance(b, Meta):
        return _bind(b, a)
    if type(a) in NUMBERS:
        return type(b) in NUMBERS
    if isinstance(a, Function):
        return isinstance(b, Function) and _unify_functions(a, b)
    if isinstance(a, _TUPLES) and isinstance(b, _TUPLES):
        return _unify_tuples(a, b)
    if isinstance(a, ArrayOf) and isinstance(b, ArrayOf):
        fits = unify(a.item, b.item)
        return unify(a.size, b.size) and fits
    if isinstance(a, SIZES) and isinstance(b, SIZES):
        return _unify_sizes(a, b)
    if isinstance(a, TypeVariable) and isinstance(b, TypeVariable):
        return a.name == b.name
    return isinstance(a, Truth) and isinstance(b, Truth)


def _reduced(type: Type) -> Type:
    """What is known about a type. What a size is shifted from may be shifted itself: `n + 1 - 1` is `n`."""
    found = resolve(type)
    return shifted(found, 0) if found.__class__ is Shifted else found


def _unify_sizes(a: Type, b: Type) -> bool:
    """Whether sizes may be the same; what one of them is shifted from is found out."""
    if isinstance(a, AnySize) or isinstance(b, AnySize):
        return True
    if isinstance(a, Shifted) and not (isinstance(b, Count) and b.number < a.offset):
        return unify(a.base, shifted(b, -a.offset))
    if isinstance(b, Shifted) and not (isinstance(a, Count) and a.number < b.offset):
        return unify(b.base, shifted(a, -b.offset))
    return a == b


def _unify_functions(a: Function, b: Function) -> bool:
    mine, theirs = a.parameters, b.parameters
    if len(mine) == len(theirs):
        fits = [unify(p.type, q.type) for p, q in zip(mine, theirs)]
        return all(fits) and unify(a.result, b.result)
    if len(mine) != 1 and len(theirs) != 1:
        return False
    return unify(as_tuple(mine), as_tuple(theirs)) and unify(a.result, b.result)


def as_tuple(parameters: tuple[Parameter, ...]) -> Type:
    """A group of parameters as the one tuple that it also accepts."""
    return parameters[0].type if len(parameters) == 1 else TupleOf(tuple(p.type for p in parameters))


def is_named_alike(a: TupleOf, b: TupleOf) -> bool:
    """Whether two tuples are of one record, or of none. The dual of one that holds functions may be a plain tuple."""
    if a.record is None or b.record is None:
        record = a.record or b.record
        return record is None or record.dual
    return a.record == b.record


def _unify_tuples(a: TupleOf | Diffeo, b: TupleOf | Diffeo) -> bool:
    if isinstance(a, TupleOf) and isinstance(b, TupleOf):
        if len(a.items) != len(b.items) or not is_named_alike(a, b):
            return False
        fits = [unify(item, other) for item, other in zip(a.items, b.items)]
        return all(fits)
    if isinstance(a, Diffeo) and isinstance(b, Diffeo):
        return a.dims is None or b.dims is None or a.dims == b.dims
    diffeo, plain = (a, b) if isinstance(a, Diffeo) else (b, a)
    assert isinstance(diffeo, Diffeo) and isinstance(plain, TupleOf)
    if plain.record is not None:
        return False
    if diffeo.dims is not None and diffeo.dims != len(plain.items):
        return False
    fits = [unify(item, REAL) for item in plain.items]
    return all(fits)


def _bind(meta: Meta, type: Type) -> bool:
    """Find `meta` to be `type`, unless that contains it; what `type` does not know yet sinks to the level of `meta`."""
    if isinstance(type, NUMBERS):
        meta.found = type
        return True
    stack: list[Type] = [type]
    seen: set[int] = set()
    while stack:
        part = resolve(stack.pop())
        if part is meta:
            return False
        if isinstance(part, Meta):
            part.level = min(part.level, meta.level)
        elif id(part) not in seen:
            seen.add(id(part))
            stack.extend(parts(part))
    meta.found = type
    return True


def occurs(meta: Meta, type: Type) -> bool:
    """Whether a type is made of what `meta` stands for."""
    meta_itself, stack, seen = resolve(meta), [type], set[int]()
    while stack:
        part = resolve(stack.pop())
        if part is meta_itself:
            return True
        if id(part) not in seen:
            seen.add(id(part))
            stack.extend(parts(part))
    return False


def parts(type: Type) -> tuple[Type, ...]:
    """The types that a type is made of."""
    if isinstance(type, Real):  # most types
        return ()
    if isinstance(type, TupleOf):
        return type.items
    if isinstance(type, Function):
        return (*(p.type for p in type.parameters), type.result)
    if isinstance(type, ArrayOf):
        return type.size, type.item
    return (type.base,) if isinstance(type, Shifted) else ()


def bare(type: Type) -> Type:
    """A type without the names of parameters and without what it says of variation."""
    if isinstance(type, NUMBERS):
        return REAL
    type = resolve(type)
    if isinstance(type, Function):
        return Function(tuple([Parameter(None, bare(p.type)) for p in type.parameters]), bare(type.result))
    if isinstance(type, TupleOf):
        return with_items(type, tuple([bare(item) for item in type.items]))
    return ArrayOf(type.size, bare(type.item)) if isinstance(type, ArrayOf) else type


def rebuild(type: Type, leaf: Callable[[Type], Type]) -> Type:
    """A type with every part that is not a composite replaced by `leaf` of it."""
    if isinstance(type, Real):  # most parts
        return leaf(type)
    type = resolve(type)
    if isinstance(type, Function):
        parameters = tuple([Parameter(p.name, rebuild(p.type, leaf)) for p in type.parameters])
        return Function(parameters, rebuild(type.result, leaf))
    if isinstance(type, TupleOf):
        return with_items(type, tuple([rebuild(item, leaf) for item in type.items]))
    if isinstance(type, ArrayOf):
        return ArrayOf(rebuild(type.size, leaf), rebuild(type.item, leaf))
    return shifted(rebuild(type.base, leaf), type.offset) if isinstance(type, Shifted) else leaf(type)


def leaves(type: Type) -> int:
    """How many numbers a type is made of, counted up to MAX_LEAVES."""
    count, stack = 0, [type]
    while stack and count < MAX_LEAVES:
        part = resolve(stack.pop())
        below = parts(part)
        count += not below and not isinstance(part, SIZES)
        stack.extend(below)
    return count


def free_metas(type: Type, level: int) -> tuple[Meta, ...]:
    """What a binding at `level` may generalise over: the unknown parts that belong to it alone."""
    found: dict[Meta, None] = {}
    stack = [type]
    while stack:
        part = resolve(stack.pop())
        if isinstance(part, Meta):
            if part.level > level:
                found[part] = None
        else:
            stack.extend(parts(part))
    return tuple(found)


def instantiate(type: Type, generic: tuple[Meta, ...], level: int) -> Type:
    """A fresh copy of a local name's type."""
    if not generic:
        return type
    fresh: dict[Meta, Type] = {meta: Meta(level, size=meta.size) for meta in generic}
    return rebuild(type, lambda leaf: fresh.get(leaf, leaf) if isinstance(leaf, Meta) else leaf)


def open_type(type: Type, level: int) -> Type:
    """A fresh copy of another definition's type, for inference: variables become unknown, marks of variation go."""
    fresh: dict[str, Type] = {}

    def leaf(part: Type) -> Type:
        if isinstance(part, NUMBERS):
            return REAL
        if isinstance(part, TypeVariable):
            return fresh.setdefault(part.name, Meta(level))
        if isinstance(part, SizeVar):
            return fresh.setdefault(f"[{part.name}]", Meta(level, size=part.name))
        return part

    return rebuild(type, leaf)


def close_type(type: Type) -> Type:
    """A type without `Meta`: what is unknown at the end holds for all types, and gets a name; no size that of a
    parameter, which is another number."""
    names: dict[Meta, Type] = {}
    sizes: set[str] = set()

    def leaf(part: Type) -> Type:
        if not isinstance(part, Meta):
            return part
        if part.size is not None and part not in names:
            if not sizes:
                sizes.update(p.name for group in groups_of(type) for p in group if p.name is not None)
            names[part] = SizeVar(size_name(part.size, sizes))
        return names.setdefault(part, TypeVariable(_variable_name(len(names))))

    return rebuild(type, leaf)


def size_name(wanted: str, taken: set[str]) -> str:
    """A name for a size that is not taken yet: the one that is wanted, or the next of n, m, k, …"""
    name, number = wanted or "n", 0
    while name in taken:
        name = "nmklpqrst"[number % 9] + (str(number // 9) if number >= 9 else "")
        number += 1
    taken.add(name)
    return name


def _variable_name(number: int) -> str:
    return chr(ord("a") + number % 26) + (str(number // 26) if number >= 26 else "")


def settle(type: Type) -> None:
    """Take every unknown part to be a number (or Unknown if it cannot be)."""
    stack = [type]
    while stack:
        part = resolve(stack.pop())
        if isinstance(part, Meta):
            part.found = part.found if part.size is not None else REAL
        else:
            stack.extend(parts(part))
