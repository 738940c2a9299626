"""The worlds beside the program that samples first and differentiates its sum: `python examples/beside.py [--jax]`.

By numpy the sums are differentiated exactly, by a complex step of 1e-30: comparisons see the real parts, as `where`
does in JAX or PyTorch. With `--jax`, where JAX is installed, it is asked, compiled, in double precision: derivatives
are the same numbers. What is missing is what moves with the jumps.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import potto

HERE = Path(__file__).parent
sys.path.append(str(HERE))
from sampled_worlds import WORLDS, World  # noqa: E402

STEP = 1e-30
Pair = tuple[float, float]


class Row(NamedTuple):
    """Value, derivative and its error of ours, value and derivative of the sum; seconds of the processor of each."""

    world: World
    value: float
    slope: float
    error: float
    seconds: float
    sampled: float
    sampled_slope: float
    sampled_seconds: float


def by_numpy(world: World) -> Callable[[], Pair]:
    def run() -> Pair:
        found = world.sampled(np, np.complex128(complex(world.place, STEP)))
        return float(np.real(found)), float(np.imag(found)) / STEP

    return run


def by_jax(world: World) -> Callable[[], Pair]:
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    both = jax.jit(lambda t: jax.jvp(lambda u: world.sampled(jnp, u), (t,), (jnp.ones_like(t),)))

    def run() -> Pair:
        value, slope = both(jnp.asarray(world.place, dtype=float))
        return float(value), float(slope)

    run()  # compiled once
    return run


def row(world: World, sampler: Callable[[World], Callable[[], Pair]] = by_numpy) -> Row:
    module = potto.load(HERE / f"{world.program}.po")
    text = f"deriv({world.function})(({world.place}, 1))"
    module.eval(text)  # plans and kernels are made once
    start = time.process_time()
    found = module.eval(text)
    seconds = time.process_time() - start
    sampled = sampler(world)
    start = time.process_time()
    value, slope = sampled()
    spent = time.process_time() - start
    ours = float(found.value), float(found.tangent), float(found.tangent_error)
    return Row(world, *ours, seconds, value, slope, spent)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jax", action="store_true", help="sums by JAX instead of numpy")
    options = parser.parse_args()
    try:
        print("| program | value | of samples | derivative | may be off by | of the sum | time | of the sum |")
        print("|---|---|---|---|---|---|---|---|")
        for world in WORLDS:
            found = row(world, by_jax if options.jax else by_numpy)
            numbers = [f"{x:.9g}" for x in (found.value, found.sampled, found.slope)]
            sums = [f"{found.error:.0e}", f"{found.sampled_slope:.9g}"]
            times = [f"{1000 * t:.1f} ms" for t in (found.seconds, found.sampled_seconds)]
            print("| " + " | ".join([f"`{world.program}`", *numbers, *sums, *times]) + " |", flush=True)
    except ModuleNotFoundError as error:
        sys.exit(f"beside.py: {error.name} is not installed: pip install '.[jax]'")


if __name__ == "__main__":
    main()
