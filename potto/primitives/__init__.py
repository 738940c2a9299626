"""The builtins of Potto.

Owns nothing itself: importing it registers every entry, file by file, in `PRIMITIVES`. See `registry` for what an
entry says.
"""

from importlib import import_module
from pathlib import Path

from potto.primitives.registry import EXACT, EXPONENT, PRIMITIVES, UNDOES, Primitive, register

for _file in sorted(Path(__file__).parent.glob("*.py")):
    if _file.stem != "__init__":
        import_module(f"{__name__}.{_file.stem}")

__all__ = ["EXACT", "EXPONENT", "PRIMITIVES", "UNDOES", "Primitive", "register"]
