"""Answers of parts of a batch, put together.

Owns `joined`, `with_what_was_made` and `unfinished`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from potto.integrate.events import Shortfall
from potto.runtime.answers.convergence import converged_members
from potto.runtime.answers.estimate import Estimate, OneSided

INTERRUPTED = Shortfall("the evaluation was interrupted", "evaluate the members that are nan again", blind=True)


def joined(parts: Sequence[Estimate]) -> Estimate:
    """One answer of several, each of so many members of a batch in one row (`member_converged` says how many)."""
    first = parts[0]
    if len(parts) == 1:
        return first
    sizes = [part.member_converged.size for part in parts]
    missed = {why: np.concatenate([_mask(part.shortfalls.get(why, False), n) for part, n in zip(parts, sizes)])
              for why in dict.fromkeys(why for part in parts for why in part.shortfalls)}  # fmt: skip
    return replace(
        first,
        **{name: _one([getattr(part, name) for part in parts])
           for name in ("value", "error", "tangent", "tangent_error")},
        converged=all(part.converged for part in parts), evals=sum(part.evals for part in parts),
        seconds=sum(part.seconds for part in parts), compile_seconds=sum(part.compile_seconds for part in parts),
        plan_seconds=sum(part.plan_seconds for part in parts),
        method="+".join(sorted({m for part in parts for m in part.method.split("+")} - {"exact"})) or "exact",
        notes=_notes(parts, sizes), stats=stats_of(parts), shortfalls=missed,
        member_converged=converged_members(missed, (sum(sizes),)),
    )  # fmt: skip


# Of what is counted, that which is made once, and which others find made.
MADE = (
    "definitions linked", "kernels compiled", "kernels from disk", "machine code compiled",
    "machine code from the cache",
)  # fmt: skip


def with_what_was_made(found: Estimate, before: Sequence[Estimate]) -> Estimate:
    """An estimate that tells as well what was made for others just before it, whose answers nobody sees."""
    stats = stats_of(before)
    return replace(
        found,
        compile_seconds=found.compile_seconds + sum(part.compile_seconds for part in before),
        plan_seconds=found.plan_seconds + sum(part.plan_seconds for part in before),
        stats=found.stats | {name: found.stats.get(name, 0) + stats[name] for name in MADE if name in stats},
    )


def unfinished(like: Estimate, count: int) -> Estimate:
    """The answer for members of a batch that nobody has evaluated: no number, and no memory for any."""

    def unknown(x: Any, number: float) -> Any:
        if isinstance(x, tuple | list):
            return type(x)(unknown(item, number) for item in x)
        return None if x is None else np.broadcast_to(number, (count,))

    return replace(
        like, value=unknown(like.value, np.nan), error=unknown(like.error, np.inf),
        tangent=unknown(like.tangent, np.nan), tangent_error=unknown(like.tangent_error, np.inf), converged=False,
        evals=0, seconds=0.0, compile_seconds=0.0, plan_seconds=0.0, notes=(), stats={},
        shortfalls={INTERRUPTED: np.broadcast_to(True, (count,))}, member_converged=np.broadcast_to(False, (count,)),
    )  # fmt: skip


def _mask(where: Any, count: int) -> Any:
    return np.broadcast_to(np.asarray(where, dtype=bool), (count,))


def _one(parts: list[Any]) -> Any:
    """Arrays one after the other, in whatever tuples they are."""
    first = parts[0]
    if isinstance(first, tuple | list):
        return type(first)(map(_one, (list(items) for items in zip(*parts, strict=True))))
    return None if first is None else np.concatenate(parts)


def _notes(parts: Sequence[Estimate], sizes: Sequence[int]) -> tuple[OneSided, ...]:
    """The notes, each once, with what it says of all members: nan for those that it does not concern."""
    found: dict[Any, list[OneSided | None]] = {}
    for i, part in enumerate(parts):
        for note in part.notes:
            key = (note.variable, note.surface, note.other, note.fold)
            found.setdefault(key, [None] * len(parts))[i] = note
    out = []
    for notes in found.values():
        first = next(note for note in notes if note is not None)
        rows = np.shape(first.forward)[:-1]

        def whole(name: str, notes: list[OneSided | None] = notes, rows: tuple[int, ...] = rows) -> Any:
            sides = [np.broadcast_to(np.nan if note is None else getattr(note, name), (*rows, n))
                     for note, n in zip(notes, sizes, strict=True)]  # fmt: skip
            return np.concatenate(sides, axis=-1)

        sides = {name: whole(name) for name in ("backward", "forward", "backward_error", "forward_error")}
        out.append(replace(first, **sides))
    return tuple(out)


def stats_of(parts: Sequence[Estimate]) -> dict[str, Any]:
    """What evaluations cost, all together: counts added up, each surface once; it is kept if it is for any."""
    found: dict[str, Any] = {}
    surfaces: dict[str, dict[str, Any]] = {}
    for part in parts:
        for name, value in part.stats.items():
            if name == "surfaces":
                for entry in value:
                    if not surfaces.get(entry["surface"], entry)["kept"] or entry["surface"] not in surfaces:
                        surfaces[entry["surface"]] = entry
            else:
                found[name] = found.get(name, 0) + value if isinstance(value, int | float) else found.get(name, value)
    return {**found, "surfaces": list(surfaces.values())} if surfaces else found
