"""How numbers are asked for: the method, the accuracy and the limits of an evaluation.

Owns `Settings` and the settings in force, which belong to the thread (or task) that set them, and with these who helps
and who is told of progress. Knows nothing of what obeys them: the runtime reads them, the faces set them. `respelled`
writes advice as each face has its settings.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Literal, get_args

from msgspec import Struct
from msgspec.structs import replace

from potto.diagnostics import PottoError, declare
from potto.extras import install_command
from potto.source import Span

if TYPE_CHECKING:
    from concurrent.futures import Executor

BAD_SETTING = declare("P0520", "a setting that does not exist or cannot have this value")

Method = Literal["auto", "quadrature", "mc", "qmc"]
SAMPLERS = ("mc", "qmc")  # whose errors are no less for one summand than for many
METHODS: tuple[str, ...] = get_args(Method)
Backend = Literal["auto", "numpy", "native"]
BACKENDS: tuple[str, ...] = get_args(Backend)
CHOICES = {"method": METHODS, "backend": BACKENDS}
HELPERS = ("executor", "progress")  # which change no number

# The relative accuracy that samples are held against where nobody asked for another one: an error of 4 standard errors
# of 10,000 samples of a condition that holds half of the time is 4 % of the answer.
SAMPLED_RTOL = 0.05


class Unasked(float):
    """A tolerance that nobody asked for."""


class Settings(Struct, frozen=True):
    """What an evaluation is asked for.

    method: how integrals are estimated; "auto" cuts and integrates by quadrature where the dimension allows it.
    rtol, atol: the accuracy asked for; an estimate converged when its error is within `max(atol, rtol * |value|)`.
    Where nobody asked, `mc` and `qmc` are held against SAMPLED_RTOL, which is within the reach of `samples`. What
    cancels to 0 has converged when its error is within 1e-12 of what cancels (`runtime/answers/allowances.py`).
    samples: points of a Monte Carlo estimate.
    seed: where its random numbers start; equal seeds give equal answers.
    max_evals: the most evaluations of an integrand before the answer comes as it is, marked as not converged.
    backend: what computes at many points: "numpy", machine code ("native"), or numpy until machine code pays ("auto").
    """

    method: Method = "auto"
    rtol: float = Unasked(1e-10)
    atol: float = 0.0
    samples: int = 100_000
    seed: int = 0
    max_evals: int = 20_000_000
    backend: Backend = "auto"

    @property
    def sampled(self) -> bool:
        """Whether samples are asked for."""
        return self.method in SAMPLERS

    def asked(self, drawn: bool) -> float:
        """The relative accuracy that an answer is held against; `drawn` if it is made of samples."""
        if drawn and self.sampled and isinstance(self.rtol, Unasked):
            return SAMPLED_RTOL
        return self.rtol


class _Changes(Struct, frozen=True):
    """What is set in a block; `made`: the settings that come of it, by the last ones that they change."""

    values: Mapping[str, object]
    made: list[tuple[Settings, Settings]] = []

    def of(self, base: Settings) -> Settings:
        for before, found in self.made:
            if before is base:
                return found
        found = replace(base, **self.values)
        self.made[:] = [(base, found)]
        return found


DEFAULTS = Settings()
Progress = Callable[[Any], object] | bool | None
_changes: ContextVar[_Changes | None] = ContextVar("potto_settings", default=None)
_executor: ContextVar[Executor | None] = ContextVar("potto_executor", default=None)
_progress: ContextVar[Progress] = ContextVar("potto_progress", default=None)


def current(base: Settings = DEFAULTS) -> Settings:
    """The settings in force in this thread or task; `base` counts where nothing is set, as a project says it."""
    changes = _changes.get()
    return base if changes is None else changes.of(base)


def executor() -> Executor | None:
    """Who evaluates tiles of large batches; None for this thread alone. Answers are the same by the same
    backend."""
    return _executor.get()


def progress() -> Progress:
    """Who is told how far calls are: a function, or with True a person at the terminal."""
    return _progress.get()


@contextmanager
def unfollowed() -> Iterator[None]:
    """In this block nobody is told how far calls are."""
    token = _progress.set(None)
    try:
        yield
    finally:
        _progress.reset(token)


def problem(name: str, value: object) -> str | None:
    """Why `value` cannot be the setting `name`, or None if it can."""
    if name == "executor":
        able = value is None or callable(getattr(value, "submit", None))
        return None if able else f"executor must be a concurrent.futures.Executor or None, not {value!r}"
    if name == "progress":
        able = value is None or isinstance(value, bool) or callable(value)
        return None if able else f"progress must be True, a function or None, not {value!r}"
    if name in CHOICES:
        if value not in CHOICES[name]:
            return f"{name} must be one of {', '.join(CHOICES[name])}, not {value!r}"
        from importlib.util import find_spec  # takes its time to load, and hardly anybody asks

        if value == "native" and find_spec("llvmlite") is None:
            return f"machine code needs llvmlite: {install_command('jit')}"
        return None
    if name not in Settings.__struct_fields__:
        known = (*Settings.__struct_fields__, *HELPERS)
        return f"there is no setting `{name}`; there are {', '.join(known)}"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"{name} must be a number, not {value!r}"
    if name in ("rtol", "atol"):
        return None if 0 <= value < math.inf else f"{name} must be a number >= 0, not {value!r}"
    least = 0 if name == "seed" else 1
    if not isinstance(value, int):
        return f"{name} must be a whole number, not {value!r}"
    return None if value >= least else f"{name} must be at least {least}, not {value!r}"


_OPTION = re.compile(r"`--([a-z-]+)(?: ([^`]+))?`")


def respelled(advice: str, spell: Callable[[str, str | None], str]) -> str:
    """Advice, which names settings as options of the command line (`--max-evals 1000`), as another face writes them:
    `spell` is given the name of each, with the value if there is one. Options that are not settings stay."""

    def spelled(option: re.Match[str]) -> str:
        name = option[1].replace("-", "_")
        return f"`{spell(name, option[2])}`" if name in Settings.__struct_fields__ else option[0]

    return _OPTION.sub(spelled, advice)


@contextmanager
def settings(**changes: object) -> Iterator[Settings]:
    """Change the settings for the `with` block: `with potto.settings(method="mc", samples=10_000, seed=7): ...`.

    `executor`: any `concurrent.futures.Executor`, which evaluates tiles of large batches (threads, processes,
    `dask.distributed.Client(…).get_executor()`, mpi4py's); None for none. It stays open, and its owner's.
    `progress`: True for a line on the terminal that says how far a call is, after half a second, and how long the rest
    may take; or a function, which is called with an `Advance` ten times a second at the most.
    """
    for name, value in changes.items():
        complaint = problem(name, value)
        if complaint is not None:
            raise PottoError([BAD_SETTING(Span(0, 0), complaint)])
    numbers = {name: value for name, value in changes.items() if name not in HELPERS}
    before = _changes.get()
    token = _changes.set(_Changes(numbers if before is None else {**before.values, **numbers}))
    helpers = _executor.set(changes.get("executor", _executor.get()))  # type: ignore[arg-type]  # `problem` looked
    told = _progress.set(changes.get("progress", _progress.get()))  # type: ignore[arg-type]
    try:
        yield current()
    finally:
        _progress.reset(told)
        _executor.reset(helpers)
        _changes.reset(token)
