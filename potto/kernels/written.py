"""Kernels that are written: as they run, and as they are kept on disk.

Owns `Kernel` and `Written`.
"""

from __future__ import annotations

import marshal
from collections.abc import Callable
from typing import Any

from msgspec import Struct

from potto.core.terms import Lam, postorder
from potto.kernels import support
from potto.kernels.cells import Cell, Value, listed, scalar_parts


class Kernel(Struct, frozen=True):
    """A compiled kernel: its function, its text (for `potto dump kernel`), and the parameters that it takes.

    plain: whether it works point by point, without asking anything of the runtime but how conditions fall. native: what
    there is of it in machine code (`native.points`).
    """

    run: Callable[..., Value]
    text: str
    params: tuple[str, ...]
    plain: bool = False
    native: dict[Any, Any] = {}


class Written(Struct, frozen=True):
    """A kernel as it can be kept: its text, that as Python's code, and what the text calls by name.

    functions: the paths of those of `support`. objects: subterms of the function, by their places in its postorder.
    """

    text: str
    code: bytes
    functions: dict[str, str]
    objects: dict[str, int | tuple[int, ...]]
    plain: bool

    def linked(self, lam: Lam) -> Kernel:
        """The kernel of the function that it was written for."""
        scope: dict[str, Any] = {name: support.function(path) for name, path in self.functions.items()}
        if self.objects:
            terms = postorder(lam.body)
            for name, at in self.objects.items():
                scope[name] = tuple(terms[place] for place in at) if isinstance(at, tuple) else terms[at]
        scope.update(Cell=Cell, parts=scalar_parts, listed=listed)
        exec(marshal.loads(self.code), scope)
        return Kernel(scope["kernel"], self.text, lam.params, self.plain)
