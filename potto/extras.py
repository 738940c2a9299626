"""How to install what Potto does not need for itself.

Owns `install_command`. A message names the libraries of an extra, which `pip` installs from any folder, whether
Potto was installed from a clone, for work on it, or as a wheel. Pages name the extra: `pip install '.[jit]'`.
"""

from __future__ import annotations

import re


def install_command(extra: str) -> str:
    """What to type for an extra of `pyproject.toml`, such as `jit`: `pip install 'llvmlite>=0.45,<1'`."""
    needed = _requirements(extra)
    return "pip install " + " ".join(f"'{one}'" for one in needed) if needed else f"pip install '.[{extra}]'"


def _requirements(extra: str) -> list[str]:
    """The libraries of an extra, by what is recorded beside the installed package; none where nothing is."""
    from importlib.metadata import PackageNotFoundError, requires  # takes its time to load, and hardly anybody asks

    try:
        recorded = requires("potto") or []
    except PackageNotFoundError:
        return []
    pairs = [line.partition(";") for line in recorded]
    return [_tidy(name) for name, _, marker in pairs if marker.replace('"', "'").strip() == f"extra == '{extra}'"]


def _tidy(requirement: str) -> str:
    """As people write it: the least version first."""
    bare = requirement.replace(" ", "")
    name = re.split("[<>=!~]", bare)[0]
    return name + ",".join(sorted(bare[len(name) :].split(","), reverse=True))
