"""Derivatives while a program runs: duals, second ones, and those to either side of a kink or beside the parameters."""
