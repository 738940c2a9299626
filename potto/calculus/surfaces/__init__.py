"""Where a term jumps or bends, and the sides that it takes there."""
