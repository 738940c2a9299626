"""Derivatives of terms: duals, boundary terms, deltas, higher orders."""
