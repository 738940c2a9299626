"""The entry point of the command line: `potto` and `python -m potto`.

Owns how a command ends: exit statuses, interrupts, closed pipes and the guard that turns our own bugs into a short
report. Imports next to nothing before it knows which command runs.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from potto import __version__

FINE, FAILED, WRONG_USE, CRASHED, CLOSED_PIPE, INTERRUPTED = 0, 1, 2, 70, 141, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command line and give its exit status."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments in (["--version"], ["-V"]):
        print(f"potto {__version__}")
        return FINE
    try:
        return _guarded(arguments)
    except KeyboardInterrupt:
        sys.stderr.write("\ninterrupted\n")
        return INTERRUPTED


def _guarded(arguments: list[str]) -> int:
    from potto.cli.command_line import dispatch

    try:
        status = dispatch(arguments)
        sys.stdout.flush()
        return status
    except SystemExit as leaving:  # argparse
        return leaving.code if isinstance(leaving.code, int) else WRONG_USE
    except BrokenPipeError:
        return _closed_pipe()
    except Exception as error:
        from potto.cli.crash import report

        sys.stderr.write(report(arguments, error) + "\n")
        return CRASHED


def _closed_pipe() -> int:
    """Whoever read our output has left; what is still buffered has nowhere to go."""
    import os

    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (OSError, ValueError):
        return CLOSED_PIPE  # no real file behind stdout: nothing is left to redirect
    return CLOSED_PIPE


if __name__ == "__main__":
    sys.exit(main())
