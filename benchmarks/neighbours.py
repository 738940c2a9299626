"""One derivative in the tools that a reader may know: `python benchmarks/neighbours.py`.

A disc of radius r and of brightness r is seen in the square [-1, 1]^2; asked are the mean and its derivative
at r = 0.6. The mean is pi*r^3/4. A third of its derivative, 3*pi*r^2/4, is the brightness's, and two thirds are the
edge's: what is blind to the edge answers a third, and says nothing of it.

Each tool is asked as its pages have it, in an environment of its own if need be: what cannot be imported is listed as
such. Answers that are drawn are the mean of eight seeds, with the standard deviation of one of them. Times are the
least of several, warm. Dr.Jit and Mitsuba need LLVM's library, 19 say (DRJIT_LIBLLVM_PATH).
"""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

R = 0.6
EXACT = (np.pi * R**3 / 4, 3 * np.pi * R**2 / 4)
POINTS = 1000  # along each side, of those that take sums
SEEDS = 8


class Answer(NamedTuple):
    """What a tool says in one way of asking: value and derivative of each seed, or why there is none; and its time."""

    how: str
    pairs: list[tuple[float, float]]
    refused: str = ""
    seconds: float = 0.0


def timed(call: Callable[[], Any], rounds: int = 5) -> float:
    call()
    spent = []
    for _ in range(rounds):
        start = time.perf_counter()
        call()
        spent.append(time.perf_counter() - start)
    return min(spent)


def asked(how: str, call: Callable[[int], tuple[float, float]], seeds: int = 1) -> Answer:
    """One way of asking. A tool that refuses has its words kept."""
    try:
        pairs = [call(seed) for seed in range(seeds)]
        return Answer(how, pairs, "", timed(lambda: call(0)))
    except (RuntimeError, TypeError, NotImplementedError) as refusal:
        return Answer(how, [], str(refusal).partition("\n")[0].partition(". ")[0])


def by_potto() -> Iterator[Answer]:
    import potto

    m = potto.compile("def mean(r) integral ([-1, 1], [-1, 1]) r/4*[x^2 + y^2 < r^2] d(x, y)")
    slope = potto.value_and_grad(m.mean)
    yield asked("as it is written", lambda seed: tuple(map(float, slope(R))))


def by_jax() -> Iterator[Answer]:
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    side = (jnp.arange(POINTS) + 0.5) / POINTS * 2 - 1

    def mean(r: Any) -> Any:
        return jnp.where(side[:, None] ** 2 + side**2 < r**2, r, 0.0).mean()

    pair = jax.jit(jax.value_and_grad(mean))
    yield asked("`grad` of a mean of 1,000,000 points", lambda seed: tuple(map(float, pair(R))))


def by_torch() -> Iterator[Answer]:
    import torch

    side = (torch.arange(POINTS, dtype=torch.float64) + 0.5) / POINTS * 2 - 1

    def call(seed: int) -> tuple[float, float]:
        r = torch.tensor(R, dtype=torch.float64, requires_grad=True)
        mean = torch.where(side[:, None] ** 2 + side**2 < r**2, r, 0.0).mean()
        mean.backward()
        return float(mean.detach()), float(r.grad)

    yield asked("`backward` of a mean of 1,000,000 points", call)


def by_quadax() -> Iterator[Answer]:
    import jax
    import jax.numpy as jnp
    from quadax import quadgk

    jax.config.update("jax_enable_x64", True)

    def inside(y: Any, x: Any, r: Any) -> Any:
        return jnp.where(x**2 + y**2 < r**2, r / 4, 0.0)

    def across(x: Any, r: Any, cut: bool) -> Any:
        within = abs(x) < r
        edge = jnp.where(within, jnp.sqrt(jnp.where(within, r**2 - x**2, 1.0)), 0.0)
        ends = jnp.array([-1.0, -edge, edge, 1.0]) if cut else jnp.array([-1.0, 1.0])
        return quadgk(inside, ends, (x, r))[0]

    def mean(r: Any, cut: bool) -> Any:
        ends = jnp.array([-1.0, -r, r, 1.0]) if cut else jnp.array([-1.0, 1.0])
        return quadgk(jnp.vectorize(lambda x: across(x, r, cut)), ends)[0]

    for how, cut in (("nested, with `where`", False), ("nested, with breakpoints worked out by hand", True)):
        pair = jax.jit(jax.value_and_grad(lambda r, cut=cut: mean(r, cut)))
        yield asked(how, lambda seed, pair=pair: tuple(map(float, pair(R))))


def by_drjit() -> Iterator[Answer]:
    import drjit as dr
    from drjit.llvm.ad import Float64

    def call(seed: int) -> tuple[float, float]:
        x, y = dr.meshgrid(*[(dr.arange(Float64, POINTS) + 0.5) / POINTS * 2 - 1] * 2)
        r = Float64(R)
        dr.enable_grad(r)
        mean = dr.mean(dr.select(x * x + y * y < r * r, r, 0))
        dr.backward(mean)
        return float(mean[0]), float(dr.grad(r)[0])

    yield asked("`backward` of a mean of 1,000,000 points", call)


def by_mitsuba() -> Iterator[Answer]:
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}, "sample_border": True,
            "pixel_format": "luminance", "component_format": "float32"}  # fmt: skip
    fov = float(np.degrees(2 * np.arctan(0.5)))  # one to each side at a distance of 2
    view = mi.ScalarTransform4f().look_at([0, 0, 2], [0, 0, 0], [0, 1, 0])
    light = {"type": "area", "radiance": {"type": "uniform", "value": R}}
    for integrator in ("direct", "direct_projective"):
        scene = mi.load_dict({
            "type": "scene", "integrator": {"type": integrator},
            "sensor": {"type": "perspective", "fov": fov, "to_world": view, "film": film},
            "disk": {"type": "disk", "to_world": mi.ScalarTransform4f().scale(R), "emitter": light},
        })  # fmt: skip
        parameters = mi.traverse(scene)

        def call(seed: int, scene: Any = scene, parameters: Any = parameters) -> tuple[float, float]:
            r = mi.Float(R)
            dr.enable_grad(r)
            parameters["disk.to_world"] = mi.Transform4f().scale(mi.Vector3f(r, r, 1))
            parameters["disk.emitter.radiance.value"] = r
            parameters.update()
            mean = dr.mean(mi.render(scene, parameters, spp=1024, seed=seed), axis=None)
            dr.forward(r)
            return float(mean.array[0]), float(dr.grad(mean).array[0])

        yield asked(f"`{integrator}`, 16 x 16 pixels, 1,024 samples each", call, SEEDS)


def by_genjax() -> Iterator[Answer]:
    import jax
    import jax.numpy as jnp
    from genjax import seed as seeded
    from genjax.adev import Dual, expectation, flip_reinforce, uniform_reparam

    @expectation
    def compared(r: Any) -> Any:
        x, y = uniform_reparam(-1.0, 1.0), uniform_reparam(-1.0, 1.0)
        return jnp.where(x**2 + y**2 < r**2, r, 0.0)

    @expectation
    def coin(r: Any) -> Any:
        return jnp.where(flip_reinforce(jnp.pi * r**2 / 4), r, 0.0)

    for how, program in (("a comparison of uniform draws, 100,000", compared), ("a coin of pi*r^2/4, 100,000", coin)):
        once = seeded(lambda program=program: program.jvp_estimate(Dual(R, 1.0)))
        many = jax.jit(jax.vmap(once))

        def call(seed: int, many: Any = many) -> tuple[float, float]:
            dual = many(jax.random.split(jax.random.key(seed), 100_000))
            return float(dual.primal.mean()), float(dual.tangent.mean())

        yield asked(how, call, SEEDS)


TOOLS: dict[str, tuple[str, Callable[[], Iterator[Answer]]]] = {
    "Potto": ("potto", by_potto),
    "JAX": ("jax", by_jax),
    "PyTorch": ("torch", by_torch),
    "quadax": ("quadax", by_quadax),
    "Dr.Jit": ("drjit", by_drjit),
    "Mitsuba": ("mitsuba", by_mitsuba),
    "GenJAX": ("genjax", by_genjax),
}


def line(answer: Answer) -> str:
    if not answer.pairs:
        return f"  {answer.how:48} refused: {answer.refused}"
    middles = [float(np.mean(column)) for column in zip(*answer.pairs)]
    spread = f" +- {np.std([slope for _, slope in answer.pairs]):.1e}" if len(answer.pairs) > 1 else ""
    off = [abs(found / exact - 1) for found, exact in zip(middles, EXACT)]
    return (f"  {answer.how:48} {middles[0]:.12f}  {middles[1]:.12f}{spread}  "
            f"off by {off[0]:.0e}, {off[1]:.0e}  {answer.seconds * 1000:.3g} ms")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", choices=TOOLS, help="these tools")
    chosen = parser.parse_args().only or list(TOOLS)
    print(f"  {'exact':48} {EXACT[0]:.12f}  {EXACT[1]:.12f}")
    for name in chosen:
        package, answers = TOOLS[name]
        if importlib.util.find_spec(package) is None:
            print(f"{name}: not installed")
            continue
        print(f"{name} {importlib.metadata.version(package)}")
        for answer in answers():
            print(line(answer), flush=True)


if __name__ == "__main__":
    main()
