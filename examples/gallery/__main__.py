"""The gallery: pictures of the examples with their times and errors, made in one run.

`python examples/gallery [--quick] [--workers N] [--out FOLDER] [FOLDER…]`. What is shown stands in a table beside the
programs, `examples/*/gallery.toml`; `tables` says how one is written. Each processor makes one entry after the other.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from besides import besides
from made import make
from pages import Section, contact_sheet, index
from tables import Chapter, TableError, chapters

from potto.python.workers import Workers

HERE = Path(__file__).resolve().parent
TARGET = HERE.parents[1] / "docs" / "gallery"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="gallery", description="pictures of the examples, with times and errors")
    parser.add_argument("folders", nargs="*", metavar="FOLDER", help="which of examples/ (default: all with a table)")
    parser.add_argument("--out", type=Path, default=TARGET, help="where the pages go (default: docs/gallery)")
    parser.add_argument("--quick", action="store_true", help="small pictures and few points, to see that all runs")
    parser.add_argument("--workers", metavar="N", type=int, help="processes (default: as many as there are processors)")
    parser.add_argument("--root", type=Path, default=HERE.parent, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    try:
        found = chapters(options.root, options.folders)
    except TableError as error:
        print(f"gallery: {error}", file=sys.stderr)
        return 2
    options.out.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    made = entries_made(found, options)
    seconds = time.perf_counter() - start
    (options.out / "index.html").write_text(index(made, options.out, seconds), encoding="utf-8")
    (options.out / "contact.svg").write_text(contact_sheet(made, options.out), encoding="utf-8")
    failures = [entry for section in made for entry in section.entries if entry.failure]
    for failed in failures:
        print(f"gallery: {failed.title}: {failed.failure}", file=sys.stderr)
    count = sum(len(entry.files) for section in made for entry in section.entries)
    print(f"{count} pictures in {seconds:.0f} s: {options.out / 'index.html'}")
    return 1 if failures else 0


def entries_made(found: list[Chapter], options: argparse.Namespace) -> list[Section]:
    """The chapters with their entries as they have been made, and beside samples."""
    with Workers(options.workers) as pool:
        tasks = [
            (
                chapter,
                [pool.submit(make, entry, chapter, options.out, options.quick) for entry in chapter.entries],
                pool.submit(besides, chapter.name),
            )
            for chapter in found
        ]
        made = []
        for chapter, waiting, compared in tasks:
            entries = []
            for task in waiting:
                entries.append(task.result())
                print(f"{chapter.name}: {entries[-1].title}", flush=True)
            made.append(Section(chapter.title, chapter.about, entries, compared.result()))
    return made


if __name__ == "__main__":
    sys.exit(main())
