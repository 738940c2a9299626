"""Rules of integration: Gauss, changes of variable, Sobol, and enclosures that prove how many nodes are enough."""
