"""Compiles the front end to machine code while a wheel is built: `HATCH_BUILD_HOOKS_ENABLE=1 pip install .`

Owns the hook that `pyproject.toml` names, with the list of modules beside it. mypyc makes an extension of each module
and puts it next to its source, so that the same package works with and without; only the time differs. Wheels without
it are pure Python, and so are editable installations: machine code of an older text would hide the text. With
`MYPYC_OPT_LEVEL=0` the C compiler takes half the time, and what it makes is slower.

What is a `value` becomes a dataclass, which mypyc knows, but for its `__init__`, which it leaves to the interpreter.
Those are written out for it, which makes values in a tenth of the time; the other methods they are given behind their
class by `potto.quick.machine`, in a fraction of the time that `dataclass` takes to write them. No line moves, so that
tracebacks still name the right ones.
"""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

VALUE = "dataclass(init=False, repr=False, eq=False)"
# What runs where the packages lie side by side as they are installed, without a project that setuptools could look at.
SETUP = """
from mypyc.build import mypycify
from setuptools import setup

compiled = mypycify({modules}, opt_level={optimized!r}, debug_level="0", multi_file=True)
setup(name="potto", packages=[], ext_modules=compiled)
"""
# Types are checked elsewhere, with all that is imported; here nothing but the hook's own dependencies is to be had.
MYPY = """
[mypy]
ignore_missing_imports = True
follow_imports = silent
"""


class FrontEndHook(BuildHookInterface[Any]):
    """Adds what it compiles to the wheel. Raises RuntimeError with the compiler's words if that fails."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            return
        self._folder = Path(tempfile.mkdtemp())
        try:
            made = self._compiled()
        except BaseException:
            shutil.rmtree(self._folder)
            raise
        build_data["force_include"] |= {str(path): str(path.relative_to(self._folder)) for path in made}
        build_data["pure_python"], build_data["infer_tag"] = False, True

    def _compiled(self) -> list[Path]:
        """The extensions, each in its package."""
        for package in self.build_config.packages:
            shutil.copytree(Path(self.root, package), self._folder / Path(package).name)
        for module in self._modules():
            path = self._folder / module
            path.write_text(with_inits(path.read_text("utf-8")), "utf-8")
        level = os.environ.get("MYPYC_OPT_LEVEL", "2")
        (self._folder / "setup.py").write_text(SETUP.format(modules=self._modules(), optimized=level))
        (self._folder / "mypy.ini").write_text(MYPY)
        command = [sys.executable, "setup.py", "build_ext", "--inplace"]
        done = subprocess.run(command, cwd=self._folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if done.returncode:
            raise RuntimeError(f"the front end could not be compiled:\n{done.stdout[-4000:]}")
        shutil.rmtree(self._folder / "build")
        return [path for path in self._folder.rglob("*") if path.suffix in (".so", ".pyd")]

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        if version != "editable":
            shutil.rmtree(self._folder)

    def _modules(self) -> list[str]:
        """The modules to compile: those of `compiled` but not of `interpreted`."""
        found = {path for pattern in self.config["compiled"] for path in self._folder.glob(pattern)}
        found -= {path for pattern in self.config["interpreted"] for path in self._folder.glob(pattern)}
        return sorted(str(path.relative_to(self._folder)) for path in found)


def with_inits(text: str) -> str:
    """A module whose dataclasses write out their `__init__`, as far as it does no more than take the fields, and whose
    values are dataclasses."""
    known = "from dataclasses import dataclass; from potto.quick import machine; from potto.quick import"
    text = text.replace("\nfrom potto.quick import", f"\n{known}")
    lines = text.replace("\n@value\n", f"\n@{VALUE}\n").split("\n")
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef):
            _write_init(node, lines)
            if "value" in map(ast.unparse, node.decorator_list):
                lines[(node.end_lineno or 0) + 1] = f"machine({node.name})"  # the second of two empty ones
    return "\n".join(lines)


def _write_init(node: ast.ClassDef, lines: list[str]) -> None:
    """Write it into the empty line behind the fields."""
    fields = [statement for statement in node.body if isinstance(statement, ast.AnnAssign)]
    own = {statement.name for statement in node.body if isinstance(statement, ast.FunctionDef)}
    dataclass = next((d for d in node.decorator_list if ast.unparse(d).startswith(("dataclass(", "value"))), None)
    more = node.bases or own & {"__init__", "__post_init__"} or any("field(" in ast.unparse(field) for field in fields)
    if dataclass is None or not fields or more:
        return
    place = fields[-1].end_lineno or 0
    if place < len(lines) and not lines[place].strip():
        names = [ast.unparse(field.target) for field in fields]
        head = ", ".join(ast.unparse(field) for field in fields)
        body = "; ".join(f"self.{name} = {name}" for name in names)
        lines[place] = f"    def __init__(self, {head}) -> None: {body}  # type: ignore"
        line = dataclass.lineno - 1
        if "init=" not in lines[line]:
            lines[line] = lines[line].replace("dataclass(", "dataclass(init=False, ", 1)
