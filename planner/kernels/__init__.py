"""Numba kernels: contiguous float64 arrays in, arrays out; no classes, no options."""
