"""Derivatives for a person to read."""
