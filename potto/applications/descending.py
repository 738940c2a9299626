"""Other ways down than L-BFGS: Gauss-Newton for squared distances, Adam for what is noisy or has kinks.

Both ask a `Minimization` for values and tell it steps; it keeps the best place and leaves at a minimum.
"""

from __future__ import annotations

import math

import numpy as np

from potto.applications.minimization import Minimization
from potto.kernels.cells import Array

RATE = 0.2  # of Adam, in first steps: where a parameter goes at most in one step; it falls to 0 as a cosine
MEMORY_OF_SLOPES, MEMORY_OF_SQUARES = 0.9, 0.99
DAMPING = 1e-3  # at the start, of the diagonal of the normal matrix
MOST_DAMPING = 1e12


def gauss_newton(walk: Minimization, start: Array, unit: Array, most: int) -> str:
    """Steps that a linear model of the residuals makes, damped (Levenberg and Marquardt). Why it ends."""
    damping = DAMPING
    for _ in range(most):
        assert walk.best is not None
        x, seen = walk.best
        slopes, off = seen.slopes, seen.residuals
        assert slopes is not None and off is not None
        free = ~np.asarray(walk.held(x, seen), dtype=bool)
        scaled = slopes * unit * free
        matrix, right = scaled.T @ scaled, scaled.T @ off
        scale = np.maximum(np.diag(matrix), 1e-12 * max(float(np.max(np.diag(matrix), initial=0.0)), 1e-300))
        while damping < MOST_DAMPING:
            step = unit * free * np.linalg.solve(matrix + np.diag(damping * scale), -right)
            walk.look(np.clip(x + step, walk.low, walk.high))
            if walk.best[1] is not seen:
                damping = max(damping / 10, 1e-12)
                break
            damping *= 10
        else:
            return ""
        walk.step()
    return f"{most} steps are done and the value still falls"


def adam(walk: Minimization, start: Array, unit: Array, most: int) -> str:
    """Steps of Adam, each parameter in its own size, smaller and smaller. Why it ends."""
    x, mean, square = start, np.zeros_like(start), np.zeros_like(start)
    for number in range(1, most + 1):
        _, gradient = walk.look(x)
        mean = MEMORY_OF_SLOPES * mean + (1 - MEMORY_OF_SLOPES) * gradient * unit
        square = MEMORY_OF_SQUARES * square + (1 - MEMORY_OF_SQUARES) * (gradient * unit) ** 2
        slope = mean / (1 - MEMORY_OF_SLOPES**number)
        size = np.sqrt(square / (1 - MEMORY_OF_SQUARES**number))
        rate = RATE * (1 + math.cos(math.pi * (number - 1) / most)) / 2
        x = np.clip(x - rate * unit * slope / np.maximum(size, 1e-300), walk.low, walk.high)
        walk.step()
    return f"{most} steps are done"
