"""Functions of Potto as functions of PyTorch.

Owns `to_torch`. What autograd sees is three functions of rows of numbers: values, whose derivatives are slopes, whose
derivatives are curvatures. All have a batch of any shape in front, so `vmap` only moves its axis there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from potto.bridges.flat import FlatFunction, Leaf, Shapes
from potto.extras import install_command
from potto.kernels.errors import wrong_call
from potto.python.functions import Function
from potto.python.named_parameters import Names
from potto.python.remade import remade


@remade
def to_torch(
    function: Function, *, wrt: Names = None, given: Mapping[str, Any] | None = None, error: bool = False
) -> Callable[..., Any]:
    """The function as one of PyTorch, for `backward`, `torch.func` (`grad`, `jvp`, `vjp`, `hessian`, `vmap`), modules.

    It takes what `function` takes, by place or by name: tensors broadcast; a parameter that is a tuple takes a tuple or
    a tensor whose last axis has its length; an array has its own axes last; a record is a dict. wrt: the parameters
    that it can be differentiated by (all); by others derivatives are 0, and cost nothing. given: what some
    parameters are once and for all, such as functions. error: answer with a pair, the value and a bound of its error,
    which has no derivative.

    Potto computes with doubles on the CPU; the answer has the dtype and the device of the arguments. `torch.compile`
    runs it as it is, outside of the graph.

    Raises PottoError if PyTorch is not installed, or a parameter or the answer is nothing that it knows.
    """
    try:
        import torch
    except ImportError:
        raise wrong_call("PyTorch is not installed", install_command("torch")) from None
    flat = FlatFunction(function, wrt, given)
    answer = _functions(torch)

    @torch.compiler.disable  # type: ignore[untyped-decorator]
    def called(*args: Any, **kwargs: Any) -> Any:
        named = flat.bound(args, kwargs)
        like = _like(named, torch)
        sides = [_rows(leaves, flat, named, like, torch) for leaves in (flat.moving, flat.still)]
        batch = torch.broadcast_shapes(*(b for shapes, parts in sides for b in _batches(shapes, parts)))
        moving, still = (_joined(shapes, parts, batch, like) for shapes, parts in sides)
        value, off = answer(moving, still.detach(), flat, (sides[0][0], sides[1][0]))
        return (flat.shaped(value), flat.shaped(off)) if error else flat.shaped(value)

    return called  # type: ignore[no-any-return]


def _like(named: Mapping[str, Any], torch: Any) -> Any:
    """A tensor of the precision, and on the device, that the answer is to have."""
    found = [leaf for leaf in _tensors(named.values()) if isinstance(leaf, torch.Tensor)]
    floating = [tensor.dtype for tensor in found if tensor.dtype.is_floating_point]
    dtype = torch.get_default_dtype() if not floating else floating[0]
    for other in floating[1:]:
        dtype = torch.promote_types(dtype, other)
    return torch.zeros(0, dtype=dtype, device=found[0].device if found else None)


def _tensors(arguments: Any) -> Any:
    for argument in arguments:
        if isinstance(argument, Mapping):
            yield from _tensors(argument.values())
        elif isinstance(argument, tuple | list):
            yield from _tensors(argument)
        else:
            yield argument


def _rows(
    leaves: Sequence[Leaf], flat: FlatFunction, named: Mapping[str, Any], like: Any, torch: Any
) -> tuple[Shapes, list[Any]]:
    """The tensors of leaves, and the shape of each without a batch."""

    def tensors(argument: Any) -> Any:
        if isinstance(argument, Mapping):
            return {name: tensors(item) for name, item in argument.items()}
        if isinstance(argument, tuple | list):
            return tuple(tensors(item) for item in argument)
        return torch.as_tensor(argument, dtype=like.dtype, device=like.device)

    named = {name: tensors(argument) for name, argument in named.items()}
    parts = flat.parts(leaves, named, lambda items: torch.stack(torch.broadcast_tensors(*items), -1))
    return tuple(tuple(part.shape[part.ndim - leaf.axes :]) for leaf, part in zip(leaves, parts, strict=True)), parts


def _batches(shapes: Shapes, parts: Sequence[Any]) -> list[tuple[int, ...]]:
    return [tuple(part.shape[: part.ndim - len(shape)]) for shape, part in zip(shapes, parts, strict=True)]


def _joined(shapes: Shapes, parts: Sequence[Any], batch: Any, like: Any) -> Any:
    """Tensors as rows of numbers over a batch."""
    rows = [
        part.expand((*batch, *shape)).reshape((*batch, int(np.prod(shape))))
        for shape, part in zip(shapes, parts, strict=True)
    ]
    import torch

    return torch.cat(rows, -1) if rows else like.new_zeros((*batch, 0))


def _functions(torch: Any) -> Callable[..., Any]:
    """Values, as autograd is to see them: classes that inherit from those of PyTorch, which is imported when it is
    asked for; so all of them are made in here."""

    def asked(question: str, moving: Any, still: Any, flat: FlatFunction, sizes: Any) -> tuple[Any, ...]:
        rows = (tensor.detach().to("cpu", torch.float64).numpy() for tensor in (moving, still))
        return tuple(torch.from_numpy(part.copy()).to(moving) for part in getattr(flat, question)(sizes, *rows))

    class Rows(torch.autograd.Function):  # type: ignore[misc]
        """What the three have in common: the question to Potto, its arguments kept, and batches."""

        @staticmethod
        def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
            moving, still, ctx.flat, ctx.sizes = inputs
            ctx.save_for_backward(moving, still)
            ctx.save_for_forward(moving, still)
            ctx.set_materialize_grads(False)
            ctx.mark_non_differentiable(output[1])

    def batched(kind: Any, info: Any, dims: Any, moving: Any, still: Any, flat: FlatFunction, sizes: Any) -> Any:
        rows = [
            tensor.expand(info.batch_size, *tensor.shape) if dim is None else tensor.movedim(dim, 0)
            for tensor, dim in zip((moving, still), dims)
        ]
        found = kind.apply(*rows, flat, sizes)
        return found, tuple(0 for _ in found)

    class Curvatures(Rows):
        @staticmethod
        def forward(moving: Any, still: Any, flat: FlatFunction, sizes: Any) -> Any:
            return asked("curvatures", moving, still, flat, sizes)

        @staticmethod
        def backward(ctx: Any, *cotangents: Any) -> Any:
            raise wrong_call("a function of Potto has first and second derivatives in PyTorch, but no third ones")

        @staticmethod
        def jvp(ctx: Any, *tangents: Any) -> Any:
            raise wrong_call("a function of Potto has first and second derivatives in PyTorch, but no third ones")

        @staticmethod
        def vmap(info: Any, dims: Any, *args: Any) -> Any:
            return batched(Curvatures, info, dims, *args)

    class Slopes(Rows):
        @staticmethod
        def forward(moving: Any, still: Any, flat: FlatFunction, sizes: Any) -> Any:
            return asked("slopes", moving, still, flat, sizes)

        @staticmethod
        def backward(ctx: Any, of_value: Any, _: Any, of_slope: Any) -> Any:
            _, _, slope, curvature = Curvatures.apply(*ctx.saved_tensors, ctx.flat, ctx.sizes)
            found = torch.zeros_like(ctx.saved_tensors[0])
            if of_value is not None:
                found = found + (of_value.unsqueeze(-1) * slope).sum(-2)
            if of_slope is not None:
                found = found + (of_slope.unsqueeze(-1) * curvature).sum((-3, -2))
            return found, None, None, None

        @staticmethod
        def jvp(ctx: Any, tangent: Any, *_: Any) -> Any:
            _, _, slope, curvature = Curvatures.apply(*ctx.saved_tensors, ctx.flat, ctx.sizes)
            turned = (curvature * tangent.unsqueeze(-2).unsqueeze(-2)).sum(-1)
            return (slope * tangent.unsqueeze(-2)).sum(-1), None, turned

        @staticmethod
        def vmap(info: Any, dims: Any, *args: Any) -> Any:
            return batched(Slopes, info, dims, *args)

    class Values(Rows):
        @staticmethod
        def forward(moving: Any, still: Any, flat: FlatFunction, sizes: Any) -> Any:
            return asked("values", moving, still, flat, sizes)

        @staticmethod
        def backward(ctx: Any, of_value: Any, _: Any) -> Any:
            if of_value is None:
                return None, None, None, None
            _, _, slope = Slopes.apply(*ctx.saved_tensors, ctx.flat, ctx.sizes)
            return (of_value.unsqueeze(-1) * slope).sum(-2), None, None, None

        @staticmethod
        def jvp(ctx: Any, tangent: Any, *_: Any) -> Any:
            _, _, slope = Slopes.apply(*ctx.saved_tensors, ctx.flat, ctx.sizes)
            return (slope * tangent.unsqueeze(-2)).sum(-1), None

        @staticmethod
        def vmap(info: Any, dims: Any, *args: Any) -> Any:
            return batched(Values, info, dims, *args)

    return Values.apply  # type: ignore[no-any-return]
