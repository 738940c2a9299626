"""Integrals settled without refinement: whole boxes, and sums whose orders were proved beforehand."""
