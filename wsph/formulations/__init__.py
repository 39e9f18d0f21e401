"""Equations of motion of a body: systems, as integrators see them."""
