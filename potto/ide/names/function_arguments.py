"""What a parameter that is a function can be given. Owns `fits`.

A name of the file, one that it imports, or one of any module of the workspace, the nearest first; else a constant
function of the type that is asked for. What is found depends on interfaces alone, file by file, so that an edit of a
body looks for nothing again.
"""

from __future__ import annotations

import itertools
import os.path
from collections.abc import Iterator, Mapping

from potto.modules import DefinitionTarget, names, resolve
from potto.modules.lookup import ImportBinding, ModuleTarget, scope
from potto.modules.workspace import files, module_name
from potto.query import Database, query
from potto.types import Diffeo, Parameter, Real, TupleOf, Type, TypeVariable, groups_of, interface, result_of
from potto.types.types import REAL
from potto.types.types import resolve as known
from potto.types.unify import as_tuple, open_type, rebuild, unify

MOST = 50  # that are offered for one parameter
Fitting = tuple[str, DefinitionTarget]  # a text, and the function that it means
_USUAL = ("x", "y", "z")


def fits(db: Database, file: str, name: str, type: Type, elsewhere: bool = True) -> tuple[str, ...]:
    """Texts of functions that a parameter of this type of the definition `name` can be given, the likeliest first.

    `elsewhere`: also functions of modules that the file does not import, as `module.function`.
    """
    type = of_numbers(type)
    near = _fitting(db, file, type)
    found = [text for text, _ in near if text != name]
    if elsewhere and len(found) < MOST:
        known = {target for _, target in near}
        found += [text for text, target in _found_elsewhere(db, file, type) if target not in known]
    return tuple(found[:MOST]) or tuple(constant(type))


def of_numbers(type: Type) -> Type:
    """A type with numbers wherever any type will do: a viewer can set numbers."""
    return rebuild(type, lambda part: REAL if isinstance(part, TypeVariable) else part)


def accepts(wanted: Type, has: Type) -> bool:
    """Whether a function of the type `has` can be given where one that takes and gives numbers is wanted.

    Where what varies is passed it must be accepted, as a plain condition on it would be refused; and a diffeomorphism
    is more than the tuple that it gives.
    """
    groups, given = groups_of(wanted), groups_of(has)
    opened = open_type(has, 0)
    if not given or len(groups) != len(given) or not unify(opened, open_type(wanted, 0)):
        return False
    if isinstance(known(result_of(wanted)), Diffeo) and not isinstance(known(result_of(has)), Diffeo):
        return False
    return all(_passes(asked, taken) for asked, taken in zip(groups, given))


def constant(type: Type) -> Iterator[str]:
    """A constant function of a type as a text, if numbers are its result."""
    groups, size = groups_of(type), numbers(result_of(type))
    if not groups or not size:
        return
    count = sum(map(len, groups))
    free = iter(_USUAL if count <= len(_USUAL) else [f"x{place + 1}" for place in range(count)])
    heads = " . ".join(f"\\({', '.join(next(free) for _ in group)})" for group in groups)
    result = known(result_of(type))
    rest = "0" if isinstance(result, TupleOf) and result.dual else "1"  # of a dual: it does not change
    yield f"{heads} . {'1' if size == 1 else '(' + ', '.join(['1', *[rest] * (size - 1)]) + ')'}"


def numbers(type: Type) -> int:
    """How many numbers a value consists of; 0 if it is neither a number nor a flat tuple of numbers."""
    type = known(type)
    if isinstance(type, Real):
        return 1
    if isinstance(type, TupleOf) and all(isinstance(known(item), Real) for item in type.items):
        return len(type.items)
    return 0


def _passes(asked: tuple[Parameter, ...], taken: tuple[Parameter, ...]) -> bool:
    """Whether what varies is accepted where it is passed; a group of n also takes one tuple of n."""
    passed, accepted = _stars(as_tuple(asked)), _stars(as_tuple(taken))
    return len(passed) != len(accepted) or all(takes or not varies for varies, takes in zip(passed, accepted))


def _stars(type: Type) -> list[bool]:
    """For each number in a type, whether it may vary. Where any type is allowed, it may."""
    type = known(type)
    if isinstance(type, TupleOf):
        return [star for item in type.items for star in _stars(item)]
    return [type.star if isinstance(type, Real) else True]


@query(keep=256)
def _fitting(db: Database, file: str, type: Type) -> tuple[Fitting, ...]:
    """What fits among the names of a file, found once for all parameters of a type."""
    groups = len(groups_of(type))
    near = itertools.chain(_own(db, file, groups), _imported(db, file, groups))
    fitting = ((text, target) for text, target in near if accepts(type, interface(db, *target).type))
    return tuple(itertools.islice(fitting, MOST + 1))  # one of them may be the function itself


@query(keep=256)
def _found_elsewhere(db: Database, file: str, type: Type) -> tuple[Fitting, ...]:
    """What fits in other modules."""
    found: list[Fitting] = []
    for other in _elsewhere(db, file):
        module = module_name(db, file, other)
        if module is not None:
            own = _own(db, other, len(groups_of(type)))
            found += [(f"{module}.{n}", target) for n, target in own if accepts(type, interface(db, *target).type)]
        if len(found) >= MOST:
            break
    return tuple(found)


def _own(db: Database, file: str, groups: int) -> Iterator[Fitting]:
    for name in db.entry(_by_groups, (file,), groups) or ():
        yield name, DefinitionTarget(file, name)


def _imported(db: Database, file: str, groups: int) -> Iterator[Fitting]:
    for bound, meaning in scope(db, file).items():
        target = resolve(db, file, bound) if isinstance(meaning, ImportBinding) else None
        if isinstance(target, DefinitionTarget):
            yield bound, target
        elif isinstance(target, ModuleTarget):
            for name in db.entry(_by_groups, (target.file,), groups) or ():
                yield f"{bound}.{name}", DefinitionTarget(target.file, name)


def _elsewhere(db: Database, file: str) -> list[str]:
    """The other programs of the workspace, those in the nearest folders first."""
    parts = os.path.dirname(file).split(os.sep)

    def distance(other: str) -> int:
        others = os.path.dirname(other).split(os.sep)
        common = sum(1 for _ in itertools.takewhile(lambda both: both[0] == both[1], zip(parts, others)))
        return len(parts) + len(others) - 2 * common

    return sorted((other for other in files(db) if other != file), key=distance)


@query
def _by_groups(db: Database, file: str) -> Mapping[int, tuple[str, ...]]:
    """The functions of a file by how many groups of parameters they have; a table, to be read by entry."""
    table: dict[int, list[str]] = {}
    for name in names(db, file):
        count = len(groups_of(interface(db, file, name).type))
        if count:
            table.setdefault(count, []).append(name)
    return {count: tuple(found) for count, found in table.items()}
