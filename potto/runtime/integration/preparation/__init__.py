"""Integrals before they are integrated: made of numbers alone, taken apart, without what is known or adds nothing."""
