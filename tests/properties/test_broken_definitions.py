"""Mutated definitions: each has a tree, nothing raises, and nobody else suffers.

`POTTO_MUTATIONS=100000 pytest -m slow tests/properties/test_broken_definitions.py` runs as many.
"""

from __future__ import annotations

import os
import random
import time

import pytest
from edited_programs import WORKSPACE, broken, library
from how_many import examples

from potto.checking.check import definition_diagnostics, has_errors
from potto.checking.library import Library
from potto.modules import chunk_text, names
from potto.modules.texts import chunks, head, is_diffeo, parsed
from potto.syntax import parse_chunk
from potto.types import interface

ROOT = "/broken"
MUTATIONS = int(os.environ.get("POTTO_MUTATIONS", examples(600, 2000)))
RECOVERY = 0.010  # seconds within which 99 in 100 are read, mistakes and all


def original() -> list[tuple[str, str, int]]:
    """All definitions of the workspace: the file, the name, and which chunk of the file it is."""
    lib = library(ROOT, dict(WORKSPACE))
    return [
        (name, str(known.name), number)
        for name in WORKSPACE
        for number, chunk in enumerate(chunks(lib.db, f"{ROOT}/{name}"))
        if (known := head(lib.db, chunk.text, is_diffeo(name))).kind == "definition"
    ]


DEFINITIONS = original()


def errors(lib: Library) -> dict[tuple[str, str], list[str]]:
    """The errors of each definition."""
    return {
        (name, each): [d.code for d in definition_diagnostics(lib.db, f"{ROOT}/{name}", each) if d.severity == "error"]
        for name in WORKSPACE
        for each in names(lib.db, f"{ROOT}/{name}")
    }


def mutate(lib: Library, seed: int) -> float:
    """Break one definition and look at all; the seconds that it took to read it."""
    rng = random.Random(seed)
    name, defined, number = rng.choice(DEFINITIONS)
    file, text = f"{ROOT}/{name}", WORKSPACE[name]
    for each, whole in WORKSPACE.items():
        lib.put(f"{ROOT}/{each}", whole)
    found, before = errors(lib), interface(lib.db, file, defined)
    assert not any(found.values())
    chunk = chunks(lib.db, file)[number]
    mutated = broken(chunk.text, rng)
    started = time.thread_time()
    read = parse_chunk(mutated, is_diffeo(name))
    seconds = time.thread_time() - started
    code = mutated.lstrip().partition("#")[0]
    nothing = not code or (read.diagnostics and not code.strip(")] \n𝄞"))  # all there is closes, or means, nothing
    assert read.item is not None or nothing, (seed, mutated)
    lib.put(file, text[: chunk.start] + mutated + text[chunk.start + len(chunk.text) :])
    lib.diagnostics(file)
    now = errors(lib)
    kept = defined in names(lib.db, file) and interface(lib.db, file, defined) == before
    now_written = chunk_text(lib.db, file, defined)  # None where the mistake is in its name
    if kept or (now_written is not None and has_errors(parsed(lib.db, now_written, is_diffeo(name)).diagnostics)):
        others = {key: said for key, said in now.items() if key != (name, defined) and key in found}
        assert all(said == found[key] for key, said in others.items()), (seed, mutated, others)
    return seconds


@pytest.fixture(scope="module")
def lib() -> Library:
    return library(ROOT, dict(WORKSPACE))


@pytest.mark.parametrize("part", range(5))
def test_mutated_definitions(lib: Library, part: int) -> None:
    for seed in range(part * 40, part * 40 + 40):
        mutate(lib, seed)


FOUND = [
    202085,  # a diffeomorphism that is none was reported again wherever it was used
    203979,  # h(deriv(h)): a type that would be part of its own dual grew until the memory was full
    206104,  # nothing but a bracket that closes nothing, and a comment
    1027749,  # nothing but a character that means nothing, and a comment
]


@pytest.mark.parametrize("seed", FOUND)
def test_what_was_found(lib: Library, seed: int) -> None:
    mutate(lib, seed)


@pytest.mark.slow
def test_many_mutated_definitions(lib: Library) -> None:
    times = sorted(mutate(lib, seed) for seed in range(10_000, 10_000 + MUTATIONS))
    assert times[int(0.99 * len(times))] < RECOVERY
