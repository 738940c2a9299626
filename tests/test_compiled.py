"""What is compiled while a wheel is built is what the compiler can do: seen here, where nothing is compiled."""

from __future__ import annotations

import ast
import importlib
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
WHEEL = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
HOOK = WHEEL["hooks"]["custom"]


def named(patterns: list[str]) -> set[Path]:
    return {path for pattern in patterns for folder in (".", "lsp", "repl") for path in (ROOT / folder).glob(pattern)}


COMPILED = sorted(named(HOOK["compiled"]) - named(HOOK["interpreted"]))
INTERPRETED = sorted(
    path
    for folder in ("potto", "lsp/potto_lsp", "repl/potto_repl")
    for path in (ROOT / folder).rglob("*.py")
    if path not in COMPILED and path.stem not in ("__main__", "kernel", "peers", "plotting")
)


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts if parts[0] == "potto" else parts[1:]).removesuffix(".__init__")


NAMES = {module_of(path) for path in COMPILED}


@pytest.mark.parametrize("path", COMPILED, ids=module_of)
def test_frozen_values_can_be_pickled_as_machine_code(path: Path) -> None:
    """`quick` teaches them that; it is called with all of them, or with all classes of a module."""
    tree = ast.parse(path.read_text())
    calls = [n for n in tree.body if isinstance(n, ast.Expr) and ast.unparse(n.value).startswith("quick(")]
    told = {name.id for call in calls for name in ast.walk(call) if isinstance(name, ast.Name)}
    frozen = {
        node.name
        for node in tree.body
        if isinstance(node, ast.ClassDef)
        if {"dataclass(frozen=True, slots=True)", "value"} & set(map(ast.unparse, node.decorator_list))
    }
    assert "globals" in told or frozen <= told


@pytest.mark.parametrize("path", INTERPRETED, ids=module_of)
def test_the_interpreter_inherits_from_no_machine_code(path: Path) -> None:
    module = importlib.import_module(module_of(path))
    for kind in vars(module).values():
        if isinstance(kind, type) and kind.__module__ == module.__name__:
            assert not {base.__module__ for base in kind.__mro__[1:]} & NAMES, kind


def test_what_the_list_names_is_there() -> None:
    assert len(COMPILED) > 60
    for pattern in (*HOOK["compiled"], *HOOK["interpreted"]):
        assert named([pattern]), pattern
