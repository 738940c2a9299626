"""The builtins of Potto.

Owns nothing itself: importing it registers every entry, file by file, in `PRIMITIVES`. See `registry` for what an
entry says.
"""

import os
from importlib import import_module

from potto.primitives.registry import EXACT, EXPONENT, PRIMITIVES, UNDOES, Primitive, register

for _file in sorted(os.listdir(os.path.dirname(__file__))):
    if _file.endswith(".py") and _file != "__init__.py":
        import_module(f"{__name__}.{_file.removesuffix('.py')}")

__all__ = ["EXACT", "EXPONENT", "PRIMITIVES", "UNDOES", "Primitive", "register"]
