"""Surfaces that meet: vertices of one against faces of another, and in 3D edges against edges."""
