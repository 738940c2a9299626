"""What evaluates a program: the machine, functions as values, calls, sums, duals."""
