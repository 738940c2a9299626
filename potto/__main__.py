"""The entry point of the command line: `potto` and `python -m potto`.

Owns how a command ends: exit statuses, interrupts, closed pipes and the guard that turns our own bugs into a short
report. Imports next to nothing before it knows which command runs.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence

from potto import __version__

FINE, FAILED, WRONG_USE, CRASHED, CLOSED_PIPE, INTERRUPTED = 0, 1, 2, 70, 141, 130


def _load_msgspec() -> None:
    """Import msgspec without typing_extensions, which it asks for what `typing` has, and gets on without: that would
    take 8 of the 50 ms in which an editor is greeted. Other programs' msgspec is left alone. It stands before any
    command runs: msgspec swallows an interrupt that comes while it is loaded."""
    if "msgspec" in sys.modules or "typing_extensions" in sys.modules:
        return
    sys.modules["typing_extensions"] = None  # type: ignore[assignment]  # what is None here cannot be imported
    try:
        import msgspec  # noqa: F401
    finally:
        del sys.modules["typing_extensions"]


_load_msgspec()


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command line and give its exit status."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments in (["--version"], ["-V"]):
        print(f"potto {__version__}")
        return FINE
    _open_streams()
    try:
        status = _guarded(arguments)
    except KeyboardInterrupt:
        sys.stderr.write("\ninterrupted\n")
        status = INTERRUPTED
    if argv is None:  # the process ends
        if status == INTERRUPTED:
            _leave()
        gc.freeze()  # a last collection would go through all that there is, for a twentieth of the time of `eval`
    return status


def _leave() -> None:
    """End the process now. A thread of LLVM, which cannot be interrupted, would be waited for, for seconds."""
    import os
    from contextlib import suppress

    with suppress(OSError, ValueError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(INTERRUPTED)


def _guarded(arguments: list[str]) -> int:
    import os

    # Of numpy's linear algebra, before numpy is loaded: its threads turn while they wait, for 20 ms of a command, and
    # what is large is divided among threads of ours.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from potto.cli.command_line import dispatch

    try:
        os.getcwd()
    except OSError:
        if arguments[:1] != ["lsp"]:  # whose client says where files are
            sys.stderr.write("potto: the folder that this is run in is gone: change to another one\n")
            return FAILED
    try:
        status = dispatch(arguments)
        sys.stdout.flush()
        return status
    except SystemExit as leaving:  # argparse
        return leaving.code if isinstance(leaving.code, int) else WRONG_USE
    except BrokenPipeError:
        return _closed_pipe()
    except OSError as error:
        import errno

        if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
            return _crashed(arguments, error)
        _closed_pipe()
        sys.stderr.write(f"potto: what is said cannot be written: {(error.strerror or str(error)).lower()}\n")
        return FAILED
    except Exception as error:
        if _of_interrupt(error):
            raise KeyboardInterrupt from error
        return _crashed(arguments, error)


def _of_interrupt(error: BaseException | None) -> bool:
    """Whether an interrupt is behind it: one that comes while a class is made is told as a RuntimeError."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _crashed(arguments: list[str], error: Exception) -> int:
    from potto.cli.crash import report

    sys.stderr.write(report(arguments, error) + "\n")
    return CRASHED


def _open_streams() -> None:
    """Let what is said go nowhere where somebody has closed the streams (`>&-`)."""
    import os

    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115  (until the end)


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
