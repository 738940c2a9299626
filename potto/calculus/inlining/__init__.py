"""Calls carried out, and what can be told about them without doing so."""
