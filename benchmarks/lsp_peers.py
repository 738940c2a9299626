"""Type checkers of Python beside our server: a workspace of the same shape, asked the same.

Owns `peers` and `compare`. Which are there is looked up in a folder of programs: `pip install ty pyrefly basedpyright`.
"""

from __future__ import annotations

import math
import random
import statistics
import tempfile
from collections.abc import Iterator
from pathlib import Path
from queue import Empty

from lsp_client import OURS, Client
from lsp_typing import type_like_a_person
from lsp_workspace import LARGE, LINES, MODULES, imports_of, module_name

COMMANDS = {
    "ty": ("ty", "server"), "pyrefly": ("pyrefly", "lsp"), "pyright": ("pyright-langserver", "--stdio"),
    "basedpyright": ("basedpyright-langserver", "--stdio"),
}  # fmt: skip
COLUMNS = ("start", "open", "key", "key p95", "answers", "hover p99", "memory")


def definition(module: int, index: int, imported: list[str]) -> list[str]:
    """One definition of about seven lines, as `lsp_workspace` has them."""
    helper = (
        f" + f{index - 1}(t, k)" if index % 3 else f" + {imported[index % len(imported)]}(t, k)" if imported else ""
    )
    return [
        f"def f{index}(t: float, k: float) -> float:",
        f'    """f{index} of module {module}: what a reader wants to know before using it."""',
        f"    scale = sqrt(t**2 + {index + 1})",
        "    shift = k / scale",
        "    width = k if k > 0 else 1.0",
        f"    return scale * exp(-shift) * width{helper}",
        "",
    ]


def module_text(number: int, lines: int) -> str:
    """A module of at least so many lines."""
    written, imported = ["from math import exp, sqrt"], list[str]()
    for other in imports_of(number):
        written.append(f"from {module_name(other)} import f1 as g{other}")
        imported.append(f"g{other}")
    index = 0
    while len(written) < lines:
        written += ["", *definition(number, index, imported)]
        index += 1
    return "\n".join(written) + "\n"


def workspace() -> dict[str, str]:
    """The modules by name."""
    rest = (LINES - LARGE) // (MODULES - 1)
    sizes = {n: LARGE if module_name(n) == "large" else rest for n in range(MODULES)}
    return {module_name(n): module_text(n, lines) for n, lines in sizes.items()}


def peers(programs: Path) -> dict[str, tuple[str, ...]]:
    """The peers in a folder of programs, with their commands."""
    found = {name: (str(programs / first), *rest) for name, (first, *rest) in COMMANDS.items()}
    return {name: command for name, command in found.items() if Path(command[0]).is_file()}


def compare(ours: Path, texts: dict[str, str], programs: Path, rounds: int) -> Iterator[tuple[str, list[float]]]:
    """Of each server, ours first: what `COLUMNS` say, in ms and MB; nan where it does not tell."""
    yield "potto", measured(Client(ours, OURS), texts["large"], rounds)
    with tempfile.TemporaryDirectory(prefix="peers-") as name:
        written = workspace()
        for module, text in written.items():
            (Path(name) / f"{module}.py").write_text(text)
        for peer, command in peers(programs).items():
            try:
                yield peer, measured(Client(Path(name), command, "python", "py"), written["large"], rounds)
            except (Empty, OSError, ValueError):
                yield peer, [math.nan] * len(COLUMNS)


def measured(client: Client, text: str, rounds: int) -> list[float]:
    client.open("large", text)
    opened = client.diagnosed("large") - client.started
    client.quiet(3.0)
    told, answered = type_like_a_person(client, "large", text, rounds)
    lines, rng = text.split("\n"), random.Random(1)
    places = [(n, line.index("sqrt(")) for n, line in enumerate(lines) if "sqrt(" in line]
    hovers = []
    for _ in range(rounds * 20):
        line, column = rng.choice(places)
        place = {"textDocument": {"uri": client.uri("large")}, "position": {"line": line, "character": column + 1}}
        hovers.append(client.ask("textDocument/hover", place)[0])
    memory = client.memory()
    client.process.kill()
    found = [client.greeted, opened, middle(told), tail(told, 0.95), middle(answered), tail(hovers, 0.99)]
    return [*(seconds * 1e3 for seconds in found), memory]


def middle(times: list[float]) -> float:
    return statistics.median(times) if times else math.nan


def tail(times: list[float], part: float) -> float:
    return sorted(times)[min(int(part * len(times)), len(times) - 1)] if times else math.nan
