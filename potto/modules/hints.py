"""What the user may have meant: names of other languages, near modules, and modules that define a name."""

from __future__ import annotations

import os.path
from collections.abc import Iterable

from potto.modules.builtins import is_builtin
from potto.modules.lookup import SUFFIXES, folders
from potto.modules.workspace import definers, module_name
from potto.query import Database
from potto.reports.near import near_names

_ELSEWHERE = {
    "ln": "the natural logarithm is `log`",
    "e": "the exponential is `exp(x)`, and `e` is `exp(1)`",
    "log2": "write `log(x)/log(2)`",
    "log10": "write `log(x)/log(10)`",
    "arcsin": "write `asin`",
    "arccos": "write `acos`",
    "arctan": "write `atan`",
    "arctan2": "write `atan2`",
    "fabs": "write `abs`",
    "power": "write `x^y`",
    "sgn": "write `sign`; what varies with a variable of integration jumps in brackets, `2*[x > 0] - 1`",
    "heaviside": "write the jump in brackets: `[x > 0]`",
    "Heaviside": "write the jump in brackets: `[x > 0]`",
    "round": "the nearest whole number is `floor(x + 0.5)`",
    "clip": "write `clamp(x, lo, hi)`",
    "relu": "write `max(x, 0)`",
    "sigmoid": "write `1/(1 + exp(-x))`",
    "expit": "write `1/(1 + exp(-x))`",
    "softplus": "write `log1p(exp(x))`",
    "factorial": "n! is `gamma(n + 1)`",
    "where": "write `if p then a else b`, and what jumps where a variable of integration says in brackets, `[x > t]`",
    "mod": "Potto has no remainder; `x - floor(x/n)*n` is one",
    "π": "write `pi`",
    "Pi": "write `pi`",
    "PI": "write `pi`",
    "∞": "write `inf`",
    "infinity": "write `inf`",
    "True": "a comparison in brackets is 1 or 0; write `1`",
    "true": "a comparison in brackets is 1 or 0; write `1`",
    "False": "a comparison in brackets is 1 or 0; write `0`",
    "false": "a comparison in brackets is 1 or 0; write `0`",
    "None": "every expression has a value; leave it out",
    "null": "every expression has a value; leave it out",
    "range": "write a range, `0..n-1`, as in `[i^2 for i in 0..n-1]` and `sum i in 0..n-1 (…)`",
    "linspace": "write out what each is: `[lo + (hi - lo)*i/(n - 1) for i in 0..n-1]`",
    "arange": "write a range, `0..n-1`, as in `[i^2 for i in 0..n-1]`",
    "zeros": "write `[0 for i in 0..n-1]`",
    "ones": "write `[1 for i in 0..n-1]`",
    "map": "write `[f(x) for x in xs]`",
    "filter": "leave out what is not meant in a sum: `sum x in xs (if x > 0 then x else 0)`",
    "reduce": "write `fold s = 0 for x in xs (s + x)`",
    "mean": "write `(sum x in xs (x))/len(xs)`",
    "average": "write `(sum x in xs (x))/len(xs)`",
    "length": "write `len(xs)`",
    "size": "write `len(xs)`",
    "shape": "write `len(xs)`, and `len(xs[0])` for a row",
    "append": "an array has its size for good: write all of it, `[… for i in 0..n-1]`",
    "sum": "write `sum x in xs (x)`",
    "product": "write `product x in xs (x)`",
    "prod": "write `product x in xs (x)`",
    "read": 'write `load("data.csv")`',
    "open": 'write `load("data.csv")`',
    "read_csv": 'write `load("data.csv")`',
    "loadtxt": 'write `load("data.csv")`',
    "integrate": "write `integral [lo, hi] body d(x)`",
    "int": "write `integral [lo, hi] body d(x)`",
    "quad": "write `integral [lo, hi] body d(x)`",
    "diff": "the derivative is `D(f)(x)`, and that by one parameter `D(f, x)`",
    "derivative": "the derivative is `D(f)(x)`, and that by one parameter `D(f, x)`",
    "gradient": "all derivatives of a number are `grad(f)`",
    "jacobian": "the derivative of all of it by one parameter is `D(f, x)`",
    "hessian": "a second derivative is `D(D(f, x), y)`; all of them are `potto.hessian(f)` from Python",
    "dirac": "write `delta`",
    "return": "the last line of a definition is its result, without `return`",
    "lambda": "a function without a name is written `\\x . e`",
    "elif": "write `else if`",
}
"""What is called otherwise in other languages, and how it is written here."""

_CALLED = {
    "ln": "log", "arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2", "fabs": "abs", "sgn": "sign",
    "clip": "clamp", "gradient": "grad",
    "π": "pi", "Pi": "pi", "PI": "pi", "∞": "inf", "infinity": "inf", "True": "1", "true": "1", "False": "0",
    "false": "0", "dirac": "delta",
}  # fmt: skip
"""What can be written as it stands in place of a name from another language."""

MARKS = ("potto.toml", ".git", "pyproject.toml")  # of the folder of a project

_LIBRARIES = frozenset({"math", "cmath", "numpy", "np", "scipy", "sympy", "jax", "jnp", "torch", "random", "maths"})


def known_elsewhere(name: str) -> str:
    """How to write what another language calls `name`; nothing if it is not known."""
    return _ELSEWHERE.get(name, "")


def called_here(name: str) -> tuple[str, ...]:
    """What another language's name is called here, if it is one name for another."""
    return (_CALLED[name],) if name in _CALLED else ()


def library_hint(module: str, names: Iterable[str] = ()) -> str:
    """What is said of a module that is one of Python, or is only asked for builtins."""
    builtins = [name for name in names if is_builtin(name)]
    if builtins:
        return f"`{builtins[0]}` is a builtin: it needs no import"
    if module.partition(".")[0] in _LIBRARIES:
        return "modules of Python can't be imported; builtins such as `sqrt` and `pi` need no import"
    return ""


def near_modules(db: Database, file: str, dotted: str) -> tuple[str, ...]:
    """The modules, as they would be written in `file`, that `dotted` may have been meant to be."""
    package, _, _ = dotted.rpartition(".")
    candidates: dict[str, None] = {}
    for folder in folders(db, file):
        for place in dict.fromkeys((package, "")):
            prefix = f"{place}." if place else ""
            for name in _listed(db, folder, place):
                module = prefix + os.path.splitext(name.rstrip("/"))[0]
                if name.endswith("/"):
                    candidates.update(dict.fromkeys(_modules_in(db, folder, module)))
                else:
                    candidates[module] = None
    leaf = dotted.rpartition(".")[2]
    same = [module for module in candidates if module != dotted and module.rpartition(".")[2] == leaf]
    return tuple(same[:2]) or near_names(dotted, candidates)


def _modules_in(db: Database, folder: str, package: str) -> list[str]:
    listed = _listed(db, folder, package)
    return [f"{package}.{os.path.splitext(name)[0]}" for name in listed if name.endswith(SUFFIXES)]


def _listed(db: Database, folder: str, package: str) -> tuple[str, ...]:
    """What is in the folder of a package."""
    inner = os.path.normpath(os.path.join(folder, package.replace(".", "/")))
    found: tuple[str, ...] = db.get_input(("folder", inner), ())
    return found


def looked_in(db: Database, file: str, dotted: str) -> tuple[str, ...]:
    """A note on where a module was looked for."""
    path = dotted.replace(".", "/")
    wanted = " or ".join(f"`{path}{suffix}`" for suffix in SUFFIXES)
    places = folders(db, file)
    if not places:
        return (f"there is no folder in which to look for {wanted}",)
    return (f"looked for {wanted} in {', '.join(places)}",)


def elsewhere(db: Database, file: str, name: str) -> str | None:
    """A module that defines a name, as it would be written in `file`: one of the same project, or where there is none,
    one beside the file or in a folder beside it."""
    place = file if os.path.isabs(file) else os.path.join(*folders(db, file)[:1], file)
    inside = (other for other in definers(db, name) if other != file and _together(place, other))
    found = (module_name(db, file, other) for other in inside)
    return next((module for module in found if module is not None), None)


def _together(file: str, other: str) -> bool:
    own = _project(file)
    if own is not None or _project(other) is not None:
        return _project(other) == own
    here, there = os.path.dirname(file), os.path.dirname(other)
    return here in (there, os.path.dirname(there))


def _project(file: str) -> str | None:
    """The folder of the project that a file is in: the nearest with a mark of one; None where there is none above."""
    folder = os.path.dirname(file)
    while not any(os.path.exists(os.path.join(folder, mark)) for mark in MARKS):
        above = os.path.dirname(folder)
        if above == folder or not folder:
            return None
        folder = above
    return folder
