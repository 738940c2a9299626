"""The parameters that a derivative is taken by, as a caller names them.

Owns `Names` and `parameters_to_vary`.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from potto.kernels.errors import wrong_call
from potto.python.functions import Function, must_be_function

Names = Sequence[str] | str | None


def parameters_to_vary(function: Function, wrt: Names) -> tuple[str, ...]:
    """The names in `wrt`, each once, or that of the first parameter. Raises PottoError if they are none of them."""
    must_be_function(function)
    parameters = function.parameters
    if wrt is None:
        if not parameters or not parameters[0]:
            raise wrong_call("the first parameter has no name, and derivatives are taken by names")
        return parameters[:1]
    if not isinstance(wrt, str | Sequence) or not all(isinstance(name, str) for name in wrt):
        raise wrong_call(f"`wrt` takes the names of parameters, not {wrt!r}")
    names = (wrt,) if isinstance(wrt, str) else tuple(dict.fromkeys(wrt))
    if not names:
        raise wrong_call("`wrt` names no parameter to differentiate by")
    for name in names:
        if name not in parameters:
            near = difflib.get_close_matches(name, [p for p in parameters if p], 1)
            named = ", ".join(f"`{p}`" for p in parameters if p)
            hint = f"did you mean `{near[0]}`?" if near else f"its parameters are {named}" if named else ""
            raise wrong_call(f"`{function.written}` has no parameter `{name}`", hint)
    return names
