"""The floors of the house: a module imports only from its own floor and the floors below."""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# From the top floor down. Packages on one floor may import each other unless they are listed as strangers.
FLOORS: tuple[tuple[str, ...], ...] = (
    ("potto_lsp", "potto_repl", "potto.__main__", "potto.cli"),
    ("potto.ide", "potto.evaluating", "potto.python", "potto.applications", "potto.bench", "potto.bridges"),
    ("potto.runtime",),
    ("potto.kernels", "potto.integrate"),
    ("potto.checking", "potto.crew"),
    ("potto.calculus",),
    ("potto.elaborate",),
    ("potto.types",),
    ("potto.modules", "potto.diffeos", "potto.measures"),
    ("potto.syntax", "potto.core", "potto.primitives"),
    ("potto.reports", "potto.projects", "potto.data"),
    ("potto.source", "potto.diagnostics", "potto.query", "potto.store", "potto.extras", "potto.digests"),
)
# What a package must not import although its floor would let it.
FORBIDDEN: dict[str, tuple[str, ...]] = {
    "potto.syntax": ("potto.core",),
    "potto.core": ("potto.syntax",),
    "potto.primitives": ("potto.syntax",),
    "potto.ide": ("potto.kernels", "potto.integrate", "potto.runtime", "potto.python", "potto.evaluating"),
    "potto.data": ("potto.reports", "potto.projects"),
}
# Who may import a package that is not ours; nobody else may, at the top of a module or inside of a function.
OUTSIDERS: dict[str, tuple[str, ...]] = {
    "lark": ("potto.syntax",),
    "numpy": (
        "potto.kernels",
        "potto.integrate",
        "potto.runtime",
        "potto.python.accepting",
        "potto.python.arguments",
        "potto.python.arrays",
        "potto.python.derivative_forms",
        "potto.python.hessian",
        "potto.python.derived_calls",
        "potto.python.sided",
        "potto.applications",
        "potto.bench",
        "potto.bridges",
        "potto.data",
        "potto_lsp.preview",
        "potto_lsp.sampling",
    ),
    "PIL": ("potto.data", "potto.applications.picture_files", "potto.applications.animations"),
    "OpenEXR": ("potto.applications.picture_files",),
    "imageio_ffmpeg": ("potto.applications.animations",),
    "scipy": ("potto.kernels", "potto.integrate", "potto.runtime", "potto.applications.minimizing", "potto.bench"),
    "jax": ("potto.bench.peers", "potto.bridges.to_jax"),
    "torch": ("potto.bridges.to_torch",),
    "vegas": ("potto.bench.peers",),
    "matplotlib": ("potto.bench.plotting", "potto.applications.figures"),
    "mpmath": ("potto.core.reference",),
    "pygls": ("potto_lsp",),
    "lsprotocol": ("potto_lsp",),
    "prompt_toolkit": ("potto_repl",),
    "llvmlite": ("potto.kernels",),
    "ipywidgets": ("potto_repl.sliders",),
}


def _files() -> Iterator[tuple[str, Path]]:
    for folder, package in (("potto", "potto"), ("lsp/potto_lsp", "potto_lsp"), ("repl/potto_repl", "potto_repl")):
        for path in sorted((ROOT / folder).rglob("*.py")):
            parts = (package, *path.relative_to(ROOT / folder).with_suffix("").parts)
            yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


MODULES = dict(_files())


@functools.cache
def _tree(module: str) -> ast.Module:
    return ast.parse(MODULES[module].read_text(encoding="utf-8"))


def _floor(module: str) -> int | None:
    """The floor of a module, counted from the top; None for the package `potto` itself."""
    for number, names in enumerate(FLOORS):
        if any(_inside(module, name) for name in names):
            return number
    return None


def _inside(module: str, package: str) -> bool:
    return module == package or module.startswith(package + ".")


@functools.cache
def _imports(module: str) -> tuple[tuple[str, int], ...]:
    return tuple(_imports_of(module, MODULES[module], _tree(module)))


def _imports_of(module: str, path: Path, tree: ast.Module) -> list[tuple[str, int]]:
    """Every module that a file imports anywhere, also inside of functions; what only type checkers see is left out."""
    skipped = {id(inner) for node in ast.walk(tree) if _typing_only(node) for inner in ast.walk(node)}
    found: list[tuple[str, int]] = []
    for node in ast.walk(tree):
        if id(node) in skipped and not isinstance(node, ast.If):
            continue
        if isinstance(node, ast.Import):
            found += ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = _absolute(module, path, node)
            for alias in node.names:
                full = f"{base}.{alias.name}"
                found.append((full if full in MODULES else base, node.lineno))
    return found


def _absolute(module: str, path: Path, node: ast.ImportFrom) -> str:
    if not node.level:
        return node.module or ""
    package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    return ".".join([*package[: len(package) - node.level + 1], *([node.module] if node.module else [])])


def _typing_only(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def _upwards(module: str) -> Iterator[str]:
    """What a module imports that it must not."""
    here = _floor(module)
    if module == "potto":  # loads its names when they are used
        return
    if here is None:
        yield f"{module} stands on no floor: add it to FLOORS"
        return
    for target, line in _imports(module):
        there = _floor(target)
        if there is None:
            continue
        where = f"{MODULES[module]}:{line}"
        if there < here:
            yield f"{where}: {module} imports {target} from a floor above"
        for package, forbidden in FORBIDDEN.items():
            if _inside(module, package) and any(_inside(target, name) for name in forbidden):
                yield f"{where}: {module} must not know {target}"


def test_modules_import_only_downwards() -> None:
    assert len(MODULES) > 400
    assert not [wrong for module in MODULES for wrong in _upwards(module)]


def test_imports_are_seen_wherever_they_stand() -> None:
    """At the top, in functions, and relative ones; not those for type checkers alone."""
    text = """
import lark
def f():
    from potto.cli import run
    from ..core import terms
if TYPE_CHECKING:
    import numpy
"""
    found = _imports_of("potto.syntax.made_up", Path("made_up.py"), ast.parse(text))
    assert sorted(found) == [("lark", 2), ("potto.cli.run", 4), ("potto.core.terms", 5)]


@functools.cache
def _neighbours(module: str) -> frozenset[str]:
    """The modules that a module imports, inside of functions and for types alone, too."""
    found = set()
    for node in ast.walk(_tree(module)):
        for alias in node.names if isinstance(node, ast.ImportFrom) and node.module else ():
            full = f"{node.module}.{alias.name}"
            target = full if full in MODULES else node.module
            if target in MODULES:
                found.add(target)
    return frozenset(found)


def _reached(module: str) -> set[str]:
    """What a module leads to by any import."""
    seen: set[str] = set()
    todo = [module]
    while todo:
        for target in _neighbours(todo.pop()) - seen:
            seen.add(target)
            todo.append(target)
    return seen


def test_there_are_no_import_circles() -> None:
    assert len(MODULES) > 500
    assert not [module for module in MODULES if module in _reached(module)]


def test_only_its_owner_imports_a_library() -> None:
    wrong = [
        f"{MODULES[module]}:{line}: {module} may not import {target}"
        for module in MODULES
        for target, line in _imports(module)
        if (owners := OUTSIDERS.get(target.split(".")[0])) is not None
        and not any(_inside(module, owner) for owner in owners)
    ]
    assert not wrong


def test_a_module_says_what_it_owns() -> None:
    assert not [module for module in MODULES if not ast.get_docstring(_tree(module))]


def test_a_module_defines_what_it_owns() -> None:
    wrong = []
    for module in MODULES:
        tree = _tree(module)
        told = re.search(r"\bOwns ((?:`\w+`(?:, and |, | and )?)+)", ast.get_docstring(tree) or "")
        found = [getattr(node, "name", getattr(node, "id", "")) for node in ast.walk(tree)]
        wrong += [(module, name) for name in re.findall(r"`(\w+)`", told[1] if told else "") if name not in found]
    assert not wrong


def test_the_front_end_starts_without_numpy() -> None:
    """What the editor needs, checking included, must not load numpy even by accident."""
    import subprocess
    import sys

    code = "import sys, potto.checking.check, potto.reports.render; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


def test_every_file_is_small_enough_to_read() -> None:
    for module, path in MODULES.items():
        lines = path.read_text(encoding="utf-8").count("\n")
        assert lines <= 400, f"{module} has {lines} lines"
