"""Written types: what an annotation says, and where what was found does not hold to it.

An annotation gives the shape to inference. What it says about variation (`Real` against `Real*`) is checked by
`closing` once the dependence is known.
"""

from __future__ import annotations

from typing import assert_never

from potto.diagnostics import Diagnostic, Related
from potto.syntax import nodes
from potto.types import kinds
from potto.types.context import Inference
from potto.types.records import named_type
from potto.types.scope import Local
from potto.types.types import (
    ANY_SIZE,
    REAL,
    UNKNOWN,
    ArrayOf,
    Count,
    Diffeo,
    Function,
    Meta,
    Parameter,
    TupleOf,
    Type,
    shifted,
)

MAX_DIMS = 64
KNOWN = "`Real`, `Real*`, `Real[x]`, `Dist[x]`, `(T, U)`, `[n] T`, `T -> U` and `Diffeo[n]`"


def written_type(inference: Inference, annotation: nodes.TypeExpr) -> Type:
    """The shape that an annotation gives."""
    match annotation:
        case nodes.RealType():
            return REAL
        case nodes.TupleType(items=items):
            return TupleOf(tuple(written_type(inference, item) for item in items))
        case nodes.ArrayType(sizes=sizes, item=item):
            found = written_type(inference, item)
            for size in reversed(sizes):
                found = ArrayOf(_size(inference, size), found)
            return found
        case nodes.NamedType():
            return named_type(inference, annotation, KNOWN)
        case nodes.FunctionType(parameters=parameters, result=result):
            group = tuple(Parameter(None, _parameter(inference, parameter)) for parameter in parameters)
            return Function(group, written_type(inference, result))
        case nodes.DiffeoType(span=span, dims=dims):
            if 1 <= dims <= MAX_DIMS:
                return Diffeo(dims)
            message = f"a diffeomorphism has 1 to {MAX_DIMS} dimensions"
            inference.report(kinds.ANNOTATION(span, message, label="cannot be", help="write for example `Diffeo[2]`"))
            return UNKNOWN
        case _:
            assert_never(annotation)


def _size(inference: Inference, size: nodes.Size) -> Type:
    """A size as it is written; a name of a size is a number in the body."""
    if size.name is None:
        return Count(size.offset)
    if size.name in ("", "_"):
        return ANY_SIZE
    known = inference.sizes.get(size.name)
    if known is None:
        known = inference.sizes[size.name] = Meta(1, size=size.name)
        before = inference.scope.find(size.name)
        if before is None:
            inference.scope.bind(Local(size.name, size.span, "size", REAL, used=True))
        elif before.kind == "parameter":
            inference.report(_two_names(size, before))
    return shifted(known, size.offset)


def _two_names(size: nodes.Size, before: Local) -> Diagnostic:
    """A size that is called as a parameter is: the name is the parameter's, and the size has none."""
    name = size.name or ""
    return kinds.SHADOWED(
        size.span,
        f"the size `{name}` is not the parameter `{name}`, which hides it",
        label="a size of its own",
        related=(Related(before.span, f"`{name}` means this number"),),
        help="leave the parameter out, since a size is a number in the body; or give one of them another name",
    )


def _parameter(inference: Inference, parameter: nodes.Parameter) -> Type:
    if parameter.annotation is None:
        return inference.fresh()
    return written_type(inference, parameter.annotation)
