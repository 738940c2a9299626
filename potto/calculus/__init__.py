"""Calculus on core terms: derivatives, surfaces, inverses, and the boundary terms of integrals. No numbers.

Owns nothing itself. What a derivative is: `derivative` (smooth), `dual` (with boundaries), `explain` (in words).
Where a surface is: `solve` in one variable, `invert` in several, `surfaces` and `sweep` under an integral. Whether a
condition is one that can be integrated over: `diffeo`.
"""
