"""Machine code for kernels that work point by point. Needs llvmlite; without it numpy does everything."""
