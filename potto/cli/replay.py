"""`potto replay`: recorded sessions of the prompt, entered again."""

from __future__ import annotations

import argparse

from potto.cli.console import Console

SUMMARY = "replay recorded sessions (`:record FILE`) and say which answers changed"
EXAMPLE = "  potto replay session.log"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("paths", nargs="+", metavar="FILE", help="what `:record` wrote; `-` is standard input")
    parser.add_argument("-v", "--verbose", action="store_true", help="also show what stayed")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto_repl.replay import replayed

    entries = different = 0
    answer = []
    for path in options.paths:
        text = _text(path, console)
        if text is None:
            return 1
        for entry, difference in replayed(text):
            entries += 1
            head = f"{path}:{entry.line}: {entry.text.partition(chr(10))[0]}"
            if difference is not None:
                different += 1
                answer.append({"file": path, "line": entry.line, "entry": entry.text, "before": entry.answer,
                               "now": difference.now})  # fmt: skip
                if not options.json:
                    console.complain(f"{head}\n  before\n{_indented(entry.answer)}\n  now\n{_indented(difference.now)}")
            elif options.verbose and not options.json:
                console.answer(head)
    if options.json:
        console.answer_json({"entries": entries, "different": answer})
    else:
        count = f"{entries} entr{'y' if entries == 1 else 'ies'}"
        console.answer(f"{count}: {different} answered differently" if different else f"{count}: all answers hold")
    return int(bool(different))


def _text(path: str, console: Console) -> str | None:
    import sys

    if path == "-":
        return sys.stdin.read()
    try:
        with open(path, encoding="utf-8") as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as error:
        said = error.strerror if isinstance(error, OSError) else "it is not text"
        console.complain(f"potto: {path} cannot be read: {(said or '').lower()}")
        return None


def _indented(text: str) -> str:
    return "\n".join(f"    {line}" for line in text.splitlines())
