"""Large batches: the same numbers by threads, processes and dask as without them, also when workers die; progress, and
interruption that keeps what is done; functions that travel as text."""

from __future__ import annotations

import importlib.util
import io
import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import potto
from potto.evaluating import progress as showing
from potto.kernels.making import making
from potto.python import at_once, following, tiles
from potto.python.workers import Workers
from potto.runtime.answers.batches import INTERRUPTED
from potto.runtime.evaluation.gauge import Gauge, watching

TEXT = """
from shaders import bright
def pixel(x, t, shader) integral ([x, x + 1], [0, 1]) shader (u, v)*[u + v < t] d(u, v)
def plain(x, t) pixel(x, t, bright)
def undefined(x) if x < 0.999 then x else integral [0, 1] [sqrt(x - 2 + 0*u) < u] d(u)
def pair(x) (integral [0, x] u d(u), x)
"""
SHADERS = "def bright(u, v) 2*u"
COUNT = 2100
X, T = np.linspace(0, 1, COUNT), 1.5


def exact(x: Any, t: float) -> tuple[Any, Any]:
    """Of `plain` for x <= 0.5 or so, by parts: the integral of 2u*min(1, t - u) over [x, x + 1], and its rate by t."""
    a, b = x, np.minimum(x + 1, t)  # the whole height up to t - 1, then t - u
    c = np.clip(t - 1, a, b)
    value = (c * c - a * a) + (t * (b * b - c * c) - 2 / 3 * (b**3 - c**3))
    return value, b * b - c * c


@pytest.fixture
def module(tmp_path: Path) -> Any:
    (tmp_path / "shaders.po").write_text(SHADERS)
    (tmp_path / "pixels.po").write_text(TEXT)
    return potto.Workspace(tmp_path).module("pixels")


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Blocks of 64 members, tiles of a few blocks, and helpers at once, that no test takes long; by numpy alone, as
    machine code, which takes over at some time, adds up in another order."""
    monkeypatch.setattr(tiles, "ENOUGH", 0.0)
    monkeypatch.setattr(tiles, "LONG", 0.0)
    monkeypatch.setattr(tiles, "WORTH", -1.0)
    monkeypatch.setattr(Workers, "worth", -1.0)
    monkeypatch.setattr(tiles, "_sizes", {})
    with potto.settings(backend="numpy"):
        yield


def same(one: Any, other: Any) -> None:
    for name in ("value", "error", "tangent", "tangent_error", "member_converged"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert one.evals == other.evals


class Deadly(Executor):
    """An executor that gives its second task to a worker which is killed by it, once."""

    def __init__(self, pool: Executor, mark: Path) -> None:
        self.pool, self.mark, self.asked, self._max_workers = pool, mark, 0, 2

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.asked += 1
        if self.asked == 2:
            return self.pool.submit(killed_once, str(self.mark), fn, *args)
        return self.pool.submit(fn, *args, **kwargs)


def killed_once(mark: str, fn: Callable[..., Any], *args: Any) -> Any:
    if not os.path.exists(mark):
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return fn(*args)


@contextmanager
def dask_executor() -> Iterator[Executor]:
    if importlib.util.find_spec("distributed") is None:
        pytest.skip("needs dask.distributed: pip install '.[distributed]'")
    from distributed import Client, LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        yield client.get_executor()


POOLS: dict[str, Callable[[], Any]] = {
    "processes": lambda: ProcessPoolExecutor(2, get_context("spawn")),
    "workers": lambda: Workers(2),
    "dask": dask_executor,
}


def test_blocks_are_within_the_error_bars_of_the_whole(module: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    program = potto.grad(module.plain, "t")
    found = program(X, T)
    value, rate = exact(X, T)
    assert found.stats["blocks"] > 10
    assert (np.abs(found.value - value) <= found.error + 1e-15).all()
    inside = X < T - 1  # at the corner one-sided derivatives differ
    assert (np.abs(found.tangent - rate) <= found.tangent_error + 1e-15)[inside].all()
    monkeypatch.setattr(tiles, "LEAST", COUNT + 1)
    whole = program(X, T)
    assert (np.abs(found.value - whole.value) <= found.error + whole.error).all()


def test_threads_give_the_same(module: Any) -> None:
    program = potto.grad(module.pixel, ["t", "x"])
    alone = program(X.reshape(3, -1), T, shader=module.bright)
    with ThreadPoolExecutor(2) as pool, potto.settings(executor=pool):
        same(program(X.reshape(3, -1), T, shader=module.bright), alone)
    assert alone.value.shape == (3, COUNT // 3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", POOLS)
def test_nothing_is_lost_when_a_worker_is_killed(kind: str, module: Any, tmp_path: Path) -> None:
    program = potto.grad(module.pixel, "t")
    alone = program(X, T, shader=module.bright)
    with POOLS[kind]() as pool:
        deadly = Deadly(pool, tmp_path / "killed")
        with potto.settings(executor=deadly):
            found = program(X, T, shader=module.bright)
    assert (tmp_path / "killed").exists() and deadly.asked > 2
    same(found, alone)
    assert kind == "dask" or found.stats["blocks done again"]  # dask itself asks another worker


def test_a_function_of_groups_travels_without_what_it_was_given(module: Any) -> None:
    program = potto.compile("f = \\(x) . \\(t) . integral [0, 1] [u*x < t] d(u)").f(X + 1)
    with ThreadPoolExecutor(2) as pool, potto.settings(executor=pool):
        found = program(0.5)
    assert found.stats["blocks"] > 10
    assert np.allclose(found.value, 0.5 / (X + 1), rtol=1e-14, atol=0)


def test_an_executor_that_takes_nothing_is_done_without(module: Any) -> None:
    pool = ThreadPoolExecutor(1)
    pool.shutdown()
    with potto.settings(executor=pool):
        found = module.plain(X, T)
    same(found, module.plain(X, T))
    with pytest.raises(potto.PottoError, match="executor must be"), potto.settings(executor=3):
        pass


def test_errors_are_those_of_the_call_itself(module: Any) -> None:
    with ThreadPoolExecutor(2) as pool, potto.settings(executor=pool):
        found = module.undefined(X)
    alone = module.undefined(X)
    same_nan = np.array_equal(found.value, alone.value, equal_nan=True)
    assert same_nan and found.reasons == alone.reasons and not found.converged
    assert found.reasons_of(-1) == alone.reasons_of(-1) != () == found.reasons_of(0)


def test_tuples_and_the_least_batches(module: Any) -> None:
    first, second = module.pair(X).value
    assert np.allclose(first, X * X / 2, rtol=1e-13, atol=1e-16) and (second == X).all()
    assert "blocks" not in module.pair(X[: tiles.LEAST - 1]).stats


def test_a_large_batch_is_not_held_to_the_blocks_of_a_small_one(module: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nothing takes long, a batch is one block, whatever was asked before."""
    monkeypatch.setattr(tiles, "ENOUGH", 1e9)
    monkeypatch.setattr(tiles, "LONG", 1e9)
    monkeypatch.setattr(tiles, "LONG", 1e9)
    monkeypatch.setattr(tiles, "LITTLE", -1.0)
    assert [module.pair(np.linspace(0, 1, count)).stats["blocks"] for count in (2100, 9000, 2100)] == [1, 1, 1]


@pytest.mark.parametrize(("block", "member", "size"), [(0.13, 0.00025, 4096), (0.0, 0.002, 256), (0.0, 0.05, 64)])
def test_blocks_are_large_where_a_block_costs_more_than_its_members(
    monkeypatch: pytest.MonkeyPatch, block: float, member: float, size: int
) -> None:
    """By a clock that says so: 0.13 s a block are a fifth of what 4,096 members take, and half of what 1,024 do."""
    for name, seconds in (("ENOUGH", 0.1), ("LONG", 1.0)):
        monkeypatch.setattr(tiles, name, seconds)

    assert size_by(monkeypatch, 25600, lambda members: block + member * members) == size


def size_by(monkeypatch: pytest.MonkeyPatch, count: int, seconds: Callable[[int], float], first: int = 64) -> int:
    """The size of blocks where one takes so many seconds; `first` is tried first."""

    def alone(self: Any, part: tuple[int, int]) -> None:
        self.spent = seconds(part[1] - part[0])
        self.done[part[0]] = None

    monkeypatch.setattr(tiles._Tiles, "_alone", alone)
    batch: Any = (count, lambda part: None, lambda parts: None, count, first)
    return tiles._Tiles(*batch)._size()


def test_blocks_are_large_where_few_members_cost_as_much_as_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """Up to ten pixels on edges are done one by one, more together: what a member costs stays, and then falls."""
    for name, seconds in (("ENOUGH", 0.1), ("LONG", 1.0)):
        monkeypatch.setattr(tiles, name, seconds)

    def one_by_one(members: int) -> float:
        return 0.0002 * min(members, 1000) + 1e-5 * members

    assert size_by(monkeypatch, 1 << 16, one_by_one) == 4096
    assert size_by(monkeypatch, 1 << 14, one_by_one) == 512


def test_blocks_of_what_takes_long_are_large_where_members_share_what_they_cost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Eight spheres: 0.7 s for each of up to ten members, 0.16 s for each of more. Others cost the same in any number:
    the least that is tried is one, then 16, which would keep an interrupt from what is done for too long."""
    for name, seconds in (("ENOUGH", 0.1), ("LONG", 1.0)):
        monkeypatch.setattr(tiles, name, seconds)
    assert size_by(monkeypatch, 1000, lambda members: members * (0.7 if members < 11 else 0.16), 1) == 16
    assert size_by(monkeypatch, 900, lambda members: 0.7 * members, 1) == 1


def test_what_is_made_for_a_larger_block_does_not_count_as_its_members(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels that 256 members are the first to need: 0.4 s once, where a member takes 0.1 ms."""
    for name, seconds in (("ENOUGH", 0.1), ("LONG", 1.0)):
        monkeypatch.setattr(tiles, name, seconds)
    made: set[int] = set()

    def alone(self: Any, part: tuple[int, int]) -> None:
        size = part[1] - part[0]
        self.spent = 1e-4 * size + 0.4 * (size in {64, 256} - made)
        made.add(size)

    monkeypatch.setattr(tiles._Tiles, "_alone", alone)
    asked: Any = (25600, lambda part: None, lambda parts: None, "made")
    assert tiles._Tiles(*asked)._size() == 1024


def test_the_first_block_is_asked_again_however_long_it_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is met for the first time may take seconds: the blocks after it are no larger for it, nor smaller."""
    for name, seconds in (("ENOUGH", 0.1), ("LONG", 1.0)):
        monkeypatch.setattr(tiles, name, seconds)
    first = iter([5.0])
    assert size_by(monkeypatch, 25600, lambda members: 0.13 + 0.00025 * members + next(first, 0.0)) == 4096


def test_blocks_grow_from_frame_to_frame_of_a_preview_and_for_nobody_else(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first frame finds everything new, so that 64 members seem to take long."""
    monkeypatch.setattr(tiles, "ENOUGH", 0.1)
    monkeypatch.setattr(tiles, "_sizes", {"frame": (64, True)})

    def frame() -> int:
        one = tiles._Tiles(1024, lambda part: SimpleNamespace(evals=0), lambda parts: None, "frame")  # type: ignore
        one._all(None, lambda part, evals: None)
        return len(one.blocks)

    assert [frame() for _ in range(2)] == [16, 16]
    with tiles.growing():
        assert [frame() for _ in range(5)] == [16, 8, 4, 2, 1]


def test_blocks_are_timed_without_what_is_made_for_them() -> None:
    """By the processor: one that others use as well is no slow function, and what is made is made once. What another
    thread makes meanwhile takes nothing from it."""

    def made() -> None:
        with making:
            work(0.2)

    def here(part: tuple[int, int]) -> None:
        made()
        with ThreadPoolExecutor(1) as pool:
            pool.submit(made).result()
        work(0.05)
        time.sleep(0.1)

    def work(seconds: float) -> None:
        start = time.thread_time()
        while time.thread_time() - start < seconds:
            pass

    batch = tiles._Tiles(1 << 14, here, lambda parts: None, "timed")  # type: ignore[arg-type, return-value]
    batch._alone((0, 64))
    assert 0.05 <= batch.spent < 0.1


def test_errors_of_answers_that_are_arguments_count_wherever_they_are_evaluated() -> None:
    """Of 3 v + w they are three times those of v, but for rounding: they do not stay behind when a block travels."""
    m = potto.compile("def f(t) integral [0, 1] [x^2 < t]*x d(x)\ndef g(v, w) 3*v + w")
    t = np.linspace(0.1, 0.9, 4000)
    with potto.settings(method="mc", samples=64):
        v = m.f(t)
    with ThreadPoolExecutor(2) as pool:
        for helpers in (None, pool):
            with potto.settings(executor=helpers):
                found = m.g(v, 1.0)
            np.testing.assert_allclose(found.error[1:], 3 * v.error[1:], rtol=1e-12)


def test_what_is_made_while_the_size_of_blocks_is_tried_is_told() -> None:
    module = potto.compile("def fresh(x) integral [0, 1] u*[u < x]*0.123456789 d(u)")
    first, second = (module.fresh(X) for _ in range(2))
    made = ("definitions linked", "kernels compiled", "kernels from disk")
    assert sum(first.stats[name] for name in made) > 0 == sum(second.stats[name] for name in made)
    assert first.compile_seconds > second.compile_seconds  # a hundred times: links and kernels against a look-up


def test_an_interrupt_keeps_what_is_done(module: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, alone = module.plain(X, T), tiles._Tiles._alone

    def interrupted(self: Any, block: tuple[int, int]) -> Any:
        if block[0] >= 640:
            raise KeyboardInterrupt
        return alone(self, block)

    monkeypatch.setattr(tiles._Tiles, "_alone", interrupted)
    with pytest.raises(potto.Interrupted) as stop:
        module.plain(X, T)
    found = stop.value.estimate
    assert (found.value[:640] == whole.value[:640]).all() and np.isnan(found.value[640:]).all()
    assert found.member_converged[:640].all() and not found.member_converged[640:].any() and not found.converged
    assert found.reasons_of(700) == (INTERRUPTED.message,)


def test_of_a_small_batch_that_takes_long_what_is_done_is_kept(module: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the first member on. It goes on from there in another call of the same kind: nothing is given up again."""
    x, alone, given_up = X[:9], tiles._Tiles._alone, list[Any]()
    value, _ = exact(x, T)

    def interrupted(self: Any, block: tuple[int, int]) -> Any:
        if block[0] == 4:
            raise KeyboardInterrupt
        return alone(self, block)

    for home, name in ((tiles, "PATIENCE"), (tiles, "LONGEST"), (at_once, "PATIENCE")):
        monkeypatch.setattr(home, name, 0.0)
    monkeypatch.setattr(tiles._Tiles, "_alone", interrupted)
    for _ in range(2):
        with pytest.raises(potto.Interrupted) as stop:
            module.plain(x, T)
        found = stop.value.estimate
        assert (np.abs(found.value - value) <= found.error + 1e-15)[:4].all()
        assert found.member_converged.tolist() == [True] * 4 + [False] * 5
    monkeypatch.setattr(tiles, "patient", given_up.append)
    monkeypatch.setattr(tiles._Tiles, "_alone", alone)
    found = module.plain(x, T)
    assert found.stats["blocks"] == 9 and not given_up
    assert (np.abs(found.value - value) <= found.error + 1e-15).all()


@pytest.mark.parametrize("last", [1, 3])
def test_an_interrupt_while_the_size_of_blocks_is_tried(last: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """64 members, then 128, 256 and so on: the last block that was done is kept, though it only told the size."""
    program, alone, sizes = potto.compile("def f(x) x*x"), tiles._Tiles._alone, list[int]()

    def interrupted(self: Any, block: tuple[int, int]) -> Any:
        if len(sizes) == last:
            raise KeyboardInterrupt
        sizes.append(block[1] - block[0])
        return alone(self, block)

    monkeypatch.setattr(tiles, "ENOUGH", 1e9)
    monkeypatch.setattr(tiles, "LONG", 1e9)
    monkeypatch.setattr(tiles, "LITTLE", -1.0)
    monkeypatch.setattr(tiles._Tiles, "_alone", interrupted)
    x = np.arange(float(COUNT))
    with pytest.raises(potto.Interrupted) as stop:
        program.f(x)
    found, done = stop.value.estimate, sizes[-1]
    assert sizes == [64, 128, 256][:last]
    assert (found.value[:done] == x[:done] ** 2).all() and np.isnan(found.value[done:]).all()
    assert found.member_converged[:done].all() and not found.member_converged[done:].any()


def test_workers_are_not_waited_for_after_an_interrupt() -> None:
    start = time.perf_counter()
    with pytest.raises(KeyboardInterrupt), Workers(1) as pool:
        pool.submit(time.sleep, 100)
        raise KeyboardInterrupt
    assert time.perf_counter() - start < 50


def test_workers_end_with_the_one_they_work_for() -> None:
    """Killed, it can't tell them; what they print into stays open for as long as they live."""
    text = (
        "import os, signal; from potto.python.workers import Workers; pool = Workers(1);"
        "print(pool.submit(abs, -7).result(), flush=True); os.kill(os.getpid(), signal.SIGKILL)"
    )
    ended = subprocess.run([sys.executable, "-c", text], stdout=subprocess.PIPE, text=True, timeout=60)
    assert (ended.stdout, ended.returncode) == ("7\n", -signal.SIGKILL)


def test_progress_is_told(module: Any) -> None:
    shares: list[float] = []
    gauge = Gauge()
    gauge.told = lambda: shares.append(gauge.share)
    with watching(gauge):
        module.plain(X, T)
    assert shares == sorted(shares) and shares[-1] == 1 and len(shares) > 10
    assert not gauge.limit and gauge.evaluations > 0


def test_progress_is_told_to_a_function_which_may_interrupt(module: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Calls of all kinds, each from its beginning to its end."""
    monkeypatch.setattr(following, "EVERY", 0.0)
    told: list[potto.Advance] = []
    one, every = potto.compile("def f(t) integral [0, 1] [x^2 < t]*exp(x) d(x)").f, potto.grad(module.plain, "t")
    calls = (lambda: module.plain(X, T)), (lambda: every(X, T)), (lambda: one(0.3)), (lambda: potto.jacobian(one)(0.4))
    with potto.settings(progress=told.append):
        for call in calls:
            told.clear()
            found = call()
            shares = [advance.share for advance in told if not advance.at_most]
            assert shares == sorted(shares) and shares[-1] == 1 and told[-1].left == 0  # type: ignore[type-var]
            assert 0 < told[0].evaluations <= told[-1].evaluations == found.evals

    def enough(advance: potto.Advance) -> None:
        if not advance.at_most and advance.share is not None and advance.share > 0.5:
            raise KeyboardInterrupt

    with potto.settings(progress=enough), pytest.raises(potto.Interrupted) as stop:
        module.plain(X, T)
    assert 0.5 < np.mean(stop.value.estimate.member_converged) < 0.6


def test_progress_is_shown_on_a_terminal_and_nowhere_else(module: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return seen

    monkeypatch.setattr(showing, "PATIENCE", 0.0)
    for seen in (True, False):
        monkeypatch.setattr(sys, "stderr", screen := Terminal())
        with potto.settings(progress=True):
            module.plain(X, T)
        assert ("evaluating, " in screen.getvalue(), screen.getvalue().endswith("\x1b[K")) == (seen, seen)
    with pytest.raises(potto.PottoError, match="progress must be"), potto.settings(progress="yes"):
        pass


# What travels


def test_functions_modules_and_answers_pickle(module: Any) -> None:
    for kept in (module.pixel, module.plain, potto.deriv(module.plain), module.plain(0.3, T)):
        arrived = pickle.loads(pickle.dumps(kept))
        assert arrived.type == kept.type if isinstance(kept, potto.Function) else float(arrived) == float(kept)
    assert float(pickle.loads(pickle.dumps(module)).plain(0.3, T)) == float(module.plain(0.3, T))
    given = pickle.loads(pickle.dumps(potto.compile("f = \\(x) . \\(y) . x - y").f(3.0)))
    assert float(given(1.0)) == 2.0
    gradient = potto.grad(module.plain, ["x", "t"])
    found, arrived = gradient(0.3, T), pickle.loads(pickle.dumps(gradient))(0.3, T)
    assert (arrived["x"], arrived["t"]) == (found["x"], found["t"])
    assert pickle.loads(pickle.dumps(found))["t"] == found["t"]


def test_a_function_needs_no_files_where_it_arrives(module: Any, tmp_path: Path) -> None:
    sent = pickle.dumps((module.pixel, module.bright))
    for name in ("pixels.po", "shaders.po"):
        (tmp_path / name).unlink()
    text = "import pickle, sys; f, s = pickle.load(sys.stdin.buffer); print(repr(float(f(0.25, 1.5, s))))"
    told = subprocess.run([sys.executable, "-c", text], input=sent, capture_output=True, check=True)
    assert float(told.stdout) == pytest.approx(float(exact(0.25, T)[0]), rel=1e-14, abs=0)


def test_other_texts_under_the_same_name_are_others(module: Any, tmp_path: Path) -> None:
    before = pickle.dumps(module.bright)
    (tmp_path / "shaders.po").write_text("def bright(u, v) 3*u")
    after = pickle.dumps(potto.Workspace(tmp_path).module("shaders").bright)
    assert [float(pickle.loads(x)(1.0, 1.0)) for x in (before, after, before)] == [2.0, 3.0, 2.0]


def test_a_workspace_pickles_by_its_folder(module: Any, tmp_path: Path) -> None:
    space = pickle.loads(pickle.dumps(potto.Workspace(tmp_path)))
    assert space.root == os.fspath(tmp_path)
    assert float(space.module("pixels").plain(0.25, T)) == float(module.plain(0.25, T))
