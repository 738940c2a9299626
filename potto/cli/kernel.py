"""`potto kernel`: Potto in Jupyter notebooks."""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import json
import os
import sys
from pathlib import Path

from potto.cli.console import Console
from potto.extras import install_command

SUMMARY = "make Potto known to Jupyter, as a kernel for notebooks"
EXAMPLE = "  potto kernel install"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("action", choices=("install", "remove", "where"), help="install, remove, or say where it is")
    parser.add_argument("--prefix", metavar="FOLDER", help="an environment to install into; the user's folder without")
    parser.add_argument("--sys-prefix", dest="prefix", action="store_const", const=sys.prefix,
                        help="the environment that Potto is installed in")  # fmt: skip


def run(options: argparse.Namespace, console: Console) -> int:
    folder = _folder(options.prefix)
    place = folder / "kernel.json"
    if options.action == "install":
        if importlib.util.find_spec("ipykernel") is None:
            console.complain(f"potto kernel: ipykernel is not installed\ntry `{install_command('jupyter')}`")
            return 1
        folder.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, "-P", "-m", "potto_repl.kernel", "-f", "{connection_file}"]
        spec = {"argv": command, "display_name": "Potto", "language": "potto", "interrupt_mode": "signal"}
        place.write_text(json.dumps(spec, indent=1) + "\n", encoding="utf-8")
    elif options.action == "remove":
        place.unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # what else somebody has put there stays
            folder.rmdir()
    if options.json:
        console.answer_json({"folder": str(folder), "installed": place.is_file()})
    else:
        console.answer(f"{folder}{'' if place.is_file() else ' (not installed)'}")
    return 0


def _folder(prefix: str | None) -> Path:
    """Where Jupyter looks for the kernel."""
    if prefix is not None:
        return Path(prefix) / "share" / "jupyter" / "kernels" / "potto"
    named = os.environ.get("JUPYTER_DATA_DIR")
    if named:
        return Path(named) / "kernels" / "potto"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Jupyter" / "kernels" / "potto"
    base = os.environ.get("XDG_DATA_HOME") or os.path.expanduser("~/.local/share")
    return Path(base) / "jupyter" / "kernels" / "potto"
