"""Potto for Python: workspaces, modules, functions that are called with numbers, arrays and each other.

Owns the names that `import potto` offers. A function is an expression with the file whose names it uses; a call is
that expression applied, elaborated once per form of call and then run on values. All of it may be called from several
threads. What is wrong, with the program or with an argument, is a `PottoError`.
"""

from __future__ import annotations

import builtins
import difflib
import itertools
import os
import warnings
from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any

from msgspec.structs import replace

from potto import store
from potto.diagnostics import Diagnostic, PottoError
from potto.evaluating.world import World
from potto.kernels.cells import Rows, Value
from potto.kernels.errors import wrong_call
from potto.modules import DefinitionTarget, ModuleTarget, find_module, names, resolve
from potto.modules.kinds import NO_MODULE
from potto.python.arguments import Batch, batch_of, misfit, moving, value_of
from potto.python.arrays import has_arrays, with_arrays
from potto.python.calls import Call, Form
from potto.python.tiles import in_tiles
from potto.python.travel import Travelling
from potto.reports.render import ProgramError, display_name
from potto.runtime.answers.estimate import Estimate
from potto.runtime.evaluation.functions import Closure
from potto.source import Span
from potto.syntax import nodes, print_expression
from potto.types import derivative_type, format_type, infer_expression
from potto.types.kinds import NO_TANGENT
from potto.types.motionless import GENERAL, LONGEST, MOTIONLESS
from potto.types.queries import is_derivative
from potto.types.types import Diffeo, Parameter, TupleOf, Type, groups_of, result_of
from potto.types.types import Function as FunctionType

NOWHERE = Span(0, 0)
Given = tuple[tuple[tuple[Any, ...], dict[str, Any]], ...]  # per call the arguments by place and by name
NOTHING: Mapping[str, Any] = MappingProxyType({})
_texts = itertools.count(1)


class Workspace:
    """A folder of programs. Modules are found in it by their dotted names, and import each other from it.

    Raises PottoError if there is no such folder.
    """

    def __init__(self, root: str | os.PathLike[str] = ".", *, roots: Sequence[str | os.PathLike[str]] = ()) -> None:
        self.root = os.path.abspath(root)
        for folder in (self.root, *map(os.path.abspath, roots)):
            if not os.path.isdir(folder):
                what = "is a file, not a folder" if os.path.exists(folder) else "does not exist"
                raise PottoError([NO_MODULE(NOWHERE, f"the folder of a workspace {what}: {display_name(folder)}")])
        self._world = World([self.root, *roots])

    def module(self, name: str) -> Module:
        """The module of a dotted name. Raises PottoError if there is none, or as `load` does."""
        file = find_module(self._world.db, os.path.join(self.root, "<workspace>"), name)
        if file is None:
            problem = NO_MODULE(NOWHERE, f"there is no module `{name}` in {display_name(self.root)}")
            raise PottoError([problem])
        return _module(self._world, file)

    def load(self, path: str | os.PathLike[str]) -> Module:
        """The module in a file. A relative path starts at the workspace's folder."""
        return _load(self._world, os.path.join(self.root, path))

    def compile(self, text: str, name: str | None = None) -> Module:
        """A module from text; it can import the workspace's modules."""
        return _compile(self._world, os.path.join(self.root, f"<{name or f'text {next(_texts)}'}>"), text)

    def reload(self) -> bool:
        """Read what has changed on disk; True if something had. Modules and functions that exist see the new texts."""
        return self._world.refresh()

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(Workspace, roots=self._world.files.roots[1:]), (self.root,)

    def __repr__(self) -> str:
        return f"potto.Workspace({display_name(self.root)!r})"


def load(path: str | os.PathLike[str]) -> Module:
    """The module in a file: `potto.load("renderer.po")`.

    Raises PottoError if nothing in it is without errors. If some of it is, `ProgramWarning` says what is not; using
    that raises PottoError.
    """
    return _load(World(["."]), os.fspath(path))


def compile(text: str, name: str | None = None) -> Module:
    """A module from text: `potto.compile("def f(t) integral [0, 1] [x < t] d(x)")`. Raises as `load` does."""
    return _compile(World(["."]), os.path.join(os.getcwd(), f"<{name or f'text {next(_texts)}'}>"), text)


def deriv(function: Function) -> Function:
    """The derivative: a function of duals `(value, tangent)`, which gives a dual."""
    must_be_function(function)
    return Function(function._world, function._file, _call_of("deriv", function._expr), derivative_type(function._type))


def must_be_function(function: object) -> None:
    """Raise PottoError for anything else."""
    if not isinstance(function, Function):
        raise wrong_call(f"a function of Potto is needed here, not a Python {type(function).__name__}")


def _load(world: World, path: str) -> Module:
    key = world.key(path)
    world.must_exist(key)
    return _module(world, key)


def _compile(world: World, key: str, text: str) -> Module:
    if not isinstance(text, str):
        raise wrong_call(f"a program is a str, not a Python {type(text).__name__}")
    return _module(world, world.own(key, text))


def _module(world: World, file: str) -> Module:
    complaint = store.complaint()
    if complaint is not None:
        warnings.warn(complaint, stacklevel=4)  # told once for each place that loads
    wrong = world.errors(file)
    if wrong:
        error = ProgramError(wrong, world.source)
        if not world.has_sound(file):
            raise error
        warnings.warn(ProgramWarning(f"a definition has an error, the others can be used{error}"), stacklevel=3)
    return Module(world, file)


class ProgramWarning(UserWarning):
    """A module is broken in part. What does not need the broken part can be used."""


class Module(Travelling):
    """The definitions of a file, as attributes."""

    def __init__(self, world: World, file: str) -> None:
        self._world = world
        self._file = file

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        target = resolve(self._world.db, self._file, name)
        if isinstance(target, DefinitionTarget):
            return _member(self._world, self._file, nodes.Name(NOWHERE, name))
        if isinstance(target, ModuleTarget):
            return Module(self._world, target.file)
        near = difflib.get_close_matches(name, names(self._world.db, self._file), 1)
        hint = f"; did you mean `{near[0]}`?" if near else ""
        raise AttributeError(f"{self!r} defines no `{name}`{hint}")

    def __dir__(self) -> list[str]:
        return sorted(names(self._world.db, self._file))

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Everything that `potto check` says about the file."""
        return tuple(located.diagnostic for located in self._world.diagnostics(self._file))

    def eval(self, expression: str) -> Estimate:
        """The value of an expression with the module's names in scope."""
        return self._world.evaluate(self._file, expression).estimate

    def __repr__(self) -> str:
        return f"<Potto module {display_name(self._file)}>"


def _member(world: World, file: str, expr: nodes.Expr) -> Any:
    """What a name stands for: a function, a list of what its items stand for, or an estimate."""
    world.need(file, expr)
    type = infer_expression(world.db, file, expr).type
    if isinstance(type, FunctionType | Diffeo):
        return Function(world, file, expr, type)
    return Call(world, file, expr, ()).run((), Batch(None))


def expression(module: Module, text: str) -> Any:
    """What an expression in a module's names stands for: a function, or an estimate. Raises PottoError."""
    return _member(module._world, module._file, module._world.parse(text))


class Function(Travelling):
    """A function of Potto, to be called with numbers, tuples, numpy arrays (which broadcast) and other functions.

    A call that gives all arguments of all groups is evaluated; one that gives the first groups only is a function of
    the others.
    """

    def __init__(
        self, world: World, file: str, expr: nodes.Expr, type: Type, given: Given = ()
    ) -> None:
        self._world = world
        self._file = file
        self._expr = expr
        self._type = type
        self._given = given
        self._calls: dict[Form, Call] = {}
        self._known: tuple[int, Value] | None = None
        self._derives: tuple[int, bool] | None = None
        self._groups: tuple[int, tuple[tuple[Parameter, ...], ...]] | None = None

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        given = (*self._given, (args, kwargs))
        rest = groups_of(self._type)[1:]
        if rest and (args or kwargs) and len(args) + len(kwargs) <= len(groups_of(self._type)[0]):
            assert isinstance(self._type, FunctionType)
            return Function(self._world, self._file, self._expr, self._type.result, given)
        return self._run(given)

    def _run(self, given: Given) -> Estimate:
        given = self._with_arrays(given)
        arguments, batch = self._arguments(given)
        if self._is_derivative():
            self._must_move(given)
        return in_tiles(self, given, (), arguments, batch)

    def in_tiles(self, args: tuple[Any, ...], kwargs: dict[str, Any], wrt: tuple[str, ...]) -> Estimate:
        """The estimate of a call with its derivatives by the parameters named; a large batch in tiles."""
        given = self._with_arrays((*self._given, (args, kwargs)))
        return in_tiles(self, given, wrt, *self._arguments(given))

    def prepared(
        self, args: tuple[Any, ...], kwargs: dict[str, Any], extra: Mapping[str, Any]
    ) -> tuple[Call, builtins.list[tuple[str, Value]], Batch]:
        """A call that is to be run: its arguments as values, and the batch that they make with `extra`."""
        given = self._with_arrays((*self._given, (args, kwargs)))
        return self._call(given), *self._arguments(given, extra)

    def _with_arrays(self, given: Given) -> Given:
        """What is given, with arrays of Python as arrays of Potto where parameters are such. Raises PottoError."""
        groups = groups_of(self._whole)
        if not any(has_arrays(parameter.type) for group in groups for parameter in group):
            return given
        sizes: dict[str, tuple[str, int]] = {}
        found = iter(
            argument if type is None else with_arrays(label, argument, type, sizes)
            for label, argument, type in _labelled(given, groups)
        )
        return tuple((tuple(next(found) for _ in args), {name: next(found) for name in words}) for args, words in given)

    def in_form(self, label: str, argument: Any, parameter: str | None) -> Any:
        """Something that goes with a parameter, or with the answer, with arrays where that has them."""
        groups = groups_of(self._whole)
        types = {p.name: p.type for group in groups for p in group}
        return with_arrays(label, argument, result_of(self._whole) if parameter is None else types[parameter], {})

    def _is_derivative(self) -> bool:
        """Whether this is the derivative of a function, whose arguments are all that moves."""
        revision = self._world.db.revision
        if self._derives is None or self._derives[0] != revision:
            self._derives = revision, is_derivative(self._world.db, self._file, self._expr)
        return self._derives[1]

    def _must_move(self, given: Given) -> None:
        """Raise PottoError if no argument has a tangent: whatever is evaluated, the derivative would be 0."""
        assert self._groups is not None
        if any(_carries(argument, type) for _, argument, type in _labelled(given, self._groups[1])):
            return
        first = self._groups[1][0][0].type
        single = isinstance(first, TupleOf) and not isinstance(first.items[0], TupleOf)  # else tangents of tangents
        text = moving(print_expression(self._expr), given) if single else ""
        help = f"write `{text}`" if text and len(text) <= LONGEST else GENERAL
        raise PottoError([replace(NO_TANGENT(NOWHERE, MOTIONLESS, help=help), severity="error")])

    def _call(self, given: Given) -> Call:
        form = tuple((len(args), tuple(words)) for args, words in given)
        if form not in self._calls:
            self._calls[form] = Call(self._world, self._file, self._expr, form)
        return self._calls[form]

    def _arguments(
        self, given: Given, extra: Mapping[str, Any] = NOTHING
    ) -> tuple[builtins.list[tuple[str, Value]], Batch]:
        """The arguments as values, under the names of their parameters. Raises PottoError for what does not fit."""
        revision = self._world.db.revision
        if self._groups is None or self._groups[0] != revision:
            self._groups = revision, groups_of(self._whole)
        labelled = _labelled(given, self._groups[1])
        for label, argument, type in labelled:
            complaint = None if type is None else misfit(label, argument, type, _type_of(argument))
            if complaint is not None:
                raise wrong_call(complaint)
        batch = batch_of([*((label, argument) for label, argument, _ in labelled), *extra.items()])
        return [(label, value_of(label, argument, batch, _function_value)) for label, argument, _ in labelled], batch

    def _value(self) -> Value:
        """The function as a value. Raises PottoError."""
        revision = self._world.db.revision
        if self._known is not None and self._known[0] == revision:
            return self._known[1]
        arguments, _ = self._arguments(self._given)
        value = self._call(self._given).value([value for _, value in arguments])
        if isinstance(value, Closure) and not value.captured:  # nothing in it was computed, under settings of its own
            self._known = revision, value
        return value

    @property
    def _whole(self) -> Type:
        """The type before any group was given."""
        return infer_expression(self._world.db, self._file, self._expr).type

    @property
    def type(self) -> str:
        """The type, as it is printed everywhere."""
        return format_type(self._type)

    @property
    def written(self) -> str:
        """The expression that it stands for, without the groups that are given."""
        return print_expression(self._expr)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters of all groups, those that are given already included; nameless ones are empty."""
        return tuple(parameter.name or "" for group in groups_of(self._whole) for parameter in group)

    @property
    def surfaces(self) -> tuple[str, ...]:
        """The conditions across which the function's value or integrand jumps, as Potto writes them."""
        from potto.checking.facts import surfaces

        return surfaces(self._world.db, self._file, self._expr)

    def __repr__(self) -> str:
        given = "".join(
            f"({', '.join([*map(repr, args), *(f'{name}={value!r}' for name, value in words.items())])})"
            for args, words in self._given
        )
        return f"<Potto function {print_expression(self._expr)}{given} : {self.type}>"


def _type_of(argument: Any) -> Type | None:
    """The type of an argument that is a function."""
    return argument._type if isinstance(argument, Function) else None


def _function_value(argument: Any) -> Value | None:
    return argument._value() if isinstance(argument, Function) else None


def _labelled(
    given: Given, groups: tuple[tuple[Parameter, ...], ...]
) -> builtins.list[tuple[str, Any, Type | None]]:
    """Every argument with the name of its parameter and the type of it, where these are known.

    Keywords bind by name; the others fill the parameters left, in order; a call may run over the end of its group.
    """
    found: list[tuple[str, Any, Type | None]] = []
    at = 0
    for args, kwargs in given:
        count = len(args) + len(kwargs)
        parameters: builtins.list[Parameter] = []
        while at < len(groups) and (not parameters or len(parameters) < count):
            parameters += groups[at]
            at += 1
        left = [p for p in parameters if p.name not in kwargs]
        spread = len(args) == 1 and len(left) > 1 and isinstance(args[0], tuple)  # one tuple for a whole group
        if spread and len(args[0]) != len(left):
            wanted = ", ".join(f"`{p.name}`" for p in left)
            raise wrong_call(f"a tuple of {len(args[0])} is given for {wanted}")
        unknown = len(parameters) - len(left) < len(kwargs)  # elaboration says which name is meant
        if len(args) < len(left) and not spread and not unknown:
            missing = ", ".join(f"`{p.name}`" for p in left[len(args) :])
            raise wrong_call(f"no value is given for {missing}")
        for place, argument in enumerate(args):
            known = left[place] if place < len(left) and not spread else None
            name = known.name if known is not None and known.name else f"argument {place + 1}"
            found.append((name, argument, known.type if known is not None else None))
        by_name = {p.name: p.type for p in parameters}
        found += [(name, argument, by_name.get(name)) for name, argument in kwargs.items()]
    return found


def _carries(argument: Any, type: Type | None) -> bool:
    """Whether an argument of a derivative has a tangent, or may have."""
    if isinstance(argument, tuple):  # of a group, if it is not known what for
        return type is not None or any(isinstance(item, tuple | list | Rows | Function) for item in argument)
    return type is None or isinstance(argument, list | Rows | Function)


def bound(function: Function, args: tuple[Any, ...], kwargs: dict[str, Any]) -> builtins.list[tuple[str, Any]]:
    """The arguments of a call under the names of their parameters. Raises PottoError if some are missing."""
    labelled = _labelled((*function._given, (args, kwargs)), groups_of(function._whole))
    return [(label, argument) for label, argument, _ in labelled]


def _call_of(name: str, argument: nodes.Expr) -> nodes.Expr:
    """`name(argument)` as a tree."""
    given = (nodes.Argument(NOWHERE, None, None, argument),)
    return nodes.Apply(NOWHERE, nodes.Name(NOWHERE, name), given, True)
