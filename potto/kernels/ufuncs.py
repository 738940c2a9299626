"""Functions over arrays that builtins need and numpy lacks. The registry names them "potto.<name>".

Like a numpy ufunc they take arrays or numbers, broadcast, and write into `out` when it is given.
"""

from __future__ import annotations

from typing import Any

import numpy as np


def clamp(x: Any, lo: Any, hi: Any, out: Any = None) -> Any:
    """min(max(x, lo), hi), nan where any of them is."""
    return np.minimum(np.maximum(x, lo), hi, out=out)
