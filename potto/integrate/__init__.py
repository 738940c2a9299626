"""Integration along surfaces: plans, cuts, pieces, estimates, and sampling in many dimensions."""
