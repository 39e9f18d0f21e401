"""Smoothed particle hydrodynamics: kernels of smoothing, pairs, weights, averages."""
