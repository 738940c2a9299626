"""Sampling: the cube, replicates, and what crosses surfaces."""
