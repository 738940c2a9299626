"""Answers: estimates, whether they converged, what to do, and how they print."""
