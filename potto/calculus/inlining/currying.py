"""Curried functions and their calls: which parameter gets which argument, group by group.

Owns `uncurry` and `arguments_of`. A group fits its parameters also as one tuple for several of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.core.terms import Lam, Term, app, fresh, proj, rename_bound, tuple_, var


def uncurry(function: Lam, sizes: Sequence[int]) -> tuple[tuple[str, ...], Term]:
    """The parameters and the body that groups of so many arguments reach.

    Of a function whose result is a function under another form (`def apply(p, x) p(x)`, given a curried `p`) the body
    is that result, called with further parameters: else nobody would see what it does with them.
    """
    params, body = function.params, function.body
    for size in sizes[1:]:
        if not isinstance(body, Lam):
            more = _further(size, {*params, *body.free})
            params, body = params + more, app(body, tuple(map(var, more)))
            continue
        clash = set(params) & set(body.params)
        if clash:
            names: dict[str, str] = {}
            for name in clash:
                names[name] = fresh(name, {*params, *body.params, *body.free, *names.values()})
            body = rename_bound(body, names)
            assert isinstance(body, Lam)
        params, body = params + body.params, body.body
    return params, body


def _further(size: int, taken: set[str]) -> tuple[str, ...]:
    names: list[str] = []
    for _ in range(size):
        names.append(fresh("given", taken | set(names)))
    return tuple(names)


def groups_of(function: Term | None) -> int:
    """How many groups of parameters a function has itself."""
    count = 0
    while isinstance(function, Lam):
        count, function = count + 1, function.body
    return count


def fitted(args: tuple[Term, ...], arity: int) -> tuple[Term, ...]:
    """A group of arguments as the parameters take it: one tuple for several parameters, or several for one."""
    if len(args) == 1 and arity > 1:
        return tuple(proj(args[0], i) for i in range(arity))
    if arity == 1 and len(args) > 1:
        return (tuple_(args),)
    return args


def arguments_of(function: Lam, groups: tuple[tuple[Term, ...], ...]) -> tuple[Term, ...]:
    """The arguments of all groups, each group as the parameters that `uncurry` gives take it."""
    args: list[Term] = []
    shape: Term = function
    for group in groups:
        if isinstance(shape, Lam):
            args.extend(fitted(group, len(shape.params)))
            shape = shape.body
        else:
            args.extend(group)
    return tuple(args)


def sizes_of(groups: Sequence[Sequence[object]]) -> tuple[int, ...]:
    """How many arguments each group has."""
    return tuple(map(len, groups))


def parameters_of(function: Term) -> list[str]:
    """The names of the parameters of all groups."""
    names: list[str] = []
    while isinstance(function, Lam):
        names += function.params
        function = function.body
    return names
