"""Evaluating programs: functions as values, calls, sums, integrals, duals; answers that carry their errors."""
