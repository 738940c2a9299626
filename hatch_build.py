"""Compiles the front end to machine code while a wheel is built: `HATCH_BUILD_HOOKS_ENABLE=1 pip install .`

Owns the hook that `pyproject.toml` names, with the list of modules beside it. mypyc makes an extension of each module
and puts it next to its source, so that the same package works with and without; only the time differs. Wheels without
it are pure Python, and so are editable installations: machine code of an older text would hide the text.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# What runs where the packages lie side by side as they are installed, without a project that setuptools could look at.
SETUP = """
from mypyc.build import mypycify
from setuptools import setup

compiled = mypycify({modules}, opt_level="2", debug_level="0", multi_file=True)
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
        for package in self.build_config.packages:
            shutil.copytree(Path(self.root, package), self._folder / Path(package).name)
        (self._folder / "setup.py").write_text(SETUP.format(modules=self._modules()))
        (self._folder / "mypy.ini").write_text(MYPY)
        command = [sys.executable, "setup.py", "build_ext", "--inplace"]
        done = subprocess.run(command, cwd=self._folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if done.returncode:
            raise RuntimeError(f"the front end could not be compiled:\n{done.stdout[-4000:]}")
        for suffix in ("so", "pyd"):
            for made in self._folder.rglob(f"*.{suffix}"):
                path = made.relative_to(self._folder)
                if path.parts[0] != "build":
                    build_data["force_include"][str(made)] = str(path)
        build_data["pure_python"], build_data["infer_tag"] = False, True

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        if version != "editable":
            shutil.rmtree(self._folder)

    def _modules(self) -> list[str]:
        """The modules to compile: those of `compiled` but not of `interpreted`."""
        found = {path for pattern in self.config["compiled"] for path in self._folder.glob(pattern)}
        found -= {path for pattern in self.config["interpreted"] for path in self._folder.glob(pattern)}
        return sorted(str(path.relative_to(self._folder)) for path in found)
