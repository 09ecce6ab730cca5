"""The compiled code: small Numba kernels, one step of one algorithm each."""
