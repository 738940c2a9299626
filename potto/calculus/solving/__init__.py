"""Roots and inverses of conditions in closed form, and which ones can be searched for."""
