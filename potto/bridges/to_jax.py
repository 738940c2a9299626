"""Functions of Potto as functions of JAX.

Owns `to_jax`. A call is one callback, also under `vmap`. The rule for tangents multiplies them with slopes that a
callback gives. That is linear in the tangents, so JAX transposes it by itself: forward and reverse are one rule. The
slopes have such a rule as well, with second derivatives; a third time there is none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from potto.bridges.flat import FlatFunction, Leaf, Shapes
from potto.extras import install_command
from potto.kernels.errors import wrong_call
from potto.python.functions import Function
from potto.python.named_parameters import Names
from potto.python.remade import remade

Sizes = tuple[Shapes, Shapes]


@remade
def to_jax(
    function: Function, *, wrt: Names = None, given: Mapping[str, Any] | None = None, error: bool = False
) -> Callable[..., Any]:
    """The function as one of JAX, for `grad`, `jvp`, `vjp`, `hessian`, `vmap` and `jit`.

    It takes what `function` takes, by place or by name: arrays broadcast; a parameter that is a tuple takes a tuple or
    an array whose last axis has its length; an array has its own axes last; a record is a dict. wrt: the parameters
    that it can be differentiated by (all); by others derivatives are 0, and cost nothing. given: what some
    parameters are once and for all, such as functions. error: answer with a pair, the value and a bound of its error,
    which has no derivative.

    Numbers have JAX's precision: single, unless `jax_enable_x64` is set. Potto computes with doubles either way.

    Raises PottoError if JAX is not installed, or a parameter or the answer is nothing that JAX knows.
    """
    try:
        import jax
    except ImportError:
        raise wrong_call("JAX is not installed", install_command("jax")) from None
    flat = FlatFunction(function, wrt, given)
    answer = _rules(flat, jax)

    def called(*args: Any, **kwargs: Any) -> Any:
        named = flat.bound(args, kwargs)
        sides = [_rows(leaves, flat, named, jax) for leaves in (flat.moving, flat.still)]
        dtype = jax.numpy.result_type(float, *(part for _, parts in sides for part in parts))
        batch = np.broadcast_shapes(*(shape for shapes, parts in sides for shape in _batches(shapes, parts)))
        moving, still = (_joined(shapes, parts, batch, dtype, jax) for shapes, parts in sides)
        value, off = answer((sides[0][0], sides[1][0]), moving, jax.lax.stop_gradient(still))
        return (flat.shaped(value), flat.shaped(off)) if error else flat.shaped(value)

    return called


def _rows(leaves: Sequence[Leaf], flat: FlatFunction, named: Mapping[str, Any], jax: Any) -> tuple[Shapes, list[Any]]:
    """The arrays of leaves, and the shape of each without a batch."""
    numpy = jax.numpy
    named = {name: jax.tree.map(numpy.asarray, argument) for name, argument in named.items()}
    parts = flat.parts(leaves, named, lambda items: numpy.stack(numpy.broadcast_arrays(*items), axis=-1))
    return tuple(tuple(part.shape[part.ndim - leaf.axes :]) for leaf, part in zip(leaves, parts, strict=True)), parts


def _batches(shapes: Shapes, parts: Sequence[Any]) -> list[tuple[int, ...]]:
    return [tuple(part.shape[: part.ndim - len(shape)]) for shape, part in zip(shapes, parts, strict=True)]


def _joined(shapes: Shapes, parts: Sequence[Any], batch: tuple[int, ...], dtype: Any, jax: Any) -> Any:
    """Arrays as rows of numbers over a batch."""
    numpy = jax.numpy
    rows = [
        numpy.broadcast_to(part, (*batch, *shape)).reshape((*batch, int(np.prod(shape)))).astype(dtype)
        for shape, part in zip(shapes, parts, strict=True)
    ]
    return numpy.concatenate(rows, axis=-1) if rows else numpy.zeros((*batch, 0), dtype)


def _rules(flat: FlatFunction, jax: Any) -> Callable[[Sizes, Any, Any], Any]:
    """The function of rows, with the rule for its tangents, and for theirs."""

    def ask(question: Callable[..., Any], axes: Callable[[int], list[tuple[int, ...]]]) -> Callable[..., Any]:
        """A question to Potto as a call of JAX; axes: of each part of the answer, for so many numbers that move."""

        def asked(sizes: Sizes, moving: Any, still: Any) -> Any:
            batch, dtype = moving.shape[:-1], moving.dtype

            def back(moving: Any, still: Any) -> Any:
                return tuple(part.astype(dtype) for part in question(sizes, np.asarray(moving), np.asarray(still)))

            shapes = [jax.ShapeDtypeStruct((*batch, *shape), dtype) for shape in axes(moving.shape[-1])]
            return jax.pure_callback(back, tuple(shapes), moving, still, vmap_method="broadcast_all")

        return asked

    m, along = flat.width, partial(jax.numpy.einsum, "...mp,...p->...m")
    first: list[tuple[int, ...]] = [(m,), (m,)]
    values = jax.custom_jvp(ask(flat.values, lambda p: first), nondiff_argnums=(0,))
    slopes = jax.custom_jvp(ask(flat.slopes, lambda p: [*first, (m, p)]), nondiff_argnums=(0,))
    curvatures = jax.custom_jvp(ask(flat.curvatures, lambda p: [*first, (m, p), (m, p, p)]), nondiff_argnums=(0,))

    def of_values(sizes: Sizes, at: Any, tangents: Any) -> Any:
        value, off, slope = slopes(sizes, *at)
        return (value, off), (along(slope, tangents[0]), jax.numpy.zeros_like(off))

    def of_slopes(sizes: Sizes, at: Any, tangents: Any) -> Any:
        value, off, slope, curvature = curvatures(sizes, *at)
        turned = jax.numpy.einsum("...mpq,...q->...mp", curvature, tangents[0])
        return (value, off, slope), (along(slope, tangents[0]), jax.numpy.zeros_like(off), turned)

    def of_curvatures(sizes: Sizes, at: Any, tangents: Any) -> Any:
        raise wrong_call("a function of Potto has first and second derivatives in JAX, but no third ones")

    values.defjvp(of_values)
    slopes.defjvp(of_slopes)
    curvatures.defjvp(of_curvatures)
    return values  # type: ignore[no-any-return]
