"""Interpolation as functions: points and times (or knots) in, a trajectory out."""
