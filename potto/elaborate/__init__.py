"""Elaboration: trees to core terms, the only bridge between syntax and the calculus.

Owns scopes and what names stand for in a definition; which conditional, call or binder of the core each piece of syntax
is. Definitions are named (`Global`), never looked into; only their signatures are read. What is wrong becomes a `Hole`
without a word: the checker of types says it.
"""

from potto.elaborate.definitions import (
    BindCore,
    DiffeoCore,
    Elaborated,
    ForCore,
    InverseCore,
    ShowCore,
    StatementCore,
    core,
    core_term,
    diffeo_core,
    elaborate_expression,
    elaborate_statement,
)
from potto.elaborate.signatures import CoreSignature, signature

__all__ = [
    "BindCore",
    "CoreSignature",
    "DiffeoCore",
    "Elaborated",
    "ForCore",
    "InverseCore",
    "ShowCore",
    "StatementCore",
    "core",
    "core_term",
    "diffeo_core",
    "elaborate_expression",
    "elaborate_statement",
    "signature",
]
