"""Panels of a batch: nodes, values, estimates, and what rounding does to them."""
