"""Shapes of bodies, one a file."""
