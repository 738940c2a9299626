"""How laws are tested: with the same examples each time, so that a change is told by its own doing; `make fuzz` looks
for others.

What tests start can be interrupted, also where the tests themselves run in the background of a script, which lets them
ignore interrupts and whatever they start as well: only what is ignored is inherited, a handler is not.

Some hundred tests start Python: what it compiles is kept, also where the environment says otherwise, or each of them
would compile all of Potto again.

What is kept between runs is kept in a folder of this run alone: no test is answered by an earlier one's cache. All
processes of the run share it, and it is in memory where that has a folder: some ten thousand small files are written,
each of which takes a quarter of a millisecond of the processor on a disk, and deleted in the end.

The longest tests go first: at the end one process would go through them while the others wait.

Nearly all that tests make stays (terms, programs, plans): looking for garbage as often as Python does was an eighth of
their time (32 of 247 s in four files of tests, 9 with these thresholds). At the end pytest would look five times more.
"""

import gc
import os
import shutil
import signal
import sys
import tempfile

import pytest
from hypothesis import settings

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, lambda *_: None)

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

MEMORY = "/dev/shm"
if "PYTEST_XDIST_WORKER" not in os.environ:
    roomy = os.access(MEMORY, os.W_OK) and shutil.disk_usage(MEMORY).free > 2**30
    _cache = tempfile.TemporaryDirectory(prefix="potto-tests-", dir=MEMORY if roomy else None)
    os.environ["POTTO_CACHE"] = _cache.name

settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=25)
settings.register_profile("explore", deadline=None, max_examples=200)
settings.load_profile("repeatable")

gc.set_threshold(50_000, 20, 50)

LONGEST = {"worlds", "catalogue", "integrate"}  # folders


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: LONGEST.isdisjoint(item.path.parts))


def pytest_collection_finish() -> None:
    gc.freeze()  # the tests themselves: some hundred thousand objects in each process


def pytest_sessionfinish() -> None:
    gc.freeze()
