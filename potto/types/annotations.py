"""Written types: what an annotation says, and where what was found does not hold to it.

An annotation gives the shape to inference. What it says about variation (`Real` against `Real*`) is checked by
`closing` once the dependence is known.
"""

from __future__ import annotations

from typing import assert_never

from potto.syntax import nodes
from potto.types import kinds
from potto.types.context import Inference
from potto.types.types import REAL, UNKNOWN, Diffeo, Function, ListOf, Parameter, TupleOf, Type

MAX_DIMS = 64


def written_type(inference: Inference, annotation: nodes.TypeExpr) -> Type:
    """The shape that an annotation gives."""
    match annotation:
        case nodes.RealType():
            return REAL
        case nodes.TupleType(items=items):
            return TupleOf(tuple(written_type(inference, item) for item in items))
        case nodes.ListType(item=item):
            return ListOf(written_type(inference, item))
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


def _parameter(inference: Inference, parameter: nodes.Parameter) -> Type:
    if parameter.annotation is None:
        return inference.fresh()
    return written_type(inference, parameter.annotation)
