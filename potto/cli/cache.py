"""`potto cache`: what Potto keeps on disk between runs."""

from __future__ import annotations

import argparse

from potto.cli.console import Console

SUMMARY = "what Potto keeps on disk between runs: where, of which kinds, how much; --clear"
EXAMPLE = "  potto cache --clear"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--clear", action="store_true", help="delete what is kept; it is made again when needed")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto import store

    report = store.report()
    kinds = {kind.name: (kind.entries, kind.size) for kind in report.kinds}
    if options.clear:
        store.clear()
    count, size = sum(kind.entries for kind in report.kinds), report.size
    if options.json:
        console.answer_json({
            "folder": None if report.folder is None else str(report.folder), "files": count, "bytes": size,
            "bound": report.bound, "kinds": {name: {"files": n, "bytes": b} for name, (n, b) in kinds.items()},
            "refused": report.complaint, "cleared": options.clear,
        })  # fmt: skip
        return 0
    if report.folder is None:
        console.answer("turned off: POTTO_CACHE is `off`")
        return 0
    console.answer(f"folder: {report.folder}  (POTTO_CACHE; `off` keeps nothing)")
    for name, (n, b) in {**kinds, "in all": (count, size)}.items():
        console.answer(f"  {name:<14} {n:>7,} file{' ' if n == 1 else 's'} {b / 1e6:>10,.3f} MB")
    console.answer(f"at most {report.bound / 1e6:,.0f} MB  (POTTO_CACHE_MB)")
    if report.complaint and store.refused() is None:  # which is told of every command
        console.answer(report.complaint)
    if options.clear:
        console.answer("cleared")
    return 0
