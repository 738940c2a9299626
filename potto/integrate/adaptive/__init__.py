"""Panels under refinement: iterated integration, estimates, budgets, and what has no value."""
