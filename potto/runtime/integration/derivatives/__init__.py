"""Derivatives of integrals beside the parameters: to either side, by differences, and of deltas on a rim."""
