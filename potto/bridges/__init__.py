"""Functions of Potto as functions of JAX, PyTorch and scipy. Each is imported only when it is asked for."""
