"""Potto: a differentiable language with an integral primitive.

Owns the names that Python programs use. They are loaded when they are first used, so that `import potto` costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from potto_repl.magics import load_ipython_extension
    from potto_repl.sliders import sliders

    from potto.applications.fitting import fit
    from potto.bridges.to_jax import to_jax
    from potto.bridges.to_scipy import to_scipy
    from potto.bridges.to_torch import to_torch
    from potto.diagnostics import PottoError
    from potto.integrate.costs import counting
    from potto.projects.settings import settings
    from potto.python.api import Module, ProgramWarning, Workspace, compile, load
    from potto.python.following import Advance
    from potto.python.functions import Function, deriv
    from potto.python.gradients import grad, jacobian, jvp, value_and_grad, vjp
    from potto.python.hessian import hessian, hvp
    from potto.python.tiles import Interrupted
    from potto.runtime.answers.estimate import Estimate

__version__ = "0.1.0"
__all__ = [
    "Advance",
    "Estimate",
    "Function",
    "Interrupted",
    "Module",
    "PottoError",
    "ProgramWarning",
    "Workspace",
    "__version__",
    "compile",
    "counting",
    "deriv",
    "fit",
    "grad",
    "hessian",
    "hvp",
    "jacobian",
    "jvp",
    "load",
    "load_ipython_extension",
    "settings",
    "sliders",
    "to_jax",
    "to_scipy",
    "to_torch",
    "value_and_grad",
    "vjp",
]

_HOMES = {
    "Advance": "potto.python.following",
    "Estimate": "potto.runtime.answers.estimate",
    "Function": "potto.python.functions",
    "Interrupted": "potto.python.tiles",
    "PottoError": "potto.diagnostics",
    "counting": "potto.integrate.costs",
    "deriv": "potto.python.functions",
    "fit": "potto.applications.fitting",
    "grad": "potto.python.gradients",
    "hessian": "potto.python.hessian",
    "hvp": "potto.python.hessian",
    "jacobian": "potto.python.gradients",
    "jvp": "potto.python.gradients",
    "load_ipython_extension": "potto_repl.magics",
    "settings": "potto.projects.settings",
    "sliders": "potto_repl.sliders",
    "to_jax": "potto.bridges.to_jax",
    "to_scipy": "potto.bridges.to_scipy",
    "to_torch": "potto.bridges.to_torch",
    "value_and_grad": "potto.python.gradients",
    "vjp": "potto.python.gradients",
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'potto' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(_HOMES.get(name, "potto.python.api")), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
