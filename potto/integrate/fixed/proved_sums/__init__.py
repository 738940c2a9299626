"""Sums over known cells with orders that were proved for a region of the parameters."""
