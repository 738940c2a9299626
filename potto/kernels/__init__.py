"""Core terms to block kernels over numpy arrays, compiled one definition at a time and kept by content."""
