"""Types: what every value is, what it varies with, and the rule that no variable of integration decides a plain
condition.

Owns types and their printing, inference, the abstract walk over dependence, and interfaces. Knows syntax and modules,
no core terms. See docs/types.md.
"""

from potto.types.analysis import Typed
from potto.types.format import format_type
from potto.types.interfaces import Interface
from potto.types.queries import (
    Inferred,
    check_definition,
    check_statement,
    expression_names,
    infer_expression,
    interface,
    plain_reasons,
    shape,
    typed_names,
)
from potto.types.types import (
    ArrayOf,
    Diffeo,
    Dist,
    Function,
    Parameter,
    Real,
    Truth,
    TupleOf,
    Type,
    TypeVariable,
    Unknown,
    derivative_type,
    groups_of,
    result_of,
)

__all__ = [
    "ArrayOf",
    "Diffeo",
    "Dist",
    "Function",
    "Inferred",
    "Interface",
    "Parameter",
    "Real",
    "Truth",
    "TupleOf",
    "Type",
    "TypeVariable",
    "Typed",
    "Unknown",
    "check_definition",
    "check_statement",
    "derivative_type",
    "expression_names",
    "format_type",
    "groups_of",
    "infer_expression",
    "interface",
    "plain_reasons",
    "result_of",
    "shape",
    "typed_names",
]
