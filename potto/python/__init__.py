"""The interface to Python programs."""
