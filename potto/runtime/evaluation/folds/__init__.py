"""Folds and reductions: states stepped one after the other, with their derivatives and errors for all steps at once."""
