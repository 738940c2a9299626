"""`potto cache`: what Potto keeps on disk between runs."""

from __future__ import annotations

import argparse

from potto.cli.console import Console

SUMMARY = "where Potto keeps files between runs, how large they are"
EXAMPLE = "  potto cache --clear"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--clear", action="store_true", help="delete what is kept; it is made again when needed")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.syntax.tables import cache_folder

    folder = cache_folder()
    tables = sorted(path for path in folder.glob("grammar-*.json") if path.is_file()) if folder.is_dir() else []
    verdicts = sorted(path for path in folder.glob("checked-*/*.json") if path.is_file()) if folder.is_dir() else []
    files = tables + verdicts
    size = sum(path.stat().st_size for path in files)
    if options.clear:
        for path in files:
            path.unlink(missing_ok=True)
    if options.json:
        report = {"folder": str(folder), "files": len(files), "bytes": size, "cleared": options.clear}
        console.answer_json({**report, "kernels": "in memory only"})
        return 0
    console.answer(f"folder:   {folder}")
    count = f"{len(files)} file{'' if len(files) == 1 else 's'}, {size / 1024:.1f} KiB"
    console.answer(f"contents: parse tables, and what was said about files that an editor had open; {count}")
    console.answer("kernels:  kept in memory only, while a process runs")
    if options.clear:
        console.answer("cleared")
    return 0
